"""fegear clatter: loose wheels of a gearbox between the edges of their plays."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from fegear.cli.groups import Range, grouped, option
from fegear.cli.options import (
    ResumedOutputs,
    chosen,
    draw_into,
    refuse_idle,
    require_outputs,
)
from fegear.cli.screen import complain, number, ruled_table, say, screen

EXAMPLE = "fegear clatter seed-five-speed --seconds 20 -o i.csv --plot motion.png"
GearboxName = Annotated[
    str,
    typer.Argument(metavar="GEARBOX", help="Built-in gearbox or path of a TOML file."),
]


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Which run is made."""

    seconds: float = option(
        "Time that is run [s].",
        default=10.0,
        allowed=Range(least=1e-6, most=1e7, unit="s"),
    )
    impacts: int | None = option(
        "Impacts of a wheel, and of those that mesh with it, after which the run ends "
        "sooner. [default: 20 million]",
        allowed=Range(least=1, most=20_000_000),
    )
    seed: int | None = option(
        "Number from which a random place at the start is made. [default: the middle "
        "of every play]",
        allowed=Range(least=0, most=2**32),
    )
    kind: Literal["event", "implicit", "fermi"] = option(
        "How impacts follow each other: events of all plays, the implicit map of a "
        "spur wheel's teeth, or its Fermi accelerator.",
        "--map",
        default="event",
    )
    chaos: bool = option(
        "Measure the largest Lyapunov exponent and the correlation dimension of the "
        "impacts as well.",
        default=False,
    )


@grouped
def clatter_command(
    *,
    gearbox: GearboxName,
    run: RunOptions,
    wheel: Annotated[
        str | None,
        typer.Option(help="Wheel that is drawn, and mapped. [default: the first]"),
    ] = None,
    attractor: Annotated[
        Path | None,
        typer.Option(
            help="Draw impacts of the wheel's teeth, phase and speed, into this "
            "file, .png, .pdf or .svg."
        ),
    ] = None,
    outputs: ResumedOutputs,
) -> None:
    """Clattering gearboxes: impacts of loose wheels in their plays.

    Between impacts wheels fly; several plays may end at once, and impacts that follow
    each other ever faster end in contact. The noise level is the sum of squared speeds
    of impacts over the time.
    """
    begin = time.perf_counter()
    if run.kind != "event":
        refuse_idle("needs --map event", resume=outputs.resume, plot=outputs.plot)
    elif attractor is None and outputs.plot is None:
        refuse_idle("needs --plot, --attractor or another --map", wheel=wheel)
    outputs.require(gearbox)
    require_outputs([outputs.output, outputs.plot], (gearbox,), attractor)
    from fegear.clatter.gearboxes import load_gearbox
    from fegear.clatter.runs import Clatter, find_clatter

    named = load_gearbox(gearbox)
    asked = Clatter(**chosen(**vars(run)))
    try:
        with outputs.progress() as report:
            found = find_clatter(named, asked, wheel, report, outputs.keeping)
    except KeyboardInterrupt:
        if outputs.checkpoint is not None:
            complain(f"{outputs.checkpoint} is kept, --resume goes on with it")
        raise
    outputs.write(found.csv)
    outputs.draw(found.draw)
    if attractor is not None:
        draw_into(attractor, found.draw_attractor)
    values = dict(found.summary)
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_clatter)


def print_clatter(values: dict[str, Any]) -> None:
    say(f"{values['gearbox']}: {values['description'] or 'no description'}")
    for inference in values["inferences"]:
        say(f"inferred: {inference}")
    table = ruled_table(
        *("wheel", "play", "impacts\nper s", "noise level\n[m2 per s3]"),
        *("lost\n[mW]", "fastest\n[mm/s]"),
    )
    for wheel in values["wheels"]:
        for play in wheel["plays"]:
            table.add_row(
                *(wheel["name"], play["play"]),
                number(play["impacts"] / wheel["seconds"], 4),
                number(play["noise_m2_per_s3"], 4),
                number(1e3 * play["lost_power_W"], 4),
                number(1e3 * play["fastest_m_per_s"], 4),
            )
    screen().print(table)
    for wheel in values["wheels"]:
        say(
            f"wheel {wheel['name']}: {wheel['impacts']} impacts in "
            f"{wheel['seconds']:.6g} s, noise level {wheel['noise_m2_per_s3']:.4g} "
            "m2 per s3"
        )
        for unit in ("s", "impact"):
            exponent = wheel.get(f"lyapunov_exponent_per_{unit}")
            if exponent is not None:
                say(f"largest Lyapunov exponent {exponent:.4g} per {unit}")
        if wheel.get("forgets_its_start"):
            say("no Lyapunov exponent: in contact the wheel forgets where it came from")
        say_dimension(wheel)
    say(f"wall time {values['wall_time_s']:.2f} s")


def say_dimension(wheel: dict[str, Any]) -> None:
    if "correlation_dimension" not in wheel or wheel["forgets_its_start"]:
        return
    dimension, error = (
        wheel[f"correlation_dimension{kind}"] for kind in ("", "_error")
    )
    if dimension is None:
        say("no correlation dimension: impacts of teeth are few, or do not scale")
    else:
        say(f"correlation dimension of its impacts {dimension:.2f} +- {error:.2f}")
