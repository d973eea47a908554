"""The contact problem at every position of a mesh cycle, compiled.

Loads, torques and stiffnesses are per unit face width.
"""

from __future__ import annotations

import numpy as np

from fegear.contact.active_set import (
    APPROACH,
    NOT_FINITE,
    TORQUE,
    solve_contact,
)
from fegear.contact.compliance import fill_compliance, friction_bending
from fegear.contact.flanks import FAR
from fegear.contact.patches import (
    FORCE,
    GAP,
    OPPOSITE,
    hertz_half_width,
    lay_nodes,
    place_patch,
)
from lumped.compiled import compiled, compiled_part

MARGIN = 1.2  # half length of a patch over the Hertz half-width at full load
GROWTH = 1.6  # of a patch whose pressure reaches its end
MAX_ROUNDS = 12
SOFT_TEETH = 8.0  # approach over load per width times 1/E1' + 1/E2', a stiff pair's
FIRST_GUESS = 40.0  # approach over load per width times 1/E1' + 1/E2', generous

# Per (torque, position).
#   approach : driver's rotation times its base radius, driven gear held [m]
#   no_load : the same without load [m]
#   slope : d(force)/d(approach) along the line of action [Pa]
#   residual, status, sweeps : of the complementarity problem
ROW = np.dtype(
    [
        ("approach", "f8"),
        ("no_load", "f8"),
        ("slope", "f8"),
        ("residual", "f8"),
        ("status", "i8"),
        ("sweeps", "i8"),
    ],
    align=True,
)
# Per (torque, position, pair).
#   load : normal line load [N/m];  gap : approach that closes the pair [m]
#   pressure : largest nodal pressure [Pa];  bending : friction-bending ratio
#   approach, lever : as in PATCH
#   arc : of the load's centre, or of the closest point, on driver and driven [m]
CELL = np.dtype(
    [
        ("load", "f8"),
        ("gap", "f8"),
        ("pressure", "f8"),
        ("bending", "f8"),
        ("approach", "f8"),
        ("lever", "f8", (4,)),
        ("arc", "f8", (2,)),
    ],
    align=True,
)


@compiled
def solve_cycle(
    mesh, flanks, tables, grid, teeth, pair_gaps, positions, kind, given,
    patches, nodes, rows, cells,
):  # fmt: skip
    """Fill rows and cells; the last contact state starts the next position.

    mesh, flanks, tables, grid : the contact problem's constants
    teeth : (pairs,) base pitches by which a pair is ahead of the reference pair
    pair_gaps : (positions, pairs) extra gap of each pair, from pitch errors [m]
    positions : base pitches from the pitch point
    kind, given : TORQUE on the driver [N], or APPROACH [m], at each of some load
        cases and positions (cases, positions)
    patches, nodes : (pairs,) and (pairs, n, 3), left as at the last position
    """
    pairs, size = nodes.shape[0], nodes.shape[1]
    width = np.empty(pairs)
    C = np.empty((pairs * size, pairs * size))
    memory = np.zeros((pairs, size), np.bool_)
    softness = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
    for t in range(given.shape[0]):
        memory[:, :] = False
        for n in range(positions.size):
            for k in range(pairs):
                s1 = mesh.pitch + (positions[n] + teeth[k]) * mesh.base_pitch
                place_patch(mesh, flanks, patches[k], s1, pair_gaps[n, k])
                load = given[t, n] / flanks[0].base_radius
                if kind == APPROACH:
                    depth = max(given[t, n] - patches[k].least_gap, 0.0)
                    load = depth / (SOFT_TEETH * softness)
                width[k] = MARGIN * hertz_half_width(mesh, flanks, s1, load)
            solve_position(
                mesh, flanks, tables, grid, teeth, pair_gaps[n], kind, given[t, n],
                patches, nodes, width, C, memory, rows[t, n], cells[t, n],
            )  # fmt: skip


@compiled_part
def solve_position(
    mesh, flanks, tables, grid, teeth, pair_gaps, kind, given,
    patches, nodes, width, C, memory, row, cells,
):  # fmt: skip
    """Solve one position; patches grow until they hold all the pressure.

    kind, given : TORQUE on the driver [N], or APPROACH [m], and its value
    """
    pairs, size = nodes.shape[0], nodes.shape[1]
    q = np.zeros(pairs * size)
    chosen = np.empty(pairs, np.int64)
    fresh = np.ones(pairs, np.bool_)  # patches whose nodes have to be laid
    row.no_load = FAR
    for k in range(pairs):
        row.no_load = min(row.no_load, patches[k].least_gap)
    if row.no_load >= FAR:
        row.status = NOT_FINITE
        return
    softness = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
    limit = given
    if kind == TORQUE:
        limit = row.no_load + FIRST_GUESS * given / flanks[0].base_radius * softness
    count = 0
    for _ in range(MAX_ROUNDS):
        count = 0
        for k in range(pairs):
            if patches[k].present and patches[k].least_gap < limit:
                chosen[count] = k
                count += 1
                if fresh[k]:
                    lay_nodes(
                        mesh, flanks, patches[k], nodes[k], pair_gaps[k], width[k],
                        grid[3], tables.shape[3],
                    )  # fmt: skip
                    fresh[k] = False
        solve_chosen(
            mesh, flanks, tables, grid, teeth, kind, given,
            patches, nodes, C, memory, row, chosen[:count], q,
        )  # fmt: skip
        if row.status != 0:
            return
        again = False
        for p in range(count):
            k = chosen[p]
            if reaches_end(patches[k], q, p * size, size, width[k]):
                width[k] *= GROWTH
                fresh[k], again = True, True
                memory[k, :] = False
        for k in range(pairs):
            if patches[k].present and limit <= patches[k].least_gap < row.approach:
                again = True
        limit = max(limit, row.approach)
        if not again:
            break
    store(flanks, tables, grid, patches, chosen[:count], q, nodes, cells)


@compiled_part
def reaches_end(patch, q, start, size, width):
    """Whether pressure touches an end of the patch where the flank goes on."""
    whole = patch.step * (size - 1) > 2.0 * width * (1.0 - 1e-9)
    return q[start] > 0.0 or (whole and q[start + size - 1] > 0.0)


@compiled_part
def solve_chosen(
    mesh, flanks, tables, grid, teeth, kind, given,
    patches, nodes, C, memory, row, chosen, q,
):  # fmt: skip
    """Nodal forces q of the chosen pairs, node after node, and the row's result."""
    size = nodes.shape[1]
    sides = np.empty((chosen.size * size, 3))
    active = np.empty(chosen.size * size, np.bool_)
    fill_compliance(C, mesh.friction, flanks, tables, patches, chosen, teeth, grid)
    for p in range(chosen.size):
        patch = patches[chosen[p]]
        for i in range(size):
            at = p * size + i
            sides[at, 0] = nodes[chosen[p], i, GAP]
            sides[at, 1] = patch.lever[0] / flanks[0].base_radius
            drag = mesh.friction * patch.approach
            sides[at, 2] = patch.lever[0] - drag * patch.lever[2]
            active[at] = memory[chosen[p], i]
    d, slope, residual, status, sweeps = solve_contact(
        C, sides, kind, given, active, q[: active.size]
    )
    for p in range(chosen.size):
        for i in range(size):
            memory[chosen[p], i] = active[p * size + i]
    row.approach, row.slope = d, slope / flanks[0].base_radius
    row.residual, row.status = residual, status
    row.sweeps += sweeps


@compiled_part
def store(flanks, tables, grid, patches, chosen, q, nodes, cells):
    size = nodes.shape[1]
    for k in range(patches.size):
        for i in range(size):
            nodes[k, i, FORCE] = 0.0
        cells[k].gap = patches[k].least_gap
        cells[k].approach = patches[k].approach
        for a in range(4):
            cells[k].lever[a] = patches[k].lever[a]
        cells[k].arc[patches[k].master] = patches[k].arc
        cells[k].arc[1 - patches[k].master] = patches[k].opposite
    for p in range(chosen.size):
        cell, patch = cells[chosen[p]], patches[chosen[p]]
        start = p * size
        peak = 2.0 * q[start + size - 1]
        own, opposite = 0.0, 0.0
        for i in range(size):
            nodes[chosen[p], i, FORCE] = q[start + i]
            cell.load += q[start + i]
            own += q[start + i] * (patch.far - i * patch.step)
            opposite += q[start + i] * nodes[chosen[p], i, OPPOSITE]
            if i < size - 1:
                peak = max(peak, q[start + i])
        if cell.load > 0.0:
            cell.pressure = peak / patch.step
            cell.arc[patch.master] = own / cell.load
            cell.arc[1 - patch.master] = opposite / cell.load
            cell.bending = friction_bending(flanks, tables, patch, q, start, grid)
