"""Resonances that two stiffness harmonics excite together, eq. 3.39 to 3.42.

Off resonance, harmonic a of the stiffness moves the meshes at a w; harmonic b times
this motion is a force at (a + b) w. If h = a + b falls on a mode, the mode resonates
with a drive of second order in the variation, the only drive if harmonic h is missing.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from lumped.closed_forms.parametric import ParametricSystem
from lumped.closed_forms.resonance import Resonance, harmonics_at, resonance
from lumped.common.array_types import Complex


def forced_vibration(
    system: ParametricSystem, order: Fraction, frequency: float
) -> Complex:
    """Amplitudes (m,) of e^(i order w t) in the mesh deflections [m], eq. 3.39.

    They are exact to first order in the stiffness variation and include all modes: the
    sum of B_l = -f_l / (1 - (order w / w_l)^2 + 2i zeta order w / w_l), in which
    eq. 3.39 has no damping.

    frequency : frequency w of the first mesh, in the unit of the system
    """
    v = system.shapes
    stiff = system.stiffness * system.deflection * harmonics_at(system, order)
    force = v.T @ (harmonics_at(system, order, "gap_harmonics") - stiff)
    ratio = float(order) * frequency / system.frequency
    return v @ (force / (1.0 - ratio**2 + 2j * system.damping_ratio * ratio))


def superharmonic(
    system: ParametricSystem, mode: int, order: Fraction | int = 2
) -> Resonance:
    """Resonance of a mode at Omega = order times w, driven at second order only.

    Parameters
    ----------
    system : ParametricSystem
        Modes and harmonics of the train.
    mode : int
        Index of the mode, from 0.
    order : Fraction or int, optional
        Frequency of the vibration over that of the first mesh, positive.

    Returns
    -------
    Resonance
        Resonance with the drive by two harmonics of the system together. It can be used
        like any resonance.

    Raises
    ------
    ValueError
        If there is no such mode or the order is not positive.

    Notes
    -----
    The drive is W of eq. 3.42 of the multi-mesh source (over c_r), here with all pairs
    of harmonics of the system whose sum is the order; with a single harmonic it is W as
    printed. Eq. 3.41 prints 1 / (2 alpha c_r), whereas 1 / (4 alpha c_r) follows as in
    3.37. The shift of the natural frequency, also of second order, is neglected.
    """
    h = Fraction(order)
    first_order = resonance(system, mode, h)
    driven = np.zeros(system.stiffness.size, complex)
    for s in (sign * order for order in system.orders for sign in (1, -1)):
        motion = h - s
        if motion != 0 and abs(motion) != h:
            y = forced_vibration(system, motion, first_order.at)
            driven += harmonics_at(system, s) * y
    driven *= system.stiffness * first_order.shapes
    return replace(first_order, driven_by=driven)


def with_superharmonic(system: ParametricSystem, first_order: Resonance) -> Resonance:
    """The resonance with its drives of first and second order together.

    Parameters
    ----------
    system : ParametricSystem
        Modes and harmonics of the train.
    first_order : Resonance
        Resonance of the system with the drive of first order.

    Returns
    -------
    Resonance
        Resonance with the sum of both drives.
    """
    second = superharmonic(system, first_order.mode, first_order.order)
    return replace(first_order, driven_by=first_order.driven_by + second.driven_by)
