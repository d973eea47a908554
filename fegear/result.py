"""The base of all results, and pandas frames of their tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lumped.common.short_repr import ShortRepr

if TYPE_CHECKING:
    from pandas import DataFrame


class Result(ShortRepr):
    """What a study or a function gives; a frozen dataclass."""


def frame(columns: object) -> DataFrame:
    """A pandas frame; ImportError with what to type where pandas is missing."""
    try:
        from pandas import DataFrame
    except ImportError:
        raise ImportError(
            "to_frame needs pandas: pip install 'fegear[pandas]'"
        ) from None
    return DataFrame(columns)
