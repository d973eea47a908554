"""Rattle of one impact in some turns, in closed form; section 2.4 of the source."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lumped.rattle.machine import TURN, Machine


@dataclass(frozen=True)
class SimpleRattle:
    """P(m, 1, 0): departures from the upper flank once in `turns`.

    time : of a departure in turns; velocity : of it [rad per turn]
    in_phase : of the two solutions the one near the largest transmission error
    """

    turns: int
    time: float
    velocity: float
    in_phase: bool


def has_closed_form(machine: Machine) -> bool:
    """Whether flanks meet in impacts, without torque ripple."""
    return machine.is_impact and not machine.ripple


def least_eccentricity(machine: Machine, turns: int = 1) -> float:
    """Below which P(m, 1, 0) does not exist [rad]; eqs. 2.54 and 2.57 without series.

    With restitution r it is |2 - 2 delta m (1 + r e) / ((1 + r) (1 - e))|, e =
    e^(-delta m), where eq. 2.56 prints r + e; delta m coth(delta m / 2) - 2 if r = 1.
    """
    return abs(_balance(machine, turns))


def simple_rattle(machine: Machine, turns: int = 1) -> tuple[SimpleRattle, ...]:
    """Both motions P(m, 1, 0) in the impact limit, none where they do not exist.

    Whether they meet the lower flank on the way is not looked at. Eq. 2.56.
    Raises ValueError for flanks with a stiffness or torque ripple.
    """
    if not has_closed_form(machine):
        raise ValueError("impacts without torque ripple are needed")
    if turns < 1:
        raise ValueError(f"turns must be at least 1, got {turns}")
    sine = (
        _balance(machine, turns) / machine.eccentricity if machine.eccentricity else 2
    )
    if abs(sine) > 1.0:
        return ()
    r = machine.restitution
    # it leaves at r times the speed at which it came; drag takes 4 pi m delta a cycle
    velocity = 2.0 * TURN * turns * machine.damping * r / (1.0 + r)
    first = math.asin(sine) / TURN
    return (
        SimpleRattle(turns, first % 1.0, velocity, True),
        SimpleRattle(turns, (0.5 - first) % 1.0, velocity, False),
    )


def _balance(machine: Machine, turns: int) -> float:
    """Eccentricity times the sine of the departure's time."""
    r, loss = machine.restitution, machine.damping * turns
    fade = math.exp(-loss)
    return 2.0 - 2.0 * loss * (1.0 + r * fade) / ((1.0 + r) * -math.expm1(-loss))
