"""Campbell diagram: modes over the speed, each followed by its shape.

Modes of successive speeds are assigned to each other by the modal assurance criterion
of their states; a step in which it is poor is halved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, linear_sum_assignment

from lumped.common.array_types import Array, Complex
from lumped.common.checks import require_between
from lumped.rotors.whirl import Instability, WhirlModes, WhirlProblem, groups_of_equal

MIN_ASSURANCE = 0.9  # of modes that continue each other, below which steps are halved
LOST_ASSURANCE = 0.3  # below which a mode has ended
MAX_HALVINGS = 8
SPARE_MODES = 8  # that are solved above those that are followed
CROSSING_RTOL = 1e-6  # of a frequency at a crossing, over the order times the speed
SPEED_XTOL = 1e-10  # of a speed at which stability changes, over the speed


@dataclass(frozen=True, eq=False)
class Campbell:
    """Modes over speeds; arrays are (speeds, modes), NaN where a mode has ended.

    speeds : of the system (speeds,) [rad/s]
    modes : at every speed, in the order of those of the first
    """

    speeds: Array
    modes: tuple[WhirlModes, ...]

    @cached_property
    def eigenvalues(self) -> Complex:
        """Growth rate + i frequency [rad/s]."""
        return np.array([one.eigenvalues for one in self.modes])

    @property
    def frequency_Hz(self) -> Array:
        """Damped natural frequencies [Hz]."""
        return self.eigenvalues.imag / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> Array:
        """Damping ratios, negative where vibration grows."""
        return -self.eigenvalues.real / np.abs(self.eigenvalues)

    @property
    def whirl(self) -> Array:
        """From 1, forward circles, to -1, backward ones; see `WhirlModes`."""
        return self._where_present([one.whirl for one in self.modes])

    @property
    def torsion(self) -> Array:
        """Part of the kinetic energy in rotations about the axes."""
        return self._where_present([one.torsion for one in self.modes])

    @property
    def axial(self) -> Array:
        """Part of the kinetic energy in motion along the axes."""
        return self._where_present([one.axial for one in self.modes])

    @property
    def housing(self) -> Array:
        """Part of the kinetic energy in the housing."""
        return self._where_present([one.housing for one in self.modes])

    @property
    def mesh_energy(self) -> Array:
        """Part of the strain energy in all meshes."""
        return self._where_present([one.mesh_energy.sum(axis=0) for one in self.modes])

    def _where_present(self, values: list[Array]) -> Array:
        return np.where(np.isnan(self.eigenvalues.imag), np.nan, values)


def campbell(
    problem: WhirlProblem,
    speeds: Sequence[float],
    modes: int,
    report: Callable[[int], None] = lambda done: None,
) -> Campbell:
    """Follow the lowest modes of the first speed through increasing speeds [rad/s].

    report : called with the number of finished speeds
    """
    require_speeds(speeds)
    pool = modes + SPARE_MODES
    first = problem.solve(speeds[0], pool)
    current = first.take(np.arange(min(modes, first.eigenvalues.size)))
    followed = [current]
    for done, ends in enumerate(pairwise(speeds), start=1):
        report(done)
        current = _step(problem, current, ends, pool)
        followed.append(current)
    return Campbell(np.array(speeds, dtype=float), tuple(followed))


def require_speeds(speeds: Sequence[float]) -> None:
    """Require increasing speeds from 0."""
    for speed in speeds:
        require_between("speed", speed, 0.0, 1e9)
    if not speeds or any(high <= low for low, high in pairwise(speeds)):
        raise ValueError("speeds must be one or more and increase")


def _step(
    problem: WhirlProblem,
    start: WhirlModes,
    ends: tuple[float, float],
    pool: int,
    halvings: int = 0,
) -> WhirlModes:
    """Continue modes from one speed to the next; the eigenvalue of one that ends is
    NaN."""
    low, high = ends
    aligned = align(start.states, problem.solve(high, pool))
    places, assurance = assign(start.states, aligned.states)
    present = ~np.isnan(start.eigenvalues.imag)
    if (assurance[present] < MIN_ASSURANCE).any() and halvings < MAX_HALVINGS:
        middle = 0.5 * (low + high)
        for part in ((low, middle), (middle, high)):
            start = _step(problem, start, part, pool, halvings + 1)
        return start
    following = aligned.take(places)
    following.eigenvalues[~present | (assurance < LOST_ASSURANCE)] = np.nan
    return following


def align(states: Complex, solved: WhirlModes) -> WhirlModes:
    """Turn shapes of equal frequency, which are any of a plane, to those before."""
    aligned = solved.take(np.arange(solved.eigenvalues.size))
    for group in groups_of_equal(solved.eigenvalues):
        if len(group) < 2:
            continue
        overlap = solved.states[:, group].conj().T @ states
        nearest = np.argsort(-(np.abs(overlap) ** 2).sum(axis=0))[: len(group)]
        left, _, right = np.linalg.svd(overlap[:, nearest])
        if len(nearest) == len(group):
            aligned.states[:, group] = solved.states[:, group] @ left @ right
    return aligned


def assign(before: Complex, after: Complex) -> tuple[NDArray[np.intp], Array]:
    """Which mode continues each, and the assurance criterion of both."""
    overlap = np.abs(before.conj().T @ after) ** 2
    norms = np.outer(
        (np.abs(before) ** 2).sum(axis=0), (np.abs(after) ** 2).sum(axis=0)
    )
    assurance = overlap / norms
    missing = max(0, before.shape[1] - after.shape[1])
    padded = np.pad(assurance, ((0, 0), (0, missing)))
    rows, places = linear_sum_assignment(padded, maximize=True)
    values = padded[rows, places]
    return np.minimum(places, after.shape[1] - 1), values


@dataclass(frozen=True)
class UnstableRange:
    """Speeds between which vibration grows [rad/s], within those that were solved.

    kind : flutter or divergence
    frequency : of the fastest growing motion in the middle [rad/s]
    """

    low: float
    high: float
    kind: Instability
    frequency: float


def unstable_ranges(problem: WhirlProblem, diagram: Campbell) -> list[UnstableRange]:
    """Ranges of speed in which vibration grows, ends found by bisection.

    Those between two successive speeds of the diagram are not seen.
    """
    if problem.is_hermitian:
        return []
    edges = [
        _edge(problem, (low, high), one.instability)
        for (low, high), (one, two) in zip(
            pairwise(diagram.speeds), pairwise(diagram.modes), strict=True
        )
        if one.instability != two.instability
    ]
    borders = [diagram.speeds[0], *edges, diagram.speeds[-1]]
    ranges = []
    for low, high in pairwise(borders):
        middle = problem.solve(0.5 * (low + high))
        if (kind := middle.instability) is not None:
            fastest = middle.growing[middle.growing.real.argmax()]
            ranges.append(
                UnstableRange(float(low), float(high), kind, abs(float(fastest.imag)))
            )
    return ranges


def _edge(
    problem: WhirlProblem, ends: tuple[float, float], first: Instability | None
) -> float:
    low, high = ends
    while high - low > SPEED_XTOL * high:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if problem.solve(middle).instability == first:
            low = middle
        else:
            high = middle
    return high


def crossings(
    problem: WhirlProblem, diagram: Campbell, order: float
) -> list[WhirlModes]:
    """Where modes of a diagram have a frequency of `order` times the speed.

    The one mode at each of these speeds, by rising speed: roots of every curve between
    two speeds. They are those of damped motion.
    """
    distance = diagram.eigenvalues.imag - order * diagram.speeds[:, None]
    crossed = [
        _crossing(problem, diagram, (row, mode), order)
        for mode in range(distance.shape[1])
        for row, (one, two) in enumerate(pairwise(distance[:, mode]))
        if one * two < 0.0 or (two == 0.0 != one)
    ]
    present = [one for one in crossed if one is not None]
    return sorted(present, key=lambda one: one.speed)


def _crossing(
    problem: WhirlProblem, diagram: Campbell, place: tuple[int, int], order: float
) -> WhirlModes | None:
    """Root of a mode's curve after a row of the diagram.

    None where another mode continues the curve once steps are shorter.
    """
    row, mode = place
    low, high = diagram.speeds[row], diagram.speeds[row + 1]
    start = diagram.modes[row].take(np.array([mode]))
    pool = diagram.modes[row].eigenvalues.size + SPARE_MODES
    solved = {low: start}

    def distance(speed: float) -> float:
        if speed not in solved:
            # from the nearest speed below, so that steps become short at the root
            before = solved[max(one for one in solved if one < speed)]
            solved[speed] = _step(problem, before, (before.speed, speed), pool)
        return float(solved[speed].eigenvalues[0].imag) - order * speed

    ends = distance(low), distance(high)
    if not ends[0] * ends[1] <= 0.0:
        return None
    root = brentq(distance, low, high, xtol=SPEED_XTOL * high, rtol=1e-12)
    is_root = abs(distance(root)) <= CROSSING_RTOL * order * high
    return solved[root] if is_root else None
