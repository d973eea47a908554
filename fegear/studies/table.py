"""Tables of results: columns with units in their names, as CSV and as frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from fegear.files.errors import InputError
from fegear.result import frame
from fegear.studies.columns import MAIN
from lumped.common.csv_text import format_csv

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of named columns; names end with units.

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
