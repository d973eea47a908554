"""Drive of a mode at a mesh frequency near one of its resonances.

A mode that vibrates at Omega = h w, where w is the frequency of the first mesh, takes
part in four kinds of resonance of the multi-mesh source, which differ only in the
order h:

    h = 1      fundamental           eq. 3.31 and 3.28, 2.24, case 1 of 4.21
    h = 2      second harmonic       eq. 3.37, 2.26
    h = 1/2    subharmonic           eq. 3.35, 2.27, case 1 of 4.26
    h = rho_j  a mesh j with another mesh frequency, 4.21 to 4.28

All follow from one solvability condition. The resonant mode
u_r = U_r + (A e^(i w_r t) + c.c.) with A = u e^(i (Omega - w_r) t) has no secular
terms if

    2i u' / w_r + (d - B(|u|)) u + p conj(u) + f = 0,
    d = 2 (1 - Omega / w_r) + 2i zeta,

    f = sum_j [k_j v_jr C_j z_j(h) - v_jr L_j(h)]      the direct drive,
    p = sum_j k_j v_jr^2 z_j(2h)                       the parametric drive,

where z_j(h), L_j(h) are the harmonics that fall on h w, zero if none does: eq. 2.21,
3.24, 3.36, 4.25, 4.27 and 4.28. In the source's symbols f = R3 / c_r (or Lambda, or
R3 tilde), p = Q3 / c_r^2 (Theta, R4), and B = -(R1 + R2 / alpha) / c_r^2 accounts for
lost contact. Eq. 3.27 prints mean deflections and mode shapes in R4, where the
derivation gives p.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from lumped.closed_forms.parametric import ParametricSystem
from lumped.common.array_types import Array, Complex
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, eq=False, kw_only=True)
class Resonance(ShortRepr):
    """Resonance of mode r of a train with m meshes, excited at Omega = order times w.

    Attributes
    ----------
    mode : int
        Index of the mode, from 0.
    frequency : float
        Natural frequency w_r, in the unit of the system.
    order : Fraction
        Frequency h of the vibration over that of the first mesh.
    shapes : (m,) array
        Mesh deflections v_jr of the mode at unit modal stiffness [m / sqrt(J)].
    energy : (m,) array
        Fractions k_j v_jr^2 of the strain energy.
    elastic : (m,) array
        Mean deflections that press the teeth together [m].
    damping_ratio : float
        Damping ratio zeta.
    driven_by : (m,) complex array
        Contribution of each mesh to the direct drive f, in the unit of modal amplitudes
        [sqrt(J)].
    parametric_by : (m,) complex array
        Contribution of each mesh to the parametric drive p.

    Notes
    -----
    The drives are those of eq. 2.21, 3.24, 3.36, 4.25, 4.27 and 4.28 of the multi-mesh
    source, see `lumped.closed_forms.resonance`.
    """

    mode: int
    frequency: float
    order: Fraction
    shapes: Array
    energy: Array
    elastic: Array
    damping_ratio: float
    driven_by: Complex
    parametric_by: Complex

    @property
    def drive(self) -> complex:
        """Direct drive f."""
        return complex(self.driven_by.sum())

    @property
    def parametric(self) -> complex:
        """Parametric drive p."""
        return complex(self.parametric_by.sum())

    @property
    def at(self) -> float:
        """Frequency of the first mesh at which Omega is the natural frequency."""
        return float(self.frequency / self.order)

    def amplitudes(self, amplitude: float) -> Array:
        """Amplitudes of the mesh deflections at a modal amplitude.

        Parameters
        ----------
        amplitude : float
            Modal amplitude alpha [sqrt(J)].

        Returns
        -------
        (m,) array
            Amplitudes ``2 |v_jr| alpha`` [m].
        """
        return 2.0 * np.abs(self.shapes) * amplitude


def resonance(
    system: ParametricSystem, mode: int, order: Fraction | int = 1
) -> Resonance:
    """Resonance of a mode at Omega = order times the mesh frequency.

    Parameters
    ----------
    system : ParametricSystem
        Modes and harmonics of the train.
    mode : int
        Index of the mode, from 0.
    order : Fraction or int, optional
        Frequency of the vibration over that of the first mesh, positive: 1 is the
        fundamental resonance, 2 the second harmonic, 1/2 the subharmonic.

    Returns
    -------
    Resonance
        Drives of the resonance by each mesh.

    Raises
    ------
    ValueError
        If there is no such mode or the order is not positive.
    """
    if not 0 <= mode < system.modes:
        raise ValueError(f"mode = {mode}; must be 0 to {system.modes - 1}")
    if not order > 0:
        raise ValueError(f"order = {order}; must be positive")
    h = Fraction(order)
    v, k = system.shapes[:, mode], system.stiffness
    direct, twice = (harmonics_at(system, s) for s in (h, 2 * h))
    gaps = harmonics_at(system, h, "gap_harmonics")
    return Resonance(
        mode=mode,
        frequency=float(system.frequency[mode]),
        order=h,
        shapes=v,
        energy=system.energy[:, mode],
        elastic=system.elastic,
        damping_ratio=system.damping_ratio,
        driven_by=k * v * system.deflection * direct - v * gaps,
        parametric_by=k * v**2 * twice,
    )


def harmonics_at(
    system: ParametricSystem, order: Fraction, name: str = "stiffness_harmonics"
) -> Complex:
    """Amplitudes (m,) of all meshes at `order` times the first mesh's frequency."""
    meshes = range(system.stiffness.size)
    return np.array([system.harmonic(name, j, order) for j in meshes])
