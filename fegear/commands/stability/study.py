"""Parametric instability of a gear set with tooth friction."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal

from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.speed_ranges import MESH_FREQUENCY
from fegear.studies.columns import meanings
from fegear.studies.page import Columns, Page, RowTable, number, pluralize
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import display_name, refusal, setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from fegear.studies.trains.axes import axis_setting
from fegear.studies.trains.headings import friction_in_words
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.model_texts import BENDING as RATIO
from fegear.studies.trains.models import SLIDING, SPRINGS, lumped_model, tables_setting
from fegear.studies.trains.parametric import (
    FRICTION,
    OF_TEETH,
    TORQUE,
    ParametricProblem,
    ParametricStudy,
)
from fegear.studies.trains.speeds import (
    refuse_both,
    rpms_setting,
    speeds_setting,
    with_frequencies,
)
from fegear.studies.trains.train_problem import TrainFacts
from fegear.train.lumped_models import LumpedModel
from lumped.common.csv_text import format_exact
from lumped.common.options import Range
from lumped.figures.map_plots import axis_label
from lumped.figures.stability import draw_chart
from lumped.stability.intervals import Interval, StabilityScan, scan_stability
from lumped.stability.periodic_system import PeriodicSystem, periodic_system
from lumped.steady.maps import Axis

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_CELLS = 4_000_000
MAX_SHOWN = 12  # intervals on the screen
LEGEND = MESH_FREQUENCY, "floquet_max", "kind"


@dataclass(frozen=True, kw_only=True)
class Stability(
    ParametricStudy,
    Study,
    command="stability",
    example="stability liu-pair --over friction=0:0.2:21 --speeds 500:6000:25",
):
    """Parametric instability of a train with tooth friction.

    Floquet multipliers over speed and one parameter while teeth stay in contact. The
    edges of unstable intervals are traced, including those of intervals that are
    narrower than the steps of speed. With --output each value is stored in FILE.partial
    until the file is written; --resume continues from there.
    """

    resumes = True
    partial = True
    unit = "value"

    over: Axis = axis_setting(
        "Parameter: friction (coefficient), friction_bending (ratio), a key of "
        "the gear set, torque_Nm or damping_ratio, with N values from A to B, or "
        "values with commas."
    )
    speeds: tuple[float, ...] = speeds_setting(
        (),
        "Mesh frequencies of the first mesh [Hz] of the chart; this or --rpm. "
        "[default: none]",
        allowed=Range(0.1, 1e6, "Hz"),
    )
    rpm: tuple[float, ...] = rpms_setting("--speeds")
    method: Literal["peano-baker", "exponential"] = setting(
        "peano-baker",
        "Method for Floquet multipliers. peano-baker: the series of the state "
        "transition; exponential: exponentials of the mean stiffness on parts of "
        "the cycle. `bench stability` compares both with integration.",
    )
    torque: float | None = torque_setting()
    model: LumpedModel = lumped_model(SPRINGS | SLIDING, 1)
    table: tuple[str, ...] = tables_setting()

    def __post_init__(self) -> None:
        super().__post_init__()
        over, rising = display_name(self, "over"), self.rising
        if self.over.name not in OF_TEETH and self.table:
            raise refusal(self, "table", f"{over} varies what tables hold")
        if self.model.number != 1:
            raise self.rejection("number", "allowed is 1, of tooth pairs")
        refuse_both(self, "speeds", "rpm")
        if not (self.speeds or self.rpm):
            speeds, rpm = display_name(self, "speeds"), display_name(self, "rpm")
            raise InputError(f"{speeds} A:B:STEP or {rpm} A:B:STEP is needed")
        if len(rising) < 2:
            raise InputError("speeds = 1 speed; two or more are needed")
        if len(rising) * len(self.over.values) > MAX_CELLS:
            raise InputError(
                f"over = {len(self.over.values)} values at {len(rising)} speeds; "
                f"allowed are {MAX_CELLS} cells"
            )

    @property
    def axes(self) -> tuple[Axis, ...]:
        return (self.over,)

    @property
    def rising(self) -> tuple[float, ...]:
        """Speeds in rising order, each once [Hz]; those in rpm until they are known."""
        return tuple(sorted(set(self.speeds or self.rpm)))

    def prepare(self) -> StabilityProblem:
        return StabilityProblem.of(with_frequencies(self, {"speeds": self.rpm}))


@dataclass(frozen=True, eq=False)
class StabilityProblem(ParametricProblem):
    """A train at each value of what varies."""

    study: Stability

    @cached_property
    def natural_Hz(self) -> list[float]:
        """Modes that strain a mesh, without friction, at the first value."""
        system = self._system_at(self.study.over.values[0])
        natural: list[float] = system.frequency_Hz.tolist()
        return natural

    @cached_property
    def _lock(self) -> threading.Lock:
        """One thread at a time solves finite elements."""
        return threading.Lock()

    def tasks(self) -> Iterator[Task]:
        _ = self.natural_Hz  # what cannot be computed is refused at once
        for value in self.study.over.values:
            yield Task(repr(value), partial(self._examined, value), size=1)

    def _examined(self, value: float, job: Job) -> StabilityScan:
        for column in job.records:
            return column
        with self._lock:
            system = self._system_at(value)
        try:
            column = scan_stability(system, self.study.rising, self.study.method)
        except ArithmeticError as error:
            raise InputError(f"{self.gears.name}: {error}") from None
        job.add_record(column, {})
        return column

    def _system_at(self, value: float) -> PeriodicSystem:
        try:
            return periodic_system(self.system((value,)))
        except InputError:
            raise
        except ValueError as error:
            raise InputError(f"{self.gears.name}: {error}") from None

    def gather(self, results: Mapping[str, StabilityScan | None]) -> StabilityResult:
        columns: list[StabilityScan] = []
        for column in results.values():
            if column is None:
                break
            columns.append(column)
        header = self.header("none")
        del header["integration"]
        study, name = self.study, self.study.over.name
        if TORQUE not in study.names:
            header["torque_Nm"] = format_exact(self.load)
        header["method"] = study.method
        if len(columns) < len(study.over.values):
            header["incomplete"] = f"{len(columns)} of {len(study.over.values)} values"
        facts = self.facts(name, header, warnings=_warnings(name, columns))
        return StabilityResult(study, facts, tuple(columns), tuple(self.natural_Hz))


def _warnings(name: str, columns: Sequence[StabilityScan]) -> Iterator[str]:
    """Warn of what varies and changes nothing, to the bit."""
    others = columns[1:]
    if others and all((other.largest == columns[0].largest).all() for other in others):
        yield with_code("W16", f"{name} does not change the multipliers")


@dataclass(frozen=True, eq=False, repr=False)
class StabilityResult(StudyResult):
    """Charts of a gear set.

    columns : one for each value that is finished
    natural_Hz : of modes that strain a mesh, without friction, at the first value
    """

    study: Stability
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
        return {"plot": self._chart}

    def _chart(self) -> Figure:
        study = self.study
        title = self.facts.title
        if FRICTION not in study.names:
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
                "from\n[Hz]": _finite("from_Hz"),
                "to\n[Hz]": _finite("to_Hz"),
                "largest\nmultiplier": _finite("floquet_max"),
            }
            yield RowTable(_widest(columns)[:MAX_SHOWN], shown, whole=True)


def _finite(key: str) -> Any:
    return lambda row: number(row[key], 6) if math.isfinite(row[key]) else ""


def _widest(columns: list[dict[str, Any]]) -> list[dict[str, Any]]:
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
