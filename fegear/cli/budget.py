"""fegear budget: what each part of the coupled model brings for a gear set."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import EditedSet, edit_entries, refuse_idle_edits
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import LoadCase, middle_torque, speeds_of
from fegear.cli.options import AsJson, Plot, progress_bar, require_outputs, show
from fegear.cli.screen import number, print_columns, say, screen
from fegear.errors import InputError
from fegear.studies.study import Range

if TYPE_CHECKING:
    from validation.budget import Budget

EXAMPLE = "fegear budget liu-idler --torque 100 --speeds 800:4200:100"
CORNER = "largest error against finite\nelements (change to coupled)"


@dataclass(frozen=True, kw_only=True)
class BudgetOutputs:
    """What is left of a budget besides the screen."""

    runs: Path | None = option(
        "Directory where the runs are kept, so that the same command goes on with "
        "them. [default: none is kept]",
        metavar="DIR",
    )
    plot: Plot = None
    as_json: AsJson = False


@grouped
def budget_command(
    *,
    subject: EditedSet,
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
    outputs: BudgetOutputs,
) -> None:
    """What each part of the coupled model brings.

    Sweeps up and down by finite elements, model 1, the coupled model and the coupled
    model without each of its parts.
    """
    from fegear.output import make_directory
    from validation.budget import budget, budget_case

    require_outputs([], [subject.set_name], outputs.plot)
    gear_set, changes = subject.load(torque=torque)
    refuse_idle_edits(changes, translations=False)
    at = middle_torque(gear_set, torque)
    speeds_of(speeds)
    try:
        case = budget_case(subject.set_name, at, speeds, subject.edits or ())
    except ValueError as error:
        raise InputError(f"--speeds = {speeds}; {error}") from None
    shown = progress_bar(enabled=not outputs.as_json)
    with TemporaryDirectory() as temporary, shown as report:
        store = make_directory(outputs.runs) if outputs.runs else Path(temporary)
        found = budget(case, store, report)
    values = {"gear_set": gear_set.name, "torque_Nm": at, **edit_entries(changes)}
    values |= _plain(found, tolerance)
    if outputs.plot is not None:
        _draw(found, _title(values), outputs.plot)
    show(values, outputs.as_json, _print)


def _title(values: dict[str, Any]) -> str:
    from fegear.headings import edits_in_words

    at = f"{values['gear_set']}, {values['torque_Nm']:g} N m"
    return ", ".join(filter(None, [at, edits_in_words(values)]))


def _draw(found: Budget, title: str, path: Path) -> None:
    from fegear.output import write_whole
    from fegear.plots import save_figure
    from lumped.drawing import draw_title
    from validation.report.figures import draw_budget

    figure = draw_budget(found)
    draw_title(figure, f"{title}\ndifferences from the finite elements")
    write_whole(path, lambda place: save_figure(figure, place))


def _plain(found: Budget, tolerance: float) -> dict[str, Any]:
    from validation.report.values import budget_values

    best = found.recommended(tolerance)
    return {
        "tolerance": tolerance,
        "fe_per_speed_s": found.fe_per_speed_s,
        **budget_values(found),
        "recommended": None if best is None else best.label,
        "recommended_largest_error": None if best is None else best.worst,
        "warnings": list(found.warnings),
    }


def _print(values: dict[str, Any]) -> None:
    columns = {}
    for i, model in enumerate(values["models"]):
        cells = [_cell(each["models"][i]) for each in values["quantities"]]
        cells += [str(model["unmatched"]), number(1e3 * model["per_speed_s"], 2)]
        columns[model["model"].replace(" ", "\n")] = cells
    labels = [f"{each['quantity']} [{each['unit']}]" for each in values["quantities"]]
    labels += ["peaks, jumps unmatched", "cost [ms a speed]"]
    print_columns(screen(), CORNER, labels, columns, _title(values))
    say(f"finite elements take {1e3 * values['fe_per_speed_s']:.1f} ms a speed")
    best, allowed = values["recommended"], f"{100.0 * values['tolerance']:g} %"
    if best is None:
        say(f"no lumped model is within {allowed}: use fegear dynamics")
    else:
        error = 100.0 * values["recommended_largest_error"]
        say(
            f"{best} is the cheapest within {allowed}: its largest error is "
            f"{error:.1f} %"
        )


def _cell(model: Mapping[str, Any]) -> str:
    """`3.1 (-2.5)`: the largest error, and what the model lacks would change."""
    if not model["places"]:
        return "-"
    error = f"{model['largest_error']:.1f}"
    if model["model"] == "coupled" or not isfinite(model["brought"]):
        return error
    change = round(model["brought"], 1) + 0.0  # -0 is 0
    return f"{error} ({change:+.1f})"
