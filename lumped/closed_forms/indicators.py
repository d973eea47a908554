"""How mesh phase and contact ratio set the drive of a resonance: eq. 3.45 to 3.50.

Drives of the meshes are complex numbers that add; their sum |R3|, |R3 tilde| or |Q3|
indicates how strong a resonance is. A delay of one mesh turns its own.
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

    eps sin(m pi c) e^(i m (pi c - phi)) / (m pi), of e^(+i m w t). Both print the
    conjugate with the other sign, which changes no magnitude of a sum.

    variation : eps, peak to peak over mean; contact_ratio : c
    delay : phi, of the drop to fewer tooth pairs after w t = 0 [rad of the mesh cycle]
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
    """|sum_j weight_j z_j| of rectangular waves, a number for each mesh.

    With weights s_jr C_j k_j / k_1 it is |R3| of eq. 3.45 to 3.48 and 4.32 (3.49 and
    3.50 print it over eps, with 1/2 for Lambda_1 / pi), with s_jr^2 k_j / k_1 it is
    |Q3| of 3.47 and |R4| of 4.33. Eq. 4.35 has the first harmonic of a mesh of twice
    the resonant frequency in |R3|; derived, it drives parametrically. 4.35 and 4.38
    have other numbers than 4.32 gives them, such as 1 / pi for 1 / pi^2. 4.34 is left
    out with 4.28, on which it stands.

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

    largest, least : magnitudes; at_largest, at_least : further delays of the mesh from
        0 to below 1 [of its own cycle]; both repeat `times` times a cycle
    """

    largest: float
    least: float
    at_largest: float
    at_least: float
    times: int


def phase_extremes(by_mesh: ArrayLike, mesh: int, harmonic: int) -> PhaseExtremes:
    """The critical mesh phases below eq. 3.46 to 3.48, and eq. 4.36, of any waves.

    by_mesh : (m,) drives or parametric drives, complex
    harmonic : of the mesh that gives its drive, 2 for a second harmonic
    """
    drives = np.asarray(by_mesh, complex)
    own, others = complex(drives[mesh]), complex(drives.sum() - drives[mesh])
    if harmonic < 1:
        raise ValueError(f"harmonic must be 1 or more, got {harmonic}")
    # a delay of x cycles turns the own drive by -2 pi harmonic x
    lead = float(np.angle(own) - np.angle(others)) / (2.0 * math.pi)
    return PhaseExtremes(
        largest=abs(others) + abs(own),
        least=abs(abs(others) - abs(own)),
        at_largest=lead % 1.0 / harmonic,
        at_least=(lead + 0.5) % 1.0 / harmonic,
        times=harmonic,
    )
