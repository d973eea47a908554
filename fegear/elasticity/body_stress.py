"""Stress in one tooth sector: the remainder's at nodes, and that of hats of load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from fegear.elasticity import halfplane
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.sector import RIGHT, CyclicSector
from lumped.common.array_types import Array
from meshes import SpurGear
from meshes.profile import flank_frame

ROOTWARD = 0.5 * np.pi  # turn of a friction load from the inward normal


@dataclass(frozen=True)
class ToothLoad:
    """Hats of line load on one tooth's flank.

    tooth : place to the right of the sector whose stress is wanted, 0 on it
    arcs : (n,) arc lengths of the hats from the tip corner [m]
    step : half-length of each hat [m]
    normal, rootward : (n,) resultants [N/m]
    """

    tooth: int
    arcs: Array
    step: float
    normal: Array
    rootward: Array


def point_loads(sector: CyclicSector, load: ToothLoad, angle: float) -> Array:
    """Loads (n,) on the flank points with the same smooth remainder.

    angle : 0 for the normal part of the load, ROOTWARD for the other
    """
    forces = load.normal if angle == 0.0 else load.rootward
    count = len(sector.flanks[RIGHT].arcs)
    index, weights = flank_stencils(load.arcs, *sector.flank_grid)
    total = np.zeros(count)
    np.add.at(total, index, weights * forces[:, None])
    return total


def hat_stresses(load: ToothLoad, gear: SpurGear, points: Array) -> Array:
    """Half-plane stress of all hats of a tooth at points (n, 2), (n, 3) [Pa]."""
    total = np.zeros((len(points), 3))
    frame = flank_frame(gear, load.arcs)
    for x, n, p, q in zip(*frame, load.normal, load.rootward, strict=True):
        if p != 0.0 or q != 0.0:
            total += halfplane.hat_stress(points, x, n, load.step, p, q)
    return total


def von_mises(stress: Array, out_of_plane: Array) -> Array:
    """Equivalent stress (n,) of xx, yy, xy (n, 3) and zz (n,) [Pa]."""
    (x, y, xy), z = stress.T, out_of_plane
    squares = (x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2
    return np.sqrt(0.5 * squares + 3.0 * xy**2)


def nodal_stress(sector: CyclicSector) -> csr_array:
    """(3 nodes, freedoms) from displacement to stress averaged at the nodes [Pa/m].

    Components run slowest: xx at all nodes, then yy, then xy.
    """
    from skfem import Basis

    corners = np.array([[0.0, 1.0, 0.0, 0.5, 0.5, 0.0], [0.0, 0.0, 1.0, 0.0, 0.5, 0.5]])
    basis = Basis(
        sector.basis.mesh, sector.basis.elem, quadrature=(corners, np.ones(6) / 12.0)
    )
    lam, mu = sector.material.lame
    nodes, total = sector.mesh.triangles, len(sector.mesh.points)
    weight = 1.0 / np.bincount(nodes.ravel())[nodes]
    entries, rows, columns = [], [], []
    for (field,), dofs in zip(basis.basis, basis.element_dofs, strict=True):
        (xx, xy), (yx, yy) = field.grad  # each (elements, 6)
        stress = (
            lam * (xx + yy) + 2.0 * mu * xx,
            lam * (xx + yy) + 2.0 * mu * yy,
            mu * (xy + yx),
        )
        for component, values in enumerate(stress):
            entries.append((weight * values).ravel())
            rows.append((component * total + nodes).ravel())
            columns.append(np.repeat(dofs, 6))
    indices = (np.concatenate(rows), np.concatenate(columns))
    shape = (3 * total, sector.basis.N)
    return csr_array((np.concatenate(entries), indices), shape=shape)
