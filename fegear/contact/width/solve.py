"""Solve the contact over the face width: a normal force for each slice in contact."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fegear.contact.offset_centers import moved_lines
from fegear.contact.pairs import PairTeeth, different_teeth, pair_gaps
from fegear.contact.problem import ContactProblem, MeshPositions, OpenContact
from fegear.contact.result import ContactCycle, FaceLoads, empty_values
from fegear.contact.width.compliance import TINY
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.damage import MomentaryLine, PairsAt
from fegear.contact.width.flank_changes import (
    GAPS_ALONE,
    FlankChange,
    changed_flanks,
    sought_depths,
)
from fegear.contact.width.lines import FaceSolver, Touches, pairs_over_width
from fegear.contact.width.slices import SliceLoads, Slices, touching_slices
from fegear.contact.width.supports import MOTIONS
from fegear.gearset.modifications import LEAD_SIZES
from lumped.common.array_types import Array, Indices
from lumped.common.workers import require_running

FIRST_GUESS = 40.0  # ste over load per width times 1/E1' + 1/E2', generous
LIMIT_GROWTH = 1.001  # for what other torques and round-off change


def solve_over_width(
    problem: ContactProblem,
    face: WidthContact,
    torques: Array,
    places: MeshPositions,
    with_slopes: bool = False,
) -> ContactCycle:
    """Contact at positive torques (t,) [N m] and positions (n,) of a cycle.

    with_slopes : whether the slopes by changes of the flanks are asked for
    """
    positions, moved, offset_gap = moved_lines(
        problem.pair, problem.offsets, places.position, places.pitch, places.back
    )
    teeth = pairs_over_width(problem, face, positions)
    numbers = teeth - places.pitch[:, None]
    gaps = pair_gaps(problem, numbers, places.back) + offset_gap[:, None]
    different = different_teeth(problem, numbers, places.back)
    solver = FaceSolver(problem, face)
    changes = tuple(changed_flanks(problem)) if with_slopes else ()
    changed_solvers = [FaceSolver(change.problem, face) for change in changes]
    cycle = _empty_cycle(solver, torques, places, teeth, changes)
    softness = sum(1.0 / flank.kernel.modulus for flank in face.flanks)
    order = np.argsort(-torques)
    per_width = torques.max() / problem.pair.driver_arm / face.width
    limit = FIRST_GUESS * per_width * softness
    for n, position in enumerate(positions):
        require_running()
        pairs = PairsAt(
            teeth,
            float(position),
            gaps[n],
            MomentaryLine(*moved[n]) if moved.size else MomentaryLine.of(problem.pair),
            different and PairTeeth(*(of_gear[n] for of_gear in different)),
        )
        lines = solver.lines(pairs)
        lines_of_changes = [
            one.with_gaps(lines, solver)
            if change.field in GAPS_ALONE
            else one.lines(pairs)
            for change, one in zip(changes, changed_solvers, strict=True)
        ]
        no_load = float(lines.gap.min())
        if not math.isfinite(no_load):
            raise OpenContact(problem, float(position + places.pitch[n]))
        start = slices = None
        for t in order:
            torque = float(torques[t])
            if slices is None or solver.is_moved_by_torque:
                # gaps count from the first, so that round-off is that of the deflection
                loaded, first = solver.moved([lines, *lines_of_changes], torque)
                at_torque, *changed = loaded
                slices = touching_slices(solver.compliance, at_torque, teeth, limit)
                start = None
            size = solver.contact_size(torque, at_torque)
            solved = slices.solve(torque, size, start)
            while (reach := slices.reach(solved)) > limit:
                # no part with a larger gap is in contact
                limit = LIMIT_GROWTH * reach
                slices = touching_slices(solver.compliance, at_torque, teeth, limit)
                solved = slices.solve(torque, size)
            start = np.maximum(solved.load, 0.0)
            _store(cycle, (int(t), n), slices, solved, (no_load, first))
            if changes:
                by_change = slices.slopes_of(solved, changed, changes)
                _store_slopes(cycle, (int(t), n), slices, changes, by_change)
    return cycle


def _empty_cycle(
    solver: FaceSolver,
    torques: Array,
    places: MeshPositions,
    teeth: Indices,
    changes: Sequence[FlankChange],
) -> ContactCycle:
    """Cycle to be filled in, with what is known before."""
    pair, face = solver.problem.pair, solver.face
    sizes = {"t": torques.size, "n": places.position.size, "k": teeth.size}
    sizes |= {"m": face.slices, "g": 2, "l": len(LEAD_SIZES), "c": len(changes)}
    sizes["s"] = places.position.size if changes else 0
    sizes["h"] = sought_depths(solver.problem) if changes else 0
    sizes["a"] = MOTIONS
    sizes["q"] = 0 if face.supports is None else 1 + 2 * MOTIONS
    twist_lead = pair.driver.base_radius * face.driver.kernel.twist * face.places
    loads = empty_values(
        FaceLoads,
        sizes,
        width=face.width,
        base_helix_angle=face.driver.kernel.base_helix_angle,
        place=face.places,
        teeth=teeth,
        reference_position=places.position[:, None] - twist_lead / pair.base_pitch,
    )
    return empty_values(
        ContactCycle,
        sizes,
        torque=torques,
        position=places.position + places.pitch,
        teeth=teeth,
        base_radius=pair.driver_arm,
        face=loads,
    )


def _store(
    cycle: ContactCycle,
    at: tuple[int, int],
    slices: Slices,
    solved: SliceLoads,
    errors: tuple[float, float],
) -> None:
    """Fill in what was solved at a torque and a position, by their indices.

    errors : transmission errors [m] without load, and from which gaps count
    """
    face, lines, n = cycle.face, slices.lines, at[1]
    parts, compliance = lines.parts, slices.compliance
    cosine = compliance.helix_cosine
    count, m = face.load.shape[2:]
    force, rate = slices.spread(solved.load), slices.spread(solved.rate)

    def by_pair(values: Array) -> Array:
        return np.bincount(parts.pair, values, count).astype(float)

    no_load, origin = errors
    cycle.ste[at], cycle.no_load[at] = origin + solved.ste, no_load
    cycle.local_stiffness[at] = solved.torque_slope / cycle.base_radius
    cycle.residual[at] = solved.residual
    normal = by_pair(force)
    cycle.load[at], cycle.load_slope[at] = cosine * normal, cosine * by_pair(rate)
    np.minimum.at(cycle.gap[at], parts.pair, origin + lines.gap)
    carries = normal > 0.0
    # of a pair without load that of the part that closes first
    first = np.zeros(force.size)
    order = np.argsort(-lines.gap, kind="stable")
    last_of_pair = np.zeros(count, np.int64)
    last_of_pair[parts.pair[order]] = order
    first[last_of_pair] = 1.0
    total = np.where(carries, normal, 1.0)[parts.pair]
    weight = np.where(carries[parts.pair], force / total, first)
    for gear in range(2):
        cycle.arc[(*at, slice(None), gear)] = by_pair(weight * parts.arcs[:, gear])
    cycle.closing[at] = by_pair(weight * lines.closing) / cosine
    cycle.driven_torque[at] = force @ lines.driven_arm
    cycle.friction_bending[at] = _friction_bending(slices, solved, carries)
    np.add.at(face.load[at], (parts.pair, lines.slices), force / face.slice_length)
    chosen = np.zeros((count, slices.index.size))
    chosen[slices.parts.pair, np.arange(slices.index.size)] = weight[slices.index]
    others = 1.0 - np.eye(count)
    face.coupling[at] = others * (chosen @ slices.smooth @ chosen.T) / cosine**2
    if cycle.face.rigid_stiffness.size:
        cycle.face.rigid_stiffness[at] = slices.rigid_stiffness(solved)
    cycle.face.axis_loads[at] = slices.axis_loads(solved)
    # of a slice that carries, parts of its line that do not are left out
    of_slices = parts.pair, lines.slices
    share = np.where(face.load[at][of_slices] > 0.0, force, parts.length)
    whole = np.zeros((count, m))
    np.add.at(whole, of_slices, share)
    share /= np.maximum(whole[of_slices], TINY)
    np.add.at(face.arc[at], of_slices, share[:, None] * parts.arcs)
    pressure = compliance.pressure(force, parts)
    np.maximum.at(face.pressure[at], (parts.pair, lines.slices), pressure)
    cycle.pressure[at] = face.pressure[at].max(axis=1)
    off_path = np.zeros((count, m), bool)
    np.logical_or.at(off_path, (parts.pair, lines.slices), ~lines.on_path)
    face.on_path[n] = ~off_path


def _store_slopes(
    cycle: ContactCycle,
    at: tuple[int, int],
    slices: Slices,
    changes: Sequence[FlankChange],
    by_change: tuple[Array, Array],
) -> None:
    """Fill in slopes of the transmission error and of forces by changes of flanks."""
    ste_slope, forces = by_change
    for change, slope in zip(changes, ste_slope, strict=True):
        getattr(cycle, change.field)[(*at, *change.at)] = slope
    parts, slices_of_parts = slices.parts, slices.lines.slices[slices.index]
    per_length = forces / cycle.face.slice_length
    np.add.at(cycle.face.load_change[at], (parts.pair, slices_of_parts), per_length)


def _friction_bending(slices: Slices, solved: SliceLoads, carries: Touches) -> Array:
    """Deflection of pairs (k,) toward the roots over that along the normal, negated."""
    compliance, load, parts = slices.compliance, solved.load, slices.parts
    approach, _ = compliance.own_contact(np.maximum(load, TINY), parts, solved.size)
    of_line = np.where(parts.is_same_line, solved.matrix, 0.0)
    normal = load * (of_line @ load + approach)
    tangential = load * (slices.rootward @ load)
    toward_root, along_normal = (
        np.bincount(parts.pair, values, carries.size) for values in (tangential, normal)
    )
    safe = np.where(carries, along_normal, 1.0)
    return np.where(carries, -toward_root / safe, np.nan)
