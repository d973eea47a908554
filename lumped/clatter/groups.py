"""Wheels that depend on each other, in the form that the compiled kernels take."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.clatter.gearbox import (
    TEETH,
    Excitation,
    Freedom,
    LooseWheel,
    SpeedSignal,
    Variation,
)
from lumped.clatter.kernels.group_arrays import GroupArrays
from lumped.common.array_types import Array
from lumped.rattle.kernels.flight import EVENT_TOL

# Multiple of the round-off of a position below which gaps are closed
CLOSED_GAP_RATIO = 64.0
# Contacts rest below this multiple of the speed of a fall through it
RESTING_SPEED_RATIO = 4.0
UNREACHABLE_DISTANCE = 1e3  # distance in plays of an edge that is never reached
# Largest rate times a step in sustained contact, for `contact.N_TERMS` of a series
MAX_SERIES_STEP = 0.5


@dataclass(frozen=True, eq=False)
class WheelGroup:
    """Wheels that depend on each other, in the form that the kernels take.

    plays : wheel and name of each play, in the order of the coordinates
    """

    wheels: tuple[LooseWheel, ...]
    excitation: Excitation
    tolerance: float = EVENT_TOL

    @cached_property
    def plays(self) -> list[tuple[LooseWheel, str]]:
        return [(wheel, name) for wheel in self.wheels for name in wheel.freedoms]

    @property
    def freedoms(self) -> list[Freedom]:
        return [wheel.freedoms[name] for wheel, name in self.plays]

    @property
    def masses(self) -> Array:
        """Masses of the coordinates [kg m2 or kg]."""
        return np.array([w.inertia if n == TEETH else w.mass for w, n in self.plays])

    @cached_property
    def rows(self) -> Array:
        """Rows (p, p) of the plays by coordinate, s = ratio e(t) + row q."""
        starts = np.cumsum([0, *(len(w.freedoms) for w in self.wheels)])
        spans = {
            w.name: slice(first, last)
            for w, (first, last) in zip(self.wheels, pairwise(starts), strict=True)
        }
        by_name = {wheel.name: wheel for wheel in self.wheels}
        rows = np.eye(len(self.plays))
        for number, (wheel, name) in enumerate(self.plays):
            if name != TEETH:
                continue
            rows[number, spans[wheel.name]] = -wheel.direction(wheel.helix_angle)
            if wheel.driver is not None:
                driver, angle = by_name[wheel.driver], wheel.helix_angle
                rows[number, spans[wheel.driver]] = driver.direction(angle, wheel.ratio)
        return rows

    @cached_property
    def ratios(self) -> Array:
        """Ratios (p,) of the excitation, by play."""
        driven = [n == TEETH and w.driver is None for w, n in self.plays]
        return np.where(driven, [wheel.ratio for wheel, _ in self.plays], 0.0)

    @property
    def variations(self) -> list[Variation | None]:
        return [w.variation if n == TEETH else None for w, n in self.plays]

    def widths(self, times: Array) -> Array:
        """Widths (t, p) of the plays at times [s]."""
        turns = 2.0 * math.pi * np.asarray(times) / self.excitation.period
        width = np.tile([freedom.play for freedom in self.freedoms], (turns.size, 1))
        for number, variation in enumerate(self.variations):
            if variation is not None:
                width[:, number] += variation.at(turns)
        return width

    @cached_property
    def box(self) -> GroupArrays:
        freedoms, period, masses = self.freedoms, self.excitation.period, self.masses
        varying = [variation is not None for variation in self.variations]
        # a play whose width varies counts as two: its upper edge and its lower one
        number = np.repeat(np.arange(len(freedoms)), np.where(varying, 2, 1))
        lower = np.append(False, number[1:] == number[:-1])
        upper = np.append(lower[1:], False)
        own_order, own_cosine, own_sine = _own_waves(self, number, lower)
        own_turn = 2.0 * math.pi * own_order
        own_size = np.hypot(own_cosine, own_sine)
        teeth = np.array([name == TEETH for _, name in self.plays])[number]
        play = np.array([freedom.play for freedom in freedoms])[number]
        orders, cosines, sines, pieces = _waves(self.excitation)
        jerk, snap = _largest_derivatives(orders, cosines, sines, pieces)
        ratios = self.ratios[number]
        damping_rate = (
            np.array([freedom.damping for freedom in freedoms]) / masses * period
        )
        fastest = 2.0 * math.pi * max([*orders, *own_order, 0.0])
        fastest = max(fastest, damping_rate.max())
        restitution = np.array([freedom.restitution for freedom in freedoms])
        closed_gap = (
            CLOSED_GAP_RATIO * float(np.finfo(float).eps) * _largest_displacement(self)
        )
        return GroupArrays(
            drag_acceleration=np.array([freedom.drag for freedom in freedoms])
            / masses
            * period**2,
            damping_rate=damping_rate,
            inverse_mass=1.0 / masses,
            rows=self.rows[number],
            ratios=ratios,
            low=np.where(upper, -UNREACHABLE_DISTANCE, -1.0) * play,
            high=np.where(lower, UNREACHABLE_DISTANCE, 0.0) * play,
            restitution=restitution[number],
            closed_gap=closed_gap,
            own_order=own_order,
            own_cosine=own_cosine,
            own_sine=own_sine,
            wall=np.where(teeth, -1, number),
            roundoff_coordinate=number,
            orders=orders,
            cosines=cosines,
            sines=sines,
            pieces=pieces,
            jerk=np.abs(ratios) * jerk + own_size * own_turn**3,
            snap=np.abs(ratios) * snap + own_size * own_turn**4,
            resting_speed=_resting_speed(
                self, float(np.max(own_size * own_turn**2)), closed_gap
            ),
            max_impacts=_max_impacts(restitution),
            tolerance=self.tolerance,
            max_held_step=MAX_SERIES_STEP / fastest if fastest > 0.0 else math.inf,
        )


def _own_waves(
    group: WheelGroup, number: NDArray[np.intp], lower: NDArray[np.bool_]
) -> tuple[Array, Array, Array]:
    """Orders, cosines and sines of the waves of lower edges, by play."""
    waves, variations = np.zeros((3, number.size)), group.variations
    for k in np.flatnonzero(lower):
        variation = variations[number[k]]
        if variation is not None:
            cosine, sine = math.sin(variation.phase), math.cos(variation.phase)
            amplitude = variation.amplitude
            waves[:, k] = variation.order, amplitude * cosine, amplitude * sine
    return waves[0], waves[1], waves[2]


def _largest_displacement(group: WheelGroup) -> float:
    """Largest displacement of teeth [m]; the plays of a row of wheels add up."""
    times = np.linspace(0.0, group.excitation.period, 1001)
    e = float(np.abs(group.excitation.at(times)).max())
    largest: dict[str, float] = {}
    for wheel in group.wheels:
        displacement = abs(wheel.ratio) * e
        if wheel.driver is not None:  # its shifts count in full
            displacement = max(abs(wheel.ratio), 1.0) * largest[wheel.driver]
        amplitude = wheel.variation.amplitude if wheel.variation is not None else 0.0
        plays = abs(amplitude) + sum(
            freedom.play for freedom in wheel.freedoms.values()
        )
        largest[wheel.name] = displacement + plays
    return max(largest.values())


def _resting_speed(
    group: WheelGroup, edge_acceleration: float, closed_gap: float
) -> float:
    """Speed below which contacts no longer bounce [m per period].

    A gap that counts as closed contains energy: contacts at rest must be slower than a
    fall through it, otherwise it would move them for ever.

    edge_acceleration : largest acceleration of an edge
    closed_gap : largest gap that counts as closed [m]
    """
    period, rows = group.excitation.period, group.rows
    ratio = max(abs(wheel.ratio) for wheel in group.wheels)
    push = np.array([f.drag for f in group.freedoms]) / group.masses * period**2
    pull = np.abs(rows @ push).max() + ratio * _largest_acceleration(group.excitation)
    return (
        RESTING_SPEED_RATIO * math.sqrt(2.0 * (pull + edge_acceleration) * closed_gap)
        + closed_gap
    )


def _max_impacts(restitution: Array) -> int:
    """Number of simultaneous impacts after which 1e-7 of a speed remains.

    The sequences considered are finite. Alternating impacts of two contacts i, k
    transform their speeds by a matrix with the determinant eps_i eps_k; they end unless
    its eigenvalues are real.
    """
    two = np.prod(np.sort(restitution)[-2:])
    share = -math.log(max(float(two), 1e-30)) / 4.0  # least loss of an impact
    return int(np.clip(math.log(1e7) / max(share, 1e-9), 10.0, 1e6))


def _largest_acceleration(excitation: Excitation) -> float:
    """Largest second derivative, with time in periods."""
    orders, cosines, sines, pieces = _waves(excitation)
    if pieces.size:
        spans = np.diff([*pieces[:, 0], 1.0])
        ends = 2 * pieces[:, 3] + spans * (6 * pieces[:, 4] + 12 * spans * pieces[:, 5])
        return float(np.abs([2.0 * pieces[:, 3], ends]).max())
    return float(np.sum(np.hypot(cosines, sines) * (2.0 * math.pi * orders) ** 2))


def _waves(excitation: Excitation) -> tuple[Array, Array, Array, Array]:
    """Orders, cosines and sines of harmonics, or pieces of a signal."""
    if isinstance(excitation, SpeedSignal):
        empty = np.zeros(0)
        return empty, empty, empty, excitation.pieces
    amplitude, phase = np.array(excitation.amplitudes), np.array(excitation.phases)
    orders = np.arange(1.0, amplitude.size + 1.0)
    return (
        orders,
        amplitude * np.sin(phase),
        amplitude * np.cos(phase),
        np.zeros((0, 6)),
    )


def _largest_derivatives(
    orders: Array, cosines: Array, sines: Array, pieces: Array
) -> tuple[float, float]:
    """Largest third and fourth derivatives of an excitation, with time in periods."""
    if pieces.size:
        spans = np.diff([*pieces[:, 0], 1.0])
        first, fourth = 6.0 * pieces[:, 4], 24.0 * pieces[:, 5]
        last = first + fourth * spans
        return float(np.abs([first, last]).max()), float(np.abs(fourth).max())
    amplitude, angular = np.hypot(cosines, sines), 2.0 * math.pi * orders
    return float(np.sum(amplitude * angular**3)), float(np.sum(amplitude * angular**4))
