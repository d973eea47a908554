"""Periodic motions of lumped systems over a parameter: what a branch solves.

The parameter is the mesh frequency, or any other figure at one mesh frequency.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import ClassVar, Literal, Protocol

from lumped.branches.balance import MAX_UNKNOWNS, HarmonicBalance
from lumped.branches.period_map import SPRING_STEPS, PeriodMap
from lumped.common.array_types import Array
from lumped.train.system import LumpedSystem

DIFFERENCE_STEP = 1e-6  # of the unit, between systems that tell what a figure changes
# Harmonics of the first mesh, of motions that are integrated
MAX_HARMONICS = 80
CACHE_SIZE = 8  # systems of neighbouring values
PeriodicMotion = HarmonicBalance | PeriodMap
Solver = Literal["balance", "shooting"]  # of periodic motions of springs


class Family(Protocol):
    """Systems over a parameter."""

    @property
    def unit(self) -> float:
        """Scale of the parameter, such that 1 counts as a static deflection does."""

    @property
    def is_speed(self) -> bool:
        """Whether the parameter is the mesh frequency."""

    def neighbour(self, value: float) -> float:
        """A neighbouring value, which tells what a change of the parameter does."""

    def within(self, value: float) -> float:
        """The nearest value that has a system."""

    def at(self, value: float) -> tuple[LumpedSystem, float]:
        """The system and the mesh frequency of its first mesh [Hz]."""

    def label_of(self, value: float) -> str:
        """A value of the parameter, with its name or unit."""


@dataclass(frozen=True, eq=False)
class SpeedFamily:
    """One system at all mesh frequencies of its first mesh [Hz]."""

    system: LumpedSystem
    unit: float = 1000.0
    is_speed: ClassVar[bool] = True
    label: ClassVar[str] = "mesh frequency of the first mesh [Hz]"

    def neighbour(self, value: float) -> float:
        return value * (1.0 + DIFFERENCE_STEP)

    def within(self, value: float) -> float:
        return value

    def at(self, value: float) -> tuple[LumpedSystem, float]:
        return self.system, value

    def label_of(self, value: float) -> str:
        return f"{value:.6g} Hz"


@dataclass(frozen=True, eq=False)
class ParameterFamily:
    """Systems in which one figure varies, at one mesh frequency [Hz].

    name : of the figure; system_of : the system of a value
    limits : of the figure, beyond which there may be no system
    """

    name: str
    system_of: Callable[[float], LumpedSystem]
    frequency: float
    limits: tuple[float, float]
    is_speed: ClassVar[bool] = False

    @property
    def unit(self) -> float:
        return 0.5 * (self.limits[1] - self.limits[0])

    def neighbour(self, value: float) -> float:
        inward = 1.0 if value < sum(self.limits) / 2.0 else -1.0
        return value + inward * DIFFERENCE_STEP * self.unit

    def within(self, value: float) -> float:
        return min(max(value, self.limits[0]), self.limits[1])

    @cached_property
    def _kept(self) -> Callable[[float], LumpedSystem]:
        return lru_cache(maxsize=CACHE_SIZE)(self.system_of)

    def at(self, value: float) -> tuple[LumpedSystem, float]:
        return self._kept(value), self.frequency

    def label_of(self, value: float) -> str:
        return f"{self.name} = {value:.6g}"


@dataclass(frozen=True, eq=False)
class PeriodicProblem:
    """The equations of motions that repeat after some common periods of the meshes.

    harmonics, multiple, steepness : as of `HarmonicBalance`, which takes unknowns
        apart; the coupled model has a `PeriodMap`, and springs if the solver is
        shooting
    """

    family: Family
    harmonics: int
    multiple: int = 1
    steepness: float | None = None
    solver: Solver = "balance"

    def at(self, value: float) -> tuple[PeriodicMotion, float]:
        """The equations at a value of the parameter, and the mesh frequency [Hz]."""
        system, frequency = self.family.at(value)
        return self._balances(system), frequency

    @cached_property
    def _balances(self) -> Callable[[LumpedSystem], PeriodicMotion]:
        """Equations of systems, kept as long as these motions are."""

        def balance(system: LumpedSystem) -> PeriodicMotion:
            if system.contacts is not None:
                return PeriodMap(system, self.multiple)
            if self.solver == "shooting":
                return PeriodMap(system, self.multiple, SPRING_STEPS)
            return HarmonicBalance(
                system, self.harmonics, self.multiple, self.steepness
            )

        return lru_cache(maxsize=CACHE_SIZE)(balance)

    @cached_property
    def finer(self) -> PeriodicProblem:
        """These motions with more harmonics, as many as are allowed."""
        balance, _ = self.at(self.family.within(math.inf))
        if not isinstance(balance, HarmonicBalance):
            raise TypeError("motions that are integrated have no harmonic balance")
        max_harmonics = (MAX_UNKNOWNS // balance.shape[1] - 1) // (2 * balance.length)
        finer = max(self.harmonics, min(MAX_HARMONICS, max_harmonics))
        return replace(self, harmonics=finer)

    def equations(self, x: Array, value: float) -> tuple[Array, Array, Array]:
        """Errors (u,), by x (u, u) and by the parameter (u,)."""
        inside = self.family.within(value)
        balance, frequency = self.at(inside)
        errors, by_x, by_frequency = balance.equations(x, frequency)
        if self.family.is_speed:
            return errors, by_x, by_frequency
        # solutions and folds do not depend on how exact this is
        neighbour_value = self.family.neighbour(inside)
        neighbour, frequency = self.at(neighbour_value)
        change = (neighbour.errors(x, frequency) - errors) / (neighbour_value - inside)
        # straight on beyond a limit, so that branches pass through it
        return errors + (value - inside) * change, by_x, change

    def figures(self, x: Array, value: float) -> dict[str, Array]:
        """Figures of a sweep's response, (m,) each; see `lumped.steady.measures`."""
        balance, frequency = self.at(value)
        return balance.figures(x, frequency)

    def monodromy(self, x: Array, value: float) -> Array:
        """Derivative of the state after a period by the state (2 n, 2 n)."""
        balance, frequency = self.at(value)
        return balance.monodromy(x, frequency)
