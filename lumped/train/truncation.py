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
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Mask
from lumped.common.short_repr import ShortRepr
from lumped.train.elastic_inertia import inertia_factor, normalise
from lumped.train.modes import MIN_RESONANCE_ENERGY

# Largest error of excitation, and of amplitudes on flanks of resonances
MAX_ERROR = 0.08
BAND_MARGIN = 0.05  # relative distance beyond the band at which a resonance is excited
MIN_DAMPING_RATIO = 1e-3  # least damping ratio at which a resonance is resolved
N_SPEEDS = 25  # speeds at which the bound is evaluated, in addition to resonances
# Orders of the mesh frequency whose resonances with a mode are considered
MAX_ORDER = 12
MAX_HARMONICS = 32  # largest number of harmonics of the excitation
COPIED_MODES = 8  # modes up to which their part is copied rather than all read
UNSOLVED_DAMPING_RATIO = 1.0  # damping ratio of modes that were not solved


class MeshPart(NamedTuple):
    """Change (k, s, h) of a mesh's compliance by modes (k,), at speeds and harmonics.

    The last of all modes are those that were not solved.
    """

    mesh: int
    modes: NDArray[np.intp]
    change: Array


@dataclass(frozen=True, eq=False)
class TruncationModel(ShortRepr):
    """Effect of b solved body modes, and of the remaining modes, on the meshes.

    frequencies_Hz, damping_ratio, families : (b,); modes of one family are a pair
    compliance : (m, b) share of each mode in the mesh's compliance at rest
    unsolved_Hz : lower bound of the frequencies of modes that were not solved
    unsolved_compliance : (m,) compliance of modes at this frequency with the inertia
        of all of these
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
    unsolved_Hz: float
    unsolved_compliance: Array
    amplitudes: NDArray[np.complex128]
    rate: Array
    resonances_Hz: Array
    energy: Array
    resonance_damping: float

    def largest_error(self, retained: Mask, band: tuple[float, float]) -> float:
        """Largest relative error of the mesh compliance in a band of speeds [Hz].

        retained : (b,) modes that are not left out
        """
        return float(self._errors(self._parts(band), ~retained).max())

    def flank_bound(self, retained: Mask, band: tuple[float, float]) -> float:
        """Relative error of amplitudes on the flanks of resonances in a band of speeds.

        retained : (b,) modes that are not left out
        """
        return self._flank_error(self._flanks(band), ~retained)

    def choose(self, band: tuple[float, float], max_error: float = MAX_ERROR) -> Mask:
        """Mask (b,) of the modes to retain, so that the others change no more than
        allowed.

        Families with the largest individual errors are retained first.
        """
        parts, flanks = self._parts(band), self._flanks(band)
        families, left_out = np.unique(self.families), np.ones(self.families.size, bool)
        individual_errors = []
        for n in families:
            family = self.families == n
            on_flanks = self._flank_error(flanks, family, rest=False)
            errors = self._errors(self._of_family(parts, n), family, rest=False)
            individual_errors.append(max(on_flanks, errors.max(initial=0.0)))
        order = families[np.argsort(individual_errors, kind="stable")[::-1]]
        errors = self._errors(parts, left_out)
        for n in order:
            if max(errors.max(), self._flank_error(flanks, left_out)) <= max_error:
                return ~left_out
            left_out = left_out & (self.families != n)
            affected = self._of_family(parts, n)
            errors[[part.mesh for part in affected]] = self._errors(affected, left_out)
        return np.ones(self.families.size, bool)

    def _of_family(self, parts: list[MeshPart], family: int) -> list[MeshPart]:
        """The parts in which a family has a share."""
        members = np.flatnonzero(self.families == family)
        return [part for part in parts if np.isin(members, part.modes).any()]

    def _errors(
        self, parts: list[MeshPart], left_out: Mask, rest: bool = True
    ) -> Array:
        """Compliance errors of meshes without some of the modes (b,), and the rest if
        included."""
        mask, sizes = np.append(left_out, rest).astype(float), self._sizes
        errors = []
        for part in parts:
            weights, change = mask[part.modes], part.change
            included = np.flatnonzero(weights)
            if included.size < COPIED_MODES:
                weights, change = weights[included], change[included]
            change = np.tensordot(weights, change, axes=1)
            squares = ((change * sizes[part.mesh]) ** 2).sum(axis=1)
            errors.append(float(np.sqrt(squares.max())))
        return np.array(errors)

    def _flank_error(self, flanks: Array, left_out: Mask, rest: bool = True) -> float:
        """Flank error without some of the modes (b,), and the rest if included."""
        mask = np.append(left_out, rest)
        return float(flanks[:, mask].sum(axis=1).max(initial=0.0))

    def _flanks(self, band: tuple[float, float]) -> Array:
        """Change (r, b + 1) of amplitudes on each resonance's flank by each mode."""
        frequencies = np.append(self.frequencies_Hz, self.unsolved_Hz)
        ratios = np.append(self.damping_ratio, UNSOLVED_DAMPING_RATIO)
        factor = inertia_factor(self.resonances_Hz[:, None] / frequencies, ratios)
        share = np.column_stack([self.compliance, self.unsolved_compliance])
        shift = 0.5 * (self.energy.T @ share) * factor
        damping = max(self.resonance_damping, MIN_DAMPING_RATIO)
        return 0.5 * shift / damping * self._excited(band, damping)[:, None]

    def _excited(self, band: tuple[float, float], damping: float) -> Array:
        """Fraction (r,) of vibration due to resonance, at the most exciting speed."""
        energy, fraction = self.energy.sum(axis=0), np.zeros(self.resonances_Hz.size)
        for sizes, rate in zip(self._sizes, self.rate, strict=True):
            for order, size in enumerate(sizes[:MAX_ORDER], start=1):
                speed = self.resonances_Hz / (order * rate)
                low, high = band[0] * (1.0 - BAND_MARGIN), band[1] * (1.0 + BAND_MARGIN)
                is_excited = (
                    (speed > low) & (speed < high) & (energy >= MIN_RESONANCE_ENERGY)
                )
                amplification = size * energy / (2.0 * damping)
                fraction = np.maximum(
                    fraction, is_excited * amplification / np.hypot(1.0, amplification)
                )
        return fraction

    @cached_property
    def _sizes(self) -> list[Array]:
        return [normalise(a[:MAX_HARMONICS]) for a in self.amplitudes]

    def _parts(self, band: tuple[float, float]) -> list[MeshPart]:
        """Change of each mesh's compliance by its own modes and the rest."""
        frequencies = np.append(self.frequencies_Hz, self.unsolved_Hz)
        ratios = np.append(self.damping_ratio, UNSOLVED_DAMPING_RATIO)
        shares = np.column_stack([self.compliance, self.unsolved_compliance])
        speeds, parts = self._speeds(band), []
        for m, (share, amplitudes) in enumerate(
            zip(shares, self.amplitudes, strict=True)
        ):
            orders = np.arange(1.0, min(len(amplitudes), MAX_HARMONICS) + 1.0)
            frequency = np.multiply.outer(speeds, self.rate[m] * orders)
            modes = np.flatnonzero(share)
            # modes of a pair have one factor
            both = np.stack([frequencies[modes], ratios[modes]])
            (natural, damping), index = np.unique(both, axis=1, return_inverse=True)
            ratio = frequency / natural[:, None, None]
            factor = inertia_factor(ratio, damping[:, None, None])
            change = share[modes, None, None] * factor[index.ravel()]
            parts.append(MeshPart(m, modes, change))
        return parts

    def _speeds(self, band: tuple[float, float]) -> Array:
        """Speeds of a band, including those at which harmonics excite modes."""
        # modes of a pair, and meshes of one frequency, have the same
        orders = np.multiply.outer(self.rate, np.arange(1.0, MAX_ORDER + 1.0))
        resonances = np.divide.outer(np.unique(self.frequencies_Hz), np.unique(orders))
        resonances = np.unique(resonances)
        inside = resonances[(resonances > band[0]) & (resonances < band[1])]
        return np.concatenate([np.geomspace(*band, N_SPEEDS), inside])
