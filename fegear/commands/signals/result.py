"""Signals of sensors with their averages and spectra, as tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.codes import with_code
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from fegear.studies.columns import unit_of_column
from fegear.studies.page import Columns, Page, RowTable, number, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table, finite_or_none
from fegear.studies.trains.shown_signals import SCALES, SHOWN_SIGNALS, signal_label
from fegear.studies.trains.train_problem import TrainFacts
from lumped.common.array_types import Array
from lumped.common.csv_text import format_exact
from lumped.figures.order_maps import OrderCurves, draw_order_maps
from lumped.figures.turn_averages import AverageCurves, draw_turn_averages
from lumped.signals.averages import TurnAverage
from lumped.signals.faulty_tooth import Engagement
from lumped.signals.orders import OrderMap
from lumped.signals.sampling import TurningGear, residual_indicators
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
    tooth : (p,) of the gear at the pitch point of its first mesh, from 1
    engagement : contact of the gear's teeth in its first mesh
    turns_of_motion : of the gear, after which the motion repeats
    teeth_differ : whether some tooth of the gear set differs from others
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
    tooth: NDArray[np.int64]
    engagement: Engagement
    turns_of_motion: int
    teeth_differ: bool

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
            "signals": [self._signal_entry(c) for c in range(len(self.names))],
            "warnings": [*self.facts.warnings, *self._disagreement()],
        }

    def _disagreement(self) -> Iterator[str]:
        """A warning where signals of one gear name different teeth.

        None of teeth that are alike where there is no noise: residuals are numerical.
        """
        if not (self.teeth_differ or self.study.noise_percent):
            return
        teeth = {
            name: int(tooth)
            for name, tooth in zip(self.names, self._indicators["tooth"], strict=True)
            if np.isfinite(tooth)
        }
        if len(set(teeth.values())) > 1:
            named = ", ".join(f"{_scaled_label(name)} {n}" for name, n in teeth.items())
            yield with_code(
                "W65",
                f"signals do not name one tooth of {self.gear.name}: {named}",
            )

    def _driver_rpm(self, mesh_frequency: Any) -> Any:
        """Speed of the gear [rpm] at a frequency of the first mesh [Hz]."""
        return SECONDS_PER_MINUTE * self.gear.turn_frequency(mesh_frequency)

    @property
    def _window_turns(self) -> int:
        return min(int(self.study.window), self.average.turns)

    @cached_property
    def _indicators(self) -> Mapping[str, Array]:
        return residual_indicators(self.average, self.names, self.engagement)

    def _signal_entry(self, c: int) -> dict[str, Any]:
        """What the average of a signal tells, in the unit at the end of its name."""
        average, has_residual = self.average, bool(self.average.has_residual[c])
        amplitude = average.amplitude[:, c]
        orders = np.arange(amplitude.size)
        of_mesh = np.any([orders % order == 0 for order in average.orders], axis=0)
        sidebands = np.where(of_mesh, 0.0, amplitude)
        indicators = {name: float(v[c]) for name, v in self._indicators.items()}
        return {
            "signal": self.names[c],
            "unit": unit_of_column(self.names[c]),
            "mesh_amplitude": float(amplitude[1:][of_mesh[1:]].max()),
            "sideband_amplitude": float(sidebands.max()),
            "sideband_order": int(sidebands.argmax()) if has_residual else None,
            "residual_rms": indicators["residual_rms"],
            "residual_peak": indicators["residual_peak"],
            "residual_kurtosis": finite_or_none(indicators["residual_kurtosis"]),
            "residual_peak_angle_deg": finite_or_none(
                360.0 * float(average.peak_turn[c])
            ),
            "residual_tooth_rms": indicators["tooth_rms"],
            "tooth": int(indicators["tooth"]) if has_residual else None,
        }

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
        return Table.of(columns | self._columns(self.values), self._header)

    def _columns(self, values: Array, prefix: str = "") -> dict[str, Array]:
        return {f"{prefix}{name}": values[:, c] for c, name in enumerate(self.names)}

    @property
    def more_tables(self) -> dict[str, Table]:
        """A row for every angle of the average, every order, and every order of
        every window."""
        average, teeth = self.average, self.gear.teeth
        points, order = len(average.values), np.arange(len(average.amplitude))
        harmonic = np.floor(order / teeth + 0.5).astype(int)
        over_turn = {
            "angle_deg": 360.0 * np.arange(points) / points,
            "tooth": self.tooth,
            **self._columns(average.values),
            **self._columns(average.residual, "residual_"),
        }
        over_order: dict[str, Any] = {"order": order}
        if not self.study.is_ramp:
            frequency = self.gear.turn_frequency(self.ramp.start)
            over_order["frequency_Hz"] = order * frequency
        over_order |= {
            "mesh_harmonic": harmonic,
            "sideband": order - harmonic * teeth,
            **self._columns(average.amplitude),
        }
        return {
            "average": Table.of(over_turn, self._header),
            "spectrum": Table.of(over_order, self._header),
            "orders": self._orders_table,
        }

    @property
    def _orders_table(self) -> Table:
        """A row for every order of every window."""
        orders = self.orders
        windows, size, signals = orders.amplitude.shape
        columns = {
            "turns_of_gear": np.repeat(orders.turns, size),
            "gear_speed_rpm": np.repeat(self._window_rpm, size),
            "order": np.tile(orders.order, windows),
            **self._columns(orders.amplitude.reshape(-1, signals)),
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
        return pictures

    def _draw_order_map(self) -> Any:
        """Spectra of the first signals over orders and speed."""
        maps = []
        for c, name in list(enumerate(self.names))[:SHOWN_SIGNALS]:
            scale, unit = SCALES[unit_of_column(name)]
            amplitude = scale * self.orders.amplitude[:, :, c]
            maps.append(OrderCurves(f"{_scaled_label(name)} [{unit}]", amplitude))
        axes = self.orders.order, self._window_rpm
        ylabel = f"speed of {self.gear.name} [rpm]"
        return draw_order_maps(maps, axes, self.gear.teeth, (self._title, ylabel))

    def _draw_averages(self) -> Any:
        curves = [
            self._curves_of_signal(c) for c in range(len(self.names))[:SHOWN_SIGNALS]
        ]
        noise = self.study.noise_percent
        title = f"{self._title}{f', {noise:g} % noise' if noise else ''}"
        angle = np.arange(len(self.tooth)) / len(self.tooth)
        start = 1.0 + self.gear.phase % self.gear.teeth
        tooth = start + self.gear.teeth * angle
        return draw_turn_averages(curves, tooth, self.gear.orders, title)

    def _curves_of_signal(self, c: int) -> AverageCurves:
        average, name = self.average, self.names[c]
        scale, unit = SCALES[unit_of_column(name)]
        values = scale * average.values[:, c]
        return AverageCurves(
            name=f"{_scaled_label(name)}\n[{unit}]",
            average=values - values.mean(),
            residual=scale * average.residual[:, c],
            amplitude=scale * average.amplitude[:, c],
            has_residual=bool(average.has_residual[c]),
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

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield self._title
        yield RowTable(values["signals"], SIGNAL_COLUMNS, "averages over a turn")
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


def _scaled_label(name: str) -> str:
    return signal_label(name.replace("_speed", ": speed"))


def _scaled_cell(name: str) -> Callable[[Any], str]:
    """The cell of a value in the unit that is shown."""
    return lambda row: number(SCALES[row["unit"]][0] * row[name], 3)


def _tooth_text(row: Any) -> str:
    return "none" if row["tooth"] is None else str(row["tooth"])


def _kurtosis_text(row: Any) -> str:
    kurtosis = row["residual_kurtosis"]
    return "none" if kurtosis is None else number(kurtosis, 3)


SIGNAL_COLUMNS: Columns = {
    "signal": lambda row: _scaled_label(row["signal"]),
    "unit": lambda row: SCALES[row["unit"]][1],
    "at orders\nof meshes": _scaled_cell("mesh_amplitude"),
    "largest\nsideband": _scaled_cell("sideband_amplitude"),
    "largest RMS\nof a tooth": _scaled_cell("residual_tooth_rms"),
    "at tooth": _tooth_text,
    "kurtosis of\nresidual": _kurtosis_text,
}
