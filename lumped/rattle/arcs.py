"""Motions as arcs, in the play or on a flank, that join into an orbit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.rattle.departures import Itinerary
from lumped.rattle.kernels import arcs as kernel
from lumped.rattle.machine import TURN, Machine

Array = NDArray[np.float64]


def arcs_of(machine: Machine, path: Array) -> Array:
    """The arcs (a, 7) of a path, see `trace`; none where flanks stay together."""
    if not np.isfinite(path).all():
        return np.empty((0, kernel.COLUMNS))
    count = len(path) - 1
    arcs = np.empty((2 * (count + int(path[:-1, 2].sum())) + 1, kernel.COLUMNS))
    used = kernel.trace(machine.arc_arrays, path[0, 0], path[0, 1], count, arcs)
    return arcs[:used]


def linearised(machine: Machine, arcs: Array) -> Array:
    """What a change of time and speed of a departure becomes over arcs (2, 2)."""
    found = np.empty((2, 2))
    kernel.linearise(machine.arc_arrays, arcs, len(arcs), found)
    return found


def history_of(machine: Machine, arcs: Array, instants: int = 40) -> Array:
    """Times in turns and relative rotations [rad] (n, 2) at instants of every arc."""
    found = np.empty((len(arcs) * instants, 2))
    kernel.sample(machine.arc_arrays, arcs, instants, found)
    return found


def margin_of(machine: Machine, arcs: Array) -> float:
    """How far arcs (a, 7) are from another itinerary [rad]; negative if virtual.

    The least distance from bounds between their ends, or the speed at which they
    leave and meet bounds, over 2 pi, where that is less: in a graze it is zero.
    """
    if (arcs[:, kernel.END] <= arcs[:, kernel.START]).any():
        return -math.inf
    flights = arcs[arcs[:, kernel.PRESSED] == 0.0]
    leaving = -flights[:, kernel.SIDE] * flights[:, kernel.SPEED]
    meeting = flights[:, kernel.NEXT] * flights[:, kernel.LAST]
    slowest = float(min(leaving.min(), meeting.min())) / TURN
    return min(slowest, float(kernel.least_clearance(machine.arc_arrays, arcs)))


@dataclass(frozen=True, eq=False)
class Layout:
    """Which arcs make a motion that repeats after `turns`.

    sides : where each arc starts (a,), 1 or -1; pressed : 1 of arcs on a flank (a,)
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
    def doubled(self) -> Layout:
        """Layout of two periods."""
        return Layout(2 * self.turns, np.tile(self.sides, 2), np.tile(self.pressed, 2))

    def join(
        self, machine: Machine, starts: Array, closing: float = 1.0
    ) -> tuple[Array, Array]:
        """How far arcs with starts (2, a), times and speeds, miss to join: errors of
        places and speeds (2 a,), and by times and speeds (2 a, 2 a).

        closing : -1 turns changes round after a period
        """
        count = 2 * self.sides.size
        errors, by_x = np.empty(count), np.empty((count, count))
        kernel.join(
            *(machine.arc_arrays, float(self.turns), self.sides, self.pressed),
            *(np.ascontiguousarray(starts), closing, errors, by_x),
        )
        return errors, by_x

    def arcs(self, machine: Machine, starts: Array) -> Array:
        """Arcs (a, 7) with starts (2, a), as of `trace`."""
        times, speeds = starts
        arcs = np.empty((times.size, kernel.COLUMNS))
        arcs[:, kernel.START], arcs[:, kernel.SPEED] = starts
        arcs[:, kernel.END] = np.append(times[1:], times[0] + self.turns)
        before = -machine.restitution if machine.is_impact else 1.0
        arcs[:, kernel.LAST] = np.roll(speeds, -1) / (before or math.nan)
        arcs[:, kernel.SIDE], arcs[:, kernel.NEXT] = self.sides, np.roll(self.sides, -1)
        arcs[:, kernel.PRESSED] = self.pressed
        return arcs


def layout_of(arcs: Array, turns: int) -> Layout:
    """Layout of arcs (a, 7) that join into an orbit."""
    return Layout(turns, arcs[:, kernel.SIDE].copy(), arcs[:, kernel.PRESSED].copy())
