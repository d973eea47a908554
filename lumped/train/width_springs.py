"""A mesh of gears that move in space: loads of its teeth as springs over the width.

With gears that are rigid the flanks approach each other by s + x t at a place x along
the axis. At every position of a mesh cycle, statics give the force F and its moment M
about x = 0 under the working load, at an approach (s, t), and their slopes

    k = dF/ds,    k c = dF/dt = dM/ds,    k (c^2 + r^2) = dM/dt.

Three springs of stiffness k/6, 2k/3 and k/6, at c and sqrt(3) r before and after it,
have the same slopes, and their gaps are such that they carry F and M. A line of contact
of even stiffness that lifts at one end does so where an outer spring does. Springs push
only: as far as M takes the center of load beyond the place where an outer spring is
unloaded, the other two carry the load.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.rotors.description import MeshSpring
from lumped.rotors.mesh_springs import approach_of_motions
from lumped.train.bodies import TrainError
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.waves import wave_from_samples

PARTS = np.array([1.0, 4.0, 1.0]) / 6.0  # of the stiffness, of the springs
PLACES = np.array([-1.0, 0.0, 1.0])  # over sqrt(3) r
MEAN_POINTS = 256  # of a mesh cycle
MIN_SPREAD = 1e-3  # sqrt(3) r over its mean, where one point carries the load
ONE_PLACE = 1e-6  # sqrt(3) r where it does at all positions [m]


@dataclass(frozen=True, eq=False)
class WidthLaw(ShortRepr):
    """Loads of a mesh at n equally spaced positions of its cycle, about a middle.

    rows : approach s and slope t of its growth by rigid motions of both gears (2, 11),
        see `lumped.rotors.description.MeshSpring`
    approach : (n, 2) [m and rad]
    loads : F and M (n, 2) [N and N m]
    slopes : of F over s, of F over t, and of M over t (n, 3) [N/m, N and N m]
    """

    rows: Array
    approach: Array
    loads: Array
    slopes: Array

    @property
    def stiffness(self) -> float:
        """Mean stiffness of the approach in the middle [N/m]."""
        return float(self.slopes[:, 0].mean())

    @property
    def tilt_stiffness(self) -> float:
        """Mean moment over slope [N m/rad]."""
        return float(self.slopes[:, 2].mean())

    def about(self, place: float) -> WidthLaw:
        """Law about another middle [m], with the same loads."""
        s, t = self.approach.T
        force, moment = self.loads.T
        k, mixed, tilting = self.slopes.T
        return WidthLaw(
            rows=np.stack([self.rows[0] + place * self.rows[1], self.rows[1]]),
            approach=np.column_stack([s + place * t, t]),
            loads=np.column_stack([force, moment - place * force]),
            slopes=np.column_stack(
                [k, mixed - place * k, tilting - 2.0 * place * mixed + place**2 * k]
            ),
        )

    @cached_property
    def center(self) -> Array:
        """Center of stiffness c (n,) [m]."""
        return np.asarray(self.slopes[:, 1] / self.slopes[:, 0])

    @cached_property
    def spread(self) -> Array:
        """Distance (n,) of the outer springs from the center of stiffness [m]."""
        squares = 3.0 * (self.slopes[:, 2] / self.slopes[:, 0] - self.center**2)
        least = MIN_SPREAD * math.sqrt(max(float(squares.mean()), 0.0))
        return np.sqrt(np.maximum(squares, max(least, ONE_PLACE) ** 2))

    @cached_property
    def shares(self) -> Array:
        """Part (n, 3) of the force that each spring carries."""
        force, moment = self.loads.T
        place = np.clip((moment / force - self.center) / self.spread, -1.0, 1.0)
        shares = PARTS * (1.0 + 3.0 * place[:, None] * PLACES)
        lifted = np.abs(place) > 1.0 / 3.0
        shares[lifted, 1] = 1.0 - np.abs(place[lifted])
        shares[lifted, 0] = np.maximum(-place[lifted], 0.0)
        shares[lifted, 2] = np.maximum(place[lifted], 0.0)
        return shares

    @property
    def moment_left_out(self) -> float:
        """Largest moment that the springs do not carry, over the force [m]."""
        carried = self.center + self.spread * (self.shares @ PLACES)
        return float(np.abs(self.loads[:, 1] / self.loads[:, 0] - carried).max())

    @property
    def excitation(self) -> MeshExcitation:
        """The three springs over the mesh cycle."""
        stiffness = PARTS * self.slopes[:, :1]
        place = self.center[:, None] + self.spread[:, None] * PLACES
        deflection = self.approach[:, :1] + self.approach[:, 1:] * place
        gap = deflection - self.shares * self.loads[:, :1] / stiffness
        return MeshExcitation(
            tuple(
                PairExcitation(
                    wave_from_samples(stiffness[:, i]),
                    wave_from_samples(gap[:, i]),
                    place=wave_from_samples(place[:, i]),
                )
                for i in range(PLACES.size)
            ),
            self.stiffness,
        )


def width_law(
    mesh: MeshSpring, motions: Array, loads: Array, stiffness: Array
) -> WidthLaw:
    """Loads of a mesh about its mean center of stiffness.

    mesh : where its gears are, with helix and path of contact
    motions, loads : rigid motions (n, 11) of both gears, and the loads that belong to
        them, of which the components beside approach and slope are left out
    stiffness : slopes (n, 11, 11) of these loads

    Raises TrainError where teeth do not resist their approach.
    """
    if not (np.isfinite(stiffness[:, 0, 0]) & (stiffness[:, 0, 0] > 0.0)).all():
        position = int(np.argmin(stiffness[:, 0, 0])) / len(stiffness)
        raise TrainError(
            f"teeth at rest have no stiffness against approach at position "
            f"{position:g}; shafts or bearings may be too soft"
        )
    rows = approach_of_motions(mesh)
    middle, tilt = rows
    norm = float(tilt @ tilt)
    force = loads[:, 0]
    k = stiffness[:, 0, 0]
    mixed = (stiffness[:, 0] - k[:, None] * middle) @ tilt / norm
    tilting = (stiffness @ tilt) @ tilt / norm**2
    ahead = float(middle @ tilt) / norm
    tilting -= k * ahead**2 + 2.0 * mixed * ahead
    tilting = np.maximum(tilting, mixed**2 / k)  # but for round-off it is
    law = WidthLaw(
        rows=rows,
        approach=motions @ rows.T,
        loads=np.column_stack([force, (loads - force[:, None] * middle) @ tilt / norm]),
        slopes=np.column_stack([k, mixed, tilting]),
    )
    return law.about(float(mixed.mean() / k.mean()))


def mean_loads_of_gaps(excitation: MeshExcitation) -> tuple[float, float]:
    """Mean force and moment by which gaps relieve springs that are pressed together.

    With the mean stiffness they have F = k s less this force, M = kappa t less this
    moment, at approaches s and t that do not vary.
    """
    at = np.arange(MEAN_POINTS) / MEAN_POINTS
    force, moment = 0.0, 0.0
    for pair in excitation.pairs:
        if pair.place is not None:
            relieved = pair.stiffness(at) * pair.gap(at)
            force += float(relieved.mean())
            moment += float((pair.place(at) * relieved).mean())
    return force, moment


def with_mean_matrix(mesh: MeshSpring, law: WidthLaw) -> MeshSpring:
    """The mesh with the mean stiffness of its law."""
    middle, tilt = law.rows
    matrix = law.stiffness * np.outer(middle, middle)
    matrix += law.tilt_stiffness * np.outer(tilt, tilt)
    return replace(mesh, matrix=tuple(map(tuple, matrix.tolist())))
