"""The base of all results: a short `repr`, and pandas frames of their tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pandas import DataFrame

LONGEST = 40  # letters of a word that is shown as it is


class Result:
    """A dataclass that shows the sizes of what it holds, not all of its numbers."""

    def __repr__(self) -> str:
        instance: Any = self
        parts = (
            f"{field.name}={shown(getattr(self, field.name))}"
            for field in fields(instance)
        )
        return f"{type(self).__name__}({', '.join(parts)})"


def shown(value: object) -> str:
    """A plain value as it is, of others their kind and size."""
    if value is None or isinstance(value, bool | int | float | str):
        text = repr(value)
        return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
    kind = type(value).__name__
    if kind == "ndarray":
        return f"<array {' x '.join(map(str, getattr(value, 'shape', ())))}>"
    if isinstance(value, Mapping | Sequence) and isinstance(value, Sized):
        return f"<{kind} of {len(value)}>"
    name = getattr(value, "name", None)
    return f"<{kind} {name}>" if isinstance(name, str) else f"<{kind}>"


def frame(columns: object) -> DataFrame:
    """A pandas frame; ImportError with what to type where pandas is missing."""
    try:
        from pandas import DataFrame
    except ImportError:
        raise ImportError("to_frame needs pandas: pip install pandas") from None
    return DataFrame(columns)
