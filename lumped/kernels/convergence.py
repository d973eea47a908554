"""Convergence test for periodic motions, whatever method integrates them.

How far the periodic motion still is follows from the last steps between sections, see
`lumped.kernels.arrays.Convergence`, so that slow decay is not taken for rest. A
distance adds up what each mode could do to a mesh at its worst phase: a mode that
turns slowly while it decays would otherwise seem to rest whenever it passes through
zero. What the integrator itself adds from period to period is never taken for motion.
"""

from __future__ import annotations

import math

from lumped.common.compiled import compiled, inlined
from lumped.kernels.arrays import MULTIPLE, PERIOD, STREAK

FINISHED, NOT_FINITE = 0, 1
MIN_STREAK = (
    3  # periods in a row, or more than an orbit: chaos passes by near unstable ones
)
REPEATED = 4.0  # tolerances within which two sections may be the same
DISTINCT_TOLS = 50.0  # tolerances beyond which two sections are not the same
STEADY = 1e-3  # change of a distance, relative, over an orbit that has settled
ROUNDOFF_TOLS = 1e-4  # tolerances below which decay is lost in round-off
ROUND_OFF = 1e-12
EPSILON = 2.3e-16  # of a step of fixed size, relative to the deflection
MAX_ROUNDOFF = 1e-6  # of the range: beyond it or the tolerance, noise hides no motion
MIN_VIBRATION = 1e-6  # of the deflection: smallest amplitude that counts as vibration
TINY = 1e-30  # m


@inlined
def bounded(q, v, limit):
    """Whether all velocities are below the limit [m sqrt(kg)/s]; NaN is not."""
    total = 0.0
    for i in range(q.size):
        total += abs(v[i]) + 0.0 * q[i]
    return total < limit


@inlined
def widen(limits, s):
    """Keep the smallest and largest deflection of each mesh (m,)."""
    for m in range(s.size):
        limits[0, m] = min(limits[0, m], s[m])
        limits[1, m] = max(limits[1, m], s[m])


@inlined
def set_section(check, q, v):
    """Modal displacements and velocities over angular frequencies, of this period."""
    section = check.sections[check.counts[PERIOD] % check.sections.shape[0]]
    for i in range(q.size):
        section[0, i] = q[i]
        section[1, i] = v[i] / check.angular[i]


@inlined
def begin_period(check):
    check.limits[0] = math.inf
    check.limits[1] = -math.inf


@inlined
def set_scale(check):
    """Range of deflection of each mesh over a period, never quite 0."""
    for m in range(check.scale.size):
        low, high = check.limits[0, m], check.limits[1, m]
        level = MIN_VIBRATION * max(abs(low), abs(high))
        check.scale[m] = max(high - low, level, TINY)


@inlined
def section_distance(check, one, two, three, second):
    """Largest size of one - two in a mesh, over its scale; NaN is inf.

    one, two, three : sections (2, n)
    second : 1.0 for the second difference, one - two - (two - three), else 0.0
    """
    largest, shapes, scale = 0.0, check.shapes, check.scale
    for m in range(scale.size):
        square = 0.0
        for i in range(one.shape[1]):
            for j in range(2):
                step = one[j, i] - two[j, i] - second * (two[j, i] - three[j, i])
                square += (shapes[m, i] * step) ** 2
        change = math.sqrt(square)
        if not change <= largest * scale[m]:
            largest = change / scale[m]
    return largest if largest == largest else math.inf


@inlined
def set_error_bound(check, steps):
    """Noise of steps of a fixed size in a period, from the size of deflection."""
    for m in range(check.error_bound.size):
        size = max(abs(check.limits[0, m]), abs(check.limits[1, m]))
        check.error_bound[m] = EPSILON * steps * size


@inlined
def largest_part(check):
    """Noise of a period over the range of deflection, of the worst mesh."""
    largest = 0.0
    for m in range(check.scale.size):
        largest = max(largest, check.error_bound[m] / check.scale[m])
    return largest


@inlined
def find_multiple(check):
    """Common periods after which the motion repeats, and whether but for round-off.

    0 while it still settles.
    Steps d that shrink by a complex factor mu leave |mu d / (1 - mu)| to go, which is
    the square of the last step over the size of the second difference (Aitken).
    """
    sections, tolerance, period = check.sections, check.tolerance, check.counts[PERIOD]
    slots = sections.shape[0]
    now = sections[period % slots]
    grain = largest_part(check)
    for p in range(1, min((slots - 2) // 2, period // 2) + 1):
        then = sections[(period - p) % slots]
        before = sections[(period - 2 * p) % slots]
        d = section_distance(check, now, then, before, 0.0)
        # noise of the last p periods, and of what p periods let decay of that before
        heard = max(min(2.0 * p * grain, max(tolerance, MAX_ROUNDOFF)), ROUND_OFF)
        if d > max(REPEATED * tolerance, heard):
            continue
        lost = d <= max(ROUNDOFF_TOLS * tolerance, heard)
        if not lost:
            if d >= section_distance(check, then, before, before, 0.0):
                continue  # it does not shrink
            bend = section_distance(check, now, then, before, 1.0)
            if not d * d <= tolerance * bend:
                continue  # the periodic motion is still further away
        if distinct(check, p):
            return p, lost
    return 0, False


@inlined
def distinct(check, p):
    """Whether no shorter multiple than p is about to be reached.

    In a transient the distances to nearer sections shrink as well; on an orbit of
    period p they stay.
    """
    sections, period = check.sections, check.counts[PERIOD]
    slots = sections.shape[0]
    now, then = sections[period % slots], sections[(period - p) % slots]
    for q in range(1, p):
        near = sections[(period - q) % slots]
        d = section_distance(check, now, near, near, 0.0)
        if d >= DISTINCT_TOLS * check.tolerance:
            continue
        near = sections[(period - p - q) % slots]
        before = section_distance(check, then, near, near, 0.0)
        if not abs(d - before) <= STEADY * before:
            return False
    return True


@inlined
def close_section(check, q, v):
    """Take up the section at the end of a period; whether the motion is periodic.

    A multiple counts when it was found several times in a row, or at once after a long
    period at whose ends nothing but round-off differs.
    """
    counts = check.counts
    counts[PERIOD] += 1
    set_section(check, q, v)
    set_scale(check)
    multiple, lost = find_multiple(check)
    counts[STREAK] = (
        counts[STREAK] + 1 if multiple > 0 and multiple == counts[MULTIPLE] else 0
    )
    if lost and check.accept_immediately:
        counts[STREAK] = max(MIN_STREAK, multiple + 1)
    counts[MULTIPLE] = multiple
    return settled(check)


@inlined
def settled(check):
    """Whether a multiple has held for long enough."""
    multiple, streak = check.counts[MULTIPLE], check.counts[STREAK]
    return multiple > 0 and streak > max(MIN_STREAK - 1, multiple)


@compiled
def close_period(check, q, v):
    """Close a period as `close_section` does, for motions that these kernels do not
    integrate.
    """
    return close_section(check, q, v)
