"""A linear oscillator under a harmonic force whose frequency is linear in time.

The problem of F. M. Lewis, Trans. ASME 54 (1932) 253: the response to a run through
resonance lags behind the steady state, and its largest amplitude comes later and is
less. In closed form by the error function of complex argument.
"""

from __future__ import annotations

import numpy as np
from scipy.special import wofz

from lumped.common.array_types import Array, Complex


def chirp_response(
    time: Array, angular: float, ratio: float, chirp: tuple[float, float], start: Array
) -> Array:
    """Displacement (t,) of x'' + 2 D w x' + w^2 x = w^2 cos(a t + b t^2), a unit force.

    angular, ratio : w [rad/s] and D
    chirp : a [rad/s] and b [rad/s2], not 0
    start : (2,) displacement and velocity at time 0
    """
    damped = angular * np.sqrt(1.0 - ratio**2)
    root = -ratio * angular + 1j * damped
    x, v = start
    # x = Re(c exp(root t)) with x(0) and x'(0)
    amplitude = x - 1j * (v + ratio * angular * x) / damped
    free = (amplitude * np.exp(root * time)).real
    a, b = chirp
    both = _convolution(time, root, a, b) + _convolution(time, root, -a, -b)
    return free + angular**2 * (0.5 * both).imag / damped


def _convolution(time: Array, root: complex, a: float, b: float) -> Complex:
    """Integral (t,) over s from 0 to t of exp(root (t - s) + i a s + i b s^2)."""
    sigma = np.sqrt(-1j * b + 0j)
    gamma = 1j * a - root
    pole = root * time + gamma**2 / (4.0 * sigma**2)
    ends = []
    for s, exponent in (
        (time, 1j * (a * time + b * time**2)),
        (np.zeros_like(time), root * time),
    ):
        z = sigma * s - gamma / (2.0 * sigma)
        side = np.where(z.real < 0.0, -1.0, 1.0)
        ends.append((side, side * np.exp(exponent) * wofz(1j * side * z)))
    (side, tail), (first_side, first_tail) = ends
    crossed = side != first_side
    jump = (side - first_side) * np.exp(np.where(crossed, pole, 0.0))
    values: Complex = np.sqrt(np.pi) / (2.0 * sigma) * (jump - tail + first_tail)
    return values
