"""Flank compliance of one gear: the singular half-plane part and the rest.

The displacement under a unit line load is Flamant's field of the tangent
half-plane, taken over the loaded sector, plus a smooth remainder w that finite
elements resolve on a coarse mesh. Flamant's field is an exact solution inside
the body, so w is loaded only by minus its tractions on the sector's boundary,
and jumps by its values on the cuts and the hub.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fegear.elasticity import halfplane
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.ring import ring_response
from fegear.elasticity.sector import RIGHT, CyclicSector, FlankPoints
from fegear.files.timing import stage
from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr
from lumped.common.workers import require_running
from meshes import MeshSize, SpurGear

MAX_TOOTH_OFFSET = 3  # teeth on either side of the loaded one whose deflection is kept
FREE_BOUNDARIES = ("tip", "flank", "fillet", "root", "cut", "crack")


@dataclass(frozen=True)
class FlankOrigin(ShortRepr):
    """What the finite elements of a flank compliance were made from."""

    gear: SpurGear
    material: PlaneMaterial
    size: MeshSize


@dataclass(frozen=True)
class FlankCompliance(ShortRepr):
    """Displacement of flank points per unit normal line load [m/(N/m)].

    normal : (2 MAX_TOOTH_OFFSET + 1, n, n) inward normal displacement at point i of the
        tooth `offset` to the right of the loaded one (index offset + MAX_TOOTH_OFFSET),
        under a unit inward normal load at point j; of the loaded tooth itself only the
        smooth remainder, without the half-plane kernel
    tangential : same shape, displacement toward the root
    flank_length : [m]
    grading : of the points between the ends of the flank, beta of
        `fegear.elasticity.flank_grid`
    modulus, poisson : E' [Pa] and nu' of the plane state
    split : whether the half-plane kernel was taken out of the loaded tooth
    origin : of a gear that is held, from which `rootward_compliance` follows, or None
    """

    normal: Array
    tangential: Array
    flank_length: float
    grading: float
    modulus: float
    poisson: float
    split: bool = True
    origin: FlankOrigin | None = None

    @property
    def reciprocity_error(self) -> float:
        """Largest violation of Maxwell's theorem relative to the compliance."""
        mirrored = self.normal[::-1].transpose(0, 2, 1)
        return float(np.abs(self.normal - mirrored).max() / np.abs(self.normal).max())


@dataclass(frozen=True)
class SectorLoads(ShortRepr):
    """Sets of loads on sector 0, one in each column.

    force : (freedoms, loads) nodal forces
    hub : (hub, loads) prescribed displacement of the hub freedoms
    jump : (cut, loads) polar displacement by which the continuous field exceeds
        sector 0's own on its cuts
    """

    force: Array
    hub: Array
    jump: Array


def flank_compliance(sector: CyclicSector, split: bool = True) -> FlankCompliance:
    """Compute the compliance of one flank, hub held.

    split=False leaves the half-plane part to the finite elements; it is there to
    be compared with, and its diagonal depends on the mesh.
    """
    flank, material = sector.flanks[RIGHT], sector.material
    normal, tangential = resolve_on_flank(flank, _flank_fields(sector, 0.0, split))
    if split:
        for table, kernel in zip(
            (normal, tangential), half_plane_kernels(sector), strict=True
        ):
            table[MAX_TOOTH_OFFSET] -= kernel
    return FlankCompliance(
        normal,
        tangential,
        sector.gear.flank_length,
        sector.size.flank_grading,
        material.modulus,
        material.poisson,
        split,
    )


def rootward_compliance(sector: CyclicSector, split: bool = True) -> Array:
    """Displacement toward the root under unit loads toward the root, hub held.

    Returns an array like `FlankCompliance.normal`, to be used with the same half-plane
    kernel. split : as in `flank_compliance`
    """
    flank = sector.flanks[RIGHT]
    inward, rootward = flank.inward[0], flank.rootward[0]
    turn = inward[0] * rootward[1] - inward[1] * rootward[0]
    u = _flank_fields(sector, math.copysign(0.5 * math.pi, turn), split)
    _, rootward_table = resolve_on_flank(flank, u)
    if split:
        of_loaded = rootward_table[MAX_TOOTH_OFFSET]
        of_loaded -= half_plane_kernels(sector)[0]
        # the half-plane's surface is displaced by (1 + nu') / (pi E') more along a load
        # on it, of which Flamant's field has nothing in the loaded point itself
        E, nu = sector.material.modulus, sector.material.poisson
        np.einsum("ii->i", of_loaded)[:] += (1.0 + nu) / (math.pi * E)
    return rootward_table


def _flank_fields(sector: CyclicSector, load_angle: float, split: bool) -> Array:
    """Displacement (teeth, 2 n, loads) of flanks under loads on that of one tooth."""
    rows = sector.flanks[RIGHT].dofs.ravel()
    teeth = range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1)
    load = flamant_loads if split else nodal_loads
    fields = ring_fields(sector, load(sector, load_angle), teeth)
    u = np.stack([fields[tooth][rows] for tooth in teeth])
    if split:
        u[MAX_TOOTH_OFFSET] += flamant_displacement(sector, rows, load_angle)
    return u


def resolve_on_flank(flank: FlankPoints, u: Array) -> tuple[Array, Array]:
    """Displacement (..., n, loads) along the inward normals and toward the root.

    u : (..., 2 n, loads) at the freedoms of the flank's points
    """
    u = u.reshape(*u.shape[:-2], len(flank.arcs), 2, u.shape[-1])
    normal = np.einsum("...icj,ic->...ij", u, flank.inward)
    return normal, np.einsum("...icj,ic->...ij", u, flank.rootward)


def half_plane_kernels(sector: CyclicSector) -> tuple[Array, Array]:
    """Kernels (n, n) of the half-plane that `FlankCompliance` does without."""
    arcs, material = sector.flanks[RIGHT].arcs, sector.material
    distance = arcs[:, None] - arcs[None, :]
    E, nu = material.modulus, material.poisson
    tangential = halfplane.tangential_kernel(distance, E, nu)
    return halfplane.normal_kernel(distance, E), tangential


def flamant_displacement(
    sector: CyclicSector,
    dofs: NDArray[np.int64],
    load_angle: float = 0.0,
    side: int = RIGHT,
) -> Array:
    """Flamant's displacement at freedoms given as (x, y) pairs, (freedoms, n)."""
    locations, flank = sector.locations[dofs[::2]], sector.flanks[side]
    E, nu = sector.material.modulus, sector.material.poisson
    fields = [
        halfplane.displacement(locations, x, n, E, nu, load_angle)
        for x, n in zip(flank.points, flank.inward, strict=True)
    ]
    return np.stack([u.ravel() for u in fields], axis=1)


def flamant_loads(
    sector: CyclicSector, load_angle: float = 0.0, side: int = RIGHT
) -> SectorLoads:
    """What drives the remainder w under a unit load at each point of a flank.

    load_angle : as in `halfplane.displacement`
    """
    names = [side + name for name in FREE_BOUNDARIES for side in ("", "left_")]
    if sector.foundation is not None:
        names += ["hub", "left_hub"]
    boundary = sector.boundary_quadrature([n for n in names if n in sector.mesh.edges])
    flank = sector.flanks[side]
    tractions = [
        halfplane.traction(boundary.points, boundary.normals, x, n, load_angle)
        for x, n in zip(flank.points, flank.inward, strict=True)
    ]
    force = -(boundary.operator @ np.stack([t.T.ravel() for t in tractions], axis=1))
    if sector.foundation is not None:
        # freedoms of the outside, as (x, y) pairs: see `CyclicSector.node_dofs`
        dofs = np.unique(sector.springs.indices).astype(np.int64)
        outside = flamant_displacement(sector, dofs, load_angle, side)
        force -= csr_array(sector.springs[:, dofs]) @ outside
    cut = flamant_displacement(sector, sector.cut, load_angle, side)
    hub = flamant_displacement(sector, sector.hub, load_angle, side)
    return SectorLoads(force, -hub, sector.polar.T @ cut)


def nodal_loads(
    sector: CyclicSector, load_angle: float = 0.0, side: int = RIGHT
) -> SectorLoads:
    """Unit point loads straight on a flank's points, no singular part.

    load_angle : as in `flamant_loads`
    """
    flank = sector.flanks[side]
    count = len(flank.points)
    force = np.zeros((sector.basis.N, count))
    across = np.stack([-flank.inward[:, 1], flank.inward[:, 0]], axis=1)
    direction = math.cos(load_angle) * flank.inward + math.sin(load_angle) * across
    for component in range(2):
        dofs = flank.dofs[:, component]
        force[dofs, np.arange(count)] = direction[:, component]
    hub, cut = np.zeros((len(sector.hub), count)), np.zeros((len(sector.cut), count))
    return SectorLoads(force, hub, cut)


def join_loads(sets: Sequence[SectorLoads]) -> SectorLoads:
    """Columns of several sets of loads, one set after another."""
    parts = [(loads.force, loads.hub, loads.jump) for loads in sets]
    return SectorLoads(*(np.hstack(part) for part in zip(*parts, strict=True)))


def ring_fields(
    sector: CyclicSector,
    loads: SectorLoads,
    teeth: Iterable[int],
    dofs: NDArray[np.int64] | None = None,
) -> dict[int, Array]:
    """Displacement (freedoms, loads) of the sectors `teeth` to the right of the
    loaded one; of the loaded sector the remainder only.

    dofs : freedoms that are returned, in this order; all by default
    """
    half = len(sector.cut) // 2
    tooth_offsets = list(teeth)
    with stage("ring"):
        held = hold_cuts(sector, loads)
        cuts = range(min(tooth_offsets) - 1, max(tooth_offsets) + 1)
        edges = ring_response(
            sector.condensation.superelement,
            held.cut_load[:half],
            held.cut_load[half:],
            sector.gear.teeth,
            cuts,
        )
        fields = {}
        rows = SectorRows.of(sector, dofs)
        for tooth in tooth_offsets:
            ends = np.vstack([edges[tooth - 1], edges[tooth]])
            fields[tooth] = sector_field(
                sector, rows, ends, held if tooth == 0 else None
            )
    return fields


@dataclass(frozen=True, eq=False)
class HeldSolution:
    """A loaded sector with its cuts held.

    loads : what acts on it
    particular : (interior, loads) displacement of the interior
    cut_load : (cut, loads) polar forces on the cuts that it leaves to the ring
    """

    loads: SectorLoads
    particular: Array
    cut_load: Array


def hold_cuts(sector: CyclicSector, loads: SectorLoads) -> HeldSolution:
    """Solve a loaded sector with its cuts held."""
    require_running()
    interior, cut, K = sector.interior, sector.cut, sector.stiffness
    condensed = sector.condensation
    load = loads.force - K[:, sector.hub] @ loads.hub
    particular = condensed.solve(load[interior])
    cut_load = sector.polar.T @ (load[cut] - K[cut][:, interior] @ particular)
    cut_load += condensed.superelement @ loads.jump
    return HeldSolution(loads, particular, cut_load)


def sector_field(
    sector: CyclicSector, rows: SectorRows, ends: Array, held: HeldSolution | None
) -> Array:
    """Displacement (rows, loads) of a sector that follows from that of its cuts.

    ends : (cut, loads) polar displacement of the cuts
    held : of the sector, where it is itself loaded; its remainder is returned
    """
    if held is not None:
        ends = ends - held.loads.jump
    field = np.zeros((rows.count, ends.shape[1]))
    field[rows.interior[0]] = -sector.condensation.response[rows.interior[1]] @ ends
    field[rows.cut[0]] = sector.polar[rows.cut[1]] @ ends
    if held is not None:
        field[rows.interior[0]] += held.particular[rows.interior[1]]
        field[rows.hub[0]] = held.loads.hub[rows.hub[1]]
    return field


@dataclass(frozen=True)
class SectorRows:
    """Rows of a field, and which freedoms of the interior, cuts and hub they are.

    A pair each: rows (m,) of the field, and rows of the part, in the same order.
    """

    count: int
    interior: tuple[Any, Any]
    cut: tuple[Any, Any]
    hub: tuple[Any, Any]

    @classmethod
    def of(cls, sector: CyclicSector, dofs: NDArray[np.int64] | None) -> SectorRows:
        """Rows of some freedoms, or of all in their order where it is None."""
        parts = sector.interior, sector.cut, sector.hub
        if dofs is None:
            every = slice(None)
            return cls(sector.basis.N, *((part, every) for part in parts))
        return cls(dofs.size, *(_matches(dofs, part) for part in parts))


def _matches(dofs: NDArray[np.int64], part: NDArray[np.int64]) -> tuple[Any, Any]:
    """Where freedoms are that a part has, and where the part has them."""
    rows = np.flatnonzero(np.isin(dofs, part))
    order = np.argsort(part)
    return rows, order[np.searchsorted(part[order], dofs[rows])]
