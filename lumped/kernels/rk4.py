"""Classical Runge-Kutta steps on a grid laid onto the corners of the excitation.

Fourth order where the excitation is smooth between the grid's points and no pair
changes its contact; a change costs an error of second order once.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.compiled import compiled, inlined
from lumped.kernels.law import note, note_before, set_acceleration
from lumped.kernels.settling import (
    FINISHED,
    NOT_FINITE,
    bounded,
    close_period,
    set_round_off,
    set_section,
    settled,
    widen,
)


@inlined
def rk4_step(system, stiffness, gap, h, q, v, work, s, later):
    """Advance q and v (n,) in place by h [s].

    stiffness, gap : (3, p) at the start, middle and end of the step
    work : (5, n), later : (m,); s : (m,) gets the deflections at the start of the step
    """
    n = q.size
    qs, vs, a, qsum, vsum = work[0], work[1], work[2], work[3], work[4]
    set_acceleration(system, stiffness[0], gap[0], q, v, a, s)
    for i in range(n):
        qsum[i] = v[i]
        vsum[i] = a[i]
        qs[i] = q[i] + 0.5 * h * v[i]
        vs[i] = v[i] + 0.5 * h * a[i]
    set_acceleration(system, stiffness[1], gap[1], qs, vs, a, later)
    for i in range(n):
        qsum[i] += 2.0 * vs[i]
        vsum[i] += 2.0 * a[i]
        qs[i] = q[i] + 0.5 * h * vs[i]
        vs[i] = v[i] + 0.5 * h * a[i]
    set_acceleration(system, stiffness[1], gap[1], qs, vs, a, later)
    for i in range(n):
        qsum[i] += 2.0 * vs[i]
        vsum[i] += 2.0 * a[i]
        qs[i] = q[i] + h * vs[i]
        vs[i] = v[i] + h * a[i]
    set_acceleration(system, stiffness[2], gap[2], qs, vs, a, later)
    for i in range(n):
        q[i] += h / 6.0 * (qsum[i] + vs[i])
        v[i] += h / 6.0 * (vsum[i] + a[i])


@compiled
def record_rk4(system, samples, periods, state, limit, out):
    """March over whole common periods and record the way.

    samples : (h, stiffness, gap), h (steps,) [s], the others (steps, 3, p)
    state : (2, n) modal displacements and velocities, advanced in place
    out : (periods * steps + 1, 6, m), see `note`
    Returns (status, steps done).
    """
    h, stiffness, gap = samples
    q, v = state[0], state[1]
    work = np.empty((5, q.size))
    s, later = np.empty(out.shape[2]), np.empty(out.shape[2])
    row = 0
    for _ in range(periods):
        for k in range(h.size):
            note(system, stiffness[k, 0], gap[k, 0], q, v, out[row])
            before = k - 1 if k > 0 else h.size - 1
            note_before(system, stiffness[before, 2], gap[before, 2], q, out[row])
            rk4_step(system, stiffness[k], gap[k], h[k], q, v, work, s, later)
            row += 1
            if not bounded(q, v, limit):
                return NOT_FINITE, row
    last = h.size - 1
    note(system, stiffness[0, 0], gap[0, 0], q, v, out[row])
    note_before(system, stiffness[last, 2], gap[last, 2], q, out[row])
    return FINISHED, row


@compiled
def settle_rk4(system, samples, settings, state):
    """March period by period until the response repeats itself.

    settings : (tolerance, limit, max_periods, multiples)
    Returns (status, period multiple or 0, common periods done).
    """
    h, stiffness, gap = samples
    tolerance, limit, max_periods, multiples = settings
    q, v = state[0], state[1]
    work = np.empty((5, q.size))
    meshes = system[3].shape[0]
    s, later = np.empty(meshes), np.empty(meshes)
    range_, noise, scale = np.empty((2, meshes)), np.empty(meshes), np.empty(meshes)
    sections = np.empty((2 * multiples + 2, 2, system[0].size))
    multiple, calm = 0, 0
    set_section(system, q, v, sections[0])
    for period in range(1, max_periods + 1):
        range_[0] = math.inf
        range_[1] = -math.inf
        for k in range(h.size):
            rk4_step(system, stiffness[k], gap[k], h[k], q, v, work, s, later)
            widen(range_[0], range_[1], s)
            if not bounded(q, v, limit):
                return NOT_FINITE, 0, period - 1 + (k + 1) / h.size
        set_section(system, q, v, sections[period % sections.shape[0]])
        set_round_off(range_, h.size, noise)
        multiple, calm = close_period(
            sections, period, system[3], range_, noise, scale, tolerance, multiple, calm
        )
        if settled(multiple, calm):
            return FINISHED, multiple, float(period)
    return FINISHED, 0, float(max_periods)
