"""What a result shows on a screen: lines and tables of words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import floor, log10
from typing import Protocol

ROUND_OFF = 1e-9  # of micrometres, newtons and per cents


@dataclass
class Grid:
    """A table of words with the names of its columns, which may have lines."""

    columns: tuple[str, ...]
    rows: list[Sequence[str]] = field(default_factory=list)

    def add(self, *cells: str) -> None:
        self.rows.append(cells)


Page = Iterator[str | Grid]


class Described(Protocol):
    """What a study is about, with a word for what was not printed in its source."""

    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def inferences(self) -> Sequence[str]: ...


def heading(subject: Described) -> Page:
    """First lines of a page: what it is about."""
    yield f"{subject.name}: {subject.description or 'no description'}"
    yield from (f"inferred: {each}" for each in subject.inferences)


def number(value: float, figures: int = 5) -> str:
    """At least so many figures, without an exponent while it can be read.

    Of values in units that fit them: what is nothing but round-off is 0.
    """
    if abs(value) < ROUND_OFF:
        return "0"
    if not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{figures}g}"
    decimals = figures - 1 - floor(log10(abs(value)))
    return f"{value:.{max(0, decimals)}f}"
