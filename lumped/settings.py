"""How to march and when to stop."""

from __future__ import annotations

from dataclasses import dataclass

METHODS = ("rk4", "dopri5")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Numerical choices of a response.

    method : rk4, fixed steps, or dopri5, adaptive with located contact changes
    steps : of rk4 per period of the fastest mesh, at least
    step_angle : of rk4, largest phase [rad] that the highest mode turns in a step
    accuracy : of dopri5, error of a step relative to the deflection; coarser than a
        thousandth of the tolerance it hides the last decay and costs periods
    tolerance : distance to the periodic response at which it has settled, relative
        to each mesh's range of deflection
    max_periods : of the first mesh, after which a response counts as aperiodic; None
        for what the damping needs, at least 2000
    multiples : largest period multiple that is looked for
    """

    method: str = "rk4"
    steps: int = 64
    step_angle: float = 0.6
    accuracy: float = 1e-8
    tolerance: float = 1e-4
    max_periods: int | None = None
    multiples: int = 8

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method must be rk4 or dopri5, got {self.method}")
        checks = {
            "steps": (4 <= self.steps <= 100_000, "4 to 100000"),
            "step_angle": (0.0 < self.step_angle <= 2.0, "above 0 to 2"),
            "accuracy": (1e-13 <= self.accuracy <= 1e-2, "1e-13 to 0.01"),
            "tolerance": (1e-12 <= self.tolerance <= 0.1, "1e-12 to 0.1"),
            "max_periods": (
                1 <= (1 if self.max_periods is None else self.max_periods) <= 10**8,
                "1 to 1e8",
            ),
            "multiples": (1 <= self.multiples <= 64, "1 to 64"),
        }
        if self.max_periods is None:
            del checks["max_periods"]
        for name, (ok, allowed) in checks.items():
            if not ok:
                raise ValueError(f"{name} must be {allowed}, got {getattr(self, name)}")
