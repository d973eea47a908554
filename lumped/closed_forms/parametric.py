"""Modes of a train whose mesh stiffness varies weakly, the input of the closed forms.

With modal coordinates u_r scaled to unit modal stiffness, the mesh deflections are
y_j = sum_r v_jr u_r and, until contact is lost,

    u_r'' / w_r^2 + 2 zeta u_r' / w_r + u_r
        + sum_j v_jr k_j sum_s z_js e^(i s rho_j w t) y_j = sum_j v_jr L_j(t) + const,

summed over s = +-1, +-2, ..., with k_j z_js the Fourier coefficients of the mesh
stiffness (eq. 3.12, 4.4 and 2.13 of the multi-mesh source) and L_j the sum of pair
stiffness times gap (eq. 2.12). Then k_j v_jr^2 is the fraction of the mode's strain
energy in mesh j. The source's normalised modes are s_jr = c_r v_jr, where c_r are its
frequencies.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from lumped.common.array_types import Array, Complex
from lumped.common.checks import format_number
from lumped.common.short_repr import ShortRepr
from lumped.train.excitation import MeshExcitation
from lumped.train.system import LumpedSystem

N_HARMONICS = 16  # number of harmonics of the mesh frequency that are included
MIN_DAMPING = 1e-9  # least damping ratio; below it peaks are not meaningful
ROUND_OFF_RTOL = 1e-12  # round-off of the harmonics over the largest amplitude


@dataclass(frozen=True, eq=False, kw_only=True)
class ParametricSystem(ShortRepr):
    """Modal system with n modes, m meshes and h harmonics of each mesh frequency.

    Harmonic amplitudes s = 1 ... h are the coefficients of e^(+i s w t).

    Parameters
    ----------
    frequency : (n,) array
        Natural frequencies at mean stiffness, rising [Hz, or any other unit, in which
        mesh frequencies are then returned].
    shapes : (m, n) array
        Mesh deflections v_jr of the modes at unit modal stiffness [m / sqrt(J), or any
        units whose square fits that of `stiffness`].
    stiffness : (m,) array
        Mean mesh stiffnesses k_j [N/m].
    deflection : (m,) array
        Mean mesh deflections C_j under the load, including gaps [m].
    elastic : (m,) array
        The part of `deflection` that presses the teeth together [m].
    damping_ratio : float
        Damping ratio of every mode, from 1e-9 to below 1.
    stiffness_harmonics : (m, h) complex array
        Harmonics z_js of the stiffness over its mean.
    gap_harmonics : (m, h) complex array
        Harmonics L_js of stiffness times gap [N].
    rates : tuple of m Fraction
        Mesh frequencies rho_j over that of the first mesh.
    backlash : (m,) array
        Backlash of the meshes [m].

    Raises
    ------
    ValueError
        If shapes do not fit, numbers are not finite, a mesh carries no load, or a
        frequency, stiffness, rate or damping ratio is not allowed.

    Notes
    -----
    The equations of motion are eq. 3.12, 4.4 and 2.13 of the multi-mesh source, with
    its normalised modes s_jr = c_r v_jr, where c_r are its frequencies.
    """

    frequency: Array
    shapes: Array
    stiffness: Array
    deflection: Array
    elastic: Array
    damping_ratio: float
    stiffness_harmonics: Complex
    gap_harmonics: Complex
    rates: tuple[Fraction, ...]
    backlash: Array

    def __post_init__(self) -> None:
        m, n = np.shape(self.shapes)
        h = np.shape(self.stiffness_harmonics)[-1]
        required = {"frequency": (n,), "stiffness_harmonics": (m, h)}
        required |= dict.fromkeys(("stiffness", "deflection", "elastic"), (m,))
        required |= {"gap_harmonics": (m, h), "rates": (m,), "backlash": (m,)}
        for name, shape in required.items():
            actual = np.shape(getattr(self, name))
            if actual != shape:
                raise ValueError(f"shape of {name} = {actual}; must be {shape}")
        for name in ("shapes", "deflection", "stiffness_harmonics", "gap_harmonics"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} must be finite")
        for name in ("frequency", "stiffness", "elastic", "rates"):
            values = np.array([float(value) for value in getattr(self, name)])
            if not ((values > 0.0) & np.isfinite(values)).all():
                raise ValueError(f"{name} = {values}; must be positive")
        if not MIN_DAMPING <= self.damping_ratio < 1.0:
            raise ValueError(
                f"damping_ratio = {format_number(self.damping_ratio)}; must be "
                f"{MIN_DAMPING:g} to "
                "below 1"
            )

    @property
    def modes(self) -> int:
        """Number of modes."""
        return self.frequency.size

    @property
    def energy(self) -> Array:
        """Fractions (m, n) of the modes' strain energy in the meshes."""
        return self.stiffness[:, None] * self.shapes**2

    @property
    def orders(self) -> list[Fraction]:
        """Orders of all mesh harmonics over the first mesh's frequency, rising."""
        count = self.stiffness_harmonics.shape[1]
        return sorted({s * rate for rate in self.rates for s in range(1, count + 1)})

    def harmonic(self, name: str, mesh: int, order: Fraction) -> complex:
        """Amplitude of a mesh at a multiple of the first mesh's frequency.

        Parameters
        ----------
        name : {'stiffness_harmonics', 'gap_harmonics'}
            Quantity.
        mesh : int
            Index of the mesh, from 0.
        order : Fraction
            Frequency over that of the first mesh, any number except 0, may be negative.

        Returns
        -------
        complex
            Amplitude, in the unit of the quantity; 0 where the mesh has no harmonic.
        """
        s = order / self.rates[mesh]
        amplitudes = getattr(self, name)[mesh]
        if s.denominator != 1 or not 0 < abs(s) <= amplitudes.size:
            return 0.0j
        value = complex(amplitudes[abs(int(s)) - 1])
        return value if s > 0 else value.conjugate()


def parametric_system(
    system: LumpedSystem, harmonics: int = N_HARMONICS
) -> ParametricSystem:
    """Parametric system of a train, with a number of harmonics of each mesh frequency.

    Modes that strain no mesh are left out.

    Parameters
    ----------
    system : LumpedSystem
        Train by model 1, 2 or 3, without friction.
    harmonics : int, optional
        Number of harmonics of each mesh frequency, 1 or more.

    Returns
    -------
    ParametricSystem
        Modes and harmonics of the train, in SI units.

    Raises
    ------
    ValueError
        If a mesh is not loaded, tooth pairs differ (pitch errors), teeth have friction,
        the model is the coupled one or `harmonics` is below 1.
    """
    if system.contacts is not None:
        raise ValueError("model = coupled; must be 1, 2 or 3")
    if system.has_friction:
        raise ValueError("friction must be 0; these closed forms leave it out")
    if harmonics < 1:
        raise ValueError(f"harmonics = {harmonics}; must be 1 or more")
    waves = [
        excitation_harmonics(excitation, mesh.phase, harmonics)
        for excitation, mesh in zip(
            system.excitations, system.train.meshes, strict=True
        )
    ]
    arrays, angular = system.arrays, system.modes.angular[system.moving]
    shapes = arrays.shapes / angular
    stiffness, gaps = np.array(waves, complex).swapaxes(0, 1)
    lift = gaps[:, 0].real
    if not (system.static_deflection > 0.0).all():
        raise ValueError(
            f"static_deflection = {system.static_deflection} m; must be positive in "
            "every mesh, the drive flanks loaded"
        )
    return ParametricSystem(
        frequency=system.modes.frequency_Hz[system.moving],
        shapes=shapes,
        stiffness=arrays.mean_stiffness,
        deflection=shapes @ (arrays.load / angular + shapes.T @ lift),
        elastic=system.static_deflection,
        damping_ratio=system.train.damping_ratio,
        stiffness_harmonics=stiffness[:, 1:] / arrays.mean_stiffness[:, None],
        gap_harmonics=gaps[:, 1:],
        rates=system.train.mesh_rates,
        backlash=arrays.backlash,
    )


def excitation_harmonics(
    excitation: MeshExcitation, phase: float, count: int
) -> tuple[Complex, Complex]:
    """Harmonics 0 ... count of the stiffness [N/m] and of stiffness times gap [N].

    Gauss quadrature is applied between the breaks of the waves, so that no jump lies
    inside an integration interval.
    """
    if excitation.period > 1:
        raise ValueError(
            f"excitation = tooth pairs that differ over {excitation.period} base "
            "pitches; must repeat after one"
        )
    waves = [wave for pair in excitation.pairs for wave in (pair.stiffness, pair.gap)]
    grid = np.linspace(0.0, 1.0, 2 * count + 1)
    breaks = np.unique(np.concatenate([grid, *(wave.breaks for wave in waves)]))
    nodes, weights = np.polynomial.legendre.leggauss(10)
    half = 0.5 * np.diff(breaks)[:, None]
    x = (breaks[:-1, None] + half * (1.0 + nodes)).ravel()
    weight = (half * weights).ravel()
    stiffness = np.array([pair.stiffness(x) for pair in excitation.pairs])
    gap = np.array([pair.gap(x) for pair in excitation.pairs])
    turns = np.exp(-2j * np.pi * np.outer(np.arange(count + 1), x - phase))
    springs, lifts = stiffness.sum(axis=0), (stiffness * gap).sum(axis=0)
    return _remove_round_off(turns @ (weight * springs)), _remove_round_off(
        turns @ (weight * lifts)
    )


def _remove_round_off(amplitudes: Complex) -> Complex:
    """Set round-off to zero, or it would drive a resonance."""
    least = ROUND_OFF_RTOL * np.abs(amplitudes).max()
    return np.where(np.abs(amplitudes) > least, amplitudes, 0.0)
