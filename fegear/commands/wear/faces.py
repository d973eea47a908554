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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fegear.commands.wear.archard import (
    LoadedFlanks,
    PathPoints,
    WearingMesh,
    WornFlanks,
)
from fegear.contact.path import on_path, roll_angles
from fegear.contact.problem import ContactFlank
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact, slice_places
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.modifications import MAX_TOPOGRAPHY_POINTS, FlankTopography
from lumped.common.array_types import Array

SAME_POINT = 1e-6  # of a flank, within which points of topographies are one


def require_few_points(
    gear_set: GearSet, mesh: int, points: PathPoints, slices: int
) -> None:
    """Raise InputError where a topography cannot have the points of worn flanks.

    points : of the path; topographies that flanks have add theirs
    """
    spec = gear_set.meshes[mesh]
    places = slice_places(gear_set.common_width(mesh), slices)
    for index, flank, angles, middle in zip(
        spec.gears,
        spec.flanks,
        roll_angles(spec.pair, points.position),
        gear_set.width_middles(mesh),
        strict=True,
    ):
        gear = gear_set.gears[index]
        rolls, along = np.sort(angles * gear.geometry.base_radius), places + middle
        if flank.topography is not None:
            rolls = merged_points(flank.topography.roll_lengths, rolls)
            along = merged_points(flank.topography.places, along)
        for count, text in (
            (rolls.size, "points of a profile; fewer positions are needed"),
            (
                along.size,
                "places over the face width; a coarser resolution or a narrower face "
                "width is needed",
            ),
        ):
            if count > MAX_TOPOGRAPHY_POINTS:
                raise InputError(
                    f'gear "{gear.name}": wear makes a topography of {count} {text}, '
                    f"allowed are {MAX_TOPOGRAPHY_POINTS}"
                )


def merged_points(points: Sequence[float], more: Array) -> Array:
    """Points, increasing, and more of them but for those that are there already."""
    present = np.array(points)
    distance = np.abs(more[:, None] - present).min(axis=1)
    new = more[distance > SAME_POINT * np.ptp(present)]
    return np.union1d(present, new)


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

    @property
    def key_figures(self) -> dict[str, float]:
        factor = {"load_distribution_factor": self.distribution_factor}
        return super().key_figures | factor


def loads_over_width(worn: WornFlanks) -> tuple[LoadedFaces, LoadedFaces]:
    """Contact before and after wear that varies over the width."""
    first, last = worn.first, worn.last
    if not (isinstance(first, LoadedFaces) and isinstance(last, LoadedFaces)):
        raise TypeError("loads are uniform over the face width")
    return first, last


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
        """Middles (2, m) of slices from the middle of driver and driven gear [m]."""
        return self.solver.places + np.array(self.solver.offsets)[:, None]

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
        return FlankTopography(
            roll_lengths=tuple(rolls[order].tolist()),
            places=tuple(self.places[gear].tolist()),
            depths=tuple(map(tuple, depth[order].tolist())),
        )

    @staticmethod
    def _with_wear(
        topography: FlankTopography | None, wear: FlankTopography
    ) -> FlankTopography:
        """The sum of two, at the points of both."""
        if topography is None:
            return wear
        rolls = merged_points(topography.roll_lengths, np.array(wear.roll_lengths))
        places = merged_points(topography.places, np.array(wear.places))
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

    def slice_error(self, loaded: LoadedFlanks, depth: Array) -> float:
        """Mean change of what a passage takes off, with half of the slices, over it.

        loaded : contact with depths (2, p, m) of wear at the middles of slices [m]
        """
        fewer = self._with_half_the_slices

        def at_fewer(values: Array) -> Array:
            """Values (2, p, m), at the middles of fewer slices."""
            rows = zip(fewer.places, self.places, values, strict=True)
            return np.array(
                [[np.interp(few, z, row) for row in v] for few, z, v in rows]
            )

        taken = at_fewer(self.depth_per_passage(loaded))
        coarse = fewer.depth_per_passage(fewer.load(at_fewer(depth)))
        change = np.abs(coarse - taken).mean(axis=(1, 2))
        return float((change / taken.mean(axis=(1, 2))).max())

    @property
    def _with_half_the_slices(self) -> WearingFaces:
        solver = self.solver
        places = slice_places(solver.width, max(2, solver.slices // 2))
        halved = replace(
            solver,
            gap=solver.gap_at(places),
            back_gap=replace(solver, gap=solver.back_gap).gap_at(places),
        )
        return replace(self, contact=replace(self.contact, solver=halved))

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
