"""Sweep tables: one row per speed and mesh of a frequency response, as CSV.

The rows are in the order in which the speeds were passed, mesh by mesh; for the file
format see `lumped.common.csv_text`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any, get_args

from lumped.common.csv_text import TableError, format_csv, parse_csv
from lumped.common.short_repr import ShortRepr
from lumped.steady.response import Status
from lumped.steady.sweep import Branch, Direction

LEGEND = {
    "mesh_frequency_Hz": "of the first mesh, in all rows",
    "mesh": "counted from 1",
    "direction": "of the speed, up or down",
    "dte_rms_m": "dynamic transmission error without its mean",
    "dte_rms_stderr_m": "standard error of dte_rms_m of a motion that does not repeat, "
    "measured over several windows; 0 where it repeats",
    "dte_peak_m": "largest value, the mean included",
    "contact_loss_fraction, back_side_fraction": "parts of the time",
    "period_multiple": "in periods of the row's own mesh, 0 where the motion did not "
    "repeat within the cap",
}


@dataclass(frozen=True)
class SweepRow(ShortRepr):
    """Row of one mesh at one speed; the fields are the columns of the file."""

    model: str
    direction: Direction
    torque_Nm: float
    mesh_frequency_Hz: float
    mesh: int
    dte_rms_m: float
    dte_rms_stderr_m: float
    dte_mean_m: float
    dte_peak_m: float
    force_peak_N: float
    contact_loss_fraction: float
    back_side_fraction: float
    period_multiple: int


COLUMNS = tuple(column.name for column in fields(SweepRow))
DERIVED_COLUMNS = ("driver_speed_rpm",)  # by who knows the teeth; not read
TEXT_COLUMNS, INTEGER_COLUMNS = ("model", "direction"), ("mesh", "period_multiple")


@dataclass(frozen=True)
class SweepTable:
    """Rows of one or more branches; header is free text by key."""

    rows: tuple[SweepRow, ...]
    header: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "header", MappingProxyType(dict(self.header)))


def branch_rows(branch: Branch, model: str, torque: float) -> Iterator[SweepRow]:
    """Rows of all finished speeds of a branch; a speed that diverged has none.

    torque : torque on the input gear [N m]
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
                dte_rms_stderr_m=float(response.dte_rms_stderr[mesh]),
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
    """Table of pairs (torque [N m], branch), with the legend after the header."""
    rows = [
        row for torque, branch in branches for row in branch_rows(branch, model, torque)
    ]
    return SweepTable(tuple(rows), dict(header or {}) | LEGEND)


def format_sweep(table: SweepTable) -> str:
    """Format the table as CSV text."""
    rows = ([getattr(row, name) for name in COLUMNS] for row in table.rows)
    return format_csv(COLUMNS, rows, table.header)


def parse_sweep(text: str, source: str = "sweep") -> SweepTable:
    """Read CSV text; raises TableError naming `source`, line and column."""
    csv_table = parse_csv(text, source)
    names = list(csv_table.names)
    for name in COLUMNS:
        if name not in names:
            raise TableError(f"{source}: column {name} is missing")
    for name in names:
        if name not in (*COLUMNS, *DERIVED_COLUMNS):
            raise TableError(f"{source}: unknown column {name}")
        if names.count(name) > 1:
            raise TableError(f"{source}: column {name} is there twice")
    rows = tuple(
        _row(cells, names, location) for location, cells in csv_table.rows.items()
    )
    return SweepTable(rows, csv_table.header)


def _row(cells: Sequence[str], names: Sequence[str], location: str) -> SweepRow:
    values: dict[str, Any] = {}
    for name, cell in zip(names, cells, strict=True):
        if name in DERIVED_COLUMNS:
            continue
        try:
            values[name] = _value(name, cell.strip())
        except ValueError as error:
            raise TableError(f"{location}, column {name}: {error}") from None
    return SweepRow(**values)


def _value(name: str, cell: str) -> str | int | float:
    if name in TEXT_COLUMNS:
        allowed = get_args(Direction) if name == "direction" else ()
        if not cell or (allowed and cell not in allowed):
            raise ValueError(f"{cell!r} must be {' or '.join(allowed) or 'a word'}")
        return cell
    if name in INTEGER_COLUMNS:
        count, least = int(cell), 1 if name == "mesh" else 0
        if count < least:
            raise ValueError(f"{count} must be {least} or more")
        return count
    return float(cell) if cell else math.nan
