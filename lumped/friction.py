"""Sliding friction of teeth: what it adds to the force of a tooth pair.

A pair that is x ahead of the pitch point along the line of action carries a normal
force N and a friction force mu N across it. Before the pitch point, in approach, the
driven flank slides faster and draws the driver's on; beyond it, in recess, the other
way round. Loads on the coordinates are -N (a - mu sgn b), with a the mesh's row of
`Coordinates`, sgn = 1 in approach and -1 in recess, and b = b_0 + x b_1 the row of
friction: moments about both gears' axes with arms l_1 = r_1 tan(phi) + x and
l_2 = r_2 tan(phi) - x, and forces off the line of action.

This is eq. 4.40 and 4.44 of the multi-mesh source but for a sign: with eq. 4.40 the
normal force grows in approach, with the matrix L of eq. 4.44 as printed it falls.
Only the first lets friction take energy away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.coordinates import Coordinates, line_of_action
from lumped.excitation import MeshExcitation
from lumped.train import Train

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ToothFriction:
    """Coulomb friction of a mesh, by the nominal direction of sliding.

    coefficient : mu
    bending : friction-bending ratio, deflection by a friction force over that by a
        normal force of the same size; pairs are stiffer by `bending` mu in approach
        and softer in recess, eq. 4.42
    """

    coefficient: float
    bending: float = 0.0

    def __post_init__(self) -> None:
        for name in ("coefficient", "bending"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise ValueError(f"{name} must be from 0 to below 1, got {value:g}")


def with_bending(excitation: MeshExcitation, friction: ToothFriction) -> MeshExcitation:
    """Tooth pairs as friction bends them, with a corner at the pitch point.

    Raises ValueError where the excitation is not made of tooth pairs.
    """
    if not friction.coefficient:
        return excitation
    pairs = []
    for pair in excitation.pairs:
        if pair.ahead is None:
            raise ValueError(
                "friction needs the stiffness of every tooth pair, that of model 1; "
                "the excitation is one spring for the whole mesh"
            )
        change = side_of(pair.ahead) * friction.bending * friction.coefficient
        wave = pair.stiffness.scaled(1.0 + change)
        if pair.ahead == 0:  # it has come from approach to recess
            wave = replace(wave, corners=tuple(sorted({0.0, *wave.corners})))
        pairs.append(replace(pair, stiffness=wave))
    return replace(excitation, pairs=tuple(pairs))


def side_of(ahead: int) -> int:
    """1 in approach, -1 in recess, of a pair by whole base pitches ahead."""
    return 1 if ahead < 0 else -1


def base_pitch(train: Train, mesh: int) -> float:
    """Of a mesh, by its driver [m]."""
    driver = train.gears[train.meshes[mesh].driver]
    return 2.0 * math.pi * driver.base_radius / driver.teeth


class FrictionRows(NamedTuple):
    """What a friction force does to coordinates, or modes, of every mesh (m, n).

    at_pitch : b_0, at the pitch point; per_metre : b_1, per metre ahead of it
    """

    at_pitch: Array
    per_metre: Array

    def of_shapes(self, shapes: Array) -> FrictionRows:
        """On modes of shapes (n, k)."""
        return FrictionRows(*(row @ shapes for row in self))


def friction_rows(train: Train, space: Coordinates) -> FrictionRows:
    """On the coordinates."""
    shape = len(train.meshes), space.mass.size
    at_pitch, per_metre = np.zeros(shape), np.zeros(shape)
    for m, mesh in enumerate(train.meshes):
        sense, slope = train.sense(mesh.driver), math.tan(mesh.pressure_angle)
        along = line_of_action(train, mesh)
        # the way of the driver's flank at the contact
        across = {"x": -sense * along[1], "y": sense * along[0]}
        for gear, side in ((mesh.driver, 1.0), (mesh.driven, -1.0)):
            place = space.places[gear, "rotation"]
            at_pitch[m, place] += sense * train.gears[gear].base_radius * slope
            per_metre[m, place] += sense * side
            for axis, cosine in across.items():
                if (gear, axis) in space.places:
                    at_pitch[m, space.places[gear, axis]] += side * cosine
    return FrictionRows(at_pitch, per_metre)
