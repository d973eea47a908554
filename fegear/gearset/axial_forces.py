"""Axial forces of helical gears under static torques, without friction.

The force between teeth is normal to their helix. Seen from the near end the driver of
the first mesh turns counter-clockwise. A right-handed driver that does so is pushed
toward the near end; the other hand, the other sense of rotation, and to be driven each
reverse the force.
"""

from __future__ import annotations

from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at


def axial_force_on_driver(gear_set: GearSet, mesh: int, torque: float) -> float:
    """Positive toward the far end [N]; the driven gear has the opposite one.

    Those of the halves of double helical gears cancel.

    torque : on the driver of the mesh [N m]
    """
    spec = gear_set.meshes[mesh]
    if gear_set.common_groove(mesh):
        return 0.0
    return -gear_set.senses[spec.driver] * torque * spec.pair.driver.twist + 0.0


def shaft_axial_force(gear_set: GearSet, gear: int, torque: float) -> float:
    """Sum on a gear and those on its axis, positive toward the far end [N].

    torque : on the input gear [N m]
    """
    axis, torques = gear_set.axis(gear), mesh_torques_at(gear_set, torque)
    total = 0.0
    for number, mesh in enumerate(gear_set.meshes):
        force = axial_force_on_driver(gear_set, number, torques[number])
        total += force * ((mesh.driver in axis) - (mesh.driven in axis))
    return total


def axial_force_text(force: float) -> str:
    """The signed force with its sense in words; round-off is no force."""
    if abs(force) < 1e-9:
        return "0 N"
    return f"{force:+.5g} N, toward the {'far' if force > 0.0 else 'near'} end"
