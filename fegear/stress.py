"""Stress in one tooth sector under contact loads on its own and other teeth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from skfem import Basis

from fegear.contact.compliance import PATCH, set_stencil
from fegear.contact.loads import PatchLoad
from fegear.elasticity import halfplane
from fegear.elasticity.flank import (
    FlankPoints,
    flank_points_of,
    ring_fields,
    split_excitation,
)
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import SectorModel, assemble_sector, condense
from meshes import MeshSize, SectorMesh, SpurGear, sector_mesh
from meshes.profile import flank_points, flank_tangents, roll_length_at_arc

Array = NDArray[np.float64]
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


def tooth_loads(
    loads: Sequence[PatchLoad], gear: Literal["driver", "driven"], tooth: int = 0
) -> list[ToothLoad]:
    """Contact loads as one gear feels them, seen from its tooth of pair `tooth`.

    The pair ahead is to the right on the driver and to the left on the driven gear.
    """
    sign = 1 if gear == "driver" else -1
    arcs = [p.driver_arcs if gear == "driver" else p.driven_arcs for p in loads]
    return [
        ToothLoad(sign * (p.tooth - tooth), where, p.step, p.normal, p.rootward)
        for p, where in zip(loads, arcs, strict=True)
    ]


@dataclass(frozen=True)
class SectorStress:
    """Stress at the nodes of a sector mesh.

    components : (nodes, 3) as (xx, yy, xy) in the tooth frame [Pa]
    out_of_plane : (nodes,) zz, zero in plane stress [Pa]
    """

    mesh: SectorMesh
    components: Array
    out_of_plane: Array

    @property
    def von_mises(self) -> Array:
        """Equivalent stress at the nodes (nodes,) [Pa]."""
        (x, y, xy), z = self.components.T, self.out_of_plane
        squares = (x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2
        return np.sqrt(0.5 * squares + 3.0 * xy**2)

    @property
    def root_stress(self) -> float:
        """Largest tension along the fillet on the loaded side [Pa].

        The fillet is free, so its only stress is the trace.
        """
        nodes = np.unique(self.mesh.edges["fillet"])
        return float(self.components[nodes, :2].sum(axis=1).max())


def sector_stress(
    gear: SpurGear,
    material: PlaneMaterial,
    loads: Sequence[ToothLoad],
    size: MeshSize | None = None,
) -> SectorStress:
    """Stress of the sector with tooth 0; loads may act on any teeth.

    The remainder's stress is averaged at the nodes; the hats' own half-plane
    stress is exact and resolves the contact below the mesh size.
    """
    mesh = sector_mesh(gear, size)
    model = assemble_sector(mesh, material)
    displacement = _remainder(gear, material, mesh, model, loads)
    stress = nodal_stress(mesh, model, material) @ displacement
    components = stress.reshape(3, -1).T
    for load in loads:
        if load.tooth == 0:
            components += hat_stresses(load, gear, mesh.points)
    nu = material.poisson_ratio if material.plane == "strain" else 0.0
    return SectorStress(mesh, components, nu * components[:, :2].sum(axis=1))


def _remainder(
    gear: SpurGear,
    material: PlaneMaterial,
    mesh: SectorMesh,
    model: SectorModel,
    loads: Sequence[ToothLoad],
) -> Array:
    """Remainder displacement of sector 0 at its freedoms (n,)."""
    sector = condense(model, gear.teeth)
    points = flank_points_of(gear, mesh, model)
    field = np.zeros(model.basis.N)
    for angle in (0.0, ROOTWARD):
        weights = {
            load.tooth: vertex_loads(load, points, mesh, angle) for load in loads
        }
        if not any(w.any() for w in weights.values()):
            continue
        excitation = split_excitation(mesh, model, sector, points, material, angle)
        # what a load on tooth j does to sector 0, tooth 0 does to sector -j
        fields = ring_fields(gear, model, sector, excitation, [-j for j in weights])
        for j, w in weights.items():
            field += fields[-j] @ w
    return field


def vertex_loads(
    load: ToothLoad, points: FlankPoints, mesh: SectorMesh, angle: float
) -> Array:
    """Loads (n,) on the flank vertices with the same smooth remainder."""
    forces = load.normal if angle == 0.0 else load.rootward
    place = cast(Any, set_stencil).py_func  # the kernel's own, uncompiled
    count = len(points.arcs)
    # arcs are a smooth function of the index, whose inverse is interpolated here
    flank = SimpleNamespace(length=points.arcs[-1], grading=_grading(mesh))
    patch = np.zeros(1, PATCH).view(np.recarray)[0]
    weights = np.zeros(count)
    for arc, force in zip(load.arcs, forces, strict=True):
        place(patch, 0, 0, arc, flank, count)
        first = patch.first[0, 0]
        weights[first : first + 4] += force * patch.weights[0, 0]
    return weights


def _grading(mesh: SectorMesh) -> float:
    """beta of arcs = length sinh(beta t) / sinh(beta), from the first two edges."""
    one, two = mesh.flank_arcs[1:3]
    edges = len(mesh.flank_arcs) - 1
    return float(edges * np.arccosh(max(1.0, 0.5 * two / one)))


def hat_stresses(load: ToothLoad, gear: SpurGear, points: Array) -> Array:
    """Half-plane stress of all hats of a tooth at points (n, 2), (n, 3) [Pa]."""
    rolls = roll_length_at_arc(gear, load.arcs)
    tangent = flank_tangents(gear, rolls)
    inward = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    origins = flank_points(gear, rolls)
    total = np.zeros((len(points), 3))
    for x, n, p, q in zip(origins, inward, load.normal, load.rootward, strict=True):
        if p != 0.0 or q != 0.0:
            total += halfplane.hat_stress(points, x, n, load.step, p, q)
    return total


def nodal_stress(
    mesh: SectorMesh, model: SectorModel, material: PlaneMaterial
) -> csr_array:
    """(3 nodes, freedoms) from displacement to stress averaged at the nodes [Pa/m].

    Components run slowest: xx at all nodes, then yy, then xy.
    """
    corners = np.array([[0.0, 1.0, 0.0, 0.5, 0.5, 0.0], [0.0, 0.0, 1.0, 0.0, 0.5, 0.5]])
    basis = Basis(
        model.basis.mesh, model.basis.elem, quadrature=(corners, np.ones(6) / 12.0)
    )
    lam, mu = material.lame
    nodes, total = mesh.triangles, len(mesh.points)
    weight = 1.0 / np.bincount(nodes.ravel())[nodes]
    entries, rows, columns = [], [], []
    for (field,), freedoms in zip(basis.basis, basis.element_dofs, strict=True):
        (xx, xy), (yx, yy) = field.grad  # each (elements, 6)
        stress = (
            lam * (xx + yy) + 2.0 * mu * xx,
            lam * (xx + yy) + 2.0 * mu * yy,
            mu * (xy + yx),
        )
        for component, values in enumerate(stress):
            entries.append((weight * values).ravel())
            rows.append((component * total + nodes).ravel())
            columns.append(np.repeat(freedoms, 6))
    where = (np.concatenate(rows), np.concatenate(columns))
    shape = (3 * total, model.basis.N)
    return csr_array((np.concatenate(entries), where), shape=shape)
