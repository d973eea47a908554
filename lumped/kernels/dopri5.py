"""Dormand-Prince steps of order 5(4) that end on contact changes and corners.

Within a step every pair keeps its contact state, so that the right-hand side is as
smooth as the waves; a change is located on the dense output and the step repeated up
to it. Time counts periods of the first mesh.

Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19; dense output of order 4 after
Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.6.

The excitation is a tuple, p pairs with two waves each:
  place (p, 3) phase and rate of the pair's mesh, offset of its gap
  first_piece (2 p + 1,) where the pieces of each wave begin: stiffness, then gap
  breaks (pieces + 2 p,), coefficients (pieces, 4) of all waves
  stops (k,) times until all meshes repeat that no step crosses
  mesh_of (p,)
  turns (2 p, 6) of each wave where its coefficients begin and how many base pitches of
    it differ, the same of its offsets; whole base pitches that come to the position,
    and where the coefficients of the present one begin
  offsets (o,) of all waves
No step crosses from one base pitch to the next: offset and coefficients of the present
one hold for all of a step.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.compiled import compiled, compiled_part, inlined
from lumped.kernels.law import note, note_before
from lumped.kernels.settling import (
    FINISHED,
    NOT_FINITE,
    bounded,
    close_period,
    set_section,
    settled,
    widen,
)

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
CHECKS = 4  # points of a step at which contacts are compared
SHORTEST = 1e-11  # periods
MOST_STEPS = 10_000_000  # per period; beyond it a run counts as lost
EXACT = 1e-13  # periods within which a contact change is located
SAFETY, LEAST, MOST = 0.9, 0.2, 5.0  # of a new step


@inlined
def wave_at(excitation, wave, x, side):
    """A wave at position x of its cycle; side -1 takes the limit from below."""
    first_piece, breaks, coefficients = excitation[1], excitation[2], excitation[3]
    first, last = first_piece[wave], first_piece[wave + 1]
    x -= math.floor(x)
    if side < 0 and x < 1e-9:
        x += 1.0
    count = last - first
    at = first + wave  # each wave before has one break more than pieces
    piece = min(int(x * count), count - 1)
    nudged = x + 1e-10 * side
    while piece > 0 and breaks[at + piece] > nudged:
        piece -= 1
    while piece < count - 1 and breaks[at + piece + 1] <= nudged:
        piece += 1
    t = x - breaks[at + piece]
    c = coefficients[excitation[6][wave, 5] + piece]
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]))


@compiled_part
def turn_to(excitation, time, side):
    """Tell the base pitch of every pair at a time: its offset and coefficients."""
    place, first_piece, turns, offsets = (
        excitation[0],
        excitation[1],
        excitation[6],
        excitation[7],
    )
    for wave in range(turns.shape[0]):
        p = wave // 2
        x = place[p, 0] + place[p, 1] * time
        pitch = turns[wave, 4] + math.floor(x + 1e-9 * side)
        count = first_piece[wave + 1] - first_piece[wave]
        turns[wave, 5] = turns[wave, 0] + count * (pitch % turns[wave, 1])
        if wave % 2 == 1 and turns[wave, 3] > 0:
            place[p, 2] = offsets[turns[wave, 2] + pitch % turns[wave, 3]]


@inlined
def own_pitch(excitation):
    """The excitation with its own record of the present base pitch."""
    place, turns = excitation[0].copy(), excitation[6].copy()
    return (place, *excitation[1:6], turns, excitation[7])


@compiled_part
def set_excitation(excitation, time, side, stiffness, gap):
    """Stiffness and gap of every pair (p,) at a time."""
    place = excitation[0]
    for p in range(stiffness.size):
        x = place[p, 0] + place[p, 1] * time
        stiffness[p] = wave_at(excitation, 2 * p, x, side)
        gap[p] = wave_at(excitation, 2 * p + 1, x, side) + place[p, 2]


@compiled_part
def set_slope(system, contact, stiffness, gap, y, slope, s):
    """Derivative (2, n) of displacement and velocity (2, n), contacts held."""
    rigidity, damping, load, shapes, mean_stiffness, backlash, first_pair = system
    n = y.shape[1]
    for i in range(n):
        slope[0, i] = y[1, i]
        slope[1, i] = load[i] - damping[i] * y[1, i] - rigidity[i] * y[0, i]
    for m in range(shapes.shape[0]):
        s[m] = 0.0
        for i in range(n):
            s[m] += shapes[m, i] * y[0, i]
        excess = -mean_stiffness[m] * s[m]
        for p in range(first_pair[m], first_pair[m + 1]):
            if contact[p] > 0:
                excess += stiffness[p] * (s[m] - gap[p])
            elif contact[p] < 0:
                excess += stiffness[p] * (s[m] - gap[p] + backlash[m])
        for i in range(n):
            slope[1, i] -= shapes[m, i] * excess


@compiled_part
def try_step(system, excitation, contact, time, h, frequency, y, k, new, work):
    """All stages k (7, 2, n) and the end state new (2, n); returns the error norm.

    k[0] must hold the slope at the start. The norm is that of the energy.
    """
    stiffness, gap, s = work
    n = y.shape[1]
    step = h / frequency
    for stage in range(1, 7):
        for j in range(2):
            for i in range(n):
                total = 0.0
                for before in range(stage):
                    total += A[stage, before] * k[before, j, i]
                new[j, i] = y[j, i] + step * total
        side = -1 if C[stage] == 1.0 else 1
        set_excitation(excitation, time + C[stage] * h, side, stiffness, gap)
        set_slope(system, contact, stiffness, gap, new, k[stage], s)
    rigidity = system[0]
    norm = 0.0
    for i in range(n):
        dq, dv = 0.0, 0.0
        for stage in range(7):
            dq += ERROR[stage] * k[stage, 0, i]
            dv += ERROR[stage] * k[stage, 1, i]
        norm += rigidity[i] * (step * dq) ** 2 + (step * dv) ** 2
    return math.sqrt(norm)


@inlined
def energy_norm(system, y):
    """Square root of twice the energy of free vibration."""
    norm = 0.0
    for i in range(y.shape[1]):
        norm += system[0][i] * y[0, i] ** 2 + y[1, i] ** 2
    return math.sqrt(norm)


@compiled_part
def set_between(y, k, step, theta, out):
    """Dense output (2, n) at part theta of a step [s]."""
    for j in range(2):
        for i in range(y.shape[1]):
            total = 0.0
            for stage in range(7):
                d = DENSE[stage]
                poly = theta * (d[0] + theta * (d[1] + theta * (d[2] + theta * d[3])))
                total += k[stage, j, i] * poly
            out[j, i] = y[j, i] + step * total


@inlined
def elastic(system, excitation, p, y, time, side):
    """Deflection minus gap of a pair [m]."""
    shapes = system[3]
    m = excitation[5][p]
    s = 0.0
    for i in range(y.shape[1]):
        s += shapes[m, i] * y[0, i]
    place = excitation[0]
    x = place[p, 0] + place[p, 1] * time
    return s - wave_at(excitation, 2 * p + 1, x, side) - place[p, 2]


@inlined
def state_of(e, backlash):
    """Contact state: 1 drive side, 0 lost, -1 back side."""
    if e > 0.0:
        return 1
    return -1 if e < -backlash else 0


@compiled_part
def change_within(system, excitation, contact, time, h, frequency, y, k, probe):
    """Part of the step at which the first pair changes its contact, and the pair.

    (2.0, -1) if none does. Looks at CHECKS points and bisects before the first one
    at which a state is no longer what it was.
    """
    step = h / frequency
    backlash, mesh_of = system[5], excitation[5]
    low = 0.0
    for check in range(1, CHECKS + 1):
        high = check / CHECKS
        set_between(y, k, step, high, probe)
        side = -1 if check == CHECKS else 1
        for p in range(contact.size):
            e = elastic(system, excitation, p, probe, time + high * h, side)
            if state_of(e, backlash[mesh_of[p]]) != contact[p]:
                found = _bisect(
                    system, excitation, contact, time, h, step, y, k, probe, low, high
                )
                return found
        low = high
    return 2.0, -1


@compiled_part
def _bisect(system, excitation, contact, time, h, step, y, k, probe, low, high):
    """Narrow (low, high] down to the first change; returns its end and the pair."""
    backlash, mesh_of = system[5], excitation[5]
    changed = -1
    while True:
        middle = 0.5 * (low + high)
        done = (high - low) * h <= EXACT or middle <= low or middle >= high
        at = high if done else middle
        set_between(y, k, step, at, probe)
        found = -1
        for p in range(contact.size):
            e = elastic(system, excitation, p, probe, time + at * h, -1)
            if found < 0 and state_of(e, backlash[mesh_of[p]]) != contact[p]:
                found = p
        if done:
            return high, found if found >= 0 else changed
        if found >= 0:
            high, changed = middle, found
        else:
            low = middle


@compiled_part
def advance(system, excitation, rules, span, y, contact, buffers, grid, out, range_):
    """March y (2, n) over span (from, to); returns (status, time reached, error).

    The error is the sum of what the steps' estimates say, in the norm of the energy.

    rules : (accuracy, limit, frequency, size): energy norm that counts as moderate
    grid : (g,) times at which to record into out (g, 6, m); may be empty
    range_ : (2, m) smallest and largest deflection at the steps' ends
    """
    accuracy, limit, frequency, size = rules
    k, new, probe, stiffness, gap, s, trial = buffers
    work = (stiffness, gap, s)
    stops = excitation[4]
    time, end = span
    stop, row = 0, 0
    h = 1.0 / 64.0
    fresh = True
    total = 0.0
    left = MOST_STEPS * (1.0 + end - time)
    while time < end:
        left -= 1.0
        if left < 0.0:
            return NOT_FINITE, time, total
        while stop < stops.size and stops[stop] <= time + SHORTEST:
            stop += 1
        until = min(end, stops[stop]) if stop < stops.size else end
        if fresh:
            turn_to(excitation, time, 1)
            set_contacts(system, excitation, y, time, contact)
            fresh = False
        set_excitation(excitation, time, 1, stiffness, gap)
        set_slope(system, contact, stiffness, gap, y, k[0], s)
        widen(range_[0], range_[1], s)
        remaining = until - time
        last = h >= remaining - SHORTEST
        h_now = remaining if last else h
        error = try_step(
            system, excitation, contact, time, h_now, frequency, y, k, new, work
        )
        scale = accuracy * (
            size + max(energy_norm(system, y), energy_norm(system, new))
        )
        if not error <= scale and h_now > SHORTEST:
            if not error < math.inf:
                h = LEAST * h_now
                if h < SHORTEST:
                    return NOT_FINITE, time, total
            else:
                h = h_now * max(LEAST, SAFETY * (scale / error) ** 0.2)
            continue
        part, changed = change_within(
            system, excitation, contact, time, h_now, frequency, y, k, probe
        )
        grown = h_now * min(MOST, SAFETY * (scale / max(error, 1e-300)) ** 0.2)
        if changed >= 0 and part < 1.0:
            h_now = max(part * h_now, SHORTEST)
            last = False
            error = try_step(
                system, excitation, contact, time, h_now, frequency, y, k, new, work
            )
        while row < grid.size and grid[row] <= time + h_now:
            theta = (grid[row] - time) / h_now
            set_between(y, k, h_now / frequency, theta, trial)
            record_row(system, excitation, trial, grid[row], stiffness, gap, out[row])
            turn_to(excitation, time, 1)
            row += 1
        y[:] = new
        total += error
        time = until if last else time + h_now
        h = max(grown, SHORTEST)
        if changed >= 0:
            flip(system, excitation, contact, changed, y, time)
        fresh = last
        if not bounded(y[0], y[1], limit):
            return NOT_FINITE, time, total
    return FINISHED, time, total


@compiled_part
def record_row(system, excitation, y, time, stiffness, gap, out):
    turn_to(excitation, time, 1)
    set_excitation(excitation, time, 1, stiffness, gap)
    note(system, stiffness, gap, y[0], y[1], out)
    turn_to(excitation, time, -1)
    set_excitation(excitation, time, -1, stiffness, gap)
    note_before(system, stiffness, gap, y[0], out)


@compiled_part
def set_contacts(system, excitation, y, time, contact):
    """Contact states from the overlaps, as they are just after a time."""
    for p in range(contact.size):
        e = elastic(system, excitation, p, y, time, 1)
        contact[p] = state_of(e, system[5][excitation[5][p]])


@compiled_part
def flip(system, excitation, contact, p, y, time):
    """The state that pair p enters: from the nearer of its two borders."""
    backlash = system[5][excitation[5][p]]
    if contact[p] == 0:
        e = elastic(system, excitation, p, y, time, 1)
        contact[p] = 1 if abs(e) <= abs(e + backlash) else -1
    else:
        contact[p] = 0 if backlash > 0.0 else -contact[p]


@inlined
def set_noise(system, error, noise):
    """Deflection of each mesh (m,) [m] that an error in the energy norm may mean."""
    rigidity, shapes = system[0], system[3]
    for m in range(noise.size):
        square = 0.0
        for i in range(rigidity.size):
            square += shapes[m, i] ** 2 / rigidity[i]
        noise[m] = error * math.sqrt(square)


@inlined
def make_buffers(system, excitation):
    n, m, p = system[0].size, system[3].shape[0], excitation[5].size
    return (
        np.empty((7, 2, n)),
        np.empty((2, n)),
        np.empty((2, n)),
        np.empty(p),
        np.empty(p),
        np.empty(m),
        np.empty((2, n)),
    )


@compiled
def record_dopri5(system, excitation, rules, span, state, grid, out):
    """March over a span and record at the grid's times; returns (status, time)."""
    buffers = make_buffers(system, excitation)
    contact = np.zeros(excitation[5].size, np.int64)
    range_ = np.zeros((2, system[3].shape[0]))
    here = own_pitch(excitation)
    status, time, _ = advance(
        system, here, rules, span, state, contact, buffers, grid, out, range_
    )
    return status, time


@compiled
def settle_dopri5(system, excitation, rules, settings, span, state):
    """March period by period until the response repeats itself.

    settings : (tolerance, max_periods, multiples)
    span : (periods until all meshes repeat, rounds of them in a common period, base
        pitches (2 p,) by which each wave is further on after a round)
    Returns (status, period multiple or 0, common periods done).
    """
    tolerance, max_periods, multiples = settings
    length, rounds, turns = span
    buffers = make_buffers(system, excitation)
    contact = np.zeros(excitation[5].size, np.int64)
    meshes = system[3].shape[0]
    range_, noise, scale = np.empty((2, meshes)), np.empty(meshes), np.empty(meshes)
    sections = np.empty((2 * multiples + 2, 2, system[0].size))
    here = own_pitch(excitation)
    none, no_rows = np.empty(0), np.empty((0, 6, meshes))
    multiple, calm = 0, 0
    set_section(system, state[0], state[1], sections[0])
    for period in range(1, max_periods + 1):
        range_[0] = math.inf
        range_[1] = -math.inf
        error = 0.0
        for number in range(rounds):
            here[6][:, 4] = excitation[6][:, 4] + number * turns
            status, time, part = advance(
                system,
                here,
                rules,
                (0.0, length),
                state,
                contact,
                buffers,
                none,
                no_rows,
                range_,
            )
            error += part
            if status != FINISHED:
                done = (number + time / length) / rounds
                return NOT_FINITE, 0, period - 1 + done
        set_section(system, state[0], state[1], sections[period % sections.shape[0]])
        set_noise(system, error, noise)
        multiple, calm = close_period(
            sections, period, system[3], range_, noise, scale, tolerance, multiple, calm
        )
        if settled(multiple, calm):
            return FINISHED, multiple, float(period)
    return FINISHED, 0, float(max_periods)
