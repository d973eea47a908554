"""Pitch errors of two gears as gaps of the tooth pairs that they form.

Teeth are numbered in the order in which they come into contact, beyond a whole turn.
Tooth n of the driver then meets tooth n of the driven gear. The pairs repeat after the
common multiple of the numbers of teeth (hunting tooth), or of the periods of the
errors. On the back flanks tooth n of the driven gear meets the preceding tooth n - 1 of
the driver.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array


def pair_errors(driver: Sequence[float], driven: Sequence[float]) -> Array:
    """Gap of every tooth pair until the pairs repeat.

    Parameters
    ----------
    driver : sequence of float
        Missing material on each tooth of the driver [m], positive if it opens a gap;
        empty for a gear without errors.
    driven : sequence of float
        The same of the driven gear [m].

    Returns
    -------
    (n,) array
        Gap of each pair [m]; empty without errors.
    """
    if not (any(driver) or any(driven)):
        return np.zeros(0)
    periods = (minimal_period(errors) for errors in (driver, driven) if len(errors))
    return pair_gaps(driver, driven, np.arange(math.lcm(*periods)))


def pair_gaps(
    driver: Sequence[float],
    driven: Sequence[float],
    pair: ArrayLike,
    back: bool = False,
) -> Array:
    """Gaps of tooth pairs [m].

    driver, driven : errors of the drive flanks, or empty
    pair : numbers of the pairs' driven teeth, of any shape
    back : whether to return gaps of the back flanks, which are displaced in the
        opposite direction
    """
    pair = np.asarray(pair, np.int64)
    gaps = np.zeros(pair.shape)
    for errors, tooth in ((driver, pair - 1 if back else pair), (driven, pair)):
        if len(errors):
            gaps += np.asarray(errors, float)[tooth % len(errors)]
    return -gaps if back else gaps


def minimal_period(errors: Sequence[float] | Array) -> int:
    """Number of teeth after which errors repeat, a divisor of the number of errors."""
    values = np.asarray(errors, float)
    for period in range(1, values.size // 2 + 1):
        if (
            values.size % period == 0
            and not np.ptp(values.reshape(-1, period), axis=0).any()
        ):
            return period
    return values.size
