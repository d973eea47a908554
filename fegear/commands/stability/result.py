"""The result of `fegear stability`: its page, tables and figures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from fegear.files.speed_ranges import MESH_FREQUENCY
from fegear.studies.columns import meanings
from fegear.studies.page import Columns, Page, RowTable, number, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.headings import friction_in_words
from fegear.studies.trains.model_texts import BENDING as RATIO
from fegear.studies.trains.parametric import FRICTION
from fegear.studies.trains.train_problem import TrainFacts
from lumped.figures.map_plots import axis_label
from lumped.figures.stability import draw_chart
from lumped.stability.intervals import Interval, StabilityScan

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_SHOWN = 12  # intervals on the screen
LEGEND = MESH_FREQUENCY, "floquet_max", "kind"


@dataclass(frozen=True, eq=False)
class StabilityResult(StudyResult):
    """Charts of a gear set.

    columns : one for each value that is finished
    natural_Hz : of modes that strain a mesh, without friction, at the first value
    """

    study: Any
    facts: TrainFacts
    columns: tuple[StabilityScan, ...]
    natural_Hz: tuple[float, ...]

    @property
    def complete(self) -> bool:
        return len(self.columns) == len(self.study.over.values)

    @property
    def empty(self) -> bool:
        return not self.columns

    @property
    def table(self) -> Table:
        """A row for each cell of the chart."""
        names = MESH_FREQUENCY, self.study.over.name, "floquet_max", "kind"
        legend = meanings("stability", *LEGEND)
        table = Table(names, self._rows, {**self.facts.header, **legend})
        return self.facts.with_driver_speed(table)

    def _rows(self) -> Iterator[tuple[float, float, float, str]]:
        speeds = self.study.rising
        for value, column in zip(self.study.over.values, self.columns, strict=False):
            kinds = column.kinds(speeds)
            for speed, largest, kind in zip(
                speeds, column.largest.tolist(), kinds, strict=True
            ):
                yield speed, value, largest, kind

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, name = self.study, self.study.over.name
        unstable = [len(column.intervals) > 0 for column in self.columns]
        return {
            **self.facts.summary,
            "friction_coefficient": None if name == FRICTION else study.model.friction,
            "friction_bending_ratio": self.facts.header.get(RATIO),
            "method": study.method,
            "speeds": len(study.rising),
            "first_speed_Hz": study.rising[0],
            "last_speed_Hz": study.rising[-1],
            "values": len(study.over.values),
            "complete": self.complete,
            "natural_frequencies_Hz": list(self.natural_Hz),
            "values_with_instability": sum(unstable),
            "columns": [
                {
                    "value": value,
                    "largest_multiplier": float(column.largest.max()),
                    "intervals": list(map(_interval_values, column.intervals)),
                }
                for value, column in zip(study.over.values, self.columns, strict=False)
            ],
            "warnings": list(self.facts.warnings),
        }

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._draw_chart}

    def _draw_chart(self) -> Figure:
        study = self.study
        title = self.facts.title
        if FRICTION not in study.axis_names:
            title += friction_in_words(study.model.friction)
        if RATIO in self.facts.header:
            title += f", {RATIO} {self.facts.header[RATIO]}"
        values = study.over.values[: len(self.columns)]
        limits = study.rising[0], study.rising[-1]
        label = axis_label(study.over.name)
        return draw_chart(values, self.columns, limits, label, title)

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield self.facts.title
        natural = ", ".join(
            f"f{i} {number(hertz, 5)}"
            for i, hertz in enumerate(values["natural_frequencies_Hz"], start=1)
        )
        yield f"natural frequencies of modes that strain a mesh [Hz]: {natural}"
        columns = values["columns"]
        yield (
            f"{pluralize(len(columns), 'value')} of {values['over']}, at "
            f"{values['values_with_instability']} of them vibration grows at some speed"
        )
        if columns:
            largest = max(column["largest_multiplier"] for column in columns)
            yield f"largest multiplier at the speeds {number(largest, 6)}"
        if values["values_with_instability"]:
            shown: Columns = {
                "combination": lambda row: row["kind"] or "none",
                f"{values['over']}\nfrom": lambda row: f"{row['first']:g}",
                "to": lambda row: f"{row['last']:g}",
                "widest\nat": lambda row: f"{row['value']:g}",
                "from\n[Hz]": _finite_cell("from_Hz"),
                "to\n[Hz]": _finite_cell("to_Hz"),
                "largest\nmultiplier": _finite_cell("floquet_max"),
            }
            yield RowTable(_widest_intervals(columns)[:MAX_SHOWN], shown, whole=True)


def _finite_cell(key: str) -> Any:
    return lambda row: number(row[key], 6) if math.isfinite(row[key]) else ""


def _widest_intervals(columns: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """For each combination, the widest first: where it is, and its widest interval."""
    by_kind: dict[str, list[dict[str, Any]]] = {}
    rows: list[dict[str, Any]] = []
    for column in columns:
        for interval in column["intervals"]:
            width = interval["to_Hz"] - interval["from_Hz"]
            place = {**interval, "width": width, "value": column["value"]}
            by_kind.setdefault(interval["kind"], []).append(place)
    for intervals in by_kind.values():
        widest = max(
            intervals, key=lambda interval: (interval["width"], -interval["value"])
        )
        ends = [interval["value"] for interval in intervals]
        rows.append({**widest, "first": min(ends), "last": max(ends)})
    return sorted(rows, key=lambda row: -row["width"])


def _interval_values(interval: Interval) -> dict[str, Any]:
    return {
        "kind": interval.kind,
        "from_Hz": interval.low,
        "to_Hz": interval.high,
        "floquet_max": interval.largest,
        "at_Hz": interval.worst,
    }
