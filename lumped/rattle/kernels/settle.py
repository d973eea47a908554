"""Where departures from the upper flank lead: return maps iterated, compiled.

Many cells fly in lanes beside each other, a step of all at a time, which the compiler
makes steps of several at once.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled, inlined
from lumped.rattle.kernels.arrays import SHORT
from lumped.rattle.kernels.flight import (
    AGAIN,
    LOST,
    MAX_STEPS,
    REST,
    advance,
    apply_contact,
    first_step,
    free_flight,
    liftoff_time,
    return_map,
    start_state,
)

MAP_POINT_TOL = 1e-9  # turns, and of a speed: departures that are one
ROUNDOFF_DISTANCE = 1e-13  # the same to round-off
ANCHORED = 32  # returns, at least, after which departures are compared with another one
MIN_VIBRATION, CHANGING, UNKNOWN, STICKING = -1, 0, -2, -3  # in place of a period
LANES = 32
# where the lanes' values of each kind begin, see `advance`
KINDS = 11
PLACE, SPEED, PULL, JERK, TRANSIENT, VALUE, HORIZON, TIME, SIDE, STATE, LEFT = range(
    0, KINDS * LANES, LANES
)
CELL = np.dtype(
    [
        ("number", np.int64),
        ("returns", np.int64),
        ("most", np.int64),  # returns after which it ends
        ("lower", np.int64),  # times the lower flank was met since the departure
        ("turns", np.float64),  # whole ones up to the lane's time
        ("before", np.float64),  # time of the departure
        ("period", np.int64),
        ("clear", np.int64),
        # a former departure, after how many returns, and when it is replaced
        ("anchor", np.float64),
        ("anchor_t", np.float64),  # the same from 0 to 1
        ("anchor_v", np.float64),
        ("anchored", np.int64),
        ("renewed", np.int64),
        ("gap", np.float64),  # to it, when departures came close to it
        # a former release from rest, how many there were, and when it is replaced
        ("release", np.float64),  # its time, from 0 to 1
        ("upper", np.float64),  # flank that it leaves, 1 or -1
        ("releases", np.int64),
        ("replaced", np.int64),
    ],
    align=True,
)


@inlined
def distance(t, v, other_t, other_v):
    """Distance of two departures."""
    turn = t - other_t
    return abs(turn - math.floor(turn + 0.5)) + abs(v - other_v) / (1.0 + v)


@inlined
def depart(cell, number, t, v, most):
    """A cell before its first return."""
    cell.number, cell.returns, cell.most, cell.lower = number, 0, most, 0
    cell.turns, cell.before, cell.anchor = 0.0, t, t
    cell.period, cell.clear = CHANGING, most
    cell.anchor_t, cell.anchor_v, cell.anchored, cell.renewed = t, v, 0, ANCHORED
    cell.gap = math.inf
    cell.release, cell.upper, cell.releases, cell.replaced = math.nan, 1.0, 0, 1


@inlined
def release(cell, t, upper):
    """Flanks that were at rest on each other part at a time from 0 to 1.

    What follows depends on that time and the flank, 1 or -1, alone: the same release
    again ends the search, and departures are not compared with any before it.
    """
    cell.releases += 1
    if cell.period != CHANGING:
        return
    turn = t - cell.release
    if upper == cell.upper and abs(turn - math.floor(turn + 0.5)) < MAP_POINT_TOL:
        cell.period, cell.clear = STICKING, cell.returns + int(upper > 0.0)
    elif cell.releases >= cell.replaced:
        cell.release, cell.upper = t, upper
        cell.replaced = 2 * cell.releases
    cell.anchor_t, cell.gap = math.nan, math.inf
    cell.renewed = cell.returns + ANCHORED


@inlined
def record_return(m, cell, t, v, early):
    """A return of a cell at a time from 0 to 1; whether it was the last.

    early : stop where it is clear what the cell leads to; what is found is the same
    """
    cell.returns += 1
    i, now = cell.returns, cell.turns + t
    lasted, passed = now - cell.before, cell.lower > 0
    cell.before, cell.lower = now, 0
    if cell.period == MIN_VIBRATION and (passed or lasted > SHORT):
        cell.period = UNKNOWN  # never seen
    if cell.period == CHANGING and not passed and lasted < m.short:
        cell.period, cell.clear = MIN_VIBRATION, i
        cell.most = i if early else cell.most
    if cell.period == CHANGING:
        gap = distance(t, v, cell.anchor_t, cell.anchor_v)
        same = gap < MAP_POINT_TOL and now - cell.anchor > 0.5
        closing = gap <= cell.gap or gap < ROUNDOFF_DISTANCE
        if same and closing and cell.gap < math.inf:
            # twice in a row, and no further apart: departures close in on an orbit
            cell.period, cell.clear = i - cell.anchored, i
            if early:
                cell.most = i + (cell.most - i) % cell.period
        elif same or i >= cell.renewed:
            cell.gap = gap if same else math.inf
            later = i - cell.anchored if same else max(ANCHORED, i // 4)
            cell.anchor, cell.anchor_t, cell.anchor_v, cell.anchored = now, t, v, i
            cell.renewed = i + later
    return i >= cell.most


@inlined
def put(lanes, i, flight):
    """Put a flight into a lane before its first step; see `start_state`."""
    x, w, a, jerk, transient, value, horizon = flight
    lanes[PLACE + i], lanes[SPEED + i], lanes[PULL + i] = x, w, a
    lanes[JERK + i], lanes[TRANSIENT + i], lanes[VALUE + i] = jerk, transient, value
    lanes[HORIZON + i], lanes[STATE + i], lanes[LEFT + i] = horizon, AGAIN, MAX_STEPS


@inlined
def start_flight(m, lanes, i, t, x, w):
    """Begin a flight in a lane."""
    rippled = m.free[2] != 0.0 or m.free[3] != 0.0
    lanes[TIME + i] = t
    put(lanes, i, start_state(m, t, x, w, rippled))


@inlined
def restart(m, lanes, i, x, w):
    """Begin a flight in a lane at the impact that ended another: all but what depends
    on the speed is known."""
    slower = lanes[SPEED + i] - w
    a = lanes[PULL + i] + m.damping * slower
    jerk = lanes[JERK + i] - m.damping * m.damping * slower
    transient, value = lanes[TRANSIENT + i] + slower, lanes[VALUE + i]
    first = first_step(m, w, a, transient)
    put(lanes, i, (x, w, a, jerk, transient, value, first))


@inlined
def advance_all(m, lanes, count, rippled):
    """A step of the flights of all lanes."""
    for i in range(count):
        flight = (
            lanes[PLACE + i],
            lanes[SPEED + i],
            lanes[PULL + i],
            lanes[JERK + i],
            lanes[TRANSIENT + i],
            lanes[VALUE + i],
            lanes[HORIZON + i],
        )
        t, flight, side, state = advance(m, lanes[TIME + i], flight, rippled)
        left = lanes[LEFT + i] - 1.0
        lanes[PLACE + i] = flight[0]
        lanes[SPEED + i] = flight[1]
        lanes[PULL + i] = flight[2]
        lanes[JERK + i] = flight[3]
        lanes[TRANSIENT + i] = flight[4]
        lanes[VALUE + i] = flight[5]
        lanes[HORIZON + i] = flight[6]
        lanes[TIME + i], lanes[SIDE + i], lanes[LEFT + i] = t, side, left
        lanes[STATE + i] = LOST if state == AGAIN and left <= 0.0 else state


@inlined
def process_event(m, lanes, i, cell, early):
    """Let the flight of a lane end and the next begin; whether its cell is finished."""
    t, w, up = lanes[TIME + i], lanes[SPEED + i], lanes[SIDE + i] > 0.0
    after = math.inf
    if lanes[STATE + i] != LOST and math.isfinite(w):
        after, w = apply_contact(m, t, w, 1 if up else -1)
    if not math.isfinite(after):
        cell.returns += 1
        cell.clear = cell.returns
        cell.period = MIN_VIBRATION if math.isnan(after) else UNKNOWN
        return True
    x, whole = m.play if up else -m.play, math.floor(after)
    cell.turns += whole
    if after == t:
        restart(m, lanes, i, x, w)
        lanes[TIME + i] = t - whole
    else:
        start_flight(m, lanes, i, after - whole, x, w)
        if m.stiffness == math.inf:
            release(cell, after - whole, lanes[SIDE + i])
    last = False
    if up:
        last = record_return(m, cell, after - whole, -w, early)
    else:
        cell.lower += 1
    return last or (early and cell.period == STICKING)


@compiled
def settle_cells(m, times, speeds, most, early, outcomes, end):
    """What departures (c,) belong to, and the departure after `most` returns.

    outcomes (c, 2) : the period in returns, QUIET where the flanks stay together or
        flights fade away, STICKING where they come to rest on each other again and
        again, CHANGING else, UNKNOWN where an event is not found; and the returns until
        that was clear
    end (c, 2) : its time, from 0 to 1, and speed; of STICKING a release from rest
    early : stop where it is clear; what is found is the same
    """
    rippled = m.free[2] != 0.0 or m.free[3] != 0.0
    lanes, cells = np.empty(KINDS * LANES), np.empty(LANES, CELL)
    taken = count = min(LANES, times.size)
    for i in range(count):
        depart(cells[i], i, times[i], speeds[i], most)
        start_flight(m, lanes, i, times[i], m.play, -speeds[i])
    while count > 0:
        if rippled:
            advance_all(m, lanes, count, True)
        else:
            advance_all(m, lanes, count, False)
        for i in range(count - 1, -1, -1):
            if lanes[STATE + i] == AGAIN or not process_event(
                m, lanes, i, cells[i], early
            ):
                continue
            number = cells[i].number
            outcomes[number, 0], outcomes[number, 1] = cells[i].period, cells[i].clear
            end[number, 0], end[number, 1] = lanes[TIME + i], -lanes[SPEED + i]
            if cells[i].period == STICKING:
                end[number, 0], end[number, 1] = cells[i].release, cells[i].upper * REST
            if taken < times.size:
                depart(cells[i], taken, times[taken], speeds[taken], most)
                start_flight(m, lanes, i, times[taken], m.play, -speeds[taken])
                taken += 1
                continue
            count -= 1  # the last lane takes this one's place
            cells[i] = cells[count]
            for k in range(KINDS):
                lanes[k * LANES + i] = lanes[k * LANES + count]


@compiled
def iterate_map(m, t, v, count, out):
    """Departures (count, 3): time, speed, and how often the lower flank was met.

    out : NaN from where the flanks stay together, or where it is not clear what follows
    """
    for i in range(count):
        out[i, 0], out[i, 1] = t, v
        t, v, lower = return_map(m, t, v)
        out[i, 2] = lower
        if not math.isfinite(t):
            break


@compiled
def release_of(m, t, side):
    """Time, see `liftoff_time`, and speed at which flanks at rest are released."""
    return liftoff_time(m, t, side), side * REST


@compiled
def next_release(m, t, v, most):
    """Time and speed of the next release from rest after a departure.

    Speeds are those from the flank that is left, negative from the lower one. The time
    is NaN where the flanks stay together, inf where none is found in `most` meetings.
    """
    w, side = -v, -1 if v < 0.0 else 1
    for _ in range(most):
        met, w, side = free_flight(m, t, side * m.play, w)
        if not math.isfinite(met):
            return met, 0.0
        t, w = apply_contact(m, met, w, side)
        if not math.isfinite(t):
            return t, 0.0
        if t > met and m.stiffness == math.inf:
            return t, -w
    return math.inf, 0.0


@compiled
def lyapunov_exponent(m, t, v, count, small):
    """Largest Lyapunov exponent per return, of a neighbour kept at a distance `small`.

    NaN where the flanks stay together, or where it is not clear what follows.
    """
    other_t, other_v, total = t, v + small, 0.0
    for _ in range(count):
        t, v, _ = return_map(m, t, v)
        other_t, other_v, _ = return_map(m, other_t, other_v)
        if not (math.isfinite(t) and math.isfinite(other_t)):
            return math.nan
        whole = math.floor(t)
        t -= whole
        turn = other_t - whole - t
        turn -= math.floor(turn + 0.5)
        size = math.hypot(turn, other_v - v)
        if size == 0.0:
            size = 1e-3 * small
        total += math.log(size / small)
        other_t, other_v = t + turn * small / size, v + (other_v - v) * small / size
    return total / count
