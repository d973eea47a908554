"""The functions of drag, beside 50 digits."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest

from lumped.clatter.kernels.phi import phi_functions
from lumped.common.compiled import compiled


@compiled
def compiled_phi_functions(z):
    """Call the part, which compiled code alone can call."""
    return phi_functions(z)


@pytest.mark.parametrize("z", [*np.geomspace(1e-12, 50.0, 60), 0.0999999, 0.1])
def test_phi_functions_to_round_off(z):
    with localcontext(prec=50):
        exact = Decimal(float(z))
        fade = (-exact).exp()
        expected = (1 - fade) / exact, (exact - 1 + fade) / exact**2
    values = compiled_phi_functions(z)
    assert values == pytest.approx([*map(float, expected)], rel=4e-15)


def test_phi_functions_without_drag():
    assert compiled_phi_functions(0.0) == (1.0, 0.5)
