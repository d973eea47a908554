"""Periodic motions by shooting: a second opinion on harmonic balance.

The state is looked for that a period of time integration takes back to itself, by
Newton's method with the monodromy of harmonic balance. Integration leaves no harmonics
out: what remains between the two is what harmonic balance does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lumped.branches.motions import PeriodicMotion
from lumped.branches.period_map import SPRING_STEPS, PeriodMap
from lumped.common.array_types import Array
from lumped.continuation.arc_length import NoSolution
from lumped.steady.integration_settings import Settings
from lumped.steady.measures import measure_motion
from lumped.steady.steady_state import Diverged, Speed
from lumped.steady.steppers import stepper_of
from lumped.train.system import LumpedSystem

NEWTON_TOL = 1e-7  # largest last correction, of the state's size
MAX_CORRECTIONS = 20
ADAPTIVE = Settings(method="dopri5", accuracy=1e-11)
FIXED = Settings(steps=512)  # of the coupled model
IN_SPACE = Settings(steps=512)  # of gears that move in space
FINEST = replace(SPRING_STEPS, accuracy=1e-12, steps=256)  # of springs, of a PeriodMap


def exact_steps(system: LumpedSystem) -> Settings:
    """Steps that leave little error of springs, adaptive ones where there are."""
    return ADAPTIVE if system.space is None else IN_SPACE


@dataclass(frozen=True, eq=False)
class Shot:
    """A periodic motion: state (2, n) at the start of its period, figures (m,) each."""

    state: Array
    figures: dict[str, Array]

    def error_of(self, rms: Array) -> float:
        """Error of the RMS (m,) of another solution, relative to the largest."""
        exact = self.figures["dte_rms"]
        return float(np.abs(rms - exact).max() / exact.max())


def shoot(balance: PeriodicMotion, x: Array, frequency: float) -> Shot:
    """The motion near unknowns x at a mesh frequency [Hz].

    Raises NoSolution where corrections do not fade.
    """
    if isinstance(balance, PeriodMap):
        finer = FINEST if balance.system.contacts is None else FIXED
        return _shoot_finer(replace(balance, steps=finer), x, frequency)
    steps = exact_steps(balance.system)
    stepper, speed = stepper_of(balance.system, steps), Speed(frequency, steps)
    state = balance.state(x, frequency)
    change = balance.monodromy(x, frequency) - np.eye(state.size)
    size = np.abs(state).max(axis=1, keepdims=True)
    for _ in range(MAX_CORRECTIONS):
        try:
            end, history = stepper.record(state, speed, balance.multiple)
            step = np.linalg.solve(change, (end - state).ravel()).reshape(state.shape)
        except (Diverged, np.linalg.LinAlgError):
            break
        if np.abs(step / size).max() <= NEWTON_TOL:
            return Shot(state, measure_motion(history))
        state = state - step
    raise NoSolution("shooting found no periodic motion")


def _shoot_finer(motion: PeriodMap, x: Array, frequency: float) -> Shot:
    """The motion near unknowns x by steps of its own."""
    for _ in range(MAX_CORRECTIONS):
        try:
            errors, jacobian, _ = motion.equations(x, frequency)
            step = np.linalg.solve(jacobian, errors)
        except (Diverged, np.linalg.LinAlgError):
            break
        x = x - step
        if np.abs(step).max() <= NEWTON_TOL * motion.size:
            return Shot(motion.state(x, frequency), motion.figures(x, frequency))
    raise NoSolution("shooting found no periodic motion")
