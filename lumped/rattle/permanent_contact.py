"""Quiet motion: flanks that never separate, and the eccentricity that ends it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from lumped.rattle.assembly import Assembly
from lumped.rattle.machine import TURN

# Instants in each cycle of the fastest forcing to check flanks at
INSTANTS_PER_CYCLE = 256


@dataclass(frozen=True)
class PermanentContact:
    """Permanent contact of an assembly, whatever the sign of its tooth load.

    The fields are amplitudes (n + 1,) of e^(i w t) in the parts' rotations and the
    tooth load, once per turn per unit eccentricity and at `ripple_order`, and their
    means.
    """

    assembly: Assembly
    names: tuple[str, ...]
    mean: NDArray[np.float64]
    turn: NDArray[np.complex128]
    ripple: NDArray[np.complex128]

    @property
    def contact_margin(self) -> float:
        """Least tooth load over a turn, over its mean; negative if flanks separate."""
        eccentricity = self.assembly.machine.eccentricity

        def load(t: NDArray[np.float64]) -> NDArray[np.float64]:
            return self._wave(t, eccentricity * self.turn[-1], self.ripple[-1])

        return 1.0 + self._least(load) / float(self.mean[-1])

    @property
    def critical_eccentricity(self) -> float:
        """Eccentricity above which flanks separate [rad]; 0 if they always do."""
        return 0.0 if self.window is None else self.window[1]

    @cached_property
    def window(self) -> tuple[float, float] | None:
        """Eccentricities between which flanks stay together [rad], or None.

        The lower one is positive if a ripple of one cycle per turn alone separates the
        flanks and the eccentricity counteracts it. A faster ripple separates them at
        instants that are spread evenly over the turn: the eccentricity adds load at one
        of them and removes it at another.
        """
        if self.assembly.machine.ripple_order == 1:
            return self._window_at_a_turn()
        mean = float(self.mean[-1])

        def ripple_load(t: NDArray[np.float64]) -> NDArray[np.float64]:
            return mean + self._wave(t, 0.0, self.ripple[-1])

        def relative_change(t: NDArray[np.float64]) -> NDArray[np.float64]:
            return self._wave(t, self.turn[-1], 0.0) / ripple_load(t)

        # load per unit eccentricity over the load present: at most 1 / eccentricity
        return (
            (0.0, -1.0 / self._least(relative_change))
            if self._least(ripple_load) > 0.0
            else None
        )

    def _window_at_a_turn(self) -> tuple[float, float] | None:
        """Interval in which |eccentricity turn + ripple| is below the mean load."""
        turn, ripple = complex(self.turn[-1]), complex(self.ripple[-1])
        square = abs(turn) ** 2
        middle = -(turn.conjugate() * ripple).real / square
        product = (abs(ripple) ** 2 - float(self.mean[-1]) ** 2) / square
        wide = middle**2 - product
        if wide <= 0.0 or (middle <= 0.0 and product >= 0.0):
            return None
        half = math.sqrt(wide)
        highest = middle + half if middle > 0.0 else -product / (half - middle)
        return max(product / highest, 0.0), highest

    def largest_rotation(
        self, one: str, other: str | None = None, with_error: bool = False
    ) -> float:
        """Largest rotation of a part, or difference of two, under all loads [rad].

        with_error : whether to add the transmission error
        """
        row = np.zeros(len(self.names))
        row[self.names.index(one)] += 1.0
        if other is not None:
            row[self.names.index(other)] -= 1.0
        mean = float(row @ self.mean[:-1])
        per_unit = complex(row @ self.turn[:-1]) + (1.0 if with_error else 0.0)
        turn = self.assembly.machine.eccentricity * per_unit
        ripple = complex(row @ self.ripple[:-1])
        return -self._least(lambda t: -np.abs(mean + self._wave(t, turn, ripple)))

    def _wave(
        self, t: NDArray[np.float64], turn: complex, ripple: complex
    ) -> NDArray[np.float64]:
        rate = TURN * self.assembly.machine.ripple_order
        phasor = turn * np.exp(1j * TURN * t) + ripple * np.exp(1j * rate * t)
        return np.asarray(phasor.real)

    def _least(
        self, of_time: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    ) -> float:
        count = INSTANTS_PER_CYCLE * self.assembly.machine.ripple_order
        t = np.arange(count) / count
        values = of_time(t)
        at, spacing = t[int(np.argmin(values))], 1.0 / count
        minimum = minimize_scalar(
            lambda t: float(of_time(np.array(t))),
            bounds=(at - spacing, at + spacing),
            method="bounded",
            options={"xatol": 1e-6 * spacing},
        )
        return min(float(minimum.fun), float(values.min()))


def quiet_motion(assembly: Assembly) -> PermanentContact:
    """Motion in permanent contact to which all others in contact converge."""
    linear, machine = assembly.linear(), assembly.machine
    no_force = np.zeros(linear.row.size)
    return PermanentContact(
        *(assembly, linear.names),
        mean=linear.respond(0.0, linear.mean).real,
        turn=linear.respond(TURN, no_force, 1.0),
        ripple=linear.respond(TURN * machine.ripple_order, linear.ripple),
    )
