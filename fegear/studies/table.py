"""Tables of results: columns with units in their names, as CSV and as frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fegear.files.errors import InputError
from fegear.result import frame
from fegear.studies.columns import MAIN
from lumped.common.csv_text import format_csv
from lumped.common.short_repr import ShortRepr

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False)
class Table(ShortRepr):
    """Rows of named columns; names end with units.

    A column is taken by its name, ``table["dte_rms_m"]``.

    Parameters
    ----------
    names : sequence of str
        Names of the columns.
    rows : callable
        Function without arguments that returns the rows in order, each a sequence with
        a value for every column, so that long tables need no memory.
    header : mapping of str to str, optional
        Entries of the lines above the names of the columns.
    """

    names: Sequence[str]
    rows: Callable[[], Iterable[Sequence[Any]]]
    header: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, columns: Mapping[str, ArrayLike], header: Mapping[str, str]) -> Table:
        """Columns of equal length as a table.

        Parameters
        ----------
        columns : mapping of str to array_like
            Values (n,) by the name of the column.
        header : mapping of str to str
            Entries of the lines above the names of the columns.

        Returns
        -------
        Table
            Table with n rows.
        """
        lists = [np.asarray(column).tolist() for column in columns.values()]
        return cls(tuple(columns), lambda: zip(*lists, strict=True), header)

    @classmethod
    def of_rows(
        cls,
        rows: Sequence[Mapping[str, Any]],
        header: Mapping[str, str] = MappingProxyType({}),
        names: Sequence[str] = (),
    ) -> Table:
        """Rows with the same keys as a table.

        Parameters
        ----------
        rows : sequence of mapping of str
            Values by the name of the column, all in the same order.
        header : mapping of str to str, optional
            Entries of the lines above the names of the columns.
        names : sequence of str, optional
            Names of the columns where there is no row.

        Returns
        -------
        Table
            Table with a row for each.
        """
        keys = tuple(rows[0]) if rows else tuple(names)
        return cls(keys, lambda: [tuple(row.values()) for row in rows], header)

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self.columns[name]
        except KeyError:
            raise InputError(
                f"the table has no column {name}; columns names all"
            ) from None

    @cached_property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """Values (n,) by the name of the column; a number that is missing is NaN."""
        columns = zip(*self.rows(), strict=True)
        values = dict(zip(self.names, columns, strict=False))
        return MappingProxyType({n: _array(values.get(n, ())) for n in self.names})

    def csv(self) -> str:
        """The table as CSV text with its header.

        Returns
        -------
        str
            Text with a line of names and a line for every row; numbers are written in
            the shortest form that reads back to the same bits.
        """
        return format_csv(list(self.names), self.rows(), dict(self.header))

    def to_frame(self) -> DataFrame:
        """The table as a pandas frame.

        Returns
        -------
        pandas.DataFrame
            A column for each name.

        Raises
        ------
        ImportError
            If pandas is missing.
        """
        columns = zip(*self.rows(), strict=True)
        return frame(dict(zip(self.names, columns, strict=False)))


def _array(values: Sequence[Any]) -> NDArray[Any]:
    """A column of numbers, in which None is NaN, or of texts."""
    if any(value is None for value in values):
        present = [value for value in values if value is not None]
        if not all(isinstance(value, int | float) for value in present):
            return np.array(values, dtype=object)
        return np.array([np.nan if v is None else v for v in values], dtype=float)
    return np.array(values)


class Tabled(Protocol):
    """A result with its tables; InputError where it has none."""

    @property
    def study(self) -> Any: ...

    @property
    def table(self) -> Table: ...

    @property
    def more_tables(self) -> Mapping[str, Table]: ...


def tables_of(result: Tabled) -> Iterator[tuple[str, Table]]:
    """All tables of a result by name, the main one first where there is one."""
    with suppress(InputError):
        yield MAIN, result.table
    yield from result.more_tables.items()


def finite_or_none(value: float) -> float | None:
    """A finite number, or None as JSON has it."""
    return value if math.isfinite(value) else None
