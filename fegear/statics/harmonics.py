"""Harmonics of the mesh frequency in a quantity over the mesh cycle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.train.elastic_inertia import harmonic_amplitudes


@dataclass(frozen=True)
class Harmonic:
    """The part ``amplitude cos(2 pi order position + phase)`` of a mesh cycle.

    Attributes
    ----------
    order : int
        Frequency over the mesh frequency.
    amplitude : float
        In the unit of the quantity, zero to peak.
    phase : float
        Phase at position 0, the pitch point of the reference pair, from -pi to pi
        [rad].
    """

    order: int
    amplitude: float
    phase: float


def mesh_harmonics(
    values: ArrayLike, count: int, pitches: int = 1
) -> tuple[Harmonic, ...]:
    """The first harmonics of the mesh frequency.

    Parameters
    ----------
    values : (n,) array
        Quantity at equal steps over the cycle, its first value not repeated.
    count : int
        Number of harmonics. Those of half the positions per base pitch and above are
        left out, as the positions do not resolve them.
    pitches : int, optional
        Number of base pitches that the values cover. Frequencies between the harmonics
        are those of pitch errors and are left out.

    Returns
    -------
    tuple of Harmonic
        In rising order, from 1.
    """
    samples: NDArray[np.float64] = np.asarray(values, float)
    resolved = (samples.size // pitches - 1) // 2
    orders = range(1, min(count, resolved) + 1)
    amplitudes = harmonic_amplitudes(samples) if resolved else ()
    parts = ((order, amplitudes[order * pitches - 1]) for order in orders)
    return tuple(
        Harmonic(order, float(np.abs(part)), float(np.angle(part)))
        for order, part in parts
    )
