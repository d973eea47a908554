"""P(m, 1, 0) of machines in parts: the response to one impulse in m turns.

The impulse that the flanks exchange at an impact balances that of the drag of the
driven shaft in m turns. The response to it is periodic, linear and independent of the
eccentricity; the response to the transmission error is added to it and determines the
time of the impact. For unequal shafts this is the construction of section 4.3.2 of the
source, eq. 4.84.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array
from lumped.rattle.machine import TURN
from lumped.rattle.motions import AssemblyIntegrator


@dataclass(frozen=True)
class ImpulseRattle:
    """Motion with one impact on the upper flank in `turns`, in the impact limit.

    min_eccentricity : eccentricity below which the motion does not exist [rad]
    velocity : speed of departures [rad per turn]
    balance : eccentricity times the sine of a departure's time [rad]
    departure : state (2 n,) after an impact, before sides are turned to their flanks

    It is not checked whether the motion meets a flank between impacts.
    """

    motions: AssemblyIntegrator
    turns: int
    velocity: float
    balance: float
    departure: Array

    @property
    def min_eccentricity(self) -> float:
        return abs(self.balance)

    @property
    def times(self) -> tuple[float, ...]:
        """Departure times of both motions in turns, none if they do not exist."""
        eccentricity = self.motions.assembly.machine.eccentricity
        if not eccentricity > self.min_eccentricity:
            return ()
        first = math.asin(self.balance / eccentricity) / TURN
        return first % 1.0, (0.5 - first) % 1.0

    def state(self, time: float) -> Array:
        """State (2 n,) of all parts at a departure from the upper flank."""
        machine, n = self.motions.assembly.machine, self.departure.size // 2
        error = machine.eccentricity * math.cos(TURN * time)
        off = self.motions.linear.row @ self.departure[:n] + error
        names = self.motions.linear.names
        driving = np.array([name.startswith("driving") for name in names])
        state = self.departure.copy()
        state[:n] += driving * (machine.half_backlash - off)
        return state


def impulse_rattle(motions: AssemblyIntegrator, turns: int = 1) -> ImpulseRattle:
    """Motion of an assembly; ValueError if flanks have a stiffness, or for ripple."""
    machine = motions.assembly.machine
    if not machine.is_impact or machine.ripple:
        raise ValueError("impacts without torque ripple are needed")
    if turns < 1:
        raise ValueError(f"turns = {turns}; must be at least 1")
    linear, play = motions.linear, motions.system.regimes[1]
    n, r = len(linear.names), machine.restitution
    decay = (play.vectors * np.exp(play.rates * turns)) @ play.inverse
    jump = np.concatenate([np.zeros(n), np.linalg.solve(linear.mass, linear.row)])
    # departure relative to the offset, and the impulse: both sides may rotate freely
    matrix = np.column_stack([decay.real - np.eye(2 * n), -jump])
    solution, *_ = np.linalg.lstsq(matrix, -turns * play.drift, rcond=1e-13)
    departure = play.offset + solution[:-1]
    arrival = departure + solution[-1] * jump
    leaving, meeting = linear.row @ departure[n:], linear.row @ arrival[n:]
    return ImpulseRattle(
        motions,
        turns,
        velocity=float(r * (meeting - leaving) / (1.0 + r)),
        balance=float((leaving + r * meeting) / (1.0 + r) / TURN),
        departure=departure,
    )
