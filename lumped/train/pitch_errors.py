"""Pitch errors of two gears as gaps of the tooth pairs that they form.

Teeth are counted in the order in which they come into contact. Tooth n of the driver
then meets tooth n of the driven gear, both counted on after a whole turn: the pairs
repeat after the common multiple of the teeth (hunting tooth), or of what the errors
repeat after. On the back flanks tooth n of the driven gear meets tooth n - 1 of the
driver, the one before it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def pair_errors(driver: Sequence[float], driven: Sequence[float]) -> Array:
    """Gap of every tooth pair (n,) [m] until the pairs repeat; empty without errors.

    driver, driven : material missing on each tooth, positive opens a gap [m]; empty
        for a gear without errors
    """
    if not (any(driver) or any(driven)):
        return np.zeros(0)
    periods = (shortest_period(errors) for errors in (driver, driven) if len(errors))
    return pair_gaps(driver, driven, np.arange(math.lcm(*periods)))


def pair_gaps(
    driver: Sequence[float],
    driven: Sequence[float],
    pair: ArrayLike,
    back: bool = False,
) -> Array:
    """Gaps of tooth pairs of any shape, by the number of their driven tooth [m].

    driver, driven : errors of the drive flanks, or empty
    back : of the back flanks, which stand as far ahead as the others stand back
    """
    pair = np.asarray(pair, np.int64)
    gaps = np.zeros(pair.shape)
    for errors, tooth in ((driver, pair - 1 if back else pair), (driven, pair)):
        if len(errors):
            gaps += np.asarray(errors, float)[tooth % len(errors)]
    return -gaps if back else gaps


def shortest_period(errors: Sequence[float] | Array) -> int:
    """Teeth after which errors repeat, a divisor of their number."""
    values = np.asarray(errors, float)
    for period in range(1, values.size // 2 + 1):
        if (
            values.size % period == 0
            and not np.ptp(values.reshape(-1, period), axis=0).any()
        ):
            return period
    return values.size
