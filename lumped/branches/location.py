"""Bifurcations of periodic motions located by shooting.

Harmonic balance leaves harmonics out and so misplaces them. Here the state z and the
parameter p that a period of integration takes back to themselves, P(z, p) = z, are
followed for a short way along their curve, until the multipliers of the integrated
motion say that something changes. Of models 1 to 3: steps that end on contact changes
are exact enough for it, fixed ones, which the coupled model takes, are not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from lumped.branches.balance import HarmonicBalance
from lumped.branches.motions import PeriodicProblem
from lumped.branches.shooting import exact_steps
from lumped.common.array_types import Array, Complex
from lumped.common.checks import require_present
from lumped.continuation.arc_length import NoSolution
from lumped.steady.steady_state import Diverged, Speed
from lumped.steady.steppers import stepper_of

Test = Callable[[Complex], float]
# Steps of a period of the fastest mesh, between which a motion is interpolated
STEPS_PER_PERIOD = 256
# Largest last correction, in scaled unknowns; the next is a thousandth
NEWTON_TOL = 1e-6
SECANT_TOL = 1e-9  # of a secant, whose error is some times this
# To the second point of the secant, and beyond all of them
FIRST_SECANT_STEP, MAX_STEP = 1e-4, 0.2
MAX_SHIFT = 0.02  # of the parameter's unit, within which a bifurcation is the one meant
DIFFERENCE_STEP = 1e-5  # of the parameter's unit
MAX_CORRECTIONS, MAX_SECANTS = 12, 8


@dataclass(frozen=True, eq=False)
class Shooting:
    """Integrates motions, in scaled unknowns z = (state, parameter) (2 n + 1,).

    size : (2, n) of displacement and velocity
    """

    motions: PeriodicProblem
    size: Array

    @property
    def unit(self) -> float:
        return self.motions.family.unit

    def value(self, z: Array) -> float:
        """Return the parameter."""
        return self.motions.family.within(float(z[-1] * self.unit))

    def state(self, z: Array) -> Array:
        return z[:-1].reshape(self.size.shape) * self.size

    def change(self, z: Array) -> Array:
        """Change of the scaled state over a period (2 n,); raises NoSolution."""
        balance, frequency = self.motions.at(self.value(z))
        steps, state = exact_steps(balance.system), self.state(z)
        stepper = stepper_of(balance.system, steps)
        try:
            end, _ = stepper.record(state, Speed(frequency, steps), balance.multiple)
        except Diverged as error:
            raise NoSolution("the motion diverges") from error
        return np.asarray(((end - state) / self.size).ravel())

    def monodromy(self, z: Array) -> Array:
        """Derivative of the state after a period by the state (2 n, 2 n)."""
        balance, frequency = self.motions.finer.at(self.value(z))
        if not isinstance(balance, HarmonicBalance):
            raise TypeError("motions that are integrated have no harmonic balance")
        x = integrated_unknowns(balance, self.state(z), frequency)
        return balance.monodromy(x, frequency)

    def derivative(self, z: Array, monodromy: Array) -> Array:
        """Derivative of `change` by the scaled unknowns (2 n, 2 n + 1).

        monodromy : derivative of the state after a period by the state
        """
        size, shifted = self.size.ravel(), z.copy()
        by_state = monodromy * size / size[:, None] - np.eye(size.size)
        shifted[-1] = self._beside(self.value(z)) / self.unit
        by_parameter = (self.change(shifted) - self.change(z)) / (shifted - z)[-1]
        return np.column_stack([by_state, by_parameter])

    def _beside(self, value: float) -> float:
        """A value so far away that the noise of the integration does not count."""
        step = DIFFERENCE_STEP * self.unit
        above = self.motions.family.within(value + step)
        return above if above - value > 0.5 * step else value - step

    def project(self, z: Array, matrix: Array) -> Array:
        """The periodic motion on the plane through z across the last row of a matrix,
        whose other rows are the derivative of the change."""
        start = z
        for _ in range(MAX_CORRECTIONS):
            try:
                step = np.linalg.solve(matrix, np.append(self.change(z), 0.0))
            except np.linalg.LinAlgError:
                break
            z = z - step
            if not np.abs(z - start).max() < MAX_STEP:
                break
            if np.abs(step).max() <= NEWTON_TOL:
                return z
        raise NoSolution("shooting found no periodic motion")


def locate_bifurcation(
    motions: PeriodicProblem, x: Array, value: float, test: Test
) -> float:
    """The parameter near `value` at which a test of the multipliers is zero.

    x : unknowns of harmonic balance there
    Raises NoSolution where there is none so near.
    """
    balance, frequency = motions.at(value)
    state = balance.state(x, frequency)
    size = np.broadcast_to(np.abs(state).max(axis=1, keepdims=True), state.shape)
    shooting = Shooting(motions, size)
    z = np.append((state / size).ravel(), value / shooting.unit)
    derivative = shooting.derivative(z, balance.monodromy(x, frequency))
    tangent = np.linalg.svd(derivative)[2][-1]
    matrix = np.vstack([derivative, tangent])
    start = shooting.project(z, matrix)

    def error(distance: float) -> float:
        solution = (
            shooting.project(start + distance * tangent, matrix) if distance else start
        )
        multipliers = np.linalg.eigvals(shooting.monodromy(solution))
        return test(np.asarray(multipliers, complex))

    critical_value = shooting.value(
        shooting.project(start + find_root(error) * tangent, matrix)
    )
    if not abs(critical_value - value) <= MAX_SHIFT * shooting.unit:
        raise NoSolution("shooting found another bifurcation")
    return critical_value


def find_root(function: Callable[[float], float]) -> float:
    """Root of a function near 0, by secants; raises NoSolution."""
    a, b, previous = 0.0, FIRST_SECANT_STEP, function(0.0)
    for _ in range(MAX_SECANTS):
        value = function(b)
        slope = (value - previous) / (b - a)
        a, b, previous = b, b - value / slope, value
        if not abs(b) < MAX_STEP:
            break
        # a secant's error is of second order
        if abs((b - a) * b) <= SECANT_TOL:
            return b
    raise NoSolution("shooting found no bifurcation there")


def integrated_unknowns(
    balance: HarmonicBalance, state: Array, frequency: float
) -> Array:
    """Unknowns of the motion that a state (2, n) sets out on."""
    from scipy.interpolate import CubicHermiteSpline

    settings = replace(exact_steps(balance.system), steps=STEPS_PER_PERIOD)
    stepper, speed = stepper_of(balance.system, settings), Speed(frequency, settings)
    _, history = stepper.record(state, speed, balance.multiple, with_states=True)
    states = require_present(history.states, "states")
    motion = balance.forces.of_modes(states).swapaxes(0, 1)
    spline = CubicHermiteSpline(history.time, *motion)
    count = 8 * balance.series.rows
    samples = spline(history.time[-1] * np.arange(count) / count)
    return np.asarray(balance.series.of_samples(samples).ravel())
