"""Floquet multipliers of a periodic system, by series, exponentials or integration."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array, Complex
from lumped.stability.periodic_system import PeriodicSystem

Method = Literal["peano-baker", "exponential", "integration"]
# Angle of a step, and truncation error of its series
MAX_STEP_ANGLE, SERIES_ERROR = 1.5, 1e-14
PARTS_PER_PIECE = 64  # parts of a piece for exponentials
INTEGRATION_RTOL = 1e-10  # relative error of the integration


def transition(
    system: PeriodicSystem, frequency: ArrayLike, method: Method = "peano-baker"
) -> Array:
    """State transition (f, 2 n, 2 n) over the common period, see `scaled_transition`.

    Entries that overflow are infinite.
    """
    scaled, growth = scaled_transition(system, frequency, method)
    return scale_by_growth(scaled, growth[:, None, None])


def scaled_transition(
    system: PeriodicSystem, frequency: ArrayLike, method: Method = "peano-baker"
) -> tuple[Array, Array]:
    """State transitions exp(g) A over the common period; state (q, q'/frequency).

    Returns A (f, 2 n, 2 n) and g (f,).

    frequency : (f,) frequency of the first mesh [Hz]
    method : Peano-Baker series, summed by powers of time (eq. 4.53-4.55); exponentials
        of mean stiffness on parts of the pieces (eq. 4.56); or integration by SciPy

    Raises ValueError if a frequency is not positive.
    """
    speeds = np.atleast_1d(np.asarray(frequency, float))
    if not ((speeds > 0.0) & np.isfinite(speeds)).all():
        raise ValueError(f"frequency = {speeds.min():g}; must be positive")
    if method == "integration":
        transitions = np.stack([_integrated(system, speed) for speed in speeds])
        return transitions, np.zeros(speeds.size)
    if method == "exponential":
        system = system.averaged(PARTS_PER_PIECE)
    from lumped.stability.kernels.transition import set_transitions

    out = np.empty((speeds.size, 2 * system.modes, 2 * system.modes))
    pieces = np.diff(system.edges), system.stiffness, system.damping, 1.0 / speeds
    growth = np.empty(speeds.size)
    set_transitions(*pieces, MAX_STEP_ANGLE, SERIES_ERROR, out, growth)
    return out, growth


def _integrated(system: PeriodicSystem, speed: float) -> Array:
    return integrated(system, speed, system.edges[-1:])[-1]


def integrated(system: PeriodicSystem, speed: float, times: Array) -> Array:
    """State transitions (t, 2 n, 2 n) from 0 to times, by adaptive steps of SciPy.

    speed : frequency of the first mesh [Hz]
    times : (t,) increasing, in a common period, in periods of the first mesh
    """
    from scipy.integrate import solve_ivp

    n, period = system.modes, 1.0 / speed
    state, transitions = np.eye(2 * n), []
    for p, (start, end) in enumerate(pairwise(system.edges.tolist())):
        coefficients = system.stiffness[p]
        inside = times[(times > start) & (times <= end)]

        def rate(t: float, y: Array, piece: Array = coefficients) -> Array:
            q, w = y.reshape(2, n, 2 * n)
            k = np.einsum("j,jab->ab", t ** np.arange(len(piece)), piece)
            restoring = period * system.damping[:, None] * w + period**2 * (k @ q)
            return np.stack([w, -restoring]).ravel()

        path = solve_ivp(
            *(rate, (0.0, end - start), state.ravel(), "DOP853"),
            t_eval=np.unique(np.append(inside - start, end - start)),
            rtol=INTEGRATION_RTOL,
            atol=INTEGRATION_RTOL,
        )
        states = path.y.T.reshape(-1, 2 * n, 2 * n)
        transitions.append(states[: inside.size])
        state = states[-1]
    return np.concatenate(transitions)


def multipliers(
    system: PeriodicSystem, frequency: ArrayLike, method: Method = "peano-baker"
) -> Complex:
    """Floquet multipliers (f, 2 n) over the common period."""
    scaled, growth = scaled_transition(system, frequency, method)
    values = np.asarray(np.linalg.eigvals(scaled), complex)
    factor = scale_by_growth(np.ones(growth.size), growth)
    with np.errstate(invalid="ignore"):
        return np.asarray(values * factor[:, None], complex)


def largest_multiplier(
    system: PeriodicSystem, frequency: ArrayLike, method: Method = "peano-baker"
) -> Array:
    """Modulus (f,) of the largest multiplier; vibration grows if it exceeds 1."""
    scaled, growth = scaled_transition(system, frequency, method)
    return scale_by_growth(np.abs(np.linalg.eigvals(scaled)).max(axis=1), growth)


def scale_by_growth(values: Array, growth: Array) -> Array:
    """Values times exp(growth), infinite if they overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(values * np.exp(growth))
