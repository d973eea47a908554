"""Position errors of planets as gaps of the meshes of a gear set."""

from __future__ import annotations

from fegear.gearset.model import GearSet
from fegear.gearset.power_path import external_torques
from lumped.common.array_types import Array
from lumped.train.position_errors import position_gaps as gaps_of_train
from lumped.train.train import Train


def position_gaps(gear_set: GearSet, train: Train) -> Array:
    """Gap of every mesh (m,) [m], positive where it opens the drive side."""
    carrier = gear_set.carrier
    errors = carrier.position_errors if carrier else ()
    sense = carrier_sense(gear_set) if errors else 1
    return gaps_of_train(train, [sense * error for error in errors])


def carrier_sense(gear_set: GearSet) -> int:
    """Sense of the carrier's rotation, 1 if counter-clockwise.

    That of the input where the carrier is held. The torque on the input acts in its
    sense of rotation, that on the output against its own.
    """
    carrier = gear_set.carrier
    if carrier is None:
        raise ValueError(f"carrier must not be None, {gear_set.name} has none")
    torques, members = external_torques(gear_set, 1.0), carrier.members
    if members.output == "carrier":
        return -1 if torques[-1] > 0.0 else 1
    gear = carrier.gear_of(members.input)
    torque = torques[-1 if gear is None else gear]
    return 1 if torque > 0.0 else -1
