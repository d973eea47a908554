"""Speeds at which two sweeps are on different branches of coexisting motions.

There an error says nothing about a model: both have both motions, and reached another
one. A speed counts so where the error is beyond a bound, and either the periods after
which both motions repeat differ, or one of both agrees with the other in the opposite
direction of the speed, so that it is known to have that motion as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Mask
from lumped.steady.jumps import Jump, Peak
from validation.study.metrics import MeasuredCurve

SAME_MOTION, OTHER_MOTION = 0.02, 0.08  # errors up to and beyond which it is one
MAX_SHARE = 0.25  # of the speeds: with more on other branches nothing is known


def on_other_branch(errors: Array, periods_differ: Mask, is_reached: Mask) -> Mask:
    """Speeds (s,) at which two motions are on different branches.

    errors : (s,) relative, of the worst mesh
    periods_differ : whether the motions repeat after different times
    is_reached : whether one agrees with the other in the opposite direction
    """
    beyond = (errors > OTHER_MOTION) & np.isfinite(errors)
    return np.asarray(beyond & (periods_differ | is_reached))


def speeds_on_other_branches(
    reference: Sequence[MeasuredCurve], model: Sequence[MeasuredCurve], direction: str
) -> tuple[Array, Array]:
    """Common speeds (s,) of a direction [Hz], and those of them on another branch.

    reference, model : curves of all meshes and directions, each
    """
    model_curves, reference_curves = (
        _curves_of_direction(model, direction),
        _curves_of_direction(reference, direction),
    )
    common = _common([*model_curves, *reference_curves])
    errors = _errors(reference_curves, model_curves, common)
    reached = np.zeros(common.size, bool)
    opposite = "down" if direction == "up" else "up"
    for one, other in (
        (reference_curves, _curves_of_direction(model, opposite)),
        (_curves_of_direction(reference, opposite), model_curves),
    ):
        if one and other:
            reached |= _errors(one, other, common) <= SAME_MOTION
    differ = np.zeros(common.size, bool)
    for a, b in zip(reference_curves, model_curves, strict=True):
        if a.period_multiple is not None and b.period_multiple is not None:
            differ |= _values_at_speeds(
                a, a.period_multiple, common
            ) != _values_at_speeds(b, b.period_multiple, common)
    return common, common[on_other_branch(errors, differ, reached)]


def without_speeds(curve: MeasuredCurve, speeds: Array) -> MeasuredCurve:
    """The curve without these speeds [Hz], and the peaks and jumps at them."""
    stays = ~np.isin(curve.frequency, speeds)
    arrays = {
        name: getattr(curve, name)[stays]
        for name in ("frequency", "dte_rms", "force_peak", "contact_loss")
    }

    def is_apart(feature: Jump | Peak) -> bool:
        if isinstance(feature, Jump):
            ends = [feature.frequency_from, feature.frequency_to]
            return bool(np.isin(ends, speeds).any())
        return bool(np.isin(feature.frequency, speeds))

    return replace(
        curve,
        **arrays,
        period_multiple=None,
        jumps=tuple(jump for jump in curve.jumps if not is_apart(jump)),
        peaks=tuple(peak for peak in curve.peaks if not is_apart(peak)),
    )


def advice(common: Array, others: Array) -> str:
    """`12 of 171 speeds, 1600 to 1700 Hz, are on another branch; ...` smaller steps."""
    step = float(np.diff(common).min()) if common.size > 1 else 0.0
    text = (
        f"{others.size} of {common.size} speeds, {others[0]:g} to {others[-1]:g} Hz, "
        "are on another branch of coexisting motions"
    )
    if step > 0.0:
        text += f"; steps of {0.5 * step:g} Hz may lead both onto one"
    return text


def _curves_of_direction(
    curves: Sequence[MeasuredCurve], direction: str
) -> list[MeasuredCurve]:
    same_direction = [curve for curve in curves if curve.direction == direction]
    return sorted(same_direction, key=lambda curve: curve.mesh)


def _common(curves: Sequence[MeasuredCurve]) -> Array:
    common = curves[0].frequency
    for curve in curves[1:]:
        common = np.intersect1d(common, curve.frequency)
    return common


def _errors(
    reference: Sequence[MeasuredCurve], model: Sequence[MeasuredCurve], speeds: Array
) -> Array:
    """Error of the worst mesh at every speed (s,), infinite where either lacks it."""
    return np.max(list(_errors_of_meshes(reference, model, speeds)), axis=0)


def _errors_of_meshes(
    reference: Sequence[MeasuredCurve], model: Sequence[MeasuredCurve], speeds: Array
) -> Iterator[Array]:
    for a, b in zip(reference, model, strict=True):
        here, there = (
            _values_at_speeds(curve, curve.dte_rms, speeds) for curve in (a, b)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.abs(there / here - 1.0)
        yield np.where(np.isfinite(error), error, np.inf)


def _values_at_speeds(curve: MeasuredCurve, values: NDArray, speeds: Array) -> Array:
    """Values of a curve at speeds (s,), NaN where it lacks them."""
    places = np.searchsorted(curve.frequency, speeds)
    places = np.minimum(places, curve.frequency.size - 1)
    present = curve.frequency[places] == speeds
    return np.where(present, values[places], np.nan)
