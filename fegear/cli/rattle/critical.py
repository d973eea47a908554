"""fegear rattle critical: whether a machine can run quietly."""

from __future__ import annotations

from typing import Any

from fegear.cli.groups import grouped
from fegear.cli.options import AsJson, show
from fegear.cli.rattle.machine import LoadFigures, MachineName
from fegear.cli.screen import screen

EXAMPLE = "fegear rattle critical roots-a --epsilon 8e-5"


@grouped
def critical_command(
    *, machine: MachineName, figures: LoadFigures, as_json: AsJson = False
) -> None:
    """Whether a machine can run quietly, and what change helps."""
    from fegear.rattle.quiet import quiet_summary

    show(quiet_summary(figures.load(machine)), as_json, print_critical)


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
