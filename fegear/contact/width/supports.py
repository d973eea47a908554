"""Axes that yield under the forces of slices: shafts and bearings as a compliance.

The disc of a gear does not bend, and its axis at the middle of the face width moves by

    q = (u_d, u_n, u_z, u_d', u_n')

along the push d of the driver on the driven gear, along the normal n to it from the
driver's centre to the line of action, and along the axis z; primes are slopes over z. A
point at (a_d, a_n, z) from that middle moves by

    u_d + z u_d',    u_n + z u_n',    u_z - a_d u_d' - a_n u_n',

so that a force f there does the work p^T q with the load

    p = (f_d, f_n, f_z, z f_d - a_d f_z, z f_n - a_n f_z).

With the load p_i of a unit normal force at slice i and the compliance C of the axis,
p_j^T C p_i is what it adds to the compliance between slices: rank five a gear.
Components along d, n and z stay as they are in a mirror that has the axis in it. Where
it is known at which end torque enters, the disc twists, see
`fegear.contact.width.torsion`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fegear.contact.width.torsion import BodyTorsion
from lumped.common.array_types import Array
from meshes import SpurGear

MOTIONS = 5  # of an axis, but for its rotation


@dataclass(frozen=True, eq=False)
class GearSupport:
    """How the axis of a gear yields in the middle of its face width.

    compliance : C (5, 5) [m/N, 1/N and 1/(N m)]
    motion : q (5,) by loads of other meshes, over the torque on the driver of this one,
        to which they are proportional [1/N and 1/(N m)]
    torsion : of the body over its face width; None where it is rigid about the axis
    """

    compliance: Array
    motion: Array
    torsion: BodyTorsion | None = None


@dataclass(frozen=True, eq=False)
class AxisSupports:
    """Axes of driver and driven gear that yield."""

    driver: GearSupport
    driven: GearSupport

    @property
    def gears(self) -> tuple[GearSupport, GearSupport]:
        return self.driver, self.driven

    def compliance_between(self, loads: tuple[Array, Array]) -> Array:
        """Normal approach (p, p) of places by unit normal forces at others [m/N].

        loads : p (p, 5) on driver and driven gear, see `unit_wrenches`
        """
        both = zip(loads, self.gears, strict=True)
        return np.asarray(sum(p @ gear.compliance @ p.T for p, gear in both))

    def opened_by(self, loads: tuple[Array, Array], force: Array) -> Array:
        """Gap along the normal (p,) that normal forces (p,) open [m]."""
        both = zip(loads, self.gears, strict=True)
        return np.asarray(sum(p @ (gear.compliance @ (force @ p)) for p, gear in both))

    def gap(self, loads: tuple[Array, Array]) -> Array:
        """Gap along the normal that loads elsewhere open, over torque (p,) [1/N]."""
        both = zip(loads, self.gears, strict=True)
        return np.asarray(sum(p @ gear.motion for p, gear in both))

    @property
    def are_moved(self) -> bool:
        """Whether other meshes load the axes."""
        return any(gear.motion.any() for gear in self.gears)


def unit_wrenches(
    gears: tuple[SpurGear, SpurGear],
    base_helix_angle: float,
    arcs: Array,
    places: tuple[Array, Array],
) -> tuple[Array, Array]:
    """Loads p (p, 5) of unit normal forces on driver and driven gear.

    base_helix_angle : of the driver [rad]
    arcs : (p, 2) of the places on both flanks, from the tip corners [m]
    places : (p,) from the middle of either gear's face width [m]
    """
    driver, driven = (
        sign * _wrench_of_push(gear, sign, base_helix_angle, arcs[:, i], places[i])
        for i, (gear, sign) in enumerate(zip(gears, (-1.0, 1.0), strict=True))
    )
    return driver, driven


def _wrench_of_push(
    gear: SpurGear, sign: float, helix: float, arcs: Array, place: Array
) -> Array:
    """Load (p, 5) of unit forces in the sense of the driver's push on the driven gear.

    sign : -1 on the driver, 1 on the driven gear
    """
    along, axial = math.cos(helix), math.sin(helix)
    # a driver rolls out along the push, from where the line touches its base circle
    ahead, aside = -sign * roll_lengths(gear, arcs), -sign * gear.base_radius
    load = np.empty((place.size, MOTIONS))
    load[:, :3] = along, 0.0, axial
    load[:, 3] = along * place - axial * ahead
    load[:, 4] = -axial * aside
    return load


def roll_lengths(gear: SpurGear, arcs: Array) -> Array:
    """Roll lengths (p,) at arcs from the tip corner, of internal gears below 0 [m]."""
    squared = gear.tip_roll_length**2 - 2.0 * gear.base_radius * arcs
    return np.asarray(gear.sign * np.sqrt(np.maximum(squared, 0.0)))
