"""Parameters that a study varies: `KEY=A:B:N` or `KEY=v,v,...` in words."""

from __future__ import annotations

from dataclasses import MISSING
from typing import Any

import numpy as np

from fegear.files.errors import InputError
from fegear.studies.settings import setting
from lumped.common.checks import format_number
from lumped.common.options import Range
from lumped.steady.maps import Axis

MAX_POINTS = 1_000_000
AXIS_LIMITS = "must be KEY=A:B:N with N values from A to B, or values with commas"


def parsed_axis(text: str) -> Axis:
    """The axis of `KEY=A:B:N` or `KEY=v,v,...`; ValueError says what is allowed."""
    name, separator, values = text.partition("=")
    if not (separator and name.strip()):
        raise ValueError("KEY=A:B:N is needed")
    try:
        points = _values(values)
    except ValueError:
        raise ValueError(AXIS_LIMITS) from None
    return Axis(name.strip(), points)


def _values(text: str) -> tuple[float, ...]:
    if ":" not in text:
        return tuple(float(value) for value in text.split(","))
    start, end, count = text.split(":")
    is_single = int(count) == 1 and float(start) != float(end)
    if is_single or not 1 <= int(count) <= MAX_POINTS:
        raise ValueError
    points = np.linspace(float(start), float(end), int(count))
    return tuple(float(f"{point:.12g}") for point in points)


def written_axis(axis: Axis) -> str:
    """Words from which `parsed_axis` reads this axis, to the last bit."""
    values = [repr(float(value)) for value in axis.values]
    if len(values) > 2:
        span = f"{values[0]}:{values[-1]}:{len(values)}"
        if _values(span) == axis.values:
            return f"{axis.name}={span}"
    return f"{axis.name}={','.join(values)}"


def limits_axis(text: str) -> Axis:
    """The axis of the two limits of `KEY=A:B`, which rise."""
    name, _, values = text.partition("=")
    low, high = limits(values, "KEY=A:B")
    return Axis(name.strip(), (low, high))


def written_limits_axis(axis: Axis) -> str:
    """Words from which `limits_axis` reads this axis."""
    return f"{axis.name}={written_limits(axis.values)}"


def limits(text: str, form: str = "A:B") -> tuple[float, float]:
    """Two values that rise; ValueError says what is needed."""
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        low = high = float("nan")
    if not -np.inf < low < high < np.inf:
        raise ValueError(f"must be {form}, two values that rise")
    return low, high


def limits_or_single(text: str) -> tuple[float, ...]:
    """Two values that rise, or one."""
    return limits(text) if ":" in text else (float(text),)


def written_limits(values: tuple[float, ...]) -> str:
    """Words from which `limits` or `limits_or_single` reads these values."""
    return ":".join(map(repr, values))


def axis_setting(text: str) -> Any:
    """A setting of one axis that must be given."""
    how: dict[str, Any] = {"parse": parsed_axis, "write": written_axis}
    return setting(MISSING, text, metavar="KEY=A:B:N", **how)


def axes_setting(text: str) -> Any:
    """A setting of one or two axes that must be given."""
    how: dict[str, Any] = {"parse": parsed_axis, "write": written_axis}
    return setting(MISSING, text, metavar="KEY=A:B:N", several=True, **how)


def require_within(axis: Axis, allowed: Range, over: str) -> None:
    """Refuse an axis with a value outside a range; over : name of the setting."""
    for value in axis.values:
        if value not in allowed:
            raise InputError(
                f"{over} {axis.name} = {format_number(value)}; must be {allowed}"
            )


def require_axes(axes: tuple[Axis, ...]) -> None:
    """Two axes at most, of different parameters, with few points."""
    if len(axes) > 2:
        raise InputError(f"over = {len(axes)}; one or two are allowed")
    if len({axis.name for axis in axes}) < len(axes):
        raise InputError(f"over {axes[0].name}; is given twice")
    count = int(np.prod([len(axis.values) for axis in axes]))
    if count > MAX_POINTS:
        raise InputError(f"over = {count}; at most {MAX_POINTS} points")
