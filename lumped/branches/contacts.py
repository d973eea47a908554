"""Forces of the coupled model along a motion known as a series.

Coordinates are the n mean rotations, in which

    q_h = static_h - G(omega_h) (B'F - k q)_h,   G = (K + k - omega^2 + i omega D)^-1,

with k the mean tangent stiffness of the contacts about the loaded state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lumped.branches.series import SampledSeries, Series
from lumped.coupled import LoadedState, coupled_steps, with_room
from lumped.kernels.arrays import ContactPieces, CoupledSteps, CoupledSystem
from lumped.response import History
from lumped.steppers import history_of
from lumped.system import LumpedSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class CoupledForces:
    """Of a lumped system with contacts, on Gauss points of equal pieces.

    Contacts stiffen from nothing: pieces are not cut where they change.
    """

    system: LumpedSystem
    series: Series
    finest: float

    @property
    def arrays(self) -> CoupledSystem:
        assert self.system.coupled_arrays is not None
        return self.system.coupled_arrays

    @property
    def _loaded(self) -> LoadedState:
        assert self.system.loaded is not None
        return self.system.loaded

    @property
    def count(self) -> int:
        """Number of coordinates d."""
        return self.arrays.load.size

    @cached_property
    def stiffness(self) -> Array:
        """Mean tangent stiffness (d, d) of the contacts under the loads [1/s2]."""
        return np.asarray(self._loaded.meshes.sum(axis=0))

    @cached_property
    def static(self) -> Array:
        """Coordinates (d,) under the loads alone."""
        whole = self.arrays.stiffness + self.stiffness
        return np.asarray(np.linalg.solve(whole, self.arrays.load))

    @property
    def damping(self) -> Array:
        """Of the coordinates (n, n) [1/s]."""
        return self.arrays.damping

    def receptance(self, omega: Array) -> tuple[Complex, Complex]:
        """G (h, d, d) at angular frequencies (h,) [rad/s], and its derivative."""
        omega, eye = omega[:, None, None], np.eye(self.count)
        dynamic = self.arrays.stiffness + self.stiffness - omega**2 * eye
        dynamic = dynamic + 1j * omega * self.damping
        found: Complex = np.linalg.inv(dynamic.astype(complex))
        slope: Complex = 2.0 * omega * eye - 1j * self.damping
        return found, np.asarray(found @ slope @ found)

    @cached_property
    def sampled(self) -> SampledSeries:
        """On equal pieces of the period."""
        length = float(self.series.length)
        pieces = math.ceil(length * self.finest)
        return SampledSeries(self.series, np.linspace(0.0, length, pieces + 1))

    @cached_property
    def _steps(self) -> CoupledSteps:
        """The contacts at the Gauss points."""
        steps = coupled_steps(self.arrays, self.sampled.points, self._periods)
        return with_room(steps, self.arrays, np.empty(0))

    @cached_property
    def _halves(self) -> CoupledSteps:
        """The contacts at the edges and between."""
        edges = self.sampled.edges
        times = np.linspace(0.0, edges[-1], 2 * edges.size - 1)[:-1]
        steps = coupled_steps(self.arrays, times, self._periods)
        return with_room(steps, self.arrays, np.empty(0))

    @property
    def _periods(self) -> Array:
        rates = np.array([float(rate) for rate in self.system.train.mesh_rates])
        return np.round(self.series.length * rates).astype(np.int64)

    def pieces(self, x: Array) -> ContactPieces:
        """Contact along a motion (2 H + 1, d).

        Raises ArithmeticError where contact is not solved.
        """
        from lumped.kernels import orbit as kernel

        q = self.sampled.values(x)[:, 1:4]
        shape = q.shape
        force, slope = np.empty(shape), np.empty((*shape, shape[-1]))
        flat = q.reshape(-1, shape[-1])
        kernel.set_contact_forces(
            *(self.arrays, self._steps, np.ascontiguousarray(flat)),
            *(force.reshape(flat.shape), slope.reshape(*flat.shape, shape[-1])),
        )
        if not np.isfinite(force).all():
            raise ArithmeticError("contact is not solved along the motion")
        count = shape[0]
        return ContactPieces(
            start=self.sampled.edges[:-1],
            length=np.diff(self.sampled.edges),
            whole=np.arange(count),
            force=force,
            slope=slope,
        )

    def modal(self, slope: Array) -> Array:
        """Stiffness of the coordinates (..., n, n) where contacts have slopes."""
        return self.arrays.stiffness + slope

    def modes(self, x: Complex, force: Complex, omega: Array) -> Complex:
        """Coordinates (h, n) of a motion."""
        return np.asarray(x, complex)

    def history(self, x: Array, frequency: float) -> History:
        """A motion over its period on the grid's edges, as sweeps record theirs."""
        from lumped.kernels import orbit as kernel

        times, steps = self.sampled.edges, self._halves
        basis = self.series.basis(times[:-1])
        q, v = basis @ x, basis @ self.series.slope(x) * frequency
        out = np.full((times.size, *self._row), np.nan)
        kernel.record_contacts(self.arrays, steps, q, v, out)
        out[-1] = out[0]
        return history_of(times / frequency, out, self.system)

    @property
    def _row(self) -> tuple[int, int]:
        most = int(np.bincount(self.arrays.mesh_of).max())
        return 6 + 2 * most, len(self.system.excitations)

    def of_modes(self, q: Array) -> Array:
        """Coordinates (..., d), the same."""
        return q
