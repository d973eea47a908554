"""What a relief makes least, and the step that does so for a linear change.

Measures of the transmission error at a torque are its peak to peak, or the root of the
sum of the squares of amplitudes of chosen harmonics of the mesh frequency. Both are
convex in the transmission error, so that the best step of its linear change is that
of linear programs: one for the peak to peak, in epigraph form, and a few for harmonics,
each with cuts at the solution of the one before (Kelley 1960).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from lumped.common.array_types import Array
from lumped.common.units import UM

Objective = Literal["largest", "mean", "harmonics"]
MAX_CUTS = 12  # linear programs of a step for harmonics
CUT_RTOL = 1e-3  # of the objective, by which the last one may be below it


@dataclass(frozen=True)
class ReliefObjective:
    """Largest or mean over torques of a measure of the transmission error.

    harmonics : orders of the mesh frequency of the objective harmonics
    factors : of the measures at the torques (t,), 1 where empty
    """

    name: Objective = "largest"
    harmonics: tuple[int, ...] = (1, 2, 3)
    factors: tuple[float, ...] = ()

    def measures(self, ste: Array) -> Array:
        """Measure of transmission errors (t, p) at each torque (t,) [m]."""
        if self.name == "harmonics":
            parts = ste @ harmonic_parts(ste.shape[1], self.harmonics).T
            return np.asarray(np.linalg.norm(parts, axis=1))
        return peak_to_peak(ste)

    def value(self, measures: Array) -> float:
        scaled = np.asarray(measures) * (self.factors or 1.0)
        return float(scaled.mean() if self.name == "mean" else scaled.max())

    def of(self, ste: Array) -> float:
        """Objective [m] of transmission errors (t, p)."""
        return self.value(self.measures(ste))


def peak_to_peak(ste: Array) -> Array:
    """Peak to peak of transmission errors (t, p), at each torque."""
    return np.asarray(np.ptp(ste, axis=1))


def harmonic_parts(positions: int, orders: tuple[int, ...]) -> Array:
    """Matrix (2 k, p) from values at equal steps of a mesh cycle to its harmonics.

    Cosine and sine parts, zero to peak, whose squares add up to that of the amplitude.
    """
    angle = 2.0 * np.pi * np.outer(orders, np.arange(positions)) / positions
    return np.asarray(np.concatenate([np.cos(angle), np.sin(angle)]) * 2.0 / positions)


def linear_step(
    ste: Array, slopes: Array, limits: tuple[Array, Array], objective: ReliefObjective
) -> tuple[Array, float]:
    """Step within limits that makes the linearised objective least, and its value [m].

    ste, slopes : transmission errors (t, p) [m] and derivatives (t, p, n) by the step
    """
    factors = np.array(objective.factors or np.ones(len(ste))) / UM
    scaled = ste * factors[:, None], slopes * factors[:, None, None]
    if objective.name == "harmonics":
        step, value = _step_of_harmonics(*scaled, limits, objective)
    else:
        step, value = _step_of_peaks(*scaled, limits, objective.name)
    return (
        (np.zeros(slopes.shape[2]), objective.of(ste))
        if step is None
        else (
            step,
            UM * value,
        )
    )


def _solve_linear_program(
    weights: Array, rows: Array, upper_bounds: Array, limits: tuple[Array, Array]
) -> Any:
    """Solve a linear program; limits : of the first unknowns, others are free.

    `milp` calls the same solver as `linprog` in two thirds of its time.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    free = np.full(weights.size - limits[0].size, np.inf)
    bounds = Bounds(np.append(limits[0], -free), np.append(limits[1], free))
    constraint = LinearConstraint(rows, -np.inf, upper_bounds)
    return milp(
        weights, constraints=constraint, bounds=bounds, options={"presolve": False}
    )


def _step_of_peaks(
    ste: Array, slopes: Array, limits: tuple[Array, Array], name: Objective
) -> tuple[Array | None, float]:
    """Unknowns are the step, the largest and the smallest transmission error at each
    torque, and the largest of their differences.
    """
    torques, positions, size = slopes.shape
    rows = np.zeros((2, torques, positions, size + 2 * torques + 1))
    rows[0, ..., :size], rows[1, ..., :size] = slopes, -slopes
    differences = np.zeros((torques, size + 2 * torques + 1))
    differences[:, -1] = -1.0
    for t in range(torques):
        rows[0, t, :, size + t] = -1.0
        rows[1, t, :, size + torques + t] = 1.0
        differences[t, size + t], differences[t, size + torques + t] = 1.0, -1.0
    upper_bounds = np.concatenate([-ste.ravel(), ste.ravel(), np.zeros(torques)])
    weights = differences.mean(axis=0)
    if name == "largest":
        weights = np.zeros_like(weights)
    weights[-1] = 1.0 if name == "largest" else 0.0
    every = np.concatenate([rows.reshape(-1, rows.shape[-1]), differences])
    solution = _solve_linear_program(weights, every, upper_bounds, limits)
    if solution.x is None or solution.fun is None:
        return None, 0.0
    return solution.x[:size], float(solution.fun)


def _step_of_harmonics(
    ste: Array, slopes: Array, limits: tuple[Array, Array], objective: ReliefObjective
) -> tuple[Array | None, float]:
    """Unknowns are the step and the largest measure, which lies above all cuts."""
    matrix = harmonic_parts(ste.shape[1], objective.harmonics)
    parts = ste @ matrix.T
    rates = np.einsum("kp,tpn->tkn", matrix, slopes)
    size = slopes.shape[2]
    best: Array | None = None
    best_value, rows, upper_bounds = np.inf, [np.append(np.zeros(size), -1.0)], [0.0]
    current_values, step = parts, np.zeros(size)
    for _ in range(MAX_CUTS):
        lengths = np.linalg.norm(current_values, axis=1)
        for t in np.flatnonzero(lengths):
            direction = current_values[t] / lengths[t]
            rows.append(np.append(direction @ rates[t], -1.0))
            upper_bounds.append(-float(direction @ parts[t]))
        weights = np.append(np.zeros(size), 1.0)
        solution = _solve_linear_program(
            weights, np.array(rows), np.array(upper_bounds), limits
        )
        if solution.x is None:
            break
        step = solution.x[:size]
        current_values = parts + rates @ step
        value = float(np.linalg.norm(current_values, axis=1).max())
        if value < best_value:
            best, best_value = step, value
        if best_value - float(solution.x[-1]) <= CUT_RTOL * best_value:
            break
    return best, best_value
