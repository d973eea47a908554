"""Closed forms for trains of gears that are a rim on elastic spokes, by dense matrices.

Every gear has a hub, at the radius of its shaft, and a rim with the teeth, joined by a
torsional spring. Contacts are linear springs between rims; all of them touch. Couplings
hold hubs to ground, torques act on hubs. A hub or a rim may have no inertia.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from lumped.common.array_types import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class RimTrain:
    """n gears, c contacts.

    hub, rim : (n,) inertias [kg m2]; spokes : (n,) torsional stiffness [N m/rad]
    ground : (n,) couplings of the hubs [N m/rad]; torque : (n,) on the hubs [N m]
    rows : (c, n) penetration of the contacts per turn of the rims [m]
    stiffness : (c,) [N/m]
    """

    hub: Array
    rim: Array
    spokes: Array
    ground: Array
    torque: Array
    rows: Array
    stiffness: Array

    @property
    def matrix(self) -> Array:
        """Stiffness (2 n, 2 n) of the turns of all hubs, then of all rims."""
        spokes, n = np.diag(self.spokes), self.hub.size
        matrix = np.block([[spokes, -spokes], [-spokes, spokes]])
        matrix[:n, :n] += np.diag(self.ground)
        matrix[n:, n:] += (self.rows.T * self.stiffness) @ self.rows
        return matrix

    @property
    def mass(self) -> Array:
        """(2 n,) [kg m2]"""
        return np.concatenate([self.hub, self.rim])

    @property
    def angular(self) -> Array:
        """Natural angular frequencies of as many modes as there is inertia, rising."""
        # inertia over stiffness: the couplings hold all, some parts weigh nothing
        inverse = eigh(np.diag(self.mass), self.matrix, eigvals_only=True)
        moving = inverse > 1e-12 * inverse.max()
        return np.sort(1.0 / np.sqrt(inverse[moving]))

    def static_turns(self, gap: Array) -> Array:
        """Turns (2 n,) under the torques and the contacts' gaps (c,) [rad]."""
        n, load = self.hub.size, np.zeros(2 * self.hub.size)
        load[:n] = self.torque
        load[n:] = self.rows.T @ (self.stiffness * gap)
        return np.asarray(np.linalg.solve(self.matrix, load))

    def harmonic_turns(self, angular: float, gap: Array, damping: Array) -> Array:
        """Complex turns (2 n,) under gaps Re(gap exp(i angular t)), gap (c,) [m].

        damping : (2 n, 2 n) [N m s/rad]
        """
        n, load = self.hub.size, np.zeros(2 * self.hub.size, complex)
        load[n:] = self.rows.T @ (self.stiffness * gap)
        dynamic = self.matrix - angular**2 * np.diag(self.mass)
        return np.linalg.solve(dynamic + 1j * angular * damping, load)
