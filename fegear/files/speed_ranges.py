"""Speeds and limits as they are written: `A:B:STEP`, numbers, commas between, `A:B`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from decimal import Decimal, InvalidOperation

from fegear.files.errors import InputError

MESH_FREQUENCY = "mesh_frequency_Hz"  # of the first mesh: its column and its key
MAX_SPEEDS = 100_000
MAX_SPEED = Decimal(10) ** 9


def parsed_speeds(
    text: str, max_count: int = MAX_SPEEDS, name: str = "speeds"
) -> tuple[float, ...]:
    """Speeds in the order given, each once; none of an empty text.

    name : of the values in messages

    Raises ValueError that says what is allowed.
    """
    speeds: dict[Decimal, None] = {}
    for part in text.split(",") if text.strip() else ():
        speeds |= dict.fromkeys(_speed_range(part, max_count, name))
        _require_count(len(speeds), max_count, name)
    return tuple(float(speed) for speed in speeds)


def written_speeds(speeds: Sequence[float]) -> str:
    """Words from which `parsed_speeds` reads these speeds, to the last bit."""
    decimals = [Decimal(repr(float(speed))) for speed in speeds]
    if len(decimals) > 2:
        ends = decimals[0], decimals[-1], abs(decimals[1] - decimals[0])
        text = ":".join(map(_digits, ends))
        with suppress(ValueError):
            if parsed_speeds(text) == tuple(speeds):
                return text
    return ",".join(map(_digits, decimals))


def _digits(number: Decimal) -> str:
    """Digits without an exponent or zeros at their end."""
    return f"{number.normalize():f}"


def _speed_range(part: str, max_count: int, name: str) -> list[Decimal]:
    """Decimals, so that 0.1 added ten times is 1."""
    try:
        numbers = [Decimal(number.strip()) for number in part.split(":")]
    except InvalidOperation:
        numbers = []
    are_finite = all(number.is_finite() for number in numbers)
    if len(numbers) not in (1, 3) or not are_finite:
        of_torques = name == "torques"
        example = "60:140:20 or 60,140" if of_torques else "800:4200:20 or 800,1000"
        raise ValueError(f"must be positive numbers or A:B:STEP, such as {example}")
    for number in numbers:
        if not Decimal(0) < number < MAX_SPEED:
            raise ValueError(f"{name} and step must be above 0 and below 1e9")
    if len(numbers) == 1:
        return numbers
    start, end, step = numbers
    count = int(min(abs(end - start) / step, MAX_SPEED)) + 1
    _require_count(count, max_count, name)
    sign = 1 if end >= start else -1
    return [start + sign * i * step for i in range(count)]


def _require_count(count: int, max_count: int, name: str) -> None:
    if count > max_count:
        raise ValueError(f"{count} {name}, at most {max_count} are allowed")


def parsed_limits(
    refused_text: str, text: str | None, least: float = -math.inf
) -> tuple[float, float]:
    """Two rising values A:B; else InputError with what is wrong."""
    try:
        low, high = map(float, (text or "").split(":"))
    except ValueError:
        low = high = math.nan
    if not (least <= low < high < math.inf and low > -math.inf):
        raise InputError(f"{refused_text}, two values that rise")
    return low, high
