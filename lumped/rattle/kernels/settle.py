"""Where departures from the upper flank lead: return maps iterated, compiled.

Many cells fly in lanes beside each other, a step of all at a time, which the compiler
makes steps of several at once.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled, inlined
from lumped.rattle.kernels.flight import (
    MAX_RESTING_SPEED,
    MAX_STEPS,
    NOT_FOUND,
    SEARCHING,
    advance,
    apply_contact,
    first_step,
    free_flight,
    liftoff_time,
    return_map,
    start_state,
)
from lumped.rattle.kernels.records import MAX_DECAYING_FLIGHT

DEPARTURE_TOL = 1e-9  # turns, and of a speed: departures that are one
ROUNDOFF_DISTANCE = 1e-13  # the same to round-off
# Returns, at least, after which departures are compared with another one
MIN_ANCHOR_RETURNS = 32
PERMANENT_CONTACT, CHANGING, UNKNOWN, STICKING = -1, 0, -2, -3  # in place of a period
LANES = 32
# where the lanes' values of each kind begin, see `advance`
N_LANE_VALUES = 11
(
    POSITION,
    SPEED,
    ACCELERATION,
    JERK,
    TRANSIENT,
    FORCED,
    HORIZON,
    TIME,
    SIDE,
    STATE,
    STEPS_LEFT,
) = range(0, N_LANE_VALUES * LANES, LANES)
CELL = np.dtype(
    [
        ("number", np.int64),
        ("returns", np.int64),
        ("max_returns", np.int64),  # returns after which it ends
        (
            "lower_impacts",
            np.int64,
        ),  # times the lower flank was met since the departure
        ("turns", np.float64),  # whole ones up to the lane's time
        ("departure", np.float64),  # time of the departure
        ("period", np.int64),
        ("decided_after", np.int64),
        # a former departure, after how many returns, and when it is replaced
        ("anchor", np.float64),
        ("anchor_t", np.float64),  # the same from 0 to 1
        ("anchor_v", np.float64),
        ("anchor_return", np.int64),
        ("anchor_renewal", np.int64),
        ("gap", np.float64),  # to it, when departures came close to it
        # a former release from rest, how many there were, and when it is replaced
        ("release", np.float64),  # its time, from 0 to 1
        ("release_side", np.float64),  # flank that it leaves, 1 or -1
        ("releases", np.int64),
        ("release_renewal", np.int64),
    ],
    align=True,
)


@inlined
def distance(t, v, other_t, other_v):
    """Distance of two departures."""
    turn = t - other_t
    return abs(turn - math.floor(turn + 0.5)) + abs(v - other_v) / (1.0 + v)


@inlined
def start_cell(cell, number, t, v, max_returns):
    """A cell before its first return."""
    cell.number, cell.returns, cell.max_returns, cell.lower_impacts = (
        number,
        0,
        max_returns,
        0,
    )
    cell.turns, cell.departure, cell.anchor = 0.0, t, t
    cell.period, cell.decided_after = CHANGING, max_returns
    cell.anchor_t, cell.anchor_v, cell.anchor_return, cell.anchor_renewal = (
        t,
        v,
        0,
        MIN_ANCHOR_RETURNS,
    )
    cell.gap = math.inf
    cell.release, cell.release_side, cell.releases, cell.release_renewal = (
        math.nan,
        1.0,
        0,
        1,
    )


@inlined
def record_release(cell, t, side):
    """Flanks that were at rest on each other part at a time from 0 to 1.

    What follows depends on that time and the flank, 1 or -1, alone: the same release
    again ends the search, and departures are not compared with any before it.
    """
    cell.releases += 1
    if cell.period != CHANGING:
        return
    turn = t - cell.release
    if side == cell.release_side and abs(turn - math.floor(turn + 0.5)) < DEPARTURE_TOL:
        cell.period, cell.decided_after = STICKING, cell.returns + int(side > 0.0)
    elif cell.releases >= cell.release_renewal:
        cell.release, cell.release_side = t, side
        cell.release_renewal = 2 * cell.releases
    cell.anchor_t, cell.gap = math.nan, math.inf
    cell.anchor_renewal = cell.returns + MIN_ANCHOR_RETURNS


@inlined
def record_return(m, cell, t, v, stop_early):
    """A return of a cell at a time from 0 to 1; whether it was the last.

    stop_early : stop where it is clear what the cell leads to, with the same outcome
    """
    cell.returns += 1
    i, time = cell.returns, cell.turns + t
    duration, met_lower = time - cell.departure, cell.lower_impacts > 0
    cell.departure, cell.lower_impacts = time, 0
    if cell.period == PERMANENT_CONTACT and (
        met_lower or duration > MAX_DECAYING_FLIGHT
    ):
        cell.period = UNKNOWN  # never seen
    if cell.period == CHANGING and not met_lower and duration < m.decaying_flight:
        cell.period, cell.decided_after = PERMANENT_CONTACT, i
        cell.max_returns = i if stop_early else cell.max_returns
    if cell.period == CHANGING:
        gap = distance(t, v, cell.anchor_t, cell.anchor_v)
        same = gap < DEPARTURE_TOL and time - cell.anchor > 0.5
        closing = gap <= cell.gap or gap < ROUNDOFF_DISTANCE
        if same and closing and cell.gap < math.inf:
            # twice in a row, and no further apart: departures close in on an orbit
            cell.period, cell.decided_after = i - cell.anchor_return, i
            if stop_early:
                cell.max_returns = i + (cell.max_returns - i) % cell.period
        elif same or i >= cell.anchor_renewal:
            cell.gap = gap if same else math.inf
            wait = i - cell.anchor_return if same else max(MIN_ANCHOR_RETURNS, i // 4)
            cell.anchor, cell.anchor_t, cell.anchor_v, cell.anchor_return = (
                time,
                t,
                v,
                i,
            )
            cell.anchor_renewal = i + wait
    return i >= cell.max_returns


@inlined
def set_flight(lanes, i, flight):
    """Put a flight into a lane before its first step; see `start_state`."""
    x, w, a, jerk, transient, value, horizon = flight
    lanes[POSITION + i], lanes[SPEED + i], lanes[ACCELERATION + i] = x, w, a
    lanes[JERK + i], lanes[TRANSIENT + i], lanes[FORCED + i] = jerk, transient, value
    lanes[HORIZON + i], lanes[STATE + i], lanes[STEPS_LEFT + i] = (
        horizon,
        SEARCHING,
        MAX_STEPS,
    )


@inlined
def start_flight(m, lanes, i, t, x, w):
    """Begin a flight in a lane."""
    rippled = m.free[2] != 0.0 or m.free[3] != 0.0
    lanes[TIME + i] = t
    set_flight(lanes, i, start_state(m, t, x, w, rippled))


@inlined
def restart_flight(m, lanes, i, x, w):
    """Begin a flight in a lane at the impact that ended another: all but what depends
    on the speed is known."""
    slower = lanes[SPEED + i] - w
    a = lanes[ACCELERATION + i] + m.damping * slower
    jerk = lanes[JERK + i] - m.damping * m.damping * slower
    transient, value = lanes[TRANSIENT + i] + slower, lanes[FORCED + i]
    first = first_step(m, w, a, transient)
    set_flight(lanes, i, (x, w, a, jerk, transient, value, first))


@inlined
def advance_all(m, lanes, count, rippled):
    """A step of the flights of all lanes."""
    for i in range(count):
        flight = (
            lanes[POSITION + i],
            lanes[SPEED + i],
            lanes[ACCELERATION + i],
            lanes[JERK + i],
            lanes[TRANSIENT + i],
            lanes[FORCED + i],
            lanes[HORIZON + i],
        )
        t, flight, side, state = advance(m, lanes[TIME + i], flight, rippled)
        left = lanes[STEPS_LEFT + i] - 1.0
        lanes[POSITION + i] = flight[0]
        lanes[SPEED + i] = flight[1]
        lanes[ACCELERATION + i] = flight[2]
        lanes[JERK + i] = flight[3]
        lanes[TRANSIENT + i] = flight[4]
        lanes[FORCED + i] = flight[5]
        lanes[HORIZON + i] = flight[6]
        lanes[TIME + i], lanes[SIDE + i], lanes[STEPS_LEFT + i] = t, side, left
        lanes[STATE + i] = NOT_FOUND if state == SEARCHING and left <= 0.0 else state


@inlined
def process_event(m, lanes, i, cell, stop_early):
    """Let the flight of a lane end and the next begin; whether its cell is finished."""
    t, w, up = lanes[TIME + i], lanes[SPEED + i], lanes[SIDE + i] > 0.0
    departure = math.inf
    if lanes[STATE + i] != NOT_FOUND and math.isfinite(w):
        departure, w = apply_contact(m, t, w, 1 if up else -1)
    if not math.isfinite(departure):
        cell.returns += 1
        cell.decided_after = cell.returns
        cell.period = PERMANENT_CONTACT if math.isnan(departure) else UNKNOWN
        return True
    x, whole = m.play if up else -m.play, math.floor(departure)
    cell.turns += whole
    if departure == t:
        restart_flight(m, lanes, i, x, w)
        lanes[TIME + i] = t - whole
    else:
        start_flight(m, lanes, i, departure - whole, x, w)
        if m.stiffness == math.inf:
            record_release(cell, departure - whole, lanes[SIDE + i])
    last = False
    if up:
        last = record_return(m, cell, departure - whole, -w, stop_early)
    else:
        cell.lower_impacts += 1
    return last or (stop_early and cell.period == STICKING)


@compiled
def settle_cells(m, times, speeds, max_returns, stop_early, outcomes, end):
    """What departures (c,) belong to, and the departure after `max_returns` returns.

    outcomes (c, 2) : the period in returns, PERMANENT_CONTACT where the flanks stay
        together or flights decay, STICKING where they come to rest on each other
        repeatedly, CHANGING else, UNKNOWN where an event is not found; and the returns
        until that was clear
    end (c, 2) : its time, from 0 to 1, and speed; of STICKING a release from rest
    stop_early : stop where it is clear; what is found is the same
    """
    rippled = m.free[2] != 0.0 or m.free[3] != 0.0
    lanes, cells = np.empty(N_LANE_VALUES * LANES), np.empty(LANES, CELL)
    started = count = min(LANES, times.size)
    for i in range(count):
        start_cell(cells[i], i, times[i], speeds[i], max_returns)
        start_flight(m, lanes, i, times[i], m.play, -speeds[i])
    while count > 0:
        if rippled:
            advance_all(m, lanes, count, True)
        else:
            advance_all(m, lanes, count, False)
        for i in range(count - 1, -1, -1):
            if lanes[STATE + i] == SEARCHING or not process_event(
                m, lanes, i, cells[i], stop_early
            ):
                continue
            number = cells[i].number
            outcomes[number, 0], outcomes[number, 1] = (
                cells[i].period,
                cells[i].decided_after,
            )
            end[number, 0], end[number, 1] = lanes[TIME + i], -lanes[SPEED + i]
            if cells[i].period == STICKING:
                end[number, 0], end[number, 1] = (
                    cells[i].release,
                    cells[i].release_side * MAX_RESTING_SPEED,
                )
            if started < times.size:
                start_cell(
                    cells[i], started, times[started], speeds[started], max_returns
                )
                start_flight(m, lanes, i, times[started], m.play, -speeds[started])
                started += 1
                continue
            count -= 1  # the last lane takes this one's place
            cells[i] = cells[count]
            for k in range(N_LANE_VALUES):
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
def release_departure(m, t, side):
    """Time, see `liftoff_time`, and speed at which flanks at rest are released."""
    return liftoff_time(m, t, side), side * MAX_RESTING_SPEED


@compiled
def next_release(m, t, v, max_impacts):
    """Time and speed of the next release from rest after a departure.

    Speeds are those from the flank that is left, negative from the lower one. The time
    is NaN where the flanks stay together, inf where none is found in `max_impacts`.
    """
    w, side = -v, -1 if v < 0.0 else 1
    for _ in range(max_impacts):
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
def lyapunov_exponent(m, t, v, count, separation):
    """Largest Lyapunov exponent per return, of a neighbour kept at a distance.

    NaN where the flanks stay together, or where it is not clear what follows.
    """
    other_t, other_v, total = t, v + separation, 0.0
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
            size = 1e-3 * separation
        total += math.log(size / separation)
        other_t, other_v = (
            t + turn * separation / size,
            v + (other_v - v) * separation / size,
        )
    return total / count
