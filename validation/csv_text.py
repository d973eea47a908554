"""Rows as the text of a CSV file."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def csv_text(names: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(rows)
    return out.getvalue()


def csv_of(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows with equal keys, which name the columns; nothing where there are none."""
    return csv_text(list(rows[0]), (row.values() for row in rows)) if rows else ""
