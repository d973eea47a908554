"""The idler of chapter 3 (Table 3.1 with the wheel's inertia of Table 2.1)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from lumped import LumpedSystem, analytic_excitation

INERTIAS = (0.002621, 3.27e-3, 0.119)  # kg m2
VARIATIONS = (0.35, 0.4)


@pytest.fixture(scope="session")
def chapter_3(idler, figures) -> Callable[..., LumpedSystem]:
    """Stiffness variations and damping ratio shrink together with `scale`."""

    def make(
        scale: float = 1.0,
        *,
        damping: float = 0.04,
        contact_ratio: float = 1.5,
        harmonics: int | None = None,
        **changes,
    ) -> LumpedSystem:
        train = idler(
            coupled=False, inertias=INERTIAS, damping=scale * damping, **changes
        )
        waves = tuple(
            analytic_excitation(
                figures(
                    mesh,
                    contact_ratio=contact_ratio,
                    variation=scale * VARIATIONS[mesh],
                ),
                harmonics=harmonics,
            )
            for mesh in range(2)
        )
        return LumpedSystem(train, waves)

    return make
