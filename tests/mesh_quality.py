"""Quality of a sector mesh."""

from __future__ import annotations

import math

from numpy.typing import NDArray

from meshes import SectorMesh


def smallest_jacobian(mesh: SectorMesh) -> float:
    """Smallest element Jacobian at the corners over its straight-sided value."""
    corners = mesh.points[mesh.triangles[:, :3]]
    mids = mesh.points[mesh.triangles[:, 3:]]
    worst = math.inf
    straight = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for i, (ahead, back) in enumerate([(0, 2), (1, 0), (2, 1)]):
        one = 4.0 * mids[:, ahead] - 3.0 * corners[:, i] - corners[:, (i + 1) % 3]
        two = 4.0 * mids[:, back] - 3.0 * corners[:, i] - corners[:, (i + 2) % 3]
        worst = min(worst, float((_cross(one, two) / straight).min()))
    return worst


def _cross(a: NDArray, b: NDArray) -> NDArray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
