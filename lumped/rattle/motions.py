"""Motions of an assembly between the flanks, and noise of an ensemble of starts."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from lumped.common.array_types import Array
from lumped.common.workers import run_in_threads
from lumped.rattle.assembly import Assembly, Linear
from lumped.rattle.kernels import assembly_modes as kernel
from lumped.rattle.machine import TURN

Waves = NDArray[np.complex128]
MAX_CONDITION = 1e12  # condition number of modes that do not form a basis


@dataclass(frozen=True)
class AssemblyRun:
    """Motion of the flanks over some turns.

    noise : sum of squared impact speeds over the turns [rad^2 per turn^3]; NaN if an
        impact was not found, or if there are far too many in a turn
    upper, lower : number of impacts on each flank
    rotation : relative rotation at the requested instants [rad]
    """

    noise: float
    upper: int
    lower: int
    rotation: Array

    @property
    def is_quiet(self) -> bool:
        return self.noise == 0.0


class AssemblyIntegrator:
    """Assembly prepared for time integration.

    Raises ValueError for a gear on a spring without inertia, which no impact can stop.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.linear = linear = assembly.linear()
        machine = assembly.machine
        if np.linalg.cond(linear.mass) > MAX_CONDITION:
            raise ValueError("parts without inertia: an inertia above 0 is needed")
        play, bound = self._regime(0.0, 0), machine.half_backlash
        if machine.is_impact:
            mobility = np.asarray(np.linalg.solve(linear.mass, linear.row), np.float64)
            kick = 1.0 / float(linear.row @ mobility) * mobility
            regimes = self._at_rest(-1), play, self._at_rest(1)
            # by drag on gears in relative rotation, or in impacts
            has_drag = float(mobility @ linear.damping @ mobility) > 0.0
            inertia = 1.0 / float(linear.row @ mobility)
            losses = has_drag or machine.restitution < 1.0
            last = 0.0, kick, machine.restitution, inertia if losses else 0.0
        else:
            lower, upper = (self._regime(machine.stiffness, side) for side in (-1, 1))
            regimes = lower, play, upper
            last = bound, np.empty(0), 0.0, 0.0
        self.system = kernel.System(regimes, bound, *last)

    def settled(self, rotation: float, speed: float, time: float = 0.0) -> Array:
        """State (2 n,) of all parts in steady rotation except for the driving side.

        rotation, speed : relative rotation and speed of the flanks at a time [rad],
            [rad per turn]
        """
        n = len(self.linear.names)
        error = self.assembly.machine.eccentricity
        state = np.zeros(2 * n)
        driving = np.array([name.startswith("driving") for name in self.linear.names])
        state[:n] = driving * (rotation - error * math.cos(TURN * time))
        state[n:] = driving * (speed + TURN * error * math.sin(TURN * time))
        return state

    def run(
        self,
        state: Array,
        begin: float,
        end: float,
        times: Array | None = None,
        start: float = 0.0,
    ) -> AssemblyRun:
        """Motion from a state (2 n,) at `start`; its noise counts from `begin` on."""
        instants = np.empty(0) if times is None else times
        rotation = np.full(instants.size, math.nan)
        noise, upper, lower, is_finished = kernel.run_motion(
            *(self.system, state.copy(), start, begin, end, instants, rotation)
        )
        level = noise / (end - begin) if is_finished else math.nan
        return AssemblyRun(level, upper, lower, rotation)

    def run_all(
        self, states: Array, begin: float, end: float, times: Array | None = None
    ) -> list[AssemblyRun]:
        """Motions from states (s, 2 n), on all processors."""
        tasks = [partial(self.run, state, begin, end, times) for state in states]
        return run_in_threads(tasks, threading.Event())

    def _regime(self, stiffness: float, side: int) -> kernel.Regime:
        """Regime of motion on a side, or in the play.

        stiffness : stiffness of the flanks in contact on a side, 1 or -1
        """
        linear, machine = self.linear, self.assembly.machine
        n = len(linear.names)
        row = linear.row
        pressed = linear.stiffness + stiffness * np.outer(row, row)
        load = linear.mean + stiffness * side * machine.half_backlash * row
        rates, vectors = _modes(linear, pressed)
        drift, offset = _steady(linear, pressed, load)
        pull = np.asarray(-stiffness * machine.eccentricity * row, np.complex128)
        turn = _forced(linear, pressed, TURN, pull)
        ripple_rate = TURN * machine.ripple_order
        ripple = _forced(linear, pressed, ripple_rate, linear.ripple)
        event_row = row @ vectors[:n]
        forced = complex(row @ turn) + machine.eccentricity, complex(row @ ripple)
        steady = float(row @ offset), float(row @ drift)
        return kernel.Regime(
            *(rates, vectors, np.linalg.inv(vectors), row),
            offset=np.concatenate([offset, drift]),
            drift=np.concatenate([drift, np.zeros(n)]),
            **self._waves(turn, ripple),
            event_row=event_row,
            forced=forced,
            steady=steady,
        )

    def _at_rest(self, side: int) -> kernel.Regime:
        """Regime of rigid flanks at rest on each other, until the load changes sign.

        Rotations that preserve contact are shapes (n, n - 1) times coordinates.
        """
        linear, machine = self.linear, self.assembly.machine
        n, row = len(linear.names), linear.row
        shapes = null_space(row[None, :])
        reduced = [
            shapes.T @ matrix @ shapes
            for matrix in (linear.mass, linear.damping, linear.stiffness)
        ]
        rates, vectors = _basis(*reduced)
        both = np.kron(np.eye(2), shapes)
        arrays = {
            "rates": np.zeros(2 * n, complex),
            "vectors": np.zeros((2 * n, 2 * n), complex),
            "inverse": np.zeros((2 * n, 2 * n), complex),
            "event_row": np.zeros(2 * n, complex),
        }
        n_modes = 2 * n - 2
        arrays["rates"][:n_modes] = rates
        arrays["vectors"][:, :n_modes] = both @ vectors
        arrays["inverse"][:n_modes] = np.linalg.inv(vectors) @ both.T
        displacements = shapes @ vectors[: n - 1]
        force = (
            linear.mass @ displacements * rates**2
            + linear.damping @ displacements * rates
        )
        arrays["event_row"][:n_modes] = (
            -row @ (force + linear.stiffness @ displacements) / (row @ row)
        )
        mean = linear.respond(0.0, linear.mean, -side * machine.half_backlash).real
        turn = linear.respond(TURN, np.zeros(n), machine.eccentricity)
        ripple = linear.respond(TURN * machine.ripple_order, linear.ripple)
        return kernel.Regime(
            *(arrays["rates"], arrays["vectors"], arrays["inverse"], row),
            offset=np.concatenate([mean[:-1], np.zeros(n)]),
            drift=np.zeros(2 * n),
            **self._waves(turn[:-1], ripple[:-1]),
            event_row=arrays["event_row"],
            forced=(complex(turn[-1]), complex(ripple[-1])),
            steady=(float(mean[-1]), 0.0),
        )

    def _waves(self, turn: Waves, ripple: Waves) -> dict[str, Any]:
        """Waves of rotations and speeds, with their rates."""
        machine = self.assembly.machine
        rate = TURN * machine.ripple_order
        return {
            "turn": np.concatenate([turn, 1j * TURN * turn]),
            "ripple": np.concatenate([ripple, 1j * rate * ripple]),
            "order": float(machine.ripple_order),
            "error": machine.eccentricity,
        }


def _modes(linear: Linear, stiffness: Array) -> tuple[Waves, Waves]:
    """Rates (2 n,) and vectors (2 n, 2 n), computed separately for uncoupled parts.

    Two equal sides would share rates, whose vectors a solver cannot separate.
    """
    n = len(linear.names)
    rates, vectors = np.zeros(2 * n, complex), np.zeros((2 * n, 2 * n), complex)
    n_modes = 0
    for group in _groups(_coupling(linear, stiffness)):
        block = np.ix_(group, group)
        size = len(group)
        columns = slice(n_modes, n_modes + 2 * size)
        rates[columns], shapes = _basis(
            linear.mass[block], linear.damping[block], stiffness[block]
        )
        rows = np.concatenate([group, group + n])
        vectors[rows, columns] = shapes
        n_modes += 2 * size
    return rates, vectors


def _basis(mass: Array, damping: Array, stiffness: Array) -> tuple[Waves, Waves]:
    """Rates (2 s,) and vectors (2 s, 2 s) of s coordinates and their speeds."""
    size = len(mass)
    matrix = np.zeros((2 * size, 2 * size))
    matrix[:size, size:] = np.eye(size)
    matrix[size:, :size] = -np.linalg.solve(mass, stiffness)
    matrix[size:, size:] = -np.linalg.solve(mass, damping)
    eigenvalues, shapes = np.linalg.eig(matrix)
    if np.linalg.cond(shapes) > MAX_CONDITION:
        raise ValueError("modes of the parts are no basis; change a parameter slightly")
    # damping dissipates energy: growth is round-off
    rates = np.minimum(eigenvalues.real, 0.0) + 1j * eigenvalues.imag
    return rates, np.asarray(shapes, np.complex128)


def _coupling(linear: Linear, stiffness: Array) -> Array:
    """Coupling (n, n) between parts, 0 if there is none."""
    return np.abs(linear.mass) + np.abs(linear.damping) + np.abs(stiffness)


def _groups(coupling: Array) -> list[NDArray[np.int64]]:
    """Groups of coupled parts."""
    linked = coupling != 0.0
    for _ in range(len(linked)):
        linked = linked @ linked
    return [np.flatnonzero(row) for row in np.unique(linked, axis=0)]


def _steady(linear: Linear, stiffness: Array, load: Array) -> tuple[Array, Array]:
    """Drift and offset (n,) under a constant load: C drift + K offset = load."""
    n = len(load)
    drift, offset = np.zeros(n), np.zeros(n)
    for group in _groups(_coupling(linear, stiffness)):
        block = np.ix_(group, group)
        # parts without restraint rotate as one, whatever the absorber does
        held = stiffness[block]
        free = np.abs(held.sum(axis=1)) <= 1e-9 * max(np.abs(held).max(), 1e-300)
        turning = free.astype(float)
        speed = load[group].sum() / (turning @ linear.damping[block] @ turning)
        drift[group] = turning * speed
        residual_load = load[group] - linear.damping[block] @ drift[group]
        offset[group] = np.linalg.lstsq(held, residual_load, rcond=1e-13)[0]
    return drift, offset


def _forced(linear: Linear, stiffness: Array, rate: float, load: Waves) -> Waves:
    matrix = stiffness - rate**2 * linear.mass + 1j * rate * linear.damping
    return np.asarray(np.linalg.solve(matrix, load), complex)
