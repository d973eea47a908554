"""Checks of the fields of a gear set's parts, as errors of a user's input."""

from __future__ import annotations

from typing import Any

from fegear.files.errors import InputError
from lumped.common.checks import format_number, is_number
from lumped.common.checks import require_fields as require_types


def require_fields(part: Any) -> None:
    """Fields match their types and are finite."""
    try:
        require_types(part)
    except ValueError as error:
        raise InputError(str(error)) from None


def require_positive(part: Any, *names: str) -> None:
    """Numbers, or all numbers of a tuple, are above 0 where they are not None."""
    for name in names:
        value = getattr(part, name)
        for number in value if isinstance(value, tuple) else (value,):
            if is_number(number) and not number > 0.0:
                raise InputError(f"{name} = {format_number(number)}; must be above 0")


def require_within(part: Any, name: str, low: float, below: float) -> None:
    """A number is from low to below a limit where it is not None."""
    value = getattr(part, name)
    if value is not None and not low <= value < below:
        raise InputError(
            f"{name} = {format_number(value)}; must be {low:g} to below {below:g}"
        )
