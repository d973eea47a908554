"""All benchmarks on one page: figures, their points, and what else was measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from fegear.output import write_text
from validation.csv_text import csv_of
from validation.made_with import machine, made_with
from validation.pages import filled, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Measured(Protocol):
    """A benchmark's figure and its values: lists of rows, and single figures."""

    @property
    def name(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def about(self) -> str: ...
    @property
    def draw(self) -> Callable[[], Figure]: ...
    @property
    def values(self) -> Mapping[str, Any]: ...


def write_page(measured: Sequence[Measured], output: Path, command: str) -> Path:
    """Write index.html with figures and tables beside it; the path of the page."""
    page = output / "index.html"
    studies = [_study(each, output) for each in measured]
    about = {**dict(made_with()), "machine": machine()}
    text = filled("bench.html", studies=studies, command=command, about=about)
    write_text(page, text)
    return page


def _study(measured: Measured, output: Path) -> dict[str, Any]:
    values = measured.values
    tables = {k: v for k, v in values.items() if isinstance(v, list) and v}
    for name, rows in tables.items():
        text = csv_of(rows)
        write_text(output / _file(measured, name), text)
    command = f"fegear bench {measured.name} -o bench"
    data = tuple((name, _file(measured, name)) for name in tables)
    about = measured.about
    return {
        "title": measured.title,
        "about": about,
        "figure": save_figure(
            measured.draw(), output, measured.name, about, command, data
        ),
        "tables": tables,
        "files": dict(data),
        "facts": {k: v for k, v in values.items() if not isinstance(v, list)},
    }


def _file(measured: Measured, table: str) -> str:
    """The points stand where the benchmark alone writes them."""
    return f"{measured.name}{'' if table == 'points' else f'-{table}'}.csv"
