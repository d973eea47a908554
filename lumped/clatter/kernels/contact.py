"""Sustained contact: forces, which contacts hold, and motion under them; compiled.

Contact forces are a complementarity problem like impulses. While teeth rest on each
other, the damped coordinates are coupled; their motion is a Taylor series to round-off.
"""

from __future__ import annotations

import math

from lumped.clatter.kernels.edge_waves import (
    derive_drives,
    evaluate_drive,
    evaluate_excitation,
)
from lumped.clatter.kernels.impact import fill_delassus, solve_basis, solve_lcp
from lumped.common.compiled import compiled_part, inlined

N_TERMS = 19  # of a series


@inlined
def evaluate_plays(box, work, t, q, v):
    """Plays and their derivatives in `work.s`, of coordinates that fly."""
    e, e1, e2, e3, _ = evaluate_excitation(box, t)
    for p in range(box.ratios.size):
        s, s1, s2, s3 = evaluate_drive(box, p, t, (e, e1, e2, e3))
        for i in range(box.drag_acceleration.size):
            row = box.rows[p, i]
            a = box.drag_acceleration[i] - box.damping_rate[i] * v[i]
            s += row * q[i]
            s1 += row * v[i]
            s2 += row * a
            s3 -= row * box.damping_rate[i] * a
        work.s[p, 0], work.s[p, 1], work.s[p, 2], work.s[p, 3] = s, s1, s2, s3


@inlined
def gather_closed(box, work, max_speed, event, side):
    """Closed contacts that part at most at a speed `max_speed`; how many.

    event, side : a play and edge that is one whatever its gap, -1 for none
    """
    count = 0
    for p in range(box.ratios.size):
        s, s1, closed_gap = work.s[p, 0], work.s[p, 1], box.closed_gap
        upper = box.high[p] - s <= closed_gap and -s1 <= max_speed
        lower = s - box.low[p] <= closed_gap and s1 <= max_speed
        if event == p:
            upper, lower = side > 0, side < 0
        if upper or lower:
            work.contact[count] = p
            work.side[count] = 1 if upper else -1
            count += 1
    return count


@inlined
def snap_to_edge(box, work, q, p, side):
    """Put a contact onto its edge, to round-off."""
    edge = box.high[p] if side > 0 else box.low[p]
    i = box.roundoff_coordinate[p]
    q[i] += (edge - work.s[p, 0]) / box.rows[p, i]


@compiled_part
def select_held(box, work, t, q, v, held, released):
    """Choose which closed contacts without speed hold, by their forces.

    held (p,) : the edge of each play that holds, else 0
    released : a play whose force has just ended, -1 for none
    Returns how many plays of teeth hold, -1 where forces are not found.
    """
    evaluate_plays(box, work, t, q, v)
    count, candidates = gather_closed(box, work, box.resting_speed, -1, 0), 0
    for i in range(count):
        p, side = work.contact[i], work.side[i]
        if -side * work.s[p, 1] < -2.0 * box.resting_speed:
            continue  # an impact is yet to come
        if released >= 0 and (p == released or work.leaving[p] == side):
            work.leaving[p] = 2 * side  # one whose force ended at this instant
            continue
        work.contact[candidates], work.side[candidates] = p, side
        candidates += 1
    for p in range(held.size):
        held[p] = 0
        work.leaving[p] = work.leaving[p] // 2 if abs(work.leaving[p]) == 2 else 0
    fill_delassus(box, work, candidates)
    for i in range(candidates):
        p, side = work.contact[i], work.side[i]
        work.b[i] = -side * work.s[p, 2]
    if candidates > 0 and not solve_lcp(
        work.delassus, work.b, work.z, work.basis, candidates, work.eliminated
    ):
        return -1
    teeth = 0
    for i in range(candidates):
        p, side = work.contact[i], work.side[i]
        if work.basis[i] == 1:
            held[p] = side
            teeth += 1 if box.wall[p] < 0 else 0
        else:
            work.leaving[p] = side
    project_speeds(box, work, v, candidates)
    project_held(box, work, t, q, v, held)
    if teeth > 0:
        set_constraints(box, work, held)
    return teeth


@compiled_part
def project_speeds(box, work, v, count):
    """Cancel speeds of held contacts by impulses, which add no energy.

    A remainder would excite the other contacts again and again.
    """
    for i in range(count):
        work.b[i] = -work.side[i] * work.s[work.contact[i], 1]
    solve_basis(work.delassus, work.b, work.z, work.basis, count, work.eliminated)
    for i in range(count):
        p = work.contact[i]
        for c in range(box.drag_acceleration.size):
            v[c] -= work.side[i] * box.inverse_mass[c] * box.rows[p, c] * work.z[i]


@compiled_part
def project_held(box, work, t, q, v, held):
    """Put held contacts onto their edges and take their speeds, to round-off."""
    for i in range(box.drag_acceleration.size):
        work.locked[i] = 0
    for p in range(held.size):
        if held[p] != 0 and box.wall[p] >= 0:
            i = box.wall[p]
            work.locked[i], v[i] = 1, 0.0
            q[i] = box.high[p] if held[p] > 0 else box.low[p]
    e, e1, e2, e3, _ = evaluate_excitation(box, t)
    for p in range(held.size):
        if held[p] == 0 or box.wall[p] >= 0:
            continue
        edge = box.high[p] if held[p] > 0 else box.low[p]
        s, s1, _, _ = evaluate_drive(box, p, t, (e, e1, e2, e3))
        coordinate = box.roundoff_coordinate[p]
        for i in range(box.drag_acceleration.size):
            s += box.rows[p, i] * q[i]
            s1 += box.rows[p, i] * v[i]
        q[coordinate] += (edge - s) / box.rows[p, coordinate]
        v[coordinate] -= s1 / box.rows[p, coordinate]


@compiled_part
def set_constraints(box, work, held):
    """Set `inverse`, `contact_acceleration` and `pull` of the held contacts."""
    count = 0
    for p in range(held.size):
        if held[p] != 0:
            work.contact[count], work.side[count] = p, 1
            count += 1
    fill_delassus(box, work, count)
    for k in range(count):
        for i in range(count):
            work.basis[i] = 1
            work.b[i] = -1.0 if i == k else 0.0
        solve_basis(work.delassus, work.b, work.z, work.basis, count, work.eliminated)
        for i in range(count):
            work.inverse[i, k] = work.z[i]
    for c in range(box.drag_acceleration.size):
        work.pull[c] = 0.0
        for k in range(count):
            value = 0.0
            for i in range(count):
                row = box.rows[work.contact[i], c]
                value += box.inverse_mass[c] * row * work.inverse[i, k]
            work.contact_acceleration[c, k] = value
            work.pull[c] += abs(value) * box.snap[work.contact[k]]


@inlined
def held_count(held):
    count = 0
    for p in range(held.size):
        count += 1 if held[p] != 0 else 0
    return count


@compiled_part
def expand_series(box, work, count, t, v):
    """Derivatives of the held coordinates in `work.x`, from the first on."""
    derive_drives(box, t, work.contact, count, work.e, work.drives)
    n = box.drag_acceleration.size
    for i in range(n):
        work.x[1, i] = v[i]
    for m in range(2, N_TERMS):
        for i in range(n):
            acceleration = box.drag_acceleration[i] if m == 2 else 0.0
            work.x[m, i] = acceleration - box.damping_rate[i] * work.x[m - 1, i]
        for k in range(count):
            p = work.contact[k]
            value = work.drives[k, m]
            for i in range(n):
                acceleration = box.drag_acceleration[i] if m == 2 else 0.0
                value += box.rows[p, i] * (
                    acceleration - box.damping_rate[i] * work.x[m - 1, i]
                )
            for i in range(n):
                work.x[m, i] -= work.contact_acceleration[i, k] * value


@compiled_part
def bound_held(box, work, count, horizon):
    """Largest third and fourth derivatives of all coordinates up to a horizon.

    In the norm of the masses damping lets no derivative grow, the excitation does.
    Coordinates that no held contact moves fly on their own.
    """
    squared_norm, pull, fastest = 0.0, 0.0, 0.0
    for i in range(box.drag_acceleration.size):
        work.a[i], work.j[i] = work.x[2, i], work.x[3, i]
        if is_coupled(work, count, i):
            squared_norm += work.j[i] ** 2 / box.inverse_mass[i]
            pull += work.pull[i] ** 2 / box.inverse_mass[i]
            fastest = max(fastest, box.damping_rate[i])
    max_jerk = math.sqrt(squared_norm) + math.sqrt(pull) * horizon
    for i in range(box.drag_acceleration.size):
        root = math.sqrt(box.inverse_mass[i])
        work.max_j[i] = root * max_jerk
        work.max_k[i] = root * (fastest * max_jerk + math.sqrt(pull))
        if not is_coupled(work, count, i):
            work.max_j[i] = abs(work.j[i])
            work.max_k[i] = box.damping_rate[i] * abs(work.j[i])


@inlined
def is_coupled(work, count, i):
    """Whether forces of held contacts move a coordinate."""
    most = 0.0
    for k in range(count):
        most = max(most, abs(work.contact_acceleration[i, k]))
    return most > 0.0


@compiled_part
def contact_force(box, work, held, count, k):
    """Force of a held contact, its rate and the largest second derivative."""
    force, rate, max_second_derivative = 0.0, 0.0, 0.0
    for m in range(count):
        p, g = work.contact[m], work.inverse[k, m]
        value, slope, second_derivative = (
            work.drives[m, 2],
            work.drives[m, 3],
            box.snap[p],
        )
        for i in range(box.drag_acceleration.size):
            row = box.rows[p, i]
            value += row * (
                box.drag_acceleration[i] - box.damping_rate[i] * work.x[1, i]
            )
            slope -= row * box.damping_rate[i] * work.x[2, i]
            second_derivative += abs(row) * box.damping_rate[i] * work.max_j[i]
        force += g * value
        rate += g * slope
        max_second_derivative += abs(g) * second_derivative
    side = held[work.contact[k]]
    return side * force, side * rate, max_second_derivative


@compiled_part
def advance_held(box, work, q, v, h):
    """A step of the held coordinates, by their series."""
    for i in range(box.drag_acceleration.size):
        # both by Horner's rule: sum x_m h^m / m!, and of its derivative
        speed, shift = 0.0, 0.0
        for m in range(N_TERMS - 1, 0, -1):
            shift = (work.x[m, i] + shift) * h / m
            speed = work.x[m, i] + (speed * h / m)
        q[i] += shift
        v[i] = speed
