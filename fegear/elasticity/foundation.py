"""Elastic foundation: springs between a boundary about the centre and a rigid base."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import block_array, csr_array, diags_array

from fegear.elasticity.boundary import BoundaryQuadrature


def foundation_stiffness(
    boundary: BoundaryQuadrature, radial: float, tangential: float
) -> csr_array:
    """Stiffness (n, n) of springs on a boundary, along and across the radius [Pa].

    It is the integral of radial u_r v_r + tangential u_t v_t over the boundary.

    radial, tangential : stiffness per area [N/m3]
    """
    operator, count = boundary.operator, len(boundary.points)
    # the shape functions at a point add up to 1, so that their sum is its weight
    weight = np.asarray(operator.sum(axis=0)).ravel()[:count]
    along = boundary.points / np.hypot(*boundary.points.T)[:, None]
    difference = radial - tangential

    def component(a: int, b: int) -> Any:
        isotropic = tangential if a == b else 0.0
        return diags_array(
            (isotropic + difference * along[:, a] * along[:, b]) / weight
        )

    law: Any = block_array([[component(a, b) for b in range(2)] for a in range(2)])
    return csr_array(operator @ law @ operator.T)
