"""fegear rattle basin: which motions a machine settles to, and from where."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import typer

from fegear.cli.groups import grouped, option
from fegear.cli.options import ResumedOutputs, Workers, named_options
from fegear.cli.rattle.machine import (
    MachineName,
    Velocity,
    print_machine,
    speeds_of,
)
from fegear.cli.screen import number, ruled_table, screen
from fegear.rattle.choice import MotionFigures
from fegear.rattle.limits import LEAST_RETURNS, MOST_RETURNS
from fegear.studies.study import Range

EXAMPLE = "fegear rattle basin roots-scaled -o basins.npz --plot basins.png"


@dataclass(frozen=True, kw_only=True)
class BasinOutputs(ResumedOutputs):
    """Where the basins go."""

    output: Path | None = option(
        "Write attractor and returns of every cell to this NPZ file.",
        "-o",
        "--output",
    )
    endings: ClassVar[Sequence[str]] = (".npz",)


@grouped
def basin_command(
    *,
    machine: MachineName,
    figures: MotionFigures,
    velocity: Velocity = None,
    grid: Annotated[
        int,
        typer.Option(help="Cells a side of the grid, over a turn and over the speeds."),
        Range(least=5, most=1_000_000),
    ] = 400,
    iterations: Annotated[
        int,
        typer.Option(
            help="Returns to the upper flank after which a motion that still changes "
            "counts as chaotic. Low damping needs more, which the result says."
        ),
        Range(least=LEAST_RETURNS, most=MOST_RETURNS),
    ] = 1499,
    workers: Workers,
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
        cells = Grid(side=grid, velocity=speeds_of(velocity, named))
        found = find_basins(
            named, cells, iterations, outputs.keeping, report, workers.chosen
        )
    if outputs.output is not None:
        found.to_npz(outputs.output)
    outputs.draw(found.draw)
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_basins)


def print_basins(values: dict[str, Any]) -> None:
    console = screen()
    print_machine(values)
    console.print(
        f"{values['cells_a_side']} cells a side, speeds up to "
        f"{values['velocity_rad_per_turn'][1]:.4g} rad per turn, "
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
    if not math.isnan(values["basin_entropy"]):
        console.print(f"basin entropy {values['basin_entropy']:.3f}")
    console.print(f"wall time {values['wall_time_s']:.2f} s")
