"""Harmonic balance: periodic motions of a lumped train as Fourier series.

Coordinates x respond to the forces F of the contacts beyond those of a mean stiffness
k, harmonic by harmonic, x_h = static_h - G(omega_h) (F - k x)_h; the forces follow
from the motion over time. Those of springs are evaluated with the true contact function
on Gauss points between its changes, so that the equations and their Jacobian are exact
to the quadrature: only harmonics that are left out are missing.

T. M. Cameron and J. H. Griffin, J. Appl. Mech. 56 (1989) 149.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lumped.branches.series import Series
from lumped.branches.space_forces import SpaceForces
from lumped.branches.springs import SpringForces
from lumped.common.array_types import Array, Complex
from lumped.kernels.arrays import ContactPieces
from lumped.steady.integration_settings import Settings
from lumped.steady.measures import measure_motion
from lumped.steady.response import Response
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import FixedStepper
from lumped.train.bodies import TrainError
from lumped.train.system import LumpedSystem

MIN_PIECES_PER_PERIOD = 96  # pieces of a period of the fastest mesh
PIECES_PER_HARMONIC = 6  # pieces for each harmonic
MAX_UNKNOWNS = 3000  # whose Jacobian takes a second to factorise


@dataclass(frozen=True, eq=False)
class HarmonicBalance:
    """The equations of a lumped system for motions of one period.

    harmonics : of the mesh frequency of the first mesh that are kept
    multiple : common periods after which the motion repeats
    steepness : [1/m] of contact that closes by tanh, None for true contact

    A vector x of unknowns holds the series (2 H + 1, d) of the coordinates row by row:
    mean, cosines and sines of H = harmonics times the period's length. Coordinates are
    the deflections of the meshes, or those of the coupled model.
    """

    system: LumpedSystem
    harmonics: int = 20
    multiple: int = 1
    steepness: float | None = None

    def __post_init__(self) -> None:
        if self.system.has_friction:
            raise TrainError("friction must be 0; harmonic balance leaves it out")
        if self.system.contacts is not None:
            raise TrainError("the coupled model is not of springs, see PeriodMap")
        if self.system.space is not None and self.steepness is not None:
            raise TrainError(
                "steepness: contact that closes by tanh is of gears in the plane"
            )
        for name in ("harmonics", "multiple"):
            if getattr(self, name) < 1:
                value = getattr(self, name)
                raise ValueError(f"{name} = {value}; must be at least 1")
        unknowns = self.shape[0] * self.shape[1]
        if unknowns > MAX_UNKNOWNS:
            raise TrainError(
                f"{self.harmonics} harmonics of a motion of {self.length} periods of "
                f"the first mesh: {unknowns} unknowns, more than {MAX_UNKNOWNS}; "
                "allowed are fewer harmonics, a shorter period or simpler tooth ratios"
            )

    @property
    def length(self) -> int:
        """Period of the motion in periods of the first mesh."""
        return self.system.common_period[0] * self.multiple

    @cached_property
    def series(self) -> Series:
        return Series(self.harmonics * self.length, self.length)

    @cached_property
    def forces(self) -> SpringForces:
        rate = float(max(self.system.train.mesh_rates))
        min_pieces = max(
            MIN_PIECES_PER_PERIOD * rate, PIECES_PER_HARMONIC * self.harmonics
        )
        kind = SpringForces if self.system.space is None else SpaceForces
        return kind(self.system, self.series, min_pieces, self.steepness)

    @property
    def size(self) -> float:
        """Norm of the unknowns under the loads alone."""
        return float(np.abs(self.forces.static).max())

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a series."""
        return self.series.rows, self.forces.count

    @cached_property
    def static(self) -> Array:
        """Unknowns x of gears under the loads alone."""
        series = np.zeros(self.shape)
        series[0] = self.forces.static
        return series.ravel()

    def _omega(self, frequency: float) -> Array:
        """Angular frequencies (H + 1,) of the harmonics [rad/s]."""
        order = np.arange(self.series.order + 1)
        return np.asarray(2.0 * math.pi * frequency / self.length * order, float)

    def equations(self, x: Array, frequency: float) -> tuple[Array, Array, Array]:
        """Errors of the equations (u,), their Jacobian (u, u), and what a change of
        frequency makes of them (u,) per Hz."""
        series, k = self.series, self.forces.stiffness
        motion = x.reshape(self.shape)
        force, slope = self._harmonics(self.forces.pieces(motion))
        omega = self._omega(frequency)
        receptance, change = self.forces.receptance(omega)
        errors = self._errors(motion, force, receptance)
        by_frequency = change * (omega / frequency)[:, None, None]
        errors_by_frequency = self._respond(motion, force, by_frequency)
        rows, count = self.shape
        jacobian = np.eye(x.size).reshape(rows, count, rows, count)
        for i, j in np.ndindex(count, count):
            if not slope[:, i, j].any() and not k[i, j]:
                continue
            tangent = series.products(slope[:, i, j])
            tangent[np.diag_indices(rows)] -= k[i, j]
            for r in range(count):
                jacobian[:, r, :, j] += series.filtered(receptance[:, r, i], tangent)
        return (
            errors.ravel(),
            jacobian.reshape(x.size, x.size),
            errors_by_frequency.ravel(),
        )

    def errors(self, x: Array, frequency: float) -> Array:
        """Errors of the equations (u,) alone."""
        motion = x.reshape(self.shape)
        force, _ = self._harmonics(self.forces.pieces(motion))
        receptance, _ = self.forces.receptance(self._omega(frequency))
        return self._errors(motion, force, receptance).ravel()

    def _errors(self, motion: Array, force: Array, receptance: Complex) -> Array:
        errors = motion + self._respond(motion, force, receptance)
        errors[0] -= self.forces.static
        return errors

    def _respond(self, motion: Array, force: Array, receptance: Complex) -> Array:
        """Series that follows from forces beyond those of the mean stiffness."""
        excess = self.series.waves(force - motion @ self.forces.stiffness.T)
        return self.series.of_waves(np.einsum("hij,hj->hi", receptance, excess))

    def _harmonics(self, pieces: ContactPieces) -> tuple[Array, Array]:
        """Series of the forces (2 H + 1, d), and means of the slopes' products with
        waves up to 2 H (4 H + 1, d, d)."""
        from lumped.kernels.orbit import GAUSS_POINTS, GAUSS_WEIGHTS

        series, sampled = self.series, self.forces.sampled
        weight = pieces.length[:, None] * GAUSS_WEIGHTS / self.length
        uncut = pieces.grid_piece >= 0
        times = pieces.start[~uncut, None] + pieces.length[~uncut, None] * GAUSS_POINTS
        extra = series.basis(times.ravel(), 2 * series.order)

        def means(values: Array) -> Array:
            flat = values.reshape(*values.shape[:2], -1) * weight[..., None]
            on_grid = np.zeros((len(sampled.times), 3, flat.shape[-1]))
            on_grid[pieces.grid_piece[uncut]] = flat[uncut]
            coefficients = sampled.twice.T @ on_grid.reshape(-1, flat.shape[-1])
            coefficients += extra.T @ flat[~uncut].reshape(-1, flat.shape[-1])
            return coefficients.reshape(len(coefficients), *values.shape[2:])

        twice, H = 2 * series.order, series.order
        low_orders = [*range(H + 1), *range(twice + 1, twice + H + 1)]
        force = 2.0 * means(pieces.force)[low_orders]
        force[0] *= 0.5
        return force, means(pieces.slope)

    def monodromy(self, x: Array, frequency: float) -> Array:
        """What a small change of displacement and velocity becomes in a period
        (2 n, 2 n)."""
        from lumped.kernels import orbit as kernel

        pieces = self.forces.pieces(x.reshape(self.shape))
        damping = self.forces.damping_at(frequency)
        tangent = np.ascontiguousarray(self.forces.modal(pieces.slope))
        state = np.eye(2 * len(damping))
        kernel.integrate_changes(tangent, damping, pieces.length / frequency, state)
        return state

    def state(self, x: Array, frequency: float) -> Array:
        """Displacement and velocity (2, n) of the modes at the start of the period."""
        motion = x.reshape(self.shape)
        force, _ = self._harmonics(self.forces.pieces(motion))
        omega, series = self._omega(frequency), self.series
        waves: Complex = self.forces.modes(
            series.waves(motion), series.waves(force), omega
        )
        rates = 1j * omega[:, None] * waves
        return np.stack([waves.real.sum(axis=0), rates.real.sum(axis=0)])

    def figures(self, x: Array, frequency: float) -> dict[str, Array]:
        """Quantities of a sweep's response, (m,) each; see `lumped.steady.measures`."""
        return measure_motion(self.forces.history(x.reshape(self.shape), frequency))

    def of_response(self, response: Response, settings: Settings) -> Array:
        """Unknowns x of a motion that has settled by fixed steps."""
        from scipy.interpolate import CubicHermiteSpline

        from lumped.kernels import orbit as kernel

        stepper = FixedStepper(self.system)
        kernel_args: tuple[Any, Any] = stepper.kernel_arguments(
            Speed(response.frequency, settings)
        )
        arrays, steps = kernel_args
        out = np.empty((response.multiple * steps.h.size + 1, *response.state.shape))
        kernel.integrate_steps(arrays, steps, np.array(response.state), out)
        times = np.concatenate([[0.0], np.cumsum(np.tile(steps.h, response.multiple))])
        spline = CubicHermiteSpline(times, *self.forces.of_modes(out).swapaxes(0, 1))
        count = 8 * self.series.rows
        part = (np.arange(count) / count * self.multiple / response.multiple) % 1.0
        return np.asarray(self.series.of_samples(spline(times[-1] * part)).ravel())

    def repeated(self, times: int) -> HarmonicBalance:
        """These equations for motions of a longer period."""
        return replace(self, multiple=times * self.multiple)

    def lengthened(self, x: Array, times: int) -> Array:
        """Unknowns x as those of `repeated(times)`."""
        series, H = x.reshape(self.shape), self.series.order
        longer = self.repeated(times)
        coefficients = np.zeros(longer.shape)
        coefficients[0] = series[0]
        orders = times * np.arange(1, H + 1)
        coefficients[orders] = series[1 : H + 1]
        coefficients[longer.series.order + orders] = series[H + 1 :]
        return coefficients.ravel()

    def delayed(self, x: Array, periods: int, frequency: float) -> Array:
        """Unknowns x of the motion so many common periods later."""
        later = periods * self.system.common_period[0]
        return self.series.delayed(x.reshape(self.shape), later).ravel()

    def odd_part(self, x: Array, frequency: float) -> Array:
        """Harmonics that motions of half the period do not have."""
        series, H = x.reshape(self.shape), self.series.order
        return np.concatenate([series[1 : H + 1 : 2], series[H + 1 :: 2]]).ravel()
