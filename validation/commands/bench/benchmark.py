"""Run time against error: what every benchmark measures, draws and leaves."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fegear.figures.saving import save_figure
from fegear.files.output import write_text, write_whole
from lumped.common.csv_text import format_records
from lumped.figures.drawing import draw_title, panels
from validation import pages
from validation.study.provenance import machine, provenance

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = "points"  # the table that is drawn
QUICK = "quick: few points, not judged"
REPEATS = 3
MARKERS = "osD^v"  # of curves, which have no more
Row = TypeVar("Row")


@dataclass(frozen=True)
class CostCurve:
    """Points (x, y) of a line; settings : by which they are named, if any."""

    label: str
    marker: str
    points: Sequence[tuple[float, float]]
    settings: Sequence[float] = ()


@dataclass(frozen=True)
class Panel:
    """Curves over one another, doubly logarithmic.

    limit : (x, label) of a dotted line
    """

    x: str
    y: str
    curves: Sequence[CostCurve]
    limit: tuple[float, str] | None = None


@dataclass(frozen=True, eq=False)
class Benchmark:
    """What was measured.

    name : of its files; about : what its figure shows, one sentence
    tables : rows with equal keys by the table's name, POINTS first
    panels : of its figure, the first with time over error
    facts : single values in addition to them
    left_out : columns that no screen has room for; findings : sentences below them
    failures : what is beyond its limits
    interrupted : whether Ctrl-C ended it
    quick : whether it has few points, by which nothing is judged
    """

    name: str
    title: str
    about: str
    tables: Mapping[str, Sequence[Mapping[str, Any]]]
    panels: Sequence[Panel]
    facts: Mapping[str, float] = field(default_factory=dict)
    left_out: Sequence[str] = ()
    findings: Sequence[str] = ()
    failures: Sequence[str] = ()
    interrupted: bool = False
    quick: bool = False

    @property
    def values(self) -> dict[str, Any]:
        """All of it, ready for JSON."""
        return {"quick": self.quick, **self.tables, **self.facts}

    @property
    def heading(self) -> str:
        """The title, with what is quick."""
        return f"{self.title}\n{QUICK}" if self.quick else self.title

    def draw(self) -> Figure:
        """Panels below each other."""
        count = len(self.panels)
        figure, rows = panels(count, size=(6.4, 1.2 + 3.8 * count))
        draw_title(figure, self.heading)
        for panel, (axes,) in zip(self.panels, rows, strict=True):
            axes.set_xlabel(panel.x)
            axes.set_ylabel(panel.y)
            for curve in panel.curves:
                _draw_curve(axes, curve)
            if panel.limit:
                at, label = panel.limit
                axes.axvline(at, color="0.6", ls=":", label=label)
            axes.legend(fontsize=8)
        return figure


def _draw_curve(axes: Axes, curve: CostCurve) -> None:
    places = np.array(curve.points, float).reshape(-1, 2)
    axes.loglog(*places.T, f"{curve.marker}-", label=curve.label)
    for setting, point in zip(curve.settings, curve.points, strict=False):
        axes.annotate(
            f"{setting:g}",
            point,
            textcoords="offset points",
            xytext=(4, 4),
            fontsize=7,
        )


def curves_of(
    rows: Sequence[Row],
    label: Callable[[Row], str],
    place: Callable[[Row], tuple[float, float]],
    setting: Callable[[Row], float] | None = None,
) -> list[CostCurve]:
    """A curve for each label, in the order of the rows."""
    curves = []
    for name, marker in zip(dict.fromkeys(map(label, rows)), MARKERS, strict=False):
        curve_rows = [row for row in rows if label(row) == name]
        settings = [] if setting is None else list(map(setting, curve_rows))
        curves.append(CostCurve(name, marker, list(map(place, curve_rows)), settings))
    return curves


def collect(
    table_rows: Iterable[tuple[str, DataclassInstance]], *tables: str
) -> tuple[dict[str, list[Any]], bool]:
    """Rows by table, POINTS and others, and whether Ctrl-C ended them early."""
    rows: dict[str, list[Any]] = {name: [] for name in (POINTS, *tables)}
    try:
        for table, row in table_rows:
            rows[table].append(row)
    except KeyboardInterrupt:
        return rows, True
    return rows, False


def plain(rows: Mapping[str, Sequence[DataclassInstance]]) -> dict[str, list[Any]]:
    """Tables of dataclasses as tables of dictionaries."""
    return {
        name: [asdict(row) for row in table_rows] for name, table_rows in rows.items()
    }


def fastest(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Seconds of the fastest of several runs, after one that compiles."""
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """Slope of log(y) over log(x), NaN for less than two points."""
    if len(x) < 2:
        return math.nan
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def files_of(name: str, output: Path) -> tuple[Path, Path]:
    """Table of the points and figure of a benchmark."""
    return output / f"{name}.csv", output / f"{name}.png"


def write_benchmark(measured: Benchmark, output: Path) -> None:
    """The points as CSV and the figure as PNG."""
    table, picture = files_of(measured.name, output)
    write_text(table, format_records(measured.tables[POINTS]))
    write_whole(picture, lambda path: save_figure(measured.draw(), path))


def write_page(measured: Sequence[Benchmark], output: Path, command: str) -> Path:
    """Write index.html next to its figures and tables; return its path."""
    page = output / "index.html"
    studies = [_study(benchmark, output) for benchmark in measured]
    about = {**dict(provenance()), "machine": machine()}
    text = pages.filled("bench.html", studies=studies, command=command, about=about)
    write_text(page, text)
    return page


def _study(measured: Benchmark, output: Path) -> dict[str, Any]:
    name, about = measured.name, measured.about
    quick = " --quick" if measured.quick else ""
    tables = {table: rows for table, rows in measured.tables.items() if rows}
    files = {
        table: f"{name}{'' if table == POINTS else f'-{table}'}.csv" for table in tables
    }
    for table, rows in tables.items():
        write_text(output / files[table], format_records(rows))
    figure, command = measured.draw(), f"fegear bench {name}{quick} -o bench"
    data = tuple(files.items())
    return {
        "title": measured.heading,
        "about": about,
        "figure": pages.save_figure(figure, output, name, about, command, data),
        "tables": tables,
        "files": files,
        "facts": measured.facts,
    }
