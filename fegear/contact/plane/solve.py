"""Run the plane kernel over a mesh cycle: at torques, or at transmission errors."""

from __future__ import annotations

import numpy as np

from fegear.contact.offset_centers import moved_lines
from fegear.contact.pairs import (
    PairTeeth,
    candidate_pairs,
    different_teeth,
    pair_gaps,
)
from fegear.contact.plane.constants import NOMINAL, Conditions, patch_nodes
from fegear.contact.plane.runs import (
    KernelResult,
    empty_result,
    solve_pairs,
    workspace,
)
from fegear.contact.problem import (
    ContactFailure,
    ContactProblem,
    MeshPositions,
    OpenContact,
)
from fegear.contact.result import ContactCycle, FaceLoads
from fegear.gearset.modifications import LEAD_SIZES
from lumped.common.array_types import Array, Indices

PATH_MARGIN = 0.01  # base pitches from the ends of the path, as corners reach


def solve_in_plane(
    problem: ContactProblem,
    torque: Array,
    places: MeshPositions,
    with_slopes: bool = False,
) -> ContactCycle:
    """Solve at positive torques (t,) [N m], loads uniform over the width."""
    solved = run_kernel(problem, torque, *places, with_rates=with_slopes)
    return _recorded(problem, torque, places, solved)


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
    from fegear.contact.plane.kernels.cycle import TORQUE

    passed_pitches = np.zeros(position.size, np.int64) if pitch is None else pitch
    place, lines, offset_gap = moved_lines(
        problem.pair, problem.offsets, position, passed_pitches, back
    )
    teeth = candidate_pairs(problem, place)
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
    _require_contact(problem, solved.rows, position + passed_pitches)
    _require_solved(solved.rows, torque, position)
    return solved


def kernel_torques(problem: ContactProblem, torque: Array, positions: int) -> Array:
    """Targets (t, positions) of the kernel [N] from torques (t,) on the driver [N m].

    Per face width; negative on an internal gear, as its base radius is.
    """
    per_width = problem.pair.driver.sign * torque / problem.face_width
    return np.repeat(per_width[:, None], positions, axis=1)


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
    from fegear.contact.plane.kernels.cycle import TORQUE

    different, conditions = teeth_and_conditions
    lines = conditions.lines
    work = workspace(teeth.size, patch_nodes(problem))
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
    from fegear.contact.plane.kernels.cycle import TORQUE

    torques, positions = np.array([torque]), np.array([position])
    teeth = np.array([pair], np.int64)
    gaps = pair_gaps(problem, teeth[None, :])
    targets = kernel_torques(problem, torques, positions.size)
    different = different_teeth(problem, teeth)
    solved = solve_pairs(
        problem, teeth, gaps, positions, TORQUE, targets, Conditions(different)
    )
    _require_solved(solved.rows, torques, positions)
    places = MeshPositions(positions, np.zeros(1, np.int64))
    return _recorded(problem, torques, places, solved)


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
    from fegear.contact.plane.kernels.cycle import STE

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


def _require_contact(
    problem: ContactProblem, rows: np.recarray, position: Array
) -> None:
    from fegear.contact.plane.kernels.flanks import NO_FLANK_GAP

    is_open = (rows.no_load >= NO_FLANK_GAP).any(axis=0)
    if is_open.any():
        raise OpenContact(problem, float(position[is_open.argmax()]))


def _require_solved(rows: np.recarray, torque: Array, position: Array) -> None:
    failed = np.argwhere(rows.status != 0)
    if len(failed):
        t, n = failed[0]
        raise ContactFailure(
            f"contact not solved at torque {torque[t]:g} N m, position "
            f"{position[n]:g}: status {rows.status[t, n]}, residual "
            f"{rows.residual[t, n]:.3g} after {rows.sweeps[t, n]} sweeps"
        )


def _recorded(
    problem: ContactProblem, torque: Array, places: MeshPositions, solved: KernelResult
) -> ContactCycle:
    from fegear.contact.plane.kernels.flanks import NO_FLANK_GAP

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
        position=places.position + places.pitch,
        teeth=teeth,
        base_radius=abs(base_radius),
        face=_uniform_loads(problem, places.position, solved),
        ste=rows.ste,
        no_load=rows.no_load,
        local_stiffness=rows.slope * width,
        load=load,
        load_slope=cells.slope * width,
        relief_slope=rates.relief.sum(axis=2) / total_slope,
        profile_slope=rates.profile.sum(axis=2) / total_slope[..., 0],
        lead_slope=np.zeros((*rates.shape[:2], 2, len(LEAD_SIZES))),
        topography_slope=np.zeros((*rates.shape[:2], 2, 0)),
        gap=np.where(cells.gap >= NO_FLANK_GAP, np.inf, cells.gap),
        pressure=cells.pressure,
        friction_bending=np.where(cells.load > 0.0, cells.bending, np.nan),
        arc=cells.arc,
        turn=cells.turn,
        closing=closing,
        driven_torque=problem.pair.driven.sign * (load * arm).sum(axis=2),
        residual=rows.residual,
        axial_float=np.zeros_like(rows.ste),
    )


def _uniform_loads(
    problem: ContactProblem, position: Array, solved: KernelResult
) -> FaceLoads:
    """Loads in one slice, which is all of the width."""
    pair, cells = problem.pair, solved.cells
    start, end = pair.path
    path = position[:, None] + solved.teeth
    inside = (path > start + PATH_MARGIN) & (path < end - PATH_MARGIN)
    return FaceLoads(
        width=problem.face_width,
        base_helix_angle=0.0,
        place=np.zeros(1),
        teeth=solved.teeth,
        reference_position=position[:, None],
        on_path=inside[..., None],
        load=cells.load[..., None],
        pressure=cells.pressure[..., None],
        arc=cells.arc[..., None, :],
        coupling=np.empty((*cells.shape[:2], 0, 0)),
        load_change=np.empty((cells.shape[0], 0, cells.shape[2], 1, 0)),
        rigid_stiffness=np.empty((*cells.shape[:2], 0, 0)),
        axis_loads=np.empty((*cells.shape[:2], 2, 0)),
    )
