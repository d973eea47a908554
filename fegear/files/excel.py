"""Spreadsheets (.xlsx) by openpyxl, with numbers to the last bit and without dates.

openpyxl writes 16 digits of a number, of which some need 17; cells therefore get the
text of their number. All dates are that of the oldest zip file, so that equal values
give equal bytes.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import isfinite, isnan
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from fegear.files.errors import InputError
from fegear.files.output import write_whole
from fegear.files.version import package_version

MAX_ROWS, MAX_COLUMNS = 1_048_576, 16_384  # of a sheet
LONGEST_TEXT = 32_767  # letters of a cell, see `wrapped`
EPOCH = datetime(1980, 1, 1)  # of zip files
ROWS_ABOVE = 2  # names and units
WIDTHS = 12, 60  # least and largest, letters of a column


@dataclass(frozen=True, eq=False)
class Sheet:
    """Columns of equal length, with a row of names and one of units above.

    units : of the columns, none where the row is left out
    """

    columns: Mapping[str, Sequence[Any]]
    units: Sequence[str] = ()

    @property
    def rows(self) -> Iterator[Sequence[Any]]:
        """All rows, in order."""
        yield list(self.columns)
        if self.units:
            yield self.units
        yield from zip(*self.columns.values(), strict=True)


class _UndatedZip(ZipFile):
    """An archive whose entries are as old as can be."""

    def writestr(self, zinfo_or_arcname: Any, data: Any, *_: Any, **__: Any) -> None:
        super().writestr(ZipInfo(zinfo_or_arcname), data, ZIP_DEFLATED)

    def write(self, filename: Any, arcname: Any = None, *_: Any, **__: Any) -> None:
        self.writestr(arcname, Path(filename).read_bytes())


def write_excel(path: Path, sheets: Mapping[str, Sheet]) -> None:
    """Write sheets by name.

    Raises InputError where a sheet cannot hold the rows or columns, or the file cannot
    be written.
    """
    for name, sheet in sheets.items():
        _require_space(path, name, sheet)
    # openpyxl writes temporary files of its own, for which there may be no space
    write_whole(path, lambda beside: beside.write_bytes(_content(sheets)))


def _content(sheets: Mapping[str, Sheet]) -> bytes:
    from openpyxl import Workbook
    from openpyxl.writer.excel import ExcelWriter

    book = Workbook(write_only=True)
    book.properties.creator = f"fegear {package_version()}"
    book.properties.created = book.properties.modified = EPOCH
    for name, sheet in sheets.items():
        _fill_sheet(book.create_sheet(name), sheet)
    out = io.BytesIO()
    ExcelWriter(book, _UndatedZip(out, "w")).save()
    return out.getvalue()


def _require_space(path: Path, name: str, sheet: Sheet) -> None:
    rows = ROWS_ABOVE + max(map(len, sheet.columns.values()), default=0)
    sizes = ("rows", rows, MAX_ROWS), ("columns", len(sheet.columns), MAX_COLUMNS)
    for unit, size, most in sizes:
        if size > most:
            raise InputError(
                f"{path}: {name} has {size} {unit}, a sheet holds at most {most}; use "
                ".nc or .csv"
            )


def _fill_sheet(target: Any, sheet: Sheet) -> None:
    from openpyxl.utils import get_column_letter

    target.freeze_panes = f"A{1 + ROWS_ABOVE if sheet.units else 2}"
    for number, (name, cells) in enumerate(sheet.columns.items(), start=1):
        texts = (len(cell) for cell in cells if isinstance(cell, str))
        width = max(len(name) + 1, max(texts, default=0))
        column = target.column_dimensions[get_column_letter(number)]
        column.width = min(max(width, WIDTHS[0]), WIDTHS[1])
    for row in sheet.rows:
        target.append([_cell(target, value) for value in row])


def _cell(sheet: Any, value: Any) -> Any:
    """A cell of openpyxl; empty for NaN, and infinity as text."""
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE

    if isinstance(value, float) and isnan(value):
        return None
    cell = WriteOnlyCell(sheet)
    if isinstance(value, str) or (isinstance(value, float) and not isfinite(value)):
        text = ILLEGAL_CHARACTERS_RE.sub("\ufffd", str(value))
        cell._value, cell.data_type = text, "s"  # never a formula
    elif isinstance(value, bool):
        cell._value, cell.data_type = value, "b"
    else:
        cell._value, cell.data_type = repr(value), "n"
    return cell


def wrapped(text: str) -> list[str]:
    """A text in parts that a cell holds each, one part where it is short."""
    starts = range(0, max(len(text), 1), LONGEST_TEXT)
    return [text[start : start + LONGEST_TEXT] for start in starts]
