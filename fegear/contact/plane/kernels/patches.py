"""Laying the contact patches of the tooth pairs at one position.

Every pair that may touch carries equally spaced nodes on the flank that is nearer
its tip (the master); the last node is the one nearest the tip.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.plane.grid import SUPPORT
from fegear.contact.plane.kernels.flanks import (
    NO_FLANK_GAP,
    arc_of_roll,
    base_tangent_angle,
    closest_arc,
    common_normal,
    is_relieved,
    normal_angle,
    roll_of_arc,
    separation,
)
from fegear.elasticity.flank_grid import beyond_first, place_stencil
from lumped.common.compiled import compiled_part

CORNER_OVERLAP = 2e-3  # of a flank's length, beyond the tip where an edge still touches
COARSE_ARC_RTOL, ARC_RTOL = 1e-3, 1e-8  # of a flank's length, for the closest point
CORNER_WIDTH = 1.5  # of a corner's contact, over load times compliance over angle
MIN_CORNER_WIDTH = 1e-6  # of that of the flanks, so that a grazing corner has nodes
TIP_RTOL = 1e-12  # of a roll length, by which it may be on either side of a tip
MIN_ROLL = 0.02  # of the line of action, least radius of curvature
MAX_REACH, REACH_STEPS = 5.0, 40  # contact half-widths searched for more contact
MAX_TURN = 0.05  # base pitches; farther off, flanks on the path never touch
MAX_TURNS, TURN_RTOL = 6, 1e-5  # turns until a corner touches; rest, of a base pitch
# Node of a patch: gap [m], arc of the opposite point on the mate [m], force [N/m],
# the share of the face width on which both flanks are there, and whether they touch,
# as which the next position starts.
NODE = np.dtype(
    [
        ("gap", "f8"),
        ("mate_arc", "f8"),
        ("force", "f8"),
        ("width_share", "f8"),
        ("in_contact", "?"),
    ],
    align=True,
)


@compiled_part
def hertz_half_width(mesh, flanks, s1, load):
    """Half-width of the contact strip under a line load [N/m]."""
    line = mesh.line_of_action
    rho1 = curvature_radius(flanks[0], line, s1)
    rho2 = curvature_radius(flanks[1], line, line - s1)
    compliance = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
    return math.sqrt(4.0 / math.pi * load * compliance * rho1 * rho2 / (rho1 + rho2))


@compiled_part
def corner_width(flanks, patch, half_width, load):
    """Width of the contact of a corner under a line load [N/m].

    A corner whose flank is at an angle to its mate's touches over a width in proportion
    to the load, as a wedge does (Johnson (1985) eq. (5.42)), up to that of the flanks,
    half_width [m].
    """
    angle = abs(patch.tilt[1])
    if angle == 0.0 or load <= 0.0:
        return half_width
    compliance = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
    ratio = 0.5 * half_width * angle / (CORNER_WIDTH * compliance * load)
    share = 1.0 / (math.hypot(1.0, ratio) + ratio)
    return half_width * max(share, MIN_CORNER_WIDTH)


@compiled_part
def curvature_radius(flank, line, s):
    """Radius of curvature at a roll length, not too small; negative where concave."""
    return s if flank.base_radius < 0.0 else max(s, MIN_ROLL * abs(line))


@compiled_part
def place_patch(mesh, flanks, patch, s1):
    """Find one pair's closest point; s1 is the driver's nominal roll length."""
    patch.master = 0 if s1 >= mesh.pitch_point else 1
    rolls = s1, mesh.line_of_action - s1
    mate = 1 - patch.master
    is_broken = flanks[mate].tip_arc > 0.0 and is_past_tip(
        flanks, rolls, mate, -TIP_RTOL
    )
    if is_broken and not is_past_tip(flanks, rolls, patch.master, -TIP_RTOL):
        patch.master = mate  # it ends below the pitch point
    patch.present, patch.closing_ste = False, NO_FLANK_GAP
    patch.is_fitted = False
    patch.sliding_sign = np.sign(mesh.pitch_point - s1)
    if abs(mesh.pitch_point - s1) < 1e-12 * abs(mesh.line_of_action):
        patch.sliding_sign = 0.0
    turn_driver(mesh, patch, s1, 0.0)
    master, slave = flanks[patch.master], flanks[1 - patch.master]
    nominal = patch.crossings[0]  # the master's roll length
    is_undercut = slave.undercut_roll > 0.0
    if is_undercut and patch.crossings[1] < slave.undercut_roll * (1.0 - 1e-12):
        place_edge_patch(mesh, flanks, patch, s1)
        if patch.present or nominal <= master.corner_roll:
            return
        # the edge has not reached the mate's tip, whose corner may touch above it
        patch.master = 1 - patch.master
        turn_driver(mesh, patch, s1, 0.0)
    corner = master.corner_roll
    off_path = nominal > corner + TIP_RTOL * abs(corner)
    way_off = nominal - corner
    if off_path and (
        mesh.corner_range == 0.0 or way_off > mesh.corner_range * mesh.base_pitch
    ):
        return
    patch.arc = max(master.tip_arc, arc_of_roll(master, nominal))
    if is_relieved(master) or is_relieved(slave):
        find_closest(mesh, flanks, patch, 0.1, COARSE_ARC_RTOL)
        set_contact(mesh, flanks, patch, off_path, 0.0)
        if not patch.present:
            return
        # levers and gaps are those where the flanks touch, the driver turned so far
        turn_driver(mesh, patch, s1, min(patch.closing_ste, MAX_TURN * mesh.base_pitch))
        find_closest(mesh, flanks, patch, 0.01, ARC_RTOL)
        if off_path:
            close_corner(mesh, flanks, patch, s1)
    elif off_path:
        close_corner(mesh, flanks, patch, s1)
    set_contact(mesh, flanks, patch, off_path, patch.extra_gap)


@compiled_part
def close_corner(mesh, flanks, patch, s1):
    """Turn the driver until a corner off the path touches its mate.

    The gap is a way of the slave's base circle. Where the driver is the master, it
    turns the corner, so that the way that closes it is that of Newton's method.
    """
    is_modified = is_relieved(flanks[0]) or is_relieved(flanks[1])
    for _ in range(MAX_TURNS):
        set_contact(mesh, flanks, patch, True, 0.0)
        rest = patch.closing_ste - patch.driver_advance
        if not patch.present or abs(rest) < TURN_RTOL * mesh.base_pitch:
            return
        turn_driver(mesh, patch, s1, patch.closing_ste)
        if is_modified:
            find_closest(mesh, flanks, patch, 0.01, ARC_RTOL)


@compiled_part
def is_past_tip(flanks, rolls, gear, margin):
    """Whether a gear's flank would cross the line of action beyond its tip corner.

    margin : of its roll length
    """
    corner = flanks[gear].corner_roll
    return rolls[gear] > corner + margin * abs(corner)


@compiled_part
def place_edge_patch(mesh, flanks, patch, s1):
    """Contact of the edge at which an undercut ends the slave's flank.

    The edge touches the mate's flank off the line of action, as a tip corner does: its
    gear becomes the master, whose patch ends at the edge.
    """
    nominal, edge = patch.crossings[1], flanks[1 - patch.master].undercut_roll
    if mesh.corner_range == 0.0 or nominal < edge - mesh.corner_range * mesh.base_pitch:
        return
    patch.master = 1 - patch.master
    patch.arc = flanks[patch.master].length
    turn_driver(mesh, patch, s1, 0.0)
    master, slave = flanks[patch.master], flanks[1 - patch.master]
    s = roll_of_arc(master, patch.arc)
    gap = separation(master, slave, mesh.line_of_action, patch.crossings, s)[0]
    # levers and gap are those where they touch, maybe just below the mate's tip
    turn_driver(mesh, patch, s1, min(gap, MAX_TURN * mesh.base_pitch))
    set_contact(mesh, flanks, patch, True, patch.extra_gap)
    if not patch.present:
        turn_driver(mesh, patch, s1, 0.0)
        set_contact(mesh, flanks, patch, True, patch.extra_gap)


@compiled_part
def ends_at_edge(flanks, patch):
    """Whether a patch ends where an undercut ends the master's flank."""
    master = flanks[patch.master]
    return master.undercut_roll > 0.0 and patch.first_arc >= master.length


@compiled_part
def reach_of_patch(mesh, flanks, patch, half_width):
    """Half-width that includes other valleys of the gap that the load closes.

    half_width : of the contact of unmodified flanks under the load [m]

    Beside a Hertzian contact of half-width b, at x = b t, bodies come as near as
    b^2 / (2 R) (t^2 - t sqrt(t^2 - 1) + arcosh t): a gap that exceeds its least value
    by less closes too.
    """
    master, slave = flanks[patch.master], flanks[1 - patch.master]
    if master.profile.count + slave.profile.count == 0:
        return half_width
    line, crossings = mesh.line_of_action, patch.crossings
    least = separation(master, slave, line, crossings, roll_of_arc(master, patch.arc))
    s1 = curvature_radius(master, line, crossings[0])
    s2 = curvature_radius(slave, line, crossings[1])
    depth = half_width**2 * (s1 + s2) / (2.0 * s1 * s2)
    reach = half_width
    for i in range(1, REACH_STEPS + 1):
        t = 1.0 + (MAX_REACH - 1.0) * i / REACH_STEPS
        approach = t * t - t * math.sqrt(t * t - 1.0) + math.acosh(t)
        for side in (-1.0, 1.0):
            arc = patch.arc + side * t * half_width
            if master.tip_arc <= arc <= master.length:
                s = roll_of_arc(master, arc)
                gap = separation(master, slave, line, crossings, s)[0]
                if gap - least[0] < approach * depth:
                    reach = t * half_width
    return reach


@compiled_part
def turn_driver(mesh, patch, s1, advance):
    """Put the driver a way `advance` [m] ahead of where unmodified flanks touch."""
    patch.driver_advance = advance
    crossings = s1 + advance, mesh.line_of_action - s1
    patch.crossings[0] = crossings[patch.master]
    patch.crossings[1] = crossings[1 - patch.master]


@compiled_part
def find_closest(mesh, flanks, patch, search_radius, arc_tol):
    """Arc of the master where the gap is least.

    search_radius : within which it is sought first; arc_tol : tolerance; both as parts
        of the flank's length
    """
    master, slave = flanks[patch.master], flanks[1 - patch.master]
    patch.arc = closest_arc(
        master, slave, mesh.line_of_action, patch.crossings, patch.arc,
        search_radius * master.length, arc_tol * master.length,
    )  # fmt: skip


@compiled_part
def set_contact(mesh, flanks, patch, off_path, extra_gap):
    """Levers and gap at the master's closest point, if the mate's flank is there.

    Unmodified flanks touch on the line of action; off the path, the force is normal to
    the slave's flank through the master's tip corner.
    """
    master, slave = flanks[patch.master], flanks[1 - patch.master]
    s = roll_of_arc(master, patch.arc)
    gap, s_slave, mate_tangent_angle = separation(
        master, slave, mesh.line_of_action, patch.crossings, s
    )
    patch.mate_arc = arc_of_roll(slave, s_slave)
    is_edge = master.undercut_roll > 0.0 and patch.arc >= master.length
    # while edge and tip corner meet, each is just beyond the other's flank
    lowest = slave.tip_arc - (CORNER_OVERLAP * slave.length if is_edge else 0.0)
    patch.present = lowest <= patch.mate_arc <= slave.length
    if not patch.present:
        patch.closing_ste = NO_FLANK_GAP
        return
    tangent_angle, normal_direction = (
        base_tangent_angle(master, patch.crossings[0], s),
        mate_tangent_angle,
    )
    if is_relieved(master) or is_relieved(slave):
        normal_direction = common_normal(
            master, slave, mesh.line_of_action, patch.crossings, patch.arc
        )
    elif not off_path:
        s, tangent_angle, normal_direction = patch.crossings[0], 0.0, 0.0
    tilt = 0.0
    if off_path and (is_edge or patch.arc == master.tip_arc):
        tilt = normal_direction - tangent_angle - normal_angle(master, s)
    patch.tilt[0], patch.tilt[1] = math.cos(tilt), math.sin(tilt)
    set_levers(mesh, flanks, patch, s, tangent_angle, normal_direction)
    gap = normal_gap(flanks, patch, gap)
    patch.closing_ste = patch.driver_advance + (gap + extra_gap) / closing_rate(
        flanks, patch
    )


@compiled_part
def set_levers(mesh, flanks, patch, s, tangent_angle, normal_direction):
    """Arms of normal and friction force about the two centres.

    s : the master's roll length at the point of contact [m]
    tangent_angle, normal_direction : of the base tangent there and of the force,
        from the line of action
    """
    m = patch.master
    bases = flanks[0].base_radius + flanks[1].base_radius
    c, sn = (
        math.cos(tangent_angle - normal_direction),
        math.sin(tangent_angle - normal_direction),
    )
    patch.moment_arms[m] = flanks[m].base_radius * c + s * sn
    patch.moment_arms[2 + m] = s * c - flanks[m].base_radius * sn
    c, sn = math.cos(normal_direction), math.sin(normal_direction)
    patch.moment_arms[1 - m] = (
        bases * c - mesh.line_of_action * sn - patch.moment_arms[m]
    )
    patch.moment_arms[3 - m] = (
        mesh.line_of_action * c + bases * sn - patch.moment_arms[2 + m]
    )


@compiled_part
def closing_rate(flanks, patch):
    """Contact approach per transmission error."""
    return patch.moment_arms[0] / flanks[0].base_radius


@compiled_part
def normal_gap(flanks, patch, gap):
    """Convert a gap on the slave's base circle to one along the common normal."""
    slave = 1 - patch.master
    return gap * patch.moment_arms[slave] / flanks[slave].base_radius


@compiled_part
def lay_nodes(constants, flanks, patch, nodes):
    """Gaps and opposite arcs of a pair's nodes (n,), stencils at support points."""
    m, mesh, points = patch.master, constants.mesh, constants.grid.points
    line, crossings = mesh.line_of_action, patch.crossings
    master, slave = flanks[m], flanks[1 - m]
    count, half_width = constants.tables.shape[3], patch.half_width
    tip_end = max(master.tip_arc, patch.arc - half_width)
    root_end = patch.arc + half_width
    if master.undercut_roll > 0.0:
        root_end = min(root_end, master.length)
    if slave.undercut_roll > 0.0:
        tip_end = arc_facing_edge(mesh, flanks, patch, tip_end)
    patch.first_arc = root_end
    patch.step = (root_end - tip_end) / (nodes.size - 1)
    initial_gap = patch.extra_gap + patch.driver_advance * closing_rate(flanks, patch)
    for i in range(nodes.size):
        s = roll_of_arc(master, root_end - i * patch.step)
        gap, s_slave, _ = separation(master, slave, line, crossings, s)
        nodes[i].gap = normal_gap(flanks, patch, gap) + initial_gap
        nodes[i].mate_arc = arc_of_roll(slave, s_slave)
        nodes[i].width_share = width_at(master, s) * width_at(slave, s_slave)
        if 0.0 < s_slave < slave.undercut_roll:
            nodes[i].gap = NO_FLANK_GAP
    for a in range(SUPPORT):
        arc = 0.5 * (root_end + tip_end) - 0.5 * (root_end - tip_end) * points[a]
        s = roll_of_arc(master, arc)
        s_slave = separation(master, slave, line, crossings, s)[1]
        set_stencil(patch, m, a, arc, master, count)
        set_stencil(patch, 1 - m, a, arc_of_roll(slave, s_slave), slave, count)


@compiled_part
def width_at(flank, s):
    """Share of the face width that a flank has at roll length s, 1 without spall."""
    width = 1.0
    for spall in flank.spalls:
        if spall.share == 0.0:
            break
        if spall.start <= s <= spall.end:
            width -= spall.share
    return width


@compiled_part
def arc_facing_edge(mesh, flanks, patch, tip_end):
    """Arc of the master opposite the edge of the slave's undercut, at least tip_end.

    A patch that ends there has a node at the edge, where the pressure is largest.
    """
    master, slave = flanks[patch.master], flanks[1 - patch.master]
    line, crossings, edge = mesh.line_of_action, patch.crossings, slave.undercut_roll
    low, high = tip_end, patch.arc
    for arc, is_edge_within in ((low, True), (high, False)):
        roll = separation(master, slave, line, crossings, roll_of_arc(master, arc))[1]
        if (roll < edge) != is_edge_within:
            return tip_end
    while high - low > ARC_RTOL * 1e-4 * master.length:
        middle = 0.5 * (low + high)
        s = roll_of_arc(master, middle)
        if separation(master, slave, line, crossings, s)[1] < edge:
            low = middle
        else:
            high = middle
    return high


@compiled_part
def set_stencil(patch, gear, a, arc, flank, count):
    """Find the place in the flank's table at which support point a is read."""
    weights = patch.weights[gear, a]
    both_ends = flank.undercut_roll > 0.0
    patch.first[gear, a] = place_stencil(
        arc, flank.length, flank.grading, both_ends, count, weights
    )
    patch.beyond[gear, a] = beyond_first(
        arc, flank.length, flank.grading, both_ends, count
    )
