"""Steady vibration near a resonance: amplitudes, frequencies, stability.

With d = 2 (1 - Omega / w_r) - B + 2i zeta the solvability condition of
`lumped.closed_forms.resonance` is, in steady state, d u + p conj(u) + f = 0, so that

    u = (p conj(f) - f conj(d)) / (|d|^2 - |p|^2).

The result is valid to first order in the stiffness variation, in zeta and in the
fraction of the time without contact; `lumped.closed_forms.limits` reports where these
assumptions fail.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lumped.closed_forms.resonance import Resonance
from lumped.closed_forms.separation import (
    contact_loss_amplitude,
    lost_stiffness,
    lost_stiffness_slope,
    separation_angle,
)
from lumped.common.array_types import Array

# A root is real if its imaginary over absolute value is below this
REAL_ROOT_RTOL = 1e-7
# Two roots are one if they differ by less than this part of the detuning
ROOT_RTOL = 1e-9


@dataclass(frozen=True, eq=False)
class SteadyVibration:
    """Steady vibration of a train with m meshes near a resonance.

    The mesh deflections are y_j = C_j + 2 v_jr alpha cos(Omega t - gamma).

    Attributes
    ----------
    frequency : float
        Frequency of the first mesh, in the unit of the system.
    amplitude : float
        Modal amplitude alpha [sqrt(J)]; mesh deflections have ``2 |v_jr| alpha`` [m].
    phase : float
        Phase gamma [rad].
    separation : (m,) array
        Angles theta_j [rad], see `separation_angle`.
    stable : bool
        Whether small changes of amplitude and phase decay.

    Notes
    -----
    Eq. 3.25 and 4.15 of the multi-mesh source.
    """

    frequency: float
    amplitude: float
    phase: float
    separation: Array
    stable: bool


def linear_amplitude(resonance: Resonance, frequency: float) -> float:
    """Modal amplitude at a mesh frequency, while no contact is lost.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train.
    frequency : float
        Frequency of the first mesh, in the unit of the system.

    Returns
    -------
    float
        Modal amplitude alpha [sqrt(J)].

    Raises
    ------
    ValueError
        If a second harmonic makes the linear motion grow without limit.

    Notes
    -----
    Eq. 2.24 of the multi-mesh source, and 2.25 if p = 0, with 4 zeta^2 where both print
    zeta^2.
    """
    d = complex(_detuning(resonance, frequency), 2.0 * resonance.damping_ratio)
    f, p = resonance.drive, resonance.parametric
    if abs(p) >= abs(d):
        raise ValueError(
            f"frequency = {frequency:g} is inside of a parametric instability, where "
            "linear motion has no limit"
        )
    return abs(p * f.conjugate() - f * d.conjugate()) / (abs(d) ** 2 - abs(p) ** 2)


def _detuning(resonance: Resonance, frequency: float) -> float:
    return 2.0 * (1.0 - frequency / resonance.at)


def steady_vibrations(
    resonance: Resonance, amplitude: float
) -> tuple[SteadyVibration, ...]:
    """All steady vibrations with a modal amplitude, by rising frequency.

    If p = 0, there are two up to the peak, below and above the backbone. If f = 0,
    there are two at every amplitude, unless the damping is too large. With both, there
    are up to four.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train.
    amplitude : float
        Modal amplitude alpha [sqrt(J)], positive.

    Returns
    -------
    tuple of SteadyVibration
        Stable and unstable vibrations.

    Raises
    ------
    ValueError
        If the amplitude is not positive.

    Notes
    -----
    Eq. 3.31, 3.37 and 4.21 of the multi-mesh source if p = 0, and eq. 3.35 and 4.26 if
    f = 0. With both, the vibrations are the solutions of
    ``(|d|^2 - |p|^2) alpha = |p conj(f) - f conj(d)|``. This replaces eq. 3.28, which
    ignores lost contact, and eq. 4.28, which differs from the derivation: it takes the
    modulus of f / alpha + p without the phase between the two.
    """
    lost = lost_stiffness(resonance, amplitude)
    vibrations = [
        _vibration(resonance, amplitude, lost, x)
        for x in sorted(_detunings(resonance, amplitude), reverse=True)
    ]
    return tuple(vibration for vibration in vibrations if vibration is not None)


def _detunings(resonance: Resonance, amplitude: float) -> list[float]:
    """Real parts of d."""
    f, p, zeta = resonance.drive, resonance.parametric, resonance.damping_ratio
    if f == 0.0 or p == 0.0:
        square = (abs(p) ** 2 if f == 0.0 else abs(f / amplitude) ** 2) - 4.0 * zeta**2
        root = math.sqrt(square) if square >= 0.0 else math.nan
        return [] if square < 0.0 else [root, -root][: 1 + (root > 0.0)]
    # x^2 + q is |d|^2 - |p|^2, and the right side squared is a quadratic in x
    q, g = 4.0 * zeta**2 - abs(p) ** 2, _right_side(resonance)
    quartic = np.array([1.0, 0.0, 2.0 * q, 0.0, q**2])
    quartic[2:] -= g / amplitude**2
    return _real_roots(quartic)


def _right_side(resonance: Resonance) -> Array:
    """|p conj(f) - f conj(d)|^2, d = x + 2i zeta: coefficients of x^2, x and 1."""
    f, p = resonance.drive, resonance.parametric
    constant = p * f.conjugate() + 2j * resonance.damping_ratio * f
    return np.array(
        [abs(f) ** 2, -2.0 * (constant * f.conjugate()).real, abs(constant) ** 2]
    )


def _real_roots(polynomial: Array) -> list[float]:
    """Distinct real roots of a polynomial given with the highest power first."""
    roots = np.roots(polynomial)
    scale = np.abs(roots).max(initial=1e-300)
    real = np.sort(roots[np.abs(roots.imag) <= REAL_ROOT_RTOL * scale].real)
    return [float(x) for x in real[np.diff(real, prepend=-np.inf) > ROOT_RTOL * scale]]


def _vibration(
    resonance: Resonance, amplitude: float, lost: float, x: float
) -> SteadyVibration | None:
    """Vibration at a detuning, or None if p and d cancel and the phase is undefined."""
    f, p = resonance.drive, resonance.parametric
    d = complex(x, 2.0 * resonance.damping_ratio)
    if f == 0.0:
        phase_factor = -p / d  # u / conj(u)
        u = amplitude * phase_factor**0.5
    else:
        size = abs(d) ** 2 - abs(p) ** 2
        if size == 0.0:
            return None
        u = (p * f.conjugate() - f * d.conjugate()) / size
        phase_factor = u / u.conjugate()
    # the eigenvalues of the linearised condition have the sum -2 zeta w_r
    slope = 0.5 * lost_stiffness_slope(resonance, amplitude)
    stable = abs(d - slope) > abs(p - slope * phase_factor) * (1.0 + ROOT_RTOL)
    return SteadyVibration(
        frequency=resonance.at * (1.0 - 0.5 * (x + lost)),
        amplitude=amplitude,
        phase=float(-np.angle(u)),
        separation=separation_angle(resonance, amplitude),
        stable=bool(stable),
    )


def peak_amplitude(resonance: Resonance) -> float:
    """Largest modal amplitude of a direct resonance.

    Lost contact changes the frequency of the peak, not its amplitude.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train that is driven directly.

    Returns
    -------
    float
        Modal amplitude alpha [sqrt(J)]; infinite if ``|p| >= 2 zeta``.

    Raises
    ------
    ValueError
        If the direct drive is 0.

    Notes
    -----
    If p = 0, it is ``|f| / (2 zeta)``, eq. 3.34 of the multi-mesh source; 4.23 prints
    c_s where c_s^2 is right.
    """
    return _peak(resonance)[0]


def _peak(resonance: Resonance) -> tuple[float, float]:
    """Largest amplitude, and the real part of d there."""
    f, p, zeta = resonance.drive, resonance.parametric, resonance.damping_ratio
    if f == 0.0:
        raise ValueError("drive = 0; must not be, as there is no peak")
    if abs(p) >= 2.0 * zeta:
        return math.inf, math.nan
    # the square of the amplitude is g / s^2, which peaks where g' s = 2 g s'
    g, s = np.poly1d(_right_side(resonance)), np.poly1d([1.0, 0.0, 4.0 * zeta**2])
    s = s - abs(p) ** 2
    places = _real_roots((g.deriv() * s - 2.0 * g * s.deriv()).coeffs)
    return max((math.sqrt(float(g(x))) / float(s(x)), x) for x in places)


def peak(resonance: Resonance) -> SteadyVibration:
    """Steady vibration with the largest amplitude.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train that is driven directly.

    Returns
    -------
    SteadyVibration
        Vibration at the peak.

    Raises
    ------
    ValueError
        If there is no peak or the peak is not finite.

    Notes
    -----
    Eq. 3.34 of the multi-mesh source.
    """
    amplitude, x = _peak(resonance)
    vibration = None
    if math.isfinite(amplitude):
        lost = lost_stiffness(resonance, amplitude)
        vibration = _vibration(resonance, amplitude, lost, x)
    if vibration is None:
        raise ValueError(
            f"parametric = {resonance.parametric:.3g}; must be below 2 damping ratios"
        )
    return vibration


def transition_frequencies(resonance: Resonance, mesh: int) -> tuple[float, ...]:
    """Mesh frequencies at which a mesh begins to lose contact.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train.
    mesh : int
        Index of the mesh, from 0.

    Returns
    -------
    tuple of float
        Frequencies of the first mesh, rising, in the unit of the system; none if the
        mesh never loses contact.

    Notes
    -----
    For the mesh that loses contact first these are eq. 3.33 and 4.22 of the multi-mesh
    source; for the others they include the contact already lost at that amplitude. Eq.
    3.43 prints the first term without 1 / c_r^2. For a subharmonic they are the
    frequencies at which its vertical branches begin to bend, which is where it begins.
    """
    amplitude = float(contact_loss_amplitude(resonance)[mesh])
    if math.isinf(amplitude):
        return ()
    return tuple(
        vibration.frequency for vibration in steady_vibrations(resonance, amplitude)
    )


def instability_interval(resonance: Resonance) -> tuple[float, float] | None:
    """Mesh frequencies between which rest or a forced motion is unstable.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train.

    Returns
    -------
    tuple of 2 float or None
        Bounds ``2 w_r (1 -+ sqrt(|p|^2 - 4 zeta^2) / 2) / (2 h)``, frequencies of the
        first mesh in the unit of the system; None if the damping ratio exceeds
        `critical_damping`.

    Notes
    -----
    Eq. 3.44, 4.26 and 2.27 of the multi-mesh source; eq. 2.27 prints half of the width
    with a quarter of the damping term.
    """
    square = abs(resonance.parametric) ** 2 - 4.0 * resonance.damping_ratio**2
    if square < 0.0:
        return None
    half = 0.5 * math.sqrt(square)
    return resonance.at * (1.0 - half), resonance.at * (1.0 + half)


def critical_damping(resonance: Resonance) -> float:
    """Damping ratio at which a subharmonic vanishes.

    Parameters
    ----------
    resonance : Resonance
        Resonance of a train.

    Returns
    -------
    float
        Damping ratio ``|p| / 2``.

    Notes
    -----
    Below eq. 3.44 of the multi-mesh source.
    """
    return 0.5 * abs(resonance.parametric)
