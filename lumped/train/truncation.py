"""Bound on the effect of the body modes that the coupled model leaves out.

The bound is that of `lumped.train.elastic_inertia`: the change of the mesh compliance
by the inertia of a mode, relative to the excitation's RMS, summed over all modes left
out. Modes that were never solved count as one mode at the lowest frequency that they
can have, with the remaining inertia: the sum of w^2 / omega^4 is known from statics.

A change of compliance also shifts resonances of the mesh. With little damping this can
matter even if the compliance itself does not: a shift by a fraction s of half the
bandwidth changes amplitudes on the flanks of a resonance by s / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lumped.train.elastic_inertia import inertia_part, normalised

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
ALLOWED = 0.08  # largest error of excitation, and of amplitudes on flanks of resonances
STRAINED = 0.05  # least part of a resonance's strain energy in the meshes that counts
REACH = 0.05  # relative distance beyond the band at which a resonance is excited
SHARP = 1e-3  # least damping ratio at which a resonance is resolved
GRID = 25  # speeds at which the bound is evaluated, in addition to resonances
ORDERS = 12  # orders of the mesh frequency whose resonances with a mode are considered
HARMONICS = 32  # largest number of harmonics of the excitation
CRITICAL = 1.0  # damping ratio of modes that were not solved


@dataclass(frozen=True, eq=False)
class TruncationModel:
    """Effect of b solved body modes, and of the remaining modes, on the meshes.

    frequencies_Hz, damping_ratio, families : (b,); modes of one family are a pair
    compliance : (m, b) share of each mode in the mesh's compliance at rest
    rest_Hz : lower bound of the frequencies of modes that were not solved
    rest : (m,) compliance of modes at this frequency with the inertia of all of these
    amplitudes : (m, h) amplitudes of harmonics of the static transmission error
    rate : (m,) frequencies of the meshes over that of the first
    resonances_Hz, energy : (r,) and (m, r) natural frequencies without body modes, and
        the fraction of their strain energy in each mesh
    resonance_damping : damping ratio of these resonances
    """

    frequencies_Hz: Array
    damping_ratio: Array
    families: NDArray[np.int64]
    compliance: Array
    rest_Hz: float
    rest: Array
    amplitudes: NDArray[np.complex128]
    rate: Array
    resonances_Hz: Array
    energy: Array
    resonance_damping: float

    def largest_error(self, retained: Mask, band: tuple[float, float]) -> float:
        """Largest relative error of the mesh compliance in a band of speeds [Hz].

        retained : (b,) modes that are not left out
        """
        return self._error(self._parts(band), ~retained)

    def flank_bound(self, retained: Mask, band: tuple[float, float]) -> float:
        """Relative error of amplitudes on the flanks of resonances in a band of speeds.

        retained : (b,) modes that are not left out
        """
        return self._flank_error(self._flanks(band), ~retained)

    def choose(self, band: tuple[float, float], allowed: float = ALLOWED) -> Mask:
        """Mask (b,) of the modes to retain, so that the others change no more than
        allowed.

        Families with the largest individual errors are retained first.
        """
        parts, flanks = self._parts(band), self._flanks(band)

        def error(left: Mask, rest: bool = True) -> float:
            on_flanks = self._flank_error(flanks, left, rest)
            return max(self._error(parts, left, rest), on_flanks)

        numbers = np.unique(self.families)
        alone = [error(self.families == n, rest=False) for n in numbers]
        order = numbers[np.argsort(alone, kind="stable")[::-1]]
        for count in range(order.size):
            retained = np.isin(self.families, order[:count])
            if error(~retained) <= allowed:
                return retained
        return np.ones(self.families.size, bool)

    def _error(self, parts: list[Array], left: Mask, rest: bool = True) -> float:
        """Compliance error without some of the modes (b,), and the rest if included."""
        out = np.append(left, rest)
        return max(
            float(np.sqrt(((part[..., out].sum(axis=2) * size) ** 2).sum(axis=1)).max())
            for part, size in zip(parts, self._sizes, strict=True)
        )

    def _flank_error(self, flanks: Array, left: Mask, rest: bool = True) -> float:
        """Flank error without some of the modes (b,), and the rest if included."""
        out = np.append(left, rest)
        return float(flanks[:, out].sum(axis=1).max(initial=0.0))

    def _flanks(self, band: tuple[float, float]) -> Array:
        """Change (r, b + 1) of amplitudes on each resonance's flank by each mode."""
        frequencies = np.append(self.frequencies_Hz, self.rest_Hz)
        ratios = np.append(self.damping_ratio, CRITICAL)
        part = inertia_part(self.resonances_Hz[:, None] / frequencies, ratios)
        share = np.column_stack([self.compliance, self.rest])
        shift = 0.5 * (self.energy.T @ share) * part
        damping = max(self.resonance_damping, SHARP)
        return 0.5 * shift / damping * self._excited(band, damping)[:, None]

    def _excited(self, band: tuple[float, float], damping: float) -> Array:
        """Fraction (r,) of vibration due to resonance, at the most exciting speed."""
        energy, fraction = self.energy.sum(axis=0), np.zeros(self.resonances_Hz.size)
        for sizes, rate in zip(self._sizes, self.rate, strict=True):
            for order, size in enumerate(sizes[:ORDERS], start=1):
                speed = self.resonances_Hz / (order * rate)
                low, high = band[0] * (1.0 - REACH), band[1] * (1.0 + REACH)
                met = (speed > low) & (speed < high) & (energy >= STRAINED)
                grown = size * energy / (2.0 * damping)
                fraction = np.maximum(fraction, met * grown / np.hypot(1.0, grown))
        return fraction

    @property
    def _sizes(self) -> list[Array]:
        return [normalised(a[:HARMONICS]) for a in self.amplitudes]

    def _parts(self, band: tuple[float, float]) -> list[Array]:
        """Change of each mesh's compliance (s, h, b + 1) by each mode and the rest."""
        frequencies = np.append(self.frequencies_Hz, self.rest_Hz)
        ratios = np.append(self.damping_ratio, CRITICAL)
        parts = []
        meshes = zip(
            self.compliance, self.rest, self.amplitudes, self.rate, strict=True
        )
        for share, rest, amplitudes, rate in meshes:
            orders = np.arange(1.0, min(len(amplitudes), HARMONICS) + 1.0)
            driven = np.multiply.outer(self._speeds(band), rate * orders)
            part = inertia_part(driven[..., None] / frequencies, ratios)
            parts.append(np.append(share, rest) * part)
        return parts

    def _speeds(self, band: tuple[float, float]) -> Array:
        """Speeds of a band, including those at which harmonics excite modes."""
        orders = np.multiply.outer(self.rate, np.arange(1.0, ORDERS + 1.0)).ravel()
        met = np.divide.outer(self.frequencies_Hz, orders).ravel()
        inside = met[(met > band[0]) & (met < band[1])]
        return np.concatenate([np.geomspace(*band, GRID), inside])
