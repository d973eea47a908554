"""Motion between the flanks and on them in closed form, event by event, compiled.

The first crossing of a bound is found by steps that cannot pass it. With speed w and
acceleration a toward a bound at a distance d, and a third derivative of J at most, a
step h with w h + a h^2 / 2 + J h^3 / 6 <= d is short of it. Near a crossing such steps
converge faster than Newton's.
"""

from __future__ import annotations

import math

from lumped.compiled import compiled, inlined

TURN = 2.0 * math.pi
LONG = 0.5  # turns of a first step, at most
CLOSE = 1e-14  # turns: a step so short ends a search
MOST_STEPS = 10_000  # of a search
REST = 1e-9  # rad per turn: slower flanks rest on each other


@inlined
def forced(order, part, t):
    """A forced part at a time and its rate."""
    c, s = math.cos(TURN * t), math.sin(TURN * t)
    value = part[0] * c + part[1] * s
    rate = TURN * (part[1] * c - part[0] * s)
    if part[2] != 0.0 or part[3] != 0.0:
        angle = TURN * order * t
        c, s = math.cos(angle), math.sin(angle)
        value += part[2] * c + part[3] * s
        rate += TURN * order * (part[3] * c - part[2] * s)
    return value, rate


@inlined
def bent(order, part, value, t):
    """Second derivative of a forced part, turned round, from its value."""
    found = TURN * TURN * value
    if part[2] != 0.0 or part[3] != 0.0:
        angle = TURN * order * t
        fast = part[2] * math.cos(angle) + part[3] * math.sin(angle)
        found += TURN * TURN * (order * order - 1.0) * fast
    return found


@inlined
def reach(distance, speed, bend):
    """Shortest time to a bound ahead under a constant acceleration; inf if never."""
    square = speed * speed + 2.0 * bend * distance
    if square < 0.0:
        return math.inf
    root = math.sqrt(square)
    if speed > 0.0:
        return 2.0 * distance / (speed + root)
    return (root - speed) / bend if bend > 0.0 else math.inf


@inlined
def fly(m, t, x, w):
    """Time and speed at which the play ends, and its side.

    From (t, x, w) in the play or leaving a flank.
    """
    start, rate = forced(m.order, m.free, t)
    decay = m.drift + rate - w
    jerk = abs(decay) * m.damping**2 + m.free_jerk
    tau, here, speed, value, left, side = 0.0, x, w, start, decay, 0
    horizon = LONG
    for _ in range(MOST_STEPS):
        bend = m.damping * left - bent(m.order, m.free, value, t + tau)
        turn, side = jerk * horizon / 3.0, 1
        if speed < 0.0 or (speed == 0.0 and bend < 0.0):
            side = -1
        # up to the horizon, accelerations are at most these
        ahead, behind = max(m.play - side * here, 0.0), max(m.play + side * here, 0.0)
        step = min(horizon, reach(ahead, side * speed, side * bend + turn))
        if (0.5 * step * (turn - side * bend) - side * speed) * step > behind:
            back = reach(behind, -side * speed, turn - side * bend)
            if back < step:
                step, side = back, -side
        horizon = 2.0 * horizon if step == horizon else step
        tau += step
        grown = math.expm1(-m.damping * tau)
        left = decay * (1.0 + grown)
        value, rate = forced(m.order, m.free, t + tau)
        here = x + decay * grown / m.damping + m.drift * tau + value - start
        speed = m.drift + rate - left
        if step < CLOSE or jerk * step**3 < CLOSE * side * speed:
            break
    return t + tau, speed, side


@inlined
def press(m, t, w, side):
    """Time and speed at which flanks part again that met at a speed w; NaN if never.

    side : of the flanks, 1 or -1. Distances count into the flank.
    """
    value, rate = forced(m.order, m.pressed, t)
    half = 0.5 * m.damping
    turn = math.sqrt(m.stiffness - half * half)
    mean = side * m.offset
    a = -(mean + side * value)
    b = (side * (w - rate) + half * a) / turn
    size = math.hypot(a, b)
    swing = abs(m.pressed[0]) + abs(m.pressed[1])
    swing += abs(m.pressed[2]) + abs(m.pressed[3])
    tau, into, speed = 0.0, 0.0, side * w
    for _ in range(MOST_STEPS):
        fade = math.exp(-half * tau)
        if mean - size * fade - swing > 0.0:
            return math.nan, 0.0
        most = m.stiffness * size * fade + m.pressed_bend
        step = reach(max(into, 0.0), -speed, most)
        tau += step
        fade = math.exp(-half * tau)
        c, s = math.cos(turn * tau), math.sin(turn * tau)
        value, rate = forced(m.order, m.pressed, t + tau)
        into = mean + side * value + fade * (a * c + b * s)
        speed = side * rate
        speed += fade * ((turn * b - half * a) * c - (turn * a + half * b) * s)
        if step < CLOSE * (1.0 + tau):
            return t + tau, side * speed
    return math.nan, 0.0


@inlined
def push(m, t):
    """Acceleration of flanks in the play at rest."""
    c, s = math.cos(TURN * t), math.sin(TURN * t)
    found = m.damping * m.drift - TURN * TURN * (m.free[0] * c + m.free[1] * s)
    found += m.damping * TURN * (m.free[1] * c - m.free[0] * s)
    if m.free[2] != 0.0 or m.free[3] != 0.0:
        rate = TURN * m.order
        c, s = math.cos(rate * t), math.sin(rate * t)
        found -= rate * rate * (m.free[2] * c + m.free[3] * s)
        found += m.damping * rate * (m.free[3] * c - m.free[2] * s)
    return found


@inlined
def bounce(m, t, w, side):
    """Time and speed at which flanks part that met at a speed w; NaN if never."""
    if m.stiffness < math.inf:
        return press(m, t, w, side)
    away = -m.restitution * w
    if abs(away) > REST:
        return t, away
    # they rest on each other until something pulls them apart
    step = 1.0 / 4096.0
    for i in range(4096 + 1):
        if side * push(m, t + i * step) < 0.0:
            return t + i * step, -side * REST
    return math.nan, 0.0


@compiled
def returned(m, t, v):
    """The next departure (t, v) from the upper flank after one at a speed v > 0.

    Third is how often the lower flank was met; t is NaN where the flanks stay together.
    """
    now, w, side = fly(m, t, m.play, -v)
    lower = 0
    while side < 0:
        lower += 1
        now, w = bounce(m, now, w, -1)
        if math.isnan(now):
            return math.nan, 0.0, lower
        now, w, side = fly(m, now, -m.play, w)
    now, w = bounce(m, now, w, 1)
    return now, -w, lower
