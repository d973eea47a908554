"""How to march and when to stop."""

from __future__ import annotations

from dataclasses import dataclass

METHODS = ("rk4", "dopri5")
FINEST, USUAL = 1e-13, 1e-8  # error of a step: just above round-off, and by default


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Numerical choices of a response.

    method : rk4, fixed steps, or dopri5, adaptive with located contact changes
    steps : of rk4 per period of the fastest mesh, at least
    step_angle : of rk4, largest phase [rad] that the highest mode turns in a step
    accuracy : of dopri5, error of a step relative to the deflection; None for 1e-8,
        or a thousandth of the tolerance where that is less, so that errors do not
        hide the last decay
    tolerance : distance to the periodic response at which it has settled, relative
        to each mesh's range of deflection
    max_periods : of the first mesh, after which a response counts as aperiodic; None
        for what the damping needs, at least 2000
    multiples : largest period multiple that is looked for
    windows : of so many common periods each, at most, over which a motion that does
        not repeat is measured; a long common period takes fewer
    """

    method: str = "rk4"
    steps: int = 64
    step_angle: float = 0.6
    accuracy: float | None = None
    tolerance: float = 1e-4
    max_periods: int | None = None
    multiples: int = 8
    windows: int = 16

    @property
    def step_error(self) -> float:
        """Error of a step of dopri5, relative to the deflection."""
        if self.accuracy is not None:
            return self.accuracy
        return max(min(USUAL, 1e-3 * self.tolerance), FINEST)

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method must be rk4 or dopri5, got {self.method}")
        checks = {
            "steps": (4 <= self.steps <= 100_000, "4 to 100000"),
            "step_angle": (0.0 < self.step_angle <= 2.0, "above 0 to 2"),
            "accuracy": (FINEST <= self.step_error <= 1e-2, "1e-13 to 0.01"),
            "tolerance": (1e-12 <= self.tolerance <= 0.1, "1e-12 to 0.1"),
            "max_periods": (
                1 <= (1 if self.max_periods is None else self.max_periods) <= 10**8,
                "1 to 1e8",
            ),
            "multiples": (1 <= self.multiples <= 64, "1 to 64"),
            "windows": (1 <= self.windows <= 10_000, "1 to 10000"),
        }
        if self.max_periods is None:
            del checks["max_periods"]
        for name, (ok, allowed) in checks.items():
            if not ok:
                raise ValueError(f"{name} must be {allowed}, got {getattr(self, name)}")
