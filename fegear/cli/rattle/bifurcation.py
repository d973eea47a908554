"""fegear rattle bifurcation: orbits over a figure of the machine."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.groups import Range, grouped, option
from fegear.cli.options import ResumedOutputs, limits_of
from fegear.cli.rattle.machine import (
    MachineName,
    MotionFigures,
    Velocity,
    print_machine,
    speeds_of,
)
from fegear.cli.screen import counted, say
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.rattle.machines import NamedMachine

EXAMPLE = "fegear rattle bifurcation roots-scaled --over delta=0.5:0.75 --plot b.png"
FIGURES = {  # by the names of options, and of those that have none
    "delta": "damping",
    "epsilon": "eccentricity",
    "beta": "half_backlash",
    "kappa": "stiffness",
    "restitution": "restitution",
    "ripple": "ripple",
    "phase": "ripple_phase",
}


def figure_over(text: str) -> tuple[str, tuple[float, float]]:
    """Name of the figure and its limits, of NAME=A:B."""
    name, _, values = text.partition("=")
    if name not in FIGURES:
        raise InputError(f"--over = {text}; must be NAME=A:B of {', '.join(FIGURES)}")
    return name, limits_of(f"--over = {text}; must be NAME=A:B", values)


@dataclass(frozen=True, kw_only=True)
class SoughtBranches:
    """Where branches begin, and what is drawn beside them."""

    departures: int = option(
        "Departures from the upper flank in a period, at most, of the motions from "
        "which branches are followed.",
        default=2,
        allowed=Range(least=1, most=12),
    )
    starts: int = option(
        "Values of the figure at which such motions are looked for.",
        default=5,
        allowed=Range(least=1, most=1000),
    )
    doublings: int = option(
        "How often the period may double on the way from a branch to others.",
        default=1,
        allowed=Range(least=0, most=6),
    )
    runs: int = option(
        "Values of the figure at which long runs settle, each from a grid of "
        "departures, to be drawn beside the branches.",
        default=200,
        allowed=Range(least=0, most=100_000),
    )


def refuse_idle_figures(
    name: str, named: NamedMachine, given: Mapping[str, float | None]
) -> None:
    """Refuse to vary what changes nothing, or what is given as well."""
    machine, figure = named.machine, FIGURES[name]
    if given.get(figure) is not None:
        raise InputError(f"--{name}; --over {name}=A:B takes its place")
    if figure == "restitution" and not machine.is_impact:
        raise InputError(f"--over {name}; belongs to impacts, {named.name} has none")
    if figure == "ripple_phase" and not machine.ripple:
        raise InputError(f"--over {name}; {named.name} has no torque ripple")


@grouped
def bifurcation_command(
    *,
    machine: MachineName,
    over: Annotated[
        str,
        typer.Option(
            "--over",
            metavar="NAME=A:B",
            help="Figure of the machine that varies, and from where to where: "
            f"{', '.join(FIGURES)}.",
        ),
    ],
    figures: MotionFigures,
    sought: SoughtBranches,
    velocity: Velocity = "0:7",
    outputs: ResumedOutputs,
) -> None:
    """Motions that repeat over a figure: where they are born, double and graze.

    Branches of P(m, n+, n-), stable or not, followed by arc length from the motions
    that are found at some values, with folds, period doublings and grazes, beside what
    long runs settle to. With --output what is found is kept in FILE.partial until the
    file is written; --resume goes on from there.
    """
    begin = time.perf_counter()
    outputs.require(machine)
    name, limits = figure_over(over)
    named = figures.load(machine)
    refuse_idle_figures(name, named, figures.given)
    from fegear.rattle.bifurcation import Search, find_bifurcations

    search = Search(
        figure=FIGURES[name],
        limits=limits,
        velocity=speeds_of(velocity),
        **vars(sought),
    )
    with outputs.progress() as report:
        found = find_bifurcations(named, search, outputs.keeping, report)
    outputs.write(found.csv)
    outputs.draw(found.draw)
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_bifurcations)


def print_bifurcations(values: dict[str, Any]) -> None:
    print_machine(values)
    say(
        f"{values['over']} from {values['from']:g} to {values['to']:g}, "
        f"{counted(len(values['branches']), 'branch', 'branches')}"
    )
    for place, branch in enumerate(values["branches"], start=1):
        say(
            f"branch {place}: {branch['name']}, "
            f"{counted(branch['points'], 'point', 'points')}, "
            f"{branch['stable_points']} of them stable, {branch['from']:.6g} to "
            f"{branch['to']:.6g}\n"
            f"  {branch['origin']}; ends: {branch['end']}"
        )
        for each in branch["bifurcations"]:
            time_, speed = each["departures"][0]
            say(
                f"  {each['value']:12.7g}  {each['kind']:<15} first departure at "
                f"{time_:.4f} turns, {speed:.4g} rad per turn"
            )
    say(f"wall time {values['wall_time_s']:.2f} s")
