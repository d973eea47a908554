"""Flank compliance of one gear: the singular half-plane part and the rest.

The displacement under a unit line load is Flamant's field of the tangent
half-plane, taken over the loaded sector, plus a smooth remainder w that finite
elements resolve on a coarse mesh. Flamant's field is an exact solution inside
the body, so w is loaded only by minus its tractions on the sector's boundary,
and jumps by its values on the cuts and the hub.
"""

from __future__ import annotations

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
class _Loads:
    """Flamant fields of unit normal loads at the flank points of sector 0."""

    points: Array  # (n, 2)
    inward: Array  # (n, 2)
    rootward: Array  # (n, 2)
    arcs: Array  # (n,)
    freedoms: NDArray[np.int64]  # (n, 2)


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
        loads = _flank_loads(gear, mesh, model)
        solve = _split_displacement if split else _nodal_displacement
        fields = solve(gear, material, mesh, model, sector, loads)
    normal = np.stack([np.einsum("icj,ic->ij", u, loads.inward) for u in fields])
    tangential = np.stack([np.einsum("icj,ic->ij", u, loads.rootward) for u in fields])
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


def _flank_loads(gear: SpurGear, mesh: SectorMesh, model: SectorModel) -> _Loads:
    """Load points at the flank vertices, except the tip corner itself."""
    arcs = mesh.flank_arcs[1:]
    tangent = flank_tangents(gear, roll_length_at_arc(gear, arcs))
    inward = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    nodes = mesh.flank_nodes[1:]
    return _Loads(
        mesh.points[nodes], inward, -tangent, arcs, model.node_freedoms[nodes]
    )


def _split_displacement(
    gear: SpurGear,
    material: PlaneMaterial,
    mesh: SectorMesh,
    model: SectorModel,
    sector: CondensedSector,
    loads: _Loads,
) -> list[Array]:
    names = [side + name for name in FREE_BOUNDARIES for side in ("", "left_")]
    names = [name for name in names if name in mesh.edges]
    boundary = boundary_quadrature(model, mesh, names)
    E, nu = material.modulus, material.poisson
    pairs = list(zip(loads.points, loads.inward, strict=True))
    tractions = [
        halfplane.traction(boundary.points, boundary.normals, x, n).T.ravel()
        for x, n in pairs
    ]
    force = -(boundary.operator @ np.stack(tractions, axis=1))

    def singular(dofs: NDArray[np.int64]) -> Array:
        """Flamant's displacement at freedoms given as (x, y) pairs, (dofs, n)."""
        places = model.locations[dofs[::2]]
        fields = [halfplane.displacement(places, x, n, E, nu) for x, n in pairs]
        return np.stack([u.ravel() for u in fields], axis=1)

    hub = _paired(model.hub, model)
    jump = sector.polar.T @ singular(model.cut)
    remainder = _ring_displacement(
        gear, model, sector, loads.freedoms, force, (hub, -singular(hub)), jump
    )
    own = singular(loads.freedoms.ravel())
    remainder[REACH] += own.reshape(remainder[REACH].shape)
    return remainder


def _nodal_displacement(
    gear: SpurGear,
    material: PlaneMaterial,
    mesh: SectorMesh,
    model: SectorModel,
    sector: CondensedSector,
    loads: _Loads,
) -> list[Array]:
    """Point loads straight on the flank vertices, without a singular part."""
    count = len(loads.points)
    force = np.zeros((model.basis.N, count))
    for component in range(2):
        dofs = loads.freedoms[:, component]
        force[dofs, np.arange(count)] = loads.inward[:, component]
    hub = _paired(model.hub, model)
    held = (hub, np.zeros((len(hub), count)))
    jump = np.zeros((len(model.cut), count))
    return _ring_displacement(gear, model, sector, loads.freedoms, force, held, jump)


def _paired(dofs: NDArray[np.int64], model: SectorModel) -> NDArray[np.int64]:
    """Freedoms sorted so that x and y of one place follow each other."""
    x, y = model.locations[dofs].T
    return dofs[np.lexsort((dofs, np.round(x, 12), np.round(y, 12)))]


def _ring_displacement(
    gear: SpurGear,
    model: SectorModel,
    sector: CondensedSector,
    flank: NDArray[np.int64],
    force: Array,
    held: tuple[NDArray[np.int64], Array],
    jump: Array,
) -> list[Array]:
    """Flank displacement (n, 2, loads) of the teeth -REACH..REACH.

    flank : (n, 2) freedoms of the flank points
    force : (freedoms, loads) on sector 0
    held : hub freedoms and their prescribed remainder (hub, loads)
    jump : (cut, loads) polar displacement by which sector 0's cuts differ from
        the continuous field
    """
    inner, cut, half = model.inner, model.cut, len(model.cut) // 2
    hub, prescribed = held
    reaction = model.stiffness[:, hub] @ prescribed
    load = force - reaction
    settled = sector.factor.solve(np.ascontiguousarray(load[inner]))
    coupling = model.stiffness[cut][:, inner]
    cut_load = sector.polar.T @ (load[cut] - coupling @ settled)
    cut_load += sector.superelement @ jump
    cuts = ring_response(
        sector.superelement,
        cut_load[:half],
        cut_load[half:],
        gear.teeth,
        range(-REACH - 1, REACH + 1),
    )
    place = np.full(model.basis.N, -1)
    place[inner] = np.arange(len(inner))
    rows = place[flank.ravel()]
    response = sector.response[rows]
    shape = (*flank.shape, force.shape[1])
    fields = []
    for tooth in range(-REACH, REACH + 1):
        ends = np.vstack([cuts[tooth - 1], cuts[tooth]])
        if tooth == 0:
            ends -= jump
        u = -response @ ends
        if tooth == 0:
            u += settled[rows]
        fields.append(u.reshape(shape))
    return fields
