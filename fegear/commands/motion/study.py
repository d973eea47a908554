"""The settled motion of a gear set's lumped train at one speed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fegear.commands.motion.result import MotionResult
from fegear.studies.problem import Job, Task
from fegear.studies.trains.one_speed import OneSpeedProblem, OneSpeedStudy
from fegear.studies.trains.speeds import with_frequencies
from lumped.steady.motion import time_history
from lumped.steady.truncation_check import check_truncation


@dataclass(frozen=True, kw_only=True)
class Motion(
    OneSpeedStudy,
    command="motion",
    example="motion liu-idler --speed 2100 --from-speed 3000 --plot m.png",
):
    """Steady-state motion of a lumped train at one speed.

    Forces and contact of every tooth pair, phase plane and spectrum.
    """

    def prepare(self) -> MotionProblem:
        speeds = {"speed": self.rpm, "from_speed": self.from_rpm}
        return MotionProblem.of(with_frequencies(self, speeds))


@dataclass(frozen=True, eq=False)
class MotionProblem(OneSpeedProblem):
    """A train at one torque and speed, whose motion is recorded."""

    study: Motion

    def tasks(self) -> Iterator[Task]:
        yield Task("motion", self._solve_motion)

    def _solve_motion(self, job: Job) -> MotionResult:
        """The motion; DivergedError where it has no bound."""
        study, torque = self.study, self.single_torque
        state, observer = self.start_state(job)
        arguments = self.system, study.frequency, self.integration, state
        motion = time_history(*arguments, callback=observer.callback)
        checks = check_truncation(
            self.system, [motion.response], self.integration, observer.callback
        )
        facts = self.facts(torque, motion.response, checks)
        return MotionResult(study, facts, torque, motion)
