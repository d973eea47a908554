"""fegear rattle critical: whether a machine can run quietly."""

from __future__ import annotations

from math import degrees
from typing import Any

from fegear.cli.groups import grouped
from fegear.cli.options import AsJson, show
from fegear.cli.rattle.machine import LoadFigures, MachineName, print_machine
from fegear.cli.screen import say

LEAST_SHOWN = 1e-3  # per cent per cent
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
    say(
        f"eccentricity {values['eccentricity_rad']:g} rad, "
        f"critical {values['critical_eccentricity_rad']:.4g} rad"
    )
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
    changes = values["percent_of_critical_per_percent"].items()
    helpful = [(name, change) for name, change in changes if change is not None]
    for name, change in sorted(helpful, key=lambda both: -abs(both[1])):
        if abs(change) >= LEAST_SHOWN:
            say(f"1 % more {name}: {change:+.3g} % critical eccentricity")


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
    return f"{text}it can run quietly within {degrees(within):.4g} degrees"
