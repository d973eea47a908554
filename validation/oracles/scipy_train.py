"""The lumped models as one would write them with NumPy and SciPy.

Physical coordinates, matrices, `scipy.integrate.solve_ivp`: slow, short, and sharing
no code with the compiled kernels, so that it serves as their opponent and check.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from lumped.common.array_types import Array
from lumped.train.system import LumpedSystem

Method = Literal["DOP853", "LSODA"]
TABLE_POINTS = 4096  # points per base pitch of stiffness and gap
READ_POINTS = 256  # per period of the first mesh at which the motion is read


class ScipyTrain:
    """Equations of motion M a + C v + K x + G^T F(G x, t) = T."""

    def __init__(self, system: LumpedSystem) -> None:
        if system.repetitions > 1:
            raise ValueError("teeth must be equal: a base pitch is read for all others")
        space, modes = system.modes.coordinates, system.modes
        self.mass, self.load, self.rows = space.mass, space.load, space.mesh_rows
        springs = space.spring_rows * space.spring_stiffness[:, None]
        self.stiffness = space.spring_rows.T @ springs
        self.damping = modes.damping_matrix(system.train.damping_ratio)
        self.backlash = np.array([mesh.backlash for mesh in system.train.meshes])
        self.phase = [mesh.phase for mesh in system.train.meshes]
        self.rate = [float(rate) for rate in system.train.mesh_rates]
        x = np.arange(TABLE_POINTS + 1) / TABLE_POINTS
        self.tables = [
            np.array([[pair.stiffness(x), pair.gap(x)] for pair in excitation.pairs])
            for excitation in system.excitations
        ]
        mean = self.stiffness + self.rows.T @ (
            modes.mean_stiffness[:, None] * self.rows
        )
        self.start = np.linalg.lstsq(mean, self.load, rcond=None)[0]

    def slope(self, time: float, state: Array, frequency: float) -> Array:
        """Derivative of displacement and velocity (2 n,) at a time [s]."""
        x, v = np.split(state, 2)
        force = self.forces(self.rows @ x, time * frequency)
        load = self.load - self.damping @ v - self.stiffness @ x - force @ self.rows
        return np.concatenate([v, load / self.mass])

    def forces(self, deflection: Array, periods: float) -> Array:
        """Mesh forces (m,) [N] after so many periods of the first mesh."""
        force = np.empty(deflection.size)
        for m, table in enumerate(self.tables):
            position = (self.phase[m] + self.rate[m] * periods) % 1.0 * TABLE_POINTS
            i = min(int(position), TABLE_POINTS - 1)
            part = position - i
            stiffness, gap = ((1.0 - part) * table[..., i] + part * table[..., i + 1]).T
            e = deflection[m] - gap
            overlap = np.maximum(e, 0.0) + np.minimum(e + self.backlash[m], 0.0)
            force[m] = stiffness @ overlap
        return force


def scipy_rms(
    train: ScipyTrain,
    frequency: float,
    settle: float,
    measure: int,
    method: Method,
    rtol: float,
) -> Array:
    """RMS of the DTE without its mean (m,) [m] after `settle` periods.

    measure : whole periods of the first mesh to read
    """
    start = np.concatenate([train.start, np.zeros_like(train.start)])
    size = np.abs(train.start).max()
    scale = np.repeat([size, size * 2.0 * math.pi * frequency], train.start.size)
    span = (0.0, (settle + measure) / frequency)
    times = (settle + np.arange(measure * READ_POINTS) / READ_POINTS) / frequency
    done = solve_ivp(
        train.slope,
        span,
        start,
        method,
        t_eval=times,
        rtol=rtol,
        atol=rtol * 1e-2 * scale,
        args=(frequency,),
    )
    deflection = train.rows @ done.y[: train.start.size]
    return deflection.std(axis=1)
