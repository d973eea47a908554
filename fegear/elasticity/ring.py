"""A ring of equal super-elements, solved by Fourier transform over its sectors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def ring_response(
    superelement: Array, left: Array, right: Array, teeth: int, cuts: range
) -> dict[int, Array]:
    """Displacement of the cuts of a block-circulant ring under loads on one sector.

    superelement : (2 m, 2 m) stiffness over (left cut, right cut), equal for all
    left, right : (m, loads) loads on the two cuts of sector 0
    cuts : which cuts to return; cut c lies between sectors c and c + 1

    Returns cut -> (m, loads). Each Fourier component over the sectors is an
    independent (m, m) Hermitian system.
    """
    m = len(left)
    LL, LR = superelement[:m, :m], superelement[:m, m:]
    RL, RR = superelement[m:, :m], superelement[m:, m:]
    waves = np.arange(teeth // 2 + 1)
    phase = np.exp(2j * np.pi * waves / teeth)[:, None, None]
    system = (LL + RR) + RL / phase + LR * phase
    spectrum = np.linalg.solve(system, right + left * phase)
    weight = np.where((waves == 0) | (2 * waves == teeth), 1.0, 2.0) / teeth
    spectrum *= weight[:, None, None]
    return {c: np.real(np.sum(spectrum * phase**c, axis=0)) for c in cuts}
