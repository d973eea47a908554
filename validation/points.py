"""Points of a benchmark as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from validation.csv_text import csv_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def points_csv(points: Sequence[DataclassInstance]) -> str:
    """Equal dataclasses, a row each; their fields name the columns."""
    return csv_of([asdict(point) for point in points])
