"""When a response has become periodic, whatever method marches it.

Sections are the modal displacements, and velocities over the natural angular
frequency, at the start of each common period. How far the periodic response still is
follows from the last steps between them, so that slow decay is not taken for rest. A
distance adds up what each mode could do to a mesh at its worst phase: a mode that
turns slowly while it decays would otherwise seem to rest whenever it passes through
zero. What the integrator itself adds from period to period is never taken for motion.
"""

from __future__ import annotations

import math

from lumped.compiled import compiled, inlined

FINISHED, NOT_FINITE = 0, 1
CALM = 3  # periods in a row, or more than an orbit: chaos passes by near unstable ones
REPEATED = 4.0  # tolerances within which two sections may be the same
APART = 50.0  # tolerances beyond which two sections are not the same
STEADY = 1e-3  # change of a distance, relative, over an orbit that has settled
SILENT = 1e-4  # tolerances below which decay is lost in round-off
ROUND_OFF = 1e-12
EPSILON = 2.3e-16  # of a step of fixed size, relative to the deflection
LOUDEST = 1e-6  # of the range: beyond it or the tolerance, noise hides no motion
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
def set_section(system, q, v, section):
    """Modal displacements and velocities over angular frequencies (2, n)."""
    rigidity = system[0]
    for i in range(q.size):
        section[0, i] = q[i]
        section[1, i] = v[i] / math.sqrt(rigidity[i])


@inlined
def set_scale(low, high, scale):
    """Range of deflection of each mesh over a period (m,), never quite 0."""
    for m in range(scale.size):
        level = QUIET * max(abs(low[m]), abs(high[m]))
        scale[m] = max(high[m] - low[m], level, TINY)


@inlined
def apart(one, two, three, second, shapes, scale):
    """Largest size of one - two in a mesh, over its scale; NaN is inf.

    one, two, three : sections (2, n)
    second : 1.0 for the second difference, one - two - (two - three), else 0.0
    shapes : (m, n) mesh deflection of each mode
    """
    largest = 0.0
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
def set_round_off(range_, steps, noise):
    """Noise of fixed steps in a period (m,) [m], from the range of deflection."""
    for m in range(noise.size):
        noise[m] = EPSILON * steps * max(abs(range_[0, m]), abs(range_[1, m]))


@inlined
def largest_part(noise, scale):
    """Noise of a period over the range of deflection, of the worst mesh."""
    largest = 0.0
    for m in range(scale.size):
        largest = max(largest, noise[m] / scale[m])
    return largest


@inlined
def settled_multiple(sections, period, shapes, scale, noise, tolerance):
    """Common periods after which the response repeats; 0 while it still settles.

    Steps d that shrink by a complex factor mu leave |mu d / (1 - mu)| to go, which is
    the square of the last step over the size of the second difference (Aitken).

    sections : (slots, 2, n), a ring of two or more beyond twice the largest multiple
    noise : (m,) what the integrator adds to the deflection in a period [m]
    """
    slots = sections.shape[0]
    now = sections[period % slots]
    grain = largest_part(noise, scale)
    for p in range(1, min((slots - 2) // 2, period // 2) + 1):
        then, before = (
            sections[(period - p) % slots],
            sections[(period - 2 * p) % slots],
        )
        d = apart(now, then, before, 0.0, shapes, scale)
        # noise of the last p periods, and of what p periods let decay of that before
        heard = max(min(2.0 * p * grain, max(tolerance, LOUDEST)), ROUND_OFF)
        if d > max(REPEATED * tolerance, heard):
            continue
        lost = d <= max(SILENT * tolerance, heard)
        if not lost:
            if d >= apart(then, before, before, 0.0, shapes, scale):
                continue  # it does not shrink
            bend = apart(now, then, before, 1.0, shapes, scale)
            if not d * d <= tolerance * bend:
                continue  # the periodic response is still further away
        if distinct(sections, period, p, shapes, scale, tolerance):
            return p
    return 0


@inlined
def distinct(sections, period, p, shapes, scale, tolerance):
    """Whether no shorter multiple than p is about to be reached.

    In a transient the distances to nearer sections shrink as well; on an orbit of
    period p they stay.
    """
    slots = sections.shape[0]
    now, then = sections[period % slots], sections[(period - p) % slots]
    for q in range(1, p):
        near = sections[(period - q) % slots]
        d = apart(now, near, near, 0.0, shapes, scale)
        if d >= APART * tolerance:
            continue
        near = sections[(period - p - q) % slots]
        before = apart(then, near, near, 0.0, shapes, scale)
        if not abs(d - before) <= STEADY * before:
            return False
    return True


@inlined
def close_period(
    sections, period, shapes, range_, noise, scale, tolerance, multiple, calm
):
    """(multiple, calm) after a period: the multiple found, how often in a row."""
    set_scale(range_[0], range_[1], scale)
    found = settled_multiple(sections, period, shapes, scale, noise, tolerance)
    return found, calm + 1 if found > 0 and found == multiple else 0


@inlined
def settled(multiple, calm):
    """Whether a multiple has held for long enough."""
    return multiple > 0 and calm > max(CALM - 1, multiple)


@compiled
def judge(sections, period, shapes, range_, noise, scale, tolerance, multiple, calm):
    """(multiple, calm, whether it has held for long enough) after a period.

    For motions that are not marched by these kernels.
    """
    multiple, calm = close_period(
        sections, period, shapes, range_, noise, scale, tolerance, multiple, calm
    )
    return multiple, calm, settled(multiple, calm)
