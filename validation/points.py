"""Points of a benchmark as CSV."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import astuple, fields
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def write_points(points: Sequence[DataclassInstance], path: Path) -> None:
    """Equal dataclasses, a row each; their fields name the columns."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([field.name for field in fields(points[0])])
        writer.writerows(astuple(point) for point in points)
