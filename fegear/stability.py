"""Stability of a gear set whose teeth rub: where over speed and a figure it shakes."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.errors import InputError
from fegear.headings import (
    BENDING,
    friction_in_words,
    friction_of,
    heading,
    title_of,
)
from fegear.output import write_text
from fegear.parameter_maps import FRICTION, TORQUE, VariedSet
from fegear.result import Result
from fegear.speeds import MESH_FREQUENCY
from fegear.store import NOTHING, InOrder, Keeping
from lumped.csv_text import exact, format_csv
from lumped.map_figure import axis_label
from lumped.maps import Axis
from lumped.progress import Progress, silent
from lumped.stability.combinations import Combination
from lumped.stability.figure import draw_chart
from lumped.stability.intervals import Column, Interval, examined
from lumped.stability.multipliers import Method
from lumped.stability.periodic import PeriodicSystem, periodic_system
from lumped.workers import run_tasks

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_CELLS = 4_000_000
COLUMNS = "columns"  # in a checkpoint
LEGEND = {
    MESH_FREQUENCY: "of the first mesh",
    "floquet_max": "modulus of the largest Floquet multiplier over the common period "
    "of all meshes; above 1 vibration grows until contact is lost",
    "kind": "modes whose frequencies meet a multiple of the mesh frequency where "
    "vibration grows, numbered by the frequencies of modes that strain a mesh",
}


@dataclass(frozen=True, eq=False, repr=False)
class StabilityResult(Result):
    """Of a gear set over speed and one figure.

    axis : of the figure; columns : one for each of its values that is finished
    natural_Hz : of the modes that strain a mesh, without friction, at the first value
    """

    header: Mapping[str, str]
    axis: Axis
    speeds: tuple[float, ...]
    columns: tuple[Column, ...]
    natural_Hz: tuple[float, ...]

    @property
    def complete(self) -> bool:
        return len(self.columns) == len(self.axis.values)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write a row for each cell of the chart."""
        write_text(path, self.csv())

    def csv(self) -> str:
        """The rows as text."""
        names = MESH_FREQUENCY, self.axis.name, "floquet_max", "kind"
        return format_csv(names, self.rows(), {**self.header, **LEGEND})

    def rows(self) -> Iterator[tuple[float, float, float, str]]:
        for value, column in zip(self.axis.values, self.columns, strict=False):
            kinds = column.kinds(self.speeds)
            for speed, largest, kind in zip(
                self.speeds, column.largest.tolist(), kinds, strict=True
            ):
                yield speed, value, largest, kind

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        unstable = [len(column.intervals) > 0 for column in self.columns]
        return {
            **heading(self.header, self.axis.name),
            "friction_coefficient": None
            if self.axis.name == FRICTION
            else friction_of(self.header),
            "friction_bending_ratio": self.header.get(BENDING),
            "method": self.header["method"],
            "speeds": len(self.speeds),
            "first_speed_Hz": self.speeds[0],
            "last_speed_Hz": self.speeds[-1],
            "values": len(self.axis.values),
            "complete": self.complete,
            "natural_frequencies_Hz": list(self.natural_Hz),
            "values_with_instability": sum(unstable),
            "columns": [
                {
                    "value": value,
                    "largest_multiplier": float(column.largest.max()),
                    "intervals": list(map(_plain, column.intervals)),
                }
                for value, column in zip(self.axis.values, self.columns, strict=False)
            ],
            "warnings": list(self._warnings()),
        }

    def _warnings(self) -> Iterator[str]:
        """What varies and changes nothing, to the bit."""
        first, *others = self.columns
        if others and all((each.largest == first.largest).all() for each in others):
            yield f"{self.axis.name} does not change the multipliers"

    def draw(self) -> Figure:
        limits = self.speeds[0], self.speeds[-1]
        title = title_of(heading(self.header, self.axis.name))
        title += friction_in_words(friction_of(self.header))
        if BENDING in self.header:
            title += f", {BENDING} {self.header[BENDING]}"
        values = self.axis.values[: len(self.columns)]
        return draw_chart(
            values, self.columns, limits, axis_label(self.axis.name), title
        )


def _plain(interval: Interval) -> dict[str, Any]:
    return {
        "kind": interval.kind,
        "from_Hz": interval.low,
        "to_Hz": interval.high,
        "floquet_max": interval.largest,
        "at_Hz": interval.worst,
    }


def find_stability(
    varied: VariedSet,
    speeds: Sequence[float],
    method: Method = "peano-baker",
    keeping: Keeping = NOTHING,
    progress: Progress = silent,
) -> StabilityResult:
    """Floquet multipliers over speed [Hz] and one figure, in contact all the time.

    varied : with the axis of the figure
    keeping : where finished values are kept
    After Ctrl-C the result holds the values that were finished, from the first on.
    Raises InputError for what cannot be used.
    """
    (axis,) = varied.axes
    rising = tuple(sorted(set(speeds)))
    if len(rising) < 2:
        raise InputError("speeds = 1 speed; two or more are needed")
    if len(rising) * len(axis.values) > MOST_CELLS:
        raise InputError(
            f"over = {len(axis.values)} values at {len(rising)} speeds; allowed are "
            f"{MOST_CELLS} cells"
        )
    progress("stiffness", 0, 1)
    first = _system_at(varied, axis.values[0])
    header = _header(varied, method)
    checkpoint = keeping.open(_inputs(varied, rising, header))
    kept = InOrder(checkpoint, COLUMNS, _stored, _read)
    if checkpoint is not None and keeping.resume:
        checkpoint.tell_finished([COLUMNS], len(axis.values), keeping.tell, "value")

    def take(number: int, column: Column) -> None:
        kept.take(number, column)
        progress("values", kept.count, len(axis.values))

    tasks = (
        (number, partial(examined, _system_at(varied, value), rising, method))
        for number, value in enumerate(axis.values)
        if number >= len(kept.done)
    )
    try:
        run_tasks(tasks, take, threading.Event())
    except KeyboardInterrupt:
        if not kept.done:
            raise
    except ArithmeticError as error:
        raise InputError(f"{varied.gear_set.name}: {error}") from None
    finally:
        finished = len(kept.done)
        if checkpoint is not None:
            checkpoint.close(keep=0 < finished < len(axis.values))
    if finished < len(axis.values):
        header["incomplete"] = f"{finished} of {len(axis.values)} values"
    natural = tuple(first.frequency_Hz.tolist())
    return StabilityResult(header, axis, rising, tuple(kept.done), natural)


def _system_at(varied: VariedSet, value: float) -> PeriodicSystem:
    try:
        return periodic_system(varied.system((value,)))
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{varied.gear_set.name}: {error}") from None


def _header(varied: VariedSet, method: Method) -> dict[str, str]:
    header = varied.header("none")
    del header["integration"]
    if TORQUE not in varied.names:
        header["torque_Nm"] = exact(varied.load)
    return header | {"method": method}


def _inputs(
    varied: VariedSet, speeds: Sequence[float], header: Mapping[str, str]
) -> dict[str, str]:
    """All that determines the columns."""
    (axis,) = varied.axes
    return {
        **header,
        **varied.inputs,
        "over": axis.name,
        "values": ", ".join(map(repr, axis.values)),
        "speeds": ", ".join(map(repr, speeds)),
    }


def _stored(column: Column) -> dict[str, Any]:
    return {
        "largest": column.largest.tolist(),
        "intervals": [asdict(each) for each in column.intervals],
        "expected": [asdict(each) for each in column.expected],
    }


def _read(values: Mapping[str, Any]) -> Column:
    return Column(
        np.array(values["largest"], float),
        tuple(Interval(**each) for each in values["intervals"]),
        tuple(Combination(**each) for each in values["expected"]),
    )
