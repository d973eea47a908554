"""Forces of a train of springs, Model-1 to 3, along a motion known as a series.

Coordinates are the deflections of the m meshes. The modes follow from the forces that
the meshes carry beyond their mean stiffness k, harmonic by harmonic, so that

    s_h = static_h - G(omega_h) (F - k s)_h,
    G = sum_i phi_i phi_i' / (w_i^2 - omega^2 + i omega d_i).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from lumped.branches.series import SampledSeries, Series
from lumped.common.array_types import Array, Complex
from lumped.kernels.arrays import (
    ContactPieces,
    FourierOrbit,
    ModalSystem,
    Pieces,
    QuadratureGrid,
)
from lumped.steady.response import History
from lumped.train.system import LumpedSystem

CAPACITY_RATIO = 4  # times the pieces of the grid, for those that are cut


@dataclass(frozen=True, eq=False)
class SpringForces:
    """Forces of a lumped system, evaluated on Gauss points between changes of contact.

    series : what motions are made of
    finest : pieces of a period of the first mesh, at least
    steepness : [1/m] of contact that closes by tanh, eq. 3.5; None for true contact,
        which opens at once
    """

    system: LumpedSystem
    series: Series
    finest: float
    steepness: float | None = None

    @property
    def arrays(self) -> ModalSystem:
        return self.system.arrays

    @property
    def count(self) -> int:
        """Number of coordinates d."""
        return len(self.system.excitations)

    @property
    def stiffness(self) -> Array:
        """Mean stiffness (d, d) that the receptance holds."""
        return np.diag(self.arrays.mean_stiffness)

    @property
    def static(self) -> Array:
        """Coordinates (d,) under the loads alone."""
        return self.system.static_deflection

    def damping_at(self, frequency: float) -> Array:
        """Damping of the modes (n, n) [1/s], and gyroscopic forces.

        frequency : of the first mesh [Hz]
        """
        return np.diag(self.arrays.damping)

    def receptance(self, omega: Array) -> tuple[Complex, Complex]:
        """G (h, d, d) at angular frequencies (h,) [rad/s], and its derivative."""
        arrays, omega = self.arrays, omega[:, None]
        dynamic = arrays.rigidity - omega**2 + 1j * omega * arrays.damping
        change = (2.0 * omega - 1j * arrays.damping) / dynamic**2
        outer = arrays.shapes[:, None] * arrays.shapes[None]
        return (
            np.einsum("hi,mri->hmr", 1.0 / dynamic, outer),
            np.einsum("hi,mri->hmr", change, outer),
        )

    @cached_property
    def grid(self) -> QuadratureGrid:
        times = self.sampled.times
        inside = self.system.excitation.evaluate(times[:, :4])
        at_end = self.system.excitation.evaluate(times[:, 4:], side=-1)
        stiffness, gap = (
            np.concatenate(both, axis=1) for both in zip(inside, at_end, strict=True)
        )
        return QuadratureGrid(self.sampled.edges, stiffness, gap)

    @cached_property
    def sampled(self) -> SampledSeries:
        return SampledSeries(self.series, self._edges())

    def _edges(self) -> Array:
        """Corners, hand-overs and ends of paths of contact of a period, and even parts
        between them."""
        excitation = self.system.excitation
        mesh_period, length = self.system.train.common_period[0], self.series.length
        # a path that ends within a piece would make its quadrature depend on where
        # contact cuts it, which the Jacobian does not know
        stops = np.union1d(excitation.pieces.stops, excitation.breaks())
        corners = (
            mesh_period * np.arange(length // mesh_period)[:, None] + stops
        ).ravel()
        corners = np.concatenate([[0.0], corners, [float(length)]])
        corners = corners[np.append(np.diff(corners) > 1e-9, True)]
        parts = [
            np.linspace(a, b, math.ceil((b - a) * self.finest), endpoint=False)
            for a, b in pairwise(corners)
        ]
        return np.concatenate([*parts, [float(length)]])

    @cached_property
    def _waves(self) -> Pieces:
        return self.system.excitation.pieces_in(0)

    @cached_property
    def _room(self) -> ContactPieces:
        count, meshes = CAPACITY_RATIO * (self.sampled.edges.size - 1), self.count
        return ContactPieces(
            start=np.empty(count),
            length=np.empty(count),
            grid_piece=np.empty(count, np.int64),
            force=np.empty((count, 3, meshes)),
            slope=np.empty((count, 3, meshes)),
        )

    def pieces(self, x: Array) -> ContactPieces:
        """Contact along a motion (2 H + 1, d), slopes as matrices (n, 3, d, d).

        Raises ArithmeticError where contacts change too often to be followed.
        """
        if self.steepness is not None:
            return self._smooth_pieces(x, self.steepness)
        from lumped.kernels import orbit as kernel

        orbit = FourierOrbit(
            np.ascontiguousarray(x),
            float(self.series.length),
            self.sampled.values(x),
            self._waves,
        )
        count = kernel.set_pieces(self.arrays, orbit, self.grid, self._room)
        if not count:
            raise ArithmeticError("contacts change too often in a period")
        contact_pieces = ContactPieces(*(part[:count].copy() for part in self._room))
        return contact_pieces._replace(
            slope=contact_pieces.slope[..., None] * np.eye(self.count)
        )

    def _smooth_pieces(self, x: Array, steepness: float) -> ContactPieces:
        """Pieces of contact that closes by tanh: no change of contact divides them."""
        grid, first = self.grid, self.arrays.first_pair
        meshes = np.repeat(np.arange(self.count), np.diff(first))
        s = self.sampled.values(x)[:, 1:4, meshes]
        elastic = s - grid.gap[:, 1:4]
        drive, back = (
            _smooth_overlap(overlap, steepness)
            for overlap in (elastic, -elastic - self.arrays.backlash[meshes])
        )
        stiffness = grid.stiffness[:, 1:4]
        force = np.add.reduceat(stiffness * (drive[0] - back[0]), first[:-1], axis=2)
        slope = np.add.reduceat(stiffness * (drive[1] + back[1]), first[:-1], axis=2)
        return ContactPieces(
            start=grid.edges[:-1],
            length=np.diff(grid.edges),
            grid_piece=np.arange(len(s)),
            force=force,
            slope=slope[..., None] * np.eye(self.count),
        )

    def modal(self, slope: Array) -> Array:
        """Stiffness of the modes (..., n, n) where meshes have slopes (..., d, d)."""
        shapes = self.arrays.shapes
        excess = slope - self.stiffness
        stiffness: Array = np.diag(self.arrays.rigidity)
        return stiffness + shapes.T @ excess @ shapes

    def modes(self, x: Complex, force: Complex, omega: Array) -> Complex:
        """Modal displacements (h, n) of a motion with its forces, waves (h, d) each."""
        arrays = self.arrays
        omega = omega[:, None]
        dynamic = arrays.rigidity - omega**2 + 1j * omega * arrays.damping
        loads = -(force - x * arrays.mean_stiffness) @ arrays.shapes
        loads[0] += arrays.load
        return np.asarray(loads / dynamic)

    def history(self, x: Array, frequency: float) -> History:
        """A motion over its period on the grid's edges, as sweeps record theirs."""
        grid, arrays = self.grid, self.arrays
        s = self.sampled.values(x)
        rate = self.sampled.values(self.series.slope(x)) * frequency
        columns: dict[str, list[Array]] = {}
        for m in range(self.count):
            pairs = slice(arrays.first_pair[m], arrays.first_pair[m + 1])
            waves = grid.stiffness[..., pairs], grid.gap[..., pairs]
            for name, values in _contact(s[..., m], *waves, arrays.backlash[m]).items():
                columns.setdefault(name, []).append(values)
        joined = {name: np.stack(parts, axis=-1) for name, parts in columns.items()}

        def at_edges(values: Array) -> Array:
            return np.concatenate([values[:, 0], values[:1, 0]])

        before = np.concatenate([joined["force"][-1:, 4], joined["force"][:, 4]])
        return History(
            time=grid.edges / frequency,
            deflection=at_edges(s),
            rate=at_edges(rate),
            force=at_edges(joined["force"]),
            drive_overlap=at_edges(joined["drive"]),
            back_overlap=at_edges(joined["back"]),
            force_before=before,
        )

    def of_modes(self, q: Array) -> Array:
        """Coordinates (..., d) of modal ones (..., n)."""
        return q @ self.arrays.shapes.T


def _smooth_overlap(overlap: Array, steepness: float) -> tuple[Array, Array]:
    """Overlap of flanks that close by tanh, and its slope; none where it is -inf."""
    clipped = np.maximum(overlap, -1e3 / steepness)
    turn = np.tanh(steepness * clipped)
    part = 0.5 * (1.0 + turn)
    return part * clipped, part + 0.5 * steepness * clipped * (1.0 - turn**2)


def _contact(
    s: Array, stiffness: Array, gap: Array, backlash: float
) -> dict[str, Array]:
    """Force and overlaps of the nearest flanks of a mesh, of the shape of s."""
    elastic = s[..., None] - gap
    pressed = np.maximum(elastic, 0.0)
    back = -elastic - backlash
    force = stiffness * (pressed - np.maximum(back, 0.0))
    is_engaged = stiffness > 0.0
    return {
        "force": force.sum(axis=-1),
        "drive": np.where(is_engaged, elastic, -np.inf).max(axis=-1),
        "back": np.where(is_engaged, back, -np.inf).max(axis=-1),
    }
