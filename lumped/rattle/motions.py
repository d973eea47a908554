"""Motions of an assembly between the flanks: noise of an ensemble of starts."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from lumped.rattle.assembly import Assembly, Linear
from lumped.rattle.kernels import modes as kernel
from lumped.rattle.machine import TURN
from lumped.workers import run_together

Array = NDArray[np.float64]
Waves = NDArray[np.complex128]
SINGULAR = 1e12  # condition of modes that are no basis


@dataclass(frozen=True)
class Motion:
    """What flanks did over some turns.

    noise : sum of squared speeds at which they met over the turns [rad^2 per turn^3];
        NaN where a meeting was not found, or they would come to rest in impacts
    upper, lower : how often they met
    rotation : relative one at the instants asked for [rad]
    """

    noise: float
    upper: int
    lower: int
    rotation: Array

    @property
    def is_quiet(self) -> bool:
        return self.noise == 0.0


class Motions:
    """An assembly ready to move.

    Raises ValueError for a gear on a spring without inertia, which no impact can stop.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.linear = linear = assembly.linear()
        machine = assembly.machine
        if np.linalg.cond(linear.mass) > SINGULAR:
            raise ValueError("parts without inertia: an inertia above 0 is needed")
        play = self._regime(0.0, 0)
        regimes = play, play, play
        kick: Array = np.empty(0)
        if machine.is_impact:
            soft = np.asarray(np.linalg.solve(linear.mass, linear.row), np.float64)
            kick = (1.0 + machine.restitution) / float(linear.row @ soft) * soft
        else:
            lower, upper = (self._regime(machine.stiffness, side) for side in (-1, 1))
            regimes = lower, play, upper
        self.system = kernel.System(regimes, machine.half_backlash, kick)

    def settled(self, rotation: float, speed: float, time: float = 0.0) -> Array:
        """State (2 n,) of all parts in steady rotation but for the driving side.

        rotation, speed : relative ones of the flanks [rad], [rad per turn] at a time
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
    ) -> Motion:
        """The motion from a state (2 n,) at `start`; its noise is from `begin` on."""
        instants = np.empty(0) if times is None else times
        rotation = np.full(instants.size, math.nan)
        noise, upper, lower, found = kernel.run(
            *(self.system, state.copy(), start, begin, end, instants, rotation)
        )
        level = noise / (end - begin) if found else math.nan
        return Motion(level, upper, lower, rotation)

    def run_all(
        self, states: Array, begin: float, end: float, times: Array | None = None
    ) -> list[Motion]:
        """Those of states (s, 2 n), on all processors."""
        tasks = [partial(self.run, state, begin, end, times) for state in states]
        return run_together(tasks, threading.Event())

    def _regime(self, stiffness: float, side: int) -> kernel.Regime:
        """stiffness : of flanks that are pressed together on a side, 1 or -1."""
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
        return kernel.Regime(
            rates=rates,
            vectors=vectors,
            inverse=np.linalg.inv(vectors),
            row=row,
            offset=np.concatenate([offset, drift]),
            drift=np.concatenate([drift, np.zeros(n)]),
            turn=np.concatenate([turn, 1j * TURN * turn]),
            ripple=np.concatenate([ripple, 1j * ripple_rate * ripple]),
            order=float(machine.ripple_order),
            error=machine.eccentricity,
        )


def _modes(linear: Linear, stiffness: Array) -> tuple[Waves, Waves]:
    """Rates (2 n,) and vectors (2 n, 2 n), those of parts that are apart by themselves.

    Two sides that are alike would share rates, whose vectors no solver tells apart.
    """
    n = len(linear.names)
    rates, vectors = np.zeros(2 * n, complex), np.zeros((2 * n, 2 * n), complex)
    used = 0
    for group in _groups(_coupling(linear, stiffness)):
        own = np.ix_(group, group)
        size = len(group)
        matrix = np.zeros((2 * size, 2 * size))
        matrix[:size, size:] = np.eye(size)
        matrix[size:, :size] = -np.linalg.solve(linear.mass[own], stiffness[own])
        matrix[size:, size:] = -np.linalg.solve(linear.mass[own], linear.damping[own])
        found, shapes = np.linalg.eig(matrix)
        if np.linalg.cond(shapes) > SINGULAR:
            raise ValueError(
                "modes of the parts are no basis; change a figure a little"
            )
        columns = slice(used, used + 2 * size)
        # damping takes energy: growth is round-off
        rates[columns] = np.minimum(found.real, 0.0) + 1j * found.imag
        places = np.concatenate([group, group + n])
        vectors[places, columns] = shapes
        used += 2 * size
    return rates, vectors


def _coupling(linear: Linear, stiffness: Array) -> Array:
    """What moves one part by another (n, n), 0 where nothing does."""
    return np.abs(linear.mass) + np.abs(linear.damping) + np.abs(stiffness)


def _groups(coupling: Array) -> list[NDArray[np.int64]]:
    """Parts that move one another."""
    linked = coupling != 0.0
    for _ in range(len(linked)):
        linked = linked @ linked
    return [np.flatnonzero(row) for row in np.unique(linked, axis=0)]


def _steady(linear: Linear, stiffness: Array, load: Array) -> tuple[Array, Array]:
    """Drift and offset (n,) under a constant load: C drift + K offset = load."""
    n = len(load)
    drift, offset = np.zeros(n), np.zeros(n)
    for group in _groups(_coupling(linear, stiffness)):
        own = np.ix_(group, group)
        # parts that nothing holds turn as one, whatever the absorber does
        held = stiffness[own]
        free = np.abs(held.sum(axis=1)) <= 1e-9 * max(np.abs(held).max(), 1e-300)
        turning = free.astype(float)
        speed = load[group].sum() / (turning @ linear.damping[own] @ turning)
        drift[group] = turning * speed
        left = load[group] - linear.damping[own] @ drift[group]
        offset[group] = np.linalg.lstsq(held, left, rcond=1e-13)[0]
    return drift, offset


def _forced(linear: Linear, stiffness: Array, rate: float, load: Waves) -> Waves:
    matrix = stiffness - rate**2 * linear.mass + 1j * rate * linear.damping
    return np.asarray(np.linalg.solve(matrix, load), complex)
