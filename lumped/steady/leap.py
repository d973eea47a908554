"""From a motion that settles slowly to the periodic motion that it approaches.

The map over a period has the periodic motion as its fixed point. Newton's method finds
it from any section near to it, at the cost of the map's derivative: as many changes of
the motion as it has variables. The derivative also tells whether the fixed point is
stable. A motion that would leave it again, or is far from it, has to settle by itself,
as has one between which and the fixed point the map is far from linear.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from lumped.kernels.arrays import MULTIPLE, PERIOD

if TYPE_CHECKING:
    from lumped.kernels.arrays import Convergence
    from lumped.steady.settings import Settings
    from lumped.steady.steady_state import Speed
    from lumped.train.system import LumpedSystem

Array = NDArray[np.float64]
ROUNDS = 8  # with one derivative
LARGEST = 0.2  # of the range of deflection, of the first step: others lie beyond
NEAR = 0.5  # of the range, of the last change of a motion that may be within that
HARDLY = 20.0  # times the periods that passed, of a motion that hardly changes less
CONTRACTS = 0.2  # least contraction of these rounds: the map is nearly linear
EXACT = 0.1  # tolerances, that may be left after the last round
CERTAIN = 0.01  # second step over the first up to which the first derivative will do
SQUARINGS = 14  # of a derivative: multipliers above 0.9995 count as 1
BEYOND = 1e12  # size of a power of a matrix whose powers grow


class Leaping(Protocol):
    """A stepper whose motions leap, `lumped.steady.steppers.FixedStepper`."""

    @property
    def system(self) -> LumpedSystem: ...
    def start(self) -> Array: ...
    def begin(self, state: Array, settings: Settings) -> Convergence: ...
    def section_of(self, state: Array) -> Array: ...
    def state_of(self, section: Array) -> Array: ...
    def settle(
        self, state: Array, at: Speed, check: Convergence, most: int, on: bool = False
    ) -> bool: ...
    def monodromy(
        self, state: Array, at: Speed, periods: int
    ) -> tuple[Array, Array]: ...


def settle_or_leap(
    stepper: Leaping, state: Array, at: Speed, check: Convergence, most: int
) -> tuple[Array, bool]:
    """Advance as `Stepper.advance` does, with a Newton step wherever that takes less
    time than the transient.

    A motion settles by itself for half as long as a leap takes, while its changes show
    that it is far away, and after a leap that failed for as long as it went before.
    """
    before, leap, on = check.period, leap_cost(stepper) // 2, False
    while True:
        passed = check.period - before
        onward, many = at.after(passed), min(leap, most) - passed
        settled = stepper.settle(state, onward, check, max(many, 1), on)
        passed, on = check.period - before, True
        if settled or passed >= most:
            return state, settled
        at.watch(passed)
        multiple, more, last = approached(check)
        cost = leap_cost(stepper) * multiple
        if more <= cost or math.inf > last > NEAR:
            leap = passed + max(math.ceil(min(more, cost)), 1)
            continue
        found = leapt(stepper, state, at, check, multiple)
        if found is not None:
            return found, True
        leap, on = 2 * passed, False


def leap_cost(stepper: Leaping) -> int:
    """Common periods that take about as long as the derivative of one."""
    return 8 + stepper.system.angular.size // 3


def leapt(
    stepper: Leaping, state: Array, at: Speed, check: Convergence, multiple: int
) -> Array | None:
    """The stable motion that repeats after `multiple` common periods and is near to a
    state, None where there is none."""
    mapping, size = SectionMap(stepper, at, multiple), partial(distance, check)
    try:
        found = stable_fixed_point(
            mapping, stepper.section_of(state), size, check.tolerance
        )
        if found is None:
            return None
        check.counts[MULTIPLE] = mapping.shortest(found, size, check.tolerance)
    except ArithmeticError:
        return None
    check.counts[PERIOD] += mapping.passed
    return stepper.state_of(found)


@dataclass
class SectionMap:
    """Sections of a motion, mapped over so many common periods.

    passed : common periods integrated so far
    """

    stepper: Leaping
    at: Speed
    multiple: int
    passed: int = 0

    @cached_property
    def _check(self) -> Convergence:
        """Keeps sections, and finds none that repeat but to the last digit."""
        check = self.stepper.begin(self.stepper.start(), self.at.settings)
        return check._replace(tolerance=0.0, at_once=False)

    def after(self, x: Array, on: bool = True) -> tuple[Array, Array]:
        """The next two sections of a motion that starts from x.

        on : whether forces before x are those of the motion that was integrated last,
            better than those that are extrapolated where it was near
        """
        check, state = self._check, self.stepper.state_of(x)
        check.counts[:] = 0
        self.stepper.settle(state, self.at, check, 2 * self.multiple, on)
        self.passed += check.period
        first, second = (
            check.sections[min(times * self.multiple, check.period)].ravel()
            for times in (1, 2)
        )
        return first.copy(), second.copy()

    def derivative(self, x: Array) -> Array:
        """What small changes of a section become."""
        self.passed += self.multiple
        state = self.stepper.state_of(x)
        return self.stepper.monodromy(state, self.at, self.multiple)[1]

    def shortest(
        self, x: Array, size: Callable[[Array], float], tolerance: float
    ) -> int:
        """Common periods after which a motion that repeats first does so."""
        for multiple in range(1, self.multiple):
            if self.multiple % multiple == 0:
                one, two = replace(self, multiple=multiple).after(x)
                if size(two - one) < tolerance:
                    return multiple
        return self.multiple


def distance(check: Convergence, difference: Array) -> float:
    """Size of a difference of two sections (2 n,), see `distances`."""
    return float(distances(check, difference.reshape(1, 2, -1))[0])


def distances(check: Convergence, differences: Array) -> Array:
    """Sizes (k,) of differences (k, 2, n) of sections, in ranges of deflection of the
    worst mesh."""
    squares = (differences**2).sum(axis=1) @ (check.shapes**2).T
    return np.asarray(np.sqrt(squares / check.scale**2).max(axis=1))


def approached(check: Convergence) -> tuple[int, float, float]:
    """Over how many common periods a motion changes ever less, how many it still takes
    to settle at that rate, and its last change in ranges of deflection; one and twice
    infinity where that is not seen."""
    slots, now = check.sections.shape[0], check.period
    back = (now - np.arange(1 + min(slots - 1, now))) % slots
    sections, found = check.sections[back], (1, math.inf, math.inf)
    for multiple in range(1, min((slots - 1) // 2, now // 2) + 1):
        changes = distances(check, np.diff(sections[::multiple], axis=0))
        half = changes.size // 2
        last, first = float(changes[:half].max()), float(changes[half:].max())
        if 0.0 < last < first:
            rate = math.log(first / last) / (half * multiple)
            left = last / min(rate * multiple, 1.0)
            more = max(math.log(left / check.tolerance), 0.0) / rate
            if more < found[1]:
                found = multiple, more, last
            if more < HARDLY * now:
                break
    return found


def stable_fixed_point(
    mapping: SectionMap,
    section: Array,
    size: Callable[[Array], float],
    tolerance: float,
) -> Array | None:
    """The stable fixed point (u,) that a section is near to.

    size : of a difference of sections, in ranges of deflection
    Returns None where it is far, unstable, or the map far from linear on the way.
    """
    x, mapped = mapping.after(section)
    derivative = mapping.derivative(x)
    if not contracts(derivative):
        return None
    matrix, steps = np.eye(section.size) - derivative, list[float]()
    for _ in range(ROUNDS):
        step = np.asarray(np.linalg.solve(matrix, mapped - x), np.float64)
        steps.append(size(step))
        ratio = steps[-1] / steps[-2] if len(steps) > 1 else 0.0
        if not (steps[0] <= LARGEST and ratio <= CONTRACTS):
            return None
        x += step
        # the second step may miss forces before the start, the others what is left
        left = steps[-1] * (ratio if len(steps) > 2 else 1.0)
        if left < EXACT * tolerance:
            break
        x, mapped = mapping.after(x, on=len(steps) > 1)
    else:
        return None
    # Newton's second step is what the derivative changed over what it is short of 1
    changed = steps[1] / steps[0] if len(steps) > 1 else 0.0
    return x if changed < CERTAIN or contracts(mapping.derivative(x)) else None


def contracts(matrix: Array) -> bool:
    """Whether powers of a matrix vanish; one that takes too many for it does not."""
    for _ in range(SQUARINGS):
        size = np.linalg.norm(matrix)
        if size < 1.0:
            return True
        if not size < BEYOND:
            break
        matrix = matrix @ matrix
    return False
