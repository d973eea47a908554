"""Measured profiles between their points, for kernels and for curves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fegear.gearset.modifications import FlankProfile
from lumped.common.array_types import Array

END_RTOL = 1e-6  # of a flank: a profile that ends so near its end ends there
KINK_SLOPE = 1e-6  # change of slope, depth over roll length, that counts as a kink


def profile_record(profile: FlankProfile | None, start: float, tip: float) -> Any:
    """The kernel's record of a profile.

    start, tip : roll lengths at which the active profile begins and ends [m]
    """
    from fegear.contact.plane.kernels.flanks import PROFILE

    record = np.zeros((), PROFILE)
    record["half_range"] = 1.0
    if profile is None:
        return record[()]
    record["is_there"] = True
    record["middle"], record["half_range"] = 0.5 * (start + tip), 0.5 * (tip - start)
    record["crowning"], record["slope"] = profile.crowning, profile.slope
    record["is_linear"] = profile.interpolation == "linear"
    count = len(profile.roll_lengths)
    record["count"] = count
    record["roll"][:count] = profile.roll_lengths
    record["depth"][:count] = -np.array(profile.deviations)
    record["knot_slope"][:count] = _knot_slopes(profile, start, tip)
    return record[()]


def _knot_slopes(profile: FlankProfile, start: float, tip: float) -> Array:
    """Slopes (n,) of the depth at measured points.

    Those of the monotone cubic of Fritsch and Butland (1984), but for zero where the
    points end within the active profile, on which the depth is constant from there.
    """
    from scipy.interpolate import PchipInterpolator

    if not profile.is_measured:
        return np.empty(0)
    rolls, depths = np.array(profile.roll_lengths), -np.array(profile.deviations)
    with np.errstate(over="ignore"):  # depths of no size
        slopes: Array = PchipInterpolator(rolls, depths).derivative()(rolls)
    for end in _free_ends(profile, start, tip):
        slopes[end] = 0.0
    return slopes


def _free_ends(profile: FlankProfile, start: float, tip: float) -> list[int]:
    """0 and -1 where the first or last point lies within the active profile."""
    margin = END_RTOL * (tip - start)
    first, last = profile.roll_lengths[0], profile.roll_lengths[-1]
    ends = {0: first > start + margin, -1: last < tip - margin}
    return [end for end, is_free in ends.items() if is_free]


def profile_depth(
    profile: FlankProfile, roll_length: ArrayLike, start: float, tip: float
) -> Array:
    """Material removed (n,) at roll lengths (n,), negative where there is excess [m].

    start, tip : roll lengths at which the active profile begins and ends [m]
    """
    from scipy.interpolate import CubicHermiteSpline

    s = np.asarray(roll_length, float)
    fraction = (s - start) / (tip - start)
    depth: Array = profile.crowning * (2.0 * fraction - 1.0) ** 2
    depth = depth - profile.slope * fraction
    if not profile.is_measured:
        return depth
    rolls, depths = np.array(profile.roll_lengths), -np.array(profile.deviations)
    if profile.interpolation == "linear":
        return depth + np.interp(s, rolls, depths)
    cubic = CubicHermiteSpline(rolls, depths, _knot_slopes(profile, start, tip))
    return np.asarray(depth + cubic(np.clip(s, rolls[0], rolls[-1])))


def profile_kinks(profile: FlankProfile, start: float, tip: float) -> Array:
    """Roll lengths (k,) within the active profile at which the slope jumps [m].

    A cubic has none.
    """
    if profile.interpolation == "cubic" or not profile.is_measured:
        return np.empty(0)
    rolls = np.array(profile.roll_lengths)
    chords = np.diff(profile.deviations) / np.diff(rolls)
    jumps = np.abs(np.diff(np.concatenate([[0.0], chords, [0.0]])))
    inside = (rolls > start) & (rolls < tip - END_RTOL * abs(tip))
    return rolls[inside & (jumps > KINK_SLOPE)]
