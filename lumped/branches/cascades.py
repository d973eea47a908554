"""Cascades of period doublings: from branch to branch, each of twice the period.

The intervals between successive doublings shrink by ratios that tend to Feigenbaum's
constant, M. J. Feigenbaum, J. Stat. Phys. 19 (1978) 25, so that infinitely many
doublings end at a parameter near by, beyond which motions are chaotic.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lumped.branches.periodic import DOUBLING_TOL
from lumped.branches.points import BranchPoint, PeriodicBranch
from lumped.continuation.bifurcations import DOUBLING

FEIGENBAUM = 4.669201609  # limit of the ratios of intervals
RMS_RTOL = 0.05  # between a doubling and the end of the branch that begins in it
MIN_DOUBLINGS = 2  # of a cascade


@dataclass(frozen=True)
class Cascade:
    """Successive period doublings.

    multiples : common periods of the motion that doubles; parameters : where it does
    """

    multiples: tuple[int, ...]
    parameters: tuple[float, ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        """Ratio of each interval between doublings to the next one."""
        intervals = np.diff(self.parameters)
        return tuple(float(a / b) for a, b in pairwise(intervals))

    @property
    def limit(self) -> float:
        """Parameter of infinitely many doublings, from the last two of them."""
        before, last = self.parameters[-2:]
        return last + (last - before) / (FEIGENBAUM - 1.0)


def find_cascades(branches: Sequence[PeriodicBranch], unit: float) -> list[Cascade]:
    """Cascades of two doublings or more, each as long as the branches show.

    unit : scale of the parameter
    """
    children = {
        id(point): child
        for parent in branches
        for point in _doublings(parent)
        if (child := _child_of(parent, point, branches, unit)) is not None
    }
    later = {id(point) for child in children.values() for point in child.points}
    cascades = []
    for branch in branches:
        for point in _doublings(branch):
            if id(point) in later:
                continue
            multiples, parameters = [branch.multiple], [point.best_parameter]
            for multiple, doubling in _chain(point, children):
                multiples.append(multiple)
                parameters.append(doubling.best_parameter)
            if len(multiples) >= MIN_DOUBLINGS:
                cascades.append(Cascade(tuple(multiples), tuple(parameters)))
    return cascades


def _doublings(branch: PeriodicBranch) -> list[BranchPoint]:
    return [point for point in branch.points if point.kind == DOUBLING]


def _chain(
    point: BranchPoint, children: dict[int, PeriodicBranch]
) -> Iterator[tuple[int, BranchPoint]]:
    """Doublings that follow one, each the first on the branch that begins there."""
    while (child := children.get(id(point))) is not None:
        doublings = _doublings(child)
        if not doublings:
            return
        first, last = (_distance(end, point) for end in _ends(child))
        point = doublings[0] if first <= last else doublings[-1]
        yield child.multiple, point


def _child_of(
    parent: PeriodicBranch,
    point: BranchPoint,
    branches: Sequence[PeriodicBranch],
    unit: float,
) -> PeriodicBranch | None:
    """The branch of twice the period with the end nearest to a doubling, if near."""
    candidates = [
        (_distance(end, point), number)
        for number, branch in enumerate(branches)
        if branch.multiple == 2 * parent.multiple
        for end in _ends(branch)
        if _distance(end, point) < DOUBLING_TOL * unit and _is_alike(end, point)
    ]
    return branches[min(candidates)[1]] if candidates else None


def _ends(branch: PeriodicBranch) -> tuple[BranchPoint, BranchPoint]:
    return branch.points[0], branch.points[-1]


def _distance(one: BranchPoint, two: BranchPoint) -> float:
    return abs(one.best_parameter - two.best_parameter)


def _is_alike(one: BranchPoint, two: BranchPoint) -> bool:
    return np.allclose(one.figures["dte_rms"], two.figures["dte_rms"], rtol=RMS_RTOL)
