"""The idler of chapter 3 (Table 3.1 with the wheel's inertia of Table 2.1)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from lumped import LumpedSystem, analytic_excitation

INERTIAS = (0.002621, 3.27e-3, 0.119)  # kg m2
VARIATIONS = (0.35, 0.4)


def relief_of(c: float, magnitude: float) -> list[tuple[float, float]]:
    """Gap of a pair over its way through the mesh, of contact ratio c."""
    ends, starts = 0.5 * c, 1.0 - 0.5 * c
    return [(-ends, magnitude), (-starts, 0.0), (starts, 0.0), (ends, magnitude)]


@pytest.fixture(scope="session")
def chapter_3(idler, figures) -> Callable[..., LumpedSystem]:
    """Stiffness variations and damping ratio shrink together with `scale`.

    reliefs : of both tips of each mesh, linear from the highest single contact [m]
    """

    def make(
        scale: float = 1.0,
        *,
        damping: float = 0.04,
        contact_ratio: float | tuple[float, float] = 1.5,
        reliefs: tuple[float, float] = (0.0, 0.0),
        harmonics: int | None = None,
        **changes,
    ) -> LumpedSystem:
        train = idler(
            coupled=False, inertias=INERTIAS, damping=scale * damping, **changes
        )
        ratios = np.broadcast_to(contact_ratio, 2)
        waves = []
        for mesh, c in enumerate(ratios):
            variation = scale * VARIATIONS[mesh]
            key = figures(mesh, contact_ratio=float(c), variation=variation)
            gap = relief_of(c, reliefs[mesh]) if reliefs[mesh] else ()
            waves.append(analytic_excitation(key, gap=gap, harmonics=harmonics))
        return LumpedSystem(train, tuple(waves))

    return make
