"""fegear rattle gears: a machine of two gears in mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.groups import grouped, option
from fegear.cli.options import (
    AsJson,
    Elements,
    Mesh,
    progress_bar,
    require_ending,
    require_mesh,
    require_outputs,
    show,
)
from fegear.cli.screen import say
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.rattle.gears import Conditions

EXAMPLE = (
    "fegear rattle gears liu-pair --speed-rpm 1500 --drag-Nm 1 --eccentricity-um 9"
)
ABOVE = Range(above=0.0, below=math.inf)


@dataclass(frozen=True, kw_only=True)
class Running:
    """How the gears run."""

    speed_rpm: Annotated[
        float, typer.Option(help="Speed of the driving gear [rpm]."), ABOVE
    ]
    drag_Nm: Annotated[
        float,
        typer.Option(
            "--drag-Nm", help="Drag of both shafts, on the driving gear [N\u00a0m]."
        ),
        ABOVE,
    ]
    eccentricity_um: Annotated[
        float,
        typer.Option(
            "--eccentricity-um",
            help="Amplitude of the transmission error at a turn of the driving gear "
            "[um].",
        ),
        Range(least=0.0, below=math.inf),
    ]
    driven_share: float | None = option(
        "Share of the drag on the driven shaft, a ratio above 0 and below 1. [default: "
        "that of its inertia]",
        allowed=Range(above=0.0, below=1.0),
    )
    driving_inertia_kgm2: float | None = option(
        "Inertia of all on the driving shaft [kg m2]. [default: the gear's]",
        "--driving-inertia-kgm2",
        allowed=ABOVE,
    )
    driven_inertia_kgm2: float | None = option(
        "Inertia of all on the driven shaft [kg m2]. [default: the gear's]",
        "--driven-inertia-kgm2",
        allowed=ABOVE,
    )

    @property
    def conditions(self) -> Conditions:
        from fegear.rattle.gears import Conditions

        return Conditions(
            speed=self.speed_rpm / 60.0,
            drag=self.drag_Nm,
            eccentricity=1e-6 * self.eccentricity_um,
            driven_share=self.driven_share,
            driving_inertia=self.driving_inertia_kgm2,
            driven_inertia=self.driven_inertia_kgm2,
        )


@grouped
def gears_command(
    *,
    set_name: Annotated[
        str,
        typer.Argument(metavar="SET", help="Built-in gear set or path of a TOML file."),
    ],
    mesh: Mesh = 1,
    running: Running,
    elements: Elements,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Write the machine to this TOML file. [default: none]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """A machine of two gears in mesh, for the other commands of rattle.

    Its stiffness is the mean mesh stiffness of `fegear stiffness` at the load of the
    drag, its backlash and inertias are those of the gear set.
    """
    from fegear.gearset import load_gear_set
    from fegear.output import write_text

    require_ending(output, [".toml"])
    require_outputs([output], [set_name], None)
    gear_set = load_gear_set(set_name)
    require_mesh(gear_set, mesh)
    from fegear.rattle.gears import machine_of_gears
    from fegear.statics import StaticsSettings

    settings = StaticsSettings(**elements.choices)
    with progress_bar(enabled=not as_json) as report:
        found = machine_of_gears(
            gear_set, mesh - 1, running.conditions, settings, report
        )
    if output is not None:
        write_text(output, found.text)
    show(found.summary, as_json, print_gears)


def print_machine(values: dict[str, Any]) -> None:
    """What it is, and what of it was not printed in its source."""
    say(f"{values['machine']}: {values['description'] or 'no description'}")
    for inference in values["inferences"]:
        say(f"inferred: {inference}")


def print_gears(values: dict[str, Any]) -> None:
    print_machine(values)
    say(
        f"mean mesh stiffness {values['mean_stiffness_N_per_m']:.4g} N/m, peak to peak "
        f"over mean {values['peak_to_peak_over_mean']:.3g}, at "
        f"{values['driven_drag_Nm']:.4g} N m; backlash {values['backlash_um']:.4g} um"
    )
    say(
        f"damping {values['damping']:.4g}, stiffness {values['stiffness']:.4g}, half "
        f"backlash {values['half_backlash_rad']:.4g} rad, inertia of the driven shaft "
        f"{values['shafts']['driven_inertia']:.4g} of the driving one"
    )
    say(
        f"eccentricity {values['eccentricity_um']:.4g} um, critical "
        f"{values['critical_eccentricity_um']:.4g} um or "
        f"{values['critical_eccentricity_rad']:.4g} rad"
    )
