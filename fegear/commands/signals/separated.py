"""Averages of the ring's sensor over the teeth of the sun and of each planet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.commands.signals.entries import label_with_unit, scale_of, scaled_label
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.studies.page import Columns, RowTable, cell
from fegear.studies.table import finite_or_none
from fegear.studies.trains.turning_gears import (
    engagement_of,
    tooth_at_pitch_point,
    turning_gear,
)
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.figures.turn_averages import AverageCurves, draw_averages_of_gears
from lumped.signals.averages import TurnAverage
from lumped.signals.faulty_tooth import Engagement
from lumped.signals.indicators import difference_indicators
from lumped.signals.planet_separation import (
    PassingGear,
    SeparatedAverage,
    planet_gear,
    separated_average,
    sun_gear,
    with_equal_loads,
)
from lumped.signals.ring_sensor import RingSensor
from lumped.signals.shared_teeth import tooth_of_meshes
from lumped.train.train import Train

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A tooth of one of N planets changes its force by N - 1 times as much as that of each
# other, one of the sun has its turn with all planets alike. Where teeth of the sun come
# to the sensor with the same planets, both leave open which it is.
MIN_PLANETS, MIN_PLANET_RATIO, MAX_SUN_RATIO = 3, 1.5, 0.6
MIN_KURTOSIS = 5.0  # of a residual in which one tooth stands out; noise has 3 to 4


@dataclass(frozen=True, eq=False)
class SeparatedGear:
    """Average of the sensor over the teeth of a gear, where windows cover its turn.

    name, teeth : of the gear
    turns_needed : of the carrier against the ring, after which the same teeth pass
    separated : its average, None where windows do not cover a turn
    tooth : (p,) of the gear at the pitch point, from 1
    engagements : contact of its teeth in the meshes whose forces the sensor feels
    """

    name: str
    teeth: int
    turns_needed: int
    separated: SeparatedAverage | None
    tooth: NDArray[np.int64]
    engagements: tuple[Engagement, ...]

    @cached_property
    def average(self) -> TurnAverage | None:
        """The average as one over turns, None where there is none."""
        if self.separated is None:
            return None
        values, windows = self.separated.values[:, None], self.separated.windows
        return TurnAverage(values, windows, (self.teeth,))

    @property
    def tooth_axis(self) -> Array:
        """Teeth (p,) that rise over a turn, whole at the pitch point."""
        part = np.arange(self.tooth.size) / self.tooth.size
        return 1.0 + self.engagements[0].first % self.teeth + self.teeth * part

    def curves(self, scale: float, unit: str) -> AverageCurves:
        """Curves of the average, where there is one, in a unit."""
        average = require_present(self.average, "average")
        values = scale * average.values[:, 0]
        return AverageCurves(
            name=f"{self.name}\n[{unit}]",
            average=values - values.mean(),
            residual=scale * average.residual[:, 0],
            amplitude=scale * average.amplitude[:, 0],
            has_residual=bool(average.has_residual[0]),
        )

    @cached_property
    def entry(self) -> dict[str, Any]:
        """Indicators of the average, all None without one."""
        names = "residual_rms", "residual_peak", "residual_kurtosis", "fm4", "tooth"
        values: dict[str, Any] = dict.fromkeys(names)
        average, separated = self.average, self.separated
        if average is not None:
            residual = average.residual[:, 0]
            tooth, _ = tooth_of_meshes(residual, self.engagements)
            indicators = difference_indicators(average)
            values = {
                "residual_rms": float(np.sqrt((residual**2).mean())),
                "residual_peak": float(average.peak[0]),
                "residual_kurtosis": finite_or_none(float(average.kurtosis[0])),
                "fm4": finite_or_none(float(indicators["fm4"][0])),
                "tooth": tooth if average.has_residual[0] else None,
            }
        return {
            "gear": self.name,
            "carrier_turns_needed": self.turns_needed,
            "windows": None if separated is None else separated.windows,
            "window_teeth": None if separated is None else separated.window_teeth,
            **values,
        }


def separated_gears(
    gears: GearSet, train: Train, sensor: RingSensor, signal: Array, samples: int
) -> Iterator[SeparatedGear]:
    """The sun and all planets, averaged over their teeth.

    gears : a planetary set; train : of it
    sensor : on the ring; signal : (k,) of it at equal angles from the start
    samples : in a mesh cycle
    """
    is_long_enough = len(signal) >= samples * sensor.passes.teeth
    if is_long_enough:
        signal = with_equal_loads(signal, samples, sensor)
    teeth = [gear.geometry.teeth for gear in gears.gears]
    carrier = require_present(gears.carrier, "carrier")
    sun = carrier.sun
    members: dict[int, PassingGear] = {
        sun: sun_gear(sensor, teeth[sun], train.sense(sun)),
        **{p: planet_gear(n, teeth[p]) for n, p in enumerate(carrier.planets)},
    }
    for index, member in members.items():
        turning = turning_gear(gears, train, index)
        # the turn of the sun is counted at the first planet
        meshes = gears.meshes_of[index][: 1 if index == sun else None]
        yield SeparatedGear(
            name=turning.name,
            teeth=teeth[index],
            turns_needed=member.turns_needed(sensor.passes.teeth),
            separated=(
                separated_average(signal, samples, sensor, member)
                if is_long_enough
                else None
            ),
            tooth=tooth_at_pitch_point(gears, turning, samples * teeth[index]),
            engagements=tuple(engagement_of(gears, turning, mesh) for mesh in meshes),
        )


def separated_rows(signals: Mapping[str, Sequence[SeparatedGear]]) -> dict[str, Any]:
    """Columns of the averages, a row for every angle of every gear.

    signals : averages of the same gears, by names of the signals
    """
    gears = [gear for gear in next(iter(signals.values())) if gear.average is not None]
    columns: dict[str, list[NDArray[Any]]] = {
        "gear": [np.full(gear.tooth.size, gear.name) for gear in gears],
        "angle_deg": [_angles(gear.tooth.size) for gear in gears],
        "tooth": [gear.tooth for gear in gears],
    }
    for name, separated in signals.items():
        averages = [gear.average for gear in separated if gear.average is not None]
        columns[name] = [average.values[:, 0] for average in averages]
        columns[f"residual_{name}"] = [one.residual[:, 0] for one in averages]
    return {
        name: np.concatenate(arrays) if arrays else np.empty(0)
        for name, arrays in columns.items()
    }


def _angles(points: int) -> Array:
    return np.asarray(360.0 * np.arange(points) / points)


def draw_separated(separated: Sequence[SeparatedGear], name: str, title: str) -> Figure:
    """Plot the averages of a signal, by its name, over the teeth of each gear."""
    gears = [gear for gear in separated if gear.average is not None]
    if not gears:
        raise InputError(
            f"{scaled_label(name)}: windows do not cover a turn of any gear, "
            "more turns are needed"
        )
    scale, unit = scale_of(name)
    curves = [gear.curves(scale, unit) for gear in gears]
    return draw_averages_of_gears(curves, [gear.tooth_axis for gear in gears], title)


def sensor_sentence(summary: Mapping[str, Any]) -> str:
    """What turns of a planetary set are, and what its sensor feels."""
    return (
        "turns of gears are against the carrier, those of the carrier against the ring;"
        f" the sensor at {summary['sensor_deg']:g} deg of the ring feels each planet in"
        f" a window of {summary['sensor_window_deg']:.4g} deg"
    )


def separated_table(entries: Sequence[Mapping[str, Any]], name: str) -> RowTable:
    """Indicators of the averages by teeth of a signal, by its name."""
    title = f"{label_with_unit(name)}, by teeth that pass the sensor"
    return RowTable(entries, SEPARATED_COLUMNS, title)


def naming_sentence(gears: Sequence[Mapping[str, Any]], name: str) -> str:
    """Which gear differs by a signal, or between which it is not sure.

    gears : their entries, see `differing_gears`
    """
    teeth = [f"{entry['gear']} at tooth {entry['tooth']}" for entry in gears]
    if len(teeth) == 1:
        return f"{scaled_label(name)}: {teeth[0]} differs most"
    return f"{scaled_label(name)}: not sure whether {' or '.join(teeth)} differs"


def differing_gears(entries: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Entries of the gear that differs most; of two where averages leave them open.

    entries : of the sun, then of each planet
    """
    sun, *planets = entries
    if len(planets) < MIN_PLANETS or any(e["tooth"] is None for e in entries):
        return []
    *_, second, first = sorted(planets, key=lambda entry: entry["residual_rms"])
    named = [sun, first]
    if first["residual_rms"] < MIN_PLANET_RATIO * second["residual_rms"]:
        named = [sun]
    elif sun["residual_rms"] < MAX_SUN_RATIO * first["residual_rms"]:
        named = [first]
    is_sharp = all(entry["residual_kurtosis"] > MIN_KURTOSIS for entry in named)
    return named if is_sharp else []


SEPARATED_COLUMNS: Columns = {
    "gear": lambda row: row["gear"],
    "turns of carrier\nneeded": lambda row: str(row["carrier_turns_needed"]),
    "windows": lambda row: str(row["windows"] or "too few"),
    "RMS of\nresidual": cell("residual_rms", 3, none="none"),
    "largest": cell("residual_peak", 3, none="none"),
    "kurtosis of\nresidual": cell("residual_kurtosis", 3, none="none"),
    "FM4": cell("fm4", 3, none="none"),
}
