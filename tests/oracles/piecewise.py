"""Exact motion of a gear train whose pair stiffnesses are piecewise constant.

Between two events, the next jump of an excitation or change of a contact, such a
train is linear and its state follows from a matrix exponential. Events are bracketed
on the exact solution at `checks` points per period and narrowed down to round-off.
Written in the rotations of the disks from multi-mesh gear dynamics (2007), eqs.
(2.2)-(2.7) and (3.1), except that the force on the back side is k (S - g + b): by
eq. (2.4) as printed it would push the teeth further together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

from lumped.common.array_types import Array

TIME_TOL = 1e-12  # periods within which two jumps are one
AHEAD = 1e-9  # periods ahead for which a contact at its border is judged
GAUSS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True, kw_only=True)
class Disk:
    """Base radius [m], inertia [kg m2], torque [N m], spring to ground [N m/rad]."""

    radius: float
    inertia: float
    torque: float = 0.0
    coupling: float = 0.0


@dataclass(frozen=True)
class Piece:
    """Interval in which a pair carries load: constant stiffness [N/m], linear gap [m].

    start, end : in base pitches of the toothing's period, or before it
    """

    start: float
    end: float
    stiffness: float
    gap_start: float = 0.0
    gap_end: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Toothing:
    """A mesh: S = sense (r_driver theta_driver + r_driven theta_driven).

    sense : 1 where the driver turns counter-clockwise, else -1, eq. (2.3)
    pairs : pieces of each tooth pair, which carries nothing elsewhere; the same pairs
        meet again after as many base pitches
    mean_stiffness : that modal damping refers to [N/m]
    rate : mesh frequency over that of the first mesh
    """

    driver: int
    driven: int
    pairs: tuple[tuple[Piece, ...], ...]
    mean_stiffness: float
    sense: int = 1
    backlash: float = math.inf
    phase: float = 0.0
    rate: float = 1.0

    @property
    def period(self) -> int:
        return len(self.pairs)

    def piece(self, pair: int, position: float) -> tuple[Piece, float] | None:
        """Interval in which a pair carries load at a position, and how far it entered
        there.
        """
        x = position % self.period
        for piece in self.pairs[pair]:
            for ahead in (x - piece.start, x - piece.start - self.period):
                if 0.0 <= ahead < piece.end - piece.start:
                    return piece, ahead
        return None


@dataclass(frozen=True)
class PiecewiseTrain:
    disks: tuple[Disk, ...]
    toothings: tuple[Toothing, ...]
    damping_ratio: float = 0.0

    def row(self, toothing: Toothing) -> Array:
        """Mesh deflection per rotation of each disk (n,) [m]."""
        out = np.zeros(len(self.disks))
        for disk in (toothing.driver, toothing.driven):
            out[disk] = toothing.sense * self.disks[disk].radius
        return out

    @property
    def rows(self) -> Array:
        return np.array([self.row(toothing) for toothing in self.toothings])

    @property
    def inertia(self) -> Array:
        return np.array([disk.inertia for disk in self.disks])

    @property
    def coupling(self) -> Array:
        return np.diag([disk.coupling for disk in self.disks])

    @property
    def damping(self) -> Array:
        """C = sum_i 2 zeta omega_i (M v_i)(M v_i)^T about the mean stiffness."""
        mean = np.diag([toothing.mean_stiffness for toothing in self.toothings])
        mass = np.diag(self.inertia)
        squares, shapes = eigh(self.coupling + self.rows.T @ mean @ self.rows, mass)
        rates = 2.0 * self.damping_ratio * np.sqrt(np.maximum(squares, 0.0))
        momentum = mass @ shapes
        return (momentum * rates) @ momentum.T


@dataclass(frozen=True, eq=False)
class Spring:
    """A tooth pair between two jumps; its overlap is row times the state."""

    mesh: int
    stiffness: float
    overlap: Array  # (2 n + 2,)
    gap_rate: float  # m/s
    backlash: float


@dataclass(frozen=True, eq=False)
class StateEquation:
    """z' = generator z while no contact changes.

    z = (theta, theta', 1, seconds since the last jump). z energy z / 2 is the energy
    of motion, springs and load [J]; z power z is what damping takes and moving gaps
    give [W]; force z are the mesh forces (m,) [N].
    """

    generator: Array
    energy: Array
    power: Array
    force: Array


@dataclass(frozen=True, eq=False)
class LinearSegment:
    start: float
    length: float
    equation: StateEquation
    state: Array


@dataclass(frozen=True, eq=False)
class PiecewiseSolution:
    """Exact motion in spans; changes are the times at which contacts changed [s]."""

    train: PiecewiseTrain
    spans: tuple[LinearSegment, ...]
    changes: tuple[float, ...]

    @property
    def end_state(self) -> Array:
        """Rotations and speeds (2 n,) at the end."""
        last = self.spans[-1]
        return (expm(last.length * last.equation.generator) @ last.state)[:-2]

    def states(self, time: Array) -> tuple[Array, list[StateEquation]]:
        """States (t, 2 n + 2) and the equations that hold just after each time [s]."""
        starts = np.array([span.start for span in self.spans])
        at = np.clip(np.searchsorted(starts, time, "right") - 1, 0, starts.size - 1)
        spans = [self.spans[i] for i in at]
        steps = np.array(
            [
                (t - span.start) * span.equation.generator
                for t, span in zip(time, spans, strict=True)
            ]
        )
        begin = np.array([span.state for span in spans])
        return (expm(steps) @ begin[:, :, None])[:, :, 0], [s.equation for s in spans]

    def deflection(self, time: Array) -> Array:
        """Mesh deflections (t, m) [m]."""
        n = len(self.train.disks)
        return self.states(time)[0][:, :n] @ self.train.rows.T

    def force(self, time: Array) -> Array:
        """Mesh forces (t, m) just after each time [N]."""
        states, equations = self.states(time)
        return np.array(
            [
                equation.force @ state
                for equation, state in zip(equations, states, strict=True)
            ]
        )

    def _inside(self, begin: float, end: float) -> list[LinearSegment]:
        return [s for s in self.spans if begin <= s.start + 0.5 * s.length < end]

    def contact_loss(self, begin: float, end: float) -> Array:
        """Part of the time (m,) in which no pair of a mesh touches."""
        inside = self._inside(begin, end)
        length = np.array([span.length for span in inside])
        lost = np.array([~span.equation.force.any(axis=1) for span in inside])
        return np.asarray(length @ lost / length.sum())

    def quadrature(self, begin: float, end: float) -> tuple[Array, Array]:
        """Times and weights that integrate smooth functions over each span."""
        x, w = 0.5 + 0.5 * GAUSS[0], 0.5 * GAUSS[1]
        inside = self._inside(begin, end)
        times = np.concatenate([s.start + s.length * x for s in inside])
        return times, np.concatenate([s.length * w for s in inside])

    def rms(self, begin: float, end: float) -> Array:
        """RMS (m,) of the deflections about their means [m]."""
        time, weight = self.quadrature(begin, end)
        weight = (weight / weight.sum())[:, None]
        s = self.deflection(time)
        mean = (weight * s).sum(axis=0)
        return np.asarray(np.sqrt((weight * (s - mean) ** 2).sum(axis=0)))


def rectangular_pairs(
    mean: float,
    variation: float,
    contact_ratio: float,
    relief: float = 0.0,
    gaps: Sequence[float] = (0.0, 0.0),
) -> tuple[tuple[Piece, ...], ...]:
    """Pieces of every pair for a contact ratio between 1 and 2, shared equally.

    k [1 + eps (1 - c)] in single and half of k [1 + eps (2 - c)] in double contact,
    above eq. (2.28); contact lasts from c / 2 before to c / 2 after the pitch point.
    relief : of both tips [m], linear from the highest point of single contact
    gaps : of each further pair [m], two or more
    """
    c = contact_ratio
    single = mean * (1.0 + variation * (1.0 - c))
    shared = 0.5 * mean * (1.0 + variation * (2.0 - c))
    enter, leave = 1.0 - 0.5 * c, 0.5 * c
    return tuple(
        (
            Piece(n - leave, n - enter, shared, gap + relief, gap),
            Piece(n - enter, n + enter, single, gap, gap),
            Piece(n + enter, n + leave, shared, gap, gap + relief),
        )
        for n, gap in enumerate(gaps)
    )


def march(
    train: PiecewiseTrain,
    frequency: float,
    state: Array,
    periods: float,
    checks: int = 64,
) -> PiecewiseSolution:
    """From rotations and speeds (2 n,) over periods of the first mesh.

    frequency : of the first mesh [Hz]
    checks : points per period at which contacts are looked at
    """
    spans: list[LinearSegment] = []
    changes: list[float] = []
    z = np.concatenate([state, [1.0, 0.0]])
    for begin, end in pairwise(_edges(train, frequency, periods)):
        springs = _springs(train, frequency, begin, end)
        z[-1] = 0.0
        now = begin
        contact = _contacts(train, springs, z, 1.0 / frequency)
        while end - now > TIME_TOL / frequency:
            equation = _state_equation(train, springs, contact)
            count = max(1, math.ceil((end - now) * frequency * checks))
            step = (end - now) / count
            z, now, changed = _advance(
                spans, springs, contact, equation, z, now, step, end
            )
            if changed:
                changes.append(now)
                contact = _contacts(train, springs, z, 1.0 / frequency)
    return PiecewiseSolution(train, tuple(spans), tuple(changes))


def _edges(train: PiecewiseTrain, frequency: float, periods: float) -> list[float]:
    """Times at which some excitation jumps or bends or a period ends [s]."""
    edges = {0.0, periods, *map(float, range(math.ceil(periods)))}
    for toothing in train.toothings:
        pieces = [piece for pair in toothing.pairs for piece in pair]
        for edge in {edge for piece in pieces for edge in (piece.start, piece.end)}:
            first = (edge - toothing.phase) % toothing.period
            last = math.ceil(periods * toothing.rate) + 1
            turns = range(0, last, toothing.period)
            edges |= {(first + i) / toothing.rate for i in turns}
    times = sorted(t for t in edges if 0.0 <= t <= periods)
    distinct = [b for a, b in pairwise(times) if b - a > TIME_TOL]
    return [t / frequency for t in [0.0, *distinct]]


def _springs(
    train: PiecewiseTrain, frequency: float, begin: float, end: float
) -> list[Spring]:
    """Pairs with a stiffness between two edges [s]."""
    out = []
    n = len(train.disks)
    for m, toothing in enumerate(train.toothings):
        speed = toothing.rate * frequency
        middle = toothing.phase + speed * 0.5 * (begin + end)
        for pair in range(toothing.period):
            piece_ahead = toothing.piece(pair, middle)
            if piece_ahead is None:
                continue
            piece, ahead = piece_ahead
            slope = (piece.gap_end - piece.gap_start) / (piece.end - piece.start)
            ahead -= speed * 0.5 * (end - begin)
            row = np.zeros(2 * n + 2)
            row[:n] = train.row(toothing)
            row[-2:] = -(piece.gap_start + slope * ahead), -slope * speed
            rate = slope * speed
            out.append(Spring(m, piece.stiffness, row, rate, toothing.backlash))
    return out


def _state_of(overlap: float, backlash: float) -> int:
    """1 on the drive side, 0 apart, -1 on the back side."""
    return 1 if overlap > 0.0 else -1 if overlap < -backlash else 0


def _contacts(
    train: PiecewiseTrain, springs: Sequence[Spring], z: Array, period: float
) -> list[int]:
    """Contact of each spring, a moment ahead so that none lies on its border."""
    n = len(train.disks)
    moment = AHEAD * period
    near = z.copy()
    near[:n] += moment * z[n : 2 * n]
    near[-1] += moment
    return [_state_of(float(s.overlap @ near), s.backlash) for s in springs]


def _state_equation(
    train: PiecewiseTrain, springs: Sequence[Spring], contact: Sequence[int]
) -> StateEquation:
    """Equations (2.5) of the disks with the springs that touch."""
    n = len(train.disks)
    torque = np.array([disk.torque for disk in train.disks])
    push = np.zeros((n, 2 * n + 2))  # generalised forces per state
    push[:, :n] = -train.coupling
    push[:, n : 2 * n] = -train.damping
    push[:, -2] = torque
    energy, power = np.zeros((2, 2 * n + 2, 2 * n + 2))
    energy[:n, :n] = train.coupling
    energy[n : 2 * n, n : 2 * n] = np.diag(train.inertia)
    energy[:n, -2] = energy[-2, :n] = -torque
    power[n : 2 * n, n : 2 * n] = -train.damping
    force = np.zeros((len(train.toothings), 2 * n + 2))
    for spring, side in zip(springs, contact, strict=True):
        if side == 0:
            continue
        squeeze = spring.overlap.copy()
        squeeze[-2] += spring.backlash if side < 0 else 0.0
        push[:, :] -= spring.stiffness * np.outer(spring.overlap[:n], squeeze)
        force[spring.mesh] += spring.stiffness * squeeze
        energy += spring.stiffness * np.outer(squeeze, squeeze)
        power[-2] -= spring.stiffness * spring.gap_rate * squeeze
    generator = np.zeros((2 * n + 2, 2 * n + 2))
    generator[:n, n : 2 * n] = np.eye(n)
    generator[n : 2 * n] = push / train.inertia[:, None]
    generator[-1, -2] = 1.0
    return StateEquation(generator, energy, power, force)


def _advance(
    spans: list[LinearSegment],
    springs: Sequence[Spring],
    contact: Sequence[int],
    equation: StateEquation,
    z: Array,
    now: float,
    step: float,
    end: float,
) -> tuple[Array, float, bool]:
    """Append spans up to the next contact change or edge: (state, time, changed)."""
    through = expm(step * equation.generator)
    while end - now > 0.5 * step:
        after = through @ z
        changed = [
            spring
            for spring, side in zip(springs, contact, strict=True)
            if _state_of(float(spring.overlap @ after), spring.backlash) != side
        ]
        if changed:
            sides = [contact[springs.index(spring)] for spring in changed]
            first = min(
                _crossing(spring, side, equation, z, step)
                for spring, side in zip(changed, sides, strict=True)
            )
            spans.append(LinearSegment(now, first, equation, z))
            return expm(first * equation.generator) @ z, now + first, True
        spans.append(LinearSegment(now, step, equation, z))
        z, now = after, now + step
    return z, end, False


def _crossing(
    spring: Spring, side: int, equation: StateEquation, z: Array, step: float
) -> float:
    """Time after z at which a spring leaves its contact state [s]."""

    def overlap(time: float) -> float:
        return float(spring.overlap @ (expm(time * equation.generator) @ z))

    leaves_at_drive = side > 0 or (side == 0 and overlap(step) > 0.0)
    border = 0.0 if leaves_at_drive else -spring.backlash
    early = 1e-7 * step  # a change just made lies behind
    return float(
        brentq(lambda t: overlap(t) - border, early, step, xtol=1e-19, rtol=1e-14)
    )
