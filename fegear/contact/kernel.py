"""Load distribution over the tooth pairs of one mesh, compiled.

Every tooth pair that may touch carries a patch of equally spaced nodes on the
flank that is nearer its tip (the master); the last node is the one nearest the
tip. Loads and torques are per unit face width.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fegear.contact.active_set import NOT_FINITE, solve_contact
from fegear.contact.compiled import compiled
from fegear.contact.compliance import (
    STENCIL,
    interpolate,
    lagrange_table,
    logarithm_table,
    sign_table,
    stencil,
)
from fegear.contact.flanks import (
    FAR,
    arc_of_roll,
    closest_arc,
    roll_of_arc,
    separation,
)

SUPPORT = 5  # points per patch at which the smooth remainder is evaluated
MARGIN = 1.2  # half length of a patch over the Hertz half-width at full load
GROWTH = 1.6
MAX_ROUNDS = 8


class Grid(NamedTuple):
    """Constants of an equally spaced patch, made once per call."""

    logarithm: np.ndarray  # (nodes, nodes)
    sign: np.ndarray  # (nodes, nodes)
    points: np.ndarray  # (SUPPORT,) in [-1, 1]
    lagrange: np.ndarray  # (nodes, SUPPORT)


class Patches(NamedTuple):
    """Patches of all pairs at one position; first axis is the pair.

    present : whether the pair takes part
    gap : (pairs, nodes) normal gap at nodes
    least_gap : (pairs,) smallest approach that closes the pair
    step : (pairs,) node spacing
    lever : (pairs, 4) arms of the normal force about driver and driven, then of
        the rootward friction force
    approach : (pairs,) +1 before the pitch point, -1 behind, 0 on it
    first, weights : table stencils at the support points, (pairs, 2, SUPPORT[, 4])
    driver_is_master : (pairs,)
    """

    present: np.ndarray
    gap: np.ndarray
    least_gap: np.ndarray
    step: np.ndarray
    lever: np.ndarray
    approach: np.ndarray
    first: np.ndarray
    weights: np.ndarray
    driver_is_master: np.ndarray


@compiled
def make_grid(nodes):
    points = np.cos(math.pi * (np.arange(SUPPORT) + 0.5) / SUPPORT)[::-1].copy()
    return Grid(
        logarithm_table(nodes),
        sign_table(nodes),
        points,
        lagrange_table(nodes, points),
    )


@compiled
def make_patches(pairs, nodes):
    return Patches(
        np.zeros(pairs, np.bool_),
        np.empty((pairs, nodes)),
        np.full(pairs, FAR),
        np.ones(pairs),
        np.zeros((pairs, 4)),
        np.zeros(pairs),
        np.zeros((pairs, 2, SUPPORT), np.int64),
        np.zeros((pairs, 2, SUPPORT, STENCIL)),
        np.zeros(pairs, np.bool_),
    )


@compiled
def hertz_half_width(mesh, s1, load):
    """Half-width of the contact strip under a line load [N/m]."""
    s2 = mesh.line - s1
    low = 0.02 * mesh.line
    radius = max(s1, low) * max(s2, low) / (max(s1, low) + max(s2, low))
    compliance = 1.0 / mesh.driver.modulus + 1.0 / mesh.driven.modulus
    return math.sqrt(4.0 * load * radius * compliance / math.pi)


@compiled
def place_patch(mesh, patches, pair, s1, extra_gap, half_width, grid):
    """Lay one pair's patch around its closest point; s1 is its nominal contact."""
    master_is_driver = s1 >= mesh.pitch
    if master_is_driver:
        master, slave, s = mesh.driver, mesh.driven, s1
    else:
        master, slave, s = mesh.driven, mesh.driver, mesh.line - s1
    off_path = s > master.tip_roll * (1.0 + 1e-12)
    patches.present[pair] = False
    patches.least_gap[pair] = FAR
    if off_path and not mesh.corner:
        return
    arc = max(0.0, arc_of_roll(master, s))
    steepest = (
        master.tip_relief.magnitude
        + master.root_relief.magnitude
        + slave.tip_relief.magnitude
        + slave.root_relief.magnitude
    )
    if steepest > 0.0:
        arc = closest_arc(master, slave, mesh.line, s, arc, 0.1 * master.length)
    s_closest = roll_of_arc(master, arc)
    gap, _, lean = separation(master, slave, mesh.line, s, s_closest)
    if gap >= FAR:
        return
    _set_levers(mesh, patches, pair, s1, s_closest, lean, off_path)
    scale = patches.lever[pair, 0] / mesh.driver.base_radius
    patches.present[pair] = True
    patches.driver_is_master[pair] = master_is_driver
    patches.least_gap[pair] = (gap + extra_gap) / scale
    _lay_nodes(mesh, patches, pair, s, arc, extra_gap, half_width, grid)


@compiled
def _set_levers(mesh, patches, pair, s1, s_closest, lean, off_path):
    """Arms of normal and friction force about the two centres."""
    rb1, rb2 = mesh.driver.base_radius, mesh.driven.base_radius
    s2 = mesh.line - s1
    driver_is_master = s1 >= mesh.pitch
    lever = patches.lever[pair]
    if not off_path:
        lever[0], lever[1], lever[2], lever[3] = rb1, rb2, s1, s2
    else:
        # the force is normal to the slave's flank at the master's tip corner
        if driver_is_master:
            rb_master, rb_slave, s_nominal = rb1, rb2, s1
        else:
            rb_master, rb_slave, s_nominal = rb2, rb1, s2
        turn = (s_closest - s_nominal) / rb_master - lean
        normal = rb_master * math.cos(turn) + s_closest * math.sin(turn)
        friction = s_closest * math.cos(turn) - rb_master * math.sin(turn)
        beyond = mesh.line * math.cos(lean) + (rb1 + rb2) * math.sin(lean)
        if driver_is_master:
            lever[0], lever[1], lever[2], lever[3] = (
                normal,
                rb_slave,
                friction,
                beyond - friction,
            )
        else:
            lever[0], lever[1], lever[2], lever[3] = (
                rb_slave,
                normal,
                beyond - friction,
                friction,
            )
    patches.approach[pair] = np.sign(mesh.pitch - s1)
    if abs(mesh.pitch - s1) < 1e-12 * mesh.line:
        patches.approach[pair] = 0.0


@compiled
def _lay_nodes(mesh, patches, pair, s, arc, extra_gap, half_width, grid):
    """Gaps at the nodes and table stencils at the support points."""
    driver_is_master = patches.driver_is_master[pair]
    if driver_is_master:
        master, slave = mesh.driver, mesh.driven
    else:
        master, slave = mesh.driven, mesh.driver
    nodes = grid.lagrange.shape[0]
    near = max(0.0, arc - half_width)
    far = arc + half_width
    step = (far - near) / (nodes - 1)
    patches.step[pair] = step
    for i in range(nodes):
        roll = roll_of_arc(master, far - i * step)
        gap, _, _ = separation(master, slave, mesh.line, s, roll)
        patches.gap[pair, i] = gap + extra_gap
    on_master = 0 if driver_is_master else 1
    for a in range(SUPPORT):
        place = 0.5 * (far + near) - 0.5 * (far - near) * grid.points[a]
        roll = roll_of_arc(master, place)
        _, s_slave, _ = separation(master, slave, mesh.line, s, roll)
        patches.first[pair, on_master, a] = stencil(
            place,
            master.length,
            master.grading,
            master.normal.shape[1],
            patches.weights[pair, on_master, a],
        )
        patches.first[pair, 1 - on_master, a] = stencil(
            arc_of_roll(slave, s_slave),
            slave.length,
            slave.grading,
            slave.normal.shape[1],
            patches.weights[pair, 1 - on_master, a],
        )


@compiled
def remainder_block(mesh, patches, seen, loaded, teeth_apart, tangential, block):
    """Smooth compliance (SUPPORT, SUPPORT) of both gears, filled into `block`.

    seen, loaded : patches where displacement is seen and where load acts
    teeth_apart : tooth of `seen` ahead of the tooth of `loaded`
    tangential : under rootward friction loads, by Maxwell's theorem
    """
    reach = mesh.driver.normal.shape[0] // 2
    block[:] = 0.0
    if abs(teeth_apart) > reach:
        return
    for gear in range(2):
        # ahead is to the right on the driver and to the left on the driven gear
        apart = teeth_apart if gear == 0 else -teeth_apart
        flank = mesh.driver if gear == 0 else mesh.driven
        for a in range(SUPPORT):
            row = patches.first[seen, gear, a]
            row_weights = patches.weights[seen, gear, a]
            for b in range(SUPPORT):
                column = patches.first[loaded, gear, b]
                column_weights = patches.weights[loaded, gear, b]
                if tangential:
                    block[a, b] += interpolate(
                        flank.tangential[reach - apart],
                        column,
                        column_weights,
                        row,
                        row_weights,
                    )
                else:
                    block[a, b] += interpolate(
                        flank.normal[reach + apart],
                        row,
                        row_weights,
                        column,
                        column_weights,
                    )


@compiled
def local_normal(mesh, grid, step, i, j):
    """Half-plane part of both gears at node i under a unit load at node j."""
    softness = 1.0 / mesh.driver.modulus + 1.0 / mesh.driven.modulus
    return -2.0 / math.pi * softness * (grid.logarithm[i, j] + math.log(step))


@compiled
def local_tangential(mesh, grid, driver_is_master, i, j):
    """The same under a unit rootward friction load; it cancels for equal gears."""
    driver = 0.5 * (1.0 - mesh.driver.poisson) / mesh.driver.modulus
    driven = 0.5 * (1.0 - mesh.driven.poisson) / mesh.driven.modulus
    toward_tip = driven - driver if driver_is_master else driver - driven
    return toward_tip * grid.sign[i, j]


@compiled
def add_block(C, row, column, grid, block, factor):
    """C[row:, column:] += factor * lagrange block lagrange^T."""
    nodes = grid.lagrange.shape[0]
    half = np.empty(SUPPORT)
    for i in range(nodes):
        for b in range(SUPPORT):
            total = 0.0
            for a in range(SUPPORT):
                total += grid.lagrange[i, a] * block[a, b]
            half[b] = factor * total
        for j in range(nodes):
            total = 0.0
            for b in range(SUPPORT):
                total += half[b] * grid.lagrange[j, b]
            C[row + i, column + j] += total


@compiled
def compliance_matrix(mesh, patches, chosen, teeth, grid):
    """Compliance [m/(N/m)] over the nodes of the chosen pairs, friction included."""
    nodes = grid.lagrange.shape[0]
    C = np.zeros((chosen.size * nodes, chosen.size * nodes))
    block = np.empty((SUPPORT, SUPPORT))
    for p in range(chosen.size):
        step = patches.step[chosen[p]]
        driver_is_master = patches.driver_is_master[chosen[p]]
        for q in range(chosen.size):
            seen, loaded = chosen[p], chosen[q]
            apart = teeth[seen] - teeth[loaded]
            remainder_block(mesh, patches, seen, loaded, apart, False, block)
            add_block(C, p * nodes, q * nodes, grid, block, 1.0)
            drag = mesh.friction * patches.approach[loaded]
            if drag != 0.0:
                remainder_block(mesh, patches, seen, loaded, apart, True, block)
                add_block(C, p * nodes, q * nodes, grid, block, drag)
        drag = mesh.friction * patches.approach[chosen[p]]
        for i in range(nodes):
            for j in range(nodes):
                local = local_normal(mesh, grid, step, i, j)
                if drag != 0.0:
                    local += drag * local_tangential(
                        mesh, grid, driver_is_master, i, j
                    )
                C[p * nodes + i, p * nodes + j] += local
    return C


@compiled
def friction_bending(mesh, patches, pair, q, grid):
    """Stiffening of a pair by rootward friction: -(q' Cnt q) / (q' Cnn q)."""
    nodes = q.size
    moments = np.zeros(SUPPORT)
    normal, tangential = 0.0, 0.0
    step = patches.step[pair]
    for i in range(nodes):
        if q[i] == 0.0:
            continue
        for a in range(SUPPORT):
            moments[a] += grid.lagrange[i, a] * q[i]
        for j in range(nodes):
            load = q[i] * q[j]
            normal += load * local_normal(mesh, grid, step, i, j)
            tangential += load * local_tangential(
                mesh, grid, patches.driver_is_master[pair], i, j
            )
    block = np.empty((SUPPORT, SUPPORT))
    remainder_block(mesh, patches, pair, pair, 0, False, block)
    normal += moments @ (block @ moments)
    remainder_block(mesh, patches, pair, pair, 0, True, block)
    tangential += moments @ (block @ moments)
    return -tangential / normal
