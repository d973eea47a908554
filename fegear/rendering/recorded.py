"""The motion of one mesh, read back from a file that `fegear dynamics` writes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from fegear.files.errors import InputError
from fegear.files.output import read_text
from fegear.gearset.model import GearSet
from fegear.gearset.planes import Plane
from lumped.common.array_types import Array
from lumped.common.csv_text import parse_csv

Pair = tuple[int, bool]  # base pitches ahead of the reference pair, back flanks
# of a column's range within which a cycle is the same as another
REPETITION_RTOL = 1e-2
MAX_FILM_CYCLES = 16  # mesh cycles, at most, of a film
ALLOWED = "allowed are time histories that fegear dynamics writes"


def mesh_force(loads: Mapping[Pair, Any]) -> Any:
    """Sum of the pairs' loads, numbers or arrays, negative on the back flanks."""
    return sum(-load if back else load for (_, back), load in loads.items())


@dataclass(frozen=True)
class Instant:
    """A mesh at one time; pairs without load are left out.

    frequency : of the first mesh [Hz]; direction : of the sweep, in words
    time : since the start of the file [s]
    position : base pitches since the start of the mesh's cycle, 0 to 1
    ste : dynamic transmission error [m]
    loads : of each pair, positive [N]
    """

    frequency: float
    direction: str
    time: float
    position: float
    ste: float
    loads: Mapping[Pair, float]

    @property
    def force(self) -> float:
        """Mesh force, negative on the back flanks [N]."""
        return float(mesh_force(self.loads))

    @property
    def back(self) -> bool:
        """Whether the back flanks are in contact, and not the drive flanks."""
        return self.force < 0.0


@dataclass(frozen=True, eq=False)
class HistoryFile:
    """Columns (t,) by name and the entries of the header."""

    path: Path
    header: Mapping[str, str]
    columns: Mapping[str, Array]

    def number(self, key: str) -> float:
        try:
            return float(self.header.get(key, ""))
        except ValueError:
            raise InputError(f"{self.path}: no number for {key!r}; {ALLOWED}") from None

    def column(self, name: str) -> Array:
        if name not in self.columns:
            raise InputError(f"{self.path}: column {name} is missing; {ALLOWED}")
        return self.columns[name]

    @property
    def plane(self) -> Plane:
        """Plane state of the finite elements; files without it are of plane stress."""
        plane = self.header.get("plane", "stress")
        if plane not in get_args(Plane):
            raise InputError(f"{self.path}: plane = {plane}; {ALLOWED}")
        return cast(Plane, plane)

    @property
    def edits(self) -> dict[str, str]:
        """What was changed in the gear set for that run, by key."""
        entries = self.header.items()
        return {key[4:]: value for key, value in entries if key.startswith("set ")}


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """One mesh over the times (t,) of a file, whose last row repeats the first.

    source : the file, for messages
    edits : what was changed in the gear set for that run, by key
    pitch : base pitches from one row to the next
    """

    source: Path
    frequency: float
    direction: str
    friction: float
    torque: float
    plane: Plane
    edits: Mapping[str, str]
    time: Array
    pitch: float
    ste: Array
    loads: Mapping[Pair, Array]

    @property
    def rows(self) -> int:
        """Number of rows without the repeated one."""
        return self.time.size - 1

    @property
    def force(self) -> Array:
        """Mesh force (t,), negative on the back flanks [N]."""
        return mesh_force(self.loads)

    @property
    def cycles(self) -> int:
        """Mesh cycles after which the motion repeats."""
        all_cycles = max(1, round(self.rows * self.pitch))
        for count in range(1, all_cycles):
            shift = round(count / self.pitch)
            is_whole_shift = abs(shift * self.pitch - count) < 1e-6
            if (
                all_cycles % count == 0
                and is_whole_shift
                and self._repeats_after(shift)
            ):
                return count
        return all_cycles

    def _repeats_after(self, shift: int) -> bool:
        return all(
            np.ptp(values) == 0.0
            or np.abs(values[shift:] - values[:-shift]).max()
            < REPETITION_RTOL * np.ptp(values)
            for values in (self.ste, self.force)
        )

    @property
    def film_cycles(self) -> tuple[int, int]:
        """First mesh cycle of a film and their number.

        Of a motion that takes longer to repeat, the cycle of the largest force.
        """
        if self.cycles <= MAX_FILM_CYCLES:
            return 0, self.cycles
        return int(np.abs(self.force[:-1]).argmax() * self.pitch), 1

    def largest(self) -> Instant:
        """The row with the largest mesh force on either side."""
        return self.at(int(np.abs(self.force).argmax()))

    def frames(self, count: int) -> list[Instant]:
        """Equally spaced over the cycles of a film, all of a period if it is short."""
        first, cycles = self.film_cycles
        return [
            self.at((first + cycles * i / count) / self.pitch) for i in range(count)
        ]

    def extremes(self) -> list[Instant]:
        """Instants of the largest forces, pair loads and transmission errors."""
        rows = {int(load.argmax()) for load in self.loads.values()}
        rows |= {int(self.ste.argmin()), int(self.ste.argmax())}
        return [self.largest(), *(self.at(row) for row in sorted(rows))]

    def at(self, row: float) -> Instant:
        """Between two rows, linearly; row is from 0 to below `rows`."""
        row = row % self.rows
        row_before = min(int(row), self.rows - 1)
        fraction, position = row - row_before, self._mesh_position(row)
        # pairs are renumbered where the next row begins a new cycle
        passed_cycles = int(
            self._mesh_position(row_before + 1) < self._mesh_position(row_before)
        )
        loads = {}
        for pair, is_back in self.loads:
            load_before = self.loads[pair, is_back][row_before]
            loads_of_renumbered = self.loads.get((pair + passed_cycles, is_back))
            load_after = (
                0.0
                if loads_of_renumbered is None
                else loads_of_renumbered[row_before + 1]
            )
            loads[pair, is_back] = float(
                (1.0 - fraction) * load_before + fraction * load_after
            )
        return Instant(
            frequency=self.frequency,
            direction=self.direction,
            time=float(np.interp(row, np.arange(self.time.size), self.time)),
            position=position,
            ste=float(
                (1.0 - fraction) * self.ste[row_before]
                + fraction * self.ste[row_before + 1]
            ),
            loads={pair: load for pair, load in loads.items() if load > 0.0},
        )

    def _mesh_position(self, row: float) -> float:
        cycles = row * self.pitch
        return max(0.0, cycles - np.floor(cycles + 1e-9))


def read_history(path: Path) -> HistoryFile:
    """Header and columns; raises InputError, in one line, on any other file."""
    text = read_text(path)
    try:
        contents = parse_csv(text, str(path))
        table = np.array([list(map(float, row)) for row in contents.rows.values()])
    except ValueError as error:
        message = f"{path}: is no history of a motion, {error}; {ALLOWED}"
        raise InputError(message) from None
    if (
        "gear set" not in contents.header
        or len(table) < 2
        or contents.names[0] != "time_s"
    ):
        raise InputError(f"{path}: is no history of a motion; {ALLOWED}")
    if not np.isfinite(table).all():
        column = contents.names[int(np.argwhere(~np.isfinite(table))[0, 1])]
        raise InputError(f"{path}: {column} has values that are not finite; {ALLOWED}")
    return HistoryFile(
        path, contents.header, dict(zip(contents.names, table.T, strict=True))
    )


def mesh_motion(file: HistoryFile, gear_set: GearSet, mesh: int) -> RecordedMotion:
    """The motion of mesh number `mesh`, counted from 0, of that gear set.

    Raises InputError where the file is of another set or damaged.
    """
    _require_same_gear_set(file, gear_set)
    prefix = f"mesh{mesh + 1}"
    time, position = file.column("time_s"), file.column(f"{prefix}_position")
    pitch = float(position[1] - position[0])
    expected_cycles = pitch * np.arange(time.size)
    deviation = np.abs(np.remainder(position - expected_cycles + 0.5, 1.0) - 0.5)
    steps = np.diff(time)
    if not (pitch > 0.0 and deviation.max() < 1e-6 and np.ptp(steps) < 1e-6 * time[-1]):
        raise InputError(
            f"{file.path}: times or positions are not in equal steps; {ALLOWED}"
        )
    if pitch * time.size < 1.0 - 1e-6:
        raise InputError(
            f"{file.path}: ends after {pitch * time.size:.2f} of a mesh cycle; "
            f"{ALLOWED}"
        )
    pattern = re.compile(rf"{prefix}_(pair|back)(-?\d+)_load_N")
    matches = [(pattern.fullmatch(name), name) for name in file.columns]
    loads = {
        (int(match[2]), match[1] == "back"): file.columns[name]
        for match, name in matches
        if match
    }
    if not loads:
        raise InputError(
            f"{file.path}: column {prefix}_pair0_load_N is missing; {ALLOWED}"
        )
    return RecordedMotion(
        source=file.path,
        frequency=file.number("mesh_frequency_Hz"),
        direction=file.header.get("direction", ""),
        friction=file.number("friction coefficient"),
        torque=file.number("torque_Nm"),
        plane=file.plane,
        edits=file.edits,
        time=time,
        pitch=pitch,
        ste=file.column(f"{prefix}_dte_m"),
        loads=loads,
    )


def _require_same_gear_set(file: HistoryFile, gear_set: GearSet) -> None:
    from fegear.dynamics.history import gear_words

    name = file.header["gear set"]
    if name != gear_set.name:
        raise InputError(
            f"{file.path}: is of gear set {name}; allowed are histories of "
            f"{gear_set.name}"
        )
    gears_of_file = {
        column.removesuffix("_rotation_rad")
        for column in file.columns
        if column.endswith("_rotation_rad")
    }
    labels = gear_words(gear_set)
    if gears_of_file != set(labels):
        raise InputError(
            f"{file.path}: is of the gears {', '.join(sorted(gears_of_file))}; allowed "
            f"are histories of {', '.join(labels)}"
        )
