"""What benchmarks share: how they end, and what they leave."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fegear.cli.options import progress_bar, require_outputs
from fegear.cli.screen import print_json, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fegear.statics import Progress


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a benchmark has measured.

    name : of its files; about : what its figure shows, one sentence
    points : equal dataclasses, none if it was ended before the first
    values : plain ones for JSON: lists of rows, and single figures
    interrupted : whether Ctrl-C ended it
    """

    name: str
    title: str
    about: str
    points: Sequence[Any]
    draw: Callable[[], Figure]
    values: Mapping[str, Any]
    interrupted: bool = False


def outputs_of(name: str, output: Path) -> list[Path]:
    """The files of a benchmark below its directory."""
    return [output / f"{name}.csv", output / f"{name}.png"]


def run_bench(
    name: str,
    measure: Callable[[Progress], Outcome],
    show: Callable[[Outcome], None],
    output: Path,
    as_json: bool,
) -> None:
    """Measure, write and print; after Ctrl-C what was finished."""
    from fegear.output import make_directory

    make_directory(output)
    require_outputs(outputs_of(name, output))
    with progress_bar(enabled=not as_json) as report:
        outcome = measure(report)
    if not outcome.points:
        raise KeyboardInterrupt
    write_outcome(outcome, output)
    if as_json:
        print_json(outcome.values)
    else:
        show(outcome)
        table, picture = outputs_of(name, output)
        say(f"wrote {table} and {picture}")
    if outcome.interrupted:
        raise KeyboardInterrupt


def write_outcome(outcome: Outcome, output: Path) -> None:
    from fegear.output import write_text, write_whole
    from fegear.plots import save_figure
    from validation.points import points_csv

    table, picture = outputs_of(outcome.name, output)
    write_text(table, points_csv(outcome.points))
    figure = outcome.draw()
    write_whole(picture, lambda path: save_figure(figure, path))
