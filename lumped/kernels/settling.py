"""When a response has become periodic, whatever method marches it.

Sections are the mesh deflections and rates at the start of each common period. Their
distances shrink by a factor with every period; how far the periodic response still
is follows from the distance and that factor, so that slow decay is not taken for
rest.
"""

from __future__ import annotations

import math

from lumped.compiled import inlined

FINISHED, NOT_FINITE = 0, 1
CALM = 3  # periods in a row that must be close enough
REPEATED = 4.0  # tolerances within which two sections may be the same
APART = 50.0  # tolerances beyond which two sections are not the same
STEADY = 1e-3  # change of a distance, relative, over an orbit that has settled
SILENT = 1e-13  # distance at the level of round-off
QUIET = 1e-6  # of the deflection: smallest amplitude that counts as vibration
TINY = 1e-30  # m


@inlined
def bounded(q, v, limit):
    """Whether all velocities are below the limit [m sqrt(kg)/s]; NaN is not."""
    total = 0.0
    for i in range(q.size):
        total += abs(v[i]) + 0.0 * q[i]
    return total < limit


@inlined
def widen(low, high, s):
    """Keep the smallest and largest deflection of each mesh (m,)."""
    for m in range(s.size):
        low[m] = min(low[m], s[m])
        high[m] = max(high[m], s[m])


@inlined
def set_section(system, q, v, omega, section):
    """Deflections and rates over the mesh's angular frequency (2, m) [m]."""
    shapes = system[3]
    for m in range(shapes.shape[0]):
        s, rate = 0.0, 0.0
        for i in range(q.size):
            s += shapes[m, i] * q[i]
            rate += shapes[m, i] * v[i]
        section[0, m] = s
        section[1, m] = rate / omega


@inlined
def set_scale(low, high, scale):
    """Range of deflection of each mesh over a period (m,), never quite 0."""
    for m in range(scale.size):
        level = QUIET * max(abs(low[m]), abs(high[m]))
        scale[m] = max(high[m] - low[m], level, TINY)


@inlined
def apart(one, two, scale):
    """Largest difference of two sections (2, m) in parts of the scale; NaN is inf."""
    largest = 0.0
    for m in range(scale.size):
        change = max(abs(one[0, m] - two[0, m]), abs(one[1, m] - two[1, m]))
        if not change <= largest * scale[m]:
            largest = change / scale[m]
    return largest if largest == largest else math.inf


@inlined
def settled_multiple(sections, period, scale, tolerance):
    """Common periods after which the response repeats; 0 while it still settles.

    sections : (slots, 2, m), a ring of at least two times the largest multiple
    """
    slots = sections.shape[0]
    largest = min((slots - 2) // 2, (period - 1) // 2)
    now, last = sections[period % slots], sections[(period - 1) % slots]
    for p in range(1, largest + 1):
        d = apart(now, sections[(period - p) % slots], scale)
        if d > REPEATED * tolerance:
            continue
        before = apart(last, sections[(period - 1 - p) % slots], scale)
        if d > SILENT and d * (1.0 + tolerance) > tolerance * ((before / d) ** p - 1.0):
            continue  # the periodic response is still further away than the tolerance
        if distinct(sections, period, p, scale, tolerance):
            return p
    return 0


@inlined
def distinct(sections, period, p, scale, tolerance):
    """Whether no shorter multiple than p is about to be reached.

    In a transient the distances to nearer sections shrink as well; on an orbit of
    period p they stay.
    """
    slots = sections.shape[0]
    now, then = sections[period % slots], sections[(period - p) % slots]
    for q in range(1, p):
        d = apart(now, sections[(period - q) % slots], scale)
        if d >= APART * tolerance:
            continue
        before = apart(then, sections[(period - p - q) % slots], scale)
        if not abs(d - before) <= STEADY * before:
            return False
    return True


@inlined
def close_period(sections, period, range_, scale, tolerance, multiple, calm):
    """(multiple, calm) after a period: the multiple found, how often in a row."""
    set_scale(range_[0], range_[1], scale)
    found = settled_multiple(sections, period, scale, tolerance)
    return found, calm + 1 if found > 0 and found == multiple else 0
