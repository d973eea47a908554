"""Laying the contact patches of the tooth pairs at one position.

Every pair that may touch carries equally spaced nodes on the flank that is nearer
its tip (the master); the last node is the one nearest the tip.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.contact.flanks import (
    FAR,
    arc_of_roll,
    closest_arc,
    roll_of_arc,
    separation,
)
from fegear.contact.grid import SUPPORT
from fegear.elasticity.flank_grid import place_stencil
from lumped.compiled import compiled_part

REACH = 0.5  # base pitches off the path within which a corner may touch
# Node of a patch: gap [m], arc of the opposite point on the mate [m], force [N/m].
NODE = np.dtype([("gap", "f8"), ("opposite", "f8"), ("force", "f8")], align=True)


@compiled_part
def hertz_half_width(mesh, flanks, s1, load):
    """Half-width of the contact strip under a line load [N/m]."""
    least = 0.02 * mesh.line
    rho1, rho2 = max(s1, least), max(mesh.line - s1, least)
    softness = 1.0 / flanks[0].modulus + 1.0 / flanks[1].modulus
    return math.sqrt(4.0 / math.pi * load * softness * rho1 * rho2 / (rho1 + rho2))


@compiled_part
def place_patch(mesh, flanks, patch, s1, extra_gap):
    """Find one pair's closest point; s1 is the driver's nominal roll length."""
    patch.master = 0 if s1 >= mesh.pitch else 1
    patch.nominal = s1 if s1 >= mesh.pitch else mesh.line - s1
    patch.present, patch.least_gap = False, FAR
    patch.sliding_sign = np.sign(mesh.pitch - s1)
    if abs(mesh.pitch - s1) < 1e-12 * mesh.line:
        patch.sliding_sign = 0.0
    master, slave = flanks[patch.master], flanks[1 - patch.master]
    off_path = patch.nominal > master.tip_roll * (1.0 + 1e-12)
    if off_path and not mesh.corner:
        return
    if patch.nominal > master.tip_roll + REACH * mesh.base_pitch:
        return  # farther off, the point may lie behind the mate's base circle
    patch.arc = max(0.0, arc_of_roll(master, patch.nominal))
    removed = (
        master.tip_relief.magnitude
        + master.root_relief.magnitude
        + slave.tip_relief.magnitude
        + slave.root_relief.magnitude
    )
    if removed > 0.0:
        patch.arc = closest_arc(
            master, slave, mesh.line, patch.nominal, patch.arc, 0.1 * master.length
        )
    s = roll_of_arc(master, patch.arc)
    gap, s_slave, lean = separation(master, slave, mesh.line, patch.nominal, s)
    patch.opposite = arc_of_roll(slave, s_slave)
    if not 0.0 <= patch.opposite <= slave.length:
        return  # the corner is past the mate's flank, whose involute ends there
    patch.present = True
    set_levers(mesh, flanks, patch, s, lean, off_path)
    patch.least_gap = (gap + extra_gap) * flanks[0].base_radius / patch.lever[0]


@compiled_part
def set_levers(mesh, flanks, patch, s, lean, off_path):
    """Arms of normal and friction force about the two centres.

    On the nominal path the force acts along the line of action; off it, normal to
    the slave's flank through the master's tip corner.
    """
    m = patch.master
    rb_master, rb_slave = flanks[m].base_radius, flanks[1 - m].base_radius
    patch.lever[m], patch.lever[1 - m] = rb_master, rb_slave
    patch.lever[2 + m], patch.lever[3 - m] = patch.nominal, mesh.line - patch.nominal
    if off_path:
        turn = (s - patch.nominal) / rb_master - lean
        c, sn = math.cos(turn), math.sin(turn)
        patch.lever[m] = rb_master * c + s * sn
        patch.lever[2 + m] = s * c - rb_master * sn
        apart = mesh.line * math.cos(lean) + (rb_master + rb_slave) * math.sin(lean)
        patch.lever[3 - m] = apart - patch.lever[2 + m]


@compiled_part
def lay_nodes(constants, patch, nodes, extra_gap, half_width):
    """Gaps and opposite arcs of a pair's nodes (n,), stencils at support points."""
    m, mesh, points = patch.master, constants.mesh, constants.grid.points
    master, slave = constants.flanks[m], constants.flanks[1 - m]
    count = constants.tables.shape[3]
    near, far = max(0.0, patch.arc - half_width), patch.arc + half_width
    patch.far = far
    patch.step = (far - near) / (nodes.size - 1)
    for i in range(nodes.size):
        s = roll_of_arc(master, far - i * patch.step)
        gap, s_slave, _ = separation(master, slave, mesh.line, patch.nominal, s)
        nodes[i].gap = gap + extra_gap
        nodes[i].opposite = arc_of_roll(slave, s_slave)
    for a in range(SUPPORT):
        arc = 0.5 * (far + near) - 0.5 * (far - near) * points[a]
        s = roll_of_arc(master, arc)
        s_slave = separation(master, slave, mesh.line, patch.nominal, s)[1]
        set_stencil(patch, m, a, arc, master, count)
        set_stencil(patch, 1 - m, a, arc_of_roll(slave, s_slave), slave, count)


@compiled_part
def set_stencil(patch, gear, a, arc, flank, count):
    """Where the flank's table is read at support point a."""
    weights = patch.weights[gear, a]
    patch.first[gear, a] = place_stencil(
        arc, flank.length, flank.grading, count, weights
    )
