"""Published values of spur gears, and those of other programs, beside ours.

`published_cases` computes every case; `markdown` and `draw` show them.
"""

from validation.published.cases import (
    PublishedCase,
    PublishedRow,
    case_names,
    published_cases,
)
from validation.published.showing import draw, markdown, pair_table

__all__ = [
    "PublishedCase",
    "PublishedRow",
    "case_names",
    "draw",
    "markdown",
    "pair_table",
    "published_cases",
]
