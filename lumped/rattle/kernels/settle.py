"""Where departures from the upper flank lead: return maps iterated, compiled."""

from __future__ import annotations

import math

from lumped.compiled import compiled, inlined
from lumped.rattle.kernels.flight import returned

SAME = 1e-9  # turns, and of a speed: departures that are one
EXACT = 1e-13  # the same to round-off
ANCHORED = 32  # returns, at least, after which departures are compared with another one
SHORT = 0.05  # turns of a flight; a whole turn of shorter ones fades away
QUIET, CHANGING = -1, 0  # in place of a period


@inlined
def apart(t, v, other_t, other_v):
    """Distance of two departures."""
    turn = t - other_t
    return abs(turn - math.floor(turn + 0.5)) + abs(v - other_v) / (1.0 + v)


@inlined
def settle(m, t, v, most, early):
    """The departure (t, v) after `most` returns, and what it belongs to.

    (period, returns until that was clear, t, v): the period in returns, QUIET where the
    flanks stay together or only shorter and shorter flights follow, CHANGING else.

    early : stop where it is clear; what is found is the same
    """
    anchor_t, anchor_v, anchored, renewed = t, v, 0, ANCHORED
    long_ago, period, clear, gap, i = t, CHANGING, most, math.inf, 0
    while i < most:
        before = t
        t, v, _ = returned(m, t, v)
        i += 1
        if math.isnan(t):
            return QUIET, i, t, v
        long_ago = t if t - before > SHORT else long_ago
        if t - long_ago > 1.0:
            return QUIET, i, t, v
        if period != CHANGING:
            continue
        now = apart(t, v, anchor_t, anchor_v)
        if now < SAME and (now <= gap or now < EXACT) and gap < math.inf:
            # twice in a row, and no further apart: departures close in on an orbit
            period, clear = i - anchored, i
            most = i + (most - i) % period if early else most
        elif now < SAME or i >= renewed:
            gap = now if now < SAME else math.inf
            renewed = i + (i - anchored if now < SAME else max(ANCHORED, i // 4))
            anchor_t, anchor_v, anchored = t, v, i
    return period, clear, t, v


@compiled
def settle_cells(m, t, v, most, early, found, end):
    """`settle` from departures (c,); found (c, 2) period and returns, end (c, 2)."""
    for c in range(t.size):
        period, clear, end[c, 0], end[c, 1] = settle(m, t[c], v[c], most, early)
        found[c, 0], found[c, 1] = period, clear
        end[c, 0] -= math.floor(end[c, 0])


@compiled
def follow(m, t, v, count, out):
    """Departures (count, 3): time, speed, and how often the lower flank was met.

    out : NaN from where the flanks stay together
    """
    for i in range(count):
        out[i, 0], out[i, 1] = t, v
        t, v, lower = returned(m, t, v)
        out[i, 2] = lower
        if math.isnan(t):
            break


@compiled
def stretch(m, t, v, count, small):
    """Largest Lyapunov exponent per return, of a neighbour kept at a distance `small`.

    NaN where the flanks stay together.
    """
    other_t, other_v, total = t, v + small, 0.0
    for _ in range(count):
        t, v, _ = returned(m, t, v)
        other_t, other_v, _ = returned(m, other_t, other_v)
        if math.isnan(t) or math.isnan(other_t):
            return math.nan
        t -= math.floor(t)
        turn = other_t - t
        turn -= math.floor(turn + 0.5)
        size = math.hypot(turn, other_v - v)
        if size == 0.0:
            size = 1e-3 * small
        total += math.log(size / small)
        other_t, other_v = t + turn * small / size, v + (other_v - v) * small / size
    return total / count
