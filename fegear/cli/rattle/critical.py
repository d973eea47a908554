"""fegear rattle critical: whether a machine can run quietly."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, inf
from typing import Any

from fegear.cli.groups import grouped
from fegear.cli.options import AsJson, show
from fegear.cli.rattle.machine import MachineName, print_machine
from fegear.cli.screen import say
from fegear.rattle.choice import LoadFigures

LEAST_SHOWN = 1e-3  # per cent per cent
LIMITS = {  # whose changes are told
    "percent_of_critical_per_percent": "critical eccentricity",
    "percent_of_least_quiet_per_percent": "least quiet eccentricity",
}
EXAMPLE = "fegear rattle critical roots-a --epsilon 8e-5"


@grouped
def critical_command(
    *, machine: MachineName, figures: LoadFigures, as_json: AsJson = False
) -> None:
    """Whether a machine can run quietly, and what change helps.

    It takes machines of any parts: unequal shafts, gears on springs, an absorber.
    """
    from fegear.rattle.quiet import quiet_summary

    show(quiet_summary(figures.load(machine)), as_json, print_critical)


def print_critical(values: dict[str, Any]) -> None:
    print_machine(values)
    say(f"eccentricity {values['eccentricity_rad']:g} rad, {_window(values)}")
    margin = values["least_contact_load_over_mean"]
    if values["quiet_motion_exists"]:
        say(f"it can run quietly: contact keeps {margin:.1%} of its mean load")
    else:
        say("it cannot run quietly: the flanks part in every turn")
    least = values["simple_rattle_in_impacts_from_rad"]
    if least is not None:
        say(
            "with rigid flanks, rattle of one impact a turn exists from "
            f"{least:.4g} rad"
        )
    if "driving_eccentricity_rad" in values:
        say(_of_gears(values))
    if values["ripple"]:
        say(
            "critical eccentricity without torque ripple "
            f"{values['critical_without_ripple_rad']:.4g} rad"
        )
    for key, limit in LIMITS.items():
        for line in _changes(values[key], limit):
            say(line)


def _window(values: dict[str, Any]) -> str:
    """At which eccentricities it can run quietly."""
    lowest = values["least_quiet_eccentricity_rad"]
    critical = values["critical_eccentricity_rad"]
    if critical is None:
        return "none is quiet: the torque ripple alone parts the flanks"
    if lowest > 0.0:
        return (
            f"quiet from {lowest:.4g} rad, below which the torque ripple parts the "
            f"flanks, to the critical {critical:.4g} rad"
        )
    return f"critical {critical:.4g} rad"


def _changes(slopes: dict[str, Any], limit: str) -> Iterator[str]:
    """What a change of each figure does to a limit, the largest first."""
    known = {name: slope for name, slope in slopes.items() if slope is not None}
    for name, slope in sorted(known.items(), key=lambda both: -_largest(both[1])):
        if _largest(slope) < LEAST_SHOWN:
            continue
        if isinstance(slope, tuple):
            less, more = map(_percent, slope)
            yield f"1 % more {name}: {more} {limit}, 1 % less: {less}"
        else:
            yield f"1 % more {name}: {_percent(slope)} {limit}"


def _percent(change: float | None) -> str:
    return "no" if change is None else f"{change:+.3g} %"


def _largest(slope: float | tuple[float | None, float | None]) -> float:
    """Where there is no limit any more it is beyond all."""
    both = slope if isinstance(slope, tuple) else (slope,)
    return max(inf if each is None else abs(each) for each in both)


def _of_gears(values: dict[str, Any]) -> str:
    """What putting the gears together in another way would bring."""
    driving, driven = (
        values[f"{side}_eccentricity_rad"] for side in ("driving", "driven")
    )
    phase = values["eccentricity_phase_rad"]
    within = values["quiet_for_phases_within_rad"]
    text = (
        f"gears of {driving:g} and {driven:g} rad, their long sides "
        f"{degrees(phase):.4g} degrees apart: "
    )
    if within is None:
        return f"{text}no other angle makes it quiet"
    beyond = values["quiet_for_phases_beyond_rad"]
    least = f"beyond {degrees(beyond):.4g} and " if beyond else ""
    return f"{text}it can run quietly {least}within {degrees(within):.4g} degrees"
