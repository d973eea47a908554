"""The result of `fegear tolerances`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from math import sqrt
from typing import Any

from fegear.commands.tolerances.bands import QUANTILE_STDERR, ToleranceBands
from fegear.commands.tolerances.deviations import (
    DISTRIBUTION,
    LIMIT_OVER_STD,
    MEAN_STIFFNESS,
    PEAK_TO_PEAK,
)
from fegear.commands.tolerances.figure import draw_tolerances
from fegear.files.codes import with_code
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from lumped.common.units import UM

MAX_BAND_ERROR = 0.1  # of the first order, above which a warning follows
SCALES = {  # and names on the screen
    MEAN_STIFFNESS: (1e-8, "mean k [1e8 N/m]"),
    PEAK_TO_PEAK: (1e6, "STE p-p [um]"),
    DISTRIBUTION: (1.0, "K_Hbeta"),
}

BAND_COLUMNS: Columns = {
    "quantity": lambda row: SCALES[row["quantity"]][1],
    "nominal": lambda row: _scaled_text(row, "nominal"),
    "5 %": lambda row: _scaled_text(row, "p05"),
    "50 %": lambda row: _scaled_text(row, "p50"),
    "95 %": lambda row: _scaled_text(row, "p95"),
}

SOURCE_COLUMNS: Columns = {
    "tolerance": lambda row: row["source"].replace("_", " "),
    "limit\n+- um": cell("limit_um", 3),
    "part of variance\n[%]": cell("share_of_ste_peak_to_peak", 3, 100.0),
    "95 % value\nwithout it [%]": lambda row: row["without"],
}
WIDTH_COLUMNS: Columns = {
    "part of variance\nof K_Hbeta [%]": cell(
        "share_of_load_distribution_factor", 3, 100.0
    ),
}


def _scaled_text(row: Mapping[str, Any], key: str) -> str:
    return f"{SCALES[row['quantity']][0] * row[key]:.4g}"


def _percent_text(value: float, of: float) -> str:
    """Change of a value [%], with its sign."""
    return f"{100.0 * (value / of - 1.0):+.1f}"


@dataclass(frozen=True, eq=False)
class TolerancesResult(StudyResult):
    """Bands of pairs of gears within their tolerances; torque : on the driver [N m]."""

    study: Any
    gear_set: str
    torque: float
    bands: ToleranceBands
    complete: bool = True
    gear_warnings: tuple[str, ...] = ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, bands = self.study, self.bands
        least, nominal, largest = sorted(bands.contact_ratios)
        return {
            "gear_set": self.gear_set,
            "mesh": study.mesh,
            "torque_Nm": self.torque,
            "driver_grade": study.driver_grade or study.grade,
            "driven_grade": study.driven_grade or study.grade,
            "distribution": study.distribution,
            "samples": len(bands.solved.ste),
            "seed": study.seed,
            "quantities": bands.rows,
            "tolerances": self._source_rows,
            "contact_ratio": nominal,
            "contact_ratio_least": least,
            "contact_ratio_largest": largest,
            "lost_contact_fraction": float(bands.solved.lost_contact.mean()),
            "moved_extremes_fraction": bands.moved_extremes,
            "jammed_fraction": bands.jammed,
            "evidence": [self._accuracy_text],
            "warnings": [*self.gear_warnings, *self._warnings()],
        }

    @property
    def _source_rows(self) -> list[dict[str, Any]]:
        bands = self.bands
        return [
            {
                "source": source,
                "limit_um": limit / UM,
                "share_of_ste_peak_to_peak": bands.effects[PEAK_TO_PEAK][source],
                "share_of_mean_stiffness": bands.effects[MEAN_STIFFNESS][source],
                "first_order_p95_without_um": bands.peak_to_peak_without[source] / UM,
            }
            | (
                {f"share_of_{DISTRIBUTION}": bands.effects[DISTRIBUTION][source]}
                if DISTRIBUTION in bands.effects
                else {}
            )
            for source, limit in bands.limits.items()
        ]

    @property
    def _limit_effects(self) -> list[dict[str, Any]]:
        """A row for each tolerance, with the change of the 95 % value without it."""
        (row,) = (row for row in self.bands.rows if row["quantity"] == PEAK_TO_PEAK)
        every = row["first_order_p95"] / UM
        return [
            source
            | {"without": _percent_text(source["first_order_p95_without_um"], every)}
            for source in self._source_rows
        ]

    @property
    def _values_outside_limits(self) -> Iterator[str]:
        """A line for each quantity whose nominal value is outside its band."""
        for row in self.bands.rows:
            if row["p05"] <= row["nominal"] <= row["p95"]:
                continue
            change = "raise" if row["nominal"] < row["p05"] else "lower"
            yield (
                f"{SCALES[row['quantity']][1]}: the nominal value is outside the band; "
                f"deviations of either sign take load from a tooth pair and {change} it"
            )

    @property
    def _accuracy_text(self) -> str:
        text = (
            "derivatives of the transmission error from one contact solution, off "
            f"slopes over the scatter by {self.bands.linear.derivative_error:.2g}"
        )
        return with_code("E21", text)

    def _warnings(self) -> Iterator[str]:
        bands = self.bands
        stderr = QUANTILE_STDERR / sqrt(len(bands.solved.ste))
        for row in bands.rows:
            if row["band_error"] > MAX_BAND_ERROR + 2.0 * stderr:
                yield with_code("W29", self._nonlinear_warning(row))
        if bands.jammed > 0.0:
            text = (
                f"backlash {bands.backlash / UM:.3g} um at the nominal centre distance;"
                f" the teeth of {100.0 * bands.jammed:.2g} % of the pairs of gears "
                "would jam"
            )
            yield with_code("W30", text)

    def _nonlinear_warning(self, row: Mapping[str, Any]) -> str:
        """How far the first order of a quantity is off, and what it leaves out."""
        names = "p05", "p95", "first_order_p05", "first_order_p95"
        low, high, low_linear, high_linear = (_scaled_text(row, name) for name in names)
        lost = 100.0 * self.bands.solved.lost_contact.mean()
        return (
            f"{SCALES[row['quantity']][1]}: 5 and 95 % are {low} and {high}, to first "
            f"order {low_linear} and {high_linear}, {100.0 * row['band_error']:.0f} % "
            f"of the band off; {lost:.0f} % of the pairs of gears have a tooth pair on "
            "the path of contact without load, "
            f"{100.0 * self.bands.moved_extremes:.0f} % have their extremes elsewhere"
        )

    @property
    def _header(self) -> dict[str, str]:
        summary = self.summary
        names = "torque_Nm", "driver_grade", "driven_grade", "distribution", "samples"
        limits = self.bands.limits.items()
        return {
            **{name: f"{summary[name]}" for name in (*names, "seed")},
            **{f"{name} [um]": f"{limit / UM:g}" for name, limit in limits},
            **self.study.gear_set.entries,
        }

    @property
    def table(self) -> Table:
        """A row for each quantity."""
        return Table.of_rows(self.bands.rows, self._header)

    @property
    def more_tables(self) -> dict[str, Table]:
        return {"samples_table": self._sample_table, "cycle": self._cycle_table}

    @property
    def _sample_table(self) -> Table:
        """A row for each pair of gears."""
        return Table.of(self.bands.sample_columns, self._header)

    @property
    def _cycle_table(self) -> Table:
        """A row for each position."""
        return Table.of(self.bands.cycle_columns, self._header)

    @property
    def figures(self) -> Mapping[str, Draw]:
        title = (
            f"{self.gear_set}, mesh {self.study.mesh}, {self.torque:g} N m: "
            f"{len(self.bands.solved.ste)} pairs of gears within their tolerances"
        )
        return {"plot": partial(draw_tolerances, self.bands, title)}

    def page(self) -> Page:
        values = self.summary
        yield (
            "{gear_set} mesh {mesh} at {torque_Nm:g} N m, grades {driver_grade} and "
            "{driven_grade} of ISO 1328-1: {samples} pairs of gears, seed {seed}"
        ).format_map(values)
        yield RowTable(values["quantities"], BAND_COLUMNS, "Bands", ("quantity",))
        kind = "uniform within the limits"
        if values["distribution"] == "normal":
            kind = f"normal, limits at {LIMIT_OVER_STD:g} standard deviations"
        title = f"Tolerances, {kind}: effect on STE p-p to first order"
        of_width = WIDTH_COLUMNS if DISTRIBUTION in self.bands.effects else {}
        columns = SOURCE_COLUMNS | of_width
        yield RowTable(self._limit_effects, columns, title, ("tolerance",))
        yield from self._values_outside_limits
        yield (
            "contact ratio {contact_ratio_least:.4g} to {contact_ratio_largest:.4g}"
        ).format_map(values)
        yield from values["evidence"]
