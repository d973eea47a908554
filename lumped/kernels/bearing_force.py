"""Force of a rolling bearing on the ring that it supports, compiled.

The samples are `lumped.kernels.arrays.BearingSamples`. The rotation of every inner ring
is a coordinate behind those of the modes, which nothing accelerates: its velocity is
the speed of the shaft. So the cage goes on from one common period to the next.
"""

from __future__ import annotations

import math

from lumped.common.compiled import inlined
from lumped.kernels.arrays import (
    AMPLITUDE,
    CAGE_RATIO,
    COEFFICIENT,
    EXPONENT,
    FREE_GAP,
    ON_INNER,
    ORDER,
    RUNOUT,
    WAVE_PHASE,
)
from lumped.kernels.mesh_force import record, record_before, set_spring_acceleration


@inlined
def element_load(approach, coefficient, exponent):
    """Load [N] on an element at an approach of both races [m]."""
    if approach <= 0.0:
        return 0.0
    if exponent == 1.5:
        return coefficient * approach * math.sqrt(approach)
    return coefficient * approach**exponent


@inlined
def waviness(samples, b, shaft, on_outer):
    """Excess of material of both races [m] at an angle on the outer one."""
    total = 0.0
    for w in range(samples.first_wave[b], samples.first_wave[b + 1]):
        wave = samples.waves[w]
        angle = on_outer - wave[ON_INNER] * shaft
        total += wave[AMPLITUDE] * math.cos(wave[ORDER] * angle + wave[WAVE_PHASE])
    return total


@inlined
def ring_force(samples, b, x, y, shaft):
    """Force (x, y) [N] that moves the ring of bearing b to x, y [m].

    shaft : rotation of the inner ring [rad]
    """
    parameters = samples.parameters[b]
    cage = parameters[CAGE_RATIO] * shaft
    cosine, sine = math.cos(cage), math.sin(cage)
    # an eccentric race moves as its ring does
    race_x, race_y = x, y
    if parameters[RUNOUT] > 0.0:
        race_x += parameters[RUNOUT] * math.cos(shaft)
        race_y += parameters[RUNOUT] * math.sin(shaft)
    has_waves = samples.first_wave[b + 1] > samples.first_wave[b]
    force_x, force_y = 0.0 * x, 0.0 * y  # NaN stays NaN
    for e in range(samples.first_element[b], samples.first_element[b + 1]):
        c = cosine * samples.cosines[e] - sine * samples.sines[e]
        s = sine * samples.cosines[e] + cosine * samples.sines[e]
        # eq. 6.6 of the multi-mesh source, of both contacts together
        approach = race_x * c + race_y * s - parameters[FREE_GAP]
        if has_waves:
            approach += waviness(samples, b, shaft, cage + samples.angles[e])
        load = element_load(approach, parameters[COEFFICIENT], parameters[EXPONENT])
        force_x += load * c
        force_y += load * s
    return force_x, force_y


@inlined
def displacement(samples, b, q):
    """Displacement (x, y) [m] of the ring of bearing b."""
    rows = samples.rows[b]
    x, y = 0.0, 0.0
    for i in range(q.size):
        x += rows[0, i] * q[i]
        y += rows[1, i] * q[i]
    return x, y


@inlined
def set_bearing_acceleration(system, samples, instant, q, v, a, s):
    """Set accelerations and deflections, with forces of bearings beyond springs."""
    set_spring_acceleration(system, samples, instant, q, v, a, s)
    bearings = samples.parameters.shape[0]
    first_rotation = q.size - bearings
    for b in range(bearings):
        rows, reference = samples.rows[b], samples.reference[b]
        x, y = displacement(samples, b, q)
        force_x, force_y = ring_force(samples, b, x, y, q[first_rotation + b])
        # the springs are in the rigidity
        force_x -= reference[0, 0] * x + reference[0, 1] * y
        force_y -= reference[1, 0] * x + reference[1, 1] * y
        for i in range(first_rotation):
            a[i] -= rows[0, i] * force_x + rows[1, i] * force_y


@inlined
def record_bearings(system, samples, k, q, v, out):
    """The meshes (6, m) at the start of step k, see `record`, and behind them, row by
    row, displacement and force (x, y, Fx, Fy) of every bearing.
    """
    before = k - 1 if k > 0 else samples.h.size - 1
    record(system, samples.stiffness[k, 0], samples.gap[k, 0], q, v, out)
    record_before(system, samples.stiffness[before, 2], samples.gap[before, 2], q, out)
    bearings, meshes = samples.parameters.shape[0], out.shape[1]
    for b in range(bearings):
        x, y = displacement(samples, b, q)
        force_x, force_y = ring_force(samples, b, x, y, q[q.size - bearings + b])
        first = 4 * b
        out[6 + first // meshes, first % meshes] = x
        out[6 + (first + 1) // meshes, (first + 1) % meshes] = y
        out[6 + (first + 2) // meshes, (first + 2) % meshes] = force_x
        out[6 + (first + 3) // meshes, (first + 3) % meshes] = force_y
