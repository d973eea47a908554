"""Profile relief of least transmission error over torques.

The transmission error of a loaded pair of gears answers a change of the gap of one
tooth pair by that pair's part of the next increment of the load, its slope over the
sum of all slopes: this follows from the contact conditions of the nodes that touch,
whose forces balance the torque before and after. A relief is such a gap, so that the
solution of the contact gives the derivative of the transmission error with respect to
every relief without another solution, what it does to moment arms included. What is
left out is that the nodes of a contact patch follow the point of contact, 1 % of the
derivatives and less with more nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from fegear.commands.relief.objective import ReliefObjective, linear_step
from fegear.contact.problem import ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.gearset.modifications import Relief, ReliefShape
from fegear.gearset.zones import Zones, zones
from lumped.common.array_types import Array
from lumped.common.units import UM

PLACES = ("driver_tip", "driven_tip", "driver_root", "driven_root")
MIN_MAGNITUDE = 1e-12  # of a relief [m], by which its derivative is known
FIRST_RADIUS, MIN_RADIUS = 0.2, 1e-4  # of the trust region, over the range of designs
MAX_STEPS = 60  # of a local search
RELATIVE_GAIN = 1e-4  # of the objective, below which a step is not taken
ROUGH_GAIN = 1e-3  # the same of all searches but the last
# how far from the best design further searches start, over the range of designs
NEIGHBOURS = (0.2, 0.1, 0.05, 0.05, 0.3, 0.3, 0.2, 0.1)
# of the range of designs, within which searches lead to the same one
SAME_END_DISTANCE = 0.03
SAME_VALUE_RTOL = 0.005  # relative, by which the objective differs there
# magnitudes and lengths from which searches start, over their limits: equal ones, and a
# short relief of one gear with a longer one of the other
START_PATTERNS = (
    ((0.3, 0.3), (0.5, 0.5)),
    ((0.15, 0.35), (0.3, 0.75)),
    ((0.35, 0.15), (0.75, 0.3)),
    ((0.27, 0.6), (0.3, 0.7)),
    ((0.6, 0.27), (0.7, 0.3)),
)
GOOD_GAIN, POOR_GAIN = 0.75, 0.25  # over the predicted one, for the next radius
MIN_LENGTH = 0.05  # of a relief [base pitches]
# over the objective without relief: effect below which a relief is left out, and below
# which the others are refined without it
MIN_EFFECT, REFINED_EFFECT = 1e-3, 0.02


@dataclass(frozen=True)
class ReliefRange:
    """A relief whose magnitude and length are sought.

    place : one of PLACES
    flank : zones of its gear
    end : roll length at which the relief is largest [m]
    lengths : shortest and longest, over the base pitch
    """

    place: str
    flank: Zones
    end: float
    lengths: tuple[float, float]

    @property
    def is_tip(self) -> bool:
        return self.place.endswith("tip")

    @property
    def index(self) -> tuple[Any, ...]:
        """Its place in `ContactCycle.relief_slope`."""
        gear = 0 if self.place.startswith("driver") else 1
        return ..., gear, 0 if self.is_tip else 1, slice(None)

    def start(self, length: float, base_pitch: float) -> float:
        """Roll length where a relief of a length in base pitches begins [m]."""
        distance = length * base_pitch
        return self.end - distance if self.is_tip else self.end + distance


@dataclass(frozen=True)
class ReliefProblem:
    """Magnitudes and lengths of reliefs that make the transmission error least.

    contact : of the mesh without the reliefs that are sought
    ranges : reliefs that are sought
    torques : on the driver (t,) [N m]; positions : of the mesh cycle (p,)
    max_magnitude : [m]
    symmetric : whether reliefs of both gears have one magnitude and one length in
        base pitches
    """

    contact: ContactProblem
    ranges: tuple[ReliefRange, ...]
    torques: Array
    positions: Array
    max_magnitude: float
    shape: ReliefShape = "linear"
    symmetric: bool = False

    @property
    def groups(self) -> tuple[tuple[ReliefRange, ...], ...]:
        """Ranges that share their magnitude and length, n groups."""
        if not self.symmetric:
            return tuple((entry,) for entry in self.ranges)
        ends = True, False
        groups = [tuple(e for e in self.ranges if e.is_tip == tip) for tip in ends]
        return tuple(group for group in groups if group)

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Limits of a design (2 n,): magnitudes [um], then lengths [base pitches]."""
        magnitudes = [(0.0, self.max_magnitude / UM)] * len(self.groups)
        limits = [[entry.lengths for entry in group] for group in self.groups]
        lengths = [
            (max(low for low, _ in group_limits), min(high for _, high in group_limits))
            for group_limits in limits
        ]
        return magnitudes + lengths

    def separate(self, design: Array) -> tuple[ReliefProblem, Array]:
        """The problem with each relief by itself, and the design that is the same."""
        sizes = [len(group) for group in self.groups]
        ranges = tuple(entry for group in self.groups for entry in group)
        separate = np.repeat(design.reshape(2, -1), sizes, axis=1).ravel()
        return replace(self, ranges=ranges, symmetric=False), separate

    def contact_of(self, design: Array) -> ContactProblem:
        """The contact problem with the reliefs of a design."""
        pitch = self.contact.pair.base_pitch
        problem, design = self.separate(design)
        count = len(problem.ranges)
        reliefs: dict[str, dict[str, Any]] = {"driver": {}, "driven": {}}
        for entry, size, length in zip(
            problem.ranges, design[:count], design[count:], strict=True
        ):
            relief = Relief(
                magnitude=max(UM * float(size), MIN_MAGNITUDE),
                start_roll_length=entry.start(float(length), pitch),
                shape=self.shape,
            )
            role, _, place = entry.place.partition("_")
            reliefs[role][f"{place}_relief"] = relief
        return replace(
            self.contact,
            driver=replace(self.contact.driver, **reliefs["driver"]),
            driven=replace(self.contact.driven, **reliefs["driven"]),
        )

    def ste(self, design: Array) -> tuple[Array, Array]:
        """Transmission errors (t, p) [m] and their derivatives (t, p, 2 n)."""
        contact = self.contact_of(design)
        cycle = solve_cycle(contact, self.torques, self.positions, with_slopes=True)
        count, pitch = len(self.groups), contact.pair.base_pitch
        derivative = np.zeros((*cycle.ste.shape, 2 * count))
        for i, group in enumerate(self.groups):
            for entry in group:
                slopes = cycle.relief_slope[entry.index]
                by_magnitude, by_start = np.moveaxis(slopes, -1, 0)
                derivative[..., i] += UM * by_magnitude
                sign = -1.0 if entry.is_tip else 1.0
                derivative[..., count + i] += sign * pitch * by_start
        return cycle.ste, derivative


def relief_ranges(
    contact: ContactProblem, places: Sequence[str]
) -> tuple[ReliefRange, ...]:
    """Ranges of reliefs, at most from the pitch point on."""
    pair = contact.pair
    pitch_points = {
        "driver": pair.pitch_point,
        "driven": pair.line_of_action - pair.pitch_point,
    }
    ranges = []
    for place in places:
        role = place.partition("_")[0]
        flank = zones(pair, role)
        end = flank.tip if place.endswith("tip") else flank.start
        longest = abs(end - pitch_points[role]) / pair.base_pitch
        ranges.append(ReliefRange(place, flank, end, (MIN_LENGTH, longest)))
    return tuple(ranges)


def starting_designs(problem: ReliefProblem, count: int) -> list[Array]:
    """Designs from which searches start: those of START_PATTERNS, then others.

    The others are a sequence of low discrepancy, always the same: multiples of powers
    of the generalised golden ratio (Roberts 2018). Root reliefs have the pattern of
    the tip reliefs of their mates.
    """
    reliefs, bounds = len(problem.groups), np.array(problem.bounds)
    patterns = [
        np.concatenate([np.resize(sizes, reliefs), np.resize(lengths, reliefs)])
        for sizes, lengths in START_PATTERNS
    ]
    ratio = 2.0
    for _ in range(60):  # ratio^(d + 1) = ratio + 1
        ratio = (1.0 + ratio) ** (1.0 / (2 * reliefs + 1))
    steps = ratio ** -np.arange(1.0, 2 * reliefs + 1.0)
    numbers = np.arange(1, max(0, count - len(patterns)) + 1)
    others = np.mod(0.5 + np.outer(numbers, steps), 1.0)
    designs = [*patterns, *others * np.repeat([0.7, 1.0], reliefs)]
    return [bounds[:, 0] + part * np.ptp(bounds, axis=1) for part in designs[:count]]


@dataclass(frozen=True)
class BestRelief:
    """A design and what it gives.

    design : magnitudes [um], then lengths [base pitches]
    measures : of the transmission error at each torque (t,) [m]
    value : of the objective [m]
    evaluations : solutions of the mesh cycle at all torques; starts : of the search
    """

    design: Array
    measures: Array
    value: float
    evaluations: int
    starts: int


def find_best_relief(
    problem: ReliefProblem,
    starts: Sequence[Array],
    objective: ReliefObjective,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> BestRelief:
    """The best of local searches from several designs, then near the best of them.

    The largest of many peak-to-peak values has no derivative where two are equal. Each
    step is therefore the solution of a linear program for a design and limits of the
    transmission error at each torque, with a constraint for each position (epigraph
    form), in a trust region that grows and shrinks with the gain. Searches stop at a
    design where another one ended, and at small gains; the best design is refined.
    """
    bounds = np.array(problem.bounds)
    random = np.random.default_rng(0)
    neighbours = NEIGHBOURS[: len(starts) - 1]
    total = len(starts) + len(neighbours) + 1
    ends: list[_SearchEnd] = []
    for number in range(total - 1):
        progress(number, total)
        if number < len(starts):
            start = starts[number]
        else:
            way = neighbours[number - len(starts)] * random.uniform(
                -1.0, 1.0, len(bounds)
            )
            start = np.clip(
                _best_design(ends) + way * np.ptp(bounds, axis=1), *bounds.T
            )
        ends.append(_local_search(problem, start, objective, ROUGH_GAIN, ends))
    ends.append(
        _local_search(problem, _best_design(ends), objective, RELATIVE_GAIN, ())
    )
    progress(total, total)
    best = min(ends, key=lambda end: end.value)
    return BestRelief(
        best.design,
        objective.measures(problem.ste(best.design)[0]),
        best.value,
        sum(end.evaluations for end in ends),
        len(starts),
    )


def without_idle_reliefs(
    problem: ReliefProblem, design: Array, objective: ReliefObjective
) -> tuple[ReliefProblem, Array, int]:
    """The problem and design without reliefs that hardly change the objective.

    From the smallest on, each (or that of both gears) is left out if the objective
    rises by less than MIN_EFFECT of that without any relief. Where the rise is larger,
    but less than REFINED_EFFECT, the others are refined first. The last value is the
    number of solutions of the mesh cycle.
    """
    no_magnitudes = replace(problem, ranges=())
    objective_without_reliefs = objective.of(no_magnitudes.ste(np.empty(0))[0])
    value, evaluations = objective.of(problem.ste(design)[0]), 2
    for group in _groups_by_magnitude(problem, design):
        reduced_problem, reduced_design = _without_group(problem, design, group)
        reached = objective.of(reduced_problem.ste(reduced_design)[0])
        evaluations += 1
        if (
            reduced_problem.ranges
            and MIN_EFFECT
            < (reached - value) / objective_without_reliefs
            < REFINED_EFFECT
        ):
            end = _local_search(
                reduced_problem, reduced_design, objective, RELATIVE_GAIN, ()
            )
            reduced_design, reached = end.design, end.value
            evaluations += end.evaluations
        if reached - value <= MIN_EFFECT * objective_without_reliefs:
            problem, design = reduced_problem, reduced_design
    return problem, design, evaluations


def _groups_by_magnitude(
    problem: ReliefProblem, design: Array
) -> list[tuple[ReliefRange, ...]]:
    order = np.argsort(design[: len(problem.groups)])
    return [problem.groups[i] for i in order]


def _without_group(
    problem: ReliefProblem, design: Array, group: tuple[ReliefRange, ...]
) -> tuple[ReliefProblem, Array]:
    """The problem and design without the reliefs of a group."""
    is_kept = [other != group for other in problem.groups]
    ranges = tuple(entry for entry in problem.ranges if entry not in group)
    return replace(problem, ranges=ranges), design.reshape(2, -1)[:, is_kept].ravel()


class _SearchEnd(NamedTuple):
    """Where a search ended: design, objective [m], solutions of the mesh cycle."""

    design: Array
    value: float
    evaluations: int


def _best_design(ends: Sequence[_SearchEnd]) -> Array:
    return min(ends, key=lambda end: end.value).design


def _local_search(
    problem: ReliefProblem,
    start: Array,
    objective: ReliefObjective,
    min_gain: float,
    ends: Sequence[_SearchEnd],
) -> _SearchEnd:
    """Sequential linear programming in a trust region, over scaled designs.

    min_gain : of the objective, below which a step is not taken
    ends : of other searches; this one stops near one of them
    """
    bounds = np.array(problem.bounds)
    scale = np.ptp(bounds, axis=1)
    design, radius = start, FIRST_RADIUS
    ste, slopes = problem.ste(design)
    value, evaluations = objective.of(ste), 1
    for _ in range(MAX_STEPS):
        low = np.maximum((bounds[:, 0] - design) / scale, -radius)
        high = np.minimum((bounds[:, 1] - design) / scale, radius)
        step, predicted = linear_step(ste, slopes * scale, (low, high), objective)
        if value - predicted < min_gain * value:
            break
        candidate = np.clip(design + scale * step, *bounds.T)
        ste_there, slopes_there = problem.ste(candidate)
        evaluations += 1
        candidate_value = objective.of(ste_there)
        gain = (value - candidate_value) / (value - predicted)
        if gain > 0.0:
            design, ste, slopes, value = (
                candidate,
                ste_there,
                slopes_there,
                candidate_value,
            )
        radius *= 2.0 if gain > GOOD_GAIN else 1.0 if gain > POOR_GAIN else 0.3
        if radius < MIN_RADIUS * min_gain / RELATIVE_GAIN:
            break
        if any(_leads_to_same_end(end, design, value, scale) for end in ends):
            break
    return _SearchEnd(design, value, evaluations)


def _leads_to_same_end(
    end: _SearchEnd, design: Array, value: float, scale: Array
) -> bool:
    """Whether a search is near the end of another one, and not better."""
    distance = np.abs((end.design - design) / scale).max()
    return bool(
        distance < SAME_END_DISTANCE and value > (1.0 - SAME_VALUE_RTOL) * end.value
    )
