"""Bifurcations of periodic motions by their Floquet multipliers.

A motion is stable where no multiplier is beyond the unit circle. Along a branch a
multiplier leaves it at +1 in a fold or where branches cross, at -1 where the period
doubles, and as a pair elsewhere, where motions of two frequencies begin.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import groupby
from typing import Protocol, TypeVar

import numpy as np

from lumped.common.array_types import Complex

FOLD, DOUBLING = "fold", "period doubling"
CROSSING, TORUS = "branch point", "torus"
HALVED = "the period is half of it again"  # why a branch of a doubled period ends
REAL_TOL = 1e-9  # imaginary part of a multiplier that is real


class HasStability(Protocol):
    """A point of any branch."""

    @property
    def stable(self) -> bool: ...


P = TypeVar("P", bound=HasStability)


def stability_segments(points: Sequence[P]) -> Iterator[tuple[bool, list[P]]]:
    """Stretches of equal stability; each goes on to the first point of the next."""
    last: list[P] = []
    for stable, group in groupby(points, lambda point: point.stable):
        segment = list(group)
        yield stable, last + segment
        last = segment[-1:]


def multiplier_test(multipliers: Complex, value: float) -> float:
    """Changes its sign where a real multiplier passes through 1 or -1."""
    return float(np.prod(multipliers * value - 1.0).real)


def bifurcation_test(kind: str) -> Callable[[Complex], float] | None:
    """A function of multipliers that is zero in bifurcations of a kind, and around them
    not; None of crossings, around which another branch is as near."""
    tests: dict[str, Callable[[Complex], float]] = {
        FOLD: partial(multiplier_test, value=1.0),
        DOUBLING: partial(multiplier_test, value=-1.0),
        TORUS: lambda multipliers: pair_modulus(multipliers) - 1.0,
    }
    return tests.get(kind)


def pair_modulus(multipliers: Complex) -> float:
    """Largest modulus of complex multipliers, NaN where all are real."""
    pairs = np.abs(multipliers[np.abs(multipliers.imag) > REAL_TOL])
    return float(pairs.max()) if pairs.size else float("nan")
