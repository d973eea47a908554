"""Tooth thickness by a series of DIN 3967 (1978), such as cd25.

The letters choose the upper allowance, the number the tolerance below it, both by the
reference diameter and in the normal section.
"""

from __future__ import annotations

import re
from bisect import bisect_left

from fegear.files.errors import InputError

# reference diameters up to which each row holds [mm]
DIAMETERS_MM = 10, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6300, 10000
# upper allowances by row [um], each of them negative
ALLOWANCES_UM = {
    "a": (100, 135, 180, 250, 330, 450, 600, 820, 1100, 1500, 2000),
    "ab": (85, 110, 150, 200, 280, 370, 500, 680, 920, 1250, 1650),
    "b": (70, 95, 125, 170, 230, 310, 420, 560, 760, 1020, 1350),
    "bc": (58, 75, 105, 140, 190, 260, 340, 460, 620, 840, 1150),
    "c": (48, 65, 85, 115, 155, 210, 290, 390, 520, 700, 940),
    "cd": (40, 54, 70, 95, 130, 175, 240, 320, 430, 580, 780),
    "d": (33, 44, 60, 80, 110, 145, 200, 270, 360, 480, 640),
    "e": (22, 30, 40, 56, 75, 100, 135, 180, 250, 330, 450),
    "f": (10, 14, 19, 26, 35, 48, 64, 85, 115, 155, 210),
    "g": (5, 7, 9, 12, 17, 22, 30, 41, 56, 75, 100),
    "h": (0,) * 11,
}
# tolerances of the numbers 21 to 30 are ten in turn of one of these, of every second
# row of diameters; each of its rows begins one further on
TOLERANCES_UM = (
    (3, 5, 8, 12, 20, 30, 50, 80, 130, 200, 300, 500, 800, 1300, 2000),
    (6, 10, 16, 25, 40, 60, 100, 160, 250, 400, 600, 1000, 1600, 2400),
)
FIRST_NUMBER = 21
SERIES = re.compile(r"(a|ab|b|bc|c|cd|d|e|f|g|h)(2[1-9]|30)", re.I)


def thinning_of_series(series: str, diameter: float) -> tuple[float, float]:
    """Least and largest thinning of a tooth [um], normal section.

    series : such as cd25; diameter : of the reference circle [mm]

    Raises
    ------
    InputError
        If there is no such series or diameter.
    """
    chosen = SERIES.fullmatch(series.strip())
    if chosen is None:
        letters = f"{', '.join(ALLOWANCES_UM)} with 21 to 30"
        raise InputError(f"series {series[:40]!r} of DIN 3967; allowed are {letters}")
    if diameter > DIAMETERS_MM[-1]:
        raise InputError(
            f"reference diameter {diameter:g} mm; DIN 3967 ends at {DIAMETERS_MM[-1]}"
        )
    row = bisect_left(DIAMETERS_MM, diameter)
    least = ALLOWANCES_UM[chosen[1].lower()][row]
    sequence, step = _sequence_of_row(row)
    tolerance = TOLERANCES_UM[sequence][step + int(chosen[2]) - FIRST_NUMBER]
    return float(least), float(least + tolerance)


def _sequence_of_row(row: int) -> tuple[int, int]:
    """Which sequence of tolerances a row has, and where it begins in it."""
    if row < 2:
        return 0, row
    return (0, (row + 1) // 2) if row % 2 else (1, row // 2 - 1)
