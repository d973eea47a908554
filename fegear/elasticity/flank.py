"""Flank compliance of one gear: the singular half-plane part and the rest.

The displacement under a unit line load is Flamant's field of the tangent
half-plane, taken over the loaded sector, plus a smooth remainder w that finite
elements resolve on a coarse mesh. Flamant's field is an exact solution inside
the body, so w is loaded only by minus its tractions on the sector's boundary,
and jumps by its values on the cuts and the hub.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity import halfplane
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.ring import ring_response
from fegear.elasticity.sector import (
    CondensedSector,
    SectorModel,
    assemble_sector,
    boundary_quadrature,
    condense,
)
from fegear.timing import stage
from meshes import MeshSize, SectorMesh, SpurGear, sector_mesh
from meshes.profile import flank_tangents, roll_length_at_arc

Array = NDArray[np.float64]
REACH = 3  # teeth on either side of the loaded one whose deflection is kept
FREE_BOUNDARIES = ("tip", "flank", "fillet", "root", "cut")


@dataclass(frozen=True)
class FlankCompliance:
    """Displacement of flank points per unit normal line load [m/(N/m)].

    normal : (2 REACH + 1, n, n) inward normal displacement at point i of the tooth
        `offset` to the right of the loaded one (index offset + REACH), under a
        unit inward normal load at point j; of the loaded tooth itself only the
        smooth remainder beside the half-plane kernel
    tangential : same shape, displacement toward the root
    flank_length : [m]; points lie at arcs flank_length sinh(beta t) / sinh(beta)
        from the tip corner, t = 1/n, 2/n, ..., 1; grading is beta
    modulus, poisson : E' [Pa] and nu' of the plane state
    split : whether the half-plane kernel was taken out of the loaded tooth
    """

    normal: Array
    tangential: Array
    flank_length: float
    grading: float
    modulus: float
    poisson: float
    split: bool = True

    @property
    def reciprocity_error(self) -> float:
        """Largest violation of Maxwell's theorem relative to the compliance."""
        mirrored = self.normal[::-1].transpose(0, 2, 1)
        return float(np.abs(self.normal - mirrored).max() / np.abs(self.normal).max())


@dataclass(frozen=True)
class FlankPoints:
    """Points of the right flank, unit directions and freedoms (x, y) there."""

    points: Array  # (n, 2)
    inward: Array  # (n, 2)
    rootward: Array  # (n, 2)
    arcs: Array  # (n,)
    freedoms: NDArray[np.int64]  # (n, 2)


@dataclass(frozen=True)
class Excitation:
    """What one set of loads does to sector 0.

    force : (freedoms, loads) nodal loads
    held : (hub, loads) prescribed displacement of the hub freedoms
    jump : (cut, loads) polar displacement by which the continuous field exceeds
        sector 0's own on its cuts
    """

    force: Array
    held: Array
    jump: Array


def flank_compliance(
    gear: SpurGear,
    material: PlaneMaterial,
    size: MeshSize | None = None,
    order: int = 2,
    split: bool = True,
) -> FlankCompliance:
    """Compute the compliance of one flank, hub held.

    split=False leaves the half-plane part to the finite elements; it is there to
    be compared with, and its diagonal depends on the mesh.
    """
    size = size or MeshSize()
    with stage("meshing"):
        mesh = sector_mesh(gear, size)
    with stage("assembling"):
        model = assemble_sector(mesh, material, order)
    with stage("condensing"):
        sector = condense(model, gear.teeth)
        loads = flank_points_of(gear, mesh, model)
        excite = split_excitation if split else nodal_excitation
        excitation = excite(mesh, model, sector, loads, material)
        rows = loads.freedoms.ravel()
        teeth = range(-REACH, REACH + 1)
        fields = ring_fields(gear, model, sector, excitation, teeth)
        u = np.stack([fields[tooth][rows] for tooth in teeth])
        if split:
            u[REACH] += flamant_displacement(model, loads, material, rows)
    u = u.reshape(len(teeth), len(loads.arcs), 2, -1)
    normal = np.einsum("micj,ic->mij", u, loads.inward)
    tangential = np.einsum("micj,ic->mij", u, loads.rootward)
    if split:
        distance = loads.arcs[:, None] - loads.arcs[None, :]
        E, nu = material.modulus, material.poisson
        normal[REACH] -= halfplane.normal_kernel(distance, E)
        tangential[REACH] -= halfplane.tangential_kernel(distance, E, nu)
    return FlankCompliance(
        normal,
        tangential,
        gear.flank_length,
        size.flank_grading,
        material.modulus,
        material.poisson,
        split,
    )


def flank_points_of(
    gear: SpurGear, mesh: SectorMesh, model: SectorModel
) -> FlankPoints:
    """The flank vertices where loads act, all but the tip corner itself."""
    arcs = mesh.flank_arcs[1:]
    tangent = flank_tangents(gear, roll_length_at_arc(gear, arcs))
    inward = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    nodes = mesh.flank_nodes[1:]
    return FlankPoints(
        mesh.points[nodes], inward, -tangent, arcs, model.node_freedoms[nodes]
    )


def flamant_displacement(
    model: SectorModel,
    loads: FlankPoints,
    material: PlaneMaterial,
    dofs: NDArray[np.int64],
    load_angle: float = 0.0,
) -> Array:
    """Flamant's displacement at freedoms given as (x, y) pairs, (dofs, n)."""
    places = model.locations[dofs[::2]]
    E, nu = material.modulus, material.poisson
    fields = [
        halfplane.displacement(places, x, n, E, nu, load_angle)
        for x, n in zip(loads.points, loads.inward, strict=True)
    ]
    return np.stack([u.ravel() for u in fields], axis=1)


def split_excitation(
    mesh: SectorMesh,
    model: SectorModel,
    sector: CondensedSector,
    loads: FlankPoints,
    material: PlaneMaterial,
    load_angle: float = 0.0,
) -> Excitation:
    """What drives the remainder w; load_angle as in `halfplane.displacement`."""
    names = [side + name for name in FREE_BOUNDARIES for side in ("", "left_")]
    names = [name for name in names if name in mesh.edges]
    boundary = boundary_quadrature(model, mesh, names)
    tractions = [
        halfplane.traction(boundary.points, boundary.normals, x, n, load_angle)
        for x, n in zip(loads.points, loads.inward, strict=True)
    ]
    force = -(boundary.operator @ np.stack([t.T.ravel() for t in tractions], axis=1))
    cut = flamant_displacement(model, loads, material, model.cut, load_angle)
    hub = flamant_displacement(model, loads, material, model.hub, load_angle)
    return Excitation(force, -hub, sector.polar.T @ cut)


def nodal_excitation(
    mesh: SectorMesh,
    model: SectorModel,
    sector: CondensedSector,
    loads: FlankPoints,
    material: PlaneMaterial,
) -> Excitation:
    """Point loads straight on the flank vertices, without a singular part."""
    count = len(loads.points)
    force = np.zeros((model.basis.N, count))
    for component in range(2):
        dofs = loads.freedoms[:, component]
        force[dofs, np.arange(count)] = loads.inward[:, component]
    held = np.zeros((len(model.hub), count))
    return Excitation(force, held, np.zeros((len(model.cut), count)))


def ring_fields(
    gear: SpurGear,
    model: SectorModel,
    sector: CondensedSector,
    excitation: Excitation,
    teeth: Iterable[int],
) -> dict[int, Array]:
    """Displacement (freedoms, loads) of the sectors `teeth` to the right of the
    excited one; of the excited sector the remainder only."""
    inner, cut, half = model.inner, model.cut, len(model.cut) // 2
    load = excitation.force - model.stiffness[:, model.hub] @ excitation.held
    settled = sector.factor.solve(np.ascontiguousarray(load[inner]))
    coupling = model.stiffness[cut][:, inner]
    cut_load = sector.polar.T @ (load[cut] - coupling @ settled)
    cut_load += sector.superelement @ excitation.jump
    wanted = list(teeth)
    cuts = range(min(wanted) - 1, max(wanted) + 1)
    edges = ring_response(
        sector.superelement, cut_load[:half], cut_load[half:], gear.teeth, cuts
    )
    fields = {}
    for tooth in wanted:
        ends = np.vstack([edges[tooth - 1], edges[tooth]])
        if tooth == 0:
            ends -= excitation.jump
        field = np.zeros_like(excitation.force)
        field[inner] = -sector.response @ ends
        field[cut] = sector.polar @ ends
        if tooth == 0:
            field[inner] += settled
            field[model.hub] = excitation.held
        fields[tooth] = field
    return fields
