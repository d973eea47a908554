"""Motion of loose wheels from event to event, compiled; time in periods.

Between impacts coordinates move in closed form. The next event is found by steps that
cannot pass it, as in `lumped.rattle.kernels.flight`: with bounds of the third and
fourth derivatives of a play, no crossing is missed, and near one such steps converge
faster than Newton's.
"""

from __future__ import annotations

import math

from lumped.clatter.kernels.contact import (
    advance_held,
    bound_held,
    contact_force,
    evaluate_plays,
    expand_series,
    gather_closed,
    held_count,
    project_held,
    select_held,
    snap_to_edge,
)
from lumped.clatter.kernels.excitation import evaluate_drive, evaluate_excitation
from lumped.clatter.kernels.impact import solve_impact
from lumped.clatter.kernels.phi import phi_functions
from lumped.common.compiled import compiled, compiled_part, inlined
from lumped.rattle.kernels.flight import time_to_bound

MAX_STEP = 0.5  # periods of a step, at most
MIN_SEPARATION_TIME = 1e-6  # periods in which a contact without speed may part
SIMULTANEITY_TOL = 1e-12  # periods: events that are at once
TIME_TOL = 1e-15  # periods: times that are one
MAX_STEPS = 1_000_000  # in a time of `SHORT`
DONE, RECORDS_FULL, NOT_FOUND = 0, 1, 2  # how a run ends
SINGLE_IMPACT, MULTIPLE_IMPACT = 1, 2  # how an impact is found


@inlined
def advance_free(box, work, q, v, h):
    """A step of coordinates that fly, in closed form."""
    for i in range(box.drag_acceleration.size):
        if work.locked[i] == 0:
            z = box.damping_rate[i] * h
            first, second = phi_functions(z)
            speed = v[i]
            q[i] += h * (speed * first + box.drag_acceleration[i] * h * second)
            v[i] = speed * (1.0 - z * first) + box.drag_acceleration[i] * h * first


@inlined
def derive_flight(box, work, v):
    """Derivatives of coordinates that fly and their largest values from now on."""
    for i in range(box.drag_acceleration.size):
        loose = 1.0 - work.locked[i]
        a = (box.drag_acceleration[i] - box.damping_rate[i] * v[i]) * loose
        work.a[i], work.j[i] = a, -box.damping_rate[i] * a
        work.max_j[i] = box.damping_rate[i] * abs(a)
        work.max_k[i] = box.damping_rate[i] * work.max_j[i]


@inlined
def derive_plays(box, work, t, e, q, v, held, horizon):
    """Plays that are open, their derivatives and bounds; the horizon of the next step.

    It is twice the time to an edge at constant acceleration, at most.
    """
    for p in range(box.ratios.size):
        if held[p] != 0:
            continue
        s, s1, s2, s3 = evaluate_drive(box, p, t, e)
        max_jerk, snap = box.jerk[p], box.snap[p]
        for i in range(box.drag_acceleration.size):
            row = box.rows[p, i]
            if row != 0.0:
                s += row * q[i]
                s1 += row * v[i]
                s2 += row * work.a[i]
                s3 += row * work.j[i]
                max_jerk += abs(row) * work.max_j[i]
                snap += abs(row) * work.max_k[i]
        work.s[p, 0], work.s[p, 1], work.s[p, 2], work.s[p, 3] = s, s1, s2, s3
        work.bounds[p, 0], work.bounds[p, 1] = max_jerk, snap
        leaving = work.leaving[p]
        if leaving != 0:
            away, later = -leaving * s2, -leaving * s3
            lift = away / max_jerk if away > 0.0 and max_jerk > 0.0 else 0.0
            if later > 0.0 and away >= 0.0 and snap > 0.0:
                lift = max(lift, 2.0 * later / snap)
            if max_jerk > 0.0:
                horizon = min(horizon, max(lift, MIN_SEPARATION_TIME))
        if leaving <= 0:
            gap = max(box.high[p] - s, 0.0)
            horizon = min(horizon, 2.0 * time_to_bound(gap, s1, s2))
        if leaving >= 0:
            gap = max(s - box.low[p], 0.0)
            horizon = min(horizon, 2.0 * time_to_bound(gap, -s1, -s2))
    return horizon


@inlined
def next_edge(box, work, held, horizon):
    """A step that passes no edge: its length, play, edge, whether it ends there."""
    step, event, edge, is_close = math.inf, -1, 1, False
    for p in range(box.ratios.size):
        if held[p] != 0:
            continue
        s, s1, s2, s3 = work.s[p, 0], work.s[p, 1], work.s[p, 2], work.s[p, 3]
        jerk_margin = work.bounds[p, 0] * horizon / 3.0
        toward = s3 * horizon / 3.0
        rest = work.bounds[p, 1] * horizon * horizon / 12.0
        up = min(jerk_margin, max(toward, 0.0) + rest)
        down = min(jerk_margin, max(-toward, 0.0) + rest)
        first, second = math.inf, math.inf
        if work.leaving[p] <= 0:
            first = time_to_bound(max(box.high[p] - s, 0.0), s1, s2 + up)
        if work.leaving[p] >= 0:
            second = time_to_bound(max(s - box.low[p], 0.0), -s1, down - s2)
        arrival = min(first, second)
        if arrival < step:
            step, event, edge = arrival, p, 1 if first <= second else -1
            close = (up + down) * arrival * arrival < box.tolerance * edge * s1
            is_close = arrival < box.tolerance or close
    return step, event, edge, is_close


@inlined
def next_release(box, work, held, count, horizon):
    """Next event at which the force of a held contact vanishes."""
    step, event, is_close = math.inf, -1, False
    for k in range(count):
        force, rate, most = contact_force(box, work, held, count, k)
        duration = time_to_bound(max(force, 0.0), -rate, most)
        if duration < step:
            step, event = duration, work.contact[k]
            is_close = (
                duration < box.tolerance
                or most * duration * duration < box.tolerance * -rate
            )
    return step, event, is_close


@inlined
def prepare(box, work, t, q, v, held, teeth, horizon):
    """Derivatives of plays and bounds in `work`, and the horizon of the next step."""
    value, rate, acceleration, jerk, end = evaluate_excitation(box, t)
    horizon = min(horizon, end - t)
    if teeth > 0:
        horizon = min(horizon, box.max_held_step)
        count = held_count(held)
        expand_series(box, work, count, t, v)
        bound_held(box, work, count, horizon)
    else:
        derive_flight(box, work, v)
    e = value, rate, acceleration, jerk
    return derive_plays(box, work, t, e, q, v, held, horizon), end


@inlined
def next_event(box, work, held, teeth, horizon):
    """A step to the next event at most: its length, play, edge, whether it ends there.

    The edge is 0 where a contact force ends.
    """
    step, event, edge, is_close = next_edge(box, work, held, horizon)
    if teeth > 0:
        count = held_count(held)
        release_step, play, release_is_close = next_release(
            box, work, held, count, horizon
        )
        if release_step < step:
            step, event, edge, is_close = release_step, play, 0, release_is_close
    return step, event, edge, is_close and step <= horizon


@inlined
def simulate(box, work, time, q, v, held, teeth, step):
    """A step of the motion, to a time."""
    for p in range(held.size):
        work.leaving[p] = work.leaving[p] if step < SIMULTANEITY_TOL else 0
    if teeth > 0:
        advance_held(box, work, q, v, step)
        project_held(box, work, time, q, v, held)
    else:
        advance_free(box, work, q, v, step)


@inlined
def resolve_impact(box, work, t, q, v, event, edge):
    """The impact of all closed contacts at an instant; its outcome.

    That is ALONE where no other play was closed, AGAIN, or -1 where it is not found.
    `approach_speed`, `impulse` and `dissipated` of `work` are of the plays struck.
    """
    evaluate_plays(box, work, t, q, v)
    count = gather_closed(box, work, box.resting_speed, event, edge)
    for i in range(count):
        snap_to_edge(box, work, q, work.contact[i], work.side[i])
    for p in range(box.ratios.size):
        work.approach_speed[p], work.impulse[p], work.dissipated[p] = 0.0, 0.0, 0.0
    speed = edge * work.s[event, 1]
    if count > 1 or speed <= box.resting_speed or other_closed(box, work, event):
        return MULTIPLE_IMPACT if repeat_impacts(box, work, t, q, v, count) else -1
    mobility = 0.0
    for c in range(box.drag_acceleration.size):
        mobility += box.rows[event, c] ** 2 * box.inverse_mass[c]
    bounce = box.restitution[event]
    impulse = (1.0 + bounce) * speed / mobility
    for c in range(box.drag_acceleration.size):
        v[c] -= edge * box.inverse_mass[c] * box.rows[event, c] * impulse
    work.approach_speed[event], work.impulse[event] = speed, impulse
    work.edge[event] = edge
    work.dissipated[event] = 0.5 * (1.0 - bounce) * speed * impulse
    return SINGLE_IMPACT


@inlined
def other_closed(box, work, event):
    """Whether another play than that of an event is closed, whatever its speed."""
    is_closed = False
    for p in range(box.ratios.size):
        gap = min(box.high[p] - work.s[p, 0], work.s[p, 0] - box.low[p])
        is_closed = is_closed or (p != event and gap <= box.closed_gap)
    return is_closed


@inlined
def has_separated(box, work, event):
    """Whether a contact separates after an impact of its own."""
    return box.restitution[event] * work.approach_speed[event] > 2.0 * box.resting_speed


@compiled_part
def repeat_impacts(box, work, t, q, v, count):
    """Impacts at an instant until no closed contact approaches; whether it was found.

    A light body between two others may be struck without end. So many impacts leave
    no speed, for they lose it by their restitution: then none bounces.
    """
    for number in range(box.max_impacts + 1):
        is_last = number == box.max_impacts
        if is_last:
            count = gather_closed(box, work, math.inf, -1, 0)
        if not solve_impact(box, work, v, count, not is_last):
            return False
        for i in range(count):
            p = work.contact[i]
            work.approach[i] = work.side[i] * work.s[p, 1]
        evaluate_plays(box, work, t, q, v)
        for i in range(count):
            p, side, approach = work.contact[i], work.side[i], work.approach[i]
            work.edge[p], work.approach_speed[p] = (
                side,
                max(work.approach_speed[p], approach),
            )
            work.impulse[p] += work.z[i]
            work.dissipated[p] += 0.5 * work.z[i] * (approach + side * work.s[p, 1])
        count = gather_closed(box, work, box.resting_speed, -1, 0)
        fastest = 0.0
        for i in range(count):
            fastest = max(fastest, work.side[i] * work.s[work.contact[i], 1])
        if fastest <= box.resting_speed:
            return True
    return True


@inlined
def record(box, work, whole, t, records, taken):
    """Rows of the plays that were struck at a speed; how many rows there are."""
    for p in range(box.ratios.size):
        if work.approach_speed[p] > box.resting_speed and work.impulse[p] > 0.0:
            records[taken, 0], records[taken, 1] = whole, t
            records[taken, 2], records[taken, 3] = p, work.edge[p]
            records[taken, 4], records[taken, 5] = (
                work.approach_speed[p],
                work.impulse[p],
            )
            records[taken, 6] = work.dissipated[p]
            taken += 1
    return taken


@compiled
def run_events(box, work, clock, q, v, held, goal, records):
    """Move on to a time; rows taken and how it ended: DONE, FULL records or LOST.

    clock (2,) : whole periods and the part of one, changed as q, v (n,) and held (p,)
    goal : (whole periods, part of one)
    records (r, 7) : whole periods, part of one, play, edge, speed of approach, impulse,
        energy lost; one or more of each impact
    """
    whole, t = clock[0], clock[1]
    taken, steps, status, horizon = 0, 0, NOT_FOUND, MAX_STEP
    since, passed = whole, t
    teeth = select_held(box, work, t, q, v, held, -1)
    while steps < MAX_STEPS and teeth >= 0 and math.isfinite(t):
        if t >= 1.0 and box.pieces.shape[0] == 0:
            t -= 1.0
            whole += 1.0
        left = (goal[0] - whole) + (goal[1] - t)
        if left <= TIME_TOL or taken + held.size > records.shape[0]:
            status = DONE if left <= TIME_TOL else RECORDS_FULL
            break
        reached = min(horizon, left)
        horizon, end = prepare(box, work, t, q, v, held, teeth, reached)
        step, event, edge, ends = next_event(box, work, held, teeth, horizon)
        step = min(step, horizon)
        t = end if step == end - t else t + step
        simulate(box, work, t, q, v, held, teeth, step)
        steps, horizon = (
            steps + 1,
            min(MAX_STEP, max(2.0 * step, 4.0 * MIN_SEPARATION_TIME)),
        )
        if (whole - since) + (t - passed) > MIN_SEPARATION_TIME:
            steps, since, passed = 0, whole, t
        if not ends:
            continue
        horizon, released = MAX_STEP, event
        if edge != 0:
            hit, released = resolve_impact(box, work, t, q, v, event, edge), -1
            if hit < 0:
                break
            taken = record(box, work, whole, t, records, taken)
            if hit == SINGLE_IMPACT and has_separated(box, work, event):
                continue  # nothing is at rest
        teeth = select_held(box, work, t, q, v, held, released)
    clock[0], clock[1] = whole, t
    return taken, status
