"""Tip relief that keeps a mesh from exciting vibration, eq. 2.28 to 2.33.

Both tips of a mesh are relieved linearly from the highest point of single-tooth
contact, by rho at the tip; one pair touches or two, which share the load equally. The
pair that leaves gains the gap that the pair that enters loses: two pairs have
k_two rho / 2 of stiffness times gap, a rectangle in step with that of the stiffness. At
every harmonic relief takes from the drive of a mesh what is proportional to rho.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.closed_forms.resonance import Resonance

Array = NDArray[np.float64]


def optimal_relief(force: float, lowest: float, highest: float) -> float:
    """Relief [m] at the tips with which the static transmission error is constant.

    2 F (1 / k_one - 1 / k_two), eq. 2.28: twice the peak-to-peak error without relief.
    (The text above 2.28 gives the stiffness of two pairs to one, and that of one to
    two.) For any stiffness between these values it is an estimate.

    force : on the mesh F [N]
    lowest, highest : stiffness of one pair and of two [N/m]

    Raises ValueError unless the force is positive and the stiffness of two pairs is
    from once to twice that of one, beyond which a relieved tip carries nothing.
    """
    if not 0.0 < force < math.inf:
        raise ValueError(f"force must be positive, got {force:g}")
    if not 0.0 < lowest <= highest <= 2.0 * lowest:
        raise ValueError(
            f"highest must be lowest to twice lowest, got {highest:g} and {lowest:g}"
        )
    return 2.0 * force * (1.0 / lowest - 1.0 / highest)


@dataclass(frozen=True, eq=False)
class ReliefContours:
    """|f|^2 = (rho - centre) . form . (rho - centre) over the reliefs rho (m,), 2.31.

    Contours of equal amplitude are ellipses about the centre, or straight lines where
    the meshes drive in step and one relief makes up for the other. The centre is the
    relief of least transmission error of each mesh, for all modes and mesh phases; the
    phase turns the axes. Eq. 2.33 prints for one mode that the relief of a mesh adds to
    what its stiffness excites; derived, it takes away in all modes.

    centre : (m,) [m]; form : (m, m)
    """

    resonance: Resonance
    centre: Array
    form: Array

    def amplitude(self, relief: ArrayLike, frequency: float) -> float:
        """Modal amplitude alpha at a mesh frequency, eq. 2.25, contact kept.

        relief : (m,) [m]
        """
        away = np.asarray(relief, float) - self.centre
        width = 2.0 * (1.0 - frequency / self.resonance.at)
        zeta = self.resonance.damping_ratio
        drive = math.sqrt(max(0.0, float(away @ self.form @ away)))
        return drive / math.hypot(width, 2.0 * zeta)

    def axes(self) -> tuple[Array, Array]:
        """Directions (m, m), in columns, and how much |f| grows along each per metre.

        The last one is that to which the response is most sensitive.
        """
        values, directions = np.linalg.eigh(self.form)
        return directions, np.sqrt(np.maximum(values, 0.0))


def relief_contours(resonance: Resonance, optimal: ArrayLike) -> ReliefContours:
    """How tip reliefs of all meshes change a resonance of teeth without relief.

    optimal : (m,) reliefs of `optimal_relief` [m]
    """
    centre = np.asarray(optimal, float)
    if centre.shape != resonance.driven_by.shape or not (centre > 0.0).all():
        meshes = resonance.driven_by.size
        raise ValueError(f"optimal must be {meshes} positive numbers, got {centre}")
    per_metre = resonance.driven_by / centre
    form = np.outer(per_metre, per_metre.conjugate()).real
    return ReliefContours(resonance, centre, form)
