"""The contact problem of every position of a mesh cycle, compiled."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fegear.contact.active_set import NOT_FINITE, solve_contact
from fegear.contact.compiled import compiled
from fegear.contact.flanks import FAR
from fegear.contact.kernel import (
    GROWTH,
    MARGIN,
    MAX_ROUNDS,
    compliance_matrix,
    friction_bending,
    hertz_half_width,
    make_grid,
    make_patches,
    place_patch,
)


class CycleArrays(NamedTuple):
    """Results by (torque, position[, pair]); per unit face width.

    approach : driver's rotation times its base radius, driven gear held [m]
    no_load : the same without load [m]
    slope : d(force)/d(approach) along the line of action [Pa]
    load : normal line load of each pair [N/m]
    gap : approach that closes each pair [m]
    pressure : largest nodal pressure of each pair [Pa]
    bending : friction-bending ratio of each pair
    lever : (..., pair, 4) as in Patches
    residual, status, sweeps : of the complementarity problem
    """

    approach: np.ndarray
    no_load: np.ndarray
    slope: np.ndarray
    load: np.ndarray
    gap: np.ndarray
    pressure: np.ndarray
    bending: np.ndarray
    lever: np.ndarray
    residual: np.ndarray
    status: np.ndarray
    sweeps: np.ndarray


@compiled
def empty_arrays(torques, positions, pairs):
    rows = (torques, positions)
    cells = (torques, positions, pairs)
    return CycleArrays(
        np.full(rows, math.nan),
        np.full(rows, math.nan),
        np.full(rows, math.nan),
        np.zeros(cells),
        np.full(cells, FAR),
        np.zeros(cells),
        np.full(cells, math.nan),
        np.zeros((torques, positions, pairs, 4)),
        np.full(rows, math.nan),
        np.full(rows, -1),
        np.zeros(rows, np.int64),
    )


@compiled
def solve_cycle(mesh, teeth, pair_gaps, positions, torques, nodes):
    """Solve each (torque, position); the last contact state starts the next one.

    teeth : (pairs,) pair k touches k base pitches ahead of the reference pair
    pair_gaps : (pairs,) extra gap of each pair, from pitch errors [m]
    positions : base pitches from the pitch point
    torques : on the driver per unit face width [N]
    nodes : of each contact patch
    """
    out = empty_arrays(torques.size, positions.size, teeth.size)
    grid = make_grid(nodes)
    patches = make_patches(teeth.size, nodes)
    for t in range(torques.size):
        memory = np.zeros((teeth.size, nodes), np.bool_)
        for n in range(positions.size):
            _solve_position(
                mesh, teeth, pair_gaps, positions[n], torques[t], grid, patches,
                memory, out, t, n,
            )  # fmt: skip
    return out


@compiled
def _solve_position(
    mesh, teeth, pair_gaps, position, torque, grid, patches, memory, out, t, n
):
    pairs, nodes = memory.shape
    load = torque / mesh.driver.base_radius
    s1 = mesh.pitch + (position + teeth) * mesh.base_pitch
    width = np.empty(pairs)
    for k in range(pairs):
        width[k] = MARGIN * hertz_half_width(mesh, s1[k], load)
        place_patch(mesh, patches, k, s1[k], pair_gaps[k], width[k], grid)
    out.gap[t, n] = patches.least_gap
    out.lever[t, n] = patches.lever
    out.no_load[t, n] = patches.least_gap.min()
    if out.no_load[t, n] >= FAR:
        out.status[t, n] = NOT_FINITE
        return
    limit = out.no_load[t, n] + 40.0 * load * (
        1.0 / mesh.driver.modulus + 1.0 / mesh.driven.modulus
    )
    for _ in range(MAX_ROUNDS):
        chosen = np.flatnonzero(patches.present & (patches.least_gap < limit))
        q, d = _solve_chosen(
            mesh, teeth, chosen, torque, grid, patches, memory, out, t, n
        )
        if out.status[t, n] != 0:
            return
        again = False
        for p in range(chosen.size):
            k = chosen[p]
            if q[p * nodes] > 0.0 or _cut_short(patches, q, p, nodes, k, width, mesh):
                width[k] *= GROWTH
                place_patch(mesh, patches, k, s1[k], pair_gaps[k], width[k], grid)
                memory[k] = False
                again = True
        for k in range(pairs):
            if patches.present[k] and limit <= patches.least_gap[k] < d:
                again = True
        limit = max(limit, d)
        if not again:
            break
    _store(mesh, chosen, q, grid, patches, out, t, n)


@compiled
def _cut_short(patches, q, p, nodes, k, width, mesh):
    """Whether pressure reaches the patch's end although the flank goes on."""
    loaded_end = q[p * nodes + nodes - 1] > 0.0
    full = patches.step[k] * (nodes - 1) > 2.0 * width[k] * (1.0 - 1e-9)
    return loaded_end and full


@compiled
def _solve_chosen(mesh, teeth, chosen, torque, grid, patches, memory, out, t, n):
    """Pressures of the chosen pairs' nodes as nodal forces, and the approach."""
    nodes = grid.lagrange.shape[0]
    C = compliance_matrix(mesh, patches, chosen, teeth, grid)
    size = chosen.size * nodes
    gap, h, arms = np.empty(size), np.empty(size), np.empty(size)
    active = np.zeros(size, np.bool_)
    for p in range(chosen.size):
        k = chosen[p]
        lever = patches.lever[k]
        part = slice(p * nodes, (p + 1) * nodes)
        gap[part] = patches.gap[k]
        h[part] = lever[0] / mesh.driver.base_radius
        arms[part] = lever[0] - mesh.friction * patches.approach[k] * lever[2]
        active[part] = memory[k]
    q, d, slope, residual, status, sweeps = solve_contact(
        C, gap, h, arms, torque, active
    )
    for p in range(chosen.size):
        memory[chosen[p]] = active[p * nodes : (p + 1) * nodes]
    out.approach[t, n] = d
    out.slope[t, n] = slope / mesh.driver.base_radius
    out.residual[t, n] = residual
    out.status[t, n] = status
    out.sweeps[t, n] += sweeps
    return q, d


@compiled
def _store(mesh, chosen, q, grid, patches, out, t, n):
    nodes = grid.lagrange.shape[0]
    for p in range(chosen.size):
        k = chosen[p]
        own = q[p * nodes : (p + 1) * nodes]
        out.load[t, n, k] = own.sum()
        if out.load[t, n, k] > 0.0:
            peak = max(own[:-1].max(), 2.0 * own[-1])
            out.pressure[t, n, k] = peak / patches.step[k]
            out.bending[t, n, k] = friction_bending(mesh, patches, k, own, grid)
