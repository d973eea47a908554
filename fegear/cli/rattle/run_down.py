"""fegear rattle run-down: damping from a run-down test."""

from __future__ import annotations

import math
from typing import Annotated, Any

import typer

from fegear.cli.groups import grouped
from fegear.cli.options import AsJson, show
from fegear.cli.screen import say
from fegear.studies.study import Range

EXAMPLE = "fegear rattle run-down measured.csv --speed-rpm 3000"
ABOVE = Range(above=0.0, below=math.inf)


@grouped
def run_down_command(
    *,
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="CSV file of time_s and speed_rpm, speed_Hz or speed_rad_per_s.",
        ),
    ],
    speed_rpm: Annotated[
        float | None,
        typer.Option(
            help="Speed at which the machine runs [rpm]. [default: the test's first]"
        ),
        ABOVE,
    ] = None,
    inertia_kgm2: Annotated[
        float | None,
        typer.Option(
            "--inertia-kgm2",
            help="Inertia of a shaft [kg m2], for its damping coefficient. "
            "[default: none]",
        ),
        ABOVE,
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Damping of a machine from its speed after the motor is switched off.

    An exponential is fitted to the speed; its rate over the speed in turns per second
    is the figure `damping` of a machine.
    """
    from fegear.rattle.run_down import run_down_summary

    show(run_down_summary(file, speed_rpm, inertia_kgm2), as_json, print_run_down)


def print_run_down(values: dict[str, Any]) -> None:
    say(
        f"{values['file']}: rate {values['rate_per_s']:.4g} +- "
        f"{values['rate_standard_error_per_s']:.2g} per s from "
        f"{values['speed_at_start_rpm']:.4g} rpm, {values['rows']} rows"
    )
    say(
        f"damping {values['damping']:.4g} +- {values['damping_standard_error']:.2g} "
        f"at {values['speed_rpm']:.4g} rpm"
    )
    coefficient = values["damping_coefficient_Nms_per_rad"]
    if coefficient is not None:
        say(f"damping coefficient of a shaft {coefficient:.4g} N m s/rad")
    say(f"residual {values['residual_rms_rpm']:.3g} rpm, root mean square")
    one, two = (values[f"rate_of_{name}_half_per_s"] for name in ("first", "second"))
    say(f"rate of the first half {one:.4g}, of the second half {two:.4g} per s")
    if not values["drag_goes_with_speed"]:
        say("they differ: the drag does not go with the speed alone")
