"""Limits of the closed forms: checks of their assumptions for a resonance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from lumped.closed_forms.frequency_response import peak_amplitude
from lumped.closed_forms.parametric import ParametricSystem
from lumped.closed_forms.resonance import Resonance, harmonics_at
from lumped.closed_forms.separation import contact_loss_amplitude, separation_angle
from lumped.closed_forms.superharmonic import forced_vibration

MAX_VARIATION = 0.5  # first harmonic 2 |z_j1|, below eq. 3.12: "in practice less"
# At this fraction of a cycle without contact, integration puts the peak of the idler of
# chapter 3 5 % below the closed forms; at 0.4, the largest of figure 3.8, 20 % below.
MAX_SEPARATION = 0.3
# Largest drive by gaps of tooth pairs over that by stiffness variation
MAX_GAP_DRIVE = 0.25
# Largest vibration of other modes over the mean deflection of a mesh
MAX_OTHER_MOTION = 0.5


def limits(system: ParametricSystem, resonance: Resonance) -> tuple[str, ...]:
    """Sentences on the assumptions of the closed forms that do not hold.

    Parameters
    ----------
    system : ParametricSystem
        Modes and harmonics of the train.
    resonance : Resonance
        Resonance of the system.

    Returns
    -------
    tuple of str
        A sentence for each assumption that the system violates, none if all hold.
    """
    return (
        *_variation_limits(system),
        *_other_mode_limits(system, resonance),
        *_combination_limits(system, resonance),
        *_peak_limits(system, resonance),
    )


def _variation_limits(system: ParametricSystem) -> Iterator[str]:
    for j, first in enumerate(2.0 * np.abs(system.stiffness_harmonics[:, 0]), start=1):
        if first >= MAX_VARIATION:
            yield (
                f"stiffness of mesh {j} varies by {first:.2g} of its mean in the first "
                f"harmonic, small is below {MAX_VARIATION:g}"
            )


def _other_mode_limits(system: ParametricSystem, resonance: Resonance) -> Iterator[str]:
    """Warn of meshes that other modes or harmonics move too much."""
    for order in system.orders:
        if order == resonance.order:
            continue
        motion = 2.0 * np.abs(forced_vibration(system, order, resonance.at))
        part = float((motion / system.elastic).max())
        if part > MAX_OTHER_MOTION:
            distance = np.abs(system.frequency - float(order) * resonance.at)
            yield (
                f"{float(order):.4g} times the mesh frequency, nearest to the mode at "
                f"{system.frequency[distance.argmin()]:.5g}, moves a mesh by "
                f"{part:.2g} of its mean deflection as well"
            )


def _combination_limits(
    system: ParametricSystem, resonance: Resonance
) -> Iterator[str]:
    """Warn of combination instabilities of this mode with another.

    By the same averaging, both modes grow if s w is near w_r + w_l, for
    |s w - w_r - w_l| < (w_r + w_l) sqrt(|p_rl|^2 - 4 zeta^2) / 2.
    """
    mode = resonance.mode
    for other, order in product(range(system.modes), system.orders):
        total = system.frequency[mode] + system.frequency[other]
        shapes = system.shapes[:, mode] * system.shapes[:, other]
        p = abs((system.stiffness * shapes * harmonics_at(system, order)).sum())
        width = p**2 - 4.0 * system.damping_ratio**2
        gap = abs(float(order) * resonance.at - total) / total
        if other != mode and width > 0.0 and gap < 0.5 * math.sqrt(width):
            yield (
                f"{float(order):.4g} times the mesh frequency is near the sum of the "
                f"modes at {system.frequency[mode]:.5g} and "
                f"{system.frequency[other]:.5g}, which grow together"
            )


def _peak_limits(system: ParametricSystem, resonance: Resonance) -> Iterator[str]:
    if resonance.drive == 0.0:
        return
    top = peak_amplitude(resonance)
    if math.isinf(top):
        yield (
            f"stiffness at twice its frequency, {abs(resonance.parametric):.2g}, is "
            "2 damping ratios or more: no peak at this order"
        )
        return
    part = float(separation_angle(resonance, top).max()) / math.pi
    if part > MAX_SEPARATION:
        yield (
            f"contact is lost for {part:.2g} of the cycle at the peak, small is below "
            f"{MAX_SEPARATION:g}"
        )
    deflection_change = resonance.amplitudes(top) - system.elastic
    for j in np.flatnonzero(deflection_change > system.backlash):
        yield f"the peak takes mesh {j + 1} through its backlash to the back side"
    lost = (contact_loss_amplitude(resonance) < top).any()
    by_gaps = np.abs(system.gap_harmonics[:, 0])
    by_stiffness = np.abs(system.stiffness_harmonics[:, 0]) * system.stiffness
    if lost and (by_gaps > MAX_GAP_DRIVE * by_stiffness * system.deflection).any():
        yield (
            "contact is lost where gaps or transmission errors excite as well, "
            "which its closed forms leave out"
        )
