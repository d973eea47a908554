"""Softening of a mode by lost contact: eq. 3.30 and the backbone of eq. 3.31."""

from __future__ import annotations

import numpy as np

from lumped.closed_forms.resonance import Resonance
from lumped.common.array_types import Array
from lumped.common.checks import format_number


def contact_loss_amplitude(resonance: Resonance) -> Array:
    """Modal amplitudes at which each mesh begins to lose contact.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train with m meshes.

    Returns
    -------
    (m,) array
        Amplitudes ``|C_j / (2 v_jr)|`` [sqrt(J)], infinite if the mode does not deflect
        the mesh. C_j is the elastic part of the mean deflection.

    Notes
    -----
    Eq. 3.33 and 4.22 of the multi-mesh source.
    """
    with np.errstate(divide="ignore"):
        return 0.5 * resonance.elastic / np.abs(resonance.shapes)


def separation_angle(resonance: Resonance, amplitude: float) -> Array:
    """Half of the angle of a cycle without contact.

    Contact is lost for the fraction theta_j / pi of a cycle, about the lowest point of
    that mesh: at once in all meshes whose v_jr have the same sign, and half a cycle
    later in the others.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train with m meshes.
    amplitude : float
        Modal amplitude alpha [sqrt(J)], positive.

    Returns
    -------
    (m,) array
        Angles theta_j [rad], with ``cos(theta_j) = C_j / (2 |v_jr| alpha)``; 0 below
        the amplitude of first loss.

    Raises
    ------
    ValueError
        If the amplitude is not positive.

    Notes
    -----
    Eq. 3.30 and 4.16 of the multi-mesh source, which print two cases where there is
    one.
    """
    if not amplitude > 0.0:
        raise ValueError(f"amplitude = {format_number(amplitude)}; must be positive")
    return np.arccos(np.minimum(contact_loss_amplitude(resonance) / amplitude, 1.0))


def lost_stiffness(resonance: Resonance, amplitude: float) -> float:
    """Mean fraction B of the modal stiffness that is lost with contact.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train.
    amplitude : float
        Modal amplitude alpha [sqrt(J)], positive.

    Returns
    -------
    float
        ``B = sum_j k_j v_jr^2 (theta_j - sin(theta_j) cos(theta_j)) / pi``, the first
        harmonic of the force that is lost over the amplitude.

    Raises
    ------
    ValueError
        If the amplitude is not positive.

    Notes
    -----
    B equals -(R1 + R2 / alpha) / c_r^2 of eq. 3.32 and 4.20 of the multi-mesh source,
    or with Q1 and Q2 that of 3.36, if C_j is replaced by ``2 |v_jr| alpha
    cos(theta_j)``. Eq. 3.15 prints a series that counts h_0 and g_0 twice; 3.24 and
    3.32 count them once.
    """
    theta = separation_angle(resonance, amplitude)
    lost = (theta - np.sin(theta) * np.cos(theta)) / np.pi
    return float(resonance.energy @ lost)


def lost_stiffness_slope(resonance: Resonance, amplitude: float) -> float:
    """Slope alpha dB / d alpha, from d theta_j / d alpha = cot(theta_j) / alpha."""
    theta = separation_angle(resonance, amplitude)
    return float(resonance.energy @ np.sin(2.0 * theta)) / np.pi


def backbone(resonance: Resonance, amplitude: float) -> float:
    """Mesh frequency of free vibration at an amplitude.

    It falls with the amplitude, as contact is lost.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train.
    amplitude : float
        Modal amplitude alpha [sqrt(J)], positive.

    Returns
    -------
    float
        Frequency w = w_r (1 - B / 2) / h of the first mesh, in the unit of the system.

    Raises
    ------
    ValueError
        If the amplitude is not positive.

    Notes
    -----
    Below eq. 3.32 of the multi-mesh source.
    """
    return resonance.at * (1.0 - 0.5 * lost_stiffness(resonance, amplitude))
