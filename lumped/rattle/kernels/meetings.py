"""Meetings of the flanks in a run, compiled."""

from __future__ import annotations

import math

from lumped.common.compiled import compiled
from lumped.rattle.kernels.flight import apply_contact, free_flight
from lumped.rattle.kernels.settle import DEPARTURE_TOL, STICKING

MAX_IMPACTS = 10_000  # per turn


@compiled
def sum_impacts(m, starts, periods, turns, sums):
    """Sum of squared impact speeds and number of impacts (n, 2) of runs from departures
    (n, 2), from each start to the first impact after `turns`, both over that time; NaN
    where it is not known what follows, or impacts are too frequent.

    periods (n,) : in departures from the upper flank, of runs that repeat, which are
        measured over whole ones, as those from one release to the same are, which have
        STICKING in its place; else 0 or less
    Speeds below 0 are those of departures from the lower flank.
    Flanks in contact have no impacts; decaying ones do not count.
    """
    for i in range(starts.shape[0]):
        begin = starts[i, 0]
        t, w, side = begin, -starts[i, 1], -1 if starts[i, 1] < 0.0 else 1
        period, sticks = periods[i], periods[i] == STICKING
        total, count, returns, is_complete = 0.0, 0, 0, period <= 0 and not sticks
        while (t - begin < turns or not is_complete) and count < MAX_IMPACTS * turns:
            start_side, start = side, t
            t, w, side = free_flight(m, t, side * m.play, w)
            if not math.isfinite(t):
                break
            if start_side > 0 and side > 0 and t - start < m.decaying_flight:
                t = math.nan  # they fade away
                break
            total += w * w
            count += 1
            met = t
            t, w = apply_contact(m, t, w, side)
            if period > 0:
                returns += side > 0
                is_complete = side > 0 and returns % period == 0
            elif sticks:
                turn = t - begin
                is_complete = (
                    t > met and abs(turn - math.floor(turn + 0.5)) < DEPARTURE_TOL
                )
        duration = turns if math.isnan(t) else t - begin
        sums[i, 0], sums[i, 1] = total / duration, count / duration
        if t == math.inf or duration < turns:
            sums[i, 0], sums[i, 1] = math.nan, math.nan
