"""Solve the static contact of a gear pair: at torques, or at transmission errors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fegear.contact.kernel_constants import NOMINAL, Conditions, PairTeeth
from fegear.contact.kernel_runs import (
    KernelResult,
    empty_result,
    solve_pairs,
    workspace,
)
from fegear.contact.offset_centers import back_lead, moved_lines
from fegear.contact.problem import ContactCycle, ContactFailure, ContactProblem
from lumped.common.array_types import Array, Indices
from lumped.train.pitch_errors import pair_gaps as tooth_pair_gaps
from meshes import GearPair


def solve_cycle(
    problem: ContactProblem,
    torques: ArrayLike,
    positions: ArrayLike,
    pitches: ArrayLike = 0,
    with_slopes: bool = False,
) -> ContactCycle:
    """Solve the contact at every torque [N m] on the driver and every position.

    pitches : whole base pitches (n,) that come to the positions; pairs count anew in
        each
    with_slopes : whether the slopes by reliefs and profiles are asked for

    A negative torque turns the driver back through the backlash and loads the other
    flanks. Raises ContactFailure where no solution was found and ValueError
    for torques that are zero or not finite.
    """
    torque = np.atleast_1d(np.asarray(torques, float))
    position = np.atleast_1d(np.asarray(positions, float))
    pitch = np.broadcast_to(np.asarray(pitches, np.int64), position.shape)
    if not (np.isfinite(torque).all() and (torque != 0.0).all()):
        raise ValueError(f"torques = {torque.tolist()}; must be finite and not zero")
    if not np.isfinite(position).all():
        raise ValueError(f"positions = {position.tolist()}; must be finite")
    if (torque > 0.0).all() and problem.face is not None:
        return solve_over_face(problem, torque, position, pitch)
    if (torque > 0.0).all():
        solved = run_kernel(problem, torque, position, pitch, with_rates=with_slopes)
        return _contact_cycle(problem, torque, position + pitch, solved)
    if (torque < 0.0).all():
        return _solve_back_side(problem, torque, position, pitch, with_slopes)
    raise ValueError(f"torques = {torque.tolist()}; must have one sign")


def back_side_position(pair: GearPair, position: ArrayLike) -> Array:
    """Position of the back flanks' cycle while the drive side is at `position`.

    Both gears are symmetric about their teeth, so back contact is drive contact
    in a mirror, where motion runs the other way. The driven tooth's back flank
    passes the pitch point a tooth thickness before its drive flank does.
    """
    return -(np.asarray(position, float) + back_lead(pair))


def _solve_back_side(
    problem: ContactProblem,
    torque: Array,
    position: Array,
    pitch: Indices,
    with_slopes: bool,
) -> ContactCycle:
    mirrored = back_side_position(problem.pair, position)
    of_back = with_back_flanks(problem)
    if of_back.face is not None:
        cycle = solve_over_face(of_back, -torque, mirrored, -pitch, back=True)
    else:
        solved = run_kernel(of_back, -torque, mirrored, -pitch, True, with_slopes)
        cycle = _contact_cycle(of_back, -torque, mirrored, solved)
    backlash = problem.pair.backlash
    return replace(
        cycle,
        torque=torque,
        position=position + pitch,
        teeth=-cycle.teeth,
        ste=-(backlash + cycle.ste),
        no_load=-(backlash + cycle.no_load),
        gap=-(backlash + cycle.gap),
        load=-cycle.load,
        driven_torque=-cycle.driven_torque,
    )


def solve_over_face(
    problem: ContactProblem,
    torque: Array,
    position: Array,
    pitch: Indices,
    back: bool = False,
) -> ContactCycle:
    """Solve at positive torques (t,) [N m] and positions (n,), slice by slice.

    pitch, back : as of `run_kernel`
    """
    from fegear.contact.face_solve import solve_face

    face = problem.face
    if face is None:
        raise ValueError("face = None; loads are uniform over the width")
    half = 0.5 * face.overlap(problem.pair.driver)
    reached = np.array([position.min() - half, position.max() + half])
    teeth = candidate_pairs(problem.pair, reached)
    gaps = pair_gaps(problem, teeth - pitch[:, None], back)
    cycle = solve_face(problem, face, torque, position, gaps, teeth)
    return replace(cycle, position=position + pitch)


def run_kernel(
    problem: ContactProblem,
    torque: Array,
    position: Array,
    pitch: Indices | None = None,
    back: bool = False,
    with_rates: bool = False,
) -> KernelResult:
    """Solve at positive torques (t,) [N m] and positions (n,).

    pitch : (n,) whole base pitches that come to the positions; none by default
    back : whether the flanks are the back flanks, seen in a mirror
    with_rates : whether rates by reliefs and profiles are asked for
    """
    from fegear.contact.cycle import TORQUE

    passed_pitches = np.zeros(position.size, np.int64) if pitch is None else pitch
    place, lines, offset_gap = moved_lines(
        problem.pair, problem.offsets, position, passed_pitches, back
    )
    teeth = candidate_pairs(problem.pair, place)
    numbers = teeth - passed_pitches[:, None]
    gaps = pair_gaps(problem, numbers, back) + offset_gap[:, None]
    targets = kernel_torques(problem, torque, position.size)
    different = different_teeth(problem, numbers, back)
    if different is None:
        still = Conditions(lines=lines, with_rates=with_rates)
        solved = solve_pairs(
            problem, teeth, gaps, place, TORQUE, targets, conditions=still
        )
    else:
        common = Conditions(lines=lines, with_rates=with_rates)
        solved = _solve_groups(
            problem, teeth, gaps, place, targets, (different, common)
        )
    _require_solved(solved.rows, torque, position)
    return solved


def kernel_torques(problem: ContactProblem, torque: Array, positions: int) -> Array:
    """Targets (t, positions) of the kernel [N] from torques (t,) on the driver [N m].

    Per face width; negative on an internal gear, as its base radius is.
    """
    per_width = problem.pair.driver.sign * torque / problem.face_width
    return np.repeat(per_width[:, None], positions, axis=1)


def with_back_flanks(problem: ContactProblem) -> ContactProblem:
    """The problem with the faults and the helix that back flanks have."""
    driver, driven = (
        flank
        if flank.faults is None
        else replace(flank, faults=flank.faults.on_back_flanks)
        for flank in problem.flanks
    )
    face = None if problem.face is None else problem.face.mirrored
    return replace(problem, driver=driver, driven=driven, face=face)


def different_teeth(
    problem: ContactProblem, teeth: Indices, back: bool = False
) -> PairTeeth | None:
    """Teeth of pairs (of any shape) that differ from the others; None if none do.

    back : of back flanks, as in `pair_gaps`
    """
    faults = problem.driver.faults, problem.driven.faults
    if faults == (None, None):
        return None
    number = teeth if back else -teeth
    numbers = (number - 1 if back else number), number
    return PairTeeth(
        *(
            np.full(number.shape, -1) if f is None else f.different(n)
            for f, n in zip(faults, numbers, strict=True)
        )
    )


def _solve_groups(
    problem: ContactProblem,
    teeth: Indices,
    gaps: Array,
    position: Array,
    targets: Array,
    teeth_and_conditions: tuple[PairTeeth, Conditions],
) -> KernelResult:
    """Run the kernel for the positions of each set of teeth in the pairs.

    teeth_and_conditions : teeth (n, k) that differ, and the other conditions
    """
    from fegear.contact.cycle import TORQUE

    different, conditions = teeth_and_conditions
    lines = conditions.lines
    work = workspace(teeth.size, problem.nodes)
    result = empty_result(teeth, targets.shape, work, conditions.with_rates)
    teeth_of_both_gears = np.concatenate(different, axis=1)
    groups, group = np.unique(teeth_of_both_gears, axis=0, return_inverse=True)
    for number in range(len(groups)):
        group_positions = np.flatnonzero(group.ravel() == number)
        group_conditions = conditions._replace(
            teeth=PairTeeth(
                *(gear_teeth[group_positions[0]] for gear_teeth in different)
            ),
            lines=lines[group_positions] if lines.size else lines,
        )
        solved = solve_pairs(
            problem,
            teeth,
            gaps[group_positions],
            position[group_positions],
            TORQUE,
            targets[:, group_positions],
            group_conditions,
        )
        result.replace_at(group_positions, solved)
    return result._replace(patches=solved.patches, nodes=solved.nodes)


def solve_pair_alone(
    problem: ContactProblem, torque: float, position: float, pair: int = 0
) -> ContactCycle:
    """Contact at a torque on the driver [N m] with one pair carrying all of it.

    The other pairs are left out of the problem, and their loads do not deflect this
    one. Pitch errors and faults are those of the pair's teeth; centres stay in place.

    position : base pitches from the pitch point of the reference pair
    pair : base pitches by which it is ahead of the reference pair

    Raises ContactFailure where its flanks do not face each other.
    """
    from fegear.contact.cycle import TORQUE

    torques, positions = np.array([torque]), np.array([position])
    teeth = np.array([pair], np.int64)
    gaps = pair_gaps(problem, teeth[None, :])
    targets = kernel_torques(problem, torques, positions.size)
    different = different_teeth(problem, teeth)
    solved = solve_pairs(
        problem, teeth, gaps, positions, TORQUE, targets, Conditions(different)
    )
    _require_solved(solved.rows, torques, positions)
    return _contact_cycle(problem, torques, positions, solved)


def solve_drive_side(
    problem: ContactProblem,
    teeth: Indices,
    gaps: Array,
    position: Array,
    ste: Array,
    conditions: Conditions = NOMINAL,
) -> tuple[np.recarray, np.recarray]:
    """Rows (n,) and cells (n, k) of chosen tooth pairs (k,) at transmission errors.

    gaps : (n, k) extra gap of each pair [m]; ste : (n,) [m]
    conditions : teeth that differ, centres that move, friction
    """
    from fegear.contact.cycle import STE

    targets = np.ascontiguousarray(ste[None, :])
    solved = solve_pairs(problem, teeth, gaps, position, STE, targets, conditions)
    rows, cells = solved.rows[0], solved.cells[0]
    failed = np.flatnonzero(rows.status != 0)
    if failed.size:
        n = failed[0]
        raise ContactFailure(
            f"contact not solved at position {position[n]:g}, transmission error "
            f"{ste[n]:g} m: status {rows.status[n]}"
        )
    return rows, cells


def candidate_pairs(pair: GearPair, position: Array) -> Indices:
    """Pairs that may touch at some position, the reference pair first."""
    start, end = pair.path
    low = math.ceil(start - 0.5 - float(position.max()))
    high = math.floor(end + 0.5 - float(position.min()))
    return np.array(sorted(range(low, high + 1), key=lambda k: (abs(k), k)), np.int64)


def pair_gaps(problem: ContactProblem, teeth: Indices, back: bool = False) -> Array:
    """Extra gaps of pairs (of any shape) from the pitch errors of their teeth [m].

    back : of back flanks, where a pair that is ahead is behind in the mirror
    """
    # a pair ahead (k > 0) came into contact earlier
    number = teeth if back else -teeth
    errors = problem.driver.pitch_errors, problem.driven.pitch_errors
    return tooth_pair_gaps(*errors, number, back)


def _require_solved(rows: np.recarray, torque: Array, position: Array) -> None:
    failed = np.argwhere(rows.status != 0)
    if len(failed):
        t, n = failed[0]
        raise ContactFailure(
            f"contact not solved at torque {torque[t]:g} N m, position "
            f"{position[n]:g}: status {rows.status[t, n]}, residual "
            f"{rows.residual[t, n]:.3g} after {rows.sweeps[t, n]} sweeps"
        )


def _contact_cycle(
    problem: ContactProblem,
    torque: Array,
    position: Array,
    solved: KernelResult,
) -> ContactCycle:
    from fegear.contact.flanks import NO_FLANK_GAP

    teeth, rows, cells, rates = solved[:4]
    width = problem.face_width
    load = cells.load * width
    mu = problem.friction * cells.sliding_sign
    arm = cells.moment_arms[..., 1] - mu * cells.moment_arms[..., 3]
    base_radius = problem.pair.driver.base_radius
    closing = cells.moment_arms[..., 0] / base_radius
    driver_arm = cells.moment_arms[..., 0] - mu * cells.moment_arms[..., 2]
    moment_slope = (cells.slope * (driver_arm / base_radius)).sum(axis=2)
    total_slope = moment_slope[:, : rates.shape[1], None, None, None]
    return ContactCycle(
        torque=torque,
        position=position,
        teeth=teeth,
        base_radius=abs(base_radius),
        ste=rows.ste,
        no_load=rows.no_load,
        local_stiffness=rows.slope * width,
        load=load,
        load_slope=cells.slope * width,
        relief_slope=rates.relief.sum(axis=2) / total_slope,
        profile_slope=rates.profile.sum(axis=2) / total_slope[..., 0],
        gap=np.where(cells.gap >= NO_FLANK_GAP, np.inf, cells.gap),
        pressure=cells.pressure,
        friction_bending=np.where(cells.load > 0.0, cells.bending, np.nan),
        arc=cells.arc,
        turn=cells.turn,
        closing=closing,
        driven_torque=problem.pair.driven.sign * (load * arm).sum(axis=2),
        residual=rows.residual,
    )
