"""Closed-form rattle with one departure in some turns, section 2.4 of the source."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array
from lumped.rattle.arcs import ArcSequence, margin_of
from lumped.rattle.machine import TURN, Machine

INSTANTS_PER_TURN = 1000  # instants of a turn in the search for the lower impact
ONE_FLANK, BOTH_FLANKS = np.array([1.0]), np.array([1.0, -1.0])  # where arcs start


@dataclass(frozen=True)
class SimpleRattle:
    """P(m, 1, 0) or P(m, 1, 1): one departure from the upper flank in `turns`.

    time : time of the departure in turns
    velocity : speed of the departure [rad per turn]
    in_phase : whether the departure is closer to the largest transmission error than to
        the least
    lower : time from the departure to the impact on the lower flank, None if there is
        none
    margin : see `margin_of`; if negative, the motion passes through a flank
    """

    turns: int
    time: float
    velocity: float
    in_phase: bool
    lower: float | None
    margin: float

    @property
    def name(self) -> str:
        return f"P({self.turns},1,{int(self.lower is not None)})"

    @property
    def physical(self) -> bool:
        return self.margin > 0.0


def has_closed_form(machine: Machine) -> bool:
    """Whether flanks meet in impacts, without torque ripple."""
    return machine.is_impact and not machine.ripple


def min_eccentricity(machine: Machine, turns: int = 1) -> float:
    """Least eccentricity of P(m, 1, 0) [rad], eqs. 2.54 and 2.57 without series.

    With restitution r it is |2 - 2 delta m (1 + r e) / ((1 + r) (1 - e))|, e =
    e^(-delta m), where eq. 2.56 prints r + e; delta m coth(delta m / 2) - 2 if r = 1.
    """
    return abs(signed_balance(machine, turns))


def simple_rattle(machine: Machine, turns: int = 1) -> tuple[SimpleRattle, ...]:
    """Both motions P(m, 1, 0) in the impact limit, eq. 2.56, none if they do not exist.

    Raises ValueError for flanks with a stiffness or torque ripple.
    """
    _require_closed_form(machine, turns)
    sine = (
        signed_balance(machine, turns) / machine.eccentricity
        if machine.eccentricity
        else 2
    )
    if abs(sine) > 1.0:
        return ()
    r = machine.restitution
    # the departure has r times the impact speed; drag removes 4 pi m delta per cycle
    drift = 2.0 * TURN * machine.drive
    velocity = drift * turns * machine.damping * r / (1.0 + r)
    first = math.asin(sine) / TURN
    layout = ArcSequence(turns, ONE_FLANK, 0.0 * ONE_FLANK)
    motions = []
    for time in (first, 0.5 - first):
        starts = np.array([[time], [-velocity]])
        margin = margin_of(machine, layout.arcs(machine, starts))
        in_phase = time == first
        motions.append(
            SimpleRattle(turns, time % 1.0, velocity, in_phase, None, margin)
        )
    return motions[0], motions[1]


def two_sided_rattle(machine: Machine, turns: int = 1) -> tuple[SimpleRattle, ...]:
    """All motions P(m, 1, 1) in the impact limit, by the time of the lower impact.

    They solve eqs. 2.48 to 2.53 with any restitution. For a given time between both
    impacts, the arcs and hence the conditions are linear in cosine and sine of the
    departure. The times that yield the amplitude of the eccentricity are roots of one
    function. Raises ValueError for flanks with a stiffness or torque ripple.
    """
    _require_closed_form(machine, turns)
    construction = _TwoSided(machine, turns)
    return tuple(construction.motion(lower) for lower in _roots(construction))


def _require_closed_form(machine: Machine, turns: int) -> None:
    if not has_closed_form(machine):
        raise ValueError("impacts without torque ripple are needed")
    if turns < 1:
        raise ValueError(f"turns = {turns}; must be at least 1")


@dataclass(frozen=True)
class _TwoSided:
    """P(m, 1, 1) as a function of the time from its departure to the lower impact."""

    machine: Machine
    turns: int

    def conditions(self, lower: float) -> tuple[Array, Array, Array]:
        """Matrix (2, 2) and right side (2,) of the impacts' conditions, and speeds
        (2, 3) after both: for the transmission error's cosine and sine, and for 0."""
        delta, r = self.machine.damping, self.machine.restitution
        drift, play = 2.0 * TURN * self.machine.drive, self.machine.half_backlash
        c, s = math.cos(TURN * lower), math.sin(TURN * lower)
        times = lower, self.turns - lower
        decays = [math.exp(-delta * time) for time in times]
        # speeds minus drift and forced part at the start of the arcs, from their ends
        rise = np.array([c - 1.0, -s, 0.0])
        lengths = [
            np.array([0.0, 0.0, side * 2.0 * play - drift * time]) + side * rise
            for side, time in zip((-1.0, 1.0), times, strict=True)
        ]
        excess = [
            delta / -math.expm1(-delta * time) * length
            for time, length in zip(times, lengths, strict=True)
        ]
        rates = np.array([[0.0, -TURN, drift], [-TURN * s, -TURN * c, drift]])
        rows = np.array(
            [
                (1.0 + r) * rates[0] + excess[0] + r * decays[1] * excess[1],
                (1.0 + r) * rates[1] + excess[1] + r * decays[0] * excess[0],
            ]
        )
        return rows[:, :2], -rows[:, 2], rates + np.array(excess)

    def excess(self, lower: float) -> float:
        """Excess of the transmission error's amplitude over that of the machine."""
        matrix, right, _ = self.conditions(lower)
        (a, b), (c, d) = matrix
        wave = d * right[0] - b * right[1], a * right[1] - c * right[0]
        return math.hypot(*wave) - self.machine.eccentricity * abs(a * d - b * c)

    def motion(self, lower: float) -> SimpleRattle:
        matrix, right, speeds = self.conditions(lower)
        cosine, sine = np.linalg.solve(matrix, right)
        time = math.atan2(sine, cosine) / TURN
        after = speeds @ [cosine, sine, 1.0]
        starts = np.array([[time, time + lower], after])
        layout = ArcSequence(self.turns, BOTH_FLANKS, 0.0 * BOTH_FLANKS)
        margin = margin_of(self.machine, layout.arcs(self.machine, starts))
        velocity, in_phase = float(-after[0]), bool(cosine > 0.0)
        return SimpleRattle(self.turns, time % 1.0, velocity, in_phase, lower, margin)


def _roots(construction: _TwoSided) -> Iterator[float]:
    """Roots of the excess, including pairs that are close to each other."""
    from scipy.optimize import brentq, minimize_scalar

    count = INSTANTS_PER_TURN * construction.turns
    times = (np.arange(count) + 0.5) / INSTANTS_PER_TURN
    values = np.array([construction.excess(time) for time in times])
    for i in range(1, count - 1):
        low, here, high = values[i - 1 : i + 2]
        if here > 0.0 and here <= low and here < high:
            bounds = times[i - 1], times[i + 1]
            least = minimize_scalar(
                construction.excess, bounds=bounds, options={"xatol": 1e-14}
            )
            if least.fun < 0.0:
                for a, b in ((bounds[0], least.x), (least.x, bounds[1])):
                    yield float(brentq(construction.excess, a, b, xtol=1e-16))
    for i in np.flatnonzero(values[1:] * values[:-1] < 0.0).tolist():
        yield float(brentq(construction.excess, times[i], times[i + 1], xtol=1e-16))


def signed_balance(machine: Machine, turns: int = 1) -> float:
    """Eccentricity times the sine of the departure's time of P(m, 1, 0) [rad]."""
    r, loss = machine.restitution, machine.damping * turns
    decay = math.exp(-loss)
    slowed = loss * (1.0 + r * decay) / ((1.0 + r) * -math.expm1(-loss))
    return 2.0 * machine.drive * (1.0 - slowed)
