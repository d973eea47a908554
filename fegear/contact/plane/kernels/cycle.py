"""The contact problem at every position of a mesh cycle, compiled.

Loads, torques and stiffnesses are per unit face width.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.contact.plane.grid import PatchTables
from fegear.contact.plane.kernels.active_set import (
    NOT_FINITE,
    STE,
    TORQUE,
    solve_contact,
)
from fegear.contact.plane.kernels.compliance import fill_compliance, friction_bending
from fegear.contact.plane.kernels.flanks import NO_FLANK_GAP
from fegear.contact.plane.kernels.patches import (
    corner_width,
    ends_at_edge,
    hertz_half_width,
    lay_nodes,
    place_patch,
    reach_of_patch,
)
from fegear.contact.plane.kernels.relief_rates import store_rates
from lumped.common.compiled import compiled_part, not_allocating

PATCH_MARGIN = 1.2  # half length of a patch over the Hertz half-width at full load
PATCH_GROWTH = 1.6  # of a patch whose pressure reaches its end
PATCH_STEP = 0.9  # in which a corner's is fitted to its load
MAX_PATCH_ITERATIONS = 12
SOFT_TEETH = 8.0  # ste over load per width times 1/E1' + 1/E2', a stiff pair's
FIRST_GUESS = 40.0  # ste over load per width times 1/E1' + 1/E2', generous

# Per (torque, position).
#   ste : driver's rotation times its base radius, driven gear held [m]
#   no_load : the same without load [m]
#   slope : d(force)/d(ste) along the line of action [Pa]
#   residual, status, sweeps : of the complementarity problem
ROW = np.dtype(
    [
        ("ste", "f8"),
        ("no_load", "f8"),
        ("slope", "f8"),
        ("residual", "f8"),
        ("status", "i8"),
        ("sweeps", "i8"),
    ],
    align=True,
)
# Per (torque, position, pair).
#   load : normal line load [N/m];  gap : ste that closes the pair [m]
#   slope : d(load)/d(ste) of the pair, all pairs moving together [Pa]
#   pressure : largest nodal pressure [Pa];  bending : friction-bending ratio
#   sliding_sign, moment_arms : as in `compliance.PATCH`
#   turn : sine of the angle of `compliance.PATCH.tilt`, on driver and driven
#   arc : of the load's centre, or of the closest point, on driver and driven [m]
CELL = np.dtype(
    [
        ("load", "f8"),
        ("slope", "f8"),
        ("gap", "f8"),
        ("pressure", "f8"),
        ("bending", "f8"),
        ("sliding_sign", "f8"),
        ("moment_arms", "f8", (4,)),
        ("turn", "f8", (2,)),
        ("arc", "f8", (2,)),
    ],
    align=True,
)


class Constants(NamedTuple):
    """A contact problem's constants.

    mesh, tables : as from `fegear.contact.plane.constants.kernel_inputs`
    flanks : (pairs, 2) of driver and driven in each pair
    changes : as in `fegear.contact.plane.kernels.compliance`
    lines : (positions, 2) length of the line of action and the driver's roll length at
        the pitch point [m], where centres move; of no size where they do not
    grid : of the patches
    """

    mesh: Any
    flanks: NDArray[Any]
    tables: NDArray[np.float64]
    changes: NDArray[np.float64]
    lines: NDArray[np.float64]
    grid: PatchTables


class Places(NamedTuple):
    """Tooth pairs and positions at which the contact is solved.

    teeth : (pairs,) base pitches by which a pair is ahead of the reference pair
    gaps : (positions, pairs) extra gap of each pair, from pitch errors [m]
    positions : (positions,) base pitches from the pitch point
    """

    teeth: NDArray[np.int64]
    gaps: NDArray[np.float64]
    positions: NDArray[np.float64]


class Workspace(NamedTuple):
    """State of k pairs of n nodes at one position, left as at the last one.

    patches : (k,) records `compliance.PATCH`; nodes : (k, n) records `patches.NODE`
    active_pairs : (k,) those in contact, first
    unknowns : (k n,) records `active_set.UNKNOWN` of the nodes of the active pairs
    C : (k n, k n) their compliance [m/(N/m)]
    matrix : (k n, k n + 2) space for equations
    block : (s + 1, s) space for the compliance of two pairs, between s points of each
    """

    patches: NDArray[Any]
    nodes: NDArray[Any]
    active_pairs: NDArray[np.int64]
    unknowns: NDArray[Any]
    C: NDArray[np.float64]
    matrix: NDArray[np.float64]
    block: NDArray[np.float64]


@not_allocating
def solve_cycle(constants, places, kind, targets, work, results, rates):
    """Fill results; the last contact state starts the next position.

    constants, places, work : Constants, Places, Workspace
    kind, targets : TORQUE on the driver [N], or STE [m], at each of some load cases and
        positions (cases, positions)
    results : rows (cases, positions) and cells (cases, positions, pairs)
    rates : records `relief_rates.RATE`, shaped as cells, or None, without which what
        they take is not compiled
    """
    (teeth, gaps, positions), (rows, cells) = places, results
    for t in range(targets.shape[0]):
        for k in range(teeth.size):
            forget_contact(work.nodes[k])
        for n in range(positions.size):
            if constants.lines.shape[0] > 0:
                constants.mesh.line_of_action = constants.lines[n, 0]
                constants.mesh.pitch_point = constants.lines[n, 1]
            for k in range(teeth.size):
                work.patches[k].tooth = teeth[k]
                work.patches[k].extra_gap = gaps[n, k]
            place_pairs(constants, positions[n], kind, targets[t, n], work)
            count = solve_position(constants, kind, targets[t, n], work, rows[t, n])
            if count < 0:
                continue
            store_cells(constants, work, count, cells[t, n])
            if rates is not None:
                store_rates(constants, work, count, rows[t, n].ste, rates[t, n])


@compiled_part
def forget_contact(nodes):
    """Take the nodes of a patch out of contact."""
    for i in range(nodes.size):
        nodes[i].in_contact = False


@compiled_part
def place_pairs(constants, position, kind, target, work):
    """Closest points of all pairs, and patches as wide as the whole load would need."""
    mesh = constants.mesh
    for k in range(work.patches.size):
        flanks, patch = constants.flanks[k], work.patches[k]
        compliance = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
        s1 = mesh.pitch_point + (position + patch.tooth) * mesh.base_pitch
        place_patch(mesh, flanks, patch, s1)
        load = target / flanks[0].base_radius
        if kind == STE:
            depth = max(target - patch.closing_ste, 0.0)
            load = depth / (SOFT_TEETH * compliance)
        half_width = hertz_half_width(mesh, flanks, s1, load)
        if patch.present:
            half_width = reach_of_patch(mesh, flanks, patch, half_width)
            half_width = corner_width(flanks, patch, half_width, load)
        patch.half_width = PATCH_MARGIN * half_width
        patch.has_nodes = False


@compiled_part
def solve_position(constants, kind, target, work, row):
    """Solve one position; patches grow until they hold all the pressure.

    kind, target : TORQUE on the driver [N], or STE [m], and its value

    Returns how many of the pairs are active, -1 without a solution.
    """
    patches, flanks = work.patches, constants.flanks[0]
    row.no_load = NO_FLANK_GAP
    for k in range(patches.size):
        row.no_load = min(row.no_load, patches[k].closing_ste)
    if row.no_load >= NO_FLANK_GAP:
        row.status = NOT_FINITE
        return -1
    limit = target
    if kind == TORQUE:
        compliance = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
        limit = row.no_load + FIRST_GUESS * target / flanks[0].base_radius * compliance
    count = 0
    for _ in range(MAX_PATCH_ITERATIONS):
        count = choose_pairs(constants, work, limit)
        solve_active_pairs(constants, kind, target, work, count, row)
        if row.status != 0:
            return -1
        any_resized = resize_patches(constants, work, count)
        for k in range(patches.size):
            if patches[k].present and limit <= patches[k].closing_ste < row.ste:
                any_resized = True
        limit = max(limit, row.ste)
        if not any_resized:
            break
    return count


@compiled_part
def choose_pairs(constants, work, limit):
    """Number of pairs that close below a transmission error [m]; lays their nodes."""
    count = 0
    for k in range(work.patches.size):
        patch = work.patches[k]
        if patch.present and patch.closing_ste < limit:
            work.active_pairs[count] = k
            count += 1
            if not patch.has_nodes:
                lay_nodes(constants, constants.flanks[k], patch, work.nodes[k])
                patch.has_nodes = True
    return count


@compiled_part
def resize_patches(constants, work, count):
    """Widen patches that pressure reaches an end of, and fit those of corners to their
    own load once; whether there were any.
    """
    size, any_resized = work.nodes.shape[1], False
    for p in range(count):
        k = work.active_pairs[p]
        nodes = work.unknowns[p * size : (p + 1) * size]
        patch, half_width = work.patches[k], work.patches[k].half_width
        # the far end is cut short where the flank ends at its tip
        reaches_far_end = patch.step * (size - 1) > 2.0 * half_width * (1.0 - 1e-9)
        # and the near end where an undercut ends the flank
        is_cut = ends_at_edge(constants.flanks[k], patch)
        reaches_far_end = reaches_far_end or is_cut
        near, far, factor = nodes[0].force > 0.0, nodes[size - 1].force > 0.0, 1.0
        if (near and not is_cut) or (reaches_far_end and far):
            factor = PATCH_GROWTH
        elif patch.tilt[1] != 0.0 and not patch.is_fitted:
            load = 0.0
            for i in range(size):
                load += nodes[i].force
            width = corner_width(constants.flanks[k], patch, half_width, load)
            if load > 0.0 and PATCH_MARGIN * width < half_width:
                # in steps, so that a small change of the load leaves the nodes in place
                ratio = math.log(PATCH_MARGIN * width / half_width)
                factor = PATCH_STEP ** math.floor(ratio / math.log(PATCH_STEP))
            patch.is_fitted = True
        if factor != 1.0:
            patch.half_width *= factor
            patch.has_nodes, any_resized = False, True
            forget_contact(work.nodes[k])
    return any_resized


@compiled_part
def solve_active_pairs(constants, kind, target, work, count, row):
    """Nodal forces of the active pairs, node after node, and the row's result.

    The arm of a nodal force is that of the normal force less that of the friction
    force times the friction coefficient in the direction of sliding.
    """
    size, mesh = work.nodes.shape[1], constants.mesh
    base_radius = constants.flanks[0, 0].base_radius
    unknowns = work.unknowns[: count * size]
    fill_compliance(constants, work, count)
    for p in range(count):
        k = work.active_pairs[p]
        patch = work.patches[k]
        mu = mesh.friction * patch.sliding_sign
        for i in range(size):
            unknown = unknowns[p * size + i]
            unknown.gap = work.nodes[k, i].gap
            unknown.closing = patch.moment_arms[0] / base_radius
            unknown.arm = patch.moment_arms[0] - mu * patch.moment_arms[2]
            unknown.in_contact = work.nodes[k, i].in_contact
    ste, slope, residual, status, sweeps = solve_contact(
        work.C, unknowns, kind, target, work.matrix
    )
    for p in range(count):
        for i in range(size):
            in_contact = unknowns[p * size + i].in_contact
            work.nodes[work.active_pairs[p], i].in_contact = in_contact
    row.ste, row.slope = ste, slope / base_radius
    row.residual, row.status = residual, status
    row.sweeps += sweeps


@compiled_part
def store_cells(constants, work, count, cells):
    """Fill cells and the nodes' forces from the patches and their nodal forces."""
    size = work.nodes.shape[1]
    for k in range(work.patches.size):
        patch, cell = work.patches[k], cells[k]
        for i in range(size):
            work.nodes[k, i].force = 0.0
        cell.gap = patch.closing_ste
        cell.sliding_sign = patch.sliding_sign
        cell.turn[patch.master] = patch.tilt[1]
        for a in range(4):
            cell.moment_arms[a] = patch.moment_arms[a]
        cell.arc[patch.master] = patch.arc
        cell.arc[1 - patch.master] = patch.mate_arc
    for p in range(count):
        k = work.active_pairs[p]
        unknowns = work.unknowns[p * size : (p + 1) * size]
        for i in range(size):
            work.nodes[k, i].force = unknowns[i].force
            cells[k].slope += unknowns[i].rate
        store_pair(work.patches[k], work.nodes[k], cells[k])
        if cells[k].load > 0.0:
            cells[k].bending = friction_bending(constants, work, k)


@compiled_part
def store_pair(patch, nodes, cell):
    """Load, largest pressure and load centre of a pair from its nodal forces."""
    master_moment, slave_moment = 0.0, 0.0
    last = nodes[nodes.size - 1]
    # the nodes at both ends carry half a hat
    peak = 2.0 * max(
        nodes[0].force / nodes[0].width_share, last.force / last.width_share
    )
    for i in range(nodes.size):
        node = nodes[i]
        cell.load += node.force
        master_moment += node.force * (patch.first_arc - i * patch.step)
        slave_moment += node.force * node.mate_arc
        peak = max(peak, node.force / node.width_share)
    if cell.load > 0.0:
        cell.pressure = peak / patch.step
        cell.arc[patch.master] = master_moment / cell.load
        cell.arc[1 - patch.master] = slave_moment / cell.load
