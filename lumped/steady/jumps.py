"""Jumps between branches and peaks in a frequency response.

At a jump, the straight continuations of the curves left and right of a step miss each
other by far more than the curves change next to it. At a peak, however sharp, the
changes next to a step are of the size of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array
from lumped.steady.sweep import Branch, Direction

MIN_JUMP_MISS = 3.0  # least miss of a jump over the changes next to the step
MIN_SIMULTANEOUS_MISS = 1.5  # the same, for the other meshes at a speed where one jumps
MIN_MISS_OF_VALUE = 0.1  # least miss of a jump over the larger value
MIN_MISS_OF_MAXIMUM = 1e-3  # least miss of a jump over the largest value of the curve
BRANCH_RTOL = 0.02  # relative difference below which two branches are equal
# Least height of a peak over its feet, per largest value of the curve
MIN_PROMINENCE = 0.1
MAX_FLAT_RMS = 1e-12  # m, curves below are flat


@dataclass(frozen=True)
class Jump:
    """Step between neighbouring speeds, in the order in which they were passed.

    mesh : number of the mesh, from 1
    frequency_from, frequency_to : frequencies of the first mesh [Hz]
    dte_rms_from, dte_rms_to : RMS of the dynamic transmission error [m]
    """

    direction: Direction
    mesh: int
    frequency_from: float
    frequency_to: float
    dte_rms_from: float
    dte_rms_to: float


@dataclass(frozen=True)
class Peak:
    """Local or global maximum of the RMS of the dynamic transmission error.

    mesh : number of the mesh, from 1
    frequency : frequency of the first mesh [Hz]
    dte_rms : RMS of the dynamic transmission error [m]
    force_peak : largest mesh force [N]
    contact_loss, back_side : fractions of the time
    """

    direction: Direction
    mesh: int
    frequency: float
    dte_rms: float
    force_peak: float
    contact_loss: float
    back_side: float


def find_jumps(branch: Branch, opposite: Branch | None = None) -> list[Jump]:
    """Jumps in the order of the branch, one for each mesh whose curve has a step.

    opposite : branch of the same train passed in the other direction; a step that it
        also has, between the same values, is a steep resonance and no jump
    """
    frequency, rms = branch.frequency_Hz, branch.column("dte_rms")
    if len(frequency) < 4:
        return []
    miss = np.stack([relative_miss(frequency, curve) for curve in rms.T])
    is_jump = (miss > MIN_JUMP_MISS).any(axis=0)
    if opposite is not None:
        same = _equal_responses(branch, opposite)
        is_jump &= ~(same[:-1] & same[1:])
    return [
        Jump(
            direction=branch.direction,
            mesh=int(m) + 1,
            frequency_from=float(frequency[i]),
            frequency_to=float(frequency[i + 1]),
            dte_rms_from=float(rms[i, m]),
            dte_rms_to=float(rms[i + 1, m]),
        )
        for i in np.flatnonzero(is_jump)
        for m in np.flatnonzero(miss[:, i] > MIN_SIMULTANEOUS_MISS)
    ]


def _equal_responses(branch: Branch, opposite: Branch) -> NDArray[np.bool_]:
    """Speeds at which both branches have the same values in all meshes."""
    opposite_rms = dict(
        zip(opposite.frequency_Hz, opposite.column("dte_rms"), strict=True)
    )
    return np.array(
        [
            f in opposite_rms
            and np.allclose(rms, opposite_rms[f], rtol=BRANCH_RTOL, atol=0.0)
            for f, rms in zip(
                branch.frequency_Hz, branch.column("dte_rms"), strict=True
            )
        ]
    )


def opposite_branches(branches: Sequence[Branch]) -> list[Branch | None]:
    """Branches of the same systems that were passed in the other direction, or None."""
    return [
        next(
            (
                other
                for other in branches
                if other.system is branch.system
                and other.direction != branch.direction
                and other.responses
            ),
            None,
        )
        for branch in branches
    ]


def relative_miss(frequency: Array, values: Array) -> Array:
    """Miss of the straight continuations in each step over the changes next to it.

    The shape is (n - 1,). The miss is 0 where it is negligible, where a value is NaN
    and where a neighbour is missing.
    """
    out = np.zeros(max(frequency.size - 1, 0))
    if frequency.size < 4:
        return out
    width = np.abs(np.diff(frequency))
    slope = np.diff(values) / np.where(width > 0.0, width, np.nan)
    before, step, after = (slope[s] * width[1:-1] for s in _NEIGHBOURS)
    magnitude = np.abs(values)
    miss = np.abs(step - 0.5 * (before + after))
    neighbour_change = np.maximum(np.abs(before), np.abs(after))
    with np.errstate(invalid="ignore"):  # comparisons with NaN are false
        floor = np.maximum(
            MIN_MISS_OF_VALUE * np.maximum(magnitude[1:-2], magnitude[2:-1]),
            MAX_FLAT_RMS,
        )
        is_significant = miss > np.fmax(
            floor, MIN_MISS_OF_MAXIMUM * np.nanmax(magnitude, initial=0.0)
        )
    tiny = np.finfo(float).tiny
    out[1:-1][is_significant] = miss[is_significant] / np.maximum(
        neighbour_change[is_significant], tiny
    )
    return out


_NEIGHBOURS = (slice(None, -2), slice(1, -1), slice(2, None))


def find_peaks(branch: Branch) -> list[Peak]:
    """Peaks by mesh and rising frequency; the ends of a curve are feet, not peaks."""
    order = np.argsort(branch.frequency_Hz, kind="stable")
    rms = branch.column("dte_rms")
    return [
        _peak(branch, int(order[i]), m)
        for m in range(len(branch.system.excitations))
        if len(order)
        for i in prominent_maxima(rms[order, m])
    ]


def largest_responses(branch: Branch) -> list[Peak]:
    """Largest RMS of each mesh, whether a peak or not; none without a motion."""
    rms = branch.column("dte_rms")
    if not np.isfinite(rms).any():
        return []
    return [_peak(branch, int(i), m) for m, i in enumerate(np.nanargmax(rms, axis=0))]


def _peak(branch: Branch, i: int, m: int) -> Peak:
    columns = ("dte_rms", "force_peak", "contact_loss", "back_side")
    return Peak(
        direction=branch.direction,
        mesh=m + 1,
        frequency=float(branch.frequency_Hz[i]),
        **{name: float(branch.column(name)[i, m]) for name in columns},
    )


def prominent_maxima(values: Array) -> list[int]:
    """Indices of the local maxima that are prominent on both sides.

    A maximum's feet are the lowest values on the way to anything higher.
    """
    finite = np.flatnonzero(np.isfinite(values))
    y = values[finite]
    if y.size < 3 or y.max() < MAX_FLAT_RMS:
        return []
    min_height = MIN_PROMINENCE * y.max()
    maxima = np.flatnonzero((y[1:-1] > y[:-2]) & (y[1:-1] >= y[2:])) + 1
    return [
        int(finite[i])
        for i in maxima
        if y[i] - max(_foot(y[i::-1]), _foot(y[i:])) >= min_height
    ]


def _foot(curve: Array) -> float:
    """Lowest value from way[0] until something is higher than it."""
    higher = np.flatnonzero(curve > curve[0])
    return float(curve[: higher[0] if higher.size else curve.size].min())
