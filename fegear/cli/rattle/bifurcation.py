"""fegear rattle bifurcation: orbits over a figure of the machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.groups import grouped, option
from fegear.cli.options import ResumedOutputs, limits_of, refuse_idle, require
from fegear.cli.rattle.machine import (
    MachineName,
    Velocity,
    print_machine,
    speeds_of,
)
from fegear.cli.screen import counted, say
from fegear.errors import InputError
from fegear.rattle.choice import MotionFigures
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.rattle.bifurcation import BifurcationResult
    from fegear.rattle.existence import ExistenceResult
    from fegear.rattle.machines import NamedMachine

Find = Callable[..., "BifurcationResult | ExistenceResult"]

EXAMPLE = "fegear rattle bifurcation roots-scaled --over delta=0.5:0.75 --plot b.png"
NONE_FOUND = "nothing was found at the values looked at; --starts looks at more"
FIGURES = {  # by the names of options, and of those that have none
    "delta": "damping",
    "epsilon": "eccentricity",
    "beta": "half_backlash",
    "kappa": "stiffness",
    "restitution": "restitution",
    "ripple": "ripple",
    "phase": "ripple_phase",
}


def axes_of(over: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Limits by the names of one or two figures, of KEY=A:B."""
    require(1 <= len(over) <= 2, "--over", len(over), "one or two are allowed")
    found: dict[str, tuple[float, float]] = {}
    for text in over:
        name, _, values = text.partition("=")
        if name not in FIGURES:
            allowed = f"must be KEY=A:B, KEY one of {', '.join(FIGURES)}"
            raise InputError(f"--over = {text}; {allowed}")
        if name in found:
            raise InputError(f"--over {name}; is given twice")
        found[name] = limits_of(f"--over = {text}; must be KEY=A:B", values)
    return found


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
        "Values of the figure, beside both ends, from whose motions branches are "
        "looked for.",
        default=5,
        allowed=Range(least=1, most=1000),
    )
    doublings: int = option(
        "How often the period may double on the way from a branch to others.",
        default=1,
        allowed=Range(least=0, most=6),
    )
    runs: int | None = option(
        "Values of the figure at which long runs settle, each from a grid of "
        "departures, to be drawn beside the branches. [default: 200 over one figure]",
        allowed=Range(least=0, most=100_000),
    )


def refuse_idle_figures(
    name: str, named: NamedMachine, given: Mapping[str, float | None]
) -> None:
    """Refuse to vary what changes nothing, or what is given as well."""
    machine, figure = named.machine, FIGURES[name]
    if given.get(figure) is not None:
        raise InputError(f"--{name}; --over {name} replaces it, leave it out")
    if figure == "restitution" and not machine.is_impact:
        raise InputError(f"--over {name}; belongs to impacts, {named.name} has none")
    if name == "kappa" and given.get("restitution") is not None:
        raise InputError(
            "--restitution; belongs to impacts, --over kappa gives flanks a stiffness"
        )
    if figure == "ripple_phase" and not machine.ripple:
        raise InputError(f"--over {name}; {named.name} has no torque ripple")


@grouped
def bifurcation_command(
    *,
    machine: MachineName,
    over: Annotated[
        list[str],
        typer.Option(
            "--over",
            metavar="KEY=A:B",
            help="Figure of the machine that varies, and from where to where: "
            f"{', '.join(FIGURES)}. Give it twice for the bifurcations over two.",
        ),
    ],
    figures: MotionFigures,
    sought: SoughtBranches,
    velocity: Velocity = None,
    outputs: ResumedOutputs,
) -> None:
    """Motions that repeat over a figure: where they are born, double and graze.

    Branches of P(m, n+, n-), stable or not, followed by arc length from the motions
    that are found at some values, with folds, period doublings and grazes, beside what
    long runs settle to. With --output what is found is kept in FILE.partial until the
    file is written; --resume goes on from there.

    Over two figures the curves of those bifurcations, which bound where motions exist.
    """
    begin = time.perf_counter()
    outputs.require(machine)
    axes = axes_of(over)
    named = figures.load(machine)
    for name in axes:
        refuse_idle_figures(name, named, figures.given)
    find, print_values = finder_of(axes, named, sought, speeds_of(velocity, named))
    with outputs.progress() as report:
        found = find(outputs.keeping, report)
    outputs.write(found.csv)
    outputs.draw(found.draw)
    values = found.summary
    values["wall_time_s"] = round(time.perf_counter() - begin, 3)
    outputs.show(values, print_values)


def finder_of(
    axes: Mapping[str, tuple[float, float]],
    named: NamedMachine,
    sought: SoughtBranches,
    velocity: tuple[float, float],
) -> tuple[Find, Callable[[dict[str, Any]], None]]:
    """What finds branches over one figure, or curves over two, and prints them."""
    from fegear.rattle.bifurcation import Search, find_bifurcations
    from fegear.rattle.existence import find_existence, plane_of

    given = {k: v for k, v in vars(sought).items() if v is not None}
    (first, limits), *others = axes.items()
    search = Search(figure=FIGURES[first], limits=limits, velocity=velocity, **given)
    if not others:
        return partial(find_bifurcations, named, search), print_bifurcations
    refuse_idle("belongs to one --over", runs=sought.runs)
    second, other_limits = others[0]
    plane = plane_of(search, FIGURES[second], other_limits)
    return partial(find_existence, named, plane), print_existence


def print_bifurcations(values: dict[str, Any]) -> None:
    print_machine(values)
    say(
        f"{values['over']} from {values['from']:g} to {values['to']:g}, "
        f"{counted(len(values['branches']), 'branch', 'branches')}"
    )
    if not values["branches"]:
        say(NONE_FOUND)
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


def print_existence(values: dict[str, Any]) -> None:
    print_machine(values)
    first, second = values["over"]
    curves = values["curves"]
    say(f"{first} and {second}, {counted(len(curves), 'curve', 'curves')}")
    if not curves:
        say(NONE_FOUND)
    for place, curve in enumerate(curves, start=1):
        ends = " to ".join("({:.6g}, {:.6g})".format(*curve[k]) for k in ("from", "to"))
        say(
            f"curve {place}: {curve['bifurcation']} of {curve['name']}, "
            f"{counted(curve['points'], 'point', 'points')}, {ends}; {curve['end']}"
        )
        for each in curve["meetings"]:
            say("  {} at ({:.7g}, {:.7g})".format(each["kind"], *each["at"]))
    say(f"wall time {values['wall_time_s']:.2f} s")
