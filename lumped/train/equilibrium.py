"""Forces of all meshes of a train at rest, with the contacts that are lost.

Models 1 to 3 have a convex potential energy, of springs that act on one side of a gap
or the other. Newton's method with a line search finds its least value, in coordinates
of unit stiffness. A free motion, such as the rotation of a planet without contact, has
no stiffness: it is left out where nothing loads it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.train.system import LumpedSystem

POINTS = 64  # positions in a period of the first mesh
MAX_STEPS = 100  # of Newton's method
MAX_HALVINGS = 80  # of a step
# Of unit stiffness: what is less is a free motion's, and what that gets if it is loaded
FREE_RTOL, ADDED_STIFFNESS = 1e-12, 1e-11
FREE_LOAD_RTOL = 1e-9  # round-off of the load on a free motion, relative to all loads
SLOPE_RTOL = 1e-3  # slope at the end of a step, over that at its start
ENERGY_RTOL = 1e-18  # energy that a step would still release, over that of the loads


@dataclass(frozen=True, eq=False)
class _Springs:
    """Springs of a train at t positions, in n coordinates of unit stiffness.

    stiffness : (n, n) without the meshes
    load : (n,) [sqrt(N m)]
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
    force, _ = springs.pair_forces(_equilibrium(springs))
    return np.add.reduceat(force, system.arrays.first_pair[:-1], axis=1)


def _springs(system: LumpedSystem) -> _Springs:
    """The train's springs; taken from it and not from its modes, which round them."""
    arrays, excitation = system.arrays, system.excitation
    count = POINTS * system.common_period[0]
    times = (np.arange(count) + 0.5) / POINTS  # between the corners of even numbers
    stiffness, gap = excitation.evaluate(times)
    train, mesh_of = system.modes.coordinates, excitation.mesh_of
    diagonal = train.spring_stiffness @ train.spring_rows**2
    diagonal += arrays.mean_stiffness @ train.mesh_rows**2
    unit = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    elongations = train.spring_rows * unit
    return _Springs(
        stiffness=np.einsum(
            "s,si,sj->ij", train.spring_stiffness, elongations, elongations
        ),
        load=train.load * unit,
        rows=train.mesh_rows[mesh_of] * unit,
        pair_stiffness=stiffness,
        gap=gap,
        backlash=arrays.backlash[mesh_of],
    )


def _equilibrium(springs: _Springs) -> Array:
    """Coordinates (t, n) of least potential energy."""
    q = np.zeros((len(springs.gap), springs.load.size))
    energy = float(springs.load @ springs.load)  # of the loads on unit springs
    for _ in range(MAX_STEPS):
        residual, tangent = springs.imbalance(q)
        step = _newton_step(residual, tangent, np.sqrt(energy))
        released = -np.einsum("ti,ti->t", residual, step)
        length = _step_lengths(springs, q, step, residual)
        ahead = q + step * length[:, None]
        # the energy is quadratic while contacts stay, so that a whole step is the last
        is_last = (length == 1.0) & (
            springs.pair_forces(q)[1] == springs.pair_forces(ahead)[1]
        ).all(axis=1)
        q = ahead
        if (is_last | (released <= ENERGY_RTOL * energy)).all():
            return q
    raise ArithmeticError("no static equilibrium of the train was found")


def _newton_step(residual: Array, tangent: Array, load: float) -> Array:
    """Step (t, n) to the equilibrium of the springs in contact.

    Along a free motion there is a step only where it is loaded, by more than the
    round-off of loads of the magnitude `load`; it is long, to where teeth touch.
    """
    stiffness, motions = np.linalg.eigh(tangent)
    forces = np.einsum("tij,ti->tj", motions, residual)
    is_free = stiffness <= FREE_RTOL
    forces[is_free & (np.abs(forces) <= FREE_LOAD_RTOL * load)] = 0.0
    held = np.where(is_free, ADDED_STIFFNESS, stiffness)
    return -np.einsum("tij,tj->ti", motions, forces / held)


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
