"""Mean stiffness of meshes, by finite elements or as given."""

from __future__ import annotations

from typing import Any

from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.unmodified import unmodified
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.settings import (
    SettingsGroup,
    display_name,
    expose,
    refusal,
    refuse_non_default,
)
from fegear.studies.trains.loads import chosen_torque

FE_SETTINGS = SettingsGroup(
    kind=ExcitationSettings, exposed=expose("plane", "resolution")
)


def require_stiffness_edits(study: Any) -> None:
    """Refuse a change of a given mean stiffness that a study does not read."""
    for key in study.gear_set.overrides:
        if key.endswith("mean_stiffness_N_per_m") and study.stiffness != "given":
            name = display_name(study, "stiffness")
            reason = f"finite elements take its place, choose {name} given"
            raise study.gear_set.rejection(key, reason)


def stiffness_load(study: Any, gears: GearSet, is_loaded: bool = False) -> float | None:
    """Torque on the input gear [N m] of mean stiffnesses, None where all are given.

    study : with the settings torque, stiffness and source, which are refused where
        they would change nothing
    is_loaded : whether something else depends on the torque
    """
    if study.stiffness != "given" or not all(m.mean_stiffness for m in gears.meshes):
        return chosen_torque(gears, study.torque)
    if study.torque is not None and not is_loaded:
        reason = f"{gears.name} gives all mean stiffnesses, use "
        raise refusal(study, "torque", reason + "{stiffness} fe")
    reason = "the gear set gives all stiffness parameters, nothing is solved"
    refuse_non_default(study.excitation, [*FE_SETTINGS.exposed], reason, FE_SETTINGS)
    return chosen_torque(gears, study.torque) if is_loaded else None


def mean_stiffnesses(
    gear_set: GearSet,
    torque: float,
    source: ExcitationSettings,
    has_given_stiffness: bool,
) -> list[tuple[float, str]]:
    """Mean stiffness of every mesh [N/m], and where it comes from."""
    excitations, stiffnesses = Excitations(source), []
    for mesh, driver_torque in enumerate(mesh_torques_at(gear_set, torque)):
        nominal = gear_set.meshes[mesh].mean_stiffness
        origin = (
            f"finite elements at {driver_torque:g} N m on the driver, without relief"
        )
        if nominal is not None and has_given_stiffness:
            value, origin = nominal, "given by the gear set"
        else:
            table = excitations.table(unmodified(gear_set, mesh), mesh, driver_torque)
            value = float(table["stiffness_N_per_m"].mean())
        stiffnesses.append((value, origin))
    return stiffnesses
