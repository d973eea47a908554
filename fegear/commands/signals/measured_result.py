"""Averages of a recording over turns, beside those of computed signals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fegear.commands.signals.entries import (
    GearAverages,
    averages_table,
    indicators_table,
    label_with_unit,
    scale_of,
)
from fegear.commands.signals.result import SignalsResult
from fegear.commands.signals.separated import (
    SeparatedGear,
    differing_gears,
    draw_separated,
    naming_sentence,
    sensor_sentence,
    separated_rows,
    separated_table,
)
from fegear.files.codes import with_code
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from fegear.studies.page import Page, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from lumped.figures.order_maps import OrderCurves, draw_order_maps
from lumped.figures.turn_averages import draw_measured_averages
from lumped.signals.orders import OrderMap
from lumped.signals.ring_sensor import RingSensor


@dataclass(frozen=True, eq=False)
class MeasuredResult(StudyResult):
    """Averages of the channels of a recording over turns of the gears of a set.

    averages : over the turns of every gear that turns at least once
    shown : index among them of the gear whose rotation is measured
    sampling_rate : of the recording [Hz]; duration : of it [s]
    turns : of the gear; mean_speed, speed_range : of it [turns per second]
    rotation_source : what the rotation follows from, in words
    repaired_pulses : number of pulses that were missing and too many, None without a
        tachometer
    pulse_scatter : RMS of intervals over those on both sides, less 1; None without one
    orders : spectra over windows of turns of the gear
    notes : on the recording; warnings : of it
    sensor : on the ring of a planetary set, None of others
    separated : averages over the teeth of its sun and of each planet, by channel
    computed : signals at the mean speed, None where none are computed
    """

    study: Any
    gear_set: str
    averages: tuple[GearAverages, ...]
    shown: int
    sampling_rate: float
    duration: float
    turns: float
    mean_speed: float
    speed_range: tuple[float, float]
    rotation_source: str
    repaired_pulses: tuple[int, int] | None
    pulse_scatter: float | None
    orders: OrderMap
    notes: tuple[str, ...]
    warnings: tuple[str, ...]
    sensor: RingSensor | None
    separated: Mapping[str, tuple[SeparatedGear, ...]]
    computed: SignalsResult | None = None

    @property
    def gear_averages(self) -> GearAverages:
        """Averages over the turns of the gear whose rotation is measured."""
        return self.averages[self.shown]

    @cached_property
    def summary(self) -> dict[str, Any]:
        one, computed = self.gear_averages, self.computed
        dropped, doubled = self.repaired_pulses or (None, None)
        lowest, highest = (self._rpm(speed) for speed in self.speed_range)
        return {
            "gear_set": self.gear_set,
            "measured": self.study.measured,
            "gear": one.gear.name,
            "gear_speed_rpm": self._rpm(self.mean_speed),
            "lowest_gear_speed_rpm": lowest,
            "highest_gear_speed_rpm": highest,
            "rotation": self.rotation_source,
            "pulses_missing": dropped,
            "pulses_doubled": doubled,
            "pulse_scatter": self.pulse_scatter,
            "duration_s": self.duration,
            "sampling_rate_Hz": self.sampling_rate,
            "turns": one.average.turns,
            "window_turns": min(int(self.study.window), one.average.turns),
            "mesh_orders": list(one.gear.orders),
            "signals": one.entries,
            "other_gears": [
                {
                    "gear": other.gear.name,
                    "turns": other.average.turns,
                    "mesh_orders": list(other.gear.orders),
                    "signals": other.entries,
                }
                for other in self.averages
                if other is not one
            ],
            **self._sensor_entries,
            "computed": None if computed is None else computed.summary,
            "notes": list(self.notes),
            "warnings": [*self.warnings, *one.disagreement(), *self._of_computed],
        }

    @property
    def _sensor_entries(self) -> dict[str, Any]:
        """Entries on the sensor of a planetary set, none of others."""
        if self.sensor is None:
            return {}
        return {
            "sensor_deg": math.degrees(self.sensor.direction),
            "sensor_window_deg": math.degrees(self.sensor.width),
            "separated": [
                {"signal": name, **entry}
                for name, entries in self._separated_entries.items()
                for entry in entries
            ],
        }

    @cached_property
    def _separated_entries(self) -> dict[str, list[dict[str, Any]]]:
        """Entries of the sun and of each planet, by channel."""
        return {
            name: [gear.entry for gear in separated]
            for name, separated in self.separated.items()
        }

    @property
    def _of_computed(self) -> list[str]:
        return [] if self.computed is None else self.computed.summary["warnings"]

    def _rpm(self, turn_frequency: float) -> float:
        return SECONDS_PER_MINUTE * turn_frequency

    @property
    def _header(self) -> dict[str, str]:
        return {
            "gear set": self.gear_set,
            "recording": self.study.measured,
            "gear": self.gear_averages.gear.name,
            "rotation": self.rotation_source,
            "turns": str(self.gear_averages.average.turns),
        }

    @property
    def table(self) -> Table:
        """A row for every channel and gear, and every signal that is computed."""
        rows = [
            {"source": "measured", "gear": one.gear.name} | entry
            for one in self.averages
            for entry in one.entries
        ]
        if self.computed is not None:
            one = self.computed.averages
            rows += [
                {"source": "computed", "gear": one.gear.name} | entry
                for entry in one.entries
            ]
        return Table.of_rows(rows, self._header)

    @property
    def more_tables(self) -> dict[str, Table]:
        """A row for every angle and order of every gear's averages, and every order of
        every window."""
        order_columns = [
            {"order": np.arange(len(one.average.amplitude)), **one.over_orders}
            for one in self.averages
        ]
        turn_columns = [one.over_turn for one in self.averages]
        tables = {
            "average": self._table_of_gears(turn_columns),
            "spectrum": self._table_of_gears(order_columns),
            "orders": self._orders_table,
        }
        if self.separated:
            rows = separated_rows(self.separated)
            tables["separated"] = Table.of(rows, self._header)
        return tables

    def _table_of_gears(self, parts: list[dict[str, Any]]) -> Table:
        """Columns of all gears below each other, with the name of the gear."""
        names = [
            np.full(len(next(iter(part.values()))), one.gear.name)
            for one, part in zip(self.averages, parts, strict=True)
        ]
        columns = {
            key: np.concatenate([part[key] for part in parts]) for key in parts[0]
        }
        return Table.of({"gear": np.concatenate(names), **columns}, self._header)

    @property
    def _orders_table(self) -> Table:
        orders = self.orders
        windows, size, signals = orders.amplitude.shape
        amplitude = orders.amplitude.reshape(-1, signals)
        columns = {
            "turns_of_gear": np.repeat(orders.turns, size),
            "order": np.tile(orders.order, windows),
            **self.gear_averages.columns(amplitude),
        }
        return Table.of(columns, self._header)

    @property
    def figures(self) -> dict[str, Draw]:
        """Averages and spectra beside those of computed signals, and order maps."""
        pictures = {"plot": self._draw_averages, "order_map": self._draw_order_map}
        if self.separated:
            pictures["separated_plot"] = self._draw_separated
        return pictures

    def _draw_separated(self) -> Any:
        """Averages of the first channel over the teeth that pass the sensor."""
        name, separated = next(iter(self.separated.items()))
        title = f"{label_with_unit(name)}, by teeth that pass the sensor"
        return draw_separated(separated, name, f"{self._title}\n{title}")

    def _draw_averages(self) -> Any:
        one, computed = self.gear_averages, self.computed
        return draw_measured_averages(
            one.curves(one.shown),
            []
            if computed is None
            else computed.averages.curves(computed.averages.shown),
            one.tooth_axis,
            one.gear.orders,
            self._title,
        )

    def _draw_order_map(self) -> Any:
        """Spectra of the first channels over orders and turns."""
        one = self.gear_averages
        maps = [
            OrderCurves(
                label_with_unit(name),
                scale_of(name)[0] * self.orders.amplitude[:, :, c],
            )
            for c, name in enumerate(one.names)
            if c in one.shown
        ]
        axes = self.orders.order, self.orders.turns
        ylabel = f"turns of {one.gear.name}"
        return draw_order_maps(maps, axes, one.gear.teeth, (self._title, ylabel))

    @property
    def _title(self) -> str:
        one = self.gear_averages
        lowest, highest = (self._rpm(speed) for speed in self.speed_range)
        speeds = f"{self._rpm(self.mean_speed):.5g} rpm"
        if f"{lowest:.4g}" != f"{highest:.4g}":
            speeds += f", {lowest:.5g} to {highest:.5g} rpm"
        return (
            f"{self.gear_set}, {Path(self.study.measured).name}: "
            f"{pluralize(one.average.turns, 'turn')} of {one.gear.name} at {speeds}, "
            f"{self.rotation_source}"
        )

    def page(self) -> Page:
        one = self.gear_averages
        yield self._title
        yield (
            f"{self.duration:.6g} s at {self.sampling_rate:.6g} Hz; the rotation is "
            "taken to start as that of computed signals, otherwise teeth are shifted"
        )
        yield from self.notes
        if self.pulse_scatter is not None:
            line = f"pulses: intervals scatter by {self.pulse_scatter:.2g} of those"
            yield with_code("E33", f"{line} on both sides")
        yield averages_table(one.entries, "measured: averages over a turn")
        yield indicators_table(one.entries, "measured: indicators of damage")
        if self.sensor is not None:
            yield sensor_sentence(self.summary)
        for name, entries in self._separated_entries.items():
            yield separated_table(entries, name)
            if gears := differing_gears(entries):
                yield naming_sentence(gears, name)
        if others := [other.gear.name for other in self.averages if other is not one]:
            yield f"averages over turns of {', '.join(others)} are in the tables"
        yield from self._computed_page()

    def _computed_page(self) -> Iterator[Any]:
        computed = self.computed
        if computed is None:
            return
        yield from (part for part in computed.page() if isinstance(part, str))
        entries = computed.averages.entries
        yield averages_table(entries, "computed: averages over a turn")
        yield indicators_table(entries, "computed: indicators of damage")
