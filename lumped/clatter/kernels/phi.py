"""Functions by which a linear drag and a constant force move a coordinate.

They are phi_1(-z) and phi_2(-z) of exponential integrators.
"""

from __future__ import annotations

import math

from lumped.common.compiled import inlined


@inlined
def phi_functions(z):
    """(1 - e^-z) / z and (z - 1 + e^-z) / z^2, to round-off, for z >= 0."""
    if z < 0.1:
        second = 1.0 / 40320.0 - z * (1.0 / 362880.0 - z / 3628800.0)
        second = 1.0 / 720.0 - z * (1.0 / 5040.0 - z * second)
        second = 0.5 - z * (
            1.0 / 6.0 - z * (1.0 / 24.0 - z * (1.0 / 120.0 - z * second))
        )
        return 1.0 - z * second, second
    first = -math.expm1(-z) / z
    return first, (1.0 - first) / z
