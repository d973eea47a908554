"""Convergence test for periodic motions, whatever method integrates them.

How far the periodic motion still is follows from the last steps between sections, see
`lumped.kernels.arrays.Convergence`, so that slow decay is not taken for rest. A
distance adds up what each mode could do to a mesh at its worst phase: a mode that
turns slowly while it decays would otherwise seem to rest whenever it passes through
zero. Of gears that move in space the forces of bearings must have settled as well:
motion along the axis strains the teeth little. What the integrator itself adds from
period to period is never taken for motion.
"""

from __future__ import annotations

import math

from lumped.common.compiled import compiled, inlined
from lumped.kernels.arrays import MULTIPLE, PERIOD, STREAK

FINISHED, NOT_FINITE = 0, 1
# Periods in a row, or more than an orbit: chaos passes by near unstable ones
MIN_STREAK = 3
REPEATED_TOLS = 4.0  # tolerances within which two sections may be the same
DISTINCT_TOLS = 50.0  # tolerances beyond which two sections are not the same
STEADY_RTOL = 1e-3  # change of a distance, relative, over an orbit that has settled
ROUNDOFF_TOLS = 1e-4  # tolerances below which decay is lost in round-off
MIN_NOISE = 1e-12
STEP_ROUNDOFF = 2.3e-16  # of a step of fixed size, relative to the deflection
MAX_ROUNDOFF = 1e-6  # of the range: beyond it or the tolerance, noise hides no motion
MIN_VIBRATION = 1e-6  # of the deflection: smallest amplitude that counts as vibration
MIN_SCALE = 1e-30  # m
MIN_FORCE_RANGE = 1e-3  # of the largest range of a bearing's force, for all of them


@inlined
def is_bounded(q, v, limit):
    """Whether all velocities are below the limit [m sqrt(kg)/s]; NaN is not."""
    total = 0.0
    for i in range(q.size):
        total += abs(v[i]) + 0.0 * q[i]
    return total < limit


@inlined
def update_limits(limits, s):
    """Keep the smallest and largest deflection of each mesh (m,)."""
    for m in range(s.size):
        limits[0, m] = min(limits[0, m], s[m])
        limits[1, m] = max(limits[1, m], s[m])


@inlined
def update_force_limits(convergence, q):
    """Keep the smallest and largest force of each bearing; see `Convergence.shapes`."""
    limits, shapes = convergence.limits, convergence.shapes
    for m in range(convergence.meshes, shapes.shape[0]):
        force = 0.0
        for i in range(q.size):
            force += shapes[m, i] * q[i]
        limits[0, m] = min(limits[0, m], force)
        limits[1, m] = max(limits[1, m], force)


@inlined
def set_section(convergence, q, v):
    """Modal displacements and velocities over angular frequencies, of this period."""
    section = convergence.sections[
        convergence.counts[PERIOD] % convergence.sections.shape[0]
    ]
    for i in range(q.size):
        section[0, i] = q[i]
        section[1, i] = v[i] / convergence.angular[i]


@inlined
def begin_period(convergence):
    convergence.limits[0] = math.inf
    convergence.limits[1] = -math.inf


@inlined
def set_scale(convergence):
    """Range of deflection of each mesh over a period, never quite 0.

    That of a bearing's force is not less than a part of the largest of all bearings.
    """
    for m in range(convergence.scale.size):
        low, high = convergence.limits[0, m], convergence.limits[1, m]
        level = MIN_VIBRATION * max(abs(low), abs(high))
        convergence.scale[m] = max(high - low, level, MIN_SCALE)
    largest = 0.0
    for m in range(convergence.meshes, convergence.scale.size):
        largest = max(largest, convergence.scale[m])
    for m in range(convergence.meshes, convergence.scale.size):
        convergence.scale[m] = max(convergence.scale[m], MIN_FORCE_RANGE * largest)


@inlined
def section_distance(convergence, one, two, three, second):
    """Largest size of one - two in a mesh or bearing, over its scale; NaN is inf.

    one, two, three : sections (2, n)
    second : 1.0 for the second difference, one - two - (two - three), else 0.0
    """
    largest, shapes, scale = 0.0, convergence.shapes, convergence.scale
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
def set_error_bound(convergence, steps):
    """Noise of steps of a fixed size in a period, from the size of deflection."""
    for m in range(convergence.error_bound.size):
        size = max(abs(convergence.limits[0, m]), abs(convergence.limits[1, m]))
        convergence.error_bound[m] = STEP_ROUNDOFF * steps * size


@inlined
def relative_noise(convergence):
    """Noise of a period over the range of deflection, of the worst mesh."""
    largest = 0.0
    for m in range(convergence.scale.size):
        largest = max(largest, convergence.error_bound[m] / convergence.scale[m])
    return largest


@inlined
def find_multiple(convergence):
    """Common periods after which the motion repeats, and whether but for round-off.

    0 while it still settles.
    Steps d that shrink by a complex factor mu leave |mu d / (1 - mu)| to go, which is
    the square of the last step over the size of the second difference (Aitken).
    """
    sections, tolerance, period = (
        convergence.sections,
        convergence.tolerance,
        convergence.counts[PERIOD],
    )
    slots = sections.shape[0]
    newest = sections[period % slots]
    period_noise = relative_noise(convergence)
    for p in range(1, min((slots - 2) // 2, period // 2) + 1):
        previous = sections[(period - p) % slots]
        before = sections[(period - 2 * p) % slots]
        d = section_distance(convergence, newest, previous, before, 0.0)
        # noise of the last p periods, and of what p periods let decay of that before
        noise = max(
            min(2.0 * p * period_noise, max(tolerance, MAX_ROUNDOFF)), MIN_NOISE
        )
        if d > max(REPEATED_TOLS * tolerance, noise):
            continue
        is_round_off = d <= max(ROUNDOFF_TOLS * tolerance, noise)
        if not is_round_off:
            if d >= largest_earlier_step(convergence, p):
                continue  # it does not shrink
            second_difference = section_distance(
                convergence, newest, previous, before, 1.0
            )
            if not d * d <= tolerance * second_difference:
                continue  # the periodic motion is still further away
        if is_minimal_multiple(convergence, p):
            return p, is_round_off
    return 0, False


@inlined
def largest_earlier_step(convergence, p):
    """Largest of the steps over p periods that led to the last one."""
    sections, period = convergence.sections, convergence.counts[PERIOD]
    slots, largest = sections.shape[0], 0.0
    for n in range(1, convergence.earlier_steps + 1):
        if (n + 1) * p > min(period, slots - 1):
            break
        end, start = period - n * p, period - (n + 1) * p
        one, two = sections[end % slots], sections[start % slots]
        step = section_distance(convergence, one, two, two, 0.0)
        largest = max(largest, step)
    return largest


@inlined
def is_minimal_multiple(convergence, p):
    """Whether no shorter multiple than p is about to be reached.

    In a transient the distances to nearer sections shrink as well; on an orbit of
    period p they stay.
    """
    sections, period = convergence.sections, convergence.counts[PERIOD]
    slots = sections.shape[0]
    newest, previous = sections[period % slots], sections[(period - p) % slots]
    for q in range(1, p):
        section = sections[(period - q) % slots]
        d = section_distance(convergence, newest, section, section, 0.0)
        if d >= DISTINCT_TOLS * convergence.tolerance:
            continue
        section = sections[(period - p - q) % slots]
        previous_distance = section_distance(
            convergence, previous, section, section, 0.0
        )
        if not abs(d - previous_distance) <= STEADY_RTOL * previous_distance:
            return False
    return True


@inlined
def close_section(convergence, q, v):
    """Take up the section at the end of a period; whether the motion is periodic.

    A multiple counts when it was found several times in a row, or at once after a long
    period at whose ends nothing but round-off differs.
    """
    counts = convergence.counts
    counts[PERIOD] += 1
    set_section(convergence, q, v)
    set_scale(convergence)
    multiple, is_round_off = find_multiple(convergence)
    counts[STREAK] = (
        counts[STREAK] + 1 if multiple > 0 and multiple == counts[MULTIPLE] else 0
    )
    if is_round_off and convergence.accept_immediately:
        counts[STREAK] = max(MIN_STREAK, multiple + 1)
    counts[MULTIPLE] = multiple
    return is_settled(convergence)


@inlined
def is_settled(convergence):
    """Whether a multiple has held for long enough."""
    multiple, streak = convergence.counts[MULTIPLE], convergence.counts[STREAK]
    return multiple > 0 and streak > max(MIN_STREAK - 1, multiple)


@compiled
def close_period(convergence, q, v):
    """Close a period as `close_section` does, for motions that these kernels do not
    integrate.
    """
    return close_section(convergence, q, v)
