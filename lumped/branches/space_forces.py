"""Forces of a train in space along a motion known as a series.

A mesh has two coordinates, its deflection s and the difference t of the slopes of its
gears; they respond to its force F and to its moment M. Each spring over the width has a
deflection s + x t at its place x, which varies with the position of the teeth. Where a
spring opens or closes is located on a series of that deflection with more harmonics; a
force is continuous there, so that its error is of second order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lumped.branches.series import Series
from lumped.branches.springs import SpringForces
from lumped.common.array_types import Array, Complex
from lumped.common.checks import require_present
from lumped.kernels.arrays import ContactPieces, FourierOrbit, ModalSystem, Pieces
from lumped.steady.response import History
from lumped.train.space import MotionInSpace

MORE_HARMONICS = 3  # times as many, of the deflection of a spring
SAMPLES_PER_HARMONIC = 4


@dataclass(frozen=True, eq=False)
class SpaceForces(SpringForces):
    """Forces of gears that move in space, on 2 m coordinates of m meshes.

    Deflections come first, then differences of slopes.
    """

    @property
    def space(self) -> MotionInSpace:
        return require_present(self.system.space, "motion in space")

    @property
    def meshes(self) -> int:
        """Number m of meshes."""
        return len(self.system.excitations)

    @property
    def count(self) -> int:
        return 2 * self.meshes

    @cached_property
    def rows(self) -> Array:
        """Coordinates (d, n) of each mode."""
        shapes = self.system.modes.shapes[:, self.system.moving]
        return np.concatenate([self.arrays.shapes, self.space.tilt_rows @ shapes])

    @property
    def stiffness(self) -> Array:
        tilting = self.space.tilt_stiffness
        return np.diag(np.concatenate([self.arrays.mean_stiffness, tilting]))

    @property
    def static(self) -> Array:
        return np.asarray(self.rows @ (self.arrays.load / self.arrays.rigidity))

    def damping_at(self, frequency: float) -> Array:
        return np.diag(self.arrays.damping) + self.system.velocity_forces(frequency)

    @cached_property
    def _rigidity(self) -> Array:
        """Stiffness of the modes (n, n), with forces across displacements [1/s2]."""
        shapes = self.system.modes.shapes[:, self.system.moving]
        across = shapes.T @ self.space.cross_stiffness @ shapes
        return np.diag(self.arrays.rigidity) + across

    def _frequency(self, omega: Array) -> float:
        """Mesh frequency [Hz] of angular frequencies of all harmonics (h,)."""
        return float(omega[1]) * self.series.length / (2.0 * math.pi)

    def _inverses(self, omega: Array) -> Complex:
        """Displacements of modes by forces on them (h, n, n)."""
        damping = self.damping_at(self._frequency(omega))
        square = omega[:, None, None] ** 2 * np.eye(len(damping))
        rate = 1j * omega[:, None, None]
        return np.asarray(np.linalg.inv(self._rigidity - square + rate * damping))

    def receptance(self, omega: Array) -> tuple[Complex, Complex]:
        """G (h, d, d) at angular frequencies (h,) [rad/s], and its derivative.

        Gyroscopic moments grow with the speed, and so with each of them.
        """
        frequency = self._frequency(omega)
        inverses = self._inverses(omega)
        # per relative change of all frequencies
        gyroscopic = self.damping_at(frequency) - self.damping_at(0.0)
        at = omega[:, None, None]
        eye = np.eye(len(gyroscopic))
        damping = self.damping_at(frequency) + gyroscopic
        by_omega = 1j * damping - 2.0 * at * eye
        change = -inverses @ by_omega @ inverses
        return (
            np.asarray(self.rows @ inverses @ self.rows.T),
            np.asarray(self.rows @ change @ self.rows.T),
        )

    @cached_property
    def _places(self) -> Array:
        """Places of the springs (pieces, 5, p) on the points of the grid [m]."""
        times = self.sampled.times
        inside, at_end = (
            self.system.excitation.places_at(part, side)
            for part, side in ((times[:, :4], 1), (times[:, 4:], -1))
        )
        return np.concatenate([inside, at_end], axis=1)

    @property
    def _mesh_of(self) -> NDArray[np.intp]:
        return self.system.excitation.mesh_of

    def _deflections(self, values: Array, places: Array) -> Array:
        """Deflections (..., p) of springs where coordinates have values (..., d)."""
        s, t = values[..., self._mesh_of], values[..., self.meshes + self._mesh_of]
        return np.asarray(s + places * t)

    @cached_property
    def _springs(self) -> ModalSystem:
        """Every spring as a mesh of its own."""
        count = self._mesh_of.size
        return self.arrays._replace(
            backlash=self.arrays.backlash[self._mesh_of],
            first_pair=np.arange(count + 1),
        )

    @cached_property
    def _waves(self) -> Pieces:
        count = self._mesh_of.size
        return self.system.excitation.pieces_in(0)._replace(mesh_of=np.arange(count))

    @cached_property
    def _fine(self) -> tuple[Series, Array, Array]:
        """Series with more harmonics, samples of a period for it, and places there."""
        series = Series(MORE_HARMONICS * self.series.order, self.series.length)
        count = SAMPLES_PER_HARMONIC * series.rows
        times = np.arange(count) / count * series.length
        return series, times, self.system.excitation.places_at(times)

    def pieces(self, x: Array) -> ContactPieces:
        from lumped.kernels import orbit as kernel

        series, times, places = self._fine
        sampled = self._deflections(self.series.basis(times) @ x, places)
        orbit = FourierOrbit(
            np.ascontiguousarray(series.of_samples(sampled)),
            float(series.length),
            np.ascontiguousarray(
                self._deflections(self.sampled.values(x), self._places)
            ),
            self._waves,
        )
        room = self._room
        count = kernel.set_pieces(self._springs, orbit, self.grid, room)
        if not count:
            raise ArithmeticError("contacts change too often in a period")
        pieces = ContactPieces(*(part[:count].copy() for part in room))
        place = self._places_of(pieces)
        return pieces._replace(
            force=self._sums(pieces.force, pieces.force * place),
            slope=self._matrices(pieces.slope, place),
        )

    @cached_property
    def _room(self) -> ContactPieces:
        room = super()._room
        size = (*room.force.shape[:2], self._mesh_of.size)
        return room._replace(force=np.empty(size), slope=np.empty(size))

    def _places_of(self, pieces: ContactPieces) -> Array:
        """Places (n, 3, p) at the Gauss points of pieces."""
        from lumped.kernels.orbit import GAUSS_POINTS

        place = self._places[pieces.grid_piece, 1:4]
        cut = pieces.grid_piece < 0
        times = pieces.start[cut, None] + pieces.length[cut, None] * GAUSS_POINTS
        place[cut] = self.system.excitation.places_at(times)
        return np.asarray(place)

    def _sums(self, force: Array, moment: Array) -> Array:
        """Forces and moments (..., d) of the meshes by those of springs (..., p)."""
        first = self.arrays.first_pair[:-1]
        parts = (np.add.reduceat(part, first, axis=-1) for part in (force, moment))
        return np.concatenate([*parts], axis=-1)

    def _matrices(self, slope: Array, place: Array) -> Array:
        """Slopes (..., d, d) of forces and moments by those of springs (..., p)."""
        m = self.meshes
        matrices = np.zeros((*slope.shape[:-1], 2 * m, 2 * m))
        by_power = [
            np.add.reduceat(slope * place**power, self.arrays.first_pair[:-1], axis=-1)
            for power in range(3)
        ]
        at = np.arange(m)
        matrices[..., at, at] = by_power[0]
        matrices[..., at, m + at] = matrices[..., m + at, at] = by_power[1]
        matrices[..., m + at, m + at] = by_power[2]
        return matrices

    def modal(self, slope: Array) -> Array:
        excess = slope - self.stiffness
        return np.asarray(self._rigidity + self.rows.T @ excess @ self.rows)

    def modes(self, x: Complex, force: Complex, omega: Array) -> Complex:
        loads = -(force - x @ self.stiffness) @ self.rows
        loads[0] += self.arrays.load
        return np.asarray((self._inverses(omega) @ loads[..., None])[..., 0])

    def history(self, x: Array, frequency: float) -> History:
        values = self.sampled.values(x)
        rates = self.sampled.values(self.series.slope(x)) * frequency
        elastic = self._deflections(values, self._places) - self.grid.gap
        backlash = self.arrays.backlash[self._mesh_of]
        pressed = np.maximum(elastic, 0.0)
        back = -elastic - backlash
        force = self.grid.stiffness * (pressed - np.maximum(back, 0.0))
        sums = self._sums(force, force * self._places)
        first, m = self.arrays.first_pair[:-1], self.meshes

        def at_edges(part: Array) -> Array:
            return np.concatenate([part[:, 0], part[:1, 0]])

        force_of_meshes = sums[..., :m]
        before = np.concatenate([force_of_meshes[-1:, 4], force_of_meshes[:, 4]])
        return History(
            time=self.grid.edges / frequency,
            deflection=at_edges(values[..., :m]),
            rate=at_edges(rates[..., :m]),
            force=at_edges(force_of_meshes),
            drive_overlap=at_edges(np.maximum.reduceat(elastic, first, axis=-1)),
            back_overlap=at_edges(np.maximum.reduceat(back, first, axis=-1)),
            force_before=before,
            moments=at_edges(sums[..., m:]),
            tilts=at_edges(values[..., m:]),
        )

    def of_modes(self, q: Array) -> Array:
        return np.asarray(q @ self.rows.T)
