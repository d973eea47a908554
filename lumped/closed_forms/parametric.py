"""Modes of a train whose mesh stiffness varies weakly: what the closed forms take.

With modal coordinates u_r scaled to unit modal stiffness, mesh deflections are
y_j = sum_r v_jr u_r and, until contact is lost,

    u_r'' / w_r^2 + 2 zeta u_r' / w_r + u_r
        + sum_j v_jr k_j sum_s z_js e^(i s rho_j w t) y_j = sum_j v_jr L_j(t) + const,

summed over s = +-1, +-2, ..., with k_j z_js the Fourier coefficients of the mesh
stiffness (eq. 3.12, 4.4 and 2.13 of the multi-mesh source) and L_j the sum of pair
stiffness times gap (eq. 2.12). Then k_j v_jr^2 is the part of the mode's strain energy
that is in mesh j. The source's normalised modes are s_jr = c_r v_jr, c_r its
frequencies.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from lumped.train.excitation import MeshExcitation
from lumped.train.system import LumpedSystem

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
HARMONICS = 16  # of the mesh frequency that are kept
LEAST_DAMPING = 1e-9  # ratio, below which peaks are beyond all numbers
ROUND_OFF = 1e-12  # of the largest amplitude


@dataclass(frozen=True, eq=False, kw_only=True)
class ParametricSystem:
    """n modes and m meshes; amplitudes of harmonics s = 1 ... h are of e^(+i s w t).

    frequency : (n,) natural frequencies at mean stiffness, rising [Hz, or any unit,
        in which mesh frequencies then come out]
    shapes : (m, n) v_jr, mesh deflections of the modes at unit modal stiffness
        [m / sqrt(J), or any units whose square fits that of `stiffness`]
    stiffness : (m,) mean mesh stiffnesses k_j [N/m]
    deflection : (m,) mean mesh deflections under the load C_j, gaps counted [m]
    elastic : (m,) the part of them that presses the teeth together [m]
    damping_ratio : of every mode
    stiffness_harmonics : (m, h) of the stiffness over its mean z_js
    gap_harmonics : (m, h) of stiffness times gap L_js [N]
    rates : (m,) mesh frequencies over that of the first mesh rho_j
    backlash : (m,) [m]

    Raises ValueError where shapes do not fit, numbers are not finite, no torque loads
    a mesh or a frequency, stiffness or rate is not positive.
    """

    frequency: Array
    shapes: Array
    stiffness: Array
    deflection: Array
    elastic: Array
    damping_ratio: float
    stiffness_harmonics: ComplexArray
    gap_harmonics: ComplexArray
    rates: tuple[Fraction, ...]
    backlash: Array

    def __post_init__(self) -> None:
        m, n = np.shape(self.shapes)
        h = np.shape(self.stiffness_harmonics)[-1]
        wanted = {"frequency": (n,), "stiffness_harmonics": (m, h)}
        wanted |= dict.fromkeys(("stiffness", "deflection", "elastic"), (m,))
        wanted |= {"gap_harmonics": (m, h), "rates": (m,), "backlash": (m,)}
        for name, shape in wanted.items():
            found = np.shape(getattr(self, name))
            if found != shape:
                raise ValueError(f"{name} must have shape {shape}, got {found}")
        for name in ("shapes", "deflection", "stiffness_harmonics", "gap_harmonics"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} must be finite")
        for name in ("frequency", "stiffness", "elastic", "rates"):
            values = np.array([float(value) for value in getattr(self, name)])
            if not ((values > 0.0) & np.isfinite(values)).all():
                raise ValueError(f"{name} must be positive, got {values}")
        if not LEAST_DAMPING <= self.damping_ratio < 1.0:
            raise ValueError(
                f"damping_ratio must be {LEAST_DAMPING:g} to below 1, got "
                f"{self.damping_ratio:g}"
            )

    @property
    def modes(self) -> int:
        return self.frequency.size

    @property
    def energy(self) -> Array:
        """(m, n) parts of the modes' strain energy in the meshes."""
        return self.stiffness[:, None] * self.shapes**2

    @property
    def orders(self) -> list[Fraction]:
        """Orders of all harmonics of the meshes relative to the first mesh's frequency,
        rising.
        """
        count = self.stiffness_harmonics.shape[1]
        return sorted({s * rate for rate in self.rates for s in range(1, count + 1)})

    def harmonic(self, name: str, mesh: int, order: Fraction) -> complex:
        """Amplitude of a mesh at `order` times the first mesh's frequency, or 0.

        name : stiffness_harmonics or gap_harmonics; order : not 0, may be negative
        """
        s = order / self.rates[mesh]
        amplitudes = getattr(self, name)[mesh]
        if s.denominator != 1 or not 0 < abs(s) <= amplitudes.size:
            return 0.0j
        value = complex(amplitudes[abs(int(s)) - 1])
        return value if s > 0 else value.conjugate()


def parametric_system(
    system: LumpedSystem, harmonics: int = HARMONICS
) -> ParametricSystem:
    """The parametric system of a train, with so many harmonics of each mesh frequency.

    Modes that strain no mesh are left out. Raises ValueError where a mesh is not
    loaded or tooth pairs differ (pitch errors), and for the coupled model.
    """
    if system.contacts is not None:
        raise ValueError("contacts must be None, models 1 to 3, got the coupled model")
    if system.rubs:
        raise ValueError("friction must be 0; these closed forms leave it out")
    if harmonics < 1:
        raise ValueError(f"harmonics must be 1 or more, got {harmonics}")
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
            "static deflection of every mesh must be positive, the drive flanks "
            f"loaded, got {system.static_deflection} m"
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
) -> tuple[ComplexArray, ComplexArray]:
    """Harmonics 0 ... count of the stiffness [N/m] and of stiffness times gap [N].

    Gauss quadrature on the pieces of the waves, so that no jump lies inside of one.
    """
    if excitation.period > 1:
        raise ValueError(
            "excitation must repeat after one base pitch, got tooth pairs that differ "
            f"over {excitation.period} base pitches"
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
    return _rounded(turns @ (weight * springs)), _rounded(turns @ (weight * lifts))


def _rounded(amplitudes: ComplexArray) -> ComplexArray:
    """Round-off is no harmonic: with it a resonance had a drive that it has not."""
    least = ROUND_OFF * np.abs(amplitudes).max()
    return np.where(np.abs(amplitudes) > least, amplitudes, 0.0)
