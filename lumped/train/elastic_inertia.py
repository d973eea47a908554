"""Relevance of the elastic inertia of the gears, and the modes to retain for it.

A clamped-hub mode of frequency f_i and amplitude phi_i at the contact contributes
c_i = phi_i^2 / (2 pi f_i)^2 to the compliance c there. Driven at frequency f, its share
is c_i / (1 - x^2 + 2 j zeta x) with x = f / f_i, compared with c_i if it is treated as
quasi-static. The part of the difference due to inertia, without that of damping, is

    c_i r_i,  r_i = x^2 / |1 - x^2 + 2 j zeta x|

and the error of several modes is at most the sum of their magnitudes. The error of a
model that retains the modes below a cut-off is the sum over the modes above it. The
mesh is driven at the harmonics of its frequency with the amplitudes of the loaded
static transmission error, so errors are weighted by its spectrum.

Modes that are not passed are ignored: the modes should extend far above the highest
significant harmonic.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lumped.common.array_types import Array, Complex

Fidelity = Literal["quasistatic", "reduced"]
# R_i assigned to an undamped mode at resonance, as for zeta = 0.0005
MAX_INERTIA_FACTOR = 1e3
CUTOFF_MARGIN = 1e-6  # relative margin of a cut-off above the highest mode, for pairs


@dataclass(frozen=True, eq=False)
class ElasticModes:
    """Clamped-hub modes of both gears and their effect on a mesh, in any order.

    frequencies_Hz : (n,) positive frequencies
    compliance : (n,) share c_i / c of each mode in the mesh's compliance at rest, which
        is 1 / mean mesh stiffness; 0 or more
    damping_ratio : damping ratio of every mode, 0 or more
    """

    frequencies_Hz: Array
    compliance: Array
    damping_ratio: float

    def __post_init__(self) -> None:
        for name in ("frequencies_Hz", "compliance"):
            values = np.array(getattr(self, name), float)
            _require_finite(name, values)
            object.__setattr__(self, name, values)
        if self.frequencies_Hz.shape != self.compliance.shape:
            raise ValueError(
                f"shape of compliance = {self.compliance.shape}; must be "
                f"{self.frequencies_Hz.shape}"
            )
        if not (self.frequencies_Hz > 0.0).all():
            lowest = self.frequencies_Hz.min()
            raise ValueError(f"frequencies_Hz = {lowest:g}; must be positive")
        if not (self.compliance >= 0.0).all():
            least = self.compliance.min()
            raise ValueError(f"compliance = {least:g}; must be 0 or more")
        if not 0.0 <= self.damping_ratio < math.inf:
            raise ValueError(
                f"damping_ratio = {self.damping_ratio}; must be 0 or more and finite"
            )


ExcitedMesh = tuple[ElasticModes, ArrayLike, float]  # modes, amplitudes, rate of mesh


@dataclass(frozen=True)
class Choice:
    """Recommended treatment of the elastic inertia of the gears.

    bound : largest error of the quasi-static treatment over speeds and meshes
    speed_Hz : frequency of the first mesh at which it is reached
    mesh : mesh in which it is reached, from 0
    tolerance : allowed error
    cutoff_Hz : lowest cut-off that is accurate enough, below which modes are retained;
        0 if there are none
    retained : number of modes below the cut-off in each mesh
    remaining : largest error with these modes retained
    """

    fidelity: Fidelity
    bound: float
    speed_Hz: float
    mesh: int
    tolerance: float
    cutoff_Hz: float
    retained: tuple[int, ...]
    remaining: float

    @property
    def sentence(self) -> str:
        """Sentence that states the choice and its reason."""
        extent = "at most" if self.fidelity == "quasistatic" else "up to"
        location = f"at {_format_digits(self.speed_Hz, 4)} Hz"
        location += f" in mesh {self.mesh + 1}" if len(self.retained) > 1 else ""
        text = (
            f"{self.fidelity}: elastic inertia changes the mesh compliance by {extent} "
            f"{_format_percent(self.bound)} of the excitation's RMS ({location}), "
            f"allowed are {_format_percent(self.tolerance)}"
        )
        if self.fidelity == "quasistatic":
            return text
        return (
            f"{text}; {' + '.join(map(str, self.retained))} modes below "
            f"{_format_digits(self.cutoff_Hz / 1e3, 3)} kHz are kept, the others "
            f"change it by at most {_format_percent(self.remaining)}"
        )


def harmonic_amplitudes(ste: ArrayLike) -> Complex:
    """Amplitudes A_h (n // 2,) of harmonics 1, 2, ... of a mesh cycle.

    ste : (n,) one cycle of the static transmission error, equally spaced, its first
        value not repeated; n of 2 or more

    A_h is the amplitude in Re(A_h exp(2 pi j h t)), with t in cycles, so that a cosine
    of amplitude a has |A_h| = a. Harmonic n / 2 includes only the cosine.
    """
    values = np.asarray(ste, float)
    _require_finite("ste", values)
    if values.size < 2:
        raise ValueError(f"values of ste = {values.size}; must be 2 or more")
    amplitudes = 2.0 * np.fft.rfft(values)[1:] / values.size
    if values.size % 2 == 0:
        amplitudes[-1] /= 2.0
    return amplitudes


def inertia_error(
    modes: ElasticModes, amplitudes: ArrayLike, mesh_frequency: float
) -> float:
    """Relative error of the compliance without inertia, RMS over the excitation.

    It is sqrt(sum |A_h e_h|^2 / sum |A_h|^2) with e_h = sum_i c_i r_i / c at
    h mesh_frequency; large but finite at a resonance, 0 without excitation.

    amplitudes : (H,) amplitudes of harmonics 1, 2, ... in any unit
    mesh_frequency : 0 or more [Hz]
    """
    return float(_remaining_errors(modes, amplitudes, mesh_frequency)[0])


def choose(
    meshes: Sequence[ExcitedMesh], speeds: ArrayLike, tolerance: float = 0.02
) -> Choice:
    """Choose quasi-static treatment if its error is tolerable, else the fewest modes.

    meshes : modes, amplitudes of harmonics (H,) and rate of each mesh, i.e. its
        frequency over that of the first mesh; the worst mesh is decisive
    speeds : (s,) frequencies of the first mesh [Hz]; a sharp resonance between them is
        not detected
    """
    if not meshes:
        raise ValueError("meshes = none; must have one or more")
    if not 0.0 <= tolerance < math.inf:
        raise ValueError(f"tolerance = {tolerance}; must be 0 or more and finite")
    frequencies = _validate_speeds(speeds)
    tables = [
        np.array([_remaining_errors(modes, a, rate * f) for f in frequencies])
        for modes, a, rate in meshes
    ]
    quasistatic_errors = np.array([table[:, 0] for table in tables])
    mesh, speed = np.unravel_index(
        quasistatic_errors.argmax(), quasistatic_errors.shape
    )
    cutoff, retained, remaining = _lowest_cutoff(
        [np.sort(modes.frequencies_Hz) for modes, _, _ in meshes],
        [table.max(axis=0) for table in tables],
        tolerance,
    )
    return Choice(
        fidelity="reduced" if cutoff else "quasistatic",
        bound=float(quasistatic_errors[mesh, speed]),
        speed_Hz=float(frequencies[speed]),
        mesh=int(mesh),
        tolerance=tolerance,
        cutoff_Hz=cutoff,
        retained=retained,
        remaining=remaining,
    )


def _remaining_errors(
    modes: ElasticModes, amplitudes: ArrayLike, mesh_frequency: float
) -> Array:
    """Error (n + 1,) with the 0, 1, ..., n lowest of n modes retained."""
    weights = normalise(amplitudes)
    if not 0.0 <= mesh_frequency < math.inf:
        raise ValueError(
            f"mesh_frequency = {mesh_frequency} Hz; must be 0 or more and finite"
        )
    order = np.argsort(modes.frequencies_Hz)
    harmonic_frequencies = mesh_frequency * np.arange(1.0, weights.size + 1.0)
    x = harmonic_frequencies[:, None] / modes.frequencies_Hz[order]
    shares = modes.compliance[order] * inertia_factor(x, modes.damping_ratio)
    # sums from the highest mode down: the modes above each cut-off
    above = np.cumsum(shares[:, ::-1], axis=1)[:, ::-1]
    errors = np.column_stack([above, np.zeros(weights.size)])
    return np.sqrt(((weights[:, None] * errors) ** 2).sum(axis=0))


def inertia_factor(x: Array, damping_ratio: float | Array) -> Array:
    """Factor r_i at frequency ratios x of any shape, at most MAX_INERTIA_FACTOR."""
    magnitude = np.hypot(1.0 - x**2, 2.0 * damping_ratio * x)
    return x**2 / np.maximum(magnitude, x**2 / MAX_INERTIA_FACTOR)


def normalise(amplitudes: ArrayLike) -> Array:
    """Magnitudes |A_h| (H,) with a sum of squares of 1, or all 0."""
    magnitudes = np.abs(np.asarray(amplitudes))
    _require_finite("amplitudes", magnitudes)
    largest = magnitudes.max(initial=0.0)
    if largest == 0.0:
        return np.zeros(magnitudes.size)
    magnitudes = magnitudes / largest  # squares of very small numbers would underflow
    return magnitudes / np.sqrt((magnitudes**2).sum())


def _lowest_cutoff(
    frequencies: list[Array], errors: list[Array], tolerance: float
) -> tuple[float, tuple[int, ...], float]:
    """Cut-off [Hz], modes below it in each mesh, and largest error of the rest.

    frequencies : (n,) for each mesh, rising
    errors : (n + 1,) for each mesh, with the lowest modes retained
    """
    candidates = np.unique(np.concatenate(frequencies)) * (1.0 + CUTOFF_MARGIN)
    cutoffs = np.concatenate([[0.0], candidates])
    counts = [np.searchsorted(f, cutoffs) for f in frequencies]
    max_errors = np.max([e[n] for e, n in zip(errors, counts, strict=True)], axis=0)
    first = int(np.argmax(max_errors <= tolerance))  # with all modes the error is 0
    retained = tuple(int(n[first]) for n in counts)
    return float(cutoffs[first]), retained, float(max_errors[first])


def _validate_speeds(speeds: ArrayLike) -> Array:
    frequencies = np.asarray(speeds, float)
    _require_finite("speeds", frequencies)
    if not frequencies.size:
        raise ValueError("speeds = none; must have one or more values")
    return frequencies


def _require_finite(name: str, values: NDArray[Any]) -> None:
    if values.ndim != 1:
        raise ValueError(f"dimensions of {name} = {values.ndim}; must be 1")
    if not np.isfinite(values).all():
        raise ValueError(f"{name} must be finite")


def _format_percent(fraction: float) -> str:
    return f"{_format_digits(100.0 * fraction, 2)} %"


def _format_digits(value: float, count: int) -> str:
    """Format with `count` significant digits, never with an exponent."""
    return np.format_float_positional(
        value, precision=count, fractional=False, trim="-"
    )
