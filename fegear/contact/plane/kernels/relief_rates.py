"""How the transmission error of loaded tooth pairs answers their reliefs, compiled.

A relief opens the gaps of the nodes, shifts the point of contact and turns the normal
there, which changes the moment arms; the driver turns ahead by what it opens. Nodes
count as if they stayed in place: they follow the point of contact, which changes the
discretisation alone.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.plane.kernels.flanks import (
    KINK,
    base_tangent_angle,
    is_relieved,
    modification_slope,
    normals,
    profile_derivatives,
    relief_derivatives,
    relief_slope_derivatives,
    roll_of_arc,
    separation,
)
from lumped.common.compiled import compiled_part
from lumped.kernels.elimination import eliminate

CROSSING_STEP = 1e-8  # of the line of action, for differences over a crossing
MAX_BEND = 100.0  # of a normal over the roll length, per base radius; more is a kink


# Per (torque, position, pair): the pair's part of derivatives of the transmission error
# times the slope of the load [Pa].
#   relief : by magnitude and start of tip and root relief of driver and driven
#   profile : slopes of nodal forces times the derivatives of their gaps, by crowning
#       and slope of the profiles of driver and driven
RATE = np.dtype([("relief", "f8", (2, 2, 2)), ("profile", "f8", (2, 2))], align=True)


@compiled_part
def store_rates(constants, work, count, ste, rates):
    """Fill the rates of the active pairs, zero for flanks without modifications.

    count : of active pairs
    """
    size = work.nodes.shape[1]
    unknowns = work.unknowns[: count * size]
    set_moment_rates(constants, work, unknowns)
    for p in range(count):
        k = work.active_pairs[p]
        by_gap = unknowns[p * size : (p + 1) * size]
        flanks, patch, nodes = constants.flanks[k], work.patches[k], work.nodes[k]
        add_relief_rates(constants.mesh, flanks, patch, nodes, by_gap, ste, rates[k])
        add_profile_rates(flanks, patch, nodes, by_gap, rates[k])


@compiled_part
def set_moment_rates(constants, work, unknowns):
    """Fill `moment_rate` of nodes: C' rates = arm over those in contact."""
    for i in range(unknowns.size):
        unknowns[i].moment_rate = unknowns[i].rate
    if constants.mesh.friction == 0.0:
        return
    n, matrix, base_radius = 0, work.matrix, constants.flanks[0, 0].base_radius
    for i in range(unknowns.size):
        unknowns[i].moment_rate = 0.0
        if unknowns[i].in_contact:
            unknowns[n].touching = i
            n += 1
    for i in range(n):
        matrix[i, n] = unknowns[unknowns[i].touching].arm
        for j in range(n):
            matrix[i, j] = work.C[unknowns[j].touching, unknowns[i].touching]
    eliminate(matrix, n, n + 1)
    for i in range(n):
        unknowns[unknowns[i].touching].moment_rate = matrix[i, n] / base_radius


@compiled_part
def add_relief_rates(mesh, flanks, patch, nodes, unknowns, ste, rate):
    """Add a pair's rates by reliefs; none for flanks without.

    unknowns : of the nodes of the pair, under the transmission error `ste`
    """
    m = patch.master
    if not (is_relieved(flanks[0]) or is_relieved(flanks[1])):
        return
    master, slave = flanks[m], flanks[1 - m]
    contact = contact_point(mesh, master, slave, patch)
    sums = node_sums(mesh, master, slave, patch, unknowns)
    for gear in range(2):
        s = contact[0] if gear == m else contact[1]
        for end in range(2):
            opened = gap_rates(mesh, flanks, patch, nodes, unknowns, gear, end)
            for parameter in range(2):
                depth, slope = depth_and_slope(flanks[gear], end, parameter, s)
                turned = turn_normal(master, slave, patch, contact, gear, depth, slope)
                total = opened[parameter] + pair_rate(
                    mesh, flanks, patch, contact, sums, ste, turned
                )
                rate.relief[gear, end, parameter] += total


@compiled_part
def add_profile_rates(flanks, patch, nodes, unknowns, rate):
    """Add a pair's rates by profiles, at fixed moment arms; none without profiles."""
    slave = 1 - patch.master
    factor = patch.moment_arms[slave] / flanks[slave].base_radius
    for gear in range(2):
        flank = flanks[gear]
        if not flank.profile.is_there:
            continue
        for i in range(nodes.size):
            arc = nodes[i].mate_arc
            if gear == patch.master:
                arc = patch.first_arc - i * patch.step
            s = roll_of_arc(flank, arc)
            by_crowning, by_slope = profile_derivatives(flank.profile, s)
            moment_rate = unknowns[i].moment_rate
            rate.profile[gear, 0] += factor * moment_rate * by_crowning
            rate.profile[gear, 1] += factor * moment_rate * by_slope


@compiled_part
def depth_and_slope(flank, end, parameter, s):
    """Derivatives of depth and slope of one relief at roll length s.

    end : 0 tip, 1 root; parameter : 0 magnitude, 1 start
    """
    relief = flank.tip_relief if end == 0 else flank.root_relief
    depth, slope = relief_derivatives(relief, s), relief_slope_derivatives(relief, s)
    return (depth[0], slope[0]) if parameter == 0 else (depth[1], slope[1])


@compiled_part
def gap_by_crossing(mesh, master, slave, patch, s):
    """Gap at the master's roll length s, and its slope over the master's crossing."""
    line, step = mesh.line_of_action, CROSSING_STEP * mesh.line_of_action
    here = patch.crossings[0]
    gap = separation(master, slave, line, patch.crossings, s)[0]
    patch.crossings[0] = here + step
    shifted = separation(master, slave, line, patch.crossings, s)[0]
    patch.crossings[0] = here
    return gap, (shifted - gap) / step


@compiled_part
def node_sums(mesh, master, slave, patch, unknowns):
    """Sums over nodes: load, its slope, slopes times gaps and times gaps' slopes."""
    load, stiffness, gaps, by_crossing = 0.0, 0.0, 0.0, 0.0
    for i in range(unknowns.size):
        load += unknowns[i].force
        rate = unknowns[i].moment_rate
        if rate != 0.0:
            s = roll_of_arc(master, patch.first_arc - i * patch.step)
            gap, slope = gap_by_crossing(mesh, master, slave, patch, s)
            stiffness += rate
            gaps += rate * gap
            by_crossing += rate * slope
    return load, stiffness, gaps, by_crossing


@compiled_part
def gap_rates(mesh, flanks, patch, nodes, unknowns, gear, end):
    """Slopes of nodal forces times derivatives of gaps, at fixed normals.

    By magnitude and start. A modification of the master is a shift of its crossing.
    """
    m = patch.master
    flank, slave = flanks[gear], flanks[1 - m]
    relief = flank.tip_relief if end == 0 else flank.root_relief
    by_magnitude, by_start = 0.0, 0.0
    if relief.magnitude == 0.0:
        return by_magnitude, by_start
    for i in range(nodes.size):
        weight = unknowns[i].moment_rate
        if weight == 0.0:
            continue
        arc = patch.first_arc - i * patch.step if gear == m else nodes[i].mate_arc
        s = roll_of_arc(flank, arc)
        depth = relief_derivatives(relief, s)
        if gear == m and depth[0] != 0.0:
            weight *= -gap_by_crossing(mesh, flank, slave, patch, s)[1]
        by_magnitude += weight * depth[0]
        by_start += weight * depth[1]
    factor = patch.moment_arms[1 - m] / slave.base_radius
    return factor * by_magnitude, factor * by_start


@compiled_part
def contact_point(mesh, master, slave, patch):
    """Roll lengths of master and mate, tangent and normal angle, and their slopes.

    Slopes of the normals of master and mate over the master's roll length, that of the
    mate over the master's crossing, and whether the point stays on the master, at a
    corner or kink, or on the mate.
    """
    line, step = mesh.line_of_action, KINK * master.length
    crossings, here = patch.crossings, patch.crossings[0]
    near = roll_of_arc(master, max(0.0, patch.arc - step))
    far = roll_of_arc(master, patch.arc + step)
    master_near, mate_near = normals(master, slave, line, crossings, near)
    master_far, mate_far = normals(master, slave, line, crossings, far)
    by_s = (master_near - master_far) / (near - far)
    mate_by_s = (mate_near - mate_far) / (near - far)
    max_bend = MAX_BEND / min(abs(master.base_radius), abs(slave.base_radius))
    is_corner = patch.arc == 0.0 or (
        master.undercut_roll > 0.0 and patch.arc >= master.length
    )
    stays = is_corner or abs(by_s) > max_bend
    s = roll_of_arc(master, patch.arc)
    s_mate = separation(master, slave, line, crossings, s)[1]
    shift = CROSSING_STEP * line
    mate_normal = normals(master, slave, line, crossings, s)[1]
    crossings[0] = here + shift
    mate_by_x = (normals(master, slave, line, crossings, s)[1] - mate_normal) / shift
    crossings[0] = here
    tangent = base_tangent_angle(master, here, s)
    normal = 0.5 * (master_near + master_far)
    if is_corner or abs(mate_by_s) < abs(by_s):
        normal = 0.5 * (mate_near + mate_far)
    stays_on_mate = abs(mate_by_s) > max_bend
    return s, s_mate, tangent, normal, by_s, mate_by_s, mate_by_x, stays, stays_on_mate


@compiled_part
def slope_turn(flank, s):
    """Turn of a flank's normal per slope of its depth, see `normal_angle`."""
    slope, base = modification_slope(flank, s), flank.base_radius
    way = (1.0 + slope) * s
    return base * s / (way * way + (slope * base) ** 2)


@compiled_part
def turn_normal(master, slave, patch, contact, gear, depth, slope):
    """Advance of the driver, shift of the point, turns of tangent and normal.

    depth, slope : of a modification of `gear` at the point; the driver turns ahead by
        what it opens there
    """
    s, s_mate, _, _, by_s, mate_by_s, mate_by_x, stays, stays_on_mate = contact
    m = patch.master
    driver = master if m == 0 else slave
    factor = patch.moment_arms[1 - m] / slave.base_radius
    advance = factor * depth * driver.base_radius / patch.moment_arms[0]
    shift = advance if m == 0 else 0.0  # of the master's crossing
    if gear == m:
        shift -= depth
    turn, mate_turn = -shift / master.base_radius, shift * mate_by_x
    if gear == m:
        turn += slope_turn(master, s) * slope
    else:
        mate_turn += slope_turn(slave, s_mate) * slope
    way = 0.0
    if stays:
        turn = mate_turn
    elif not stays_on_mate:
        way = (mate_turn - turn) / (by_s - mate_by_s)
        turn += by_s * way
    tangent_turn = (1.0 + modification_slope(master, s)) * way - shift
    return advance, way, tangent_turn / master.base_radius, turn


@compiled_part
def pair_rate(mesh, flanks, patch, contact, sums, ste, turned):
    """What changed moment arms and the driver's advance add to a pair's rate."""
    _, _, tangent, normal = contact[:4]
    load, stiffness, gaps, by_crossing = sums
    advance, way, tangent_turn, turn = turned
    m, line = patch.master, mesh.line_of_action
    base, mate_base = flanks[m].base_radius, flanks[1 - m].base_radius
    # as in `set_levers`
    angle, angle_turn = tangent - normal, tangent_turn - turn
    arm = patch.moment_arms[2 + m] * angle_turn + math.sin(angle) * way
    sliding = -patch.moment_arms[m] * angle_turn + math.cos(angle) * way
    c, sn, bases = math.cos(normal), math.sin(normal), base + mate_base
    mate_arm = -(bases * sn + line * c) * turn - arm
    mate_sliding = (bases * c - line * sn) * turn - sliding
    factor = patch.moment_arms[1 - m] / mate_base
    total = gaps * mate_arm / mate_base
    total += advance * stiffness * patch.moment_arms[0] / flanks[0].base_radius
    total += advance * factor * (by_crossing if m == 0 else -stiffness)
    if m == 1:
        arm, sliding = mate_arm, mate_sliding
    total += (patch.driver_advance - ste) * stiffness * arm / flanks[0].base_radius
    friction = mesh.friction * patch.sliding_sign * sliding
    return total - load * (arm - friction) / flanks[0].base_radius
