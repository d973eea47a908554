"""Classical Runge-Kutta steps on a grid laid onto the corners of the excitation.

Fourth order where the excitation is smooth between the grid's points and no pair
changes its contact; a change costs an error of second order once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lumped.common.compiled import compiled, dispatch_by_record, inlined
from lumped.kernels.arrays import (
    BearingSamples,
    ExcitationSamples,
    FrictionSamples,
    SpaceSamples,
    VariedSteps,
)
from lumped.kernels.bearing_force import record_bearings, set_bearing_acceleration
from lumped.kernels.convergence import (
    FINISHED,
    NOT_FINITE,
    begin_period,
    close_section,
    is_bounded,
    set_error_bound,
    update_force_limits,
    update_limits,
)
from lumped.kernels.friction import record_friction, set_friction_acceleration
from lumped.kernels.mesh_force import (
    record,
    record_before,
    record_state,
    set_spring_acceleration,
)
from lumped.kernels.space_force import record_space, set_space_acceleration
from lumped.kernels.tangent import normalise_perturbations, set_varied_acceleration

STEPS_PER_RESCALING = 64  # steps after which small changes are brought back to length 1


@inlined
def record_springs(system, samples, k, q, v, out):
    """The meshes (6, m) at the start of step k; see `record`."""
    before = k - 1 if k > 0 else samples.h.size - 1
    record(system, samples.stiffness[k, 0], samples.gap[k, 0], q, v, out)
    record_before(system, samples.stiffness[before, 2], samples.gap[before, 2], q, out)


def set_acceleration(system, steps, instant, q, v, a, s):
    """Modal accelerations (n,) and mesh deflections (m,) at an instant.

    Of springs along Samples, of springs with friction along FrictionSamples, with
    rolling bearings along BearingSamples, of gears that move in space along
    SpaceSamples, of springs and small changes of the motion along VariedSteps.
    """
    kernel: Any = set_spring_acceleration
    if isinstance(steps, FrictionSamples):
        kernel = set_friction_acceleration
    elif isinstance(steps, BearingSamples):
        kernel = set_bearing_acceleration
    elif isinstance(steps, SpaceSamples):
        kernel = set_space_acceleration
    elif isinstance(steps, VariedSteps):
        kernel = set_varied_acceleration
    kernel(system, steps, instant, q, v, a, s)


def record_row(system, steps, k, q, v, out):
    """The meshes (6, m) at the start of step k; see `mesh_force.record`."""
    kernel: Any = record_springs
    if isinstance(steps, FrictionSamples):
        kernel = record_friction
    elif isinstance(steps, BearingSamples):
        kernel = record_bearings
    elif isinstance(steps, SpaceSamples):
        kernel = record_space
    kernel(system, steps, k, q, v, out)


dispatch_by_record(
    set_acceleration,
    {
        ExcitationSamples: set_spring_acceleration,
        FrictionSamples: set_friction_acceleration,
        BearingSamples: set_bearing_acceleration,
        SpaceSamples: set_space_acceleration,
        VariedSteps: set_varied_acceleration,
    },
)
dispatch_by_record(
    record_row,
    {
        ExcitationSamples: record_springs,
        FrictionSamples: record_friction,
        BearingSamples: record_bearings,
        SpaceSamples: record_space,
    },
)


@inlined
def rk4_step(system, samples, k, q, v, work, s, scratch):
    """Advance q and v (n,) in place by step k of the samples.

    Runge-Kutta's classical rule, Hairer, Norsett and Wanner, Solving Ordinary
    Differential Equations I, table II.1.2.

    work : (5, n), scratch : (m,); s : (m,) deflections at the start of the step
    """
    h, n = samples.h[k], q.size
    qs, vs, a, qsum, vsum = work[0], work[1], work[2], work[3], work[4]
    set_acceleration(system, samples, (k, 0), q, v, a, s)
    for i in range(n):
        qsum[i] = v[i]
        vsum[i] = a[i]
        qs[i] = q[i] + 0.5 * h * v[i]
        vs[i] = v[i] + 0.5 * h * a[i]
    set_acceleration(system, samples, (k, 1), qs, vs, a, scratch)
    for i in range(n):
        qsum[i] += 2.0 * vs[i]
        vsum[i] += 2.0 * a[i]
        qs[i] = q[i] + 0.5 * h * vs[i]
        vs[i] = v[i] + 0.5 * h * a[i]
    set_acceleration(system, samples, (k, 1), qs, vs, a, scratch)
    for i in range(n):
        qsum[i] += 2.0 * vs[i]
        vsum[i] += 2.0 * a[i]
        qs[i] = q[i] + h * vs[i]
        vs[i] = v[i] + h * a[i]
    set_acceleration(system, samples, (k, 2), qs, vs, a, scratch)
    for i in range(n):
        q[i] += h / 6.0 * (qsum[i] + vs[i])
        v[i] += h / 6.0 * (vsum[i] + a[i])


@compiled
def record_motion(system, samples, periods, state, limit, out, states):
    """Integrate over whole common periods and record the motion.

    system : ModalSystem; samples : Samples, h in [s]
    state : (2, n) modal displacements and velocities, advanced in place
    out : (periods * steps + 1, 6, m), see `record`
    states : (periods * steps + 1, 2, n) records the states, or (0, 2, n)
    Returns (status, steps done).
    """
    q, v = state[0], state[1]
    work = np.empty((5, q.size))
    s, scratch = np.empty(out.shape[2]), np.empty(out.shape[2])
    steps = samples.h.size
    for row in range(periods * steps):
        k = row % steps
        record_row(system, samples, k, q, v, out[row])
        record_state(states, row, q, v)
        rk4_step(system, samples, k, q, v, work, s, scratch)
        if not is_bounded(q, v, limit):
            return NOT_FINITE, row + 1
    record_row(system, samples, 0, q, v, out[-1])
    record_state(states, periods * steps, q, v)
    return FINISHED, periods * steps


@compiled
def settle_motion(system, samples, limit, state, convergence, max_periods):
    """Integrate period by period until the motion repeats itself.

    convergence : Convergence, closed after each of at most so many periods
    Returns (status, part of a period before a divergence, whether it repeats itself).
    """
    q, v = state[0], state[1]
    work, meshes = np.empty((5, q.size)), system.shapes.shape[0]
    s, scratch = np.empty(meshes), np.empty(meshes)
    steps = samples.h.size
    for _ in range(max_periods):
        begin_period(convergence)
        for k in range(steps):
            rk4_step(system, samples, k, q, v, work, s, scratch)
            update_limits(convergence.limits, s)
            update_force_limits(convergence, q)
            if not is_bounded(q, v, limit):
                return NOT_FINITE, (k + 1) / steps, False
        set_error_bound(convergence, steps)
        if close_section(convergence, q, v):
            return FINISHED, 0.0, True
    return FINISHED, 0.0, False


@compiled
def integrate_variations(system, varied, limit, state, angular, sections, growth):
    """Integrate a motion with small changes of it over whole common periods.

    varied : VariedSteps; state : (2, n (1 + k)) the motion, then k changes one after
        the other, advanced in place; together they are rescaled to length 1
    angular : (n,) [rad/s] by which velocities count in that length
    sections : (periods, 6, m) or more rows, at the start of each; see `record`
    growth : (periods,) logarithm of how much the changes have grown in each
    Returns (status, periods done).
    """
    q, v, n = state[0], state[1], angular.size
    work = np.empty((5, q.size))
    s, scratch = np.empty(sections.shape[2]), np.empty(sections.shape[2])
    steps = varied.h.size
    for period in range(growth.size):
        record_row(system, varied.steps, 0, q[:n], v[:n], sections[period])
        growth[period] = 0.0
        for k in range(steps):
            rk4_step(system, varied, k, q, v, work, s, scratch)
            if not is_bounded(q[:n], v[:n], limit):
                return NOT_FINITE, period
            if k % STEPS_PER_RESCALING == 0 or k == steps - 1:
                growth[period] += normalise_perturbations(q, v, angular)
    return FINISHED, growth.size
