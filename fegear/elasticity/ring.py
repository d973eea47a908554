"""A ring of equal super-elements, solved by Fourier transform over its sectors."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lumped.common.array_types import Array, Complex

BYTES_PER_BATCH = 2**22  # bytes of harmonics that are held at a time


def ring_response(
    superelement: Array, left: Array, right: Array, teeth: int, cuts: Iterable[int]
) -> dict[int, Array]:
    """Displacement of the cuts of a block-circulant ring under loads on one sector.

    superelement : (2 m, 2 m) stiffness over (left cut, right cut), equal for all
    left, right : (m, loads) loads on the two cuts of sector 0
    cuts : which cuts to return; cut c lies between sectors c and c + 1

    Returns cut -> (m, loads). Each Fourier component over the sectors is an
    independent (m, m) Hermitian system; that of n and of teeth - n are conjugate.
    """
    displacements = {c: np.zeros(left.shape) for c in cuts}
    for diameters, phase, system in harmonics(superelement, teeth):
        phase = phase[:, None, None]
        spectrum = np.linalg.solve(system, right + left * phase)
        standing = (diameters == 0) | (2 * diameters == teeth)
        weight = np.where(standing, 1.0, 2.0) / teeth
        spectrum *= weight[:, None, None]
        for c in displacements:
            displacements[c] += np.real(np.sum(spectrum * phase**c, axis=0))
    return displacements


def harmonics(
    superelement: Array, teeth: int
) -> Iterator[tuple[NDArray[np.int64], Complex, Complex]]:
    """A few at a time: nodal diameters n (k,) from 0 to teeth // 2, their phase from
    sector to sector (k,), and systems (k, m, m) of the left cut."""
    m = len(superelement) // 2
    count = max(1, BYTES_PER_BATCH // (16 * m * m))
    for first in range(0, teeth // 2 + 1, count):
        diameters = np.arange(first, min(first + count, teeth // 2 + 1))
        phase = np.exp(2j * np.pi * diameters / teeth)
        yield diameters, phase, close_ring(superelement, phase[:, None, None])


def close_ring(superelement: Array, phase: Any) -> NDArray[Any]:
    """System (..., m, m) of the left cut, the right one moving `phase` times as much.

    phase : exp(2 pi i n / z), a number or (..., 1, 1); the system is real where it is
    """
    m = len(superelement) // 2
    LL, LR = superelement[:m, :m], superelement[:m, m:]
    RL, RR = superelement[m:, :m], superelement[m:, m:]
    return np.asarray((LL + RR) + RL * np.conj(phase) + LR * phase)


def nodal_diameter_phase(nodal_diameters: int, teeth: int) -> complex:
    """exp(2 pi i n / z) from sector to sector, a real number for a standing mode."""
    if nodal_diameters == 0:
        return 1.0
    if 2 * nodal_diameters == teeth:
        return -1.0
    return complex(np.exp(2j * np.pi * nodal_diameters / teeth))
