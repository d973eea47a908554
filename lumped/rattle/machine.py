"""Machine that may rattle, in dimensionless parameters (table 2.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lumped.common.checks import format_number
from lumped.rattle.kernels.records import (
    MAX_DECAYING_FLIGHT,
    MAX_LOAD_CHANGE,
    Rattle,
    Waves,
)

TURN = 2.0 * math.pi
INSTANTS_PER_TURN = 4096  # instants of a turn at which the forcing is evaluated


def effective_eccentricity(driving: float, driven: float, phase: float) -> float:
    """Effective eccentricity of two gears with long sides `phase` apart [rad], eq. 2.9.

    It is zero for equal eccentricities in phase.
    """
    square = driving**2 + driven**2 - 2.0 * driving * driven * math.cos(phase)
    return math.sqrt(max(square, 0.0))


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Two equal shafts, geared one to one, with relative rotation x [rad].

    x'' + delta x' + 2 kappa B(x) = 4 pi delta d - 4 pi^2 eps cos 2 pi t
        - 2 pi delta eps sin 2 pi t + gamma cos(2 pi n t + xi),    eqs. 2.23, 2.26

    with time t in turns and B(x) = x - beta, 0, x + beta above, in and below the play.

    damping : delta, damping of a shaft over its inertia and speed
    eccentricity : eps, amplitude of the transmission error [rad]
    half_backlash : beta [rad]
    stiffness : kappa, stiffness of the flanks; infinite in the impact limit
    restitution : coefficient of restitution of impacts, in the impact limit
    ripple, ripple_order, ripple_phase : gamma [rad], n and xi [rad] of the torque
    drive : d, for shafts that are unequal but decelerate at the same rate
    """

    damping: float
    eccentricity: float
    half_backlash: float
    stiffness: float = math.inf
    restitution: float = 1.0
    ripple: float = 0.0
    ripple_order: int = 1
    ripple_phase: float = 0.0
    drive: float = 1.0

    def __post_init__(self) -> None:
        least, play = self.damping**2 / 8.0, self.half_backlash
        for name, allowed, good in (
            ("damping", "above 0 and finite", 0.0 < self.damping < math.inf),
            ("eccentricity", "0 or more", 0.0 <= self.eccentricity < math.inf),
            ("half_backlash", "above 0 and finite", 0.0 < play < math.inf),
            (
                "stiffness",
                f"above {format_number(least)}, damping^2 / 8",
                self.stiffness > least,
            ),
            ("restitution", "from 0 to 1", 0.0 <= self.restitution <= 1.0),
            ("ripple", "finite", math.isfinite(self.ripple)),
            ("ripple_order", "1 or more", self.ripple_order >= 1),
            ("ripple_phase", "finite", math.isfinite(self.ripple_phase)),
            ("drive", "above 0 and finite", 0.0 < self.drive < math.inf),
        ):
            if not good:
                raise ValueError(
                    f"{name} = {format_number(getattr(self, name))}; must be {allowed}"
                )

    @property
    def is_impact(self) -> bool:
        """Whether flanks meet in impacts, without a stiffness."""
        return self.stiffness == math.inf

    @property
    def speed(self) -> float:
        """Speed of departures of P(1,1,0) without losses in impacts [rad per turn]."""
        return TURN * self.damping * self.drive

    @property
    def fastest(self) -> float:
        """Speed above which damping exceeds all forcing [rad per turn].

        No periodic motion with impacts is faster.
        """
        steady = 2.0 * TURN * self.drive
        return steady + sum(map(abs, self.loads)) / self.damping

    @property
    def loads(self) -> tuple[complex, complex]:
        """Amplitudes of e^(i w t) in the forcing, once per turn and at `ripple_order`.

        The first follows from -4 pi^2 eps cos - 2 pi delta eps sin, which is the real
        part of eps (-4 pi^2 + 2 pi i delta) e^(2 pi i t).
        """
        turn = self.eccentricity * (-(TURN**2) + 1j * TURN * self.damping)
        return turn, self.ripple * np.exp(1j * self.ripple_phase)

    def forced(self, stiffness: float) -> tuple[complex, complex]:
        """Amplitudes of the motion that the forcing drives against a stiffness."""
        rates = TURN, TURN * self.ripple_order
        first, second = (
            load / (stiffness - rate**2 + 1j * self.damping * rate)
            for load, rate in zip(self.loads, rates, strict=True)
        )
        return first, second

    @cached_property
    def arrays(self) -> Rattle:
        """Parameters in the form that the kernels take."""
        return self.arc_arrays._replace(decaying_flight=self._short())

    @cached_property
    def arc_arrays(self) -> Rattle:
        """Parameters for kernels of single arcs, which need no decaying flights."""
        stiffness = 2.0 * self.stiffness
        drift = 2.0 * TURN * self.drive
        free = self.forced(0.0)
        pressed = (0j, 0j) if self.is_impact else self.forced(stiffness)
        return Rattle(
            damping=self.damping,
            play=self.half_backlash,
            stiffness=stiffness,
            restitution=self.restitution,
            drift=drift,
            offset=drift * self.damping / stiffness,
            order=float(self.ripple_order),
            free=_cosines_and_sines(free),
            pressed=_cosines_and_sines(pressed),
            max_pressed=self._largest(pressed, 0),
            free_jerk=self._largest(free, 3),
            pressed_jerk=self._largest(pressed, 3),
            free_snap=self._largest(free, 4),
            inverse_damping=1.0 / self.damping,
            max_step=1.0 / self.damping,
            decaying_flight=0.0,
            growth=1.0,
        )

    @cached_property
    def backward(self) -> Rattle:
        """Parameters for reversed time: damping drives, impacts gain speed, and sines
        change their sign."""
        m = self.arrays
        loss = m.restitution
        return m._replace(
            damping=-m.damping,
            drift=-m.drift,
            restitution=1.0 / loss if loss else math.inf,
            free=(m.free[0], -m.free[1], m.free[2], -m.free[3]),
            pressed=(m.pressed[0], -m.pressed[1], m.pressed[2], -m.pressed[3]),
            inverse_damping=-m.inverse_damping,
            decaying_flight=0.0,
            growth=math.e,  # over the longest step
        )

    def _short(self) -> float:
        """Duration in turns below which flights decay to rest, 0 if they never do.

        Under a load g that changes little in a flight, its duration is proportional to
        g^(-2/3) and decreases with the damping (adiabatic invariance): a flight that is
        short enough stays so over a turn. Flanks that g opens do not come to rest.
        """
        t = np.arange(INSTANTS_PER_TURN) / INSTANTS_PER_TURN
        drive = 2.0 * TURN * self.damping * self.drive
        waves, factor = self.loads, 1.0
        if not self.is_impact:
            factor = 2.0 * self.stiffness
            waves = self.forced(factor)
        load, slope = np.full(INSTANTS_PER_TURN, drive), np.zeros(INSTANTS_PER_TURN)
        for wave, order in zip(waves, (1, self.ripple_order), strict=True):
            turning = factor * wave * np.exp(1j * TURN * order * t)
            load += turning.real
            slope += (1j * TURN * order * turning).real
        if load.min() <= 0.0:
            return 0.0
        fastest = float(np.max(np.abs(slope) / load))
        longest = (
            min(MAX_DECAYING_FLIGHT, MAX_LOAD_CHANGE / fastest)
            if fastest
            else MAX_DECAYING_FLIGHT
        )
        return longest * float(load.min() / load.max()) ** (2.0 / 3.0)

    def _largest(self, waves: tuple[complex, complex], order: int) -> float:
        """Upper bound of a time derivative of the forced motion."""
        first, second = map(abs, waves)
        return float(TURN**order * (first + self.ripple_order**order * second))


def _cosines_and_sines(waves: tuple[complex, complex]) -> Waves:
    """Cosine and sine amplitudes of both waves."""
    first, second = map(complex, waves)
    return first.real, -first.imag, second.real, -second.imag
