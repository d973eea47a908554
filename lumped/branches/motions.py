"""Periodic motions of lumped systems over a parameter: what a branch solves.

The parameter is the mesh frequency, or any other figure at one mesh frequency.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lumped.branches.balance import HarmonicBalance
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
DIFFERENCE = 1e-6  # of the unit, between systems that tell what a figure changes
KEPT = 8  # systems of neighbouring values


class Family(Protocol):
    """Systems over a parameter."""

    @property
    def unit(self) -> float:
        """Of the parameter, in which a branch is as long as in static deflections."""

    @property
    def is_speed(self) -> bool:
        """Whether the parameter is the mesh frequency."""

    def at(self, value: float) -> tuple[LumpedSystem, float]:
        """The system and the mesh frequency of its first mesh [Hz]."""

    def words(self, value: float) -> str:
        """A value of the parameter, with its name or unit."""


@dataclass(frozen=True, eq=False)
class OverSpeed:
    """One system at all mesh frequencies of its first mesh [Hz]."""

    system: LumpedSystem
    unit: float = 1000.0
    is_speed = True

    def at(self, value: float) -> tuple[LumpedSystem, float]:
        return self.system, value

    def words(self, value: float) -> str:
        return f"{value:.6g} Hz"


@dataclass(frozen=True, eq=False)
class OverFigure:
    """Systems in which one figure varies, at one mesh frequency [Hz].

    name : of the figure; system_of : the system of a value; unit : of the figure
    """

    name: str
    system_of: Callable[[float], LumpedSystem]
    frequency: float
    unit: float
    is_speed = False

    @lru_cache(maxsize=KEPT)  # noqa: B019  families are few and short-lived
    def at(self, value: float) -> tuple[LumpedSystem, float]:
        return self.system_of(value), self.frequency

    def words(self, value: float) -> str:
        return f"{self.name} = {value:.6g}"


@dataclass(frozen=True, eq=False)
class Motions:
    """The equations of motions that repeat after some common periods of the meshes.

    harmonics, multiple : as of `HarmonicBalance`, which takes the unknowns apart
    """

    family: Family
    harmonics: int
    multiple: int = 1

    def at(self, value: float) -> tuple[HarmonicBalance, float]:
        """The equations at a value of the parameter, and the mesh frequency [Hz]."""
        system, frequency = self.family.at(value)
        return self._balance(system), frequency

    @lru_cache(maxsize=KEPT)  # noqa: B019  as long as its branches are followed
    def _balance(self, system: LumpedSystem) -> HarmonicBalance:
        return HarmonicBalance(system, self.harmonics, self.multiple)

    def equations(self, x: Array, value: float) -> tuple[Array, Array, Array]:
        """Errors (u,), by x (u, u) and by the parameter (u,)."""
        balance, frequency = self.at(value)
        errors, by_x, by_frequency = balance.equations(x, frequency)
        if self.family.is_speed:
            return errors, by_x, by_frequency
        # the tangent need not be exact: Newton's method and folds do not depend on it
        step = DIFFERENCE * self.family.unit
        beside, frequency = self.at(value + step)
        return errors, by_x, (beside.errors(x, frequency) - errors) / step

    def figures(self, x: Array, value: float) -> dict[str, Array]:
        """As of a sweep's response, (m,) each; see `lumped.measures`."""
        balance, frequency = self.at(value)
        return balance.figures(x, frequency)

    def monodromy(self, x: Array, value: float) -> Array:
        """What a small change of state becomes in a period (2 n, 2 n)."""
        balance, frequency = self.at(value)
        return balance.monodromy(x, frequency)
