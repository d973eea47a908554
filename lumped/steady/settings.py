"""Numerical choices: how to integrate and when a motion counts as periodic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from lumped.common.checks import require_between, require_fields

SPRING_STEPS, CONTACT_STEPS = 64, 80  # per period of the fastest mesh
FINEST, USUAL = 1e-13, 1e-8  # error of a step: just above round-off, and by default


@dataclass(frozen=True, kw_only=True)
class SteadySettings:
    """When a motion counts as periodic, whatever integrates it.

    tolerance : distance to the periodic motion at which it has settled, relative to
        each mesh's range of deflection
    max_periods : of the first mesh, after which a motion counts as aperiodic; None
        for what the damping needs, at least `least_periods`
    multiples : largest period multiple that is looked for
    windows : of so many common periods each, at most, over which a motion that does
        not repeat is measured; a long common period takes fewer
    """

    least_periods: ClassVar[int]
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
    """Numerical choices of a lumped model's response.

    method : rk4, fixed steps, or dopri5, adaptive with located contact changes
    steps : of rk4 per period of the fastest mesh, at least; None for SPRING_STEPS, or
        CONTACT_STEPS of the coupled model, which has one contact solution in each
    step_angle : of rk4, largest phase [rad] that the highest mode turns in a step
    accuracy : of dopri5, error of a step relative to the deflection; None for 1e-8,
        or a thousandth of the tolerance where that is less, so that errors do not
        hide the last decay
    """

    least_periods: ClassVar[int] = 2_000
    method: Literal["rk4", "dopri5"] = "rk4"
    steps: int | None = None
    step_angle: float = 0.6
    accuracy: float | None = None

    def least_steps(self, contacts: bool) -> int:
        """Least number of rk4 steps per period of the fastest mesh; contacts : of the
        coupled model.
        """
        usual = CONTACT_STEPS if contacts else SPRING_STEPS
        return self.steps or usual

    @property
    def step_error(self) -> float:
        """Error of a step of dopri5, relative to the deflection."""
        if self.accuracy is not None:
            return self.accuracy
        return max(min(USUAL, 1e-3 * self.tolerance), FINEST)

    def __post_init__(self) -> None:
        if self.steps is not None:
            require_between("steps", self.steps, 4, 100_000)
        require_between("step_angle", self.step_angle, 0, 2, above=True)
        if self.accuracy is not None:
            require_between("accuracy", self.accuracy, FINEST, 0.01)
        super().__post_init__()
