"""P(m, 1, 0) of machines in parts: the response to one impulse in some turns.

What flanks give each other at an impact is what the drag of the driven shaft takes in m
turns. The response to it repeats, is linear, and knows no eccentricity; that of the
transmission error comes on top, and sets the time of the impact. For unequal shafts it
is the construction of section 4.3.2 of the source, eq. 4.84.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.rattle.machine import TURN
from lumped.rattle.motions import Motions

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ImpulseRattle:
    """One impact on the upper flank in `turns`, in the impact limit.

    least_eccentricity : below which it does not exist [rad]
    velocity : of departures [rad per turn]
    balance : eccentricity times the sine of a departure's time [rad]
    departure : state (2 n,) after an impact, before sides are turned to their flanks

    Whether it meets a flank on the way is not looked at.
    """

    motions: Motions
    turns: int
    velocity: float
    balance: float
    departure: Array

    @property
    def least_eccentricity(self) -> float:
        return abs(self.balance)

    @property
    def times(self) -> tuple[float, ...]:
        """Times of the departures of both motions in turns; empty where they do not
        exist.
        """
        eccentricity = self.motions.assembly.machine.eccentricity
        if not eccentricity > self.least_eccentricity:
            return ()
        first = math.asin(self.balance / eccentricity) / TURN
        return first % 1.0, (0.5 - first) % 1.0

    def state(self, time: float) -> Array:
        """State of all parts (2 n,) at a departure from the upper flank."""
        machine, n = self.motions.assembly.machine, self.departure.size // 2
        error = machine.eccentricity * math.cos(TURN * time)
        off = self.motions.linear.row @ self.departure[:n] + error
        names = self.motions.linear.names
        driving = np.array([name.startswith("driving") for name in names])
        state = self.departure.copy()
        state[:n] += driving * (machine.half_backlash - off)
        return state


def impulse_rattle(motions: Motions, turns: int = 1) -> ImpulseRattle:
    """The motion of an assembly; ValueError for a stiffness of flanks, or ripple."""
    machine = motions.assembly.machine
    if not machine.is_impact or machine.ripple:
        raise ValueError("impacts without torque ripple are needed")
    if turns < 1:
        raise ValueError(f"turns must be at least 1, got {turns}")
    linear, play = motions.linear, motions.system.regimes[1]
    n, r = len(linear.names), machine.restitution
    fade = (play.vectors * np.exp(play.rates * turns)) @ play.inverse
    jump = np.concatenate([np.zeros(n), np.linalg.solve(linear.mass, linear.row)])
    # departure beside the offset, and the impulse: both sides may turn as they like
    matrix = np.column_stack([fade.real - np.eye(2 * n), -jump])
    found, *_ = np.linalg.lstsq(matrix, -turns * play.drift, rcond=1e-13)
    departure = play.offset + found[:-1]
    arrival = departure + found[-1] * jump
    leaving, meeting = linear.row @ departure[n:], linear.row @ arrival[n:]
    return ImpulseRattle(
        motions,
        turns,
        velocity=float(r * (meeting - leaving) / (1.0 + r)),
        balance=float((leaving + r * meeting) / (1.0 + r) / TURN),
        departure=departure,
    )
