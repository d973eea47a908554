"""Wear of both flanks of a mesh by Archard's law.

A flank loses the depth k p for each length of sliding under the pressure p. While the
contact passes a point with the speed u over its flank, that adds up to |u1 - u2| / u
times the integral of the pressure over the width of the contact, which is the load per
face width F'. A passage takes the depth

    h = k F' |1 - u_mate / u|

whatever the distribution of the pressure. Over involutes the contact moves with the
speed along the line of action times the roll angle, so that the ratio of speeds is that
of the roll angles. Wear changes the flanks and, with them, how tooth pairs share the
load: depths grow in steps of Euler's explicit method over revolutions of the driver,
and the contact is solved with the worn flanks after each (Flodin and Andersson 1997).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fegear.contact.path import PATH_TOL, loss_factor, path_positions, roll_angles
from fegear.contact.path import on_path as is_on_path
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.gearset.modifications import MAX_PROFILE_POINTS, FlankProfile
from fegear.gearset.profiles import MAX_DEVIATION_UM
from fegear.gearset.zones import zones
from fegear.statics.mesh_faults import with_wear
from lumped.common.array_types import Array
from lumped.common.progress import Progress, silent
from lumped.common.units import UM
from meshes import GearPair

Indices = NDArray[np.intp]
END_MARGIN = 1e-7  # base pitches from the ends of the path to the outermost points
DEPTH_STEP_SHARE = 0.05  # of the mean deflection of the teeth, in a step by default
MAX_STEPS = 10_000
MIN_STEPS = 2  # so that there is a run in fewer steps to compare with


@dataclass(frozen=True, eq=False)
class PathPoints:
    """Points of the path at which the depth of wear is known.

    places : (n,) positions in a base pitch at which the contact is solved, increasing:
        equally spaced ones, and those at which a pair is at an end of the path
    is_regular : (n,) whether a place is one of those equally spaced
    place, ahead : (p,) index of a point's position, and base pitches by which the pair
        is ahead there
    position : (p,) of the points, base pitches from the pitch point, increasing
    """

    places: Array
    is_regular: NDArray[np.bool_]
    place: Indices
    ahead: NDArray[np.int64]
    position: Array


def path_points(pair: GearPair, positions: int) -> PathPoints:
    """All points of the path at equally spaced positions, and its ends.

    positions : in a base pitch

    Raises InputError where a profile cannot have as many points.
    """
    regular = np.arange(positions) / positions
    start, end = pair.path
    ends = np.array([start + END_MARGIN, end - END_MARGIN]) % 1.0
    distance = np.abs((ends[:, None] - regular + 0.5) % 1.0 - 0.5).min(axis=1)
    places = np.unique(np.concatenate([regular, ends[distance > PATH_TOL]]))
    pairs = np.arange(math.floor(start) - 1, math.ceil(end) + 1)
    every = places[:, None] + pairs.astype(float)
    place, column = np.nonzero(is_on_path(pair, every))
    if place.size > MAX_PROFILE_POINTS:
        raise InputError(
            f"positions = {positions}; makes {place.size} points of a flank, allowed "
            f"are {MAX_PROFILE_POINTS}"
        )
    order = np.argsort(every[place, column])
    place, ahead = place[order], pairs[column[order]]
    is_regular = np.isin(places, regular)
    return PathPoints(places, is_regular, place, ahead, places[place] + ahead)


@dataclass(frozen=True, eq=False)
class LoadedFlanks:
    """Contact of a mesh with flanks of some wear.

    line_load : (p,) load per face width when the contact passes the points [N/m]
    position : (n,) equally spaced in a base pitch
    ste : (n,) static transmission error [m]
    stiffness : (n,) average slope of the force over the transmission error [N/m]
    deflection : mean transmission error less that without load [m]
    corner_work : sliding work of pairs off the path, on tip corners, over that of all
    shift : largest distance of the centre of a load, along the path, from where it is
        on flanks without wear [base pitches]
    """

    line_load: Array
    position: Array
    ste: Array
    stiffness: Array
    deflection: float
    corner_work: float
    shift: float

    @property
    def key_figures(self) -> dict[str, float]:
        """Figures by name, as summaries have them."""
        mean = float(self.stiffness.mean())
        return {
            "mean_stiffness_N_per_m": mean,
            "peak_to_peak_over_mean": float(np.ptp(self.stiffness)) / mean,
            "ste_mean_um": float(self.ste.mean()) / UM,
            "ste_peak_to_peak_um": float(np.ptp(self.ste)) / UM,
            "largest_line_load_N_per_m": float(self.line_load.max()),
            "corner_sliding_percent": 100.0 * self.corner_work,
        }


@dataclass(frozen=True, eq=False)
class WearingMesh:
    """A mesh whose flanks wear.

    contact : with the profiles of flanks that are not worn
    torque : on the driver [N m]
    coefficient : k of Archard's law [m2/N]
    """

    contact: ContactProblem
    torque: float
    coefficient: float
    points: PathPoints

    @property
    def pair(self) -> GearPair:
        return self.contact.pair

    @cached_property
    def roll_angles(self) -> Array:
        """Roll angles (2, p) of driver and driven gear [rad]."""
        angles = np.array(roll_angles(self.pair, self.points.position))
        if not (angles > 0.0).all():
            raise InputError(
                "the contact reaches a base circle, where sliding over rolling has no "
                "limit; larger centre distance or smaller tip of the mate"
            )
        return angles

    @property
    def specific_sliding(self) -> Array:
        """1 - u_mate / u on the flanks (2, p) of driver and driven gear."""
        angles = self.roll_angles
        return np.asarray(1.0 - angles[::-1] / angles)

    @property
    def unworn(self) -> Array:
        """No depth at all points of both flanks."""
        return np.zeros_like(self.roll_angles)

    @property
    def passages(self) -> Array:
        """How often (2, 1) a tooth of each gear meets one in a turn of the driver."""
        return np.array([[1.0], [self.pair.driver.teeth / self.pair.driven.teeth]])

    @property
    def roll_lengths(self) -> Array:
        """Roll lengths (2, p) on driver and driven gear [m]."""
        radii = self.pair.driver.base_radius, self.pair.driven.base_radius
        return self.roll_angles * np.array(radii)[:, None]

    @property
    def max_depth(self) -> float:
        """Largest depth [m] that a gear-set file takes."""
        return MAX_DEVIATION_UM * 1e-3 * self.pair.driver.module

    def profiles(self, depth: Array) -> tuple[FlankProfile, FlankProfile]:
        """Wear of both flanks at depths (2, p) [m], as faults have it."""
        rolls = self.roll_lengths
        return (
            _wear_profile(rolls[0], depth[0]),
            _wear_profile(rolls[1, ::-1], depth[1, ::-1]),
        )

    def load(self, depth: Array) -> LoadedFlanks:
        """Solve the contact with depths (2, p) of wear [m]."""
        driver, driven = self.profiles(depth)
        contact = replace(
            self.contact,
            driver=self._worn_flank(self.contact.driver, driver, "driver"),
            driven=self._worn_flank(self.contact.driven, driven, "driven"),
        )
        points = self.points
        return self._as_loaded(solve_cycle(contact, self.torque, points.places))

    def _worn_flank(
        self, flank: ContactFlank, wear: FlankProfile, role: str
    ) -> ContactFlank:
        profile = with_wear(flank.profile, wear, zones(self.pair, role))
        return replace(flank, profile=profile)

    def _as_loaded(self, cycle: ContactCycle) -> LoadedFlanks:
        points, regular = self.points, self.points.is_regular
        load = cycle.load[0, points.place, self._pair_indices(cycle)]
        return LoadedFlanks(
            line_load=load / self.contact.face_width,
            position=cycle.position[regular],
            ste=cycle.ste[0, regular],
            stiffness=cycle.stiffness[0, regular],
            deflection=float((cycle.ste - cycle.no_load)[0, regular].mean()),
            corner_work=self._corner_work(cycle),
            shift=self._load_shift(cycle),
        )

    def _contact_arcs(self, cycle: ContactCycle) -> Array:
        """Centres (p, 2) of the loads on both flanks, from the tip corners [m]."""
        arcs: Array = cycle.arc[0, self.points.place, self._pair_indices(cycle)]
        return arcs

    def _pair_indices(self, cycle: ContactCycle) -> Indices:
        """Index (p,) of the pair at each point."""
        column = {int(k): i for i, k in enumerate(cycle.teeth)}
        return np.array([column[int(k)] for k in self.points.ahead])

    @cached_property
    def _arcs_without_wear(self) -> Array:
        return self._contact_arcs(
            solve_cycle(self.contact, self.torque, self.points.places)
        )

    def _load_shift(self, cycle: ContactCycle) -> float:
        """See `LoadedFlanks`."""
        moved = np.abs(self._contact_arcs(cycle) - self._arcs_without_wear)
        return float((moved.T / self.roll_angles).max()) / self.pair.base_pitch

    def _corner_work(self, cycle: ContactCycle) -> float:
        position = path_positions(cycle)[self.points.is_regular]
        share = cycle.load_share[0, self.points.is_regular]
        teeth = [g.sign * g.teeth for g in (self.pair.driver, self.pair.driven)]
        on_path = np.where(is_on_path(self.pair, position), share, 0.0)
        every, inside = (
            float(loss_factor(teeth, position, part)) for part in (share, on_path)
        )
        return 1.0 - inside / every

    def depth_per_passage(self, loaded: LoadedFlanks) -> Array:
        """Depth (2, p) that goes in a passage on driver and driven gear [m]."""
        sliding = self._at_points(np.abs(self.specific_sliding), loaded.line_load)
        return np.asarray(self.coefficient * loaded.line_load * sliding)

    def depth_per_turn(self, loaded: LoadedFlanks) -> Array:
        """Depth (2, p) that goes in a turn of the driver [m]."""
        depth = self.depth_per_passage(loaded)
        return np.asarray(self._at_points(self.passages, loaded.line_load) * depth)

    def sliding_work(self, loaded: LoadedFlanks) -> float:
        """Load per face width times length of sliding, over a passage [N].

        It is the friction work of a passage per face width over the coefficient of
        friction. Its product with k is the volume per face width that a tooth loses.
        """
        one, two = self.roll_angles
        # in the time of a passage the contact moves along the path
        path = self.pair.base_pitch * self.points.position
        load = self.mean_over_width(loaded.line_load)
        return float(np.trapezoid(load * np.abs(one - two), path))

    def worn_areas(self, depth: Array) -> Array:
        """Volume per face width (2,) that a tooth of each gear has lost [m2].

        depth : (2, p) [m]
        """
        arcs = 0.5 * np.abs(self.roll_lengths * self.roll_angles)  # from base circles
        depths = np.array([self.mean_over_width(of_gear) for of_gear in depth])
        return np.abs(np.trapezoid(depths, arcs, axis=1))

    def mean_over_width(self, values: Array) -> Array:
        """Mean (p,) of values (p,) of sections or (p, m) over the face width."""
        return values.reshape(len(values), -1).mean(axis=1)

    @staticmethod
    def _at_points(values: Array, line_load: Array) -> Array:
        """Values (2, p) that broadcast with loads (p,) or (p, m)."""
        return values.reshape(values.shape + (1,) * (line_load.ndim - 1))


def _wear_profile(rolls: Array, depth: Array) -> FlankProfile:
    return FlankProfile(
        roll_lengths=tuple(rolls.tolist()), deviations=tuple((-depth).tolist())
    )


@dataclass(frozen=True)
class StepPlan:
    """How many steps lead to the end.

    max_depth : at most that a step takes off, at any point [m]
    count : of equal steps of revolutions instead, or None
    minimum : number of steps that are made at least
    """

    max_depth: float
    count: int | None = None
    minimum: int = MIN_STEPS

    def steps_left(self, done: int, depth: float) -> int:
        """Number of steps after some; depth : that goes until the end [m]."""
        if self.count is not None:
            return max(self.count - done, 1)
        return max(math.ceil(depth / self.max_depth), self.minimum - done, 1)

    @property
    def halved(self) -> StepPlan:
        """About half as many steps."""
        count = None if self.count is None else (self.count + 1) // 2
        return StepPlan(2.0 * self.max_depth, count, minimum=1)


@dataclass(frozen=True, eq=False)
class WornFlanks:
    """Flanks after some revolutions of the driver.

    start, depth : (2, p) of driver and driven, at the beginning and at the end [m]
    first, last : contact at the beginning and at the end
    steps : their number; largest_step : depth that one took off at most [m]
    sliding_work : sum over all passages of a driver's tooth, see `WearingMesh`
    """

    start: Array
    depth: Array
    first: LoadedFlanks
    last: LoadedFlanks
    steps: int
    largest_step: float
    sliding_work: float

    @property
    def lost(self) -> Array:
        """Depth (2, p) that has gone [m]."""
        return np.asarray(self.depth - self.start)


def wear_off(
    mesh: WearingMesh,
    start: Array,
    turns: float,
    plan: StepPlan,
    report: Progress = silent,
) -> WornFlanks:
    """Wear flanks over turns of the driver; start : depths (2, p) of wear [m].

    Raises InputError where the steps are too many or the flanks are worn too far.
    """
    depth, first = start, mesh.load(start)
    loaded = first
    remaining, steps, largest, work = turns, 0, 0.0, 0.0
    while remaining > 0.0:
        report("wear", round(100.0 * (1.0 - remaining / turns)), 100)
        rate = mesh.depth_per_turn(loaded)
        fastest = float(rate.max())
        left = plan.steps_left(steps, remaining * fastest)
        if not steps + left <= MAX_STEPS:
            raise InputError(
                f"cycles = {turns:.12g}; needs {steps + left} steps of wear, allowed "
                f"are {MAX_STEPS}"
            )
        size = remaining / left
        remaining = 0.0 if left == 1 else remaining - size
        depth = depth + size * rate
        work += size * mesh.sliding_work(loaded)
        largest, steps = max(largest, size * fastest), steps + 1
        _require_depth(mesh, depth, turns, turns - remaining)
        loaded = mesh.load(depth)
    report("wear", 100, 100)
    return WornFlanks(start, depth, first, loaded, steps, largest, work)


def _require_depth(
    mesh: WearingMesh, depth: Array, turns: float, passed: float
) -> None:
    deepest = float(depth.max())
    if not deepest <= mesh.max_depth:
        raise InputError(
            f"cycles = {turns:.12g}; after {passed:.4g} of them wear is "
            f"{1e6 * deepest:.4g} um deep, allowed are {1e6 * mesh.max_depth:.4g} um, "
            "half the module"
        )


def step_error(worn: WornFlanks, coarser: WornFlanks) -> float:
    """Estimated error of the depth by its steps, over the largest that has gone.

    coarser : in fewer steps. The method is of first order in the size of steps.
    """
    change = float(np.abs(worn.depth - coarser.depth).max() / worn.lost.max())
    return change * coarser.steps / max(worn.steps - coarser.steps, 1)


def position_error(position: Array, depths: Sequence[Array]) -> float:
    """Mean change of depths (p, ...) over their mean without every other position.

    Depths at positions that are left out are those between their neighbours.
    """
    stored = np.union1d(np.arange(0, position.size, 2), [position.size - 1])

    def between(depth: Array) -> Array:
        return np.interp(position, position[stored], depth[stored])

    changes = [
        np.abs(depth - np.apply_along_axis(between, 0, depth)).mean() / depth.mean()
        for depth in depths
    ]
    return float(max(changes))
