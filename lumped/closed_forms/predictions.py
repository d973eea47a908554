"""All resonances that the meshes of a train excite, with their closed forms."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from lumped.closed_forms.frequency_response import (
    SteadyVibration,
    critical_damping,
    instability_interval,
    peak,
    peak_amplitude,
    transition_frequencies,
)
from lumped.closed_forms.limits import limits
from lumped.closed_forms.parametric import ParametricSystem
from lumped.closed_forms.resonance import Resonance, resonance
from lumped.closed_forms.superharmonic import with_superharmonic
from lumped.common.short_repr import ShortRepr
from lumped.train.modes import MIN_RESONANCE_ENERGY

KINDS = {
    Fraction(1, 2): "subharmonic",
    Fraction(1): "fundamental",
    Fraction(2): "second harmonic",
}


@dataclass(frozen=True, eq=False, kw_only=True)
class Prediction(ShortRepr):
    """Resonance and its closed forms; all frequencies are those of the first mesh.

    Attributes
    ----------
    resonance : Resonance
        Drives of the resonance.
    kinds : mapping of int to str
        Kind of resonance for each mesh that excites it, by mesh index.
    top : SteadyVibration or None
        Vibration at the peak; None if nothing drives directly or no peak is finite.
    transitions : tuple of (tuple of 2 float or None)
        For each mesh the frequencies between which it loses contact, None if it does
        not; the loss begins at the upper one.
    unstable : tuple of 2 float or None
        Frequencies between which a motion at half the frequency grows.
    critical_damping : float
        Damping ratio from which on no such motion grows.
    limits : tuple of str
        Sentences on the assumptions that do not hold.
    """

    resonance: Resonance
    kinds: Mapping[int, str]
    top: SteadyVibration | None
    transitions: tuple[tuple[float, float] | None, ...]
    unstable: tuple[float, float] | None
    critical_damping: float
    limits: tuple[str, ...]


def predictions(system: ParametricSystem) -> tuple[Prediction, ...]:
    """Fundamental, second-harmonic and subharmonic resonances, by rising frequency.

    All modes with part of their strain energy in the meshes are included. The drive of
    second harmonics includes that of two first harmonics together, see `superharmonic`.

    Parameters
    ----------
    system : ParametricSystem
        Modes and harmonics of the train.

    Returns
    -------
    tuple of Prediction
        All resonances that are driven.
    """
    candidates = [_predict(system, mode, order) for mode, order in _resonances(system)]
    driven = [p for p in candidates if p.resonance.drive or p.resonance.parametric]
    return tuple(sorted(driven, key=lambda prediction: prediction.resonance.at))


def _resonances(system: ParametricSystem) -> Iterator[tuple[int, Fraction]]:
    orders = sorted({kind * rate for kind in KINDS for rate in system.rates})
    for mode in range(system.modes):
        if system.energy[:, mode].sum() >= MIN_RESONANCE_ENERGY:
            yield from ((mode, order) for order in orders)


def _predict(system: ParametricSystem, mode: int, order: Fraction) -> Prediction:
    near = resonance(system, mode, order)
    by_mesh = {
        mesh: KINDS[order / rate]
        for mesh, rate in enumerate(system.rates)
        if order / rate in KINDS
    }
    if "second harmonic" in by_mesh.values():
        near = with_superharmonic(system, near)
    finite = near.drive != 0.0 and math.isfinite(peak_amplitude(near))
    pairs = (transition_frequencies(near, j) for j in range(near.shapes.size))
    return Prediction(
        resonance=near,
        kinds=by_mesh,
        top=peak(near) if finite else None,
        transitions=tuple((min(p), max(p)) if p else None for p in pairs),
        unstable=instability_interval(near),
        critical_damping=critical_damping(near),
        limits=limits(system, near),
    )
