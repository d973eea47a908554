"""Mesh stiffness from a few parameters: rectangular, trapezoidal or by harmonics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.common.array_types import Array
from lumped.common.checks import check_arguments, format_number, require_fields
from lumped.train.excitation import MeshExcitation, PairExcitation, with_pitch_errors
from lumped.train.excitation_tables import MODELS
from lumped.train.waves import (
    POSITION_TOL,
    Wave,
    constant_wave,
    cut_into_pitches,
    linear_pieces,
    sum_waves,
    wave_from_harmonics,
    wave_from_samples,
)

Points = Sequence[tuple[float, float]]  # (base pitches from the pitch point, value)
STE_POINTS = 512  # points per base pitch of a static transmission error
PITCHES_PER_BLOCK = 64  # base pitches that are solved at once if they differ


@dataclass(frozen=True, kw_only=True)
class StiffnessParameters:
    """Parameters of a mesh stiffness.

    Parameters
    ----------
    mean : float
        Mean stiffness k [N/m], positive.
    variation : float
        Peak-to-peak value over the mean, eps; from 0 to below 1.
    contact_ratio : float
        Contact ratio c, from 1 to below 20.
    approach : float, optional
        Base pitches from the start of contact to the pitch point; half of the contact
        ratio unless given.
    load_share : float, optional
        Load share alpha of the leaving pair where double contact starts, between 0 and
        1; it falls linearly to 1 - alpha where double contact ends.
    ramp : float, optional
        Base pitches over which stiffness enters and leaves, 0 for a rectangle.

    Raises
    ------
    ValueError
        If a value is not allowed.

    Notes
    -----
    The parameters are those of the multi-mesh source, eq. 2.28 and 5.3. If n is the
    integer part of the contact ratio c, n + 1 pairs have the stiffness k [1 + eps (n +
    1 - c)] and n pairs k [1 + eps (n - c)]. The mean is k and the peak-to-peak value
    eps k.
    """

    mean: float
    variation: float
    contact_ratio: float
    approach: float | None = None
    load_share: float = 0.5
    ramp: float = 0.0

    def __post_init__(self) -> None:
        require_fields(self)
        max_ramp = min(self.part, 1.0 - self.part)
        checks = {
            "mean": (0.0 < self.mean < math.inf, "positive"),
            "variation": (0.0 <= self.variation < 1.0, "from 0 to below 1"),
            "contact_ratio": (1.0 <= self.contact_ratio < 20.0, "from 1 to below 20"),
            "load_share": (0.0 < self.load_share < 1.0, "between 0 and 1"),
            "ramp": (0.0 <= self.ramp <= max_ramp, f"from 0 to {max_ramp!r}"),
        }
        for name, (ok, allowed) in checks.items():
            if not ok:
                value = getattr(self, name)
                raise ValueError(f"{name} = {format_number(value)}; must be {allowed}")

    @property
    def pairs(self) -> int:
        """Number of pairs that are always in contact."""
        return math.floor(self.contact_ratio)

    @property
    def part(self) -> float:
        """Fraction of the cycle with one additional pair."""
        return self.contact_ratio - self.pairs

    @property
    def low(self) -> float:
        """Stiffness without the additional pair [N/m]."""
        return self.mean * (1.0 - self.variation * self.part)

    @property
    def high(self) -> float:
        """Stiffness with the additional pair [N/m]."""
        return self.mean * (1.0 + self.variation * (1.0 - self.part))

    @property
    def start(self) -> float:
        """Position at which the reference pair comes into contact."""
        half = 0.5 * self.contact_ratio
        return -(half if self.approach is None else self.approach)


@check_arguments
def analytic_excitation(
    figures: StiffnessParameters,
    model: int = 1,
    gap: Points = (),
    force: float = 0.0,
    harmonics: int | None = None,
    pitch_errors: ArrayLike = (),
) -> MeshExcitation:
    """Excitation of one mesh from the parameters of its stiffness.

    Parameters
    ----------
    figures : StiffnessParameters
        Parameters of the mesh stiffness.
    model : {1, 2, 3}, optional
        Model of the mesh.
    gap : sequence of tuple of 2 float, optional
        Gap of a pair over its path, corners of a polygon: base pitches from the pitch
        point and gap [m]; zero if empty.
    force : float, optional
        Nominal mesh force [N], for the loaded transmission error of Model-2.
    harmonics : int, optional
        Number of harmonics of the mesh frequency to include; the mesh is then one
        spring without a gap.
    pitch_errors : (p,) array_like, optional
        Gaps of the tooth pairs [m], one after another; see `pair_errors`.

    Returns
    -------
    MeshExcitation
        Stiffness and gap of each tooth pair, or of the mesh.

    Raises
    ------
    ValueError
        If the model or the number of harmonics is not allowed, or `harmonics` is given
        with gaps or pitch errors.
    """
    if model not in MODELS:
        raise ValueError(f"model = {model}; must be 1, 2 or 3")
    errors = np.asarray(pitch_errors, float)
    if harmonics is not None:
        if errors.size:
            raise ValueError(
                "harmonics represent the complete mesh; pitch_errors are of tooth pairs"
            )
        return _excitation_by_harmonics(figures, model, gap, force, harmonics)
    springs = pair_springs(figures, gap, errors)
    if model == 1:
        return MeshExcitation(springs, figures.mean)
    if model == 2:
        error = static_error(springs, force)
        spring = PairExcitation(
            constant_wave(figures.mean), error.scaled(1.0, -error.mean)
        )
        return MeshExcitation((spring,), figures.mean)
    stiffness = sum_waves([spring.stiffness for spring in springs])
    if errors.size and force > 0.0:
        stiffness = loaded_stiffness(springs, force)
    spring = PairExcitation(stiffness, static_error(springs, 0.0))
    return MeshExcitation((spring,), figures.mean)


def pair_springs(
    figures: StiffnessParameters, gap: Points = (), pitch_errors: ArrayLike = ()
) -> tuple[PairExcitation, ...]:
    """Stiffness and gap of every tooth pair in contact within a base pitch."""
    stiffness = _waves_by_pair(pair_profile(figures))
    gaps = _waves_by_pair([(x, y) for x, y in gap]) if gap else {}
    no_gap, errors = constant_wave(0.0), np.asarray(pitch_errors, float)
    return tuple(
        PairExcitation(
            stiffness[k], with_pitch_errors(gaps.get(k, no_gap), k, errors), k
        )
        for k in stiffness
    )


def _waves_by_pair(points: Points) -> dict[int, Wave]:
    return cut_into_pitches(*linear_pieces(points), {x for x, _ in points}, 0.0)


def pair_profile(figures: StiffnessParameters) -> list[tuple[float, float]]:
    """Corners (position, stiffness [N/m]) of a pair's path through the mesh."""
    n, c, start = figures.pairs, figures.contact_ratio, figures.start
    entering_share, leaving_share = 1.0 - figures.load_share, figures.load_share
    corners = [(start, 0.0)]
    for k in range(n + 1):  # n + 1 pairs touch from k to k + part, then n
        shares = (
            (entering_share, leaving_share)
            if k == 0
            else (leaving_share, entering_share)
        )
        if n != 1:
            shares = (1.0 / (n + 1), 1.0 / (n + 1))
        segment_ends = (start + k, start + k + figures.part)
        corners += [
            (x, figures.high * share)
            for x, share in zip(segment_ends, shares, strict=True)
        ]
        if k < n:
            segment_ends = (start + k + figures.part, start + k + 1.0)
            corners += [(x, figures.low / n) for x in segment_ends]
    corners.append((start + c, 0.0))
    return _add_ramps(corners, figures.ramp) if figures.ramp else corners


def _add_ramps(corners: Points, ramp: float) -> list[tuple[float, float]]:
    """Replace jumps by slopes of length `ramp` about them; the mean is unchanged."""
    ramped_corners: list[tuple[float, float]] = []
    positions = sorted({x for x, _ in corners})
    for x in positions:
        values = [y for position, y in corners if position == x]
        value_before, value_after = values[0], values[-1]
        ramped_corners += [
            (x - 0.5 * ramp, value_before),
            (x + 0.5 * ramp, value_after),
        ]
    return ramped_corners


def static_error(springs: Sequence[PairExcitation], force: float) -> Wave:
    """Transmission error [m] of pairs under a static force [N], eq. 2.8.

    It is exact at the corners of all waves and at STE_POINTS positions between them.
    """
    corners, x = _corners_and_nodes(springs)
    errors_at_starts, errors_at_ends = _errors_at_nodes(springs, force, x)
    return _polygon_wave(x, errors_at_starts, errors_at_ends, corners)


def loaded_stiffness(springs: Sequence[PairExcitation], force: float) -> Wave:
    """Force over its share of the transmission error [N/m], if pairs differ."""
    corners, x = _corners_and_nodes(springs)
    loaded_errors, free_errors = (_errors_at_nodes(springs, f, x) for f in (force, 0.0))
    stiffness_at_starts, stiffness_at_ends = (
        force / (loaded_error - free_error)
        for loaded_error, free_error in zip(loaded_errors, free_errors, strict=True)
    )
    return _polygon_wave(x, stiffness_at_starts, stiffness_at_ends, corners)


def _corners_and_nodes(springs: Sequence[PairExcitation]) -> tuple[list[float], Array]:
    """Corners of all waves; positions from 0 to 1, the corners among them."""
    waves = [wave for spring in springs for wave in (spring.stiffness, spring.gap)]
    corners = sorted({corner for wave in waves for corner in wave.corners})
    grid = np.arange(STE_POINTS + 1) / STE_POINTS
    x = np.unique(np.concatenate([grid, np.array(corners)]))
    return corners, np.append(x[:-1][np.diff(x) > POSITION_TOL], 1.0)


def _errors_at_nodes(
    springs: Sequence[PairExcitation], force: float, x: Array
) -> tuple[Array, Array]:
    """Transmission errors (c, n) at the starts and ends of n pieces."""
    period = math.lcm(*(spring.period for spring in springs))
    blocks = np.array_split(np.arange(period), math.ceil(period / PITCHES_PER_BLOCK))
    errors_at_starts, errors_at_ends = (
        np.concatenate([_static_errors(springs, x[s], force, side, b) for b in blocks])
        for s, side in _PIECE_ENDS
    )
    return errors_at_starts, errors_at_ends


def _polygon_wave(
    x: Array, start_values: Array, end_values: Array, corners: list[float]
) -> Wave:
    zero = np.zeros_like(start_values)
    rows = np.stack(
        [start_values, (end_values - start_values) / np.diff(x), zero, zero], axis=-1
    )
    return Wave(x, rows if len(rows) > 1 else rows[0], tuple(corners))


_PIECE_ENDS = ((slice(None, -1), 1), (slice(1, None), -1))


def _static_errors(
    springs: Sequence[PairExcitation],
    x: Array,
    force: float,
    side: int,
    pitches: NDArray[np.int64],
) -> Array:
    """Smallest deflection (c, n) at which the pairs in contact carry the force, at
    positions x (n,) of each of the base pitches (c,)."""
    stiffness, gap = np.empty((2, len(springs), pitches.size, x.size))
    for p, spring in enumerate(springs):
        stiffness[p] = spring.stiffness(x, side, pitches[:, None])
        gap[p] = spring.gap(x, side, pitches[:, None])
    return lowest_deflection(stiffness, gap, force)


def lowest_deflection(stiffness: Array, gap: Array, force: float) -> Array:
    """Deflection [m] at which the pairs in contact carry a force [N], eq. 2.8.

    stiffness, gap : stiffness [N/m] and gap [m] of the pairs, along the first axis
    """
    gap = np.where(stiffness > 0.0, gap, np.inf)
    order = np.argsort(gap, axis=0)
    k, g = (np.take_along_axis(v, order, axis=0) for v in (stiffness, gap))
    total_stiffness = np.cumsum(k, axis=0)
    moment = np.cumsum(np.where(k > 0.0, k * np.where(k > 0.0, g, 0.0), 0.0), axis=0)
    return ((force + moment) / total_stiffness).min(axis=0)


def _excitation_by_harmonics(
    figures: StiffnessParameters, model: int, gap: Points, force: float, harmonics: int
) -> MeshExcitation:
    if harmonics < 1:
        raise ValueError(f"harmonics = {harmonics}; must be 1 or more")
    if any(value != 0.0 for _, value in gap):
        raise ValueError("harmonics represent the complete mesh; gaps need tooth pairs")
    wave = wave_from_harmonics(figures.mean, stiffness_harmonics(figures, harmonics))
    if model == 2:
        x = np.arange(STE_POINTS) / STE_POINTS
        error = force / wave(x)
        spring = PairExcitation(
            constant_wave(figures.mean), wave_from_samples(error - error.mean())
        )
    else:
        spring = PairExcitation(wave, constant_wave(0.0))
    return MeshExcitation((spring,), figures.mean)


def stiffness_harmonics(figures: StiffnessParameters, count: int) -> list[complex]:
    """Complex amplitudes c_1 ... of the trapezoid, k = mean + sum (c_s e^.. + c.c.).

    The trapezoid is a rectangle of height eps k and width c - n, centred in its double
    contact (eq. 2.29 of the multi-mesh source); a ramp multiplies by its sinc.
    """
    s = np.arange(1, count + 1)
    height = figures.mean * figures.variation
    centre = figures.start + 0.5 * figures.part
    amplitude = (
        height * figures.part * np.sinc(s * figures.part) * np.sinc(s * figures.ramp)
    )
    return list(amplitude * np.exp(-2j * np.pi * s * centre))
