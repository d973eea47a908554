"""Numerical settings of the integration and of the test for periodic motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from lumped.common.checks import require_between, require_fields

Method = Literal["rk4", "dopri5"]
SPRING_STEPS, CONTACT_STEPS = 64, 80  # steps per period of the fastest mesh
MIN_STEP_ERROR, DEFAULT_STEP_ERROR = 1e-13, 1e-8  # the least is above round-off


@dataclass(frozen=True, kw_only=True)
class SteadySettings:
    """Criteria for a periodic motion, independent of the integrator.

    tolerance : distance to the periodic motion at which a motion is steady, relative
        to each mesh's range of deflection
    max_periods : periods of the first mesh after which a motion counts as aperiodic;
        None for the number that follows from the damping, at least `min_periods`
    multiples : largest period multiple to look for
    windows : largest number of windows, of `multiples` common periods each, over which
        a motion that does not repeat is measured; fewer for a long common period
    """

    min_periods: ClassVar[int]
    tolerance: float = 1e-4
    max_periods: int | None = None
    multiples: int = 8
    windows: int = 16

    def __post_init__(self) -> None:
        require_between("tolerance", self.tolerance, 1e-12, 0.1)
        if self.max_periods is not None:
            require_between("max_periods", self.max_periods, 1, 1e8)
        require_between("multiples", self.multiples, 1, 64)
        require_between("windows", self.windows, 1, 10_000)
        require_fields(self)


@dataclass(frozen=True, kw_only=True)
class Settings(SteadySettings):
    """Numerical settings of the response of a lumped model.

    method : rk4, fixed steps, or dopri5, adaptive with located contact changes
    steps : least number of steps of rk4 per period of the fastest mesh; None for
        SPRING_STEPS, or for CONTACT_STEPS in the coupled model, which solves the
        contact once in each step
    step_angle : largest phase [rad] that the highest mode turns in a step of rk4
    accuracy : error of a step of dopri5 relative to the deflection; None for 1e-8, or
        for a thousandth of the tolerance if that is less, so that errors do not mask
        the last decay
    """

    min_periods: ClassVar[int] = 2_000
    method: Method = "rk4"
    steps: int | None = None
    step_angle: float = 0.6
    accuracy: float | None = None

    def min_steps(self, contacts: bool) -> int:
        """Least number of steps of rk4 per period of the fastest mesh.

        contacts : whether the model is the coupled one
        """
        usual = CONTACT_STEPS if contacts else SPRING_STEPS
        return self.steps or usual

    @property
    def step_error(self) -> float:
        """Error of a step of dopri5, relative to the deflection."""
        if self.accuracy is not None:
            return self.accuracy
        return max(min(DEFAULT_STEP_ERROR, 1e-3 * self.tolerance), MIN_STEP_ERROR)

    def __post_init__(self) -> None:
        if self.steps is not None:
            require_between("steps", self.steps, 4, 100_000)
        require_between("step_angle", self.step_angle, 0, 2, above=True)
        if self.accuracy is not None:
            require_between("accuracy", self.accuracy, MIN_STEP_ERROR, 0.01)
        super().__post_init__()
