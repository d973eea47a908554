"""Dormand-Prince steps of order 5(4) that end on contact changes and corners.

Within a step every pair keeps its contact state, so that the right-hand side is as
smooth as the waves; a change is located on the dense output and the step repeated up
to it. Time counts periods of the first mesh.

Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19; dense output of order 4 after
Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.6.

The excitation is a `lumped.kernels.arrays.Pieces`, its own of a call.
No step crosses from one base pitch to the next: offset and coefficients of the present
one hold for all of a step.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import allocating, compiled, compiled_part, inlined
from lumped.kernels.arrays import OFFSET, PITCH, AdaptiveWork
from lumped.kernels.convergence import (
    FINISHED,
    NOT_FINITE,
    begin_period,
    close_section,
    is_bounded,
    update_limits,
)
from lumped.kernels.excitation_at import position, set_excitation, set_pitch, value_at
from lumped.kernels.mesh_force import record, record_before, record_state

C = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
ERROR = np.array(
    [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]
)
# dense output: y(theta) = y + h sum_s k_s (D[s,0] theta + ... + D[s,3] theta^4)
DENSE = np.array(
    [
        [1, -8048581381 / 2820520608, 8663915743 / 2820520608, 0],
        [0, 0, 0, 0],
        [0, 131558114200 / 32700410799, -68118460800 / 10900136933, 0],
        [0, -1754552775 / 470086768, 14199869525 / 1410260304, 0],
        [0, 127303824393 / 49829197408, -318862633887 / 49829197408, 0],
        [0, -282668133 / 205662961, 2019193451 / 616988883, 0],
        [0, 40617522 / 29380423, -110615467 / 29380423, 0],
    ]
)
DENSE[:, 3] = [
    -12715105075 / 11282082432,
    0,
    87487479700 / 32700410799,
    -10690763975 / 1880347072,
    701980252875 / 199316789632,
    -1453857185 / 822651844,
    69997945 / 29380423,
]
CONTACT_CHECKS = 4  # points of a step at which contacts are compared
MIN_STEP = 1e-11  # periods
MAX_STEPS = 10_000_000  # per period; beyond it a run counts as lost
EVENT_TOL_PERIODS = 1e-13  # periods within which a contact change is located
SAFETY, MIN_STEP_RATIO, MAX_STEP_RATIO = 0.9, 0.2, 5.0  # of a new step


@compiled_part
def set_slope(system, contact, stiffness, gap, y, slope, s):
    """Derivative (2, n) of displacement and velocity (2, n), contacts held.

    s : (m,) gets the mesh deflections
    """
    shapes, backlash, first_pair = system.shapes, system.backlash, system.first_pair
    n = y.shape[1]
    for i in range(n):
        slope[0, i] = y[1, i]
        slope[1, i] = system.load[i] - system.damping[i] * y[1, i]
        slope[1, i] -= system.rigidity[i] * y[0, i]
    for m in range(shapes.shape[0]):
        s[m] = 0.0
        for i in range(n):
            s[m] += shapes[m, i] * y[0, i]
        excess = -system.mean_stiffness[m] * s[m]
        for p in range(first_pair[m], first_pair[m + 1]):
            if contact[p] > 0:
                excess += stiffness[p] * (s[m] - gap[p])
            elif contact[p] < 0:
                excess += stiffness[p] * (s[m] - gap[p] + backlash[m])
        for i in range(n):
            slope[1, i] -= shapes[m, i] * excess


@compiled_part
def try_step(system, excitation, frequency, work, time, h, y):
    """All stages and the state at the end of a step; returns the error norm.

    The slope at the start must be there already. The norm is that of the energy.
    """
    slopes, end, n = work.slopes, work.end, y.shape[1]
    contact, stiffness, gap, s = work.contact, work.stiffness, work.gap, work.deflection
    step = h / frequency
    for stage in range(1, 7):
        for j in range(2):
            for i in range(n):
                total = 0.0
                for earlier in range(stage):
                    total += A[stage, earlier] * slopes[earlier, j, i]
                end[j, i] = y[j, i] + step * total
        side = -1 if C[stage] == 1.0 else 1
        set_excitation(excitation, time + C[stage] * h, side, stiffness, gap)
        set_slope(system, contact, stiffness, gap, end, slopes[stage], s)
    norm = 0.0
    for i in range(n):
        dq, dv = 0.0, 0.0
        for stage in range(7):
            dq += ERROR[stage] * slopes[stage, 0, i]
            dv += ERROR[stage] * slopes[stage, 1, i]
        norm += system.rigidity[i] * (step * dq) ** 2 + (step * dv) ** 2
    return math.sqrt(norm)


@inlined
def accept_step(end, y):
    """The state at the end of a step (2, n) becomes that at the next one's start."""
    for j in range(2):
        for i in range(y.shape[1]):
            y[j, i] = end[j, i]


@inlined
def energy_norm(system, y):
    """Square root of twice the energy of free vibration."""
    norm = 0.0
    for i in range(y.shape[1]):
        norm += system.rigidity[i] * y[0, i] ** 2 + y[1, i] ** 2
    return math.sqrt(norm)


@compiled_part
def set_dense_output(slopes, y, step, theta, out):
    """Dense output (2, n) at part theta of a step [s]."""
    for j in range(2):
        for i in range(y.shape[1]):
            total = 0.0
            for stage in range(7):
                d = DENSE[stage]
                poly = theta * (d[0] + theta * (d[1] + theta * (d[2] + theta * d[3])))
                total += slopes[stage, j, i] * poly
            out[j, i] = y[j, i] + step * total


@inlined
def elastic_deflection(system, excitation, p, y, time, side):
    """Deflection minus gap of a pair [m]."""
    m = excitation.mesh_of[p]
    s = 0.0
    for i in range(y.shape[1]):
        s += system.shapes[m, i] * y[0, i]
    x = position(excitation, p, time)
    gap = value_at(excitation, 2 * p + 1, x, side)
    return s - gap - excitation.pair_positions[p, OFFSET]


@inlined
def contact_state(e, backlash):
    """Contact state: 1 drive side, 0 lost, -1 back side."""
    if e > 0.0:
        return 1
    return -1 if e < -backlash else 0


@inlined
def first_changed_pair(system, excitation, work, time, side):
    """The first pair whose contact in the probed state is not what it was, or -1."""
    for p in range(work.contact.size):
        e = elastic_deflection(system, excitation, p, work.probe, time, side)
        backlash = system.backlash[excitation.mesh_of[p]]
        if contact_state(e, backlash) != work.contact[p]:
            return p
    return -1


@compiled_part
def locate_contact_change(system, excitation, frequency, work, time, h, y):
    """Part of the step at which the first pair changes its contact, and the pair.

    (2.0, -1) if none does. Looks at CONTACT_CHECKS points and bisects before the first
    one at which a state is no longer what it was.
    """
    step = h / frequency
    low, high, changed, check = 0.0, 0.0, -1, 0
    while changed < 0:
        if check == CONTACT_CHECKS:
            return 2.0, -1
        check += 1
        low, high = high, check / CONTACT_CHECKS
        set_dense_output(work.slopes, y, step, high, work.probe)
        side = -1 if check == CONTACT_CHECKS else 1
        changed = first_changed_pair(system, excitation, work, time + high * h, side)
    changed = -1
    while True:
        middle = 0.5 * (low + high)
        done = (high - low) * h <= EVENT_TOL_PERIODS or middle <= low or middle >= high
        fraction = high if done else middle
        set_dense_output(work.slopes, y, step, fraction, work.probe)
        pair = first_changed_pair(system, excitation, work, time + fraction * h, -1)
        if done:
            return high, pair if pair >= 0 else changed
        if pair >= 0:
            high, changed = middle, pair
        else:
            low = middle


@compiled_part
def advance(system, excitation, rules, work, y, span, grid, recorded):
    """Integrate y (2, n) over span (from, to); returns (status, time reached, error).

    The error is the sum of what the steps' estimates say, in the norm of the energy.

    grid : (g,) times at which to record, may be empty; recorded : out (g, 6, m) and
        states (g, 2, n) or (0, 2, n)
    """
    frequency, stops = rules.frequency, excitation.stops
    contact, stiffness, gap, s = work.contact, work.stiffness, work.gap, work.deflection
    time, end = span
    stop, row, h, at_corner, total = 0, 0, 1.0 / 64.0, True, 0.0
    steps_left = MAX_STEPS * (1.0 + end - time)
    while time < end:
        steps_left -= 1.0
        if steps_left < 0.0:
            return NOT_FINITE, time, total
        while stop < stops.size and stops[stop] <= time + MIN_STEP:
            stop += 1
        step_end = min(end, stops[stop]) if stop < stops.size else end
        if at_corner:
            set_pitch(excitation, time, 1)
            set_contacts(system, excitation, work, y, time)
            at_corner = False
        set_excitation(excitation, time, 1, stiffness, gap)
        set_slope(system, contact, stiffness, gap, y, work.slopes[0], s)
        update_limits(work.limits, s)
        last = h >= step_end - time - MIN_STEP
        h_now = step_end - time if last else h
        error = try_step(system, excitation, frequency, work, time, h_now, y)
        size = max(energy_norm(system, y), energy_norm(system, work.end))
        scale = rules.accuracy * (rules.velocity_scale + size)
        if not error <= scale and h_now > MIN_STEP:
            h = h_now * max(MIN_STEP_RATIO, SAFETY * (scale / error) ** 0.2)
            if not error < math.inf:
                h = MIN_STEP_RATIO * h_now
                if h < MIN_STEP:
                    return NOT_FINITE, time, total
            continue
        part, changed = locate_contact_change(
            system, excitation, frequency, work, time, h_now, y
        )
        h = h_now * min(MAX_STEP_RATIO, SAFETY * (scale / max(error, 1e-300)) ** 0.2)
        h = max(h, MIN_STEP)
        if changed >= 0 and part < 1.0:
            h_now = max(part * h_now, MIN_STEP)
            last = False
            error = try_step(system, excitation, frequency, work, time, h_now, y)
        while row < grid.size and grid[row] <= time + h_now:
            theta = (grid[row] - time) / h_now
            set_dense_output(work.slopes, y, h_now / frequency, theta, work.trial)
            record_row(system, excitation, work, grid[row], row, recorded)
            set_pitch(excitation, time, 1)
            row += 1
        accept_step(work.end, y)
        total += error
        time = step_end if last else time + h_now
        if changed >= 0:
            switch_contact(system, excitation, work, changed, y, time)
        at_corner = last
        if not is_bounded(y[0], y[1], rules.limit):
            return NOT_FINITE, time, total
    return FINISHED, time, total


@compiled_part
def record_row(system, excitation, work, time, row, recorded):
    """Record the trial state as a row, see `record` and `record_state`."""
    q, v, out = work.trial[0], work.trial[1], recorded[0][row]
    record_state(recorded[1], row, q, v)
    set_pitch(excitation, time, 1)
    set_excitation(excitation, time, 1, work.stiffness, work.gap)
    record(system, work.stiffness, work.gap, q, v, out)
    set_pitch(excitation, time, -1)
    set_excitation(excitation, time, -1, work.stiffness, work.gap)
    record_before(system, work.stiffness, work.gap, q, out)


@compiled_part
def set_contacts(system, excitation, work, y, time):
    """Contact states from the overlaps, as they are just after a time."""
    for p in range(work.contact.size):
        e = elastic_deflection(system, excitation, p, y, time, 1)
        work.contact[p] = contact_state(e, system.backlash[excitation.mesh_of[p]])


@compiled_part
def switch_contact(system, excitation, work, p, y, time):
    """The state that pair p enters: from the nearer of its two borders."""
    backlash, contact = system.backlash[excitation.mesh_of[p]], work.contact
    if contact[p] == 0:
        e = elastic_deflection(system, excitation, p, y, time, 1)
        contact[p] = 1 if abs(e) <= abs(e + backlash) else -1
    else:
        contact[p] = 0 if backlash > 0.0 else -contact[p]


@inlined
def set_error_bound(system, error, noise):
    """Deflection of each mesh (m,) [m] that an error in the energy norm may mean."""
    rigidity, shapes = system.rigidity, system.shapes
    for m in range(noise.size):
        square = 0.0
        for i in range(rigidity.size):
            square += shapes[m, i] ** 2 / rigidity[i]
        noise[m] = error * math.sqrt(square)


@allocating
def make_work(system, excitation, limits):
    n, m, p = system.rigidity.size, system.shapes.shape[0], excitation.mesh_of.size
    return AdaptiveWork(
        np.zeros(p, np.int64),
        np.empty((7, 2, n)),
        np.empty((2, n)),
        np.empty((2, n)),
        np.empty((2, n)),
        np.empty(p),
        np.empty(p),
        np.empty(m),
        limits,
    )


@compiled
def record_dopri5(system, excitation, rules, span, state, grid, recorded):
    """Integrate over a span and record at the grid's times; returns (status, time).

    rules : AdaptiveRules; recorded : see `advance`
    """
    work = make_work(system, excitation, np.zeros((2, system.shapes.shape[0])))
    arguments = work, state, span, grid, recorded
    status, time, _ = advance(system, excitation, rules, *arguments)
    return status, time


@compiled
def settle_dopri5(
    system, excitation, rules, repetition, state, convergence, max_periods
):
    """Integrate period by period until the motion repeats itself.

    repetition : (periods until all meshes repeat, how many of them are a common period,
        base pitches (2 p,) by which each function is further on after one)
    convergence : Convergence, closed after each of at most so many periods
    Returns (status, part of a period before a divergence, whether it repeats itself).
    """
    length, count, pitches = repetition
    work = make_work(system, excitation, convergence.limits)
    first = excitation.pitches[:, PITCH].copy()
    no_times, no_rows = np.empty(0), np.empty((0, 6, system.shapes.shape[0]))
    nowhere = no_rows, np.empty((0, 2, state.shape[1]))
    for _ in range(max_periods):
        begin_period(convergence)
        error = 0.0
        for number in range(count):
            excitation.pitches[:, PITCH] = first + number * pitches
            status, time, part = advance(
                system, excitation, rules, work, state, (0.0, length), no_times, nowhere
            )
            error += part
            if status != FINISHED:
                return NOT_FINITE, (number + time / length) / count, False
        set_error_bound(system, error, convergence.error_bound)
        if close_section(convergence, state[0], state[1]):
            return FINISHED, 0.0, True
    return FINISHED, 0.0, False
