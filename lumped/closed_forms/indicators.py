"""Effect of mesh phase and contact ratio on the drive of a resonance, eq. 3.45 to 3.50.

The drives of the meshes are complex numbers that add up; the modulus of the sum, |R3|,
|R3 tilde| or |Q3|, indicates how strong a resonance is. A delay of one mesh turns the
drive of that mesh.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def rectangular_harmonic(
    variation: float, contact_ratio: float, delay: float = 0.0, order: int = 1
) -> complex:
    """Harmonic m of a rectangular mesh stiffness over its mean, eq. 3.13 and 4.5.

    The amplitude of e^(+i m w t) is eps sin(m pi c) e^(i m (pi c - phi)) / (m pi). Both
    equations print the conjugate with the opposite sign, which leaves the magnitude of
    every sum unchanged.

    variation : eps, peak to peak over mean
    contact_ratio : c
    delay : phi, delay of the drop to fewer tooth pairs after w t = 0 [rad of the mesh
        cycle]
    order : m, from 1
    """
    if order < 1:
        raise ValueError(f"order must be 1 or more, got {order}")
    size = variation * math.sin(order * math.pi * contact_ratio) / (order * math.pi)
    turn = order * (math.pi * contact_ratio - delay)
    return size * complex(math.cos(turn), math.sin(turn))


def rectangular_indicator(
    weights: Sequence[float],
    variations: Sequence[float],
    contact_ratios: Sequence[float],
    delays: Sequence[float],
    orders: Sequence[int],
) -> float:
    """Resonance indicator |sum_j weight_j z_j| of rectangular stiffness waves.

    Each argument has one number per mesh. With the weights s_jr C_j k_j / k_1 the
    result is |R3| of eq. 3.45 to 3.48 and 4.32 (3.49 and 3.50 print it over eps, with
    1/2 for Lambda_1 / pi); with s_jr^2 k_j / k_1 it is |Q3| of 3.47 and |R4| of 4.33.
    Eq. 4.35 includes in |R3| the first harmonic of a mesh of twice the resonant
    frequency; by derivation that harmonic drives parametrically. Eq. 4.35 and 4.38
    contain numbers that differ from those of 4.32, such as 1 / pi instead of 1 / pi^2.
    Eq. 4.34 is omitted, like 4.28, on which it is based.

    orders : harmonic of each mesh that falls on the resonance, 1 and z of eq. 4.32
    """
    columns = (weights, variations, contact_ratios, delays, orders)
    terms = (
        weight * rectangular_harmonic(eps, ratio, delay, order)
        for weight, eps, ratio, delay, order in zip(*columns, strict=True)
    )
    return abs(sum(terms))


@dataclass(frozen=True)
class PhaseExtremes:
    """Extremes of |f| or |p| over the delay of one mesh.

    largest, least : extreme magnitudes
    at_largest, at_least : additional delays of the mesh at which they occur, from 0 to
        below 1 [of its own cycle]; both repeat `times` times per cycle
    """

    largest: float
    least: float
    at_largest: float
    at_least: float
    times: int


def phase_extremes(by_mesh: ArrayLike, mesh: int, harmonic: int) -> PhaseExtremes:
    """Critical mesh phases, below eq. 3.46 to 3.48 and eq. 4.36, for any waves.

    by_mesh : (m,) drives or parametric drives, complex
    harmonic : harmonic of the mesh that produces its drive, 2 for a second harmonic
    """
    drives = np.asarray(by_mesh, complex)
    drive, others = complex(drives[mesh]), complex(drives.sum() - drives[mesh])
    if harmonic < 1:
        raise ValueError(f"harmonic must be 1 or more, got {harmonic}")
    # a delay of x cycles turns the own drive by -2 pi harmonic x
    lead = float(np.angle(drive) - np.angle(others)) / (2.0 * math.pi)
    return PhaseExtremes(
        largest=abs(others) + abs(drive),
        least=abs(abs(others) - abs(drive)),
        at_largest=lead % 1.0 / harmonic,
        at_least=(lead + 0.5) % 1.0 / harmonic,
        times=harmonic,
    )
