"""fegear rattle manifold: the boundaries of basins, and where motions graze."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

from fegear.cli.groups import grouped, option
from fegear.cli.options import Outputs, named_options
from fegear.cli.rattle.machine import (
    MachineName,
    Velocity,
    print_machine,
    speeds_of,
)
from fegear.cli.screen import number, ruled_table, screen
from fegear.errors import InputError
from fegear.rattle.choice import MotionFigures
from fegear.studies.study import Range

EXAMPLE = "fegear rattle manifold roots-scaled --grid 300 --plot manifolds.png"


@dataclass(frozen=True, kw_only=True)
class AskedCurves:
    """Which curves are grown, and how far."""

    orbit: str = option(
        "Saddles of this motion only, such as P(1,1,0). [default: all]", default=""
    )
    departures: int = option(
        "Departures from the upper flank in a period of the saddles, at most.",
        default=1,
        allowed=Range(least=1, most=12),
    )
    length: float = option(
        "Length of each branch of a manifold [turns]; speeds count over 2 pi damping.",
        default=20.0,
        allowed=Range(above=0.0, most=10_000.0),
    )
    spacing: float = option(
        "Largest distance of its points, measured alike [turns].",
        default=0.01,
        allowed=Range(least=1e-5, most=1.0),
    )
    preimages: int = option(
        "Pre-images of the curve of departures that graze the lower flank.",
        default=2,
        allowed=Range(least=0, most=20),
    )
    unstable: bool = option("Grow unstable manifolds as well.", default=False)
    grid: int | None = option(
        "Cells a side of the basins that the plot shows beneath. [default: none]",
        allowed=Range(least=5, most=6000),
    )


@grouped
def manifold_command(
    *,
    machine: MachineName,
    figures: MotionFigures,
    velocity: Velocity = None,
    asked: AskedCurves,
    outputs: Outputs,
) -> None:
    """Boundaries of basins: stable manifolds of saddles, and curves of grazing.

    Motions that start on a stable manifold lead to its saddle; those beside it lead to
    one motion on one side and to another on the other. Departures of the grazing curve
    barely meet the lower flank next, those of its pre-images some returns later.
    Motions that come to rest on a flank have neither.
    """
    begin = time.perf_counter()
    outputs.require(machine)
    if asked.grid is not None and outputs.plot is None:
        raise InputError("--grid needs the --plot that shows the basins")
    named = figures.load(machine)
    from fegear.rattle.basins import find_basins
    from fegear.rattle.manifolds import CurveSearch, find_manifolds
    from fegear.store import Keeping
    from lumped.rattle.basins import Grid
    from lumped.rattle.departures import RETURNS
    from lumped.rattle.manifolds import Fineness

    speeds = speeds_of(velocity, named)
    search = CurveSearch(
        orbit=asked.orbit.replace(" ", ""),
        departures=asked.departures,
        velocity=speeds,
        length=asked.length,
        preimages=asked.preimages,
        unstable=asked.unstable,
        fineness=Fineness(spacing=asked.spacing),
    )
    basins = None
    with named_options("velocity", "grid"), outputs.progress() as report:
        found = find_manifolds(named, search, report)
        if asked.grid is not None:
            cells = Grid(side=asked.grid, velocity=speeds)
            basins = find_basins(named, cells, RETURNS, Keeping(), report).basins
    outputs.write(found.csv)
    outputs.draw(lambda: found.draw(basins))
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_manifolds)


def print_manifolds(values: dict[str, Any]) -> None:
    print_machine(values)
    table = ruled_table(
        *("curve", "at time\n[turns]", "speed\n[rad per turn]", "branch", "length"),
        "points",
    )
    for each in values["manifolds"]:
        time_, speed = each["departure"]
        table.add_row(
            f"{each['kind']} manifold of {each['motion']}",
            *(number(time_, 4), number(speed, 4), f"{each['branch']:+d}"),
            *(number(each["length"], 4), str(each["points"])),
        )
    for each in values["grazing_curves"]:
        before = each["returns_before"]
        name = f"pre-image {before} of it" if before else "grazing curve"
        length = number(each["length"], 4)
        table.add_row(name, "", "", "", length, str(each["points"]))
    screen().print(table)
    if not values["manifolds"]:
        screen().print("no saddle was found")
    screen().print(f"wall time {values['wall_time_s']:.2f} s")
