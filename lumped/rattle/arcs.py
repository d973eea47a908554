"""Motions as arcs, in the play or on a flank, that join into an orbit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array
from lumped.rattle.kernels import arcs as kernel
from lumped.rattle.machine import TURN, Machine
from lumped.rattle.return_map import Itinerary


def arcs_of(machine: Machine, path: Array) -> Array:
    """Arcs (a, 7) of a path, see `trace`; none if the flanks stay together."""
    if not np.isfinite(path).all():
        return np.empty((0, kernel.N_COLUMNS))
    count = len(path) - 1
    arcs = np.empty((2 * (count + int(path[:-1, 2].sum())) + 1, kernel.N_COLUMNS))
    n_arcs = kernel.trace_arcs(machine.arc_arrays, path[0, 0], path[0, 1], count, arcs)
    return arcs[:n_arcs]


def linearise_arcs(machine: Machine, arcs: Array) -> Array:
    """Matrix (2, 2) that maps a change of time and speed of a departure over arcs."""
    matrix = np.empty((2, 2))
    kernel.linearise(machine.arc_arrays, arcs, len(arcs), matrix)
    return matrix


def history_of(machine: Machine, arcs: Array, instants: int = 40) -> Array:
    """Times in turns and relative rotations [rad] (n, 2) at instants of each arc."""
    history = np.empty((len(arcs) * instants, 2))
    kernel.sample_arcs(machine.arc_arrays, arcs, instants, history)
    return history


def margin_of(machine: Machine, arcs: Array) -> float:
    """Distance of arcs (a, 7) from another itinerary [rad]; negative if virtual.

    It is the least distance from bounds between the ends of arcs, or the speed at which
    they leave and meet bounds, over 2 pi, if that is less. It is zero in a graze.
    """
    if (arcs[:, kernel.END_TIME] <= arcs[:, kernel.START_TIME]).any():
        return -math.inf
    flights = arcs[arcs[:, kernel.ON_FLANK] == 0.0]
    leaving = -flights[:, kernel.START_SIDE] * flights[:, kernel.START_SPEED]
    meeting = flights[:, kernel.END_SIDE] * flights[:, kernel.END_SPEED]
    slowest = float(min(leaving.min(), meeting.min())) / TURN
    return min(slowest, float(kernel.min_clearance(machine.arc_arrays, arcs)))


@dataclass(frozen=True, eq=False)
class ArcSequence:
    """Sequence of arcs that make up a motion that repeats after `turns`.

    sides : (a,) side on which each arc starts, 1 or -1
    pressed : (a,) 1 for arcs on a flank
    """

    turns: int
    sides: Array
    pressed: Array

    @property
    def itinerary(self) -> Itinerary:
        flights = self.sides[self.pressed == 0.0]
        upper = int((flights > 0.0).sum())
        return Itinerary(self.turns, upper, len(flights) - upper)

    @property
    def doubled(self) -> ArcSequence:
        """Layout of two periods."""
        return ArcSequence(
            2 * self.turns, np.tile(self.sides, 2), np.tile(self.pressed, 2)
        )

    def join_residual(
        self, machine: Machine, starts: Array, closing_sign: float = 1.0
    ) -> tuple[Array, Array]:
        """Errors (2 a,) of places and speeds by which arcs with starts (2, a), times
        and speeds, fail to join, and their derivatives (2 a, 2 a) by the starts.

        closing_sign : -1 reverses changes after a period
        """
        count = 2 * self.sides.size
        errors, jacobian = np.empty(count), np.empty((count, count))
        kernel.join_residual(
            *(machine.arc_arrays, float(self.turns), self.sides, self.pressed),
            *(np.ascontiguousarray(starts), closing_sign, errors, jacobian),
        )
        return errors, jacobian

    def arcs(self, machine: Machine, starts: Array) -> Array:
        """Arcs (a, 7) with starts (2, a), in the form of `trace`."""
        times, speeds = starts
        arcs = np.empty((times.size, kernel.N_COLUMNS))
        arcs[:, kernel.START_TIME], arcs[:, kernel.START_SPEED] = starts
        arcs[:, kernel.END_TIME] = np.append(times[1:], times[0] + self.turns)
        impact_factor = -machine.restitution if machine.is_impact else 1.0
        arcs[:, kernel.END_SPEED] = np.roll(speeds, -1) / (impact_factor or math.nan)
        arcs[:, kernel.START_SIDE], arcs[:, kernel.END_SIDE] = (
            self.sides,
            np.roll(self.sides, -1),
        )
        arcs[:, kernel.ON_FLANK] = self.pressed
        return arcs


def layout_of(arcs: Array, turns: int) -> ArcSequence:
    """Layout of arcs (a, 7) that join into an orbit."""
    return ArcSequence(
        turns, arcs[:, kernel.START_SIDE].copy(), arcs[:, kernel.ON_FLANK].copy()
    )
