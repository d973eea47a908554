"""Axes of a map as they are written: `KEY=A:B:N` or `KEY=v,v,...`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fegear.cli.options import require
from fegear.errors import InputError

if TYPE_CHECKING:
    from lumped.maps import Axis

POINTS_LIMIT = 1_000_000


def parsed_axes(over: Sequence[str]) -> tuple[Axis, ...]:
    """One or two axes of `KEY=A:B:N` or `KEY=v,v,...`."""
    from lumped.maps import Axis, MapError

    require(1 <= len(over) <= 2, "--over", len(over), "one or two are allowed")
    axes = []
    for text in over:
        name, separator, values = text.partition("=")
        if not (separator and name.strip()):
            raise InputError(f"--over {text}; KEY=A:B:N is needed")
        try:
            axes.append(Axis(name.strip(), _axis_values(values, text)))
        except MapError as error:
            raise InputError(f"--over {error}") from None
    if len({axis.name for axis in axes}) < len(axes):
        raise InputError(f"--over {axes[0].name}; is given twice")
    count = 1
    for axis in axes:
        count *= len(axis.values)
    require(count <= POINTS_LIMIT, "--over", count, f"at most {POINTS_LIMIT} points")
    return tuple(axes)


def _axis_values(values: str, text: str) -> tuple[float, ...]:
    import numpy as np

    try:
        if ":" not in values:
            return tuple(float(value) for value in values.split(","))
        start, end, count = values.split(":")
        if not 1 <= int(count) <= POINTS_LIMIT:
            raise ValueError
        points = np.linspace(float(start), float(end), int(count))
        return tuple(float(f"{point:.12g}") for point in points)
    except ValueError:
        raise InputError(
            f"--over {text}; allowed KEY=A:B:N with N values from A to B, or values "
            "with commas"
        ) from None
