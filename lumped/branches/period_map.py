"""Periodic motions as fixed points of the map over their period.

Steps through a period take hardly longer with their changes than a Jacobian of harmonic
balance, and leave no harmonics out. Their time grows with the number of periods after
which a motion repeats, that of harmonic balance with its cube. The unknowns are
displacements, and velocities over angular frequencies, at the start of the period.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from lumped.common.array_types import Array
from lumped.steady.integration_settings import Settings
from lumped.steady.measures import measure_motion
from lumped.steady.response import Response
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import AdaptiveStepper, FixedStepper, stepper_of
from lumped.train.system import LumpedSystem

STEPS = Settings(steps=256)  # of the coupled model
# Of springs: steps that end on every change of contact
SPRING_STEPS = Settings(method="dopri5", accuracy=1e-11, steps=128)
DIFFERENCE_STEP = 1e-6  # of a frequency, between two that tell what its change does


@dataclass(frozen=True, eq=False)
class PeriodMap:
    """Motions of a system that repeat after `multiple` common periods.

    steps : by which they are integrated; STEPS of contacts, SPRING_STEPS of springs
    """

    system: LumpedSystem
    multiple: int = 1
    steps: Settings = STEPS

    @property
    def size(self) -> float:
        """Norm of the unknowns under the loads alone."""
        return float(np.abs(self.system.static_state[0]).max())

    def state(self, x: Array, frequency: float) -> Array:
        """Displacement and velocity (2, n) at the start of the period."""
        return self._stepper.state_of(x)

    def _ends(self, x: Array, frequency: float, periods: int = 0) -> Array:
        """Unknowns after so many common periods, those of the motion if 0."""
        state = self.state(x, frequency)
        end_state, _ = self._stepper.record(
            state, Speed(frequency, self.steps), periods or self.multiple
        )
        return self._stepper.section_of(end_state)

    @cached_property
    def _stepper(self) -> FixedStepper | AdaptiveStepper:
        return stepper_of(self.system, self.steps)

    def equations(self, x: Array, frequency: float) -> tuple[Array, Array, Array]:
        """Errors of the equations (u,), their Jacobian (u, u), and what a change of
        frequency makes of them (u,) per Hz.

        Raises Diverged, an ArithmeticError, where the motion leaves every bound.
        """
        state, speed = self.state(x, frequency), Speed(frequency, self.steps)
        end_state, transfer = self._stepper.monodromy(state, speed, self.multiple)
        ends, change = self._stepper.section_of(end_state), DIFFERENCE_STEP * frequency
        end_by_frequency = (self._ends(x, frequency + change) - ends) / change
        return x - ends, np.eye(x.size) - transfer, -end_by_frequency

    def errors(self, x: Array, frequency: float) -> Array:
        """Errors of the equations (u,) alone."""
        return x - self._ends(x, frequency)

    def monodromy(self, x: Array, frequency: float) -> Array:
        """What a small change of displacement and velocity becomes in a period
        (2 n, 2 n)."""
        state, speed = self.state(x, frequency), Speed(frequency, self.steps)
        return self._stepper.monodromy(state, speed, self.multiple)[1]

    def figures(self, x: Array, frequency: float) -> dict[str, Array]:
        """Quantities of a sweep's response, (m,) each; see `lumped.steady.measures`."""
        state, speed = self.state(x, frequency), Speed(frequency, self.steps)
        return measure_motion(self._stepper.record(state, speed, self.multiple)[1])

    def of_response(self, response: Response, settings: Settings) -> Array:
        """Unknowns x of a motion that has settled by fixed steps."""
        return self._stepper.section_of(response.state)

    def lengthened(self, x: Array, times: int) -> Array:
        """Unknowns x as those of a motion of so many times the period."""
        return x

    def delayed(self, x: Array, periods: int, frequency: float) -> Array:
        """Unknowns x of the motion so many common periods later."""
        return self._ends(x, frequency, periods) if periods else x

    def odd_part(self, x: Array, frequency: float) -> Array:
        """What a motion of half the period does not have."""
        half = replace(self, multiple=self.multiple // 2)
        return 0.5 * (x - half._ends(x, frequency))
