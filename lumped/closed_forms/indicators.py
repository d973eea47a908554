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
from numpy.typing import ArrayLike


def rectangular_harmonic(
    variation: float, contact_ratio: float, delay: float = 0.0, order: int = 1
) -> complex:
    """Harmonic m of a rectangular mesh stiffness over its mean.

    Parameters
    ----------
    variation : float
        Variation eps, peak to peak over mean.
    contact_ratio : float
        Contact ratio c.
    delay : float, optional
        Delay phi of the drop to fewer tooth pairs after w t = 0 [rad of the mesh
        cycle].
    order : int, optional
        Number m of the harmonic, from 1.

    Returns
    -------
    complex
        Amplitude of e^(+i m w t), ``eps sin(m pi c) e^(i m (pi c - phi)) / (m pi)``.

    Raises
    ------
    ValueError
        If the order is below 1.

    Notes
    -----
    Eq. 3.13 and 4.5 of the multi-mesh source. Both print the conjugate with the
    opposite sign, which leaves the magnitude of every sum unchanged.
    """
    if order < 1:
        raise ValueError(f"order = {order}; must be 1 or more")
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
    """Resonance indicator of rectangular stiffness waves.

    It is ``|sum_j weight_j z_j|``. Each argument has one number per mesh.

    Parameters
    ----------
    weights : sequence of float
        Weights of the meshes, such as s_jr C_j k_j / k_1 [m].
    variations : sequence of float
        Variations of the stiffness, peak to peak over mean.
    contact_ratios : sequence of float
        Contact ratios.
    delays : sequence of float
        Delays of the drop to fewer tooth pairs [rad of the mesh cycle].
    orders : sequence of int
        Harmonic of each mesh that falls on the resonance, 1 and z of eq. 4.32.

    Returns
    -------
    float
        Indicator, in the unit of the weights.

    Raises
    ------
    ValueError
        If the arguments differ in length or an order is below 1.

    Notes
    -----
    With the weights s_jr C_j k_j / k_1 the result is ``|R3|`` of eq. 3.45 to 3.48 and
    4.32 of the multi-mesh source (3.49 and 3.50 print it over eps, with 1/2 for
    Lambda_1 / pi); with s_jr^2 k_j / k_1 it is ``|Q3|`` of 3.47 and ``|R4|`` of 4.33.
    Eq. 4.35 includes in ``|R3|`` the first harmonic of a mesh of twice the resonant
    frequency; by derivation that harmonic drives parametrically. Eq. 4.35 and 4.38
    contain numbers that differ from those of 4.32, such as 1 / pi instead of 1 / pi^2.
    Eq. 4.34 is omitted, like 4.28, on which it is based.
    """
    columns = (weights, variations, contact_ratios, delays, orders)
    terms = (
        weight * rectangular_harmonic(eps, ratio, delay, order)
        for weight, eps, ratio, delay, order in zip(*columns, strict=True)
    )
    return abs(sum(terms))


@dataclass(frozen=True)
class PhaseExtremes:
    """Extremes of a drive's magnitude over the delay of one mesh.

    Attributes
    ----------
    largest, least : float
        Extreme magnitudes, in the unit of the drive.
    at_largest, at_least : float
        Additional delays of the mesh at which they occur, from 0 to below 1 [cycles of
        this mesh].
    times : int
        Number of times per cycle that each of them occurs.
    """

    largest: float
    least: float
    at_largest: float
    at_least: float
    times: int


def phase_extremes(by_mesh: ArrayLike, mesh: int, harmonic: int) -> PhaseExtremes:
    """Critical phases of a mesh, for any stiffness waves.

    Parameters
    ----------
    by_mesh : (m,) complex array_like
        Direct or parametric drives of the meshes.
    mesh : int
        Index of the mesh whose phase varies, from 0.
    harmonic : int
        Harmonic of the mesh that produces its drive, 2 for a second harmonic.

    Returns
    -------
    PhaseExtremes
        Largest and least magnitude of the sum, and where they occur.

    Raises
    ------
    ValueError
        If the harmonic is below 1.

    Notes
    -----
    Below eq. 3.46 to 3.48 and eq. 4.36 of the multi-mesh source.
    """
    drives = np.asarray(by_mesh, complex)
    drive, others = complex(drives[mesh]), complex(drives.sum() - drives[mesh])
    if harmonic < 1:
        raise ValueError(f"harmonic = {harmonic}; must be 1 or more")
    # a delay of x cycles turns the own drive by -2 pi harmonic x
    lead = float(np.angle(drive) - np.angle(others)) / (2.0 * math.pi)
    return PhaseExtremes(
        largest=abs(others) + abs(drive),
        least=abs(abs(others) - abs(drive)),
        at_largest=lead % 1.0 / harmonic,
        at_least=(lead + 0.5) % 1.0 / harmonic,
        times=harmonic,
    )
