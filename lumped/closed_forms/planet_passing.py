"""Orders of the sidebands that planets make as they pass a sensor on the ring.

P. D. McFadden and J. D. Smith, An explanation for the asymmetry of the modulation
sidebands about the tooth meshing frequency in epicyclic gear vibration, Proc. Inst.
Mech. Eng. C 199 (1985) 65; M. Inalpolat and A. Kahraman, A theoretical and experimental
investigation of modulation sidebands of planetary gear sets, J. Sound Vib. 323 (2009)
677.

The force F_n of each planet's mesh on the ring has the harmonics m of the mesh, m z_r
cycles in a turn of the carrier against the ring, and the window w, through which the
sensor feels it, the orders of that turn. Their product has at order k

    S_k = sum_n sum_m C_nm W_j exp(i s j (psi_n - alpha)),  j = k - m z_r

with the coefficients C_nm of the forces and W_j of the window, the direction alpha of
the sensor, those psi_n of the planets at the start, and the sense s in which these
turn. Equal planets have F_n(t) = F_1(t + s (psi_n - psi_1) / (2 pi)), t in turns, as
each does at a tooth of the ring what the planet before it did, and then

    |S_k| = |sum_n exp(i k psi_n)| |sum_m C_1m W_j exp(-i s j alpha_1)|

with alpha_1 = alpha - psi_1. Equally spaced ones leave the multiples k of their number:
a harmonic of the mesh is at none of them where m z_r is no such multiple.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from lumped.common.array_types import Array, Complex


def phasor_sums(positions: ArrayLike, orders: ArrayLike) -> Array:
    """Sum over planets of unit phasors at orders of the carrier.

    Parameters
    ----------
    positions : (n,) array_like
        Directions psi_n of the planets [rad].
    orders : (k,) array_like
        Cycles per turn of the carrier against the ring.

    Returns
    -------
    (k,) array
        ``|sum_n exp(i k psi_n)|``, the number of planets where all are in phase.
    """
    angles, order = np.asarray(positions, float), np.asarray(orders, float)
    return np.asarray(np.abs(np.exp(1j * order[:, None] * angles).sum(axis=1)))


def window_coefficients(width: float, orders: ArrayLike) -> Array:
    """Fourier coefficients of a Hann window over the angle.

    Parameters
    ----------
    width : float
        Full width B of the window [rad], up to a turn.
    orders : array_like of int
        Orders j.

    Returns
    -------
    array
        ``W_j`` of ``sum_j W_j exp(i j theta)``, real and even.
    """
    half = 0.5 * width * np.asarray(orders, float) / math.pi  # np.sinc has this pi
    sum_of_lines = np.sinc(half) + 0.5 * (np.sinc(half - 1.0) + np.sinc(half + 1.0))
    return np.asarray(width / (4.0 * math.pi) * sum_of_lines)


def passing_amplitudes(
    harmonics: ArrayLike,
    positions: ArrayLike,
    teeth: int,
    orders: ArrayLike,
    *,
    sensor: float = 0.0,
    width: float | None = None,
    sense: int = 1,
) -> Array:
    """Amplitudes of the sensor's signal at orders of the carrier.

    Parameters
    ----------
    harmonics : (n, m) array_like
        Coefficients C_nm of ``exp(2 pi i m t)`` of each planet's force over its mesh
        cycles t, m = 0, 1, ...; those of negative m are their conjugates.
    positions : (n,) array_like
        Directions of the planets at the start [rad].
    teeth : int
        Teeth z_r of the ring.
    orders : (k,) array_like of int
        Cycles per turn of the carrier against the ring.
    sensor : float, optional
        Direction of the sensor [rad].
    width : float, optional
        Full width of the window [rad]; a turn over the number of planets by default.
    sense : int, optional
        1 where the carrier turns counter-clockwise against the ring, else -1.

    Returns
    -------
    (k,) array
        One-sided amplitudes, the mean at order 0.
    """
    positive = np.asarray(harmonics, complex)
    angles, order = np.asarray(positions, float), np.asarray(orders)
    if width is None:
        width = 2.0 * math.pi / angles.size
    lines: Complex = np.concatenate([positive[:, :0:-1].conj(), positive], axis=1)
    multiple = np.arange(1 - positive.shape[1], positive.shape[1])
    j = order[:, None] - teeth * multiple
    turned = np.exp(1j * sense * j[:, None, :] * (angles - sensor)[:, None])
    sums = np.abs(
        (lines * window_coefficients(width, j)[:, None, :] * turned).sum((1, 2))
    )
    return np.where(order == 0, sums, 2.0 * sums)
