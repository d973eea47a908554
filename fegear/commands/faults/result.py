"""The result of `fegear faults`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.commands.faults.fault_runs import INDICATORS, FaultRuns
from fegear.files.data_sets import DATA_SETS, DataArray, write_data_set
from fegear.files.errors import InputError
from fegear.files.output import path_of, require_ending
from fegear.files.version import package_version
from fegear.studies.columns import (
    MAIN,
    meaning_and_unit,
    shared_meaning,
    unit_of_column,
)
from fegear.studies.page import Columns, Page, RowTable, number, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table, finite_or_none
from fegear.studies.trains.shown_signals import (
    SCALES,
    SHOWN_SIGNALS,
    SUFFIXES,
    signal_label,
)
from fegear.studies.trains.train_problem import TrainFacts
from lumped.common.array_types import Array
from lumped.figures.fault_indicators import IndicatorPoints, draw_indicators

UNITLESS = ("residual_kurtosis", "tooth")
AVERAGES, OF_AVERAGES = "average over turns", ("angle_deg", "tooth")
NO_TOOTH = 0  # label of a run without a faulty tooth; teeth count from 1


def indicator_column(signal: str, indicator: str) -> str:
    """Name of the column of an indicator of a signal, such as mesh1_dte_rms_m."""
    unit = next(suffix for suffix in SUFFIXES if signal.endswith(suffix))
    name = f"{signal.removesuffix(unit)}_{indicator}"
    return name if indicator in UNITLESS else name + unit


@dataclass(frozen=True, eq=False, kw_only=True)
class FaultSignalsResult(StudyResult):
    """A labelled set of signals.

    gear : name of the one over whose turns signals are averaged
    labels : (r,) values of axes and settings by column
    runs : signals and indicators
    tooth : (p,) of the gear at the pitch point of its first mesh, from 1
    """

    study: Any
    facts: TrainFacts
    gear: str
    labels: Mapping[str, NDArray[Any]]
    runs: FaultRuns
    tooth: NDArray[np.int64]

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, runs = self.study, self.runs
        return {
            **self.facts.summary,
            "gear": self.gear,
            "turns": study.turns,
            "samples_per_mesh_cycle": study.samples,
            "axes": [
                {"axis": name, "column": column, **_value_range(self.labels[column])}
                for name, column in self._axis_columns
            ],
            "runs": len(runs.statuses),
            "statuses": {
                status: runs.statuses.count(status)
                for status in sorted(set(runs.statuses))
            },
            "random_points": study.random is not None,
            "named_runs": self._named_runs,
            "signals": [self._signal_entry(c) for c in range(len(runs.names))],
            "warnings": list(self.facts.warnings),
        }

    @property
    def _axis_columns(self) -> list[tuple[str, str]]:
        """Axes and their columns, which are the first after the number of the run."""
        columns = list(self.labels)[1:]
        return list(zip(self.study.axis_names, columns, strict=False))

    def _signal_entry(self, c: int) -> dict[str, Any]:
        """Ranges of the indicators of a signal, in the unit at the end of its name."""
        name, indicators = self.runs.names[c], self.runs.indicators
        ranges = {}
        for key in INDICATORS[:-1]:
            for end, pick in (("least", np.fmin), ("largest", np.fmax)):
                value = float(pick.reduce(indicators[key][:, c]))
                ranges[f"{end}_{key}"] = finite_or_none(value)
        tooth, has_tooth = self.labels.get("faulty_tooth"), self._has_faulty_tooth
        named_teeth, named = indicators["tooth"][:, c], None
        if tooth is not None and not np.isnan(named_teeth).all():
            named = named_teeth == tooth
        return {
            "signal": name,
            "unit": unit_of_column(name),
            **ranges,
            "faulty_runs": None if tooth is None else int(has_tooth.sum()),
            "runs_with_faulty_tooth": None if named is None else int(named.sum()),
        }

    @property
    def _named_runs(self) -> dict[str, int] | None:
        """Runs with a faulty tooth by the tooth that all signals name."""
        if "faulty_tooth" not in self.labels:
            return None
        if not self._has_faulty_tooth.any():
            return None
        named = self.runs.named_tooth[self._has_faulty_tooth]
        tooth = self.labels["faulty_tooth"][self._has_faulty_tooth]
        right, unsure = int((named == tooth).sum()), int(np.isnan(named).sum())
        return {"right": right, "wrong": named.size - right - unsure, "unsure": unsure}

    @property
    def _has_faulty_tooth(self) -> NDArray[np.bool_]:
        """Whether each run has signals of a gear with a faulty tooth."""
        tooth = self.labels.get("faulty_tooth", np.array(NO_TOOTH))
        return np.asarray(self.runs.settled & (tooth != NO_TOOTH))

    @property
    def _header(self) -> dict[str, str]:
        study = self.study
        return {
            **self.facts.header,
            "gear": self.gear,
            "turns": str(study.turns),
            "samples per mesh cycle": str(study.samples),
        }

    @property
    def _columns(self) -> dict[str, NDArray[Any]]:
        """Labels and indicators (r,) by column."""
        runs = self.runs
        indicators = {
            indicator_column(name, key): runs.indicators[key][:, c]
            for c, name in enumerate(runs.names)
            for key in INDICATORS
        }
        status = {
            "settled": runs.settled,
            "status": np.array(runs.statuses),
            "named_tooth": runs.named_tooth,
        }
        return {**self.labels, **status, **indicators}

    @property
    def table(self) -> Table:
        """A row for every run."""
        return Table.of(self._columns, self._header)

    @property
    def more_tables(self) -> dict[str, Table]:
        return {"labels": self.table}

    def write(self, path: str | Path) -> None:
        """Write signals and labels as .h5, .nc or .mat, or labels alone as .csv.

        Parameters
        ----------
        path : str or Path
            File.

        Raises
        ------
        InputError
            If the ending is another one, the file cannot be written, or h5py is
            missing for .h5.
        """
        target = path_of(path)
        require_ending(target, self.study.endings)
        if target.suffix.lower() not in DATA_SETS:
            self.to_csv(target)
            return
        attributes = {
            "made_with": f"fegear {package_version()}",
            "command": " ".join(["fegear", *self.study.argv]),
            **{key.replace("/", "_"): text for key, text in self._header.items()},
        }
        try:
            write_data_set(target, attributes, self._data_set_groups)
        except ValueError as error:
            raise InputError(f"{target}: {error}") from None

    @property
    def _data_set_groups(self) -> dict[str, dict[str, DataArray]]:
        """Arrays of a file of the set, by group."""
        runs = self.runs
        labels = {
            name: DataArray(values, ("run",), self._attributes(name))
            for name, values in self._columns.items()
        }
        points = len(self.tooth)
        turn = {
            "angle_deg": 360.0 * np.arange(points) / points,
            "tooth": self.tooth,
        }
        groups = {
            "labels": labels,
            "turn": {
                name: DataArray(values, ("point",), self._attributes(name))
                for name, values in turn.items()
            },
            "averages": self._data_arrays_by_signal(runs.average, "point"),
            "residuals": self._data_arrays_by_signal(runs.residual, "point"),
        }
        if runs.values is not None:
            groups["signals"] = self._data_arrays_by_signal(runs.values, "sample")
        return groups

    def _data_arrays_by_signal(
        self, values: Array, dimension: str
    ) -> dict[str, DataArray]:
        """Arrays (r, n) by the names of signals; values : (r, c, n)."""
        return {
            name: DataArray(
                values[:, c], ("run", dimension), _attributes_of_signal(name)
            )
            for c, name in enumerate(self.runs.names)
        }

    def _attributes(self, name: str) -> dict[str, str]:
        if name in OF_AVERAGES:
            meaning, unit = shared_meaning(AVERAGES, name), unit_of_column(name)
        else:
            meaning, unit = meaning_and_unit(self.study.command, name, MAIN, {})
        return {"units": unit or "1", **({"long_name": meaning} if meaning else {})}

    @property
    def figures(self) -> dict[str, Draw]:
        """Residuals and their kurtosis over the first axis, coloured by the second."""
        return {"plot": self._draw_signals}

    def _draw_signals(self) -> Any:
        runs, axes = self.runs, self._axis_columns
        first, second = axes[0][1], axes[1][1] if len(axes) > 1 else None
        panels = []
        for c, name in enumerate(runs.names[:SHOWN_SIGNALS]):
            scale, unit = SCALES[unit_of_column(name)]
            panels.append(
                IndicatorPoints(
                    name=signal_label(name),
                    unit=unit,
                    residual=scale * runs.indicators["residual_rms"][:, c],
                    kurtosis=runs.indicators["residual_kurtosis"][:, c],
                )
            )
        groups = None if second is None else (_axis_label(second), self.labels[second])
        return draw_indicators(
            panels, (_axis_label(first), self.labels[first]), groups, self._title
        )

    @property
    def _title(self) -> str:
        values = self.summary
        return (
            f"{values['gear_set']}, model {values['model']}, {values['excitation']}: "
            f"{pluralize(values['runs'], 'run')}, averages over "
            f"{pluralize(values['turns'], 'turn')} of {self.gear}"
        )

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield self._title
        for axis in values["axes"]:
            yield (
                f"{axis['column']}: {axis['count']} values from {axis['least']:.6g} to "
                f"{axis['largest']:.6g}"
            )
        yield RowTable(values["signals"], INDICATOR_COLUMNS, "indicators of the runs")
        if counts := values["named_runs"]:
            yield (
                "tooth by all signals of a run: right in {right} of them, wrong in "
                "{wrong}, not sure in {unsure}".format_map(counts)
            )


def _value_range(values: NDArray[Any]) -> dict[str, Any]:
    return {
        "least": float(values.min()),
        "largest": float(values.max()),
        "count": len(np.unique(values)),
    }


def _attributes_of_signal(name: str) -> dict[str, str]:
    meaning, _, _ = shared_meaning("signals of sensors", name).partition(
        "; in a spectrum"
    )
    return {"units": unit_of_column(name), "long_name": meaning}


def _axis_label(column: str) -> str:
    """A column in words with its unit."""
    unit = unit_of_column(column)
    end = unit.replace(" ", "") if unit else ""
    for suffix in (f"_{end}", "_percent", "_Nm"):
        column = column.removesuffix(suffix) if unit else column
    text = column if "." in column else column.replace("_", " ")
    return f"{text} [{unit}]" if unit else text


def _recognised_share(row: Mapping[str, Any]) -> str:
    """Runs whose residual names the faulty tooth, of those that have one."""
    runs, named = row["faulty_runs"], row["runs_with_faulty_tooth"]
    return "none" if named is None else f"{named} of {runs}"


def _range_cell(key: str) -> Any:
    """The cell of the range of an indicator in the unit that is shown."""

    def text(row: Mapping[str, Any]) -> str:
        scale = 1.0 if key in UNITLESS else SCALES[row["unit"]][0]
        ends = row[f"least_{key}"], row[f"largest_{key}"]
        shown = ("none" if end is None else number(scale * end, 3) for end in ends)
        return " to ".join(shown)

    return text


INDICATOR_COLUMNS: Columns = {
    "signal": lambda row: signal_label(row["signal"]),
    "unit": lambda row: SCALES[row["unit"]][1],
    "RMS": _range_cell("rms"),
    "RMS of\nresidual": _range_cell("residual_rms"),
    "peak of\nresidual": _range_cell("residual_peak"),
    "kurtosis of\nresidual": _range_cell("residual_kurtosis"),
    "runs at the\nfaulty tooth": _recognised_share,
}
