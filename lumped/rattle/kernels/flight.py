"""Motion between the flanks and on them in closed form, event by event, compiled.

The first crossing of a bound is found by steps that cannot pass it. With speed w and
acceleration a toward a bound at a distance d, and a third derivative of J at most, a
step h with w h + a h^2 / 2 + J h^3 / 6 <= d is short of it. Near a crossing such steps
converge faster than Newton's.

The step is written without branches, so that the compiler can take several cells at a
time; see `settle`.
"""

from __future__ import annotations

import math

from lumped.common.compiled import compiled, inlined

TWO_PI = 2.0 * math.pi
MAX_FIRST_STEP = 0.5  # turns of a first step, at most
EVENT_TOL = 1e-14  # turns: a step so short ends a search
MAX_STEPS = 10_000  # of a search
MAX_RESTING_SPEED = 1e-9  # rad per turn: slower flanks rest on each other
MIN_TRANSIENT = 1e-18  # rad per turn: a transient that is none any more
# Of a search: goes on, has found it, has not
SEARCHING, EVENT_FOUND, NOT_FOUND = 0.0, 1.0, 2.0


@inlined
def cos_sin_of_turns(t):
    """Cosine and sine of a time in turns, to round-off."""
    quarter = math.floor(4.0 * t + 0.5)
    r = TWO_PI * (t - 0.25 * quarter)
    z = r * r
    s = 1.0 / 6227020800.0 - z / 1307674368000.0
    s = 1.0 / 362880.0 - z * (1.0 / 39916800.0 - z * s)
    s = 1.0 / 6.0 - z * (1.0 / 120.0 - z * (1.0 / 5040.0 - z * s))
    s = r - r * z * s
    c = 1.0 / 87178291200.0 - z / 20922789888000.0
    c = 1.0 / 40320.0 - z * (1.0 / 3628800.0 - z * (1.0 / 479001600.0 - z * c))
    c = 1.0 - z * (0.5 - z * (1.0 / 24.0 - z * (1.0 / 720.0 - z * c)))
    quarter -= 4.0 * math.floor(0.25 * quarter)
    odd = quarter == 1.0 or quarter == 3.0
    cosine, sine = (s, c) if odd else (c, s)
    cosine = -cosine if quarter == 1.0 or quarter == 2.0 else cosine
    sine = -sine if quarter >= 2.0 else sine
    return cosine, sine


@inlined
def expm1_neg(z):
    """e^-z - 1 for z from -1 to 1, to round-off."""
    y = -0.25 * z
    e = 1.0 / 3628800.0 + y * (1.0 / 39916800.0 + y / 479001600.0)
    e = 1.0 / 5040.0 + y * (1.0 / 40320.0 + y * (1.0 / 362880.0 + y * e))
    e = 1.0 / 24.0 + y * (1.0 / 120.0 + y * (1.0 / 720.0 + y * e))
    e = y + y * y * (0.5 + y * (1.0 / 6.0 + y * e))
    e = e * (2.0 + e)
    return e * (2.0 + e)


@inlined
def forced_state(order, part, t):
    """A forced part at a time and its rate."""
    value, rate, _, _ = forced_derivatives(
        order, part, t, part[2] != 0.0 or part[3] != 0.0
    )
    return value, rate


@inlined
def forced_derivatives(order, part, t, rippled):
    """A forced part at a time and its first three derivatives.

    rippled : whether it has a part of `order` turns
    """
    c, s = cos_sin_of_turns(t)
    value = part[0] * c + part[1] * s
    rate = TWO_PI * (part[1] * c - part[0] * s)
    acceleration, jerk = -TWO_PI * TWO_PI * value, -TWO_PI * TWO_PI * rate
    if rippled:
        angular = TWO_PI * order
        c, s = cos_sin_of_turns(order * t)
        fast = part[2] * c + part[3] * s
        fast_rate = angular * (part[3] * c - part[2] * s)
        value += fast
        rate += fast_rate
        acceleration -= angular * angular * fast
        jerk -= angular * angular * fast_rate
    return value, rate, acceleration, jerk


@inlined
def time_to_bound(distance, speed, acceleration):
    """Shortest time to a bound ahead under a constant acceleration; inf if never."""
    square = speed * speed + 2.0 * acceleration * distance
    root = math.sqrt(max(square, 0.0))
    ahead = speed > 0.0
    span = 2.0 * distance if ahead else root - speed
    over = speed + root if ahead else acceleration
    never = square < 0.0 or not over > 0.0
    return math.inf if never else span / over


@inlined
def start_state(m, t, x, w, rippled):
    """A flight from (t, x, w), in the play or leaving a flank, before its first step.

    (x, w, acceleration, third derivative, transient speed, forced part, longest step)
    """
    value, rate, acceleration, jerk = forced_derivatives(m.order, m.free, t, rippled)
    transient = m.drift + rate - w
    a = m.damping * transient + acceleration
    jerk -= m.damping * m.damping * transient
    first = first_step(m, w, a, transient)
    return x, w, a, jerk, transient, value, first


@inlined
def first_step(m, w, a, transient):
    """Longest first step of a flight: twice its time where it falls back, and from a
    graze as long as the acceleration keeps its sign."""
    back = time_to_bound(0.0, -abs(w), -a if w > 0.0 else a)
    jerk = m.growth * abs(transient) * m.damping * m.damping + m.free_jerk
    first = 2.0 * back if back > 0.0 else abs(a) / jerk
    return min(MAX_FIRST_STEP, min(m.max_step, first))


@inlined
def advance(m, t, flight, rippled):
    """A step of a flight that cannot pass a bound.

    (time, flight as from `start_state`, side of the bound that it leads to,
    SEARCHING or EVENT_FOUND)
    """
    x, w, a, jerk, transient, value, horizon = flight
    transient_jerk = m.growth * abs(transient) * m.damping * m.damping
    max_jerk = transient_jerk + m.free_jerk
    snap = transient_jerk * abs(m.damping) + m.free_snap
    side = -1.0 if w < 0.0 or (w == 0.0 and a < 0.0) else 1.0
    ahead, behind = max(m.play - side * x, 0.0), max(m.play + side * x, 0.0)
    horizon = min(horizon, 2.0 * time_to_bound(ahead, side * w, side * a))
    # up to the horizon, accelerations are on average at most these above a
    toward, rest = side * jerk * horizon / 3.0, snap * horizon * horizon / 12.0
    max_jerk *= horizon / 3.0
    turn = min(max_jerk, max(toward, 0.0) + rest)
    back = min(max_jerk, max(-toward, 0.0) + rest)
    first = time_to_bound(ahead, side * w, side * a + turn)
    second = time_to_bound(behind, -side * w, back - side * a)
    side = -side if second < first else side
    bound = min(first, second)
    step = min(horizon, bound)
    t += step
    lost = transient * expm1_neg(min(max(m.damping * step, -1.0), 1.0))
    before = value
    value, rate, acceleration, jerk = forced_derivatives(m.order, m.free, t, rippled)
    x += value - before + m.drift * step + lost * m.inverse_damping
    transient += lost
    transient = 0.0 if abs(transient) < MIN_TRANSIENT else transient
    w = m.drift + rate - transient
    a = m.damping * transient + acceleration
    jerk -= m.damping * m.damping * transient
    is_close = step < EVENT_TOL or (turn + back) * step * step < EVENT_TOL * side * w
    state = EVENT_FOUND if is_close and bound <= horizon else SEARCHING
    horizon = 2.0 * step if transient == 0.0 else min(2.0 * step, m.max_step)
    return t, (x, w, a, jerk, transient, value, horizon), side, state


@inlined
def free_flight(m, t, x, w):
    """Time and speed at which the play ends, and its side; time is inf where no end is
    found in MAX_STEPS.

    From (t, x, w) in the play or leaving a flank.
    """
    rippled = m.free[2] != 0.0 or m.free[3] != 0.0
    turns = math.floor(t)
    t -= turns
    flight = start_state(m, t, x, w, rippled)
    side, state = 1.0, SEARCHING
    for _ in range(MAX_STEPS):
        t, flight, side, state = advance(m, t, flight, rippled)
        if state != SEARCHING:
            break
    w = flight[1]
    if state == SEARCHING or not math.isfinite(w):
        return math.inf, 0.0, 1
    return turns + t, w, 1 if side > 0.0 else -1


@inlined
def contact_phase(m, t, w, side):
    """Time and speed at which flanks part again that met at a speed w; NaN if never,
    inf where it is not found in MAX_STEPS.

    side : of the flanks, 1 or -1. Distances count into the flank.
    """
    rippled = m.pressed[2] != 0.0 or m.pressed[3] != 0.0
    value, rate, acceleration, _ = forced_derivatives(m.order, m.pressed, t, rippled)
    half, angular = 0.5 * m.damping, math.sqrt(m.stiffness)
    turn = math.sqrt(m.stiffness - half * half)
    mean = side * m.offset
    a = -(mean + side * value)
    b = (side * (w - rate) + half * a) / turn
    size = math.hypot(a, b)
    tau, penetration, speed, decay = 0.0, 0.0, side * w, 1.0
    oscillation, oscillation_rate = a, turn * b - half * a
    horizon = math.sqrt(6.0) / angular  # an oscillation's first step to its end
    for _ in range(MAX_STEPS):
        if mean - size * decay > m.max_pressed and half > 0.0:
            return math.nan, 0.0
        jerk = m.growth * angular**3 * size * decay + m.pressed_jerk
        restoring = (
            m.damping * oscillation_rate
            + m.stiffness * oscillation
            - side * acceleration
        )
        step = time_to_bound(
            max(penetration, 0.0), -speed, restoring + jerk * horizon / 3.0
        )
        limited = step >= horizon
        step = min(step, horizon)
        tau += step
        decay = math.exp(-half * tau)
        c, s = cos_sin_of_turns(turn * tau / TWO_PI)
        value, rate, acceleration, _ = forced_derivatives(
            m.order, m.pressed, t + tau, rippled
        )
        oscillation = decay * (a * c + b * s)
        oscillation_rate = decay * (
            (turn * b - half * a) * c - (turn * a + half * b) * s
        )
        penetration = mean + side * value + oscillation
        speed = side * rate + oscillation_rate
        if not limited and step < EVENT_TOL * (1.0 + tau):
            return t + tau, side * speed
        horizon = min(2.0 * horizon if limited else step, 1.0 / abs(half))
    return math.inf, 0.0


@inlined
def free_acceleration(m, t):
    """Acceleration of flanks in the play at rest."""
    rippled = m.free[2] != 0.0 or m.free[3] != 0.0
    _, rate, acceleration, _ = forced_derivatives(m.order, m.free, t, rippled)
    return m.damping * (m.drift + rate) + acceleration


@inlined
def liftoff_time(m, t, side):
    """Time from which flanks at rest on each other are pulled apart; NaN if never, inf
    where it is not found in MAX_STEPS."""
    rippled = m.free[2] != 0.0 or m.free[3] != 0.0
    rate = TWO_PI * m.order if rippled else TWO_PI
    max_second_derivative = m.free_jerk * (
        rate + m.damping
    )  # second derivative of the load
    tau = 0.0
    for _ in range(MAX_STEPS):
        _, forced_rate, acceleration, jerk = forced_derivatives(
            m.order, m.free, t + tau, rippled
        )
        load = side * (m.damping * (m.drift + forced_rate) + acceleration)
        step = time_to_bound(
            max(load, 0.0),
            -side * (m.damping * acceleration + jerk),
            max_second_derivative,
        )
        if load <= 0.0 or step < EVENT_TOL:
            return t + tau
        tau += step
        if tau > 1.0:
            return math.nan
    return math.inf


@inlined
def apply_contact(m, t, w, side):
    """Time and speed at which flanks part that met at a speed w; NaN if never, inf
    where it is not found."""
    if m.stiffness < math.inf:
        return contact_phase(m, t, w, side)
    departure_speed = -m.restitution * w
    if abs(departure_speed) > MAX_RESTING_SPEED:
        return t, departure_speed
    # they rest on each other until something pulls them apart
    return liftoff_time(m, t, side), -side * MAX_RESTING_SPEED


@compiled
def return_map(m, t, v):
    """The next departure (t, v) from the upper flank after one at a speed v > 0.

    Third is how often the lower flank was met; t is NaN where the flanks stay together,
    inf where it is not clear what follows. A speed v < 0 is that of the lower flank.
    """
    time, w, side = free_flight(m, t, math.copysign(m.play, v), -v)
    lower_impacts = 0
    while side < 0:
        lower_impacts += 1
        time, w = apply_contact(m, time, w, -1)
        if not math.isfinite(time):
            return time, 0.0, lower_impacts
        time, w, side = free_flight(m, time, -m.play, w)
    if time < math.inf:
        time, w = apply_contact(m, time, w, 1)
    return time, -w, lower_impacts
