"""Axial forces of helical gears under static torques, without friction.

The force between teeth is normal to their helix. Seen from the near end the driver of
the first mesh turns counter-clockwise. A right-handed driver that does so is pushed
toward the near end; the other hand, the other sense of rotation, and to be driven each
reverse the force.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, kw_only=True)
class AxialForce(ShortRepr):
    """Axial force on a gear in a mesh, or on an axis that has several.

    gears : by index; one in a mesh
    mesh : index, None for the sum over all meshes of the gears
    forces : at successive torques, positive toward the far end [N]
    """

    gears: tuple[int, ...]
    mesh: int | None
    forces: tuple[float, ...]


def axial_force_on_driver(gear_set: GearSet, mesh: int, torque: float) -> float:
    """Positive toward the far end [N]; the driven gear has the opposite one.

    torque : on the driver of the mesh [N m]
    """
    spec = gear_set.meshes[mesh]
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


def axial_forces(gear_set: GearSet) -> Iterator[AxialForce]:
    """Forces of the load cases: on both gears of every mesh of helical gears, then the
    sum on each axis with several meshes.
    """
    of_axes: dict[tuple[int, ...], list[tuple[float, ...]]] = {}
    for number, mesh in enumerate(gear_set.meshes):
        if not (mesh.is_helical and mesh.torques):
            continue
        for gear, sign in zip(mesh.gears, (1.0, -1.0), strict=True):
            forces = tuple(
                sign * axial_force_on_driver(gear_set, number, torque)
                for torque in mesh.torques
            )
            yield AxialForce(gears=(gear,), mesh=number, forces=forces)
            of_axes.setdefault(tuple(sorted(gear_set.axis(gear))), []).append(forces)
    for axis, parts in of_axes.items():
        if len(parts) > 1:
            sums = tuple(map(sum, zip(*parts, strict=False)))
            yield AxialForce(gears=axis, mesh=None, forces=sums)


def axial_force_text(force: float) -> str:
    """The signed force with its sense in words; round-off is no force."""
    if abs(force) < 1e-9:
        return "0 N"
    return f"{force:+.5g} N, toward the {'far' if force > 0.0 else 'near'} end"
