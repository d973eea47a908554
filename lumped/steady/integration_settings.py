"""Numerical settings of the integration and of the test for periodic motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from lumped.common.checks import require_fields
from lumped.common.options import Range, documented, option

Method = Literal["rk4", "dopri5"]
# Steps per period of the fastest mesh. With the coupled model 80 made the RMS of a
# motion at half the resonance 0.6 % too large, 112 0.2 %, for 10 % of a sweep's time.
SPRING_STEPS, CONTACT_STEPS = 64, 112
MIN_STEP_ERROR, DEFAULT_STEP_ERROR = 1e-13, 1e-8  # the least is above round-off


@documented
@dataclass(frozen=True, kw_only=True)
class SteadySettings:
    """Criteria for a periodic motion, independent of the integrator."""

    min_periods: ClassVar[int]
    earlier_steps: ClassVar[int] = 1
    tolerance: float = option(
        1e-4,
        "Relative tolerance of the steady state: distance to the periodic motion over "
        "the range of the deflection.",
        Range(1e-12, 0.1),
    )
    max_periods: int | None = option(
        None,
        "Periods of the first mesh after which a motion that has not become periodic "
        "counts as aperiodic. [default: as the damping requires, 2000 or more]",
        Range(1, 1e8),
    )
    multiples: int = option(8, "Largest period multiple to look for.", Range(1, 64))
    windows: int = option(
        16,
        "Largest number of windows, of `multiples` common periods each, over which a "
        "motion that does not repeat is measured; fewer for a long common period.",
        Range(1, 10_000),
    )

    def __post_init__(self) -> None:
        require_fields(self)


@documented
@dataclass(frozen=True, kw_only=True)
class Settings(SteadySettings):
    """Numerical settings of the response of a lumped model."""

    min_periods: ClassVar[int] = 2_000
    method: Method = option(
        "rk4",
        "Time integration. rk4: fixed steps of fourth order; dopri5: adaptive steps of "
        "fifth order that end on every change of contact.",
    )
    steps: int | None = option(
        None,
        "Least number of time steps per period of the fastest mesh, with {method} rk4. "
        f"[default: {SPRING_STEPS}, or {CONTACT_STEPS} with the coupled model]",
        Range(4, 100_000),
    )
    step_angle: float = option(
        0.6,
        "Largest phase [rad] that the highest mode turns in a step of rk4.",
        Range(above=0.0, most=2.0),
    )
    accuracy: float | None = option(
        None,
        "Error of a step of dopri5 relative to the deflection. [default: 1e-8, or a "
        "thousandth of the tolerance if that is less, so that errors do not mask the "
        "last decay]",
        Range(MIN_STEP_ERROR, 0.01),
    )

    def min_steps(self, contacts: bool) -> int:
        """Least number of steps of rk4 per period of the fastest mesh.

        Parameters
        ----------
        contacts : bool
            Whether the model is the coupled one.

        Returns
        -------
        int
            Number of steps.
        """
        usual = CONTACT_STEPS if contacts else SPRING_STEPS
        return self.steps or usual

    @property
    def step_error(self) -> float:
        """Error of a step of dopri5, relative to the deflection."""
        if self.accuracy is not None:
            return self.accuracy
        return max(min(DEFAULT_STEP_ERROR, 1e-3 * self.tolerance), MIN_STEP_ERROR)
