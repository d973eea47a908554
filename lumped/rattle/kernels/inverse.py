"""The return map and its inverse on many departures, and departures that graze.

Backward in time the motion is that of a machine with negative damping, see
`Machine.backward`; times and speeds change their sign.
"""

from __future__ import annotations

import math

from lumped.common.compiled import compiled, inlined
from lumped.rattle.kernels.flight import (
    MAX_RESTING_SPEED,
    apply_contact,
    free_acceleration,
    free_flight,
    return_map,
)


@inlined
def inverse_return_map(m, t, v):
    """The departure (t, v) before one; t is inf where it is not clear.

    m : the machine backward in time. Rest has no unique past: slow lift-offs have no
        pre-image.
    """
    if not v > MAX_RESTING_SPEED:
        return math.inf, 0.0
    time, w = apply_contact(m, -t, v, 1)
    while math.isfinite(time):
        time, w, side = free_flight(m, time, math.copysign(m.play, -w), w)
        if side > 0 or not math.isfinite(time):
            return -time, w
        time, w = apply_contact(m, time, w, -1)
    return math.inf, 0.0


@compiled
def map_points(m, departures, count, backward, images):
    """Departures (n, 2) some returns after others, or before; NaN where not clear.

    m : the machine, backward in time where `backward`
    """
    for i in range(departures.shape[0]):
        t, v = departures[i, 0], departures[i, 1]
        for _ in range(count):
            if backward:
                t, v = inverse_return_map(m, t, v)
            else:
                t, v, _ = return_map(m, t, v)
            if not math.isfinite(t):
                t, v = math.nan, math.nan
                break
        images[i, 0], images[i, 1] = t, v


@compiled
def find_grazing_departures(m, times, departures):
    """Departures (n, 2) whose next contact grazes the lower flank at a time; NaN where
    there is none.

    m : the machine backward in time
    """
    for i in range(times.size):
        t, v = math.nan, math.nan
        if free_acceleration(m, -times[i]) > 0.0:
            start, speed, side = free_flight(m, -times[i], -m.play, 0.0)
            if side > 0 and math.isfinite(start):
                t, v = -start, speed
        departures[i, 0], departures[i, 1] = t, v
