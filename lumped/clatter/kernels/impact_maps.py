"""Maps from impact to impact of a spur wheel whose teeth alone meet, compiled.

Derived again. With Q = R phi + r an impact leaves Q'+ = -eps Q'- + (1 + eps) e', which
the source prints without the factor 1 + eps in eq. (9) and (11); in eq. (8) the letter
t_k on the left and first on the right stands for the place of the wheel, e - s.
"""

from __future__ import annotations

import math

from lumped.clatter.kernels.phi import phi_functions
from lumped.common.compiled import compiled, inlined

EVENT_TOL_PERIODS = 1e-15  # periods
MAX_STEPS = 100_000
TWO_PI = 2.0 * math.pi


@inlined
def excitation_at(box, t):
    """i e and i e' of the source at a time."""
    e, e1 = 0.0, 0.0
    for m in range(box.orders.size):
        angle = TWO_PI * box.orders[m]
        c, s = math.cos(angle * t), math.sin(angle * t)
        e += box.cosines[m] * c + box.sines[m] * s
        e1 += angle * (box.sines[m] * c - box.cosines[m] * s)
    return box.ratios[0] * e, box.ratios[0] * e1


@inlined
def free_motion(box, v, h):
    """The wheel's part of s and of its speed, after a time h: the right of eq. (8)."""
    shift, rate = 0.0, 0.0
    for i in range(v.size):
        z, acceleration = box.damping_rate[i] * h, box.drag_acceleration[i]
        first, second = phi_functions(z)
        shift += box.rows[0, i] * h * (v[i] * first + acceleration * h * second)
        rate += box.rows[0, i] * (v[i] * (1.0 - z * first) + acceleration * h * first)
    return shift, rate


@inlined
def time_to_bound(speed, gap, max_acceleration):
    """A time in which a gap is not passed, of accelerations up to a largest one."""
    root = math.sqrt(speed * speed + 2.0 * max_acceleration * gap)
    return (
        2.0 * gap / (speed + root) if speed > 0.0 else (root - speed) / max_acceleration
    )


@inlined
def next_root(box, t, v, edge):
    """The first root of eq. (8): time from t, edge and speed; inf where none is."""
    max_acceleration, high, low = 0.0, box.high[0], box.low[0]
    for m in range(box.orders.size):
        amplitude = math.hypot(box.cosines[m], box.sines[m])
        max_acceleration += (
            abs(box.ratios[0]) * amplitude * (TWO_PI * box.orders[m]) ** 2
        )
    for i in range(v.size):
        max_acceleration += abs(
            box.rows[0, i] * (box.drag_acceleration[i] - box.damping_rate[i] * v[i])
        )
    start = high if edge > 0 else low
    begin, _ = excitation_at(box, t)
    h = 0.0
    for _ in range(MAX_STEPS):
        e, e1 = excitation_at(box, t + h)
        shift, rate = free_motion(box, v, h)
        s, speed = start + e - begin + shift, e1 + rate
        up = max(high - s, 0.0) if h > 0.0 or edge < 0 else 0.0
        down = max(s - low, 0.0) if h > 0.0 or edge > 0 else 0.0
        upper, lower = (
            time_to_bound(speed, up, max_acceleration),
            time_to_bound(-speed, down, max_acceleration),
        )
        h += min(upper, lower)
        if min(upper, lower) < EVENT_TOL_PERIODS:
            return h, 1 if upper < lower else -1, speed
    return math.inf, 0, 0.0


@compiled
def follow_implicit(box, t, v, edge, out):
    """Eq. (7) and (8): rows of time, edge, speed of approach, impulse; how many.

    From an impact at a time t in periods at an edge, 1 upper or -1 lower; v (n,) speeds
    after it, changed to those after the last. The next time is the first root of eq.
    (8), found by steps that a bound of the second derivative keeps short of it.
    """
    mobility = 0.0
    for i in range(v.size):
        mobility += box.rows[0, i] ** 2 * box.inverse_mass[i]
    for k in range(out.shape[0]):
        h, edge, speed = next_root(box, t, v, edge)
        if not math.isfinite(h) or edge * speed <= box.resting_speed:
            return k  # at rest on the edge: no impact follows
        t += h
        impulse = (1.0 + box.restitution[0]) * edge * speed / mobility
        for i in range(v.size):
            z = box.damping_rate[i] * h
            first, _ = phi_functions(z)
            v[i] += (box.drag_acceleration[i] * h - v[i] * z) * first
            v[i] -= edge * box.inverse_mass[i] * box.rows[0, i] * impulse
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = t, edge, edge * speed, impulse
    return out.shape[0]


@compiled
def follow_fermi(box, t, v, edge, out):
    """Eq. (11), the Fermi accelerator, as `follow_implicit`; the edge is not needed.

    Without drag and damping, the play much longer than the way of the excitation: each
    flight crosses it.
    """
    play, eps = box.high[0] - box.low[0], box.restitution[0]
    mobility, j = 0.0, 0.0
    for i in range(v.size):
        mobility += box.rows[0, i] ** 2 * box.inverse_mass[i]
        j -= box.rows[0, i] * v[i]  # the speed Q'
    for k in range(out.shape[0]):
        t += play / abs(j)
        _, e1 = excitation_at(box, t)
        approach, edge = abs(e1 - j), 1.0 if e1 > j else -1.0
        if not math.isfinite(t) or approach <= box.resting_speed:
            return k
        impulse = (1.0 + eps) * approach / mobility
        for i in range(v.size):
            v[i] -= edge * box.inverse_mass[i] * box.rows[0, i] * impulse
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = t, edge, approach, impulse
        j = -eps * j + (1.0 + eps) * e1
    return out.shape[0]
