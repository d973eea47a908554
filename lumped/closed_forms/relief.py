"""Tip relief that keeps a mesh from exciting vibration, eq. 2.28 to 2.33.

Both tips of a mesh are relieved linearly from the highest point of single-tooth
contact, by rho at the tip; one pair is in contact, or two that share the load equally.
The leaving pair gains the gap that the entering pair loses. Two pairs therefore have
k_two rho / 2 of stiffness times gap, a rectangle in phase with that of the stiffness.
At every harmonic, relief reduces the drive of a mesh in proportion to rho.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from lumped.closed_forms.resonance import Resonance
from lumped.common.array_types import Array
from lumped.common.checks import format_number


def optimal_relief(force: float, lowest: float, highest: float) -> float:
    """Tip relief that makes the static transmission error constant.

    Parameters
    ----------
    force : float
        Force F on the mesh [N], positive.
    lowest : float
        Stiffness k_one of one pair [N/m], positive.
    highest : float
        Stiffness k_two of two pairs [N/m], one to two times that of one pair; above
        that a relieved tip carries no load.

    Returns
    -------
    float
        Relief ``2 F (1 / k_one - 1 / k_two)`` at the tip [m].

    Raises
    ------
    ValueError
        If a value is not allowed.

    Notes
    -----
    Eq. 2.28 of the multi-mesh source: twice the peak-to-peak error without relief. (The
    text above 2.28 interchanges the stiffnesses of one pair and of two.) For any
    stiffness between these values it is an estimate.
    """
    if not 0.0 < force < math.inf:
        raise ValueError(f"force = {format_number(force)}; must be positive")
    if not 0.0 < lowest <= highest <= 2.0 * lowest:
        raise ValueError(
            f"highest = {format_number(highest)} and {format_number(lowest)}; must be "
            "lowest to twice lowest"
        )
    return 2.0 * force * (1.0 / lowest - 1.0 / highest)


@dataclass(frozen=True, eq=False)
class ReliefContours:
    """Drive of a resonance over the tip reliefs of m meshes.

    It is ``|f|^2 = (rho - centre) . form . (rho - centre)`` over the reliefs rho.

    Attributes
    ----------
    resonance : Resonance
        Resonance of teeth without relief.
    centre : (m,) array
        Relief of least transmission error of each mesh [m], for all modes and mesh
        phases.
    form : (m, m) array
        Matrix of the quadratic form [J/m2].

    Notes
    -----
    Eq. 2.31 of the multi-mesh source. Contours of equal amplitude are ellipses about
    the centre, or straight lines if the meshes drive in phase and one relief
    compensates for the other. The phase turns the axes. According to eq. 2.33, relief
    adds to the excitation by the stiffness in one mode; by derivation it subtracts in
    all modes.
    """

    resonance: Resonance
    centre: Array
    form: Array

    def amplitude(self, relief: ArrayLike, frequency: float) -> float:
        """Modal amplitude at a mesh frequency without loss of contact, eq. 2.25.

        Parameters
        ----------
        relief : (m,) array_like
            Tip relief of each mesh [m].
        frequency : float
            Frequency of the first mesh, in the unit of the system.

        Returns
        -------
        float
            Modal amplitude alpha [sqrt(J)].
        """
        away = np.asarray(relief, float) - self.centre
        width = 2.0 * (1.0 - frequency / self.resonance.at)
        zeta = self.resonance.damping_ratio
        drive = math.sqrt(max(0.0, float(away @ self.form @ away)))
        return drive / math.hypot(width, 2.0 * zeta)

    def axes(self) -> tuple[Array, Array]:
        """Axes of the contours; the response is most sensitive to the last one.

        Returns
        -------
        directions : (m, m) array
            Directions of the axes, in columns.
        growth : (m,) array
            Growth of the drive ``|f|`` along each axis [sqrt(J) per metre], rising.
        """
        values, directions = np.linalg.eigh(self.form)
        return directions, np.sqrt(np.maximum(values, 0.0))


def relief_contours(resonance: Resonance, optimal: ArrayLike) -> ReliefContours:
    """Effect of the tip reliefs of all meshes on a resonance of teeth without relief.

    Parameters
    ----------
    resonance : Resonance
        Resonance of teeth without relief.
    optimal : (m,) array_like
        Reliefs from `optimal_relief` [m], positive.

    Returns
    -------
    ReliefContours
        Drive over the reliefs.

    Raises
    ------
    ValueError
        If `optimal` is not a positive number for each mesh.
    """
    centre = np.asarray(optimal, float)
    if centre.shape != resonance.driven_by.shape or not (centre > 0.0).all():
        meshes = resonance.driven_by.size
        raise ValueError(f"optimal = {centre}; must be {meshes} positive numbers")
    per_metre = resonance.driven_by / centre
    form = np.outer(per_metre, per_metre.conjugate()).real
    return ReliefContours(resonance, centre, form)
