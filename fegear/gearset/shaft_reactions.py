"""Reactions of two bearings that carry a shaft under the forces of its gears' teeth.

The shaft is statically determinate: its bearings are hinges at their positions, one of
which takes the axial force; they have no tilt stiffness. Weight has no part in it, nor
have the pure torques that drive or brake the shaft. The first end of a shaft is the
near one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.gearset.model import GearSet
from fegear.gearset.tooth_forces import ForceOnGear
from lumped.common.short_repr import ShortRepr

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ShaftReactions(ShortRepr):
    """Forces of the bearings on a shaft at successive load cases.

    shaft : by index
    positions : of both bearings from the first end [m]
    radial : along x and y, of the first and of the second bearing (cases, 2, 2) [N]
    axial : positive toward the far end, by the bearing that locates the shaft [N]
    """

    shaft: int
    positions: tuple[float, float]
    radial: Array
    axial: Array


def shaft_reactions(
    gear_set: GearSet, forces: list[ForceOnGear]
) -> Iterator[ShaftReactions]:
    """Reactions of every shaft that has forces, and two hinges at two positions."""
    for number, shaft in enumerate(gear_set.shafts):
        body = shaft.body
        loads = [force for force in forces if force.gear in shaft.gears]
        if body is None or not loads or len(body.bearings) != 2:
            continue
        if body.mounted_bearings or any(b.tilt_stiffness for b in body.bearings):
            continue
        near, far = sorted(bearing.position for bearing in body.bearings)
        if not near < far:
            continue
        position_of = dict(zip(shaft.gears, body.gear_positions, strict=True))
        points = [_point(gear_set, load, position_of[load.gear]) for load in loads]
        vectors = np.stack([load.vectors for load in loads], axis=1)
        radial, axial = reactions_of_two_bearings(
            (near, far), np.array(points), vectors
        )
        yield ShaftReactions(
            shaft=number, positions=(near, far), radial=radial, axial=axial
        )


def _point(
    gear_set: GearSet, load: ForceOnGear, position: float
) -> tuple[float, float, float]:
    """Point of a force on the shaft: x, y, and distance from the first end [m]."""
    middles = gear_set.width_middles(load.mesh)
    return *load.arm, position + middles[0 if load.role == "driver" else 1]


def reactions_of_two_bearings(
    positions: tuple[float, float], points: Array, forces: Array
) -> tuple[Array, Array]:
    """Forces of two bearings that balance forces on a shaft along the third axis.

    Parameters
    ----------
    positions : tuple of float
        Of both bearings along the shaft [m].
    points : (n, 3) array
        Where the forces act: across the shaft, from its axis, and along it [m].
    forces : (cases, n, 3) array
        Forces at these points in each case [N].

    Returns
    -------
    radial : (cases, 2, 2) array
        Of each bearing, both components across the shaft [N].
    axial : (cases,) array
        Along the shaft, of one bearing or both together [N].
    """
    across, along = forces[..., :2], forces[..., 2:]
    # moments about the first bearing, in both planes through the axis
    moments = (points[:, 2:] - positions[0]) * across - points[:, :2] * along
    second = -moments.sum(axis=1) / (positions[1] - positions[0])
    first = -across.sum(axis=1) - second
    return np.stack([first, second], axis=1), -along[..., 0].sum(axis=1)
