"""Forces of all meshes of a train at rest, with the contacts that are lost.

Models 1 to 3 have a convex potential energy, of springs that act on one side of a gap
or the other. Newton's method with a line search finds its least value; a planet without
contact has a rotation without stiffness, in which the smallest step is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.common.checks import require_present
from lumped.train.system import LumpedSystem

Array = NDArray[np.float64]
POINTS = 64  # positions in a period of the first mesh
MAX_STEPS = 100  # of Newton's method
MAX_HALVINGS = 80  # of a step
# Stiffness over the largest that is added where there may be none
ADDED_STIFFNESS = 1e-11
SLOPE_RTOL = 1e-3  # slope at the end of a step, over that at its start
BALANCE_RTOL = 1e-11  # error of an equilibrium, relative to the loads
ROUND_OFF = 1e-14  # of stiffness times displacement


@dataclass(frozen=True, eq=False)
class _Springs:
    """Springs of a train at t positions, in n modal coordinates.

    stiffness : (n, n) without the meshes [1/s2]
    load : (n,)
    rows : (p, n) deflection of each tooth pair
    pair_stiffness, gap : (t, p) [N/m], [m]
    backlash : (p,) [m]
    """

    stiffness: Array
    load: Array
    rows: Array
    pair_stiffness: Array
    gap: Array
    backlash: Array

    def pair_forces(self, q: Array) -> tuple[Array, Array]:
        """Forces [N] and tangent stiffnesses [N/m] (t, p) at coordinates (t, n)."""
        elastic = q @ self.rows.T - self.gap
        drive, back = np.maximum(elastic, 0.0), np.minimum(elastic + self.backlash, 0.0)
        touches = (drive > 0.0) | (back < 0.0)
        return self.pair_stiffness * (drive + back), self.pair_stiffness * touches

    def imbalance(self, q: Array) -> tuple[Array, Array]:
        """Loads that are not balanced (t, n), and their derivatives (t, n, n)."""
        force, slope = self.pair_forces(q)
        residual = q @ self.stiffness + force @ self.rows - self.load
        tangent = np.einsum("tp,pi,pj->tij", slope, self.rows, self.rows)
        return residual, tangent + self.stiffness


def mesh_forces_at_rest(system: LumpedSystem) -> Array:
    """Force of every mesh with the gears at rest.

    Parameters
    ----------
    system : LumpedSystem
        Train of any model; friction is left out.

    Returns
    -------
    (t, m) array
        Forces [N], positive where the drive flanks are pressed together, at even
        positions over the time after which all meshes repeat; of the coupled model
        over a mesh cycle, of teeth without pitch errors.

    Raises
    ------
    ArithmeticError
        If no equilibrium is found.
    """
    if system.contacts is not None:
        loaded = require_present(system.loaded, "loaded state")
        signed = loaded.load[:-1] * system.contacts.contacts.side
        meshes = np.arange(len(system.excitations))
        return np.asarray(signed @ (system.contacts.mesh_of[:, None] == meshes))
    springs = _springs(system)
    start = system.arrays.load / system.arrays.rigidity
    force, _ = springs.pair_forces(_equilibrium(springs, start))
    return np.add.reduceat(force, system.arrays.first_pair[:-1], axis=1)


def _springs(system: LumpedSystem) -> _Springs:
    arrays, excitation = system.arrays, system.excitation
    count = POINTS * system.common_period[0]
    times = (np.arange(count) + 0.5) / POINTS  # between the corners of even numbers
    stiffness, gap = excitation.evaluate(times)
    shapes, mesh_of = arrays.shapes, excitation.mesh_of
    meshes = np.einsum("m,mi,mj->ij", arrays.mean_stiffness, shapes, shapes)
    return _Springs(
        stiffness=np.diag(arrays.rigidity) - meshes,
        load=arrays.load,
        rows=shapes[mesh_of],
        pair_stiffness=stiffness,
        gap=gap,
        backlash=arrays.backlash[mesh_of],
    )


def _equilibrium(springs: _Springs, start: Array) -> Array:
    """Coordinates (t, n) of least potential energy."""
    q = np.tile(start, (len(springs.gap), 1))
    added = ADDED_STIFFNESS * np.eye(start.size)
    for _ in range(MAX_STEPS):
        residual, tangent = springs.imbalance(q)
        largest = np.abs(tangent).max(axis=(1, 2))[:, None, None]
        tolerance = BALANCE_RTOL * np.abs(springs.load).max()
        tolerance += ROUND_OFF * largest.max() * np.abs(q).max()
        if np.abs(residual).max() <= tolerance:
            return q
        step = -np.linalg.solve(tangent + largest * added, residual[..., None])[..., 0]
        q = q + step * _step_lengths(springs, q, step, residual)[:, None]
    raise ArithmeticError("no static equilibrium of the train was found")


def _step_lengths(springs: _Springs, q: Array, step: Array, residual: Array) -> Array:
    """Part (t,) of a step within which the energy falls; the energy is convex."""
    slope = np.abs(np.einsum("ti,ti->t", residual, step))
    length = np.ones(len(q))
    for _ in range(MAX_HALVINGS):
        ahead, _ = springs.imbalance(q + length[:, None] * step)
        rises = np.einsum("ti,ti->t", ahead, step) > SLOPE_RTOL * slope
        if not rises.any():
            break
        length[rises] *= 0.5
    return length
