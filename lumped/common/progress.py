"""Progress reports of long computations."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]  # (what, done, of how many)


def silent(label: str, done: int, total: int) -> None:
    """Ignore the progress."""
