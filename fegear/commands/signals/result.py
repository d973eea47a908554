"""Signals of sensors with their averages and spectra, as tables and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.commands.signals.entries import (
    GearAverages,
    averages_table,
    indicators_table,
    label_with_unit,
    scale_of,
)
from fegear.commands.signals.separated import (
    SeparatedGear,
    differing_gears,
    draw_separated,
    naming_sentence,
    sensor_sentence,
    separated_rows,
    separated_table,
)
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from fegear.studies.page import Page, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.train_problem import TrainFacts
from lumped.common.array_types import Array
from lumped.common.csv_text import format_exact
from lumped.figures.order_maps import OrderCurves, draw_order_maps
from lumped.figures.turn_averages import draw_turn_averages
from lumped.signals.averages import TurnAverage
from lumped.signals.orders import OrderMap
from lumped.signals.ring_sensor import FORCE, RingSensor
from lumped.signals.sampling import SignalEngagements, TurningGear
from lumped.signals.tooth_verdict import NOT_NAMED, NamedTooth
from lumped.steady.ramps import SpeedRamp


@dataclass(frozen=True, eq=False)
class SignalsResult(StudyResult):
    """Signals at equal steps of time, and their averages over turns of a gear.

    torque : on the input gear [N m]
    gear : over whose turns signals are averaged
    ramp : speed over time, constant or not
    time : (t,) [s]
    names : of the c signals, with their units
    values : (t, c) samples
    average : over the turns
    orders : spectra over windows of turns
    na4 : (c,) indicator of the last window of turns
    tooth : (p,) of the gear at the pitch point of its first mesh, from 1
    engagements : contact of the gear's teeth by signals, see `GearAverages`
    turns_of_motion : of the gear, after which the motion repeats
    teeth_differ : whether some tooth of the gear set differs from others
    sensor : on the ring of a planetary set, None of others
    separated : averages of it over the teeth of the sun and of each planet
    verdict : faulty tooth of the gear by all signals, if one can be named
    """

    study: Any
    facts: TrainFacts
    torque: float
    gear: TurningGear
    ramp: SpeedRamp
    time: Array
    names: tuple[str, ...]
    values: Array
    average: TurnAverage
    orders: OrderMap
    na4: Array
    tooth: NDArray[np.int64]
    engagements: SignalEngagements
    turns_of_motion: int
    teeth_differ: bool
    sensor: RingSensor | None = None
    separated: tuple[SeparatedGear, ...] = ()
    verdict: NamedTooth = NOT_NAMED

    @cached_property
    def averages(self) -> GearAverages:
        """Averages over the turns of the gear, with their indicators."""
        return GearAverages(
            gear=self.gear,
            names=self.names,
            average=self.average,
            na4=self.na4,
            tooth=self.tooth,
            engagements=self.engagements,
        )

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, ramp = self.study, self.ramp
        speeds = [float(self._driver_rpm(end)) for end in (ramp.start, ramp.end)]
        return {
            **self.facts.summary,
            "torque_Nm": self.torque,
            "speed_Hz": ramp.start,
            "end_speed_Hz": ramp.end if study.is_ramp else None,
            "gear": self.gear.name,
            "gear_speed_rpm": speeds[0],
            "end_gear_speed_rpm": speeds[1] if study.is_ramp else None,
            "duration_s": ramp.duration,
            "turns": self.average.turns,
            "motion_repeats_turns": self.turns_of_motion,
            "sampling_rate_Hz": (
                max(speeds) / SECONDS_PER_MINUTE * self.gear.teeth * study.samples
            ),
            "noise_percent": study.noise_percent,
            "pulses_per_turn": study.pulses,
            "window_turns": self._window_turns,
            "mesh_orders": list(self.gear.orders),
            "named_tooth": self.verdict.tooth if self._may_differ else None,
            "signals": self.averages.entries,
            **self._sensor_entries,
            "warnings": [*self.facts.warnings, *self._disagreement()],
        }

    @property
    def _sensor_entries(self) -> dict[str, Any]:
        """Entries on the sensor of a planetary set, none of others."""
        if self.sensor is None:
            return {}
        named = self._differing_gears if len(self._differing_gears) == 1 else []
        return {
            "sensor_deg": math.degrees(self.sensor.direction),
            "sensor_window_deg": math.degrees(self.sensor.width),
            "separated": [gear.entry for gear in self.separated],
            "differing_gear": named[0]["gear"] if named else None,
            "differing_tooth": named[0]["tooth"] if named else None,
        }

    @cached_property
    def _differing_gears(self) -> list[Mapping[str, Any]]:
        """Entries of gears that may differ; none of teeth that are alike."""
        if not (self.teeth_differ or self.study.noise_percent):
            return []
        return differing_gears([gear.entry for gear in self.separated])

    def _disagreement(self) -> Iterator[str]:
        """A warning where signals of one gear name different teeth.

        None of teeth that are alike where there is no noise: residuals are numerical.
        """
        if self._may_differ:
            yield from self.averages.disagreement()

    @property
    def _may_differ(self) -> bool:
        """Whether residuals are more than numerical."""
        return bool(self.teeth_differ or self.study.noise_percent)

    def _driver_rpm(self, mesh_frequency: Any) -> Any:
        """Speed of the gear [rpm] at a frequency of the first mesh [Hz]."""
        return SECONDS_PER_MINUTE * self.gear.turn_frequency(mesh_frequency)

    @property
    def _window_turns(self) -> int:
        return min(int(self.study.window), self.average.turns)

    @property
    def _header(self) -> dict[str, str]:
        study = self.study
        return {
            **self.facts.header,
            "gear": self.gear.name,
            "turns": str(self.average.turns),
            "noise [%]": f"{study.noise_percent:g}, seed {study.seed}",
            **self._ramp_entries,
        }

    @property
    def _ramp_entries(self) -> dict[str, str]:
        """Entries of files on a ramp and on pulses, where there are some."""
        entries, study, ramp = dict[str, str](), self.study, self.ramp
        if study.is_ramp:
            ends = f"{format_exact(ramp.start)} to {format_exact(ramp.end)} Hz"
            entries["ramp"] = f"{ends} in {format_exact(ramp.duration)} s"
        if study.pulses:
            entries["angle"] = f"by {study.pulses} pulses per turn"
        return entries

    @property
    def table(self) -> Table:
        """A row for every sample."""
        ramp = self.ramp
        turns = self.gear.turns(ramp.cycles_at(self.time))
        columns = {
            "time_s": self.time,
            "turns_of_gear": turns,
            "gear_speed_rpm": self._driver_rpm(ramp.frequency_at(self.time)),
        }
        return Table.of(columns | self.averages.columns(self.values), self._header)

    @property
    def more_tables(self) -> dict[str, Table]:
        """A row for every angle of the average, every order, and every order of
        every window."""
        averages = self.averages
        order = np.arange(len(self.average.amplitude))
        over_order: dict[str, Any] = {"order": order}
        if not self.study.is_ramp:
            frequency = self.gear.turn_frequency(self.ramp.start)
            over_order["frequency_Hz"] = order * frequency
        over_order |= averages.over_orders
        tables = {
            "average": Table.of(averages.over_turn, self._header),
            "spectrum": Table.of(over_order, self._header),
            "orders": self._orders_table,
        }
        if self.sensor is not None:
            rows = separated_rows({FORCE: self.separated})
            tables["separated"] = Table.of(rows, self._header)
        return tables

    @property
    def _orders_table(self) -> Table:
        """A row for every order of every window."""
        orders = self.orders
        windows, size, signals = orders.amplitude.shape
        columns = {
            "turns_of_gear": np.repeat(orders.turns, size),
            "gear_speed_rpm": np.repeat(self._window_rpm, size),
            "order": np.tile(orders.order, windows),
            **self.averages.columns(orders.amplitude.reshape(-1, signals)),
        }
        return Table.of(columns, self._header)

    @property
    def _window_rpm(self) -> Array:
        """Speed of the gear (w,) in the middle of every window [rpm]."""
        cycles = self.orders.turns / self.gear.turns(1.0)
        time = self.ramp.time_at(cycles)
        return np.asarray(self._driver_rpm(self.ramp.frequency_at(time)))

    @property
    def figures(self) -> dict[str, Draw]:
        """Average, residual and spectrum of the first signals, and order maps."""
        pictures = {"plot": self._draw_averages}
        if self.study.is_ramp:
            pictures["order_map"] = self._draw_order_map
        if self.sensor is not None:
            pictures["separated_plot"] = self._draw_separated
        return pictures

    def _draw_separated(self) -> Any:
        """Averages of the sensor on the ring over the teeth of each gear."""
        title = f"{label_with_unit(FORCE)}, by teeth that pass it"
        return draw_separated(self.separated, FORCE, f"{self._title}\n{title}")

    def _draw_order_map(self) -> Any:
        """Spectra of the first signals over orders and speed."""
        maps = []
        for c in self.averages.shown:
            name = self.names[c]
            amplitude = scale_of(name)[0] * self.orders.amplitude[:, :, c]
            maps.append(OrderCurves(label_with_unit(name), amplitude))
        axes = self.orders.order, self._window_rpm
        ylabel = f"speed of {self.gear.name} [rpm]"
        return draw_order_maps(maps, axes, self.gear.teeth, (self._title, ylabel))

    def _draw_averages(self) -> Any:
        averages, noise = self.averages, self.study.noise_percent
        title = f"{self._title}{f', {noise:g} % noise' if noise else ''}"
        return draw_turn_averages(
            averages.curves(averages.shown),
            averages.tooth_axis,
            self.gear.orders,
            title,
        )

    @property
    def _title(self) -> str:
        values = self.summary
        speed, rpm = f"at {values['speed_Hz']:g} Hz", f"{values['gear_speed_rpm']:.5g}"
        if self.study.is_ramp:
            speed = f"from {values['speed_Hz']:g} to {values['end_speed_Hz']:g} Hz"
            speed = f"{speed} in {self.ramp.duration:g} s"
            rpm = f"{rpm} to {values['end_gear_speed_rpm']:.5g}"
        return (
            f"{values['gear_set']} {speed} and "
            f"{self.torque:g} N m, model {values['model']}, {values['excitation']}: "
            f"{self.average.turns} turns of {self.gear.name} at {rpm} rpm"
        )

    def _sensor_lines(self, values: Mapping[str, Any]) -> Page:
        """Lines on a planetary set: its turns, and teeth that pass the sensor."""
        yield sensor_sentence(values)
        yield separated_table(values["separated"], FORCE)
        if self._differing_gears:
            yield naming_sentence(self._differing_gears, FORCE)

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield self._title
        yield averages_table(values["signals"])
        yield indicators_table(values["signals"])
        if self.sensor is not None:
            yield from self._sensor_lines(values)
        if self._may_differ and not self.study.is_ramp:
            tooth, doubt = self.verdict
            name = "not sure" if tooth is None else str(tooth)
            verdict = ", ".join(filter(None, (name, doubt)))
            toothed = self.study.gear_set.loaded.gears[self.gear.index].name
            yield f"faulty tooth of {toothed} by all signals: {verdict}"
        if self.study.is_ramp:
            yield (
                "a torque in addition to the loads takes up the inertial forces of "
                "the mean acceleration; order tracking by "
                + (
                    f"{pluralize(self.study.pulses, 'pulse')} per turn"
                    if self.study.pulses
                    else "the nominal angle"
                )
            )
        elif self.average.turns % self.turns_of_motion:
            yield (
                f"the motion repeats after {self.turns_of_motion} turns; averages over "
                "other numbers of turns, but their multiples, contain a part of other "
                "meshes and gears"
            )
