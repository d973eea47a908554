"""Periodic functions of the mesh position, piecewise cubic.

Positions are in base pitches; the period is 1 if all teeth are equal, otherwise a whole
number. A wave may jump between its pieces and is exact there: no sample straddles a
jump.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array
from lumped.common.checks import require_fields
from lumped.common.short_repr import ShortRepr

POSITION_TOL = 1e-12  # base pitches within which two positions are equal


@dataclass(frozen=True, eq=False)
class Wave(ShortRepr):
    """Cubic pieces over a base pitch.

    Parameters
    ----------
    breaks : (n + 1,) array
        Ends of the pieces, from 0 to 1, increasing [base pitches].
    coefficients : (n, 4) or (c, n, 4) array
        Coefficients in c0 + c1 x + c2 x^2 + c3 x^3 with x from the piece's start; of c
        different base pitches, one after another.
    corners : tuple of float, optional
        Positions where value or slope jumps; integrators step onto them.
    offsets : (o,) array, optional
        Constants added to the base pitches, one after another.

    Raises
    ------
    ValueError
        If shapes do not fit, numbers are not finite or the breaks do not increase from
        0 to 1.
    """

    breaks: Array
    coefficients: Array
    corners: tuple[float, ...] = ()
    offsets: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        require_fields(self)
        pieces = self.breaks.size - 1
        if self.coefficients.ndim not in (2, 3) or self.coefficients.shape[-2:] != (
            pieces,
            4,
        ):
            raise ValueError(
                f"shape of coefficients = {self.coefficients.shape}; must be "
                f"{(pieces, 4)}"
            )
        if self.breaks[0] != 0.0 or self.breaks[-1] != 1.0:
            raise ValueError("breaks must begin at 0 and end at 1")
        if not (np.diff(self.breaks) > 0.0).all():
            raise ValueError("breaks must increase")
        for name in ("coefficients", "offsets"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} must be finite")

    @property
    def shapes(self) -> Array:
        """Coefficients (c, n, 4) of the different base pitches."""
        return self.coefficients.reshape(-1, self.breaks.size - 1, 4)

    @property
    def period(self) -> int:
        """Base pitches after which the wave repeats."""
        return math.lcm(len(self.shapes), max(1, self.offsets.size))

    def __call__(
        self, position: ArrayLike, side: int = 1, pitch: ArrayLike = 0
    ) -> Array:
        """Values at positions of any shape.

        Parameters
        ----------
        position : array_like
            Positions [base pitches].
        side : int, optional
            -1 for the limit from below.
        pitch : array_like of int, optional
            Whole base pitches to add to the positions.

        Returns
        -------
        array
            Values, of the shape of the positions.
        """
        x = np.asarray(position, float)
        x = np.where(np.abs(x - np.round(x)) < POSITION_TOL, np.round(x), x)
        whole_pitches = np.floor(x)
        x = x - whole_pitches
        if side < 0:
            at_start = x == 0.0
            x, whole_pitches = np.where(at_start, 1.0, x), whole_pitches - at_start
        shift = POSITION_TOL if side > 0 else -POSITION_TOL
        piece = np.searchsorted(self.breaks, x + shift, "right")
        piece = np.clip(piece - 1, 0, self.breaks.size - 2)
        pitch_index = whole_pitches.astype(np.int64) + np.asarray(pitch)
        shapes = self.shapes
        c = (
            shapes[0, piece]
            if len(shapes) == 1
            else shapes[pitch_index % len(shapes), piece]
        )
        t = x - self.breaks[piece]
        value = c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3]))
        if self.offsets.size:
            value = value + self.offsets[pitch_index % self.offsets.size]
        return value

    @cached_property
    def mean(self) -> float:
        """Exact mean over the period."""
        h = np.diff(self.breaks)
        powers = h[:, None] ** np.arange(1, 5) / np.arange(1, 5)
        mean = float((self.coefficients * powers).sum()) / len(self.shapes)
        return mean + float(self.offsets.mean()) if self.offsets.size else mean

    def scaled(self, factor: float, offset: float = 0.0) -> Wave:
        """The wave times a factor, plus an offset.

        Parameters
        ----------
        factor : float
            Factor.
        offset : float, optional
            Offset, in the unit of the values.

        Returns
        -------
        Wave
            Scaled wave.
        """
        c = factor * self.coefficients
        c[..., 0] += offset
        return Wave(self.breaks, c, self.corners, factor * self.offsets)


def constant_wave(value: float) -> Wave:
    return linear_wave(value, 0.0)


def linear_wave(start: float, slope: float) -> Wave:
    """Wave that grows linearly over every base pitch."""
    return Wave(np.array([0.0, 1.0]), np.array([[start, slope, 0.0, 0.0]]))


def sum_waves(waves: Sequence[Wave]) -> Wave:
    """Sum of waves, with the corners of all of them except joints that cancel."""
    breaks = np.unique(np.concatenate([wave.breaks for wave in waves]))
    breaks = np.append(breaks[:-1][np.diff(breaks) > POSITION_TOL], 1.0)
    middle = 0.5 * (breaks[:-1] + breaks[1:])
    rows = np.zeros((middle.size, 4))
    for wave in waves:
        piece = np.searchsorted(wave.breaks, middle, "right") - 1
        shift = breaks[:-1] - wave.breaks[piece]
        rows += shift_cubics(wave.coefficients[piece], shift)
    corners = sorted({corner for wave in waves for corner in wave.corners})
    return Wave(breaks, rows, tuple(corners))


def multiply_waves(one: Wave, other: Wave) -> Wave:
    """Product of waves without offsets, with the corners of both.

    Values and slopes are exact at all breaks. Between them the product is a cubic:
    exact if the sum of the degrees is at most 3, otherwise accurate to fourth order.
    """
    if one.offsets.size or other.offsets.size:
        raise ValueError("a product is of waves without offsets")
    breaks = np.unique(np.concatenate([one.breaks, other.breaks]))
    breaks = np.append(breaks[:-1][np.diff(breaks) > POSITION_TOL], 1.0)
    h, period = np.diff(breaks), math.lcm(one.period, other.period)
    values, slopes = [], []
    for wave in (one, other):
        piece = np.searchsorted(wave.breaks, breaks[:-1] + 0.5 * h, "right") - 1
        shift = breaks[:-1] - wave.breaks[piece]
        rows = [shift_cubics(shape[piece], shift) for shape in wave.shapes]
        c = np.tile(rows, (period // len(rows), 1, 1))
        powers = h[:, None] ** np.arange(4)
        ends = (c * powers).sum(axis=-1), (c[..., 1:] * powers[:, :3]) @ [1.0, 2.0, 3.0]
        values.append(np.stack([c[..., 0], ends[0]]))
        slopes.append(np.stack([c[..., 1], ends[1]]))
    value = values[0] * values[1]
    slope = slopes[0] * values[1] + values[0] * slopes[1]
    corners = tuple(sorted({*one.corners, *other.corners}))
    shapes = _hermite_pieces(value, slope, h)
    return Wave(breaks, shapes if period > 1 else shapes[0], corners)


def wave_from_samples(samples: ArrayLike, pitches: int = 1) -> Wave:
    """Monotone cubic interpolation (PCHIP) of equally spaced samples.

    The first sample is at position 0; each base pitch has the same number of samples, 4
    or more. Raises ValueError if a sample is not finite.
    """
    values = np.asarray(samples, float)
    n, margin = values.size // pitches, 3
    if values.ndim != 1 or n < 4 or n * pitches != values.size:
        raise ValueError(f"shape of samples = {values.shape}; must be (n,), n >= 4")
    if not np.isfinite(values).all():
        raise ValueError("samples must be finite")
    index = np.arange(-margin, values.size + margin + 1)
    pieces = monotone_cubics(index / n, values[index % values.size])
    pieces = pieces[margin : margin + values.size]
    shapes = pieces if pitches == 1 else pieces.reshape(pitches, n, 4)
    return Wave(np.arange(n + 1) / n, shapes)


def monotone_cubics(x: Array, y: Array) -> Array:
    """Coefficients (n - 1, 4) of the monotone cubic interpolant of n points."""
    from scipy.interpolate import PchipInterpolator

    return np.ascontiguousarray(PchipInterpolator(x, y).c[::-1].T)


def cut_into_pitches(
    breaks: Array, coefficients: Array, corners: Iterable[float], outside: float
) -> dict[int, Wave]:
    """Cut a function of a tooth pair's position into one wave for each pair k.

    The function is defined from breaks[0] to breaks[-1] and is `outside` elsewhere;
    pair k is at cycle position + k. Joints between waves are not corners: where one
    pair leaves a wave, its successor enters.
    """
    starts, ends = breaks[:-1], breaks[1:]
    corner_positions = [float(corner) for corner in corners]
    waves = {}
    for k in range(
        math.floor(breaks[0] + POSITION_TOL), math.ceil(breaks[-1] - POSITION_TOL)
    ):
        inner = starts[(starts > k + POSITION_TOL) & (starts < k + 1 - POSITION_TOL)]
        path_ends = [
            x
            for x in (breaks[0], breaks[-1])
            if k + POSITION_TOL < x < k + 1 - POSITION_TOL
        ]
        wave_breaks = np.unique(np.concatenate([[k], inner, path_ends, [k + 1.0]]))
        middle = 0.5 * (wave_breaks[:-1] + wave_breaks[1:])
        piece = np.searchsorted(ends, middle, "right")
        rows = np.zeros((middle.size, 4))
        rows[:, 0] = outside
        inside = (middle > breaks[0]) & (middle < breaks[-1])
        rows[inside] = shift_cubics(
            coefficients[piece[inside]],
            wave_breaks[:-1][inside] - starts[piece[inside]],
        )
        wave_corners = tuple(
            x - k
            for x in corner_positions
            if k - POSITION_TOL <= x < k + 1 - POSITION_TOL
        )
        waves[k] = Wave(_from_zero_to_one(wave_breaks - k), rows, wave_corners)
    return waves


def _from_zero_to_one(breaks: Array) -> Array:
    return np.concatenate([[0.0], breaks[1:-1], [1.0]])


def shift_cubics(coefficients: Array, shift: Array) -> Array:
    """Coefficients (n, 4) of the same cubics with origins moved by shift (n,)."""
    c0, c1, c2, c3 = coefficients.T
    h = shift
    return np.stack(
        [
            c0 + h * (c1 + h * (c2 + h * c3)),
            c1 + h * (2.0 * c2 + 3.0 * h * c3),
            c2 + 3.0 * h * c3,
            c3,
        ],
        axis=1,
    )


def linear_pieces(points: Sequence[tuple[float, float]]) -> tuple[Array, Array]:
    """Breaks and coefficients of straight lines between points (position, value).

    Two points at the same position form a jump.
    """
    x = np.array([point[0] for point in points], float)
    y = np.array([point[1] for point in points], float)
    h = np.diff(x)
    pieces = np.flatnonzero(h > POSITION_TOL)
    slope = np.diff(y)[pieces] / h[pieces]
    zero = np.zeros_like(slope)
    coefficients = np.stack([y[pieces], slope, zero, zero], axis=1)
    return np.append(x[pieces], x[-1]), coefficients


def wave_from_harmonics(mean: float, coefficients: Iterable[complex]) -> Wave:
    """Wave mean + sum_s (c_s exp(2 pi i s x) + c.c.) as cubics (error below 1e-9)."""
    harmonics = np.array(list(coefficients), complex)
    count = harmonics.size
    n = 128 * max(count, 1)
    x = np.arange(n + 1) / n
    turn = 2j * np.pi * np.arange(1, count + 1)
    waves = np.exp(turn * x[:, None]) * harmonics
    value = mean + 2.0 * waves.sum(axis=1).real
    slope = 2.0 * (turn * waves).sum(axis=1).real
    return Wave(x, _hermite(value, slope, 1.0 / n))


def _hermite(value: Array, slope: Array, h: float) -> Array:
    """Cubic coefficients from values and slopes at equally spaced points."""
    values, slopes = (
        np.stack([samples[:-1], samples[1:]]) for samples in (value, slope)
    )
    return _hermite_pieces(values, slopes, np.full(value.size - 1, h))


def _hermite_pieces(value: Array, slope: Array, h: Array) -> Array:
    """Coefficients (..., n, 4) from values and slopes (2, ..., n) at the ends of pieces
    of lengths h (n,)."""
    secant = (value[1] - value[0]) / h
    c2 = (3.0 * secant - 2.0 * slope[0] - slope[1]) / h
    c3 = (slope[0] + slope[1] - 2.0 * secant) / h**2
    return np.stack([value[0], slope[0], c2, c3], axis=-1)
