"""Newton shooting for motions that converge slowly.

The periodic motion is the fixed point of the map over a period. Newton's method finds
it from any section close to it, at the cost of the derivative of the map: as many
perturbed motions as there are variables. The derivative also shows whether the fixed
point is stable. A motion that would leave the fixed point again, or is far from it,
must settle by integration, and so must one for which the map is far from linear on the
way to the fixed point.
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
ROUNDS = 8  # Newton steps with one derivative
LARGEST = 0.2  # largest first step per range of deflection: farther motions may differ
MAX_LAST_CHANGE = (
    0.5  # largest last change, per range, of a motion that may be within LARGEST
)
MAX_DECAY_RATIO = (
    20.0  # periods still to settle, per period passed, of a very slow decay
)
CONTRACTS = 0.2  # largest ratio of successive steps: the map is nearly linear
NEWTON_TOL_RATIO = 0.1  # largest error after the last round, in tolerances
CERTAIN = 0.01  # second step over the first up to which the first derivative suffices
SQUARINGS = 14  # squarings of a derivative: multipliers above 0.9995 count as 1
BEYOND = 1e12  # size of a power of a matrix above which its powers grow


class ShootingStepper(Protocol):
    """Stepper whose motions can leap, see `lumped.steady.steppers.FixedStepper`."""

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


def integrate_or_shoot(
    stepper: ShootingStepper, state: Array, at: Speed, check: Convergence, most: int
) -> tuple[Array, bool]:
    """Advance as `Stepper.advance` does, and leap where that is faster than settling.

    A motion is integrated for half as long as a leap takes, as long as its changes show
    that it is far away, and after a failed leap for as long as it ran before.
    """
    before, leap, on = check.period, jacobian_cost(stepper) // 2, False
    while True:
        passed = check.period - before
        onward, many = at.after(passed), min(leap, most) - passed
        settled = stepper.settle(state, onward, check, max(many, 1), on)
        passed, on = check.period - before, True
        if settled or passed >= most:
            return state, settled
        at.watch(passed)
        multiple, more, last = estimate_decay(check)
        cost = jacobian_cost(stepper) * multiple
        if more <= cost or math.inf > last > MAX_LAST_CHANGE:
            leap = passed + max(math.ceil(min(more, cost)), 1)
            continue
        fixed_point = shoot_fixed_point(stepper, state, at, check, multiple)
        if fixed_point is not None:
            return fixed_point, True
        leap, on = 2 * passed, False


def jacobian_cost(stepper: ShootingStepper) -> int:
    """Number of common periods whose integration takes as long as a leap.

    Most of it is the derivative, and powers of that which show whether it contracts.
    """
    return 8 + 3 * stepper.system.angular.size // 2


def shoot_fixed_point(
    stepper: ShootingStepper, state: Array, at: Speed, check: Convergence, multiple: int
) -> Array | None:
    """Stable motion near a state that repeats after `multiple` common periods, or
    None."""
    mapping, size = SectionMap(stepper, at, multiple), partial(distance, check)
    try:
        fixed_point = stable_fixed_point(
            mapping, stepper.section_of(state), size, check.tolerance
        )
        if fixed_point is None:
            return None
        check.counts[MULTIPLE] = mapping.shortest(fixed_point, size, check.tolerance)
    except ArithmeticError:
        return None
    check.counts[PERIOD] += mapping.passed
    return stepper.state_of(fixed_point)


@dataclass
class SectionMap:
    """Map of the sections of a motion over a number of common periods.

    passed : common periods integrated so far
    """

    stepper: ShootingStepper
    at: Speed
    multiple: int
    passed: int = 0

    @cached_property
    def _check(self) -> Convergence:
        """Convergence that stores sections; only equality to the last digit repeats."""
        check = self.stepper.begin(self.stepper.start(), self.at.settings)
        return check._replace(tolerance=0.0, accept_immediately=False)

    def after(self, x: Array, on: bool = True) -> tuple[Array, Array]:
        """Next two sections of a motion that starts from x.

        on : whether to use for the forces before x those of the motion integrated
            last, which are more accurate than extrapolated ones if it was close to x
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
        """Derivative of the map: the images of small changes of a section."""
        self.passed += self.multiple
        state = self.stepper.state_of(x)
        return self.stepper.monodromy(state, self.at, self.multiple)[1]

    def shortest(
        self, x: Array, size: Callable[[Array], float], tolerance: float
    ) -> int:
        """Least number of common periods after which a periodic motion repeats."""
        for multiple in range(1, self.multiple):
            if self.multiple % multiple == 0:
                one, two = replace(self, multiple=multiple).after(x)
                if size(two - one) < tolerance:
                    return multiple
        return self.multiple


def distance(check: Convergence, difference: Array) -> float:
    """Size of a difference of two sections (2 n,), see `section_distances`."""
    return float(section_distances(check, difference.reshape(1, 2, -1))[0])


def section_distances(check: Convergence, differences: Array) -> Array:
    """Sizes (k,) of differences (k, 2, n) of sections, relative to the range of
    deflection, of the worst mesh."""
    squares = (differences**2).sum(axis=1) @ (check.shapes**2).T
    return np.asarray(np.sqrt(squares / check.scale**2).max(axis=1))


def estimate_decay(check: Convergence) -> tuple[int, float, float]:
    """Common periods over which the change of a motion decreases, the number left to
    settle at that rate, and the last change in ranges of deflection; one and twice
    infinity if the change does not decrease."""
    slots, now = check.sections.shape[0], check.period
    back = (now - np.arange(1 + min(slots - 1, now))) % slots
    sections, estimate = check.sections[back], (1, math.inf, math.inf)
    for multiple in range(1, min((slots - 1) // 2, now // 2) + 1):
        changes = section_distances(check, np.diff(sections[::multiple], axis=0))
        half = changes.size // 2
        last, first = float(changes[:half].max()), float(changes[half:].max())
        if 0.0 < last < first:
            rate = math.log(first / last) / (half * multiple)
            remaining = last / min(rate * multiple, 1.0)
            more = max(math.log(remaining / check.tolerance), 0.0) / rate
            if more < estimate[1]:
                estimate = multiple, more, last
            if more < MAX_DECAY_RATIO * now:
                break
    return estimate


def stable_fixed_point(
    mapping: SectionMap,
    section: Array,
    size: Callable[[Array], float],
    tolerance: float,
) -> Array | None:
    """Stable fixed point (u,) near a section.

    size : function that returns the size of a difference of sections, in ranges of
        deflection
    Returns None if the fixed point is far or unstable, or if the map is far from
    linear on the way to it.
    """
    from scipy.linalg import lu_factor, lu_solve

    x, mapped = mapping.after(section)
    derivative = mapping.derivative(x)
    if not is_stable(derivative):
        return None
    factors, steps = lu_factor(np.eye(section.size) - derivative), list[float]()
    for _ in range(ROUNDS):
        step = np.asarray(lu_solve(factors, mapped - x), np.float64)
        steps.append(size(step))
        ratio = steps[-1] / steps[-2] if len(steps) > 1 else 0.0
        if not (steps[0] <= LARGEST and ratio <= CONTRACTS):
            return None
        x += step
        # the second step may lack forces before the start, the others the remainder
        left = steps[-1] * (ratio if len(steps) > 2 else 1.0)
        if left < NEWTON_TOL_RATIO * tolerance:
            break
        x, mapped = mapping.after(x, on=len(steps) > 1)
    else:
        return None
    # Newton's second step is the change of the derivative over its distance from 1
    changed = steps[1] / steps[0] if len(steps) > 1 else 0.0
    return x if changed < CERTAIN or is_stable(mapping.derivative(x)) else None


def is_stable(matrix: Array) -> bool:
    """Whether powers of a matrix vanish after no more than SQUARINGS squarings."""
    for _ in range(SQUARINGS):
        size = np.linalg.norm(matrix)
        if size < 1.0:
            return True
        if not size < BEYOND:
            break
        matrix = matrix @ matrix
    return False
