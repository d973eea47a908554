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
from lumped.clatter.kernels.edge_waves import evaluate_drive, evaluate_excitation
from lumped.clatter.kernels.impact import solve_impact
from lumped.clatter.kernels.phi import phi_functions
from lumped.common.compiled import compiled, compiled_part, inlined
from lumped.rattle.kernels.flight import time_to_bound

MAX_STEP = 0.5  # periods of a step, at most
MIN_SEPARATION_TIME = 1e-6  # periods in which a contact without speed may part
SIMULTANEITY_TOL = 1e-12  # periods: events that are at once
TIME_TOL = 1e-15  # periods: times that are one
MAX_STEPS = 1_000_000  # within MIN_SEPARATION_TIME
DONE, RECORDS_FULL, NOT_FOUND = 0, 1, 2  # how a run ends
SINGLE_IMPACT, MULTIPLE_IMPACT = 1, 2  # how an impact is found


@inlined
def advance_free(group, work, q, v, h):
    """A step of coordinates that fly, in closed form."""
    for i in range(group.drag_acceleration.size):
        if work.locked[i] == 0:
            z = group.damping_rate[i] * h
            first, second = phi_functions(z)
            speed = v[i]
            q[i] += h * (speed * first + group.drag_acceleration[i] * h * second)
            v[i] = speed * (1.0 - z * first) + group.drag_acceleration[i] * h * first


@inlined
def derive_flight(group, work, v):
    """Derivatives of coordinates that fly and their largest values from now on."""
    for i in range(group.drag_acceleration.size):
        loose = 1.0 - work.locked[i]
        a = (group.drag_acceleration[i] - group.damping_rate[i] * v[i]) * loose
        work.a[i], work.j[i] = a, -group.damping_rate[i] * a
        work.max_j[i] = group.damping_rate[i] * abs(a)
        work.max_k[i] = group.damping_rate[i] * work.max_j[i]


@inlined
def derive_plays(group, work, t, e, q, v, held, horizon):
    """Plays that are open, their derivatives and bounds; the horizon of the next step.

    The horizon is at most twice the time to an edge at constant acceleration.
    """
    for p in range(group.ratios.size):
        if held[p] != 0:
            continue
        s, s1, s2, s3 = evaluate_drive(group, p, t, e)
        max_jerk, max_snap = group.jerk[p], group.snap[p]
        for i in range(group.drag_acceleration.size):
            row = group.rows[p, i]
            if row != 0.0:
                s += row * q[i]
                s1 += row * v[i]
                s2 += row * work.a[i]
                s3 += row * work.j[i]
                max_jerk += abs(row) * work.max_j[i]
                max_snap += abs(row) * work.max_k[i]
        work.s[p, 0], work.s[p, 1], work.s[p, 2], work.s[p, 3] = s, s1, s2, s3
        work.bounds[p, 0], work.bounds[p, 1] = max_jerk, max_snap
        leaving = work.leaving[p]
        if leaving != 0:
            away_acceleration, away_jerk = -leaving * s2, -leaving * s3
            separation_time = (
                away_acceleration / max_jerk
                if away_acceleration > 0.0 and max_jerk > 0.0
                else 0.0
            )
            if away_jerk > 0.0 and away_acceleration >= 0.0 and max_snap > 0.0:
                separation_time = max(separation_time, 2.0 * away_jerk / max_snap)
            if max_jerk > 0.0:
                horizon = min(horizon, max(separation_time, MIN_SEPARATION_TIME))
        if leaving <= 0:
            gap = max(group.high[p] - s, 0.0)
            horizon = min(horizon, 2.0 * time_to_bound(gap, s1, s2))
        if leaving >= 0:
            gap = max(s - group.low[p], 0.0)
            horizon = min(horizon, 2.0 * time_to_bound(gap, -s1, -s2))
    return horizon


@inlined
def next_edge(group, work, held, horizon):
    """A step that passes no edge: its length, play, edge, whether it ends there."""
    step, event, edge, is_close = math.inf, -1, 1, False
    for p in range(group.ratios.size):
        if held[p] != 0:
            continue
        s, s1, s2, s3 = work.s[p, 0], work.s[p, 1], work.s[p, 2], work.s[p, 3]
        jerk_margin = work.bounds[p, 0] * horizon / 3.0
        jerk_term = s3 * horizon / 3.0
        snap_term = work.bounds[p, 1] * horizon * horizon / 12.0
        upper_margin = min(jerk_margin, max(jerk_term, 0.0) + snap_term)
        lower_margin = min(jerk_margin, max(-jerk_term, 0.0) + snap_term)
        first, second = math.inf, math.inf
        if work.leaving[p] <= 0:
            first = time_to_bound(max(group.high[p] - s, 0.0), s1, s2 + upper_margin)
        if work.leaving[p] >= 0:
            second = time_to_bound(max(s - group.low[p], 0.0), -s1, lower_margin - s2)
        arrival = min(first, second)
        if arrival < step:
            step, event, edge = arrival, p, 1 if first <= second else -1
            close = (
                upper_margin + lower_margin
            ) * arrival * arrival < group.tolerance * edge * s1
            is_close = arrival < group.tolerance or close
    return step, event, edge, is_close


@inlined
def next_release(group, work, held, count, horizon):
    """Next event at which the force of a held contact vanishes."""
    step, event, is_close = math.inf, -1, False
    for k in range(count):
        force, rate, most = contact_force(group, work, held, count, k)
        duration = time_to_bound(max(force, 0.0), -rate, most)
        if duration < step:
            step, event = duration, work.contact[k]
            is_close = (
                duration < group.tolerance
                or most * duration * duration < group.tolerance * -rate
            )
    return step, event, is_close


@inlined
def prepare(group, work, t, q, v, held, teeth, horizon):
    """Derivatives of plays and bounds in `work`, and the horizon of the next step."""
    value, rate, acceleration, jerk, end = evaluate_excitation(group, t)
    horizon = min(horizon, end - t)
    if teeth > 0:
        horizon = min(horizon, group.max_held_step)
        count = held_count(held)
        expand_series(group, work, count, t, v)
        bound_held(group, work, count, horizon)
    else:
        derive_flight(group, work, v)
    e = value, rate, acceleration, jerk
    return derive_plays(group, work, t, e, q, v, held, horizon), end


@inlined
def next_event(group, work, held, teeth, horizon):
    """A step to the next event at most: its length, play, edge, whether it ends there.

    The edge is 0 where a contact force ends.
    """
    step, event, edge, is_close = next_edge(group, work, held, horizon)
    if teeth > 0:
        count = held_count(held)
        release_step, play, release_is_close = next_release(
            group, work, held, count, horizon
        )
        if release_step < step:
            step, event, edge, is_close = release_step, play, 0, release_is_close
    return step, event, edge, is_close and step <= horizon


@inlined
def advance(group, work, time, q, v, held, teeth, step):
    """Move on by `step`, to `time`."""
    for p in range(held.size):
        work.leaving[p] = work.leaving[p] if step < SIMULTANEITY_TOL else 0
    if teeth > 0:
        advance_held(group, work, q, v, step)
        project_held(group, work, time, q, v, held)
    else:
        advance_free(group, work, q, v, step)


@inlined
def resolve_impact(group, work, t, q, v, event, edge):
    """The impact of all closed contacts at an instant; its outcome.

    That is SINGLE_IMPACT where no other play was closed, else MULTIPLE_IMPACT, or -1
    where it is not found.
    `approach_speed`, `impulse` and `dissipated` of `work` are of the plays struck.
    """
    evaluate_plays(group, work, t, q, v)
    count = gather_closed(group, work, group.resting_speed, event, edge)
    for i in range(count):
        snap_to_edge(group, work, q, work.contact[i], work.side[i])
    for p in range(group.ratios.size):
        work.approach_speed[p], work.impulse[p], work.dissipated[p] = 0.0, 0.0, 0.0
    speed = edge * work.s[event, 1]
    if count > 1 or speed <= group.resting_speed or other_closed(group, work, event):
        return MULTIPLE_IMPACT if repeat_impacts(group, work, t, q, v, count) else -1
    mobility = 0.0
    for c in range(group.drag_acceleration.size):
        mobility += group.rows[event, c] ** 2 * group.inverse_mass[c]
    restitution = group.restitution[event]
    impulse = (1.0 + restitution) * speed / mobility
    for c in range(group.drag_acceleration.size):
        v[c] -= edge * group.inverse_mass[c] * group.rows[event, c] * impulse
    work.approach_speed[event], work.impulse[event] = speed, impulse
    work.edge[event] = edge
    work.dissipated[event] = 0.5 * (1.0 - restitution) * speed * impulse
    return SINGLE_IMPACT


@inlined
def other_closed(group, work, event):
    """Whether another play than that of an event is closed, whatever its speed."""
    is_closed = False
    for p in range(group.ratios.size):
        gap = min(group.high[p] - work.s[p, 0], work.s[p, 0] - group.low[p])
        is_closed = is_closed or (p != event and gap <= group.closed_gap)
    return is_closed


@inlined
def has_separated(group, work, event):
    """Whether a contact separates after an impact of its own."""
    return (
        group.restitution[event] * work.approach_speed[event]
        > 2.0 * group.resting_speed
    )


@compiled_part
def repeat_impacts(group, work, t, q, v, count):
    """Impacts at an instant until no closed contact approaches; whether it was found.

    A light body between two others may be struck without end. After `max_impacts` its
    speed is lost by restitution, and the last impact is plastic.
    """
    for number in range(group.max_impacts + 1):
        is_last = number == group.max_impacts
        if is_last:
            count = gather_closed(group, work, math.inf, -1, 0)
        if not solve_impact(group, work, v, count, not is_last):
            return False
        for i in range(count):
            p = work.contact[i]
            work.approach[i] = work.side[i] * work.s[p, 1]
        evaluate_plays(group, work, t, q, v)
        for i in range(count):
            p, side, approach = work.contact[i], work.side[i], work.approach[i]
            work.edge[p], work.approach_speed[p] = (
                side,
                max(work.approach_speed[p], approach),
            )
            work.impulse[p] += work.z[i]
            work.dissipated[p] += 0.5 * work.z[i] * (approach + side * work.s[p, 1])
        count = gather_closed(group, work, group.resting_speed, -1, 0)
        fastest = 0.0
        for i in range(count):
            fastest = max(fastest, work.side[i] * work.s[work.contact[i], 1])
        if fastest <= group.resting_speed:
            return True
    return True


@inlined
def record(group, work, whole_periods, t, records, record_count):
    """Rows of the plays that were struck at a speed; how many rows there are."""
    for p in range(group.ratios.size):
        if work.approach_speed[p] > group.resting_speed and work.impulse[p] > 0.0:
            records[record_count, 0], records[record_count, 1] = whole_periods, t
            records[record_count, 2], records[record_count, 3] = p, work.edge[p]
            records[record_count, 4], records[record_count, 5] = (
                work.approach_speed[p],
                work.impulse[p],
            )
            records[record_count, 6] = work.dissipated[p]
            record_count += 1
    return record_count


@compiled
def run_events(group, work, clock, q, v, held, goal, records):
    """Move on to a time; rows taken and how it ended: DONE, RECORDS_FULL or NOT_FOUND.

    clock (2,) : whole periods and the part of one, changed as q, v (n,) and held (p,)
    goal : (whole periods, part of one)
    records (r, 7) : whole periods, part of one, play, edge, speed of approach, impulse,
        energy lost; one or more of each impact
    """
    whole_periods, t = clock[0], clock[1]
    record_count, steps, status, horizon = 0, 0, NOT_FOUND, MAX_STEP
    progress_periods, progress_time = whole_periods, t
    teeth = select_held(group, work, t, q, v, held, -1)
    while steps < MAX_STEPS and teeth >= 0 and math.isfinite(t):
        if t >= 1.0 and group.pieces.shape[0] == 0:
            t -= 1.0
            whole_periods += 1.0
        left = (goal[0] - whole_periods) + (goal[1] - t)
        if left <= TIME_TOL or record_count + held.size > records.shape[0]:
            status = DONE if left <= TIME_TOL else RECORDS_FULL
            break
        max_step = min(horizon, left)
        horizon, end = prepare(group, work, t, q, v, held, teeth, max_step)
        step, event, edge, ends = next_event(group, work, held, teeth, horizon)
        step = min(step, horizon)
        t = end if step == end - t else t + step
        advance(group, work, t, q, v, held, teeth, step)
        steps, horizon = (
            steps + 1,
            min(MAX_STEP, max(2.0 * step, 4.0 * MIN_SEPARATION_TIME)),
        )
        if (whole_periods - progress_periods) + (
            t - progress_time
        ) > MIN_SEPARATION_TIME:
            steps, progress_periods, progress_time = 0, whole_periods, t
        if not ends:
            continue
        horizon, released = MAX_STEP, event
        if edge != 0:
            hit, released = resolve_impact(group, work, t, q, v, event, edge), -1
            if hit < 0:
                break
            record_count = record(group, work, whole_periods, t, records, record_count)
            if hit == SINGLE_IMPACT and has_separated(group, work, event):
                continue  # nothing is at rest
        teeth = select_held(group, work, t, q, v, held, released)
    clock[0], clock[1] = whole_periods, t
    return record_count, status
