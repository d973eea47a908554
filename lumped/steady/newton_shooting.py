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

from lumped.common.array_types import Array
from lumped.kernels.arrays import MULTIPLE, PERIOD

if TYPE_CHECKING:
    from lumped.kernels.arrays import Convergence
    from lumped.steady.integration_settings import Settings
    from lumped.steady.steady_state import Speed
    from lumped.train.system import LumpedSystem

MAX_NEWTON_ITERATIONS = 8  # Newton steps with one derivative
# Largest first step per range of deflection: farther motions may differ
MAX_FIRST_STEP = 0.2
# Largest last change, per range, of a motion that may be within MAX_FIRST_STEP
MAX_LAST_CHANGE = 0.5
# Periods still to settle, per period passed, of a very slow decay
MAX_DECAY_RATIO = 20.0
# Largest ratio of successive steps: the map is nearly linear
MAX_CONTRACTION_RATIO = 0.2
NEWTON_TOL_RATIO = 0.1  # largest error after the last round, in tolerances
# Second step over the first up to which the first derivative suffices
MAX_DERIVATIVE_CHANGE = 0.01
MAX_SQUARINGS = 14  # squarings of a derivative: multipliers above 0.9995 count as 1
DIVERGENCE_NORM = 1e12  # size of a power of a matrix above which its powers grow


class ShootingStepper(Protocol):
    """Stepper that supports Newton shooting, `lumped.steady.steppers.FixedStepper`."""

    @property
    def system(self) -> LumpedSystem: ...
    def start(self) -> Array: ...
    def new_convergence(self, state: Array, settings: Settings) -> Convergence: ...
    def section_of(self, state: Array) -> Array: ...
    def state_of(self, section: Array) -> Array: ...
    def settle(
        self,
        state: Array,
        speed: Speed,
        convergence: Convergence,
        max_periods: int,
        continues: bool = False,
    ) -> bool: ...
    def monodromy(
        self, state: Array, speed: Speed, periods: int
    ) -> tuple[Array, Array]: ...


def integrate_or_shoot(
    stepper: ShootingStepper,
    state: Array,
    speed: Speed,
    convergence: Convergence,
    max_periods: int,
) -> tuple[Array, bool]:
    """Reach the periodic motion by integration, or by shooting where that is faster.

    Arguments and results are those of `Stepper.advance`. A motion is integrated for
    half as long as shooting takes, as long as its changes show that it is far away, and
    after failed shooting for as long as it ran before.
    """
    first_period, periods_before_shooting, continues = (
        convergence.period,
        jacobian_cost(stepper) // 2,
        False,
    )
    while True:
        passed = convergence.period - first_period
        offset_speed, periods = (
            speed.offset_by(passed),
            min(periods_before_shooting, max_periods) - passed,
        )
        settled = stepper.settle(
            state, offset_speed, convergence, max(periods, 1), continues
        )
        passed, continues = convergence.period - first_period, True
        if settled or passed >= max_periods:
            return state, settled
        speed.callback(passed)
        multiple, periods_left, last_change = estimate_decay(convergence)
        cost = jacobian_cost(stepper) * multiple
        if periods_left <= cost or math.inf > last_change > MAX_LAST_CHANGE:
            periods_before_shooting = passed + max(
                math.ceil(min(periods_left, cost)), 1
            )
            continue
        fixed_point = shoot_fixed_point(stepper, state, speed, convergence, multiple)
        if fixed_point is not None:
            return fixed_point, True
        periods_before_shooting, continues = 2 * passed, False


def jacobian_cost(stepper: ShootingStepper) -> int:
    """Number of common periods whose integration takes as long as shooting.

    Most of it is the derivative, and powers of that which show whether it contracts.
    """
    return 8 + 3 * stepper.system.angular.size // 2


def shoot_fixed_point(
    stepper: ShootingStepper,
    state: Array,
    speed: Speed,
    convergence: Convergence,
    multiple: int,
) -> Array | None:
    """Stable motion near a state that repeats after `multiple` common periods, or
    None."""
    poincare_map, norm = (
        PoincareMap(stepper, speed, multiple),
        partial(distance, convergence),
    )
    try:
        fixed_point = stable_fixed_point(
            poincare_map, stepper.section_of(state), norm, convergence.tolerance
        )
        if fixed_point is None:
            return None
        convergence.counts[MULTIPLE] = poincare_map.minimal_period(
            fixed_point, norm, convergence.tolerance
        )
    except ArithmeticError:
        return None
    convergence.counts[PERIOD] += poincare_map.passed
    return stepper.state_of(fixed_point)


@dataclass
class PoincareMap:
    """Map of the sections of a motion over a number of common periods.

    passed : common periods integrated so far
    """

    stepper: ShootingStepper
    speed: Speed
    multiple: int
    passed: int = 0

    @cached_property
    def _convergence(self) -> Convergence:
        """Convergence that stores sections; only equality to the last digit repeats."""
        convergence = self.stepper.new_convergence(
            self.stepper.start(), self.speed.settings
        )
        return convergence._replace(tolerance=0.0, accept_immediately=False)

    def two_iterates(self, x: Array, continues: bool = True) -> tuple[Array, Array]:
        """Next two sections of a motion that starts from x.

        continues : whether to use for the forces before x those of the motion
            integrated last, which are more accurate than extrapolated ones if it was
            close to x
        """
        convergence, state = self._convergence, self.stepper.state_of(x)
        convergence.counts[:] = 0
        self.stepper.settle(
            state, self.speed, convergence, 2 * self.multiple, continues
        )
        self.passed += convergence.period
        first, second = (
            convergence.sections[min(times * self.multiple, convergence.period)].ravel()
            for times in (1, 2)
        )
        return first.copy(), second.copy()

    def derivative(self, x: Array) -> Array:
        """Derivative of the map: the images of small changes of a section."""
        self.passed += self.multiple
        state = self.stepper.state_of(x)
        return self.stepper.monodromy(state, self.speed, self.multiple)[1]

    def minimal_period(
        self, x: Array, norm: Callable[[Array], float], tolerance: float
    ) -> int:
        """Least number of common periods after which a periodic motion repeats."""
        for multiple in range(1, self.multiple):
            if self.multiple % multiple == 0:
                one, two = replace(self, multiple=multiple).two_iterates(x)
                if norm(two - one) < tolerance:
                    return multiple
        return self.multiple


def distance(convergence: Convergence, difference: Array) -> float:
    """Norm of a difference of two sections (2 n,), see `section_distances`."""
    return float(section_distances(convergence, difference.reshape(1, 2, -1))[0])


def section_distances(convergence: Convergence, differences: Array) -> Array:
    """Sizes (k,) of differences (k, 2, n) of sections, relative to the range of
    deflection, of the worst mesh."""
    squares = (differences**2).sum(axis=1) @ (convergence.shapes**2).T
    return np.asarray(np.sqrt(squares / convergence.scale**2).max(axis=1))


def estimate_decay(convergence: Convergence) -> tuple[int, float, float]:
    """Return (period multiple, periods left, last change) of the decay of a transient.

    The change over the multiple of the common period decreases at a rate at which the
    motion settles after the periods left; the last change is in ranges of deflection.
    All but the multiple are infinite if no change decreases.
    """
    slots, period = convergence.sections.shape[0], convergence.period
    slot = (period - np.arange(1 + min(slots - 1, period))) % slots
    sections, estimate = convergence.sections[slot], (1, math.inf, math.inf)
    for multiple in range(1, min((slots - 1) // 2, period // 2) + 1):
        changes = section_distances(convergence, np.diff(sections[::multiple], axis=0))
        half = changes.size // 2
        last, first = float(changes[:half].max()), float(changes[half:].max())
        if 0.0 < last < first:
            rate = math.log(first / last) / (half * multiple)
            remaining = last / min(rate * multiple, 1.0)
            periods_left = max(math.log(remaining / convergence.tolerance), 0.0) / rate
            if periods_left < estimate[1]:
                estimate = multiple, periods_left, last
            if periods_left < MAX_DECAY_RATIO * period:
                break
    return estimate


def stable_fixed_point(
    poincare_map: PoincareMap,
    section: Array,
    norm: Callable[[Array], float],
    tolerance: float,
) -> Array | None:
    """Stable fixed point (u,) near a section.

    norm : function that returns the size of a difference of sections, in ranges of
        deflection
    Returns None if the fixed point is far or unstable, or if the map is far from
    linear on the way to it.
    """
    from scipy.linalg import lu_factor, lu_solve

    x, mapped = poincare_map.two_iterates(section)
    derivative = poincare_map.derivative(x)
    if not is_stable(derivative):
        return None
    factors, steps = lu_factor(np.eye(section.size) - derivative), list[float]()
    for _ in range(MAX_NEWTON_ITERATIONS):
        step = np.asarray(lu_solve(factors, mapped - x), np.float64)
        steps.append(norm(step))
        ratio = steps[-1] / steps[-2] if len(steps) > 1 else 0.0
        if not (steps[0] <= MAX_FIRST_STEP and ratio <= MAX_CONTRACTION_RATIO):
            return None
        x += step
        # the second step may lack forces before the start, the others the remainder
        error_estimate = steps[-1] * (ratio if len(steps) > 2 else 1.0)
        if error_estimate < NEWTON_TOL_RATIO * tolerance:
            break
        x, mapped = poincare_map.two_iterates(x, continues=len(steps) > 1)
    else:
        return None
    # Newton's second step is the change of the derivative over its distance from 1
    derivative_change = steps[1] / steps[0] if len(steps) > 1 else 0.0
    return (
        x
        if derivative_change < MAX_DERIVATIVE_CHANGE
        or is_stable(poincare_map.derivative(x))
        else None
    )


def is_stable(matrix: Array) -> bool:
    """Whether powers of a matrix vanish after no more than MAX_SQUARINGS squarings."""
    for _ in range(MAX_SQUARINGS):
        norm = np.linalg.norm(matrix)
        if norm < 1.0:
            return True
        if not norm < DIVERGENCE_NORM:
            break
        matrix = matrix @ matrix
    return False
