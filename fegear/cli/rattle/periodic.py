"""fegear rattle periodic: motions that repeat, stable or not."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from fegear.cli.groups import grouped
from fegear.cli.options import AsJson, show
from fegear.cli.rattle.machine import (
    MachineName,
    Velocity,
    print_machine,
    speeds_of,
)
from fegear.cli.screen import number, ruled_table, screen
from fegear.rattle.choice import MotionFigures
from fegear.studies.study import Range

EXAMPLE = "fegear rattle periodic roots-scaled --departures 2"


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
    velocity: Velocity = None,
    as_json: AsJson = False,
) -> None:
    """Motions P(m, n+, n-) that repeat, stable or not.

    Fixed points of the return map by Newton's method from a grid of departures: m
    turns, n+ departures from the upper and n- meetings with the lower flank. Where
    impacts lose speed, flanks may chatter to rest until the load lets them part:
    sticking(m), known by its release from rest, whatever the number of impacts.
    """
    named = figures.load(machine)
    from fegear.rattle.periodic import periodic_summary

    values = periodic_summary(named, departures, speeds_of(velocity, named))
    show(values, as_json, print_periodic)


def print_periodic(values: dict[str, Any]) -> None:
    console = screen()
    print_machine(values)
    console.print(f"motions of up to {values['departures']} departures a period")
    table = ruled_table(
        *("motion", "stable", "largest\nmultiplier", "departures:\ntime [turns]"),
        "speed\n[rad per turn]",
    )
    for each in values["orbits"]:
        table.add_row(
            each["name"],
            "yes" if each["stable"] else "no",
            number(each["largest_multiplier"], 4),
            "\n".join(number(time_, 4) for time_, _ in each["departures"]),
            "\n".join(number(speed, 4) for _, speed in each["departures"]),
        )
    console.print(table)
    least = values["least_eccentricity_of_P(1,1,0)_rad"]
    if least is not None:
        console.print(f"P(1,1,0) exists from an eccentricity of {least:.4g} rad on")
    apart = [
        each["from_construction"]
        for each in values["orbits"]
        if each["from_construction"] is not None
    ]
    if apart:
        console.print(f"P(m,1,n-) are within {max(apart):.1g} of constructed ones")
