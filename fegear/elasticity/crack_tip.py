"""Stress intensities and energy release rate at the tip of a crack.

Stress intensities are linear in displacement, so that they are rows of weights over the
freedoms of the rings around the tip. They come from the interaction integral over the
rings (Yau, Wang & Corten 1980), and for comparison from the opening of the two faces
next to the tip, whose displacement varies as the square root of the distance. The
energy release rate comes from Rice's integral, taken over the rings (Li, Shih &
Needleman 1985), or from both intensities, G = (K_I^2 + K_II^2) / E'.

The crack is straight within the rings, and its faces are free of traction there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fegear.elasticity.material import PlaneMaterial
from lumped.common.array_types import Array, Indices
from meshes.cracked_region import CrackTip

INNER_PART = 0.35  # of the rings' radius up to which they are shifted rigidly
QUADRATURE_ORDER = 8


@dataclass(frozen=True, eq=False)
class TipField:
    """Rings around the tip of a crack, in axes along it and to its left.

    Attributes
    ----------
    material : PlaneMaterial
        Material of the body.
    dofs : (m, 6, 2) array
        Freedoms x and y of the nodes of m triangles.
    gradients : (m, q, 6, 2) array
        Gradients of the shape functions at q points of each [1/m], along and across.
    weights : (m, q) array
        Area of these points [m2].
    radius, angle : (m, q) array
        Their polar coordinates about the tip [m], [rad].
    shift : (m, 2) array
        Gradient of the virtual shift, 1 at the tip and 0 outside [1/m].
    axes : (2, 2) array
        Unit vectors along the crack and to its left, one in each row.
    face_dofs : (2, 2, 2) array
        Freedoms of `CrackTip.faces`.
    side : float
        Length of the sides at the tip [m].
    """

    material: PlaneMaterial
    dofs: Indices
    gradients: Array
    weights: Array
    radius: Array
    angle: Array
    shift: Array
    axes: Array
    face_dofs: Indices
    side: float

    @cached_property
    def rows(self) -> Indices:
        """Freedoms (k,) on which all quantities depend."""
        return np.unique(self.dofs)

    @cached_property
    def interaction(self) -> Array:
        """Weights (2, k) of K_I and K_II by the interaction integral [Pa/m^0.5]."""
        return np.stack([self._interaction(mode) for mode in range(2)])

    @cached_property
    def correlation(self) -> Array:
        """Weights (2, k) of K_I and K_II by displacement correlation [Pa/m^0.5].

        The opening next to the tip is A r^0.5 + B r^1.5, at a quarter of the side
        A / 2 + B / 8 and at its end A + B.
        """
        weights = np.zeros((2, len(self.rows)))
        factor = self.material.modulus / 8.0 * math.sqrt(2.0 * math.pi / self.side)
        at = np.searchsorted(self.rows, self.face_dofs)
        for face, sign in ((0, -1.0), (1, 1.0)):  # the left face opens to the left
            for node, part in ((0, 8.0 / 3.0), (1, -1.0 / 3.0)):
                for mode, axis in enumerate(self.axes[::-1]):
                    weights[mode, at[face, node]] += sign * part * factor * axis
        return weights

    def energy_release_rate(self, u: Array) -> Array:
        """Rice's integral (loads,) [J/m2] of displacement (k, loads) at `rows`."""
        at = np.searchsorted(self.rows, self.dofs)
        local = np.einsum("ac,mncl->mnal", self.axes, u[at])
        gradient = np.einsum("mnal,mqnj->mqajl", local, self.gradients)
        stress = self._stress(gradient)
        density = 0.5 * np.einsum("mqajl,mqajl->mql", stress, gradient)
        flux = np.einsum("mqajl,mqal->mqjl", stress, gradient[..., 0, :])
        shifted = np.einsum("mqjl,mj->mql", flux, self.shift)
        shifted -= density * self.shift[:, None, :1]
        return np.einsum("mql,mq->l", shifted, self.weights)

    def _stress(self, gradient: Array) -> Array:
        """Stress of displacement gradients, the tensor in axes 2 and 3."""
        first, shear = self.material.lame
        turned = np.swapaxes(gradient, 2, 3)
        trace = gradient[:, :, 0, 0] + gradient[:, :, 1, 1]
        stress = shear * (gradient + turned)
        stress[:, :, 0, 0] += first * trace
        stress[:, :, 1, 1] += first * trace
        return stress

    def _interaction(self, mode: int) -> Array:
        stress, slope = self._williams(mode)
        shift = self.shift[:, None, :]
        # sigma(u) : (slope x shift) is u's gradient times the stress of that tensor
        tensor = slope[..., :, None] * shift[..., None, :]
        factor = self._stress(tensor)
        factor[..., 0] += np.einsum("mqaj,mj->mqa", stress, self.shift)
        factor -= stress * shift[..., :1, None]
        nodal = np.einsum("mqaj,mqnj,mq->mna", factor, self.gradients, self.weights)
        nodal = 0.5 * self.material.modulus * np.einsum("mna,ac->mnc", nodal, self.axes)
        weights = np.zeros(len(self.rows))
        np.add.at(weights, np.searchsorted(self.rows, self.dofs), nodal)
        return weights

    def _williams(self, mode: int) -> tuple[Array, Array]:
        """Stress (m, q, 2, 2), and derivative (m, q, 2) of displacement along the path.

        Unit intensity; Anderson, Fracture Mechanics (2005), tables 2.1 and 2.2.
        """
        r, half = self.radius, 0.5 * self.angle
        c, s = np.cos(half), np.sin(half)
        c3, s3 = np.cos(3.0 * half), np.sin(3.0 * half)
        if mode == 0:
            xx, yy, xy = c * (1.0 - s * s3), c * (1.0 + s * s3), s * c * c3
        else:
            xx, yy, xy = -s * (2.0 + c * c3), s * c * c3, c * (1.0 - s * s3)
        scale = 1.0 / np.sqrt(2.0 * math.pi * r)
        stress = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1)
        stress *= scale[..., None, None]
        nu, E = self.material.poisson, self.material.modulus
        along = (stress[..., 0, 0] - nu * stress[..., 1, 1]) / E
        # u_y = r^0.5 f(theta), so that its derivative in x follows from f and f'
        kappa, shear = (3.0 - nu) / (1.0 + nu), 0.5 * E / (1.0 + nu)
        if mode == 0:
            f = s * (kappa + 1.0 - 2.0 * c**2)
            slope = 0.5 * c * (kappa + 1.0 - 2.0 * c**2) + 2.0 * c * s**2
        else:
            f = -c * (kappa - 1.0 - 2.0 * s**2)
            slope = 0.5 * s * (kappa - 1.0 - 2.0 * s**2) + 2.0 * c**2 * s
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        across = (0.5 * f * cos - slope * sin) * scale / (2.0 * shear)
        return stress, np.stack([along, across], axis=-1)


def tip_field(
    points: Array,
    triangles: Indices,
    node_dofs: Indices,
    tip: CrackTip,
    material: PlaneMaterial,
) -> TipField:
    """Rings around a tip of a mesh.

    Parameters
    ----------
    points : (n, 2) array
        Nodes [m].
    triangles : (m, 6) array
        As in `SectorMesh`.
    node_dofs : (n, 2) array
        Freedoms x and y of the nodes.
    tip : CrackTip
        Tip of the mesh.
    material : PlaneMaterial
        Material of the body.
    """
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefTri

    cells = triangles[tip.triangles]
    axes = np.array([tip.direction, [-tip.direction[1], tip.direction[0]]])
    nodes = (points[cells] - points[tip.node]) @ axes.T
    at, weight = get_quadrature(RefTri, QUADRATURE_ORDER)
    shape, slope = _shape_functions(*at)
    jacobian = np.einsum("mna,qnj->mqaj", nodes, slope)
    gradients = np.einsum("qnj,mqja->mqna", slope, np.linalg.inv(jacobian))
    place = np.einsum("mna,qn->mqa", nodes, shape)
    inner = INNER_PART * tip.radius
    corner_radius = np.hypot(*np.moveaxis(nodes[:, :3], -1, 0))
    value = np.clip((tip.radius - corner_radius) / (tip.radius - inner), 0.0, 1.0)
    # triangles have straight sides where the shift varies
    way = nodes[:, 1:3] - nodes[:, :1]
    rise = (value[:, 1:] - value[:, :1])[..., None]
    faces = node_dofs[tip.faces]
    return TipField(
        material,
        node_dofs[cells],
        gradients,
        np.linalg.det(jacobian) * weight,
        np.hypot(place[..., 0], place[..., 1]),
        np.arctan2(place[..., 1], place[..., 0]),
        np.linalg.solve(way, rise)[..., 0],
        axes,
        faces,
        float(np.hypot(*(points[tip.faces[0, 1]] - points[tip.node]))),
    )


def _shape_functions(x: Array, y: Array) -> tuple[Array, Array]:
    """Shape functions (q, 6) on the unit triangle, and their gradients (q, 6, 2)."""
    z, zero = 1.0 - x - y, np.zeros_like(x)
    shape = [z * (2 * z - 1), x * (2 * x - 1), y * (2 * y - 1)]
    shape += [4 * z * x, 4 * x * y, 4 * y * z]
    along_x = [1 - 4 * z, 4 * x - 1, zero, 4 * (z - x), 4 * y, -4 * y]
    along_y = [1 - 4 * z, zero, 4 * y - 1, -4 * x, 4 * x, 4 * (z - y)]
    gradients = np.stack([np.stack(along_x, 1), np.stack(along_y, 1)], axis=-1)
    return np.stack(shape, axis=1), gradients
