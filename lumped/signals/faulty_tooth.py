"""Which tooth of a gear differs from the others, by the residual of an average.

A fault of a tooth changes the deflection of its mesh while the tooth is in contact,
from the start of its path of contact to the end. Speeds are rates of it: their integral
over a turn is searched. A broken tip differs where the path ends at that tip, in a peak
that is short beside an engagement; the neighbour is in contact there as well, and its
engagement would have all of the peak.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Indices

# Base pitches from the end of the path at a tip within which a broken one has its peak
TIP_INSIDE, TIP_BEYOND = 0.2, 0.2
# Mean square over an engagement, over the square of the peak, below which it is short:
# with 0.1 585 of 600 signals of the 200 random faults that chose it name the tooth
MAX_TIP_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class Engagement:
    """Contact of a gear's teeth in one mesh, over a turn of the gear.

    first : position of the mesh at the start of the turn [base pitches]
    start, end : of the contact of a tooth, from the pitch point [base pitches]
    drives : whether the gear drives, so that its tips touch at the end
    teeth : (z,) number of the tooth, from 1, that is at the pitch point after 0, 1, ...
        base pitches
    overlap : base pitches of the contact that are those of the helix over the width
    """

    first: float
    start: float
    end: float
    drives: bool
    teeth: Indices
    overlap: float = 0.0

    def mean_squares(self, values: Array) -> Array:
        """Mean squares (z, c) of signals (p, c) while each tooth is in contact."""
        points, count = len(values), self.teeth.size
        per_pitch = points / count
        start = np.arange(count) + self.start - self.first
        first = np.ceil(start * per_pitch).astype(np.int64) % points
        length = max(1, round((self.end - self.start) * per_pitch))
        repeated = np.concatenate([values] * (1 + -(-length // points))) ** 2
        sums = np.concatenate([np.zeros((1, values.shape[1])), repeated.cumsum(axis=0)])
        return np.asarray((sums[first + length] - sums[first]) / length)

    def tooth_at_tip(self, place: Array) -> tuple[Indices, NDArray[np.bool_]]:
        """Tooth whose tip is nearest to the end of the path, and whether it is there.

        place : (c,) positions of the mesh [base pitches]

        Returns its place in `teeth` (c,), and whether it may touch by its tip alone.
        """
        low, high = self.end - TIP_INSIDE, self.end + TIP_BEYOND
        if not self.drives:
            low, high = self.start - TIP_BEYOND, self.start + TIP_INSIDE
        pitch = np.floor(place - low)
        index = pitch.astype(np.int64) % self.teeth.size
        return index, np.asarray(place - pitch <= high)


def faulty_tooth(
    residual: Array, is_rate: NDArray[np.bool_], engagement: Engagement
) -> tuple[Indices, Array]:
    """Number of the tooth (c,) that differs most, and its root mean square (c,).

    residual : (p, c) of averages over a turn; is_rate : (c,) whether of a speed
    """
    deflection = np.where(is_rate, integral_over_turn(residual), residual)
    by_tooth = engagement.mean_squares(deflection)
    index = by_tooth.argmax(axis=0)
    peak = np.abs(deflection).argmax(axis=0)
    pitches = engagement.teeth.size / len(deflection)
    at_tip, is_at_tip = engagement.tooth_at_tip(engagement.first + pitches * peak)
    squared = np.abs(deflection).max(axis=0) ** 2
    is_short = by_tooth.max(axis=0) < MAX_TIP_SHARE * squared
    index = np.where(is_at_tip & is_short, at_tip, index)
    squares = engagement.mean_squares(residual)
    of_tooth = squares[index, np.arange(residual.shape[1])]
    return engagement.teeth[index], np.sqrt(of_tooth)


def integral_over_turn(rate: Array) -> Array:
    """Integral (p, c) over a turn of rates without a mean, itself without one."""
    lines = np.fft.rfft(rate, axis=0)
    order = np.arange(len(lines))[:, None]
    lines = np.where(order > 0, lines / (2j * np.pi * np.maximum(order, 1)), 0.0)
    return np.fft.irfft(lines, len(rate), axis=0)
