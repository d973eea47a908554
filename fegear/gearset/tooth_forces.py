"""Forces between teeth under static torques, without friction, and their sums on axes.

The force of a mesh acts at its pitch point, in the middle of the common face width.
With torque T and operating pitch radius r_w of a gear, operating pressure angle
alpha_wt and helix angle beta on the reference circle of radius r

    F_t = T / r_w,    F_r = F_t tan(alpha_wt),    F_a = T tan(beta) / r.

Seen from the near end x points to the right and y up, and the driver of the first mesh
turns counter-clockwise. Axial forces are positive toward the far end.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fegear.gearset.axial_forces import axial_force_on_driver
from fegear.gearset.model import GearSet
from fegear.gearset.placing import layout
from fegear.gearset.power_path import mesh_torques_at
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, kw_only=True)
class ForceOnGear(ShortRepr):
    """Force on one gear of a mesh at the successive torques of the mesh.

    mesh, gear : by index
    tangential, radial : magnitudes [N]
    axial : positive toward the far end [N]
    tangential_direction, radial_direction : counter-clockwise from x [rad]
    arm : of the pitch point from the axis, along x and y [m]
    """

    mesh: int
    gear: int
    role: Literal["driver", "driven"]
    tangential: tuple[float, ...]
    radial: tuple[float, ...]
    axial: tuple[float, ...]
    tangential_direction: float
    radial_direction: float
    arm: tuple[float, float]

    @property
    def vectors(self) -> NDArray[np.float64]:
        """Force along x, along y and toward the far end (torques, 3) [N]."""
        tangential, radial = np.array(self.tangential), np.array(self.radial)
        directions = self.tangential_direction, self.radial_direction
        (ct, st), (cr, sr) = ((math.cos(a), math.sin(a)) for a in directions)
        plane = tangential * ct + radial * cr, tangential * st + radial * sr
        return np.stack([*plane, np.array(self.axial)], axis=-1)


@dataclass(frozen=True, kw_only=True)
class AxisForce(ShortRepr):
    """Sum of the forces of several meshes on the gears of an axis.

    gears : on the axis, by index
    vectors : along x, along y and toward the far end, at each load case [N]
    moments : by which they tilt the far end of a gear toward x and toward y, about
        the middle of its width, at each load case [N m]; none of several gears, whose
        places on the axis count
    """

    gears: tuple[int, ...]
    vectors: tuple[tuple[float, float, float], ...]
    moments: tuple[tuple[float, float], ...] = ()

    @property
    def axial(self) -> tuple[float, ...]:
        """Toward the far end at each load case [N]."""
        return tuple(vector[2] for vector in self.vectors)


def tooth_forces(gear_set: GearSet) -> list[ForceOnGear]:
    """Forces of the load cases on driver and driven gear of every mesh in order."""
    if not any(mesh.torques for mesh in gear_set.meshes):
        return []
    directions = layout(gear_set).directions
    return [
        force
        for number, mesh in enumerate(gear_set.meshes)
        if mesh.torques
        for force in _forces_of_mesh(gear_set, number, directions[number])
    ]


def _forces_of_mesh(
    gear_set: GearSet, number: int, center_line: float
) -> Iterator[ForceOnGear]:
    """Both forces of a mesh; center_line : from driver to driven gear [rad]."""
    mesh = gear_set.meshes[number]
    pair = mesh.pair
    teeth = [gear.sign * gear.teeth for gear in (pair.driver, pair.driven)]
    # from the driver's axis to the pitch point along the line of centres; below 0 where
    # a ring around the driver has its axis on the other side
    reach = pair.center_distance * teeth[0] / sum(teeth)
    reaches = reach, reach - pair.center_distance
    slope = math.tan(pair.operating_pressure_angle)
    tangential = tuple(torque / abs(reach) for torque in mesh.torques)
    axial = tuple(
        axial_force_on_driver(gear_set, number, torque) for torque in mesh.torques
    )
    # the driver moves its teeth at the pitch point that way
    motion = gear_set.senses[mesh.driver] * math.copysign(1.0, reach)
    roles: tuple[tuple[Literal["driver", "driven"], float], ...] = (
        ("driver", -1.0),
        ("driven", 1.0),
    )
    for place, (role, sign) in enumerate(roles):
        arm = reaches[place]
        # toward the axis, of an internal gear away from it
        inward = -math.copysign(1.0, arm * teeth[place])
        yield ForceOnGear(
            mesh=number,
            gear=mesh.gears[place],
            role=role,
            tangential=tangential,
            radial=tuple(slope * force for force in tangential),
            axial=tuple(-sign * force + 0.0 for force in axial),
            tangential_direction=_wrapped(center_line + 0.5 * math.pi * sign * motion),
            radial_direction=_wrapped(center_line + (math.pi if inward < 0 else 0.0)),
            arm=(arm * math.cos(center_line), arm * math.sin(center_line)),
        )


def _wrapped(angle: float) -> float:
    """The angle from 0 to below a whole turn [rad]."""
    return angle % (2.0 * math.pi)


def loads_on_gears(
    gear_set: GearSet, torque: float, has_thrust: bool = True
) -> NDArray[np.float64]:
    """Sums of the forces (g, 5) on all gears in the middle of their widths.

    They are along x, along y and toward the far end [N], and the moments that tilt the
    far end toward x and toward y [N m].

    torque : on the input gear [N m]
    has_thrust : whether helical gears push along the axis
    """
    meshes = tuple(
        replace(mesh, torques=(one,))
        for mesh, one in zip(
            gear_set.meshes, mesh_torques_at(gear_set, torque), strict=True
        )
    )
    loads = np.zeros((len(gear_set.gears), 5))
    for force in tooth_forces(replace(gear_set, meshes=meshes)):
        if not has_thrust:
            force = replace(force, axial=(0.0,))
        tilting = _tilting_moments(gear_set, force)
        loads[force.gear] += np.concatenate([force.vectors[0], tilting[0]])
    return loads


def axis_forces(gear_set: GearSet, forces: list[ForceOnGear]) -> Iterator[AxisForce]:
    """Sums on all axes on which several meshes exert forces, in order of gears."""
    of_axes: dict[tuple[int, ...], list[ForceOnGear]] = {}
    for force in forces:
        axis = tuple(sorted(gear_set.axis(force.gear)))
        of_axes.setdefault(axis, []).append(force)
    for axis, parts in sorted(of_axes.items()):
        if len(parts) > 1:
            rows = np.sum([part.vectors for part in parts], axis=0).tolist()
            tilting = [_tilting_moments(gear_set, part) for part in parts]
            moments = np.sum(tilting, axis=0).tolist() if len(axis) == 1 else []
            yield AxisForce(
                gears=axis,
                vectors=tuple((x, y, z) for x, y, z in rows),
                moments=tuple((x, y) for x, y in moments),
            )


def _tilting_moments(gear_set: GearSet, force: ForceOnGear) -> NDArray[np.float64]:
    """Moments (torques, 2) that tilt the far end toward x and y [N m]."""
    middle = gear_set.width_middles(force.mesh)[0 if force.role == "driver" else 1]
    across, along = force.vectors[:, :2], force.vectors[:, 2:]
    return np.asarray(middle * across - np.array(force.arm) * along)
