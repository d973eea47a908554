"""Mesh tables: stiffness, transmission error and load sharing over a mesh cycle.

The file is a CSV with a header of comment lines, `# key: value`, one line of
column names with units, and a row per torque and position. Numbers are written in
the shortest form that reads back to the same bits; an empty cell is NaN. Columns
beyond the required ones may be missing or extra.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.common.checks import format_number, require_fields
from lumped.common.csv_text import TableError, format_csv, parse_csv
from lumped.common.short_repr import ShortRepr

REQUIRED_COLUMNS = ("torque_Nm", "position", "stiffness_N_per_m")
INTEGER_COLUMNS = ("n_pairs",)


@dataclass(frozen=True, eq=False)
class MeshTable(ShortRepr):
    """Table of one mesh at t torques on the driver and n positions.

    A column is taken by its name, ``table["ste_m"]``, torques and positions too.

    Parameters
    ----------
    torque_Nm : (t,) array
        Torques on the driver [N m], all different.
    position : (n,) array
        Base pitches from the pitch point of the reference pair, rising.
    columns : mapping of str to (t, n) array
        Quantities by name with unit.
    header : mapping of str to str, optional
        Free text by key, such as gear set, settings and version.

    Raises
    ------
    TableError
        If a column has another shape, a torque is there more than once or positions do
        not rise.
    ValueError
        If a value is not of its type.
    """

    torque_Nm: Array
    position: Array
    columns: Mapping[str, Array]
    header: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_fields(self)
        for name in REQUIRED_COLUMNS[:2]:
            if getattr(self, name).ndim != 1:
                raise TableError(f"{name} must be a list of numbers")
        shape = (self.torque_Nm.size, self.position.size)
        for name, values in self.columns.items():
            if values.shape != shape:
                raise TableError(f"shape of {name} = {values.shape}; must be {shape}")
        torques = self.torque_Nm.tolist()
        for torque in torques:
            if torques.count(torque) > 1:
                raise TableError(f"torque_Nm = {torque:g} is there more than once")
        if not (np.diff(self.position) > 0.0).all():
            index = int(np.argmin(np.diff(self.position) > 0.0))
            before, after = self.position[index : index + 2]
            raise TableError(
                f"position must increase, {format_number(after)} follows "
                f"{format_number(before)}"
            )
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))
        object.__setattr__(self, "header", MappingProxyType(dict(self.header)))

    def __getitem__(self, name: str) -> Array:
        if name in REQUIRED_COLUMNS[:2]:
            return np.asarray(getattr(self, name))
        try:
            return self.columns[name]
        except KeyError:
            listed = ", ".join(self)
            raise TableError(
                f"the mesh table has no column {name}; it has {listed}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in tuple(self)

    def __iter__(self) -> Iterator[str]:
        """Names of all columns, in the order of files."""
        yield from REQUIRED_COLUMNS[:2]
        yield from self.columns

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled by what it is made of: proxies of mappings are not."""
        return MeshTable, (
            *(self.torque_Nm, self.position),
            *(dict(self.columns), dict(self.header)),
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MeshTable):
            return NotImplemented
        same = dict(self.header) == dict(other.header)
        same &= list(self.columns) == list(other.columns)
        pairs = [(self.torque_Nm, other.torque_Nm), (self.position, other.position)]
        pairs += [(self[n], other[n]) for n in self.columns] if same else []
        return same and all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)

    __hash__ = None  # type: ignore[assignment]

    @property
    def flat(self) -> dict[str, NDArray[Any]]:
        """All columns (t n,), torque by torque, including torques and positions."""
        torque, position = np.meshgrid(self.torque_Nm, self.position, indexing="ij")
        columns = {"torque_Nm": torque, "position": position, **self.columns}
        return {
            name: values.ravel().astype(int if name in INTEGER_COLUMNS else float)
            for name, values in columns.items()
        }

    @property
    def pair_count(self) -> int:
        """Number of tooth pairs with separate columns, pair1 to pairN."""
        return sum(name.endswith("_load_share") for name in self.columns)


def format_table(table: MeshTable) -> str:
    """Format the table as CSV text."""
    columns = table.flat
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return format_csv(columns, rows, table.header)


def parse_table(text: str, source: str = "table") -> MeshTable:
    """Read CSV text; raises TableError naming `source` and the line."""
    csv_table = parse_csv(text, source)
    _require_columns(csv_table.names, source)
    data = np.array(
        [
            [
                _parse_number(
                    cell, f"{location}, column {name}", name in REQUIRED_COLUMNS[:2]
                )
                for cell, name in zip(row, csv_table.names, strict=True)
            ]
            for location, row in csv_table.rows.items()
        ]
    ).reshape(-1, len(csv_table.names))
    columns = dict(zip(csv_table.names, data.T, strict=True))
    return table_of_columns(columns, csv_table.header, source)


def table_of_columns(
    columns: Mapping[str, Array], header: Mapping[str, str], source: str = "table"
) -> MeshTable:
    """The mesh table of columns (n,), a row for each torque and position.

    Raises TableError naming `source`.
    """
    _require_columns(columns, source)
    sizes = {name: np.shape(values) for name, values in columns.items()}
    expected = sizes[REQUIRED_COLUMNS[0]]
    for name, size in sizes.items():
        if size != expected or len(size) != 1:
            raise TableError(
                f"{source}: column {name} of shape {size}, that of torques {expected}"
            )
    for name in REQUIRED_COLUMNS[:2]:
        if not np.isfinite(columns[name]).all():
            raise TableError(f"{source}: column {name} must have finite numbers")
    if not expected[0]:
        raise TableError(f"{source}: no rows")
    data = np.array([*columns.values()], dtype=float).T
    try:
        return _table_from(list(columns), data, header)
    except TableError as error:
        raise TableError(f"{source}: {error}") from None


def _require_columns(names: Container[str], source: str) -> None:
    for name in REQUIRED_COLUMNS:
        if name not in names:
            raise TableError(f"{source}: column {name} is missing")


def _parse_number(cell: str, location: str, required: bool) -> float:
    try:
        value = float(cell) if cell.strip() else math.nan
    except ValueError:
        raise TableError(f"{location}: {cell!r} is no number") from None
    if required and not math.isfinite(value):
        raise TableError(f"{location}: {cell!r}; must be a finite number")
    return value


def _table_from(
    names: Sequence[str], data: Array, header: Mapping[str, str]
) -> MeshTable:
    torque, position = (data[:, names.index(name)] for name in REQUIRED_COLUMNS[:2])
    torques = np.array(list(dict.fromkeys(torque)))
    if not (torques > 0.0).all():
        raise TableError(
            f"torque_Nm = {format_number(torques.min())}; must be above 0 N m"
        )
    positions = position[torque == torque[0]]
    expected = [(t, p) for t in torques for p in positions]
    if expected != list(zip(torque, position, strict=True)):
        raise TableError("every torque must list the same positions")
    shape = (torques.size, positions.size)
    columns = {
        name: data[:, i].reshape(shape)
        for i, name in enumerate(names)
        if name not in REQUIRED_COLUMNS[:2]
    }
    return MeshTable(torques, positions, columns, header)


def read_table(path: str) -> MeshTable:
    """Read a mesh table.

    Parameters
    ----------
    path : str
        CSV file.

    Returns
    -------
    MeshTable
        Table with the columns of the file; an empty cell is NaN.

    Raises
    ------
    OSError
        If the file cannot be read.
    TableError
        If the file is not a mesh table; the message names the file and the line.
    """
    with open(path, encoding="utf-8", newline="") as file:
        return parse_table(file.read(), str(path))


def write_table(table: MeshTable, path: str) -> None:
    """Write a mesh table unchanged, with its header.

    Numbers are written in the shortest form that reads back to the same bits.

    Parameters
    ----------
    table : MeshTable
        Table to write.
    path : str
        CSV file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(format_table(table))


def pair_names(table: MeshTable, quantity: str) -> list[str]:
    """Names of the columns pair1_quantity, pair2_quantity, ... in order."""
    return [f"pair{pair}_{quantity}" for pair in range(1, table.pair_count + 1)]


def pair_compliance_name(one: int, other: int) -> str:
    """Name of the column of the mutual compliance of two pairs, numbered from 0."""
    first, second = sorted((one, other))
    return f"pair{first + 1}_pair{second + 1}_compliance_m_per_N"


def pair_teeth(table: MeshTable) -> list[int]:
    """Number of base pitches by which each pair is ahead of the reference pair.

    It is read from the header entry that begins with `pairs ahead`; without it the
    order of the pairs is 0, -1, 1, -2, 2, ...
    """
    for key, text in table.header.items():
        if key.startswith("pairs ahead"):
            try:
                entries = dict(item.split("=") for item in text.split())
                return [int(entries[f"pair{i + 1}"]) for i in range(table.pair_count)]
            except (KeyError, ValueError):
                raise TableError(f"header {key}: {text}; cannot be read") from None
    return sorted(
        range(-table.pair_count, table.pair_count), key=lambda k: (abs(k), k)
    )[: table.pair_count]
