"""Points of a benchmark as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from validation.csv_text import csv_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def write_points(points: Sequence[DataclassInstance], path: Path) -> None:
    """Equal dataclasses, a row each; their fields name the columns."""
    path.write_text(csv_of([asdict(point) for point in points]), encoding="utf-8")
