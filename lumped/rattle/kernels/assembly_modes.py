"""Motion of several parts between the flanks and on them, mode by mode, compiled.

Between events the motion is linear: a drift, a forced part and fading modes. The first
crossing of a bound is found by steps that cannot pass it, as in `flight`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.common.compiled import compiled, inlined
from lumped.rattle.kernels.flight import time_to_bound
from lumped.rattle.kernels.records import MAX_DECAYING_FLIGHT, MAX_LOAD_CHANGE

TWO_PI = 2.0 * math.pi
MAX_FIRST_STEP = 0.25  # turns of a first step, at most
EVENT_TOL = 1e-13  # turns: a step so short ends a search
MAX_STEPS = 10_000_000  # of a search
MAX_EVENTS = 10_000  # of flanks in a turn
MAX_RESTING_SPEED = 1e-9  # rad per turn: slower flanks rest on each other


class Regime(NamedTuple):
    """States (2 n,), rotations and speeds of n parts, while flanks stay as they are.

    They are offset + drift since the regime's start + the forced parts of turn e^(2 pi
    i t) and ripple e^(2 pi i order t), and vectors (2 n, 2 n) times amplitudes that go
    with e^(rates t). The relative rotation of the flanks is row (n,) times the
    rotations, and the transmission error.

    event_row : what ends the regime, by the amplitudes of the modes (2 n,); forced,
        steady : its amplitudes at a turn and at `order`, its offset and drift
    """

    rates: NDArray[Any]
    vectors: NDArray[Any]
    inverse: NDArray[Any]
    row: NDArray[Any]
    offset: NDArray[Any]
    drift: NDArray[Any]
    turn: NDArray[Any]
    ripple: NDArray[Any]
    order: float
    error: float
    event_row: NDArray[Any]
    forced: tuple[complex, complex]
    steady: tuple[float, float]


@inlined
def at(m, state, amplitudes, start, t):
    """State at a time t from the amplitudes of its modes at `start`, into `state`."""
    n = state.size
    one = np.exp(1j * TWO_PI * t)
    two = np.exp(1j * TWO_PI * m.order * t)
    for i in range(n):
        value = m.offset[i] + m.drift[i] * (t - start)
        value += (m.turn[i] * one).real + (m.ripple[i] * two).real
        state[i] = value
    for j in range(n):
        amplitude = amplitudes[j] * np.exp(m.rates[j] * (t - start))
        for i in range(n):
            state[i] += (m.vectors[i, j] * amplitude).real


@inlined
def modal_amplitudes(m, state, t, amplitudes):
    """Amplitudes of the modes of a state at a time t."""
    n = state.size
    one = np.exp(1j * TWO_PI * t)
    two = np.exp(1j * TWO_PI * m.order * t)
    for j in range(n):
        amplitudes[j] = 0.0
    for i in range(n):
        free_part = state[i] - m.offset[i]
        free_part -= (m.turn[i] * one).real + (m.ripple[i] * two).real
        for j in range(n):
            amplitudes[j] += m.inverse[j, i] * free_part


@inlined
def relative_motion(m, state, t):
    """Relative rotation of the flanks and its rate."""
    n = m.row.size
    x, w = m.error * math.cos(TWO_PI * t), -TWO_PI * m.error * math.sin(TWO_PI * t)
    for i in range(n):
        x += m.row[i] * state[i]
        w += m.row[i] * state[n + i]
    return x, w


@inlined
def event_function(m, amplitudes, tau, t):
    """What is watched, its rate, second derivative, and a bound on the third one from
    t on, `tau` after the start of the regime."""
    one = m.forced[0] * np.exp(1j * TWO_PI * t)
    two = m.forced[1] * np.exp(1j * TWO_PI * m.order * t)
    rate = TWO_PI * m.order
    x = m.steady[0] + m.steady[1] * tau + one.real + two.real
    w = m.steady[1] - TWO_PI * one.imag - rate * two.imag
    a = -(TWO_PI * TWO_PI) * one.real - rate * rate * two.real
    jerk = TWO_PI**3 * abs(one) + rate**3 * abs(two)
    for j in range(amplitudes.size):
        r = m.rates[j]
        term = m.event_row[j] * amplitudes[j] * np.exp(r * tau)
        x += term.real
        w += (r * term).real
        a += (r * r * term).real
        jerk += abs(term) * abs(r) ** 3
    return x, w, a, jerk


@inlined
def next_event(m, amplitudes, start, low, high, end):
    """Time at which the event function leaves low to high, and by which end.

    0 is that of `end`, come before; the time is NaN where no end is found.
    """
    tau, horizon = 0.0, MAX_FIRST_STEP
    for _ in range(MAX_STEPS):
        if start + tau >= end:
            return end, 0
        x, w, a, jerk = event_function(m, amplitudes, tau, start + tau)
        jerk_margin = jerk * horizon / 3.0
        step, side = horizon, 0
        if high < math.inf:
            step, side = (
                min(step, time_to_bound(max(high - x, 0.0), w, a + jerk_margin)),
                1,
            )
        if low > -math.inf:
            down = time_to_bound(max(x - low, 0.0), -w, jerk_margin - a)
            if side == 0 or down < step:
                step, side = min(step, down), -1
        horizon = min(2.0 * horizon, MAX_FIRST_STEP) if step == horizon else step
        tau += step
        if step < EVENT_TOL * (1.0 + tau):
            return start + tau, side
    return math.nan, 0


class System(NamedTuple):
    """Regimes of the lower flank, of the play, |relative rotation| < bound, and of the
    upper flank.

    edge : of what the regimes of the flanks watch: the relative rotation, where flanks
        have a stiffness, else the load of flanks at rest on each other, and it is 0
    kick : what the parts' speeds (n,) lose per speed that flanks lose in an impact;
        empty where they have a stiffness
    inertia : of the parts in an impact; 0 where nothing slows flights down
    """

    regimes: tuple[Regime, Regime, Regime]
    bound: float
    edge: float
    kick: NDArray[Any]
    restitution: float
    inertia: float


@inlined
def event_bounds(s, side):
    """Bounds of the event function in the play, 0, or on a flank, 1 or -1."""
    low = -s.bound if side == 0 else s.edge
    high = s.bound if side == 0 else -s.edge
    return (-math.inf if side < 0 else low), (math.inf if side > 0 else high)


@inlined
def apply_impulse(s, state, w):
    """Take a speed w of the flanks from the parts."""
    n = s.kick.size
    for i in range(n):
        state[n + i] -= s.kick[i] * w


@inlined
def comes_to_rest(s, state, t, side, w, amplitudes):
    """Whether flights that begin with a speed w off a flank only become shorter.

    As of one equation: where the load of flanks that stay together, at least, is above
    0 from now on, and changes little in a flight, losses shorten flights until the
    flanks rest. The load's parts may all add up: no bound is closer than it needs.
    """
    m = s.regimes[side + 1]
    modal_amplitudes(m, state, t, amplitudes)
    steady, one, two = side * m.steady[0], abs(m.forced[0]), abs(m.forced[1])
    change, slope = one + two, TWO_PI * (one + m.order * two)
    for j in range(amplitudes.size):
        part = abs(m.event_row[j] * amplitudes[j])
        change += part
        slope += abs(m.rates[j]) * part
    min_load = steady - change
    if min_load <= 0.0:
        return False
    max_flight = (
        MAX_DECAYING_FLIGHT
        if slope * MAX_DECAYING_FLIGHT < MAX_LOAD_CHANGE * min_load
        else MAX_LOAD_CHANGE * min_load / slope
    )
    max_flight *= (min_load / (steady + change)) ** (2.0 / 3.0)
    return 2.0 * w * s.inertia < max_flight * min_load


@compiled
def run_motion(s, state, start, begin, end, times, out):
    """Noise from `begin` to `end` of a motion from a state (2 n,) at `start`.

    (sum of squared speeds at which flanks meet in that time, meetings of the upper and
    of the lower flank, and whether all was found.) The state is left as at the end.
    Motions whose flights fade away end there and have no meetings, unless instants are
    asked for.

    times, out : instants, that rise, and the relative rotations then
    """
    amplitudes = np.empty(state.size, np.complex128)
    x, _ = relative_motion(s.regimes[1], state, start)
    side = int(x > s.bound) - int(x < -s.bound) if s.kick.size == 0 else 0
    t, n_recorded, noise, high, low, turn, events_in_turn = (
        start,
        0,
        0.0,
        0,
        0,
        start,
        0,
    )
    while t < end and events_in_turn <= MAX_EVENTS:
        m = s.regimes[side + 1]
        modal_amplitudes(m, state, t, amplitudes)
        bottom, top = event_bounds(s, side)
        event_time, end_side = next_event(m, amplitudes, t, bottom, top, end)
        if math.isnan(event_time):
            break
        while n_recorded < times.size and times[n_recorded] <= event_time:
            at(m, state, amplitudes, t, times[n_recorded])
            out[n_recorded], _ = relative_motion(m, state, times[n_recorded])
            n_recorded += 1
        at(m, state, amplitudes, t, event_time)
        _, w = relative_motion(m, state, event_time)
        t = event_time
        if end_side == 0 or side != 0:
            # flanks that were at rest leave with a speed, so that they are apart
            apply_impulse(s, state, w + side * MAX_RESTING_SPEED)
            side = 0
            continue
        if t >= begin:
            high, low = high + (end_side > 0), low + (end_side < 0)
            noise += w * w
        turn, events_in_turn = (turn, events_in_turn + 1) if t < turn + 1.0 else (t, 0)
        side = end_side if s.restitution * abs(w) < MAX_RESTING_SPEED else 0
        apply_impulse(s, state, w if side != 0 else (1.0 + s.restitution) * w)
        if side != 0 and s.edge == 0.0:
            m = s.regimes[side + 1]
            modal_amplitudes(m, state, t, amplitudes)
            if side * event_function(m, amplitudes, 0.0, t)[0] <= 0.0:
                apply_impulse(s, state, side * MAX_RESTING_SPEED)
                side = 0
        elif side == 0 and times.size == 0 and s.inertia > 0.0:
            speed = s.restitution * abs(w)
            # the least load is below the mean one
            is_short = 2.0 * speed * s.inertia < MAX_DECAYING_FLIGHT * abs(
                s.regimes[end_side + 1].steady[0]
            )
            if is_short and comes_to_rest(s, state, t, end_side, speed, amplitudes):
                return 0.0, 0, 0, True
    return noise, high, low, t >= end
