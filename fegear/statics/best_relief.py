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
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.contact.problem import ContactProblem, solve_cycle
from fegear.gearset.model import Relief, ReliefShape
from fegear.gearset.zones import Zones, zones

Array = NDArray[np.float64]
Objective = Literal["largest", "mean"]
PLACES = ("driver_tip", "driven_tip", "driver_root", "driven_root")
MIN_MAGNITUDE = 1e-12  # of a relief [m], by which its derivative is known
FIRST_RADIUS, MIN_RADIUS = 0.2, 1e-4  # of the trust region, over the range of designs
MAX_STEPS = 60  # of a local search
RELATIVE_GAIN = 1e-4  # of the objective, below which a step is not taken
# how far from the best design further searches start, over the range of designs
NEIGHBOURS = (0.3, 0.3, 0.2, 0.2, 0.1, 0.1, 0.05, 0.05)
GOOD_GAIN, POOR_GAIN = 0.75, 0.25  # over the predicted one, for the next radius
MIN_LENGTH = 0.05  # of a relief [base pitches]
MICRO = 1e-6  # unit of magnitudes in the optimisation [m]


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
        way = length * base_pitch
        return self.end - way if self.is_tip else self.end + way


@dataclass(frozen=True)
class ReliefProblem:
    """Magnitudes and lengths of reliefs that make the transmission error least.

    contact : of the mesh without the reliefs that are sought
    ranges : reliefs that are sought, n of them
    torques : on the driver (t,) [N m]; positions : of the mesh cycle (p,)
    max_magnitude : [m]
    """

    contact: ContactProblem
    ranges: tuple[ReliefRange, ...]
    torques: Array
    positions: Array
    max_magnitude: float
    shape: ReliefShape = "linear"

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Limits of a design (2 n,): magnitudes [um], then lengths [base pitches]."""
        magnitudes = [(0.0, self.max_magnitude / MICRO)] * len(self.ranges)
        return magnitudes + [entry.lengths for entry in self.ranges]

    def contact_of(self, design: Array) -> ContactProblem:
        """The contact problem with the reliefs of a design."""
        pitch = self.contact.pair.base_pitch
        count = len(self.ranges)
        reliefs: dict[str, Any] = {}
        for entry, size, length in zip(
            self.ranges, design[:count], design[count:], strict=True
        ):
            relief = Relief(
                magnitude=max(MICRO * float(size), MIN_MAGNITUDE),
                start_roll_length=entry.start(float(length), pitch),
                shape=self.shape,
            )
            reliefs[f"{entry.place}_relief"] = relief
        return replace(self.contact, **reliefs)

    def ste(self, design: Array) -> tuple[Array, Array]:
        """Transmission errors (t, p) [m] and their derivatives (t, p, 2 n)."""
        contact = self.contact_of(design)
        cycle = solve_cycle(contact, self.torques, self.positions)
        count, pitch = len(self.ranges), contact.pair.base_pitch
        derivative = np.empty((*cycle.ste.shape, 2 * count))
        for i, entry in enumerate(self.ranges):
            by_magnitude, by_start = np.moveaxis(cycle.relief_slope[entry.index], -1, 0)
            derivative[..., i] = MICRO * by_magnitude
            derivative[..., count + i] = by_start * (-pitch if entry.is_tip else pitch)
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
    """Designs from which searches start: equal reliefs of two lengths, then others.

    The others are a Sobol sequence, always the same.
    """
    from scipy.stats import qmc

    reliefs, bounds = len(problem.ranges), np.array(problem.bounds)
    fractions = [np.repeat([0.3, part], reliefs) for part in (0.8, 0.5)]
    sobol_designs = qmc.Sobol(2 * reliefs, seed=0).random_base2(
        max(1, count).bit_length()
    )
    designs = [*fractions, *sobol_designs * np.repeat([0.7, 1.0], reliefs)]
    return [bounds[:, 0] + part * np.ptp(bounds, axis=1) for part in designs[:count]]


@dataclass(frozen=True)
class BestRelief:
    """A design and what it gives.

    design : magnitudes [um], then lengths [base pitches]
    peak_to_peak : of the transmission error at each torque (t,) [m]
    evaluations : solutions of the mesh cycle at all torques; starts : of the search
    """

    design: Array
    peak_to_peak: Array
    value: float
    evaluations: int
    starts: int


def peak_to_peak(ste: Array) -> Array:
    """Peak to peak of transmission errors (t, p), at each torque."""
    return np.asarray(np.ptp(ste, axis=1))


def objective_value(ranges: Array, objective: Objective) -> float:
    return float(ranges.max() if objective == "largest" else ranges.mean())


def find_best_relief(
    problem: ReliefProblem,
    starts: Sequence[Array],
    objective: Objective = "largest",
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> BestRelief:
    """The best of local searches from several designs, then near the best of them.

    The largest of many peak-to-peak values has no derivative where two are equal. Each
    step is therefore the solution of a linear program for a design and limits of the
    transmission error at each torque, with a constraint for each position (epigraph
    form), in a trust region that grows and shrinks with the gain.
    """
    best, best_value, evaluations = starts[0], np.inf, 0
    random = np.random.default_rng(0)
    bounds = np.array(problem.bounds)
    neighbours = NEIGHBOURS[: len(starts)]
    total = len(starts) + len(neighbours)
    for number in range(total):
        progress(number, total)
        if number < len(starts):
            start = starts[number]
        else:
            way = neighbours[number - len(starts)] * random.uniform(
                -1.0, 1.0, best.size
            )
            start = np.clip(best + way * np.ptp(bounds, axis=1), *bounds.T)
        design, value, count = _local_search(problem, start, objective)
        evaluations += count
        if value < best_value:
            best, best_value = design, value
    progress(total, total)
    ranges = peak_to_peak(problem.ste(best)[0])
    return BestRelief(best, ranges, best_value, evaluations, len(starts))


def _local_search(
    problem: ReliefProblem, start: Array, objective: Objective
) -> tuple[Array, float, int]:
    """Design, its value [m], and the number of solutions of the mesh cycle.

    Sequential linear programming in a trust region, over scaled designs.
    """
    bounds = np.array(problem.bounds)
    scale = np.ptp(bounds, axis=1)
    design, radius = start, FIRST_RADIUS
    ste, slopes = problem.ste(design)
    value, evaluations = objective_value(peak_to_peak(ste), objective), 1
    for _ in range(MAX_STEPS):
        low = np.maximum((bounds[:, 0] - design) / scale, -radius)
        high = np.minimum((bounds[:, 1] - design) / scale, radius)
        step, predicted = _linear_step(ste, slopes * scale, (low, high), objective)
        if value - predicted < RELATIVE_GAIN * value:
            break
        candidate = np.clip(design + scale * step, *bounds.T)
        ste_there, slopes_there = problem.ste(candidate)
        evaluations += 1
        reached = objective_value(peak_to_peak(ste_there), objective)
        gain = (value - reached) / (value - predicted)
        if gain > 0.0:
            design, ste, slopes, value = candidate, ste_there, slopes_there, reached
        radius *= 2.0 if gain > GOOD_GAIN else 1.0 if gain > POOR_GAIN else 0.3
        if radius < MIN_RADIUS:
            break
    return design, value, evaluations


def _linear_step(
    ste: Array, slopes: Array, limits: tuple[Array, Array], objective: Objective
) -> tuple[Array, float]:
    """Step within limits that makes the linearised objective least, and its value [m].

    Unknowns are the step, the largest and the smallest transmission error at each
    torque [um], and the largest of their differences [um].
    """
    from scipy.optimize import linprog

    torques, positions, size = slopes.shape
    rows = np.zeros((2, torques, positions, size + 2 * torques + 1))
    rows[0, ..., :size], rows[1, ..., :size] = slopes / MICRO, -slopes / MICRO
    differences = np.zeros((torques, size + 2 * torques + 1))
    differences[:, -1] = -1.0
    for t in range(torques):
        rows[0, t, :, size + t] = -1.0
        rows[1, t, :, size + torques + t] = 1.0
        differences[t, size + t], differences[t, size + torques + t] = 1.0, -1.0
    at_most = np.concatenate([-ste.ravel(), ste.ravel(), np.zeros(torques)]) / MICRO
    weights = differences.mean(axis=0)
    if objective == "largest":
        weights = np.zeros_like(weights)
    weights[-1] = 1.0 if objective == "largest" else 0.0
    solution = linprog(
        weights,
        A_ub=np.concatenate([rows.reshape(-1, rows.shape[-1]), differences]),
        b_ub=at_most,
        bounds=[*zip(*limits, strict=True), *[(None, None)] * (2 * torques + 1)],
        method="highs",
    )
    if solution.x is None or solution.fun is None:
        return np.zeros(size), objective_value(peak_to_peak(ste), objective)
    return solution.x[:size], MICRO * float(solution.fun)
