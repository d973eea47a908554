"""Averages of signals by their indicators, as summaries and screens have them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.codes import with_code
from fegear.studies.columns import unit_of_column
from fegear.studies.page import Columns, RowTable, cell, number
from fegear.studies.table import finite_or_none
from fegear.studies.trains.shown_signals import SCALES, SHOWN_SIGNALS, signal_label
from lumped.common.array_types import Array
from lumped.figures.turn_averages import AverageCurves
from lumped.signals.averages import TurnAverage
from lumped.signals.indicators import difference_indicators
from lumped.signals.ring_sensor import FORCE
from lumped.signals.sampling import SignalEngagements, TurningGear, residual_indicators

MAX_HARMONIC = 8.5  # of the gear's mesh, in order maps
# that are no signals, and that a channel of a recording may be named like
TABLE_COLUMNS = {
    *("gear", "angle_deg", "tooth", "order", "mesh_harmonic", "sideband"),
    *("frequency_Hz", "turns_of_gear", "gear_speed_rpm"),
}
DIFFERENCE_INDICATORS = ("fm4", "m6a", "na4", "energy_ratio")


@dataclass(frozen=True, eq=False)
class GearAverages:
    """Averages of signals over the turns of a gear.

    names : of the c signals, with their units
    average : over the turns
    na4 : (c,) of the last window of turns
    tooth : (p,) of the gear at the pitch point of its first mesh, from 1
    engagements : contact of the gear's teeth by signals that tell of one tooth
    """

    gear: TurningGear
    names: tuple[str, ...]
    average: TurnAverage
    na4: Array
    tooth: NDArray[np.int64]
    engagements: SignalEngagements

    @cached_property
    def indicators(self) -> Mapping[str, Array]:
        """Indicators (c,) of the averages by name."""
        return {
            **residual_indicators(self.average, self.names, self.engagements),
            **difference_indicators(self.average),
            "na4": self.na4,
        }

    @cached_property
    def entries(self) -> list[dict[str, Any]]:
        """What the average of each signal tells, in the unit of the signal."""
        return [self._entry(c) for c in range(len(self.names))]

    def _entry(self, c: int) -> dict[str, Any]:
        average, has_residual = self.average, bool(self.average.has_residual[c])
        amplitude = average.amplitude[:, c]
        orders = np.arange(amplitude.size)
        of_mesh = np.any([orders % order == 0 for order in average.orders], axis=0)
        sidebands = np.where(of_mesh, 0.0, amplitude)
        indicators = {name: float(v[c]) for name, v in self.indicators.items()}
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
            "residual_tooth_rms": finite_or_none(indicators["tooth_rms"]),
            "tooth": None if math.isnan(tooth := indicators["tooth"]) else int(tooth),
            **{n: finite_or_none(indicators[n]) for n in DIFFERENCE_INDICATORS},
        }

    def disagreement(self) -> Iterator[str]:
        """A warning where signals name different teeth."""
        teeth = {
            e["signal"]: e["tooth"] for e in self.entries if e["tooth"] is not None
        }
        if len(set(teeth.values())) > 1:
            named = ", ".join(f"{scaled_label(name)} {n}" for name, n in teeth.items())
            yield with_code(
                "W65", f"signals do not name one tooth of {self.gear.name}: {named}"
            )

    def columns(self, values: Array, prefix: str = "") -> dict[str, Array]:
        """Columns of a table (n, c) by the names of the signals.

        A channel that is named like another column has `channel_` before its name.
        """
        return {
            f"{prefix}{f'channel_{name}' if name in TABLE_COLUMNS else name}": column
            for name, column in zip(self.names, values.T, strict=True)
        }

    @property
    def over_turn(self) -> dict[str, Any]:
        """Columns of the averages, a row for every angle."""
        points = len(self.average.values)
        return {
            "angle_deg": 360.0 * np.arange(points) / points,
            "tooth": self.tooth,
            **self.columns(self.average.values),
            **self.columns(self.average.residual, "residual_"),
        }

    @property
    def over_orders(self) -> dict[str, Any]:
        """Columns of the spectra, a row for every order."""
        order, teeth = np.arange(len(self.average.amplitude)), self.gear.teeth
        harmonic = np.floor(order / teeth + 0.5).astype(int)
        return {
            "mesh_harmonic": harmonic,
            "sideband": order - harmonic * teeth,
            **self.columns(self.average.amplitude),
        }

    @property
    def tooth_axis(self) -> Array:
        """Teeth (p,) that rise over a turn, whole at the pitch point."""
        part = np.arange(len(self.tooth)) / len(self.tooth)
        return 1.0 + self.gear.phase % self.gear.teeth + self.gear.teeth * part

    def curves(self, signals: Iterable[int]) -> list[AverageCurves]:
        """Curves of signals, by their indices."""
        return [self._curves_of_signal(c) for c in signals]

    @property
    def shown(self) -> tuple[int, ...]:
        """Indices of the signals in a picture.

        The first ones; of a planetary set those that tell most of the gear, at last the
        sensor on the ring.
        """
        indices = range(len(self.names))
        if FORCE not in self.names:
            return tuple(indices[:SHOWN_SIGNALS])
        related = [
            *list(self.engagements)[:2],
            *(name for name in self.names if name.startswith(f"{self.gear.name}_")),
            *self.names,
        ]
        chosen = [name for name in dict.fromkeys(related) if name != FORCE]
        chosen = [*chosen[: SHOWN_SIGNALS - 1], FORCE]
        return tuple(sorted(self.names.index(name) for name in chosen))

    def _curves_of_signal(self, c: int) -> AverageCurves:
        average, name = self.average, self.names[c]
        scale, _ = scale_of(name)
        values = scale * average.values[:, c]
        return AverageCurves(
            name=label_with_unit(name, "\n"),
            average=values - values.mean(),
            residual=scale * average.residual[:, c],
            amplitude=scale * average.amplitude[:, c],
            has_residual=bool(average.has_residual[c]),
        )


def scale_of(name: str) -> tuple[float, str]:
    """Factor and unit in which a signal is shown, by the end of its name."""
    unit = unit_of_column(name)
    return SCALES.get(unit, (1.0, unit))


def scaled_label(name: str) -> str:
    """Name of a signal without its unit, in words."""
    return signal_label(name.replace("_speed", ": speed"))


def label_with_unit(name: str, separator: str = " ") -> str:
    """Name of a signal in words, and the unit in which it is shown."""
    unit = scale_of(name)[1] or "unit of the channel"
    return f"{scaled_label(name)}{separator}[{unit}]"


def averages_table(
    entries: Sequence[Mapping[str, Any]], title: str = "averages over a turn"
) -> RowTable:
    """Lines of the averages of each signal."""
    return RowTable(entries, SIGNAL_COLUMNS, title)


def indicators_table(
    entries: Sequence[Mapping[str, Any]], title: str = "indicators of damage"
) -> RowTable:
    """Indicators of the averages of each signal."""
    return RowTable(entries, INDICATOR_COLUMNS, title)


def _scaled_cell(name: str) -> Callable[[Any], str]:
    """The cell of a value in the unit that is shown."""
    return lambda row: (
        "none"
        if row[name] is None
        else number(scale_of(row["signal"])[0] * row[name], 3)
    )


def _tooth_text(row: Any) -> str:
    return "none" if row["tooth"] is None else str(row["tooth"])


SIGNAL_COLUMNS: Columns = {
    "signal": lambda row: scaled_label(row["signal"]),
    "unit": lambda row: scale_of(row["signal"])[1],
    "at orders\nof meshes": _scaled_cell("mesh_amplitude"),
    "largest\nsideband": _scaled_cell("sideband_amplitude"),
    "largest RMS\nof a tooth": _scaled_cell("residual_tooth_rms"),
    "at tooth": _tooth_text,
}
INDICATOR_COLUMNS: Columns = {
    "signal": lambda row: scaled_label(row["signal"]),
    "kurtosis of\nresidual": cell("residual_kurtosis", 3, none="none"),
    "FM4": cell("fm4", 3, none="none"),
    "M6A": cell("m6a", 3, none="none"),
    "NA4": cell("na4", 3, none="none"),
    "energy\nratio": cell("energy_ratio", 3, none="none"),
}
