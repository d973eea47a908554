"""The excitation at an instant, compiled.

It is a `lumped.kernels.arrays.Pieces`, its own of a call; time counts periods of the
first mesh.
"""

from __future__ import annotations

import math

from lumped.common.compiled import compiled_part, inlined
from lumped.kernels.arrays import (
    FIRST_OFFSET,
    FIRST_ROW,
    OFFSET,
    OFFSETS,
    PHASE,
    PITCH,
    RATE,
    ROW,
    SHAPES,
)


@inlined
def value_at(excitation, f, x, side):
    """Function f at position x of its cycle; side -1 takes the limit from below."""
    breaks = excitation.breaks
    first, last = excitation.first_piece[f], excitation.first_piece[f + 1]
    x -= math.floor(x)
    if side < 0 and x < 1e-9:
        x += 1.0
    count = last - first
    first_break = first + f  # each function before has one break more than pieces
    piece = min(int(x * count), count - 1)
    shifted = x + 1e-10 * side
    while piece > 0 and breaks[first_break + piece] > shifted:
        piece -= 1
    while piece < count - 1 and breaks[first_break + piece + 1] <= shifted:
        piece += 1
    t = x - breaks[first_break + piece]
    c = excitation.coefficients[excitation.pitches[f, ROW] + piece]
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]))


@inlined
def position(excitation, p, time):
    """Position of pair p at a time, in base pitches."""
    return (
        excitation.pair_positions[p, PHASE] + excitation.pair_positions[p, RATE] * time
    )


@compiled_part
def set_pitch(excitation, time, side):
    """Bring every pair to its base pitch at a time: its offset and coefficients."""
    pitches, first_piece = excitation.pitches, excitation.first_piece
    for f in range(pitches.shape[0]):
        p = f // 2
        x = position(excitation, p, time)
        pitch = pitches[f, PITCH] + math.floor(x + 1e-9 * side)
        count = first_piece[f + 1] - first_piece[f]
        pitches[f, ROW] = pitches[f, FIRST_ROW] + count * (pitch % pitches[f, SHAPES])
        if f % 2 == 1 and pitches[f, OFFSETS] > 0:
            offset = pitches[f, FIRST_OFFSET] + pitch % pitches[f, OFFSETS]
            excitation.pair_positions[p, OFFSET] = excitation.offsets[offset]


@compiled_part
def set_excitation(excitation, time, side, stiffness, gap):
    """Stiffness and gap of every pair (p,) at a time."""
    for p in range(gap.size):
        x = position(excitation, p, time)
        stiffness[p] = value_at(excitation, 2 * p, x, side)
        gap[p] = value_at(excitation, 2 * p + 1, x, side)
        gap[p] += excitation.pair_positions[p, OFFSET]
