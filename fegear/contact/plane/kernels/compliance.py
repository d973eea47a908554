"""Compliance between nodes of contact patches: half-plane part and remainder.

tables : (gear, kind, offset, n, n) smooth flank compliances of driver and driven, as in
    FlankCompliance: kind 0 normal and 1 toward the root under normal loads, and where
    it is needed 2 toward the root under loads toward the root
changes : (gear, kind, pairs * pairs, n, n) what damaged teeth add, by the pair where
    displacement is read and then the one with the load; of no size without damage
flanks : (pairs, 2) records of driver and driven of each pair
"""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.plane.grid import SUPPORT
from fegear.elasticity.flank_grid import STENCIL
from lumped.common.compiled import compiled_part

NORMAL, TANGENTIAL, ROOTWARD = np.int64(0), np.int64(1), np.int64(2)

# Contact patch of one pair.
#   tooth : base pitches by which it is ahead of the reference pair
#   extra_gap : from pitch errors [m];  half_width : of the patch [m]
#   has_nodes : whether its nodes are placed
#   present : whether its flanks face each other
#   is_fitted : whether the patch of a corner has the width of its own load
#   master : gear whose flank carries the nodes, 0 driver or 1 driven
#   crossings : roll lengths where unmodified flanks of the master and of its mate
#       would cross the line of action [m], the driver turned ahead on its base circle
#       by `driver_advance` [m], 0 of unmodified flanks on the path
#   arc, mate_arc : arc lengths of the closest point on the master and its mate [m]
#   first_arc : the master's arc length of the first node; step : node spacing [m]
#   closing_ste : transmission error that closes the pair [m]
#   sliding_sign : +1 before the pitch point, -1 behind it, 0 on it
#   moment_arms : arms of the normal force about driver and driven centre, then of the
#       friction force [m]
#   tilt : cosine and sine of the angle by which the force on the master is turned from
#       the inward normal of its flank toward its root: that of a corner whose force is
#       normal to the mate's flank, else 1 and 0
#   first, weights : table stencils at the support points, by gear
#   beyond : how far these are before the first point, as from `beyond_first`
PATCH = np.dtype(
    [
        ("tooth", "i8"),
        ("extra_gap", "f8"),
        ("half_width", "f8"),
        ("has_nodes", "?"),
        ("present", "?"),
        ("is_fitted", "?"),
        ("master", "i8"),
        ("crossings", "f8", (2,)),
        ("driver_advance", "f8"),
        ("arc", "f8"),
        ("mate_arc", "f8"),
        ("first_arc", "f8"),
        ("step", "f8"),
        ("closing_ste", "f8"),
        ("sliding_sign", "f8"),
        ("moment_arms", "f8", (4,)),
        ("tilt", "f8", (2,)),
        ("first", "i8", (2, SUPPORT)),
        ("weights", "f8", (2, SUPPORT, STENCIL)),
        ("beyond", "f8", (2, SUPPORT)),
    ],
    align=True,
)


@compiled_part
def interpolate(table, gear, row_patch, a, column_patch, b):
    total = 0.0
    row, column = row_patch.first[gear, a], column_patch.first[gear, b]
    for i in range(STENCIL):
        line = 0.0
        for j in range(STENCIL):
            line += column_patch.weights[gear, b, j] * table[row + i, column + j]
        total += row_patch.weights[gear, a, i] * line
    # a wedge has no length: nearer its corner, compliance grows with the logarithm
    beyond = min(row_patch.beyond[gear, a], column_patch.beyond[gear, b])
    if beyond > 0.0:
        total += beyond * (table[0, 0] - table[1, 1])
    return total


@compiled_part
def add_normal(block, factor, table, gear, receiver, source):
    """Add a factor times a flank's table at the support points of two patches."""
    for a in range(SUPPORT):
        for b in range(SUPPORT):
            block[a, b] += factor * interpolate(table, gear, receiver, a, source, b)


@compiled_part
def add_rootward(block, factor, table, gear, receiver, source):
    """Add the normal displacement under loads toward the root, as `add_normal`.

    It follows from Maxwell's theorem, C_nt[i, j] = C_tn[j, i].

    table : displacement of the source toward the root under normal loads on the
        receiver
    """
    for a in range(SUPPORT):
        for b in range(SUPPORT):
            block[a, b] += factor * interpolate(table, gear, source, b, receiver, a)


@compiled_part
def add_flank(block, factors, tables, ahead, behind, gear, receiver, source):
    """Add what one gear yields at the support points of two patches.

    factors : of the displacement along the normal under loads along it and toward the
        root, and of that toward the root
    tables : as those of the module; ahead, behind : places of the receiver from the
        source, and of the source from the receiver
    """
    nn, nt, tn, tt = factors
    if nn != 0.0:
        add_normal(block, nn, tables[gear, NORMAL, ahead], gear, receiver, source)
    if nt != 0.0:
        table = tables[gear, TANGENTIAL, behind]
        add_rootward(block, nt, table, gear, receiver, source)
    if tn != 0.0:
        add_normal(block, tn, tables[gear, TANGENTIAL, ahead], gear, receiver, source)
    if tt != 0.0 and tables.shape[1] > ROOTWARD:
        add_normal(block, tt, tables[gear, ROOTWARD, ahead], gear, receiver, source)


@compiled_part
def smooth_compliance_block(constants, patches, pairs, normal, rootward, block):
    """Both gears' smooth compliance (SUPPORT, SUPPORT), filled into block.

    pairs : indices of the patches where displacement is read and where load acts
    normal, rootward : parts of the unit load

    Load and displacement are those along the normal that both flanks have, and across
    it; a corner's gear has another normal. That of half-planes comes in `fill_local`.
    """
    tables, changes = constants.tables, constants.changes
    max_tooth_offset, (p, q) = tables.shape[2] // 2, pairs
    receiver, source = patches[p], patches[q]
    for a in range(SUPPORT):
        for b in range(SUPPORT):
            block[a, b] = 0.0
    teeth_apart = receiver.tooth - source.tooth
    if abs(teeth_apart) > max_tooth_offset:
        return
    for gear in range(2):
        # ahead is to the right on the driver and to the left on the driven gear
        tooth_offset = teeth_apart if gear == 0 else -teeth_apart
        along, across = normal, rootward
        if source.master == gear:
            c, sn = source.tilt[0], source.tilt[1]
            along, across = c * normal - sn * rootward, sn * normal + c * rootward
        c, sn = 1.0, 0.0
        if receiver.master == gear:
            c, sn = receiver.tilt[0], receiver.tilt[1]
        factors = c * along, c * across, sn * along, sn * across
        add_flank(
            block, factors, tables, max_tooth_offset + tooth_offset,
            max_tooth_offset - tooth_offset, gear, receiver, source,
        )  # fmt: skip
        if changes.shape[2] > 0:
            add_flank(
                block, factors, changes, p * patches.size + q, q * patches.size + p,
                gear, receiver, source,
            )  # fmt: skip


@compiled_part
def half_plane_factors(flanks, master):
    """Factors of both gears' half-planes under a normal and a rootward unit load.

    The latter cancel for equal gears.
    """
    normal, tangential = 0.0, 0.0
    for gear in range(2):
        flank = flanks[gear]
        normal += flank.has_half_plane / flank.modulus
        across = 0.5 * (1.0 - flank.poisson) / flank.modulus
        across *= flank.has_half_plane
        tangential += -across if gear == master else across
    return -2.0 / math.pi * normal, tangential


@compiled_part
def add_interpolated_block(C, row, column, lagrange, block):
    """C[row:, column:] += lagrange block lagrange^T.

    block : with a row of space below
    """
    for i in range(lagrange.shape[0]):
        for b in range(SUPPORT):
            block[SUPPORT, b] = 0.0
            for a in range(SUPPORT):
                block[SUPPORT, b] += lagrange[i, a] * block[a, b]
        for j in range(lagrange.shape[0]):
            total = 0.0
            for b in range(SUPPORT):
                total += block[SUPPORT, b] * lagrange[j, b]
            C[row + i, column + j] += total


@compiled_part
def fill_compliance(constants, work, count):
    """Compliance [m/(N/m)] over the nodes of the active pairs, friction included.

    C = C_nn + mu C_nt with mu the friction coefficient in the direction of sliding.

    count : of active pairs
    """
    C, block, grid = work.C, work.block, constants.grid
    nodes = grid.lagrange.shape[0]
    for p in range(count):
        for q in range(count):
            pairs = work.active_pairs[p], work.active_pairs[q]
            source = work.patches[pairs[1]]
            mu = constants.mesh.friction * source.sliding_sign
            smooth_compliance_block(constants, work.patches, pairs, 1.0, mu, block)
            for i in range(nodes):
                for j in range(nodes):
                    C[p * nodes + i, q * nodes + j] = 0.0
            if p == q:
                k = pairs[1]
                fill_local(C, p * nodes, constants, k, source, work.nodes[k], mu)
            add_interpolated_block(C, p * nodes, q * nodes, grid.lagrange, block)


@compiled_part
def fill_local(C, first_row, constants, k, patch, nodes, mu):
    """Fill the compliance of the half-planes under one pair's own nodes."""
    flanks, grid, log_step = constants.flanks[k], constants.grid, math.log(patch.step)
    normal, tangential = half_plane_factors(flanks, patch.master)
    is_spalled = has_less_width(nodes)
    for i in range(nodes.size):
        for j in range(nodes.size):
            local = normal * (grid.logarithm[i, j] + log_step)
            friction = mu * (tangential * grid.sign[i, j])
            entry = local + friction
            if is_spalled:
                more = on_less_width(nodes, i, j)
                entry += more * (against_center_lines(flanks, local) + friction)
            C[first_row + i, first_row + j] = entry


@compiled_part
def has_less_width(nodes):
    """Whether a spall has taken from the width of a node."""
    least = 1.0
    for i in range(nodes.size):
        least = min(least, nodes[i].width_share)
    return least < 1.0


@compiled_part
def on_less_width(nodes, i, j):
    """How much more load a width has that a spall leaves, as a part; 0 without."""
    return 1.0 / math.sqrt(nodes[i].width_share * nodes[j].width_share) - 1.0


@compiled_part
def against_center_lines(flanks, local):
    """Local compliance against the centre lines of both teeth, of that of half-planes.

    A load that a spall leaves on a part of the width has spread over all of it before
    it reaches them, so that what yields more is the flank against its tooth's centre
    line: Johnson (1985) eq. (5.57), whose depth is half of the tooth's thickness.
    """
    for gear in range(2):
        flank = flanks[gear]
        at_center_line = 1.0 + flank.poisson - 2.0 * math.log(flank.half_thickness)
        local -= flank.has_half_plane * at_center_line / (math.pi * flank.modulus)
    return local


@compiled_part
def quadratic_form(block):
    """The loads below a block times the block times these loads."""
    total = 0.0
    for a in range(SUPPORT):
        for b in range(SUPPORT):
            total += block[SUPPORT, a] * block[a, b] * block[SUPPORT, b]
    return total


@compiled_part
def friction_bending(constants, work, k):
    """Stiffening of a pair by rootward friction: -(q' C_nt q) / (q' C_nn q).

    The friction-bending ratio, eq. 4.42 of the multi-mesh source, of the pair k under
    the forces q of its nodes.
    """
    flanks, grid, patch = constants.flanks[k], constants.grid, work.patches[k]
    nodes, block, log_step = work.nodes[k], work.block, math.log(patch.step)
    normal_factor, tangential_factor = half_plane_factors(flanks, patch.master)
    is_spalled = has_less_width(nodes)
    normal, tangential = 0.0, 0.0
    for a in range(SUPPORT):
        block[SUPPORT, a] = 0.0
    for i in range(nodes.size):
        for a in range(SUPPORT):
            block[SUPPORT, a] += grid.lagrange[i, a] * nodes[i].force
        for j in range(nodes.size):
            load = nodes[i].force * nodes[j].force
            if load != 0.0:
                local = normal_factor * (grid.logarithm[i, j] + log_step)
                across = tangential_factor * grid.sign[i, j]
                normal += load * local
                tangential += load * across
                if is_spalled:
                    more = load * on_less_width(nodes, i, j)
                    normal += more * against_center_lines(flanks, local)
                    tangential += more * across
    smooth_compliance_block(constants, work.patches, (k, k), 1.0, 0.0, block)
    normal += quadratic_form(block)
    smooth_compliance_block(constants, work.patches, (k, k), 0.0, 1.0, block)
    tangential += quadratic_form(block)
    return -tangential / normal
