"""Motion in arcs, in the play or on a flank: its events and their linearisation.

The linearisation at a bound x = b: a motion that is (x, w) off the one that meets the
bound at a speed W and an acceleration A meets it -x / W later, and at a speed by
w - A x / W faster (discontinuity mapping; M. di Bernardo et al., Piecewise-smooth
Dynamical Systems (2008), section 2.5).
"""

from __future__ import annotations

import math

from lumped.common.compiled import compiled, inlined
from lumped.rattle.kernels.flight import (
    apply_contact,
    forced_state,
    free_acceleration,
    free_flight,
)

START_TIME, START_SPEED, END_TIME, END_SPEED, START_SIDE, END_SIDE, ON_FLANK = range(
    7
)  # columns of arcs
N_COLUMNS = 7
# Of a turn, or an oscillation on a flank, where turning points are sought
SAMPLES_PER_TURN = 48
MAX_HALVINGS = 60
MAX_CORRECTIONS = 30
NEWTON_TOL = 1e-11  # largest last correction
MAX_TIME_CORRECTION = 0.1  # turns of a correction, at most


@compiled
def trace_arcs(m, t, v, count, arcs):
    """The arcs (a, 7) of so many returns after a departure, and their number.

    Their columns: time and speed at the start and at the end, the side where they
    start and where they end, and 1 for those on a flank. An impact turns speeds round
    between one arc and the next. The row after the last has the start of the next one.
    0 where the flanks stay together, or where more arcs come than there is room for.
    """
    w, side, n_arcs = -v, 1, 0
    while count > 0:
        if n_arcs + 3 > arcs.shape[0]:
            return 0
        end, last, end_side = free_flight(m, t, side * m.play, w)
        if not math.isfinite(end):
            return 0
        departure, departure_speed = apply_contact(m, end, last, end_side)
        if not math.isfinite(departure):
            return 0
        _set_arc(arcs[n_arcs], t, w, end, last, side, end_side, 0.0)
        n_arcs += 1
        if m.stiffness < math.inf:
            _set_arc(
                arcs[n_arcs],
                end,
                last,
                departure,
                departure_speed,
                end_side,
                end_side,
                1.0,
            )
            n_arcs += 1
        t, w, side = departure, departure_speed, end_side
        if end_side > 0:
            count -= 1
    arcs[n_arcs, START_TIME], arcs[n_arcs, START_SPEED] = t, w
    return n_arcs


@inlined
def _set_arc(arc, start, speed, end, last, side, to, pressed):
    arc[START_TIME], arc[START_SPEED], arc[END_TIME], arc[END_SPEED] = (
        start,
        speed,
        end,
        last,
    )
    arc[START_SIDE], arc[END_SIDE], arc[ON_FLANK] = side, to, pressed


@inlined
def fundamental(m, pressed, tau):
    """What a change of place and one of speed become after a time, as (2, 2)."""
    if pressed == 0.0:
        decay = math.expm1(-m.damping * tau)
        return 1.0, -decay / m.damping, 0.0, 1.0 + decay
    half = 0.5 * m.damping
    turn = math.sqrt(m.stiffness - half * half)
    decay = math.exp(-half * tau)
    c, s = decay * math.cos(turn * tau), decay * math.sin(turn * tau) / turn
    return c + half * s, s, -m.stiffness * s, c - half * s


@inlined
def arc_state(m, pressed, side, t, w, end):
    """Place and speed at a time, of an arc that starts at a bound."""
    if pressed == 0.0:
        first, first_rate = forced_state(m.order, m.free, t)
        value, rate = forced_state(m.order, m.free, end)
        loss = w - m.drift - first_rate
        fade = math.expm1(-m.damping * (end - t))
        x = side * m.play + m.drift * (end - t) + value - first
        return x - loss * fade / m.damping, m.drift + rate + loss * (1.0 + fade)
    first, first_rate = forced_state(m.order, m.pressed, t)
    value, rate = forced_state(m.order, m.pressed, end)
    a, b, c, d = fundamental(m, pressed, end - t)
    x, speed = -m.offset - first, w - first_rate
    place = side * m.play + m.offset + value + a * x + b * speed
    return place, rate + c * x + d * speed


@inlined
def propagate_change(m, arc, dt, dw):
    """What a change of time and speed at the start of an arc becomes at its end."""
    t, w, end, last, pressed = (
        arc[START_TIME],
        arc[START_SPEED],
        arc[END_TIME],
        arc[END_SPEED],
        arc[ON_FLANK],
    )
    a, b, c, d = fundamental(m, pressed, end - t)
    x, speed = -w * dt, dw - (free_acceleration(m, t) - m.damping * w) * dt
    delay = -(a * x + b * speed) / last
    return delay, c * x + d * speed + (
        free_acceleration(m, end) - m.damping * last
    ) * delay


@compiled
def linearise(m, arcs, n_arcs, out):
    """What a change of a departure's time and speed becomes over arcs (2, 2)."""
    for k in range(2):
        dt, dw = (1.0, 0.0) if k == 0 else (0.0, -1.0)
        for i in range(n_arcs):
            dt, dw = propagate_change(m, arcs[i], dt, dw)
            if m.stiffness == math.inf:
                dw *= -m.restitution
                if i + 1 < n_arcs and arcs[i + 1, START_TIME] > arcs[i, END_TIME]:
                    dt, dw = 0.0, 0.0  # flanks that have come to rest forget
        out[0, k], out[1, k] = dt, -dw


@compiled
def find_periodic_point(m, t, v, count, min_speed, max_speed_correction, arcs, change):
    """The departure near one that repeats after so many returns, by Newton's method.

    min_speed : speed of departures below which it is given up
    max_speed_correction : of steps of the speed; times change by MAX_TIME_CORRECTION
    arcs (a, 7), change (2, 2) : are overwritten
    NaN where there is none.
    """
    for _ in range(MAX_CORRECTIONS):
        n_arcs = trace_arcs(m, t, v, count, arcs) if v >= min_speed else 0
        if n_arcs == 0:
            break
        linearise(m, arcs, n_arcs, change)
        time_error, speed_error = (
            arcs[n_arcs, START_TIME] - t,
            -arcs[n_arcs, START_SPEED] - v,
        )
        time_error -= math.floor(time_error + 0.5)
        a, b = change[0, 0] - 1.0, change[0, 1]
        c, d = change[1, 0], change[1, 1] - 1.0
        determinant = a * d - b * c
        dt, dv = (
            (d * time_error - b * speed_error) / determinant,
            (a * speed_error - c * time_error) / determinant,
        )
        # far from an orbit the map bends too much for a whole step
        size = max(abs(dt) / MAX_TIME_CORRECTION, abs(dv) / max_speed_correction)
        if not size < math.inf:
            break
        fraction = 1.0 / max(1.0, size)
        t, v = t - fraction * dt, v - fraction * dv
        if max(abs(dt), abs(dv)) < NEWTON_TOL:
            return t, v
    return math.nan, math.nan


@compiled
def join_residual(m, turns, sides, pressed, starts, closing_sign, errors, jacobian):
    """How far arcs (a,) with starts (2, a), times and speeds, miss to join an orbit.

    errors (2 a,) : of place and of speed at the end of each arc
    by_x (2 a, 2 a) : by the times, then the speeds; its determinant is zero where a
        multiplier is 1, or -1 if changes come back turned round
    closing_sign : 1, or -1 so that they do
    """
    times, speeds = starts[0], starts[1]
    a = times.size
    jacobian[:] = 0.0
    for i in range(a):
        j = (i + 1) % a
        t, w = times[i], speeds[i]
        end = times[j] + (turns if j == 0 else 0.0)
        place, speed = arc_state(m, pressed[i], sides[i], t, w, end)
        one, two, three, four = fundamental(m, pressed[i], end - t)
        start = free_acceleration(m, t) - m.damping * w
        force = free_acceleration(m, end) - m.damping * speed
        if pressed[i] != 0.0:
            force -= m.stiffness * (place - sides[i] * m.play)
        impact_factor = -m.restitution if m.stiffness == math.inf else 1.0
        errors[i] = place - sides[j] * m.play
        errors[a + i] = impact_factor * speed - speeds[j]
        jacobian[i, i] -= one * w + two * start
        jacobian[i, a + i] += two
        sign = closing_sign if j == 0 else 1.0
        jacobian[i, j] += sign * speed
        jacobian[a + i, i] -= impact_factor * (three * w + four * start)
        jacobian[a + i, a + i] += impact_factor * four
        jacobian[a + i, j] += sign * impact_factor * force
        jacobian[a + i, a + j] -= sign


@inlined
def turning_point(m, arc, low, high):
    """Place where an arc that turns between two times does so."""
    pressed, side, t, w = (
        arc[ON_FLANK],
        arc[START_SIDE],
        arc[START_TIME],
        arc[START_SPEED],
    )
    _, first = arc_state(m, pressed, side, t, w, low)
    for _ in range(MAX_HALVINGS):
        middle = 0.5 * (low + high)
        _, speed = arc_state(m, pressed, side, t, w, middle)
        if speed * first > 0.0:
            low = middle
        else:
            high = middle
    return arc_state(m, pressed, side, t, w, low)[0]


@inlined
def clearance(m, arc):
    """Least distance [rad] that an arc keeps from bounds at its turning points."""
    least, pressed, side = math.inf, arc[ON_FLANK], arc[START_SIDE]
    t, w, duration = arc[START_TIME], arc[START_SPEED], arc[END_TIME] - arc[START_TIME]
    frequency = max(1.0, m.order) if m.free[2] != 0.0 or m.free[3] != 0.0 else 1.0
    if pressed != 0.0:
        frequency = max(frequency, math.sqrt(m.stiffness) / (2.0 * math.pi))
    count = int(SAMPLES_PER_TURN * frequency * duration) + SAMPLES_PER_TURN
    before, speed_before = t, w
    for k in range(1, count):
        time = t + duration * k / count
        _, speed = arc_state(m, pressed, side, t, w, time)
        if speed * speed_before < 0.0:
            x = turning_point(m, arc, before, time)
            peak = 1.0 if speed_before > 0.0 else -1.0
            if pressed == 0.0:
                least = min(least, m.play - peak * x)
            elif peak != side:
                least = min(least, side * x - m.play)
        before, speed_before = time, speed
    return least


@compiled
def min_clearance(m, arcs):
    """Least distance [rad] that arcs (a, 7) keep from bounds between their ends.

    Negative where an arc passes a bound without an event, or leaves a flank before
    its end; inf where nothing comes close.
    """
    least = math.inf
    for i in range(arcs.shape[0]):
        least = min(least, clearance(m, arcs[i]))
    return least


@compiled
def sample_arcs(m, arcs, count, out):
    """Time and place (a count, 2) at so many instants of each of arcs (a, 7)."""
    for i in range(arcs.shape[0]):
        t, w, duration = (
            arcs[i, START_TIME],
            arcs[i, START_SPEED],
            arcs[i, END_TIME] - arcs[i, START_TIME],
        )
        side, pressed = arcs[i, START_SIDE], arcs[i, ON_FLANK]
        for k in range(count):
            time = t + duration * k / count
            out[i * count + k, 0] = time
            out[i * count + k, 1] = arc_state(m, pressed, side, t, w, time)[0]
