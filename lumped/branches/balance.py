"""Harmonic balance: periodic motions of a lumped train as Fourier series.

With the mesh deflections s as unknowns, the modes follow from the forces F that their
meshes carry beyond the mean stiffness k, harmonic by harmonic,

    s_h = static_h - G(omega_h) (F - k s)_h,   G = sum_i phi_i phi_i' / (w_i^2 -
    omega^2 + i omega d_i),

and the forces from the deflections over time. Those are evaluated with the true contact
function on Gauss points between its changes, so that the equations and their Jacobian
are exact to the quadrature: only harmonics that are left out are missing.

T. M. Cameron and J. H. Griffin, J. Appl. Mech. 56 (1989) 149.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.kernels.arrays import (
    ContactPieces,
    ModalSystem,
    Orbit,
    Pieces,
    QuadratureGrid,
)
from lumped.measures import measures
from lumped.response import History
from lumped.system import LumpedSystem
from lumped.train import TrainError

Array = NDArray[np.float64]
FEWEST = 96  # pieces of a period of the fastest mesh
PER_HARMONIC = 6  # pieces for each harmonic
ROOM = 4  # times the pieces of the grid, for those that are cut
MOST_UNKNOWNS = 3000  # whose Jacobian takes a second to factorise


@dataclass(frozen=True, eq=False)
class PeriodicMotion:
    """A solution: series (2 H + 1, m) of deflections [m], and its contact pieces.

    frequency : of the first mesh [Hz]
    pieces : in the order of time
    """

    frequency: float
    series: Array
    pieces: ContactPieces


@dataclass(frozen=True, eq=False)
class HarmonicBalance:
    """The equations of a lumped system (Model-1, 2 or 3) for motions of one period.

    harmonics : of the mesh frequency of the first mesh that are kept
    multiple : common periods after which the motion repeats

    A vector x of unknowns holds the series (2 H + 1, m) of the mesh deflections row by
    row: the mean, cosines and sines of H = harmonics times the period's length.
    """

    system: LumpedSystem
    harmonics: int = 20
    multiple: int = 1

    def __post_init__(self) -> None:
        if self.system.contacts is not None:
            raise ValueError("model must be 1, 2 or 3; the coupled model is not known")
        for name in ("harmonics", "multiple"):
            if getattr(self, name) < 1:
                value = getattr(self, name)
                raise ValueError(f"{name} must be at least 1, got {value}")
        size, meshes = self.shape
        if size * meshes > MOST_UNKNOWNS:
            raise TrainError(
                f"{self.harmonics} harmonics of a motion of {self.length} periods of "
                f"the first mesh: {size * meshes} unknowns, more than {MOST_UNKNOWNS}; "
                "allowed are fewer harmonics, a shorter period or simpler tooth ratios"
            )

    @property
    def length(self) -> int:
        """Period of the motion in periods of the first mesh."""
        return self.system.common_period[0] * self.multiple

    @property
    def order(self) -> int:
        """Harmonics H of the motion's own period."""
        return self.harmonics * self.length

    @property
    def shape(self) -> tuple[int, int]:
        """Of a series."""
        return 2 * self.order + 1, len(self.system.excitations)

    @cached_property
    def arrays(self) -> ModalSystem:
        return self.system.arrays

    @cached_property
    def static(self) -> Array:
        """Series (2 H + 1, m) under the loads alone, on the mean stiffness."""
        series = np.zeros(self.shape)
        series[0] = self.system.static_deflection
        return series

    @cached_property
    def grid(self) -> QuadratureGrid:
        from lumped.kernels.orbit import CHECKS

        edges = self._edges()
        times = edges[:-1, None] + np.diff(edges)[:, None] * CHECKS
        inside = self.system.excitation_at(times[:, :4])
        at_end = self.system.excitation_at(times[:, 4:], side=-1)
        stiffness, gap = (
            np.concatenate(both, axis=1) for both in zip(inside, at_end, strict=True)
        )
        return QuadratureGrid(edges, stiffness, gap)

    def _edges(self) -> Array:
        """Corners and hand-overs of a period, and even parts between them."""
        system, rate = self.system, float(max(self.system.train.mesh_rates))
        own, length = system.train.common_period[0], self.length
        stops = system.pieces.stops
        marks = (own * np.arange(length // own)[:, None] + stops).ravel()
        marks = np.concatenate([[0.0], marks, [float(length)]])
        marks = marks[np.append(np.diff(marks) > 1e-9, True)]
        finest = max(FEWEST * rate, PER_HARMONIC * self.harmonics)
        parts = [
            np.linspace(a, b, math.ceil((b - a) * finest), endpoint=False)
            for a, b in pairwise(marks)
        ]
        return np.concatenate([*parts, [float(length)]])

    @cached_property
    def _waves(self) -> Pieces:
        return self.system.pieces_in(0)

    @cached_property
    def _bases(self) -> tuple[Array, Array]:
        """Waves at the checks (5 e, 2 H + 1), and at Gauss points up to 2 H."""
        from lumped.kernels.orbit import CHECKS

        edges = self.grid.edges
        times = edges[:-1, None] + np.diff(edges)[:, None] * CHECKS
        checks = fourier_basis(times.ravel() / self.length, self.order)
        return checks, fourier_basis(
            times[:, 1:4].ravel() / self.length, 2 * self.order
        )

    @cached_property
    def _room(self) -> ContactPieces:
        count, meshes = ROOM * (self.grid.edges.size - 1), self.shape[1]
        return ContactPieces(
            start=np.empty(count),
            length=np.empty(count),
            whole=np.empty(count, np.int64),
            force=np.empty((count, 3, meshes)),
            slope=np.empty((count, 3, meshes)),
        )

    def deflections(self, series: Array) -> Array:
        """Mesh deflections (e, 5, m) at the checks of the grid [m]."""
        return (self._bases[0] @ series).reshape(-1, 5, self.shape[1])

    def pieces(self, series: Array) -> ContactPieces:
        """Contact along a motion; valid until the next call.

        Raises ArithmeticError where contacts change too often to be followed.
        """
        from lumped.kernels import orbit as kernel

        motion = Orbit(
            np.ascontiguousarray(series),
            float(self.length),
            self.deflections(series),
            self._waves,
        )
        count = kernel.set_pieces(self.arrays, motion, self.grid, self._room)
        if not count:
            raise ArithmeticError("contacts change too often in a period")
        return ContactPieces(*(part[:count] for part in self._room))

    def equations(self, x: Array, frequency: float) -> tuple[Array, Array, Array]:
        """Errors of the equations (u,) [m], their Jacobian (u, u), and what a change of
        frequency makes of them (u,) [m/Hz]."""
        series = x.reshape(self.shape)
        force, slope = self._harmonics(self.pieces(series))
        k = self.arrays.mean_stiffness
        excess = force - k * series
        receptance, change = self._receptance(frequency)
        errors = series - self.static + self._responds(receptance, excess)
        by_frequency = self._responds(change, excess)
        meshes, size = self.shape[1], self.shape[0]
        jacobian = np.eye(size * meshes).reshape(size, meshes, size, meshes)
        for m in range(meshes):
            tangent = self._tangent(slope[:, m])
            tangent[np.diag_indices(size)] -= k[m]
            for r in range(meshes):
                jacobian[:, r, :, m] += self._filtered(receptance[:, r, m], tangent)
        return errors.ravel(), jacobian.reshape(x.size, x.size), by_frequency.ravel()

    def _harmonics(self, pieces: ContactPieces) -> tuple[Array, Array]:
        """Series of the forces (2 H + 1, m), and of tangent stiffnesses up to 2 H."""
        from lumped.kernels.orbit import POINTS, WEIGHTS

        weight = pieces.length[:, None] * WEIGHTS / self.length
        kept = pieces.whole >= 0
        basis, meshes = self._bases[1], self.shape[1]
        times = pieces.start[~kept, None] + pieces.length[~kept, None] * POINTS
        extra = fourier_basis(times.ravel() / self.length, 2 * self.order)
        columns = []
        for values in (pieces.force, pieces.slope):
            weighed = weight[..., None] * values
            whole = np.zeros((self.grid.edges.size - 1, 3, meshes))
            whole[pieces.whole[kept]] = weighed[kept]
            column = basis.T @ whole.reshape(-1, meshes)
            column += extra.T @ weighed[~kept].reshape(-1, meshes)
            columns.append(column)
        force, slope = columns
        twice = 2 * self.order
        own = [0, *range(1, self.order + 1), *range(twice + 1, twice + self.order + 1)]
        force = force[own]
        force[1:] *= 2.0
        return force, slope

    @cached_property
    def _sums(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        h = np.arange(self.order + 1)
        return h[:, None] + h, h[:, None] - h

    def _tangent(self, slope: Array) -> Array:
        """Series of the force by series of the deflection (2 H + 1, 2 H + 1).

        slope : of the tangent stiffness, mean of its products with waves up to 2 H
        """
        H, (plus, minus) = self.order, self._sums
        cosine = slope[: 2 * H + 1]
        sine = np.concatenate([[0.0], slope[2 * H + 1 :]])
        odd = np.sign(minus) * sine[np.abs(minus)]
        matrix = np.empty((2 * H + 1, 2 * H + 1))
        matrix[: H + 1, : H + 1] = cosine[plus] + cosine[np.abs(minus)]
        matrix[: H + 1, H + 1 :] = (sine[plus] - odd)[:, 1:]
        matrix[H + 1 :, : H + 1] = (sine[plus] + odd)[1:]
        matrix[H + 1 :, H + 1 :] = (cosine[np.abs(minus)] - cosine[plus])[1:, 1:]
        matrix[0] *= 0.5  # the mean
        return matrix

    def _receptance(self, frequency: float) -> tuple[NDArray[np.complex128], ...]:
        """G (H + 1, m, m) [m/N] at the harmonics, and by the frequency [m/N/Hz]."""
        arrays = self.arrays
        turn = 2.0 * math.pi * np.arange(self.order + 1)[:, None] / self.length
        omega = turn * frequency
        dynamic = arrays.rigidity - omega**2 + 1j * omega * arrays.damping
        change = turn * (2.0 * omega - 1j * arrays.damping) / dynamic**2
        shapes = arrays.shapes
        outer = shapes[:, None] * shapes[None]
        return (
            np.einsum("hi,mri->hmr", 1.0 / dynamic, outer),
            np.einsum("hi,mri->hmr", change, outer),
        )

    def _responds(self, receptance: NDArray[np.complex128], force: Array) -> Array:
        """Series (2 H + 1, m) of what series of forces do to deflections."""
        H = self.order
        wave = np.zeros((H + 1, force.shape[1]), complex)
        wave[0] = force[0]
        wave[1:] = force[1 : H + 1] - 1j * force[H + 1 :]
        found = np.einsum("hmr,hr->hm", receptance, wave)
        return np.concatenate([found.real, -found[1:].imag])

    def _filtered(self, receptance: NDArray[np.complex128], matrix: Array) -> Array:
        """Rows of a matrix (2 H + 1, 2 H + 1), series each, after a receptance."""
        H = self.order
        real, imaginary = receptance.real[:, None], receptance.imag[:, None]
        out = np.empty_like(matrix)
        out[: H + 1] = real * matrix[: H + 1]
        out[1 : H + 1] += imaginary[1:] * matrix[H + 1 :]
        out[H + 1 :] = real[1:] * matrix[H + 1 :] - imaginary[1:] * matrix[1 : H + 1]
        return out

    def motion(self, x: Array, frequency: float) -> PeriodicMotion:
        """The motion of a solution, with contact pieces of its own."""
        series = x.reshape(self.shape)
        pieces = ContactPieces(*(part.copy() for part in self.pieces(series)))
        return PeriodicMotion(frequency, series.copy(), pieces)

    def monodromy(self, motion: PeriodicMotion) -> Array:
        """What a small change of modal displacement and velocity becomes in a period,
        (2 n, 2 n), along the motion."""
        from lumped.kernels import orbit as kernel

        state = np.eye(2 * self.arrays.rigidity.size)
        pieces = motion.pieces
        kernel.monodromy(
            self.arrays, pieces, pieces.start.size, motion.frequency, state
        )
        return state

    def state(self, x: Array, frequency: float) -> Array:
        """Modal displacement and velocity (2, n) at the start of the period."""
        series = x.reshape(self.shape)
        force, _ = self._harmonics(self.pieces(series))
        arrays, H = self.arrays, self.order
        excess = (force - arrays.mean_stiffness * series) @ arrays.shapes
        omega = 2.0 * math.pi * np.arange(H + 1)[:, None] * frequency / self.length
        dynamic = arrays.rigidity - omega**2 + 1j * omega * arrays.damping
        wave = np.zeros(dynamic.shape, complex)
        wave[0] = arrays.load - excess[0]
        wave[1:] = -excess[1 : H + 1] + 1j * excess[H + 1 :]
        wave /= dynamic
        return np.stack([wave.real.sum(axis=0), (1j * omega * wave).real.sum(axis=0)])

    def history(self, motion: PeriodicMotion) -> History:
        """The motion over its period on the grid's edges, as sweeps record theirs."""
        grid, arrays, H = self.grid, self.arrays, self.order
        s = self.deflections(motion.series)
        turn = 2.0 * math.pi * np.arange(1, H + 1)[:, None] / self.length
        slope = np.zeros_like(motion.series)
        slope[1 : H + 1] = turn * motion.series[H + 1 :]
        slope[H + 1 :] = -turn * motion.series[1 : H + 1]
        rate = self.deflections(slope) * motion.frequency
        columns: dict[str, list[Array]] = {}
        for m in range(self.shape[1]):
            own = slice(arrays.first_pair[m], arrays.first_pair[m + 1])
            for name, values in _contact(
                s[..., m],
                grid.stiffness[..., own],
                grid.gap[..., own],
                arrays.backlash[m],
            ).items():
                columns.setdefault(name, []).append(values)
        joined = {name: np.stack(parts, axis=-1) for name, parts in columns.items()}

        def at_edges(values: Array) -> Array:
            return np.concatenate([values[:, 0], values[:1, 0]])

        before = np.concatenate([joined["force"][-1:, 4], joined["force"][:, 4]])
        return History(
            time=grid.edges / motion.frequency,
            deflection=at_edges(s),
            rate=at_edges(rate),
            force=at_edges(joined["force"]),
            drive_overlap=at_edges(joined["drive"]),
            back_overlap=at_edges(joined["back"]),
            force_before=before,
        )

    def figures(self, motion: PeriodicMotion) -> dict[str, Array]:
        """As of a sweep's response, (m,) each; see `lumped.measures`."""
        return measures(self.history(motion))

    def of_history(self, history: History, multiple: int) -> Array:
        """Unknowns x of a recorded motion that repeats after so many common periods."""
        from scipy.interpolate import CubicHermiteSpline

        span = history.time[-1] - history.time[0]
        spline = CubicHermiteSpline(history.time, history.deflection, history.rate)
        count = 8 * (2 * self.order + 1)
        at = np.arange(count) / count
        s = spline(history.time[0] + span * ((at * self.multiple / multiple) % 1.0))
        series = 2.0 * fourier_basis(at, self.order).T @ s / count
        series[0] *= 0.5
        return np.asarray(series).ravel()

    def repeated(self, times: int) -> HarmonicBalance:
        """The same for motions of a longer period."""
        return replace(self, multiple=times * self.multiple)

    def lengthened(self, x: Array, times: int) -> Array:
        """Unknowns x as those of `repeated(times)`."""
        series, H = x.reshape(self.shape), self.order
        longer = self.repeated(times)
        found = np.zeros(longer.shape)
        found[0] = series[0]
        at = times * np.arange(1, H + 1)
        found[at], found[longer.order + at] = series[1 : H + 1], series[H + 1 :]
        return found.ravel()

    def delayed(self, x: Array, periods: int) -> Array:
        """Unknowns x of the motion so many common periods later."""
        series, H = x.reshape(self.shape), self.order
        turn = 2.0 * math.pi * np.arange(1, H + 1)[:, None] * periods / self.multiple
        cosines, sines = series[1 : H + 1], series[H + 1 :]
        found = series.copy()
        found[1 : H + 1] = np.cos(turn) * cosines + np.sin(turn) * sines
        found[H + 1 :] = np.cos(turn) * sines - np.sin(turn) * cosines
        return found.ravel()


def fourier_basis(at: Array, order: int) -> Array:
    """Mean, cosines and sines (t, 2 H + 1) at parts of a period (t,)."""
    angle = 2.0 * math.pi * at[:, None] * np.arange(1, order + 1)
    return np.concatenate([np.ones((at.size, 1)), np.cos(angle), np.sin(angle)], axis=1)


def _contact(
    s: Array, stiffness: Array, gap: Array, backlash: float
) -> dict[str, Array]:
    """Force and overlaps of the nearest flanks of a mesh, of the shape of s."""
    elastic = s[..., None] - gap
    pressed = np.maximum(elastic, 0.0)
    behind = -elastic - backlash
    force = stiffness * (pressed - np.maximum(behind, 0.0))
    stiff = stiffness > 0.0
    return {
        "force": force.sum(axis=-1),
        "drive": np.where(stiff, elastic, -np.inf).max(axis=-1),
        "back": np.where(stiff, behind, -np.inf).max(axis=-1),
    }
