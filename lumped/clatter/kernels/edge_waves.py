"""What moves plays: the excitation e(t) and own waves, compiled; time in periods."""

from __future__ import annotations

import math

from lumped.common.compiled import compiled_part, inlined
from lumped.rattle.kernels.flight import TWO_PI, cos_sin_of_turns


@compiled_part
def piece_at(pieces, t):
    """Number of the piece that holds a time."""
    low, high = 0, pieces.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if pieces[middle, 0] <= t:
            low = middle
        else:
            high = middle
    return low


@compiled_part
def evaluate_pieces(pieces, t):
    """Excitation, as `evaluate_excitation`, by a polynomial in each piece."""
    k = piece_at(pieces, t)
    end = pieces[k + 1, 0] if k + 1 < pieces.shape[0] else math.inf
    h = t - pieces[k, 0]
    c1, c2, c3, c4 = pieces[k, 2], pieces[k, 3], pieces[k, 4], pieces[k, 5]
    value = pieces[k, 1] + h * (c1 + h * (c2 + h * (c3 + h * c4)))
    rate = c1 + h * (2.0 * c2 + h * (3.0 * c3 + h * 4.0 * c4))
    acceleration = 2.0 * c2 + h * (6.0 * c3 + h * 12.0 * c4)
    return value, rate, acceleration, 6.0 * c3 + 24.0 * h * c4, end


@inlined
def evaluate_excitation(box, t):
    """e and three derivatives, and where the piece of a signal ends."""
    if box.pieces.shape[0] > 0:
        return evaluate_pieces(box.pieces, t)
    value, rate, acceleration, jerk = 0.0, 0.0, 0.0, 0.0
    for k in range(box.orders.size):
        angular = TWO_PI * box.orders[k]
        c, s = cos_sin_of_turns(box.orders[k] * t)
        wave = box.cosines[k] * c + box.sines[k] * s
        speed = angular * (box.sines[k] * c - box.cosines[k] * s)
        value += wave
        rate += speed
        acceleration -= angular * angular * wave
        jerk -= angular * angular * speed
    return value, rate, acceleration, jerk, math.inf


@inlined
def edge_wave(box, p, t):
    """The wave of a play's own edge and three derivatives."""
    angular = TWO_PI * box.own_order[p]
    c, s = cos_sin_of_turns(box.own_order[p] * t)
    value = box.own_cosine[p] * c + box.own_sine[p] * s
    rate = angular * (box.own_sine[p] * c - box.own_cosine[p] * s)
    return value, rate, -angular * angular * value, -angular * angular * rate


@inlined
def evaluate_drive(box, p, t, e):
    """What moves a play, of e and its derivatives, with the wave of its own."""
    c = box.ratios[p]
    s, s1, s2, s3 = c * e[0], c * e[1], c * e[2], c * e[3]
    if box.own_order[p] > 0.0:
        w, w1, w2, w3 = edge_wave(box, p, t)
        s, s1, s2, s3 = s + w, s1 + w1, s2 + w2, s3 + w3
    return s, s1, s2, s3


@compiled_part
def derive_excitation(box, t, out):
    """Derivatives of e at a time, from itself on."""
    for m in range(out.size):
        out[m] = 0.0
    if box.pieces.shape[0] > 0:
        out[0], out[1], out[2], out[3], _ = evaluate_pieces(box.pieces, t)
        out[4] = 24.0 * box.pieces[piece_at(box.pieces, t), 5]
        return
    for k in range(box.orders.size):
        angular = TWO_PI * box.orders[k]
        c, s = cos_sin_of_turns(box.orders[k] * t)
        wave = box.cosines[k] * c + box.sines[k] * s
        speed = angular * (box.sines[k] * c - box.cosines[k] * s)
        for m in range(out.size):
            out[m] += wave
            wave, speed = speed, -angular * angular * wave


@compiled_part
def derive_drives(box, t, plays, count, e, out):
    """Derivatives of what moves plays, from itself on; out (count, terms), e : room."""
    derive_excitation(box, t, e)
    for k in range(count):
        p = plays[k]
        for m in range(e.size):
            out[k, m] = box.ratios[p] * e[m]
        if box.own_order[p] > 0.0:
            angular = TWO_PI * box.own_order[p]
            wave, speed, _, _ = edge_wave(box, p, t)
            for m in range(e.size):
                out[k, m] += wave
                wave, speed = speed, -angular * angular * wave
