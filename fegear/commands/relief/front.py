"""Compromises of reliefs between the lowest and the highest torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fegear.commands.relief.best_relief import (
    BestRelief,
    find_best_relief,
    starting_designs,
)
from fegear.commands.relief.objective import ReliefObjective
from fegear.commands.relief.relief_problem import ReliefProblem
from lumped.common.array_types import Array

END_STARTS = 5  # searches for either end of the front
MIN_FACTOR = 0.02  # of the torque that counts less, at the ends of the front


@dataclass(frozen=True)
class Compromise:
    """A design that no other one of the front beats at both torques.

    design : as in `BestRelief`; measures : at the lowest and the highest torque [m]
    """

    design: Array
    measures: Array


def relief_front(
    problem: ReliefProblem,
    objective: ReliefObjective,
    count: int,
    starts: tuple[Array, ...] = (),
    progress: Callable[[int, int], None] = lambda solved_count, total: None,
) -> tuple[list[Compromise], int]:
    """Compromises from the best at the lowest torque on, and solutions of the cycle.

    Every weight makes the larger of two weighted measures least, which reaches all of
    a front, also where it is not convex. Searches start at the neighbours' designs,
    from either end of the front in turn.

    starts : further designs from which every search starts
    """
    ends = np.array([problem.torques.min(), problem.torques.max()])
    pair = replace(problem, torques=ends)
    shares = np.linspace(0.0, 1.0, count)
    weights = [np.maximum([1.0 - share, share], MIN_FACTOR) for share in shares]
    goals = [replace(objective, factors=tuple(w / w.max())) for w in weights]
    best: list[BestRelief | None] = [None] * count
    order = [*range(count), *reversed(range(count))]
    evaluations = 0
    for solved_count, i in enumerate(order):
        progress(solved_count, len(order))
        before = i - 1 if solved_count < count else i + 1
        designs = [*starts] if solved_count < count else []
        neighbour = best[before] if 0 <= before < count else None
        designs += [neighbour.design] if neighbour else []
        if i in (0, count - 1) and solved_count < count:
            designs += starting_designs(pair, END_STARTS)
        if not designs:
            continue
        solved = find_best_relief(pair, designs, goals[i])
        evaluations += solved.evaluations
        existing = best[i]
        if existing is None or solved.value < existing.value:
            best[i] = solved
    progress(len(order), len(order))
    points = [Compromise(one.design, one.measures) for one in best if one]
    return _without_dominated(points), evaluations


def _without_dominated(points: list[Compromise]) -> list[Compromise]:
    """Points in the order of the first measure, each better in the second."""
    front: list[Compromise] = []
    for point in sorted(points, key=lambda one: tuple(one.measures)):
        if not front or point.measures[1] < front[-1].measures[1]:
            front.append(point)
    return front
