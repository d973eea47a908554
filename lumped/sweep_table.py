"""Sweep tables: one row per speed and mesh of a frequency response, as CSV.

The file has a header of comment lines, `# key: value`, one line of column names with
units and the rows in the order in which the speeds were passed, mesh by mesh. Numbers
are written in the shortest form that reads back to the same bits; an empty cell is
NaN.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any, get_args

from lumped.response import Status
from lumped.sweep import Branch, Direction

LEGEND = {
    "mesh_frequency_Hz": "of the first mesh, in all rows",
    "mesh": "counted from 1",
    "direction": "of the speed, up or down",
    "dte_rms_m": "dynamic transmission error without its mean",
    "dte_rms_spread_m": "standard error of dte_rms_m of a motion that does not repeat, "
    "measured over several windows; 0 where it repeats",
    "dte_peak_m": "largest value, the mean included",
    "contact_loss_fraction, back_side_fraction": "parts of the time",
    "period_multiple": "in periods of the row's own mesh, 0 where the motion did not "
    "repeat within the cap",
}


class SweepTableError(ValueError):
    """A sweep table that is not one; the message names line and column."""


@dataclass(frozen=True)
class SweepRow:
    """One mesh at one speed; the fields are the columns of the file."""

    model: str
    direction: Direction
    torque_Nm: float
    mesh_frequency_Hz: float
    mesh: int
    dte_rms_m: float
    dte_rms_spread_m: float
    dte_mean_m: float
    dte_peak_m: float
    force_peak_N: float
    contact_loss_fraction: float
    back_side_fraction: float
    period_multiple: int


COLUMNS = tuple(column.name for column in fields(SweepRow))
WORDS, COUNTS = ("model", "direction"), ("mesh", "period_multiple")


@dataclass(frozen=True)
class SweepTable:
    """Rows of one or more branches; header is free text by key."""

    rows: tuple[SweepRow, ...]
    header: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "header", MappingProxyType(dict(self.header)))


def branch_rows(branch: Branch, model: str, torque: float) -> Iterator[SweepRow]:
    """Rows of all speeds that a branch finished; one that diverged has none.

    torque : on the input gear [N m]
    """
    for response in branch.responses:
        if response.status == Status.DIVERGED:
            continue
        for mesh in range(response.dte_rms.size):
            yield SweepRow(
                model=model,
                direction=branch.direction,
                torque_Nm=float(torque),
                mesh_frequency_Hz=float(response.frequency),
                mesh=mesh + 1,
                dte_rms_m=float(response.dte_rms[mesh]),
                dte_rms_spread_m=float(response.dte_rms_spread[mesh]),
                dte_mean_m=float(response.dte_mean[mesh]),
                dte_peak_m=float(response.dte_peak[mesh]),
                force_peak_N=float(response.force_peak[mesh]),
                contact_loss_fraction=float(response.contact_loss[mesh]),
                back_side_fraction=float(response.back_side[mesh]),
                period_multiple=int(response.period_multiple[mesh]),
            )


def sweep_table(
    branches: Iterable[tuple[float, Branch]],
    model: str,
    header: Mapping[str, str] | None = None,
) -> SweepTable:
    """The table of (torque [N m], branch), its header followed by the legend."""
    rows = [
        row for torque, branch in branches for row in branch_rows(branch, model, torque)
    ]
    return SweepTable(tuple(rows), dict(header or {}) | LEGEND)


def format_sweep(table: SweepTable) -> str:
    """The table as CSV text."""
    out = io.StringIO()
    for key, value in table.header.items():
        out.write(f"# {key}: {value}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in table.rows:
        writer.writerow([_cell(getattr(row, name)) for name in COLUMNS])
    return out.getvalue()


def _cell(value: str | int | float) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value)
    return str(value)


def parse_sweep(text: str, source: str = "sweep") -> SweepTable:
    """Read CSV text; raises SweepTableError naming `source`, line and column."""
    header: dict[str, str] = {}
    names: list[str] | None = None
    rows: list[SweepRow] = []
    for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1):
        if line.startswith("#"):
            key, _, value = line[1:].partition(":")
            header[key.strip()] = value.strip()
        elif line.strip():
            cells = next(csv.reader([line]))
            where = f"{source}, line {number}"
            if names is None:
                names = _checked_names(cells, where)
            else:
                rows.append(_row(cells, names, where))
    if names is None:
        raise SweepTableError(f"{source}: no column names")
    return SweepTable(tuple(rows), header)


def _checked_names(names: list[str], where: str) -> list[str]:
    for wanted in COLUMNS:
        if names.count(wanted) != 1:
            times = names.count(wanted)
            raise SweepTableError(
                f"{where}: column {wanted} stands there {times} times, needed once"
            )
    unknown = [name for name in names if name not in COLUMNS]
    if unknown:
        raise SweepTableError(f"{where}: unknown column {unknown[0]}")
    return names


def _row(cells: list[str], names: list[str], where: str) -> SweepRow:
    if len(cells) != len(names):
        raise SweepTableError(
            f"{where}: {len(cells)} cells where {len(names)} are named"
        )
    values: dict[str, Any] = {}
    for name, cell in zip(names, cells, strict=True):
        try:
            values[name] = _value(name, cell.strip())
        except ValueError as error:
            raise SweepTableError(f"{where}, column {name}: {error}") from None
    return SweepRow(**values)


def _value(name: str, cell: str) -> str | int | float:
    if name in WORDS:
        allowed = get_args(Direction) if name == "direction" else ()
        if not cell or (allowed and cell not in allowed):
            raise ValueError(f"{cell!r} must be {' or '.join(allowed) or 'a word'}")
        return cell
    if name in COUNTS:
        count, least = int(cell), 1 if name == "mesh" else 0
        if count < least:
            raise ValueError(f"{count} must be {least} or more")
        return count
    return float(cell) if cell else math.nan


def read_sweep(path: str) -> SweepTable:
    """Read a sweep table; OSError or SweepTableError where that is not possible."""
    with open(path, encoding="utf-8", newline="") as file:
        return parse_sweep(file.read(), str(path))


def write_sweep(table: SweepTable, path: str) -> None:
    """Write a sweep table as it stands; see `format_sweep`."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(format_sweep(table))
