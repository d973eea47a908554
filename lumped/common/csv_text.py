"""Commented CSV: header lines `# key: value`, column names with units, rows.

Numbers are written in the shortest form that reads back to the same bits; an empty
cell is NaN. Spreadsheet tables with semicolons or tabs between cells can be read too,
with a decimal comma or a decimal point.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

DECIMAL_COMMA = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")
# thousands, or three decimals
AMBIGUOUS_NUMBER = {
    mark: re.compile(rf"\s*[-+]?[1-9]\d{{0,2}}\{mark}\d{{3}}\s*") for mark in ",."
}


class TableError(ValueError):
    """Invalid table; the message names the source, line or column."""


@dataclass(frozen=True)
class CsvText:
    """Header, column names, and rows of cells with their place for messages."""

    header: Mapping[str, str]
    names: Sequence[str]
    rows: Mapping[str, Sequence[str]]


def format_exact(value: float) -> str:
    """Number as text that reads back to the same bits, a whole number as `100`."""
    short = f"{value:g}"
    return short if float(short) == value else repr(float(value)).removesuffix(".0")


def format_csv(
    names: Iterable[str],
    rows: Iterable[Iterable[object]],
    header: Mapping[str, str] | None = None,
) -> str:
    lines = [f"# {key}: {value}\n" for key, value in (header or {}).items()]
    return "".join(lines) + format_rows([names]) + format_rows(rows)


def format_rows(rows: Iterable[Iterable[object]]) -> str:
    """Format rows without names and header; NaN becomes an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows(["" if v != v else v for v in row] for row in rows)
    return out.getvalue()


def format_records(records: Sequence[Mapping[str, Any]]) -> str:
    """Format records with equal keys, which name the columns; NaN is written as `nan`.

    Returns an empty string if there are no records.
    """
    rows = ([str(v) for v in record.values()] for record in records)
    return format_csv(records[0], rows) if records else ""


def parse_csv(text: str, source: str) -> CsvText:
    """Parse a table; TableError if names are missing or rows have other lengths."""
    header: dict[str, str] = {}
    body: dict[str, list[str]] = {}
    separator = ""
    for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1):
        if line.startswith("#"):
            key, _, value = line[1:].partition(":")
            header[key.strip()] = value.strip()
        elif line.strip():
            separator = separator or separator_of(line)
            location = f"{source}, line {number}"
            body[location] = _cells(line, separator, location)
    if not body:
        raise TableError(f"{source}: no column names")
    names = body.pop(next(iter(body)))
    for name in names:
        if names.count(name) > 1:
            raise TableError(f"{source}: column {name} is there more than once")
    for location, row in body.items():
        if len(row) != len(names):
            raise TableError(
                f"{location}: {len(row)} cells where {len(names)} are named"
            )
    return CsvText(
        header, names, body if separator == "," else _with_decimal_points(body)
    )


def separator_of(line: str) -> str:
    """Separator of the column names of a table."""
    return next((c for c in "\t;" if c in line and "," not in line), ",")


def _cells(line: str, separator: str, location: str) -> list[str]:
    try:
        cells = next(csv.reader([line], delimiter=separator))
    except csv.Error as error:
        raise TableError(f"{location}: {error}") from None
    return cells


def _with_decimal_points(rows: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Rows of a spreadsheet with decimal points in place of decimal commas.

    TableError where a mark may as well separate thousands: a comma where no other
    cell has a decimal comma, a point where one has.
    """
    cells = [cell for row in rows.values() for cell in row]
    commas = {cell for cell in cells if DECIMAL_COMMA.fullmatch(cell)}
    decimal = any(not AMBIGUOUS_NUMBER[","].fullmatch(cell) for cell in commas)
    ambiguous = AMBIGUOUS_NUMBER["." if decimal else ","]
    for location, row in rows.items():
        for cell in filter(ambiguous.fullmatch, row):
            mark = "." if decimal else ","
            number = cell.strip()
            as_decimal, as_whole = number.replace(mark, "."), number.replace(mark, "")
            raise TableError(
                f"{location}: {number!r} may be {as_decimal} or {as_whole}; write "
                "thousands without a separator, and decimals with a point"
            )
    return {
        location: [c.replace(",", ".") if c in commas else c for c in row]
        for location, row in rows.items()
    }
