"""Wear over profile and face width, where loads vary over the width.

Archard's law holds at every place along the width as it does in a section: across the
line of contact the pressure adds up to its load per length w, and at a given place the
contact passes with the speed of the section. The depth along the line of action is

    h = k F' |1 - u_mate / u|,  F' = w / cos(beta_b)

with the normal force per face width F', since the normal is inclined to the section by
the base helix angle beta_b. Worn flanks are topographies: depths over roll length and
place, which the contact of the next step has.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fegear.commands.wear.archard import LoadedFlanks, PathPoints, WearingMesh
from fegear.contact.path import on_path
from fegear.contact.problem import ContactFlank
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.files.errors import InputError
from fegear.gearset.modifications import MAX_TOPOGRAPHY_POINTS, FlankTopography
from lumped.common.array_types import Array


def require_few_points(points: PathPoints, positions: int, slices: int) -> None:
    """Raise InputError where a topography cannot have as many points."""
    if points.position.size > MAX_TOPOGRAPHY_POINTS:
        raise InputError(
            f"positions = {positions}; makes {points.position.size} points of a "
            f"profile, allowed over the face width are {MAX_TOPOGRAPHY_POINTS}"
        )
    if slices > MAX_TOPOGRAPHY_POINTS:
        raise InputError(
            f"{slices} slices of the face width; wear takes at most "
            f"{MAX_TOPOGRAPHY_POINTS}, as topographies have; a narrower face width or "
            "a coarser resolution needs fewer"
        )


@dataclass(frozen=True, eq=False)
class LoadedFaces(LoadedFlanks):
    """Contact of a mesh whose loads vary over the width.

    line_load : (p, m) normal force per face width when the contact passes the points,
        at the middles of slices [N/m]
    per_width : (m,) of all pairs, mean over the cycle [N/m]
    distribution_factor : K_Hbeta of the mean over the cycle
    """

    per_width: Array
    distribution_factor: float


@dataclass(frozen=True, eq=False)
class WearingFaces(WearingMesh):
    """A mesh whose flanks wear over profile and face width.

    Depths are (2, p, m) at points of the path and middles of slices.
    """

    @cached_property
    def solver(self) -> WidthContact:
        solver = self.contact.solver
        if not isinstance(solver, WidthContact):
            raise TypeError("loads are uniform over the face width")
        return solver

    @property
    def places(self) -> Array:
        """Middles (m,) of slices from the middle of the common face width [m]."""
        return self.solver.places

    @property
    def unworn(self) -> Array:
        return np.zeros((*self.roll_angles.shape, self.solver.slices))

    def topographies(self, depth: Array) -> tuple[FlankTopography, FlankTopography]:
        """Topographies of both flanks with depths (2, p, m) of wear [m].

        Those that the flanks have are among them.
        """
        driver, driven = (
            self._with_wear(flank.topography, self._topography(gear, depth[gear]))
            for gear, flank in enumerate(self.contact.flanks)
        )
        return driver, driven

    def _topography(self, gear: int, depth: Array) -> FlankTopography:
        rolls, order = self.roll_lengths[gear], np.argsort(self.roll_lengths[gear])
        places = self.places + self.solver.offsets[gear]
        return FlankTopography(
            roll_lengths=tuple(rolls[order].tolist()),
            places=tuple(places.tolist()),
            depths=tuple(map(tuple, depth[order].tolist())),
        )

    @staticmethod
    def _with_wear(
        topography: FlankTopography | None, wear: FlankTopography
    ) -> FlankTopography:
        """The sum of two, at the points of both."""
        if topography is None:
            return wear
        rolls = np.union1d(topography.roll_lengths, wear.roll_lengths)
        places = np.union1d(topography.places, wear.places)
        every = [points.ravel() for points in np.meshgrid(rolls, places, indexing="ij")]
        depths = topography.depth(*every) + wear.depth(*every)
        return FlankTopography(
            roll_lengths=tuple(rolls.tolist()),
            places=tuple(places.tolist()),
            depths=tuple(map(tuple, depths.reshape(rolls.size, -1).tolist())),
        )

    def load(self, depth: Array) -> LoadedFaces:
        """Solve the contact with depths (2, p, m) of wear [m]."""

        def worn(flank: ContactFlank, topography: FlankTopography) -> ContactFlank:
            return replace(flank, topography=topography)

        driver, driven = map(worn, self.contact.flanks, self.topographies(depth))
        contact = replace(self.contact, driver=driver, driven=driven)
        cycle = solve_cycle(contact, self.torque, self.points.places)
        regular = self.points.is_regular
        return LoadedFaces(
            line_load=self._line_loads(cycle),
            position=cycle.position[regular],
            ste=cycle.ste[0, regular],
            stiffness=cycle.stiffness[0, regular],
            deflection=float((cycle.ste - cycle.no_load)[0, regular].mean()),
            corner_work=self._corner_work(cycle),
            shift=0.0,  # a topography moves no point of contact
            per_width=cycle.face.per_width[0, regular].mean(axis=0),
            distribution_factor=float(cycle.face.distribution_factor[0]),
        )

    def _line_loads(self, cycle: ContactCycle) -> Array:
        """See `LoadedFaces`; linear between positions at which a slice was solved."""
        face, points = cycle.face, self.points
        load = face.load[0] / math.cos(face.base_helix_angle)
        inside = on_path(self.pair, face.path_position)
        line_load = np.empty((points.position.size, face.place.size))
        for m in range(face.place.size):
            passed = face.path_position[..., m][inside[..., m]]
            order = np.argsort(passed)
            values = load[..., m][inside[..., m]][order]
            line_load[:, m] = np.interp(points.position, passed[order], values)
        return line_load

    def _corner_work(self, cycle: ContactCycle) -> float:
        face, regular = cycle.face, self.points.is_regular
        position = face.path_position[regular]
        work = face.load[0, regular] * np.abs(position)
        inside = work[on_path(self.pair, position)].sum()
        return float(1.0 - inside / work.sum())
