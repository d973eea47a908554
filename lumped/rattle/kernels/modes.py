"""Motion of several parts between the flanks and on them, mode by mode, compiled.

Between events the motion is linear: a drift, a forced part and fading modes. The first
crossing of a bound is found by steps that cannot pass it, as in `flight`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.compiled import compiled, inlined
from lumped.rattle.kernels.flight import reach

TURN = 2.0 * math.pi
LONG = 0.25  # turns of a first step, at most
CLOSE = 1e-13  # turns: a step so short ends a search
MOST_STEPS = 10_000_000  # of a search
MOST_MEETINGS = 10_000  # of flanks in a turn: more would come to rest on each other


class Regime(NamedTuple):
    """States (2 n,), rotations and speeds of n parts, while flanks stay as they are.

    They are offset + drift since the regime's start + the forced parts of turn e^(2 pi
    i t) and ripple e^(2 pi i order t), and vectors (2 n, 2 n) times amplitudes that go
    with e^(rates t). The relative rotation of the flanks is row (n,) times the
    rotations, and the transmission error.
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


@inlined
def at(m, state, amplitudes, start, t):
    """State at a time t from the amplitudes of its modes at `start`, into `state`."""
    n = state.size
    one = np.exp(1j * TURN * t)
    two = np.exp(1j * TURN * m.order * t)
    for i in range(n):
        value = m.offset[i] + m.drift[i] * (t - start)
        value += (m.turn[i] * one).real + (m.ripple[i] * two).real
        state[i] = value
    for j in range(n):
        now = amplitudes[j] * np.exp(m.rates[j] * (t - start))
        for i in range(n):
            state[i] += (m.vectors[i, j] * now).real


@inlined
def excite(m, state, t, amplitudes):
    """Amplitudes of the modes of a state at a time t."""
    n = state.size
    one = np.exp(1j * TURN * t)
    two = np.exp(1j * TURN * m.order * t)
    for j in range(n):
        amplitudes[j] = 0.0
    for i in range(n):
        left = state[i] - m.offset[i]
        left -= (m.turn[i] * one).real + (m.ripple[i] * two).real
        for j in range(n):
            amplitudes[j] += m.inverse[j, i] * left


@inlined
def relative(m, state, t):
    """Relative rotation of the flanks and its rate."""
    n = m.row.size
    x, w = m.error * math.cos(TURN * t), -TURN * m.error * math.sin(TURN * t)
    for i in range(n):
        x += m.row[i] * state[i]
        w += m.row[i] * state[n + i]
    return x, w


@inlined
def waves(m, amplitudes, seen):
    """Amplitudes of the relative rotation: of the modes into `seen`, turn and ripple.

    Last is a bound on the forced third derivative.
    """
    n = m.row.size
    turn, ripple = m.error + 0j, 0j
    for j in range(2 * n):
        seen[j] = 0.0
    for i in range(n):
        turn += m.row[i] * m.turn[i]
        ripple += m.row[i] * m.ripple[i]
        for j in range(2 * n):
            seen[j] += m.row[i] * m.vectors[i, j] * amplitudes[j]
    jerk = TURN**3 * (abs(turn) + m.order**3 * abs(ripple))
    return turn, ripple, jerk


@inlined
def look(m, seen, turn, ripple, steady, tau, t):
    """Relative rotation, its rate, second derivative, and a bound on the third one.

    steady : its offset and drift
    """
    one = turn * np.exp(1j * TURN * t)
    two = ripple * np.exp(1j * TURN * m.order * t)
    rate = TURN * m.order
    x = steady[0] + steady[1] * tau + one.real + two.real
    w = steady[1] - TURN * one.imag - rate * two.imag
    a = -(TURN * TURN) * one.real - rate * rate * two.real
    jerk = 0.0
    for j in range(seen.size):
        r = m.rates[j]
        now = seen[j] * np.exp(r * tau)
        x += now.real
        w += (r * now).real
        a += (r * r * now).real
        jerk += abs(now) * abs(r) ** 3
    return x, w, a, jerk


@inlined
def leave(m, amplitudes, seen, start, low, high, until):
    """Time at which the relative rotation leaves low to high, and by which end.

    0 is that of `until`, come before; the time is NaN where no end is found.
    """
    turn, ripple, forced = waves(m, amplitudes, seen)
    offset, drift = 0.0, 0.0
    for i in range(m.row.size):
        offset += m.row[i] * m.offset[i]
        drift += m.row[i] * m.drift[i]
    steady = (offset, drift)
    tau, horizon = 0.0, LONG
    for _ in range(MOST_STEPS):
        if start + tau >= until:
            return until, 0
        x, w, a, jerk = look(m, seen, turn, ripple, steady, tau, start + tau)
        bend = (jerk + forced) * horizon / 3.0
        step, side = horizon, 0
        if high < math.inf:
            step, side = min(step, reach(max(high - x, 0.0), w, a + bend)), 1
        if low > -math.inf:
            down = reach(max(x - low, 0.0), -w, bend - a)
            if side == 0 or down < step:
                step, side = min(step, down), -1
        horizon = min(2.0 * horizon, LONG) if step == horizon else step
        tau += step
        if step < CLOSE * (1.0 + tau):
            return start + tau, side
    return math.nan, 0


class System(NamedTuple):
    """Regimes of the lower flank, of the play, |relative rotation| < bound, and of the
    upper flank.

    kick : what the parts' speeds (n,) lose per speed of an impact; empty where flanks
        have a stiffness, and the regimes of the flanks count
    """

    regimes: tuple[Regime, Regime, Regime]
    bound: float
    kick: NDArray[Any]


@inlined
def ends(s, side):
    """Relative rotations between which the play, 0, or a flank, 1 or -1, ends."""
    low = -s.bound if side == 0 else s.bound
    high = s.bound if side == 0 else -s.bound
    return (-math.inf if side < 0 else low), (math.inf if side > 0 else high)


@inlined
def meet(s, state, w, to):
    """Where flanks that meet at a speed w go on: in the play, or on a side."""
    n = s.kick.size
    for i in range(n):
        state[n + i] -= s.kick[i] * w
    return 0 if n > 0 else to


@compiled
def run(s, state, start, begin, end, times, out):
    """Noise from `begin` to `end` of a motion from a state (2 n,) at `start`.

    (sum of squared speeds at which flanks meet in that time, meetings of the upper and
    of the lower flank, and whether all was found.) The state is left as at the end.

    times, out : instants, that rise, and the relative rotations then
    """
    n = state.size
    amplitudes, seen = np.empty(n, np.complex128), np.empty(n, np.complex128)
    x, _ = relative(s.regimes[1], state, start)
    side = int(x > s.bound) - int(x < -s.bound) if s.kick.size == 0 else 0
    t, shown, noise, high, low, turn, often = start, 0, 0.0, 0, 0, start, 0
    while t < end and often <= MOST_MEETINGS:
        m = s.regimes[side + 1]
        bottom, top = ends(s, side)
        excite(m, state, t, amplitudes)
        now, to = leave(m, amplitudes, seen, t, bottom, top, end)
        if math.isnan(now):
            break
        while shown < times.size and times[shown] <= now:
            at(m, state, amplitudes, t, times[shown])
            out[shown], _ = relative(m, state, times[shown])
            shown += 1
        at(m, state, amplitudes, t, now)
        _, w = relative(m, state, now)
        t = now
        if to == 0 or side != 0:
            side = 0
            continue
        if t >= begin:
            high, low = high + (to > 0), low + (to < 0)
            noise += w * w
        turn, often = (turn, often + 1) if t < turn + 1.0 else (t, 0)
        side = meet(s, state, w, to)
    return noise, high, low, t >= end
