"""Settings of branches of periodic motions."""

from __future__ import annotations

from dataclasses import dataclass

from lumped.branches.motions import Solver
from lumped.common.checks import require_fields
from lumped.common.options import Range, documented, option


@documented
@dataclass(frozen=True, kw_only=True)
class BranchSettings:
    """Numerical choices of branches that are followed."""

    harmonics: int = option(
        20,
        "Harmonics of the first mesh's frequency in motions of models 1 to 3.",
        Range(1, 200),
    )
    step: float = option(
        0.02,
        "First arc length, in which the static deflection and the parameter's unit "
        "count one.",
        Range(above=0.0, most=1.0),
    )
    max_step: float = option(0.1, "Largest arc length.", Range(above=0.0, most=10.0))
    points: int = option(5000, "Points of a branch at most.", Range(2, 1_000_000))
    sweep_points: int = option(
        41,
        "Points of the sweeps in which further branches are looked for.",
        Range(2, 100_000),
    )
    period_multiple: int = option(
        2,
        "Largest number of common periods of all meshes after which motions repeat: "
        "period-doubled branches are followed up to it.",
        Range(1, 64),
    )
    solver: Solver = option(
        "balance",
        "Solver of periodic motions of models 1 to 3. balance: harmonic balance; "
        "shooting: fixed points of the map over a period, integrated by steps that end "
        "on every change of contact, with no harmonics left out, and sooner for large "
        "period multiples.",
    )
    starts: int = option(
        0,
        "Number of random initial conditions, the same in each run, from which further "
        "branches are searched, including isolated ones.",
        Range(0, 100_000),
    )
    steepness: float | None = option(
        None,
        "Steepness [1/m] of contact that closes by tanh; none for true contact.",
        Range(1, 1e15),
    )

    def __post_init__(self) -> None:
        require_fields(self)
