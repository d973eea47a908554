"""Loose wheels of a gearbox in their plays: what they are, as frozen values.

A wheel has a rotation phi and, in plays of its bearing, an axial shift x and a radial
one r. The relative distance of its teeth is s = i e(t) - w q with q = (phi, x, r) and
w = (R cos(beta), sin(beta), cos(beta)). The source has -cos(beta) in its s and
+cos(beta) in its eq. (3) to (6). Impulses do work on s, so that both must be one
vector; with + the radial shift counts along the line of action like the rotation, and
the other sign is the same wheel with r counted the other way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lumped.clatter.kernels.arrays import Box
from lumped.rattle.kernels.flight import CLOSE

Array = NDArray[np.float64]
AXIAL, RADIAL, TEETH = "axial", "radial", "teeth"
RESTING = 32.0  # of the speed that round-off of a place gives: contacts rest
SERIES = 0.5  # largest rate times a step in sustained contact, see TERMS


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Displacement e(t) = sum a_k sin(k 2 pi t / period + phase_k) along the teeth.

    period [s]; amplitudes [m], phases [rad], of orders 1, 2, ...
    """

    period: float
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.phases) != len(self.amplitudes):
            raise ValueError(
                f"phases must be as many as amplitudes, {len(self.amplitudes)}, got "
                f"{len(self.phases)}"
            )

    @property
    def lasts(self) -> float:
        """Seconds for which it is known."""
        return math.inf

    @property
    def shortest(self) -> float:
        """Shortest time in which it changes [s]."""
        return self.period / max(1, len(self.amplitudes))

    def at(self, time: Array) -> Array:
        """Displacement at times [s]."""
        turns = 2.0 * math.pi * np.asarray(time) / self.period
        waves = zip(self.amplitudes, self.phases, strict=True)
        start = np.zeros_like(turns)
        return sum(
            (a * np.sin((k + 1) * turns + b) for k, (a, b) in enumerate(waves)), start
        )


@dataclass(frozen=True, eq=False)
class SpeedSignal:
    """Displacement from a recorded speed: its fluctuation integrated, by cubic splines.

    The wheel turns at the mean speed; what is left moves the teeth.
    times (k,) [s] : rising, from where the run begins
    speeds (k,) [rad/s]; base_radius [m]
    """

    times: Array
    speeds: Array
    base_radius: float

    def __post_init__(self) -> None:
        if len(self.times) < 4:
            raise ValueError(f"a speed signal needs 4 rows, got {len(self.times)}")
        if not np.all(np.diff(self.times) > 0.0):
            raise ValueError("times of a speed signal must rise")
        if not np.all(np.isfinite(self.speeds)):
            raise ValueError("speeds of a signal must be finite")

    @property
    def period(self) -> float:
        """Its whole length [s]."""
        return float(self.times[-1] - self.times[0])

    @property
    def lasts(self) -> float:
        return self.period

    @property
    def shortest(self) -> float:
        return self.period / len(self.times)

    @cached_property
    def pieces(self) -> Array:
        """Where pieces begin and their polynomials of degree 4, in periods (k, 6)."""
        from scipy.interpolate import CubicSpline

        turns = (self.times - self.times[0]) / self.period
        spline = CubicSpline(turns, self.speeds)
        mean = float(spline.integrate(0.0, 1.0))
        scale = self.base_radius * self.period
        shift = CubicSpline(turns, self.speeds - mean).antiderivative()
        return np.column_stack([turns[:-1], scale * shift.c[::-1].T])

    def at(self, time: Array) -> Array:
        """Displacement at times from its beginning [s]."""
        turns = np.asarray(time) / self.period
        k = np.clip(np.searchsorted(self.pieces[:, 0], turns, "right") - 1, 0, None)
        h, c = turns - self.pieces[k, 0], self.pieces[k, 1:]
        return np.sum(c * h[..., None] ** np.arange(5), axis=-1)


Excitation = Harmonics | SpeedSignal


@dataclass(frozen=True, kw_only=True)
class Freedom:
    """A coordinate of a wheel: drag [N or N m], damping [N s/m or N m s/rad].

    play [m], restitution : of the bearing, or of the teeth where it is the rotation
    """

    play: float
    restitution: float
    drag: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Wheel:
    """A loose wheel; SI units, angles in radians.

    driver : the loose wheel that meshes with it, else it is the input
    ratio : displacement of the driving teeth over that at the driver's base circle
    axial, radial : shifts in plays of the bearing, None where there are none
    """

    name: str
    inertia: float
    mass: float
    base_radius: float
    rotation: Freedom
    axial: Freedom | None = None
    radial: Freedom | None = None
    helix_angle: float = 0.0
    ratio: float = 1.0
    driver: str | None = None

    @property
    def freedoms(self) -> dict[str, Freedom]:
        """By play, in the order of the coordinates."""
        every = {TEETH: self.rotation, AXIAL: self.axial, RADIAL: self.radial}
        return {name: each for name, each in every.items() if each is not None}

    def direction(self, ratio: float = 1.0) -> Array:
        """Displacement along the line of action by coordinate, w of the source."""
        cosine, sine = math.cos(self.helix_angle), math.sin(self.helix_angle)
        every = {TEETH: ratio * self.base_radius * cosine, AXIAL: sine, RADIAL: cosine}
        return np.array([every[name] for name in self.freedoms])


@dataclass(frozen=True, eq=False)
class Gearbox:
    """Loose wheels and what excites them."""

    excitation: Excitation
    wheels: tuple[Wheel, ...]

    def __post_init__(self) -> None:
        if not self.wheels:
            raise ValueError("a gearbox needs a wheel")
        seen: list[str] = []
        for wheel in self.wheels:
            if wheel.name in seen:
                raise ValueError(f"wheel {wheel.name} is there more than once")
            if wheel.driver is not None and wheel.driver not in seen:
                raise ValueError(
                    f"driver {wheel.driver} of wheel {wheel.name} must be a wheel "
                    "before it"
                )
            seen.append(wheel.name)

    @property
    def groups(self) -> list[tuple[Wheel, ...]]:
        """Wheels that mesh with each other, which others do not feel."""
        roots: dict[str, str] = {}
        for wheel in self.wheels:
            roots[wheel.name] = roots[wheel.driver] if wheel.driver else wheel.name
        every = dict.fromkeys(roots.values())
        return [
            tuple(w for w in self.wheels if roots[w.name] == root) for root in every
        ]


@dataclass(frozen=True, eq=False)
class Group:
    """Wheels that depend on each other, as the kernels take them.

    plays : wheel and name of each, in the order of the coordinates
    """

    wheels: tuple[Wheel, ...]
    excitation: Excitation
    tolerance: float = CLOSE

    @property
    def plays(self) -> list[tuple[Wheel, str]]:
        return [(wheel, name) for wheel in self.wheels for name in wheel.freedoms]

    @property
    def freedoms(self) -> list[Freedom]:
        return [wheel.freedoms[name] for wheel, name in self.plays]

    @property
    def masses(self) -> Array:
        """Of the coordinates [kg m2 or kg]."""
        return np.array([w.inertia if n == TEETH else w.mass for w, n in self.plays])

    @property
    def rows(self) -> Array:
        """Of the plays by coordinate (p, p), s = ratio e(t) + row q."""
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
            rows[number, spans[wheel.name]] = -wheel.direction()
            if wheel.driver is not None:
                own = by_name[wheel.driver].direction(wheel.ratio)
                rows[number, spans[wheel.driver]] = own
        return rows

    @cached_property
    def box(self) -> Box:
        plays, freedoms, period = self.plays, self.freedoms, self.excitation.period
        number = np.arange(len(plays))
        teeth = np.array([name == TEETH for _, name in plays])
        driven = np.array([wheel.driver is not None for wheel, _ in plays])
        ratio = np.array([wheel.ratio for wheel, _ in plays])
        drag = np.array([each.drag for each in freedoms])
        damping = np.array([each.damping for each in freedoms])
        play = np.array([each.play for each in freedoms])
        orders, cosines, sines, pieces = _waves(self.excitation)
        jerk, snap = _largest(orders, cosines, sines, pieces)
        fading = damping / self.masses * period
        fastest = max([2.0 * math.pi * orders.max(initial=0.0), fading.max()])
        return Box(
            push=drag / self.masses * period**2,
            fading=fading,
            yielding=1.0 / self.masses,
            rows=self.rows,
            ratios=np.where(teeth & ~driven, ratio, 0.0),
            low=-play,
            high=np.zeros(len(plays)),
            restitution=np.array([each.restitution for each in freedoms]),
            wall=np.where(teeth, -1, number),
            turning=number,
            orders=orders,
            cosines=cosines,
            sines=sines,
            pieces=pieces,
            jerk=jerk,
            snap=snap,
            rest=_resting(self, play),
            most_hits=_most_hits(np.array([each.restitution for each in freedoms])),
            tolerance=self.tolerance,
            longest=SERIES / fastest if fastest > 0.0 else math.inf,
        )


def _resting(group: Group, play: Array) -> float:
    """Speed below which contacts do not bounce any more [m in a period].

    Round-off u of a place makes speeds of sqrt(2 a u) under an acceleration a.
    """
    period, rows = group.excitation.period, group.rows
    times = np.linspace(0.0, period, 1001)
    e = np.abs(group.excitation.at(times)).max()
    ratio = max(abs(wheel.ratio) for wheel in group.wheels)
    push = np.array([f.drag for f in group.freedoms]) / group.masses * period**2
    pull = np.abs(rows @ push).max() + ratio * _largest_bend(group.excitation)
    place = ratio * e + play.max()
    own = RESTING * math.sqrt(2.0 * pull * place * np.finfo(float).eps)
    return float(own + np.finfo(float).eps * play.max())


def _most_hits(restitution: Array) -> int:
    """Impacts at an instant that leave 1e-7 of a speed, of sequences that do end.

    Two contacts i, k that are hit in turn transform their speeds by a matrix with the
    determinant eps_i eps_k, and end unless its eigenvalues are real.
    """
    two = np.prod(np.sort(restitution)[-2:])
    share = -math.log(max(float(two), 1e-30)) / 4.0  # that a hit loses, at least
    return int(np.clip(math.log(1e7) / max(share, 1e-9), 10.0, 1e6))


def _largest_bend(excitation: Excitation) -> float:
    """Largest second derivative, by periods."""
    orders, cosines, sines, pieces = _waves(excitation)
    if pieces.size:
        spans = np.diff([*pieces[:, 0], 1.0])
        ends = 2 * pieces[:, 3] + spans * (6 * pieces[:, 4] + 12 * spans * pieces[:, 5])
        return float(np.abs([2.0 * pieces[:, 3], ends]).max())
    return float(np.sum(np.hypot(cosines, sines) * (2.0 * math.pi * orders) ** 2))


def _waves(excitation: Excitation) -> tuple[Array, Array, Array, Array]:
    """Orders, cosines and sines of harmonics, or pieces of a signal."""
    if isinstance(excitation, SpeedSignal):
        nothing = np.zeros(0)
        return nothing, nothing, nothing, excitation.pieces
    size, phase = np.array(excitation.amplitudes), np.array(excitation.phases)
    orders = np.arange(1.0, size.size + 1.0)
    return orders, size * np.sin(phase), size * np.cos(phase), np.zeros((0, 6))


def _largest(
    orders: Array, cosines: Array, sines: Array, pieces: Array
) -> tuple[float, float]:
    """Largest third and fourth derivative of an excitation, by periods."""
    if pieces.size:
        spans = np.diff([*pieces[:, 0], 1.0])
        first, fourth = 6.0 * pieces[:, 4], 24.0 * pieces[:, 5]
        last = first + fourth * spans
        return float(np.abs([first, last]).max()), float(np.abs(fourth).max())
    size, own = np.hypot(cosines, sines), 2.0 * math.pi * orders
    return float(np.sum(size * own**3)), float(np.sum(size * own**4))
