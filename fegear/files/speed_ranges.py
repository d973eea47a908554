"""Speeds and limits as they are written: `A:B:STEP`, numbers, commas between, `A:B`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from decimal import Decimal, InvalidOperation

from fegear.files.errors import InputError

MESH_FREQUENCY = "mesh_frequency_Hz"  # of the first mesh: its column and its key
MAX_SPEEDS = 100_000
LARGEST = Decimal(10) ** 9


def parsed_speeds(
    text: str, most: int = MAX_SPEEDS, name: str = "speeds"
) -> tuple[float, ...]:
    """Speeds in the order given, each once; none of an empty text.

    name : of the values in messages

    Raises ValueError that says what is allowed.
    """
    speeds: dict[Decimal, None] = {}
    for part in text.split(",") if text.strip() else ():
        speeds |= dict.fromkeys(_speed_range(part, most, name))
        _require_few(len(speeds), most, name)
    return tuple(float(speed) for speed in speeds)


def written_speeds(speeds: Sequence[float]) -> str:
    """Words from which `parsed_speeds` reads these speeds, to the last bit."""
    exact = [Decimal(repr(float(speed))) for speed in speeds]
    if len(exact) > 2:
        ends = exact[0], exact[-1], abs(exact[1] - exact[0])
        text = ":".join(map(_digits, ends))
        with suppress(ValueError):
            if parsed_speeds(text) == tuple(speeds):
                return text
    return ",".join(map(_digits, exact))


def _digits(number: Decimal) -> str:
    """Digits without an exponent or zeros at their end."""
    return f"{number.normalize():f}"


def _speed_range(part: str, most: int, name: str) -> list[Decimal]:
    """Decimals, so that 0.1 added ten times is 1."""
    try:
        numbers = [Decimal(number.strip()) for number in part.split(":")]
    except InvalidOperation:
        numbers = []
    finite = all(number.is_finite() for number in numbers)
    if len(numbers) not in (1, 3) or not finite:
        raise ValueError(
            "must be positive numbers or A:B:STEP, such as 800:4200:20 or 800,1000"
        )
    for number in numbers:
        if not Decimal(0) < number < LARGEST:
            raise ValueError(f"{name} and step must be above 0 and below 1e9")
    if len(numbers) == 1:
        return numbers
    start, end, step = numbers
    count = int(min(abs(end - start) / step, LARGEST)) + 1
    _require_few(count, most, name)
    sign = 1 if end >= start else -1
    return [start + sign * i * step for i in range(count)]


def _require_few(count: int, most: int, name: str) -> None:
    if count > most:
        raise ValueError(f"at most {most} {name} are allowed, got {count}")


def limits_of(
    wrong: str, text: str | None, least: float = -math.inf
) -> tuple[float, float]:
    """Two rising values A:B; else InputError with what is wrong."""
    try:
        low, high = map(float, (text or "").split(":"))
    except ValueError:
        low = high = math.nan
    if not (least <= low < high < math.inf and low > -math.inf):
        raise InputError(f"{wrong}, two values that rise")
    return low, high
