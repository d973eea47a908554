"""Loose wheels of a gearbox in their plays, as frozen values.

A wheel has a rotation phi and, in plays of its bearing, an axial shift x and a radial
one r. The relative distance of its teeth is s = i e(t) - w q with q = (phi, x, r) and
w = (R cos(beta), sin(beta), cos(beta)). The source has -cos(beta) in its s and
+cos(beta) in its eq. (3) to (6). Impulses do work on s, so that both must be the same
vector. With + the radial shift is positive along the line of action, like the rotation;
the other sign describes the same wheel with r reversed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lumped.common.array_types import Array

MAX_ANGULAR_SPEED = 1e6  # rad/s
AXIAL, RADIAL, TEETH = "axial", "radial", "teeth"


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Displacement e(t) = sum a_k sin(k 2 pi t / period + phase_k) along the teeth.

    period : period [s]
    amplitudes, phases : amplitudes [m] and phases [rad] of orders 1, 2, ...
    """

    period: float
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.phases) != len(self.amplitudes):
            raise ValueError(
                f"phases = {len(self.phases)}; must be as many as amplitudes, "
                f"{len(self.amplitudes)}"
            )

    @property
    def lasts(self) -> float:
        """Time for which the displacement is known [s]."""
        return math.inf

    @property
    def shortest(self) -> float:
        """Shortest time scale of the displacement [s]."""
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

    The wheel rotates at the mean speed; the fluctuation moves the teeth.

    times : (k,) increasing times, from the beginning of the run [s]
    speeds : (k,) [rad/s]
    base_radius : [m]
    """

    times: Array
    speeds: Array
    base_radius: float

    def __post_init__(self) -> None:
        if len(self.times) < 4:
            raise ValueError(
                f"rows of a speed signal = {len(self.times)}; must be 4 or more"
            )
        if not np.all(np.diff(self.times) > 0.0):
            raise ValueError("times of a speed signal must rise")
        if not np.all(np.abs(self.speeds) <= MAX_ANGULAR_SPEED):
            raise ValueError(
                f"speeds must be numbers up to {MAX_ANGULAR_SPEED:g} rad/s"
            )

    @property
    def period(self) -> float:
        """Length of the signal [s]."""
        return float(self.times[-1] - self.times[0])

    @property
    def lasts(self) -> float:
        return self.period

    @property
    def shortest(self) -> float:
        return self.period / len(self.times)

    @cached_property
    def pieces(self) -> Array:
        """Starts of pieces and their polynomials of degree 4, in periods (k, 6)."""
        from scipy.interpolate import CubicSpline

        turns = (self.times - self.times[0]) / self.period
        spline = CubicSpline(turns, self.speeds)
        mean = float(spline.integrate(0.0, 1.0))
        scale = self.base_radius * self.period
        shift = CubicSpline(turns, self.speeds - mean).antiderivative()
        pieces = np.column_stack([turns[:-1], scale * shift.c[::-1].T])
        return np.ascontiguousarray(pieces)  # as kernels are compiled for

    def at(self, time: Array) -> Array:
        """Displacement at times from the beginning of the signal [s]."""
        turns = np.asarray(time) / self.period
        k = np.clip(np.searchsorted(self.pieces[:, 0], turns, "right") - 1, 0, None)
        h, c = turns - self.pieces[k, 0], self.pieces[k, 1:]
        return np.sum(c * h[..., None] ** np.arange(5), axis=-1)


Excitation = Harmonics | SpeedSignal


@dataclass(frozen=True)
class Variation:
    """Variation amplitude sin(order 2 pi t / period + phase) of a play [m]."""

    amplitude: float
    order: int
    phase: float

    def at(self, turns: Array) -> Array:
        """Variation at angles 2 pi t / period."""
        return np.asarray(self.amplitude * np.sin(self.order * turns + self.phase))


@dataclass(frozen=True, kw_only=True)
class Freedom:
    """Coordinate of a wheel: drag [N or N m], damping [N s/m or N m s/rad].

    play, restitution : play [m] and coefficient of restitution of the bearing, or of
        the teeth for the rotation
    """

    play: float
    restitution: float
    drag: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True, kw_only=True)
class LooseWheel:
    """Loose wheel; SI units, angles in radians.

    driver : loose wheel that drives it; if absent, the input does
    ratio : displacement of the driving teeth over that of the input, or over that by
        the driver's rotation at its base circle; shifts of a driver count in full
    helix_angle : helix angle of the mesh that drives it
    axial, radial : shifts in plays of the bearing, None if there are none
    variation : variation of the play of the teeth, at its lower edge
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
    variation: Variation | None = None

    def __post_init__(self) -> None:
        play, variation = self.rotation.play, self.variation
        if variation is not None and abs(variation.amplitude) >= play:
            raise ValueError(
                f"amplitude of a variation = {variation.amplitude:g}; must be below "
                f"the play, {play:g} m"
            )

    @property
    def freedoms(self) -> dict[str, Freedom]:
        """Coordinates by play, in their order."""
        candidates = {TEETH: self.rotation, AXIAL: self.axial, RADIAL: self.radial}
        return {
            name: freedom for name, freedom in candidates.items() if freedom is not None
        }

    def direction(self, helix_angle: float, ratio: float = 1.0) -> Array:
        """Displacement w along the line of action of a mesh per coordinate."""
        cosine, sine = math.cos(helix_angle), math.sin(helix_angle)
        components = {
            TEETH: ratio * self.base_radius * cosine,
            AXIAL: sine,
            RADIAL: cosine,
        }
        return np.array([components[name] for name in self.freedoms])


@dataclass(frozen=True, eq=False)
class Gearbox:
    """Loose wheels and their excitation."""

    excitation: Excitation
    wheels: tuple[LooseWheel, ...]

    def __post_init__(self) -> None:
        if not self.wheels:
            raise ValueError("a gearbox needs a wheel")
        names: list[str] = []
        for wheel in self.wheels:
            if wheel.name in names:
                raise ValueError(f"wheel {wheel.name} is there more than once")
            if wheel.driver is not None and wheel.driver not in names:
                raise ValueError(
                    f"driver {wheel.driver} of wheel {wheel.name} must be a wheel "
                    "before it"
                )
            names.append(wheel.name)

    @property
    def groups(self) -> list[tuple[LooseWheel, ...]]:
        """Groups of wheels that mesh with each other, independent of all others."""
        roots: dict[str, str] = {}
        for wheel in self.wheels:
            roots[wheel.name] = roots[wheel.driver] if wheel.driver else wheel.name
        group_roots = dict.fromkeys(roots.values())
        return [
            tuple(w for w in self.wheels if roots[w.name] == root)
            for root in group_roots
        ]
