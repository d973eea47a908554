"""fegear rattle: machines that may rattle."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.groups import Range, grouped, option
from fegear.cli.options import AsJson, ResumedOutputs, named_options, show
from fegear.cli.screen import number, ruled_table, screen
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.rattle.machines import NamedMachine

EXAMPLES = {
    "critical": "fegear rattle critical roots-a --epsilon 8e-5",
    "periodic": "fegear rattle periodic roots-scaled --departures 2",
    "basin": "fegear rattle basin roots-scaled -o basins.npz --plot basins.png",
}
ABOVE = Range(above=0.0, below=math.inf)
MachineName = Annotated[
    str,
    typer.Argument(metavar="MACHINE", help="Built-in machine or path of a TOML file."),
]


@dataclass(frozen=True, kw_only=True)
class LoadFigures:
    """Dimensionless figures in place of the machine's that press the flanks."""

    delta: float | None = option(
        "Damping coefficient over inertia and speed. [default: the machine's]",
        allowed=ABOVE,
    )
    epsilon: float | None = option(
        "Eccentricity, as an angle [rad]. [default: the machine's]",
        allowed=Range(least=0.0, below=math.inf),
    )
    kappa: float | None = option(
        "Stiffness coefficient of the flanks over inertia and speed squared; inf for "
        "impacts. [default: the machine's]",
    )

    def __post_init__(self) -> None:
        if self.kappa is not None and not self.kappa > 0.0:
            raise InputError(
                f"--kappa = {self.kappa:g}; allowed above 0, inf of impacts"
            )

    def load(self, name: str) -> NamedMachine:
        """The machine with these figures."""
        from fegear.rattle.machines import load_machine

        given = {k: v for k, v in self.given.items() if v is not None}
        return load_machine(name, given)

    @property
    def given(self) -> dict[str, float | None]:
        """By the names of the machine's figures."""
        return {
            "damping": self.delta,
            "eccentricity": self.epsilon,
            "stiffness": self.kappa,
        }


@dataclass(frozen=True, kw_only=True)
class MotionFigures(LoadFigures):
    """All dimensionless figures in place of the machine's."""

    beta: float | None = option(
        "Half of the backlash, as an angle [rad]. [default: the machine's]",
        allowed=ABOVE,
    )
    restitution: float | None = option(
        "Ratio of speeds after and before an impact, the coefficient of restitution. "
        "[default: the machine's]",
        allowed=Range(least=0.0, most=1.0),
    )

    @property
    def given(self) -> dict[str, float | None]:
        own = {"half_backlash": self.beta, "restitution": self.restitution}
        return super().given | own


@dataclass(frozen=True, kw_only=True)
class BasinOutputs(ResumedOutputs):
    """Where the basins go."""

    output: Path | None = option(
        "Write attractor and returns of every cell to this NPZ file.",
        "-o",
        "--output",
    )


@grouped
def critical_command(
    *, machine: MachineName, figures: LoadFigures, as_json: AsJson = False
) -> None:
    """Whether a machine can run quietly, and what change helps."""
    from fegear.rattle.quiet import quiet_summary

    show(quiet_summary(figures.load(machine)), as_json, print_critical)


Velocity = Annotated[
    str,
    typer.Option(metavar="A:B", help="Speeds of departure of the grid [rad per turn]."),
]


@grouped
def periodic_command(
    *,
    machine: MachineName,
    figures: MotionFigures,
    departures: Annotated[
        int,
        typer.Option(
            help="Departures from the upper flank in a period, at most, of the motions "
            "that are listed."
        ),
        Range(least=1, most=12),
    ] = 2,
    velocity: Velocity = "0:7",
    as_json: AsJson = False,
) -> None:
    """Motions P(m, n+, n-) that repeat, stable or not.

    Fixed points of the return map by Newton's method from a grid of departures: m
    turns, n+ departures from the upper and n- meetings with the lower flank.
    """
    named = figures.load(machine)
    from fegear.rattle.periodic import periodic_summary

    show(
        periodic_summary(named, departures, _speeds(velocity)), as_json, print_periodic
    )


@grouped
def basin_command(
    *,
    machine: MachineName,
    figures: MotionFigures,
    velocity: Velocity = "0:7",
    grid: Annotated[
        int,
        typer.Option(help="Cells a side of the grid, over a turn and over the speeds."),
        Range(least=5, most=1_000_000),
    ] = 400,
    iterations: Annotated[
        int,
        typer.Option(
            help="Returns to the upper flank after which a motion that still changes "
            "counts as chaotic."
        ),
        Range(least=100, most=10_000_000),
    ] = 1499,
    outputs: BasinOutputs,
) -> None:
    """Which motions a machine can settle to, and from where.

    Every cell of a grid of departures from the upper flank is followed until it is
    clear where it leads. With --output tiles of cells are kept in FILE.partial until
    the file is written; --resume goes on from there.
    """
    outputs.require(machine)
    named = figures.load(machine)
    from fegear.rattle.basins import find_basins
    from lumped.rattle.basins import Grid

    begin = time.perf_counter()
    with named_options("velocity", "grid"), outputs.progress() as report:
        cells = Grid(side=grid, velocity=_speeds(velocity))
        found = find_basins(named, cells, iterations, outputs.keeping, report)
    if outputs.output is not None:
        found.to_npz(outputs.output)
    outputs.draw(found.draw)
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_basins)


def _speeds(text: str) -> tuple[float, float]:
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        low = high = math.nan
    if not 0.0 <= low < high < math.inf:
        raise InputError(f"--velocity = {text}; must be A:B that rise, from 0 on")
    return low, high


def print_critical(values: dict[str, Any]) -> None:
    console = screen()
    console.print(
        f"{values['machine']}: eccentricity {values['eccentricity_rad']:g} rad, "
        f"critical {values['critical_eccentricity_rad']:.4g} rad"
    )
    margin = values["least_contact_load_over_mean"]
    if values["quiet_motion_exists"]:
        console.print(
            f"it can run quietly: contact keeps {margin:.1%} of its mean load"
        )
    else:
        console.print("it cannot run quietly: the flanks part in every turn")
    for name, change in values["percent_of_critical_per_percent"].items():
        if change is not None:
            console.print(f"1 % more {name}: {change:+.3g} % critical eccentricity")


def print_periodic(values: dict[str, Any]) -> None:
    console = screen()
    console.print(
        f"{values['machine']}: motions of up to {values['departures']} departures a "
        "period"
    )
    table = ruled_table(
        *("motion", "stable", "largest\nmultiplier", "departures: time [turns]"),
        "speed [rad per turn]",
    )
    for each in values["orbits"]:
        table.add_row(
            each["name"],
            "yes" if each["stable"] else "no",
            number(each["largest_multiplier"], 4),
            ", ".join(number(time_, 4) for time_, _ in each["departures"]),
            ", ".join(number(speed, 4) for _, speed in each["departures"]),
        )
    console.print(table)


def print_basins(values: dict[str, Any]) -> None:
    console = screen()
    console.print(
        f"{values['machine']}, {values['cells_a_side']} cells a side, "
        f"{values['iterations']} returns at most"
    )
    table = ruled_table(
        *("motion", "part [%]", "+- [%]", "period\n[turns]", "at time\n[turns]"),
        *("speed\n[rad per turn]", "Lyapunov\n[1/turn]"),
    )
    for each in values["attractors"]:
        time_, speed = each["point"] or (math.nan, math.nan)
        cells = time_, speed, each["lyapunov_per_turn"]
        shown = ("" if v is None or math.isnan(v) else number(v, 4) for v in cells)
        table.add_row(
            each["name"],
            f"{100.0 * each['fraction']:.2f}",
            f"{100.0 * each['fraction_of_random_starts_within']:.2f}",
            str(each["period"] or ""),
            *shown,
        )
    console.print(table)
    if values["unclear_fraction"]:
        console.print(f"not clear: {100.0 * values['unclear_fraction']:.2f} % of cells")
    console.print(f"basin entropy {values['basin_entropy']:.3f}")
    console.print(f"wall time {values['wall_time_s']:.2f} s")
