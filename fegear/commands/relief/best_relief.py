"""The modifications that make an objective least, by searches from many designs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fegear.commands.relief.objective import ReliefObjective, linear_step
from fegear.commands.relief.quantities import SlopedValues
from fegear.commands.relief.relief_problem import LeadRange, ReliefProblem, ReliefRange
from fegear.commands.relief.topography_range import TopographyRange
from lumped.common.array_types import Array

# of the trust region, over the range of designs: in a search, and near a best design
FIRST_RADIUS, NEAR_RADIUS, MIN_RADIUS = 0.2, 0.03, 1e-4
MAX_STEPS = 60  # of a local search
RELATIVE_GAIN = 1e-4  # of the objective, below which a step is not taken
ROUGH_GAIN = 1e-3  # the same of all searches but the last
FIRST_GAINS = 1e-2, 3e-3  # the same of searches at few positions
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
# the same of the depths and lengths of leads, and of slopes, which have either sign
LEAD_PARTS, SLOPE_PARTS = (0.1, 0.3, 0.05, 0.2, 0.4), (0.5, 0.5, 0.5, 0.4, 0.6)
GOOD_GAIN, POOR_GAIN = 0.75, 0.25  # over the predicted one, for the next radius
# over the objective without relief: effect below which a relief is left out, and below
# which the others are refined without it
MIN_EFFECT, REFINED_EFFECT = 1e-3, 0.02


def starting_designs(problem: ReliefProblem, count: int) -> list[Array]:
    """Designs from which searches start: those of START_PATTERNS, then others.

    The others are a sequence of low discrepancy, always the same: multiples of powers
    of the generalised golden ratio (Roberts 2018). Root reliefs have the pattern of
    the tip reliefs of their mates.
    """
    reliefs, bounds = len(problem.groups), np.array(problem.bounds)
    leads = [
        SLOPE_PARTS if lead.name == "slope" else LEAD_PARTS
        for lead in problem.leads
        for _ in lead.units
    ]
    patterns = [
        np.concatenate(
            [
                np.resize(sizes, reliefs),
                np.resize(lengths, reliefs),
                [parts[i] for parts in leads],
                problem.topography.start(i) if problem.topography else [],
            ]
        )
        for i, (sizes, lengths) in enumerate(START_PATTERNS)
    ]
    ratio = 2.0
    for _ in range(60):  # ratio^(d + 1) = ratio + 1
        ratio = (1.0 + ratio) ** (1.0 / (len(bounds) + 1))
    steps = ratio ** -np.arange(1.0, len(bounds) + 1.0)
    numbers = np.arange(1, max(0, count - len(patterns)) + 1)
    others = np.mod(0.5 + np.outer(numbers, steps), 1.0)
    others[:, :reliefs] *= 0.7
    designs = [*patterns, *others]
    return [bounds[:, 0] + part * np.ptp(bounds, axis=1) for part in designs[:count]]


@dataclass(frozen=True)
class BestRelief:
    """A design and what it gives.

    design : see `ReliefProblem.bounds`
    measures : the first of the objective in each case (c,)
    value : of the objective
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
    gains: tuple[float, float] = (ROUGH_GAIN, RELATIVE_GAIN),
) -> BestRelief:
    """The best of local searches from several designs, then near the best of them.

    The largest of many peak-to-peak values has no derivative where two are equal. Each
    step is therefore the solution of a linear program for a design and limits of the
    transmission error in each case, with a constraint for each position (epigraph
    form), in a trust region that grows and shrinks with the gain. Searches stop at a
    design where another one ended, and at small gains; the best design is refined.

    gains : of the objective, below which a step is not taken, and of the refinement
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
        ends.append(_local_search(problem, start, objective, gains[0], ends))
    ends.append(_local_search(problem, _best_design(ends), objective, gains[1], ()))
    progress(total, total)
    best = min(ends, key=lambda end: end.value)
    return BestRelief(
        best.design,
        objective.measures(problem.values(best.design)),
        best.value,
        sum(end.evaluations for end in ends),
        len(starts),
    )


def refined(
    problem: ReliefProblem, first: BestRelief, objective: ReliefObjective
) -> BestRelief:
    """The best design near that of a similar problem, with all solutions until then."""
    end = _local_search(
        problem, first.design, objective, ROUGH_GAIN, (), radius=NEAR_RADIUS
    )
    return BestRelief(
        end.design,
        objective.measures(problem.values(end.design)),
        end.value,
        first.evaluations + end.evaluations,
        first.starts,
    )


# reliefs of one size, a lead or the topography
Feature = tuple[ReliefRange, ...] | LeadRange | TopographyRange


def without_idle_features(
    problem: ReliefProblem, design: Array, objective: ReliefObjective
) -> tuple[ReliefProblem, Array, int]:
    """The problem and design without what hardly changes the objective.

    From the smallest on, each relief (or that of both gears), lead and topography is
    left out if the objective rises by less than MIN_EFFECT of that without any. Where
    the rise is larger, but less than REFINED_EFFECT, the others are refined first. The
    last value is the number of solutions of the mesh cycle.
    """
    without_any = replace(problem, ranges=(), leads=(), topography=None)
    largest = objective.of(without_any.values(np.empty(0)))
    value, evaluations = objective.of(problem.values(design)), 2
    for feature in _features_by_depth(problem, design):
        reduced_problem, reduced_design = _without(problem, design, feature)
        reached = objective.of(reduced_problem.values(reduced_design))
        evaluations += 1
        if (
            reduced_design.size
            and MIN_EFFECT < (reached - value) / largest < REFINED_EFFECT
        ):
            end = _local_search(
                reduced_problem, reduced_design, objective, RELATIVE_GAIN, ()
            )
            reduced_design, reached = end.design, end.value
            evaluations += end.evaluations
        if reached - value <= MIN_EFFECT * largest:
            problem, design = reduced_problem, reduced_design
    return problem, design, evaluations


def _features_by_depth(problem: ReliefProblem, design: Array) -> list[Feature]:
    depths: list[tuple[float, Feature]] = [
        (float(size), group)
        for size, group in zip(problem.parts(design)[0], problem.groups, strict=True)
    ]
    for lead, sizes in problem.lead_sizes(design):
        depths.append((abs(sizes[lead.name]), lead))
    if problem.topography:
        of_points = problem.topography_depths(design)
        depths.append((float(np.ptp(of_points)), problem.topography))
    return [feature for _, feature in sorted(depths, key=lambda entry: entry[0])]


def _without(
    problem: ReliefProblem, design: Array, feature: Feature
) -> tuple[ReliefProblem, Array]:
    """The problem and design without a group's reliefs, a lead or the topography."""
    magnitudes, lengths, _ = problem.parts(design)
    keeps = np.array([group != feature for group in problem.groups], bool)
    leads = [
        (lead, sizes) for lead, sizes in problem.lead_sizes(design) if lead != feature
    ]
    of_leads = [size for _, sizes in leads for size in sizes.values()]
    topography = None if problem.topography == feature else problem.topography
    fewer = replace(
        problem,
        ranges=tuple(
            entry
            for group, keep in zip(problem.groups, keeps, strict=True)
            for entry in group
            if keep
        ),
        leads=tuple(lead for lead, _ in leads),
        topography=topography,
    )
    sizes = [magnitudes[keeps], lengths[keeps], of_leads]
    if topography:
        sizes.append(problem.topography_depths(design))
    return fewer, np.concatenate(sizes)


class _SearchEnd(NamedTuple):
    """Where a search ended: design, objective, solutions of the mesh cycle."""

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
    radius: float = FIRST_RADIUS,
) -> _SearchEnd:
    """Sequential linear programming in a trust region, over scaled designs.

    min_gain : of the objective, below which a step is not taken
    ends : of other searches; this one stops near one of them
    radius : of the first trust region
    """
    bounds = np.array(problem.bounds)
    scale = np.ptp(bounds, axis=1)
    design = start
    responses = problem.responses(design)
    value, evaluations = objective.of_responses(responses), 1
    for _ in range(MAX_STEPS):
        low = np.maximum((bounds[:, 0] - design) / scale, -radius)
        high = np.minimum((bounds[:, 1] - design) / scale, radius)
        scaled = {
            name: SlopedValues(values, slopes * scale)
            for name, (values, slopes) in responses.items()
        }
        step, predicted = linear_step(scaled, (low, high), objective)
        if value - predicted < min_gain * value:
            break
        candidate = np.clip(design + scale * step, *bounds.T)
        responses_there = problem.responses(candidate)
        evaluations += 1
        candidate_value = objective.of_responses(responses_there)
        gain = (value - candidate_value) / (value - predicted)
        if gain > 0.0:
            design, responses, value = candidate, responses_there, candidate_value
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
