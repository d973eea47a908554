"""The contact problem at every position of a mesh cycle, compiled.

Loads, torques and stiffnesses are per unit face width.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.contact.active_set import (
    NOT_FINITE,
    STE,
    TORQUE,
    NodeConditions,
    moment_rates,
    solve_contact,
)
from fegear.contact.compliance import fill_compliance, friction_bending
from fegear.contact.flanks import NO_FLANK_GAP
from fegear.contact.grid import PatchTables
from fegear.contact.patches import (
    corner_width,
    ends_at_edge,
    hertz_half_width,
    lay_nodes,
    place_patch,
    reach_of_patch,
)
from fegear.contact.relief_rates import store_profile_rates, store_relief_rates
from lumped.common.compiled import allocating, compiled, compiled_part

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
#   relief_rate : the pair's part of the derivatives of the transmission error times
#       the slope of the load, by magnitude and start of tip and root relief of driver
#       and driven [Pa]
#   profile_rate : slopes of nodal forces times the derivatives of their gaps, by
#       crowning and slope of the profiles of driver and driven [Pa]
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
        ("relief_rate", "f8", (2, 2, 2)),
        ("profile_rate", "f8", (2, 2)),
    ],
    align=True,
)


class Constants(NamedTuple):
    """A contact problem's constants.

    mesh, tables : as from `fegear.contact.problem.kernel_inputs`
    flanks : (pairs, 2) of driver and driven in each pair
    changes : as in `fegear.contact.compliance`
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


class Workspace(NamedTuple):
    """State of k pairs of n nodes at one position, left as at the last one.

    patches : (k,) records `compliance.PATCH`; nodes : (k, n) records `patches.NODE`
    half_width : (k,) of the patches [m]
    has_nodes : (k,) whether the nodes of a patch are placed
    in_contact : (k, n) contact state, at which the next position starts
    C : (k n, k n) compliance of the active pairs [m/(N/m)]
    q : (k n,) their nodal forces [N/m];  rate : their slope over ste [Pa]
    moment_rate : (k n,) slope of the driver's moment over the gap of each node, over
        minus its base radius [Pa]; without friction that is `rate`
    """

    patches: NDArray[Any]
    nodes: NDArray[Any]
    half_width: NDArray[np.float64]
    has_nodes: NDArray[np.bool_]
    in_contact: NDArray[np.bool_]
    C: NDArray[np.float64]
    q: NDArray[np.float64]
    rate: NDArray[np.float64]
    moment_rate: NDArray[np.float64]


@compiled
def solve_cycle(constants, teeth, gaps, positions, kind, targets, work, results):
    """Fill rows and cells; the last contact state starts the next position.

    constants, work : Constants, Workspace
    teeth : (pairs,) base pitches by which a pair is ahead of the reference pair
    gaps : (positions, pairs) extra gap of each pair, from pitch errors [m]
    positions : base pitches from the pitch point
    kind, targets : TORQUE on the driver [N], or STE [m], at each of some load cases and
        positions (cases, positions)
    results : rows (cases, positions) and cells (cases, positions, pairs)
    """
    rows, cells = results
    for t in range(targets.shape[0]):
        work.in_contact[:, :] = False
        for n in range(positions.size):
            if constants.lines.shape[0] > 0:
                constants.mesh.line_of_action = constants.lines[n, 0]
                constants.mesh.pitch_point = constants.lines[n, 1]
            place_pairs(
                constants, teeth, gaps[n], positions[n], kind, targets[t, n], work
            )
            solve_position(
                constants, teeth, gaps[n], kind, targets[t, n], work, rows[t, n],
                cells[t, n],
            )  # fmt: skip


@compiled_part
def place_pairs(constants, teeth, gaps, position, kind, target, work):
    """Closest points of all pairs, and patches as wide as the whole load would need."""
    mesh = constants.mesh
    for k in range(teeth.size):
        flanks = constants.flanks[k]
        compliance = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
        s1 = mesh.pitch_point + (position + teeth[k]) * mesh.base_pitch
        place_patch(mesh, flanks, work.patches[k], s1, gaps[k])
        load = target / flanks[0].base_radius
        if kind == STE:
            depth = max(target - work.patches[k].closing_ste, 0.0)
            load = depth / (SOFT_TEETH * compliance)
        half_width = hertz_half_width(mesh, flanks, s1, load)
        if work.patches[k].present:
            half_width = reach_of_patch(mesh, flanks, work.patches[k], half_width)
            half_width = corner_width(flanks, work.patches[k], half_width, load)
        work.half_width[k] = PATCH_MARGIN * half_width
        work.has_nodes[k] = False


@allocating
def solve_position(constants, teeth, gaps, kind, target, work, row, cells):
    """Solve one position; patches grow until they hold all the pressure.

    kind, target : TORQUE on the driver [N], or STE [m], and its value
    """
    patches, flanks = work.patches, constants.flanks[0]
    work.q[:] = 0.0
    row.no_load = NO_FLANK_GAP
    for k in range(teeth.size):
        row.no_load = min(row.no_load, patches[k].closing_ste)
    if row.no_load >= NO_FLANK_GAP:
        row.status = NOT_FINITE
        return
    limit = target
    if kind == TORQUE:
        compliance = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
        limit = row.no_load + FIRST_GUESS * target / flanks[0].base_radius * compliance
    active_pairs = np.empty(0, np.int64)
    for _ in range(MAX_PATCH_ITERATIONS):
        active_pairs = choose_pairs(constants, work, gaps, limit)
        solve_active_pairs(constants, teeth, kind, target, work, active_pairs, row)
        if row.status != 0:
            return
        any_resized = resize_patches(constants, work, active_pairs)
        for k in range(teeth.size):
            if patches[k].present and limit <= patches[k].closing_ste < row.ste:
                any_resized = True
        limit = max(limit, row.ste)
        if not any_resized:
            break
    store_cells(constants, work, active_pairs, row.ste, cells)


@allocating
def choose_pairs(constants, work, gaps, limit):
    """Pairs that close below a transmission error [m], with their nodes laid."""
    active_pairs = np.empty(gaps.size, np.int64)
    count = 0
    for k in range(gaps.size):
        patch = work.patches[k]
        if patch.present and patch.closing_ste < limit:
            active_pairs[count] = k
            count += 1
            if not work.has_nodes[k]:
                lay_nodes(
                    constants, constants.flanks[k], patch, work.nodes[k], gaps[k],
                    work.half_width[k],
                )  # fmt: skip
                work.has_nodes[k] = True
    return active_pairs[:count]


@compiled_part
def resize_patches(constants, work, active_pairs):
    """Widen patches that pressure reaches an end of, and fit those of corners to their
    own load once; whether there were any.
    """
    size, any_resized = work.nodes.shape[1], False
    for p in range(active_pairs.size):
        k = active_pairs[p]
        q = work.q[p * size : (p + 1) * size]
        patch, half_width = work.patches[k], work.half_width[k]
        # the far end is cut short where the flank ends at its tip
        reaches_far_end = patch.step * (size - 1) > 2.0 * half_width * (1.0 - 1e-9)
        # and the near end where an undercut ends the flank
        is_cut = ends_at_edge(constants.flanks[k], patch)
        reaches_far_end = reaches_far_end or is_cut
        factor = 1.0
        if (q[0] > 0.0 and not is_cut) or (reaches_far_end and q[-1] > 0.0):
            factor = PATCH_GROWTH
        elif patch.tilt[1] != 0.0 and not patch.is_fitted:
            load = 0.0
            for force in q:
                load += force
            width = corner_width(constants.flanks[k], patch, half_width, load)
            if load > 0.0 and PATCH_MARGIN * width < half_width:
                # in steps, so that a small change of the load leaves the nodes in place
                ratio = math.log(PATCH_MARGIN * width / half_width)
                factor = PATCH_STEP ** math.floor(ratio / math.log(PATCH_STEP))
            patch.is_fitted = True
        if factor != 1.0:
            work.half_width[k] *= factor
            work.has_nodes[k], any_resized = False, True
            work.in_contact[k, :] = False
    return any_resized


@allocating
def solve_active_pairs(constants, teeth, kind, target, work, active_pairs, row):
    """Nodal forces q of the active pairs, node after node, and the row's result.

    The arm of a nodal force is that of the normal force less that of the friction
    force times the friction coefficient in the direction of sliding.
    """
    size, mesh = work.nodes.shape[1], constants.mesh
    base_radius = constants.flanks[0, 0].base_radius
    count = active_pairs.size * size
    gap, closing, arm = np.empty(count), np.empty(count), np.empty(count)
    active = np.empty(count, np.bool_)
    C, q = work.C, work.q[:count]
    fill_compliance(C, constants, work.patches, work.nodes, active_pairs, teeth)
    for p in range(active_pairs.size):
        patch = work.patches[active_pairs[p]]
        mu = mesh.friction * patch.sliding_sign
        for i in range(size):
            row_index = p * size + i
            gap[row_index] = work.nodes[active_pairs[p], i].gap
            closing[row_index] = patch.moment_arms[0] / base_radius
            arm[row_index] = patch.moment_arms[0] - mu * patch.moment_arms[2]
            active[row_index] = work.in_contact[active_pairs[p], i]
    conditions = NodeConditions(gap, closing, arm)
    ste, slope, residual, status, sweeps = solve_contact(
        C, conditions, kind, target, active, q, work.rate[:count]
    )
    work.moment_rate[:count] = work.rate[:count]
    if mesh.friction > 0.0:
        moment_rates(C, arm, active, work.moment_rate[:count])
        work.moment_rate[:count] /= base_radius
    for p in range(active_pairs.size):
        for i in range(size):
            work.in_contact[active_pairs[p], i] = active[p * size + i]
    row.ste, row.slope = ste, slope / base_radius
    row.residual, row.status = residual, status
    row.sweeps += sweeps


@allocating
def store_cells(constants, work, active_pairs, ste, cells):
    """Fill cells and the nodes' forces from the patches and their nodal forces."""
    size = work.nodes.shape[1]
    for k in range(work.patches.size):
        patch = work.patches[k]
        for i in range(size):
            work.nodes[k, i].force = 0.0
        cells[k].gap = patch.closing_ste
        cells[k].sliding_sign = patch.sliding_sign
        cells[k].turn[patch.master] = patch.tilt[1]
        for a in range(4):
            cells[k].moment_arms[a] = patch.moment_arms[a]
        cells[k].arc[patch.master] = patch.arc
        cells[k].arc[1 - patch.master] = patch.mate_arc
    for p in range(active_pairs.size):
        k = active_pairs[p]
        q = work.q[p * size : (p + 1) * size]
        store_pair(constants, work.patches, k, work.nodes[k], q, cells[k])
        rate = work.rate[p * size : (p + 1) * size]
        for i in range(size):
            cells[k].slope += rate[i]
        by_gap = work.moment_rate[p * size : (p + 1) * size]
        store_relief_rates(
            constants.mesh, constants.flanks[k], work.patches[k], work.nodes[k], q,
            by_gap, ste, cells[k],
        )  # fmt: skip
        store_profile_rates(
            constants.flanks[k], work.patches[k], work.nodes[k], by_gap, cells[k]
        )


@allocating
def store_pair(constants, patches, k, nodes, q, cell):
    """Load, largest pressure and load centre of pair k with nodal forces q (n,)."""
    patch = patches[k]
    master_moment, slave_moment = 0.0, 0.0
    # the nodes at both ends carry half a hat
    peak = 2.0 * max(q[0] / nodes[0].width_share, q[-1] / nodes[-1].width_share)
    for i in range(q.size):
        nodes[i].force = q[i]
        cell.load += q[i]
        master_moment += q[i] * (patch.first_arc - i * patch.step)
        slave_moment += q[i] * nodes[i].mate_arc
        peak = max(peak, q[i] / nodes[i].width_share)
    if cell.load > 0.0:
        cell.pressure = peak / patch.step
        cell.arc[patch.master] = master_moment / cell.load
        cell.arc[1 - patch.master] = slave_moment / cell.load
        cell.bending = friction_bending(constants, patches, k, nodes, q)
