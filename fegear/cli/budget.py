"""fegear budget: what each part of the coupled model brings for a gear set."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.groups import Range, grouped
from fegear.cli.lumped_options import LoadCase, middle_torque, speeds_of
from fegear.cli.options import AsJson, SetName, progress_bar, show
from fegear.cli.screen import print_columns, say, screen
from fegear.errors import InputError

if TYPE_CHECKING:
    from validation.budget import Budget

EXAMPLE = "fegear budget liu-idler --torque 100 --speeds 800:4200:100"
HEADS = {
    "peak_frequency": "peak frequency [%]",
    "peak_amplitude": "peak amplitude [%]",
    "off_jump_distance": "curve off jumps [%]",
    "peak_force": "peak force [%]",
    "contact_loss": "contact loss [points]",
    "jump_frequency": "jump [Hz]",
    "static_deflection": "static vibration [%]",
}


@grouped
def budget_command(
    *,
    set_name: SetName,
    speeds: Annotated[
        str,
        typer.Option(
            metavar="A:B:STEP",
            help="Mesh frequencies of the first mesh [Hz]; a number, or several with "
            "commas, as well.",
        ),
    ],
    torque: LoadCase = None,
    tolerance: Annotated[
        float,
        typer.Option(
            help="Relative tolerance of peaks, forces, curves and contact loss: the "
            "cheapest model inside it, with the same peaks and jumps, is recommended."
        ),
        Range(above=0.0, most=1.0),
    ] = 0.05,
    runs: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Directory where the runs are kept, so that the same command goes on "
            "with them. [default: none is kept]",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """What each part of the coupled model brings.

    Sweeps up and down by finite elements, model 1, the coupled model and the coupled
    model without each of its parts.
    """
    from fegear.gearset import load_gear_set
    from fegear.output import make_directory
    from validation.budget import budget, budget_case

    at = middle_torque(load_gear_set(set_name), torque)
    speeds_of(speeds)
    try:
        case = budget_case(set_name, at, speeds)
    except ValueError as error:
        raise InputError(f"--speeds = {speeds}; {error}") from None
    with TemporaryDirectory() as temporary, progress_bar(enabled=not as_json) as report:
        store = make_directory(runs) if runs else Path(temporary)
        found = budget(case, store, tolerance, report)
    values = _plain(found) | {"gear_set": set_name, "torque_Nm": at}
    show(values, as_json, lambda _: _print(found, f"{set_name}, {at:g} N m"))


def _plain(found: Budget) -> dict[str, Any]:
    from validation.budget import units

    best = found.recommended
    return {
        "tolerance": found.tolerance,
        "units": units(),
        "fe_per_speed_s": found.fe_per_speed_s,
        "models": [
            {
                "model": row.model,
                **row.errors,
                "unmatched": row.unmatched,
                "per_speed_s": row.per_speed_s,
            }
            for row in found.rows
        ],
        "recommended": None if best is None else best.model,
    }


def _print(found: Budget, title: str) -> None:
    columns = {}
    for row in found.rows:
        cells = [
            f"{error:.0f}" if name == "jump_frequency" else f"{100.0 * error:.1f}"
            for name, error in row.errors.items()
        ]
        name = row.model.removeprefix("model-").replace("coupled-without-", "without\n")
        columns[name] = [*cells, str(row.unmatched), f"{1e3 * row.per_speed_s:.1f}"]
    labels = [*HEADS.values(), "peaks, jumps unmatched", "cost [ms a speed]"]
    corner = "largest error against\nfinite elements"
    print_columns(screen(), corner, labels, columns, title)
    say(f"finite elements take {1e3 * found.fe_per_speed_s:.1f} ms a speed")
    best, allowed = found.recommended, f"{100.0 * found.tolerance:g} %"
    if best is None:
        say(f"no lumped model is within {allowed}: use fegear dynamics")
    else:
        say(
            f"{best.model} is the cheapest within {allowed}: its largest error is "
            f"{100.0 * best.worst:.1f} %"
        )
