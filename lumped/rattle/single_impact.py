"""Conditions of P(1, 1, 0), one impact a turn, with rigid flanks.

The impact must balance the drag of a turn, which determines b = eps sin 2 pi t1 of the
departure t1, and the flight must stay between the flanks. At tau turns after its
departure the gap to the driving flank is, with c = eps cos 2 pi t1,

    -h(tau) + c (1 - cos 2 pi tau) + b sin 2 pi tau,    from eqs. 2.23 and 2.56,

where h is the motion of the shafts without eccentricity. Both flanks therefore limit c
from one side each, and eps^2 = b^2 + c^2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from lumped.common.array_types import Array
from lumped.rattle.impulses import impulse_rattle
from lumped.rattle.machine import TURN, Machine
from lumped.rattle.motions import AssemblyIntegrator
from lumped.rattle.periodic_orbits import min_eccentricity, signed_balance

Function = Callable[[Array], Array]

INSTANTS = 1000  # of a turn, in the search for extremes of a flight


@dataclass(frozen=True)
class Flight:
    """Flight of P(1, 1, 0) at the eccentricity of a machine.

    in_phase : whether the departure is closer to the largest transmission error than to
        the least
    height : largest gap to the driving flank [rad]
    meets : flank that it would pass through, "back" or "driving", None if none
    """

    in_phase: bool
    height: float
    meets: str | None


@dataclass(frozen=True)
class SingleImpact:
    """Conditions of P(1, 1, 0), and its flights.

    orbit_from : eccentricity from which impacts balance the drag [rad]
    window : eccentricities between which a flight stays between the flanks [rad], None
        if there are none
    least_play : play from which there is a window [rad], None if there is none
    play : of the machine, twice its half backlash [rad]
    flights : at the eccentricity of the machine, none below `orbit_from`
    """

    orbit_from: float
    window: tuple[float, float] | None
    least_play: float | None
    play: float
    flights: tuple[Flight, ...]


def single_impact(machine: Machine) -> SingleImpact:
    """Conditions for equal shafts, whose flanks are rigid and without torque ripple."""
    rate, drift = machine.damping, 2.0 * TURN * machine.drive
    return _conditions(
        machine,
        lambda t: drift * (t - np.expm1(-rate * t) / math.expm1(-rate)),
        signed_balance(machine),
        min_eccentricity(machine),
    )


def single_impact_of_parts(motions: AssemblyIntegrator) -> SingleImpact:
    """Conditions for an assembly; ValueError for soft flanks or torque ripple."""
    rattle, play = impulse_rattle(motions), motions.system.regimes[1]
    n, row = len(motions.linear.names), motions.linear.row
    shapes = row @ play.vectors[:n]
    weights = shapes * (play.inverse @ (rattle.departure - play.offset))
    drift = row @ play.drift[:n]

    def flight(t: Array) -> Array:
        changes = np.expm1(np.multiply.outer(t, play.rates)) @ weights
        return np.asarray(changes.real + drift * t)

    machine = motions.assembly.machine
    return _conditions(machine, flight, rattle.balance, rattle.min_eccentricity)


def _conditions(
    machine: Machine, free: Function, balance: float, orbit_from: float
) -> SingleImpact:
    play = 2.0 * machine.half_backlash
    flights = _Flights(free, balance)
    lowest = flights.lowest() if machine.restitution else math.inf
    highest = flights.highest(play)
    window = None
    if lowest < highest:
        least = 0.0 if lowest < 0.0 < highest else min(abs(lowest), abs(highest))
        most = max(abs(lowest), abs(highest))
        window = math.hypot(balance, least), math.hypot(balance, most)
    square = machine.eccentricity**2 - orbit_from**2
    cosines = (-math.sqrt(square), math.sqrt(square)) if square >= 0.0 else ()
    return SingleImpact(
        orbit_from=orbit_from,
        window=window,
        least_play=flights.height(lowest) if machine.restitution else None,
        play=play,
        flights=tuple(
            Flight(
                in_phase=c > 0.0,
                height=flights.height(c),
                meets=("driving" if c <= lowest else "back" if c >= highest else None),
            )
            for c in cosines
        ),
    )


@dataclass(frozen=True)
class _Flights:
    """Flights of a turn over c, eccentricity times the cosine of the departure."""

    free: Function
    balance: float

    def gap(self, t: Array, c: float) -> Array:
        """Gap to the driving flank [rad] at times t [turns] after the departure."""
        wave = c * _versed(t) + self.balance * np.sin(TURN * t)
        return np.asarray(wave - self.free(t))

    def lowest(self) -> float:
        """The c above which the flight stays off the driving flank."""
        return _largest(lambda t: -self.gap(t, 0.0) / _versed(t))

    def highest(self, play: float) -> float:
        """The c below which the flight stays off the back flank."""
        return -_largest(lambda t: (self.gap(t, 0.0) - play) / _versed(t))

    def height(self, c: float) -> float:
        """Largest gap to the driving flank [rad]."""
        return _largest(lambda t: self.gap(t, c))


def _versed(t: Array) -> Array:
    """1 - cos 2 pi t."""
    return np.asarray(2.0 * np.sin(0.5 * TURN * t) ** 2)


def _largest(function: Function) -> float:
    """Largest value between the ends of a turn."""
    times = (np.arange(INSTANTS) + 0.5) / INSTANTS
    best = times[function(times).argmax()]
    bounds = max(best - 1.0 / INSTANTS, times[0]), min(best + 1.0 / INSTANTS, times[-1])
    optimum = minimize_scalar(
        lambda t: -float(function(t)), bounds=bounds, options={"xatol": 1e-12}
    )
    return max(-float(optimum.fun), float(function(best)))
