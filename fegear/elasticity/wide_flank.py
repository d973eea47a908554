"""Compliance of a flank to loads that vary over the width, of spur and helical gears.

Loads and displacements over the width are polynomials, between points of the flank in
the section. What they cannot follow, the yielding near a force, is that of a half-space
and is left out here: see `fegear.elasticity.line_kernel`. What remains is smooth in
both directions. It has three parts:

- finite elements over the width less those in plane strain, on one mesh, so that the
  singular errors of a point load in the section cancel,
- the flank compliance in plane strain, whose half-plane part is exact,
- less the half-space kernel, projected on the same polynomials.

A unit force along the normal of a helical flank is spread over 1 / cos(beta_r) of a
helix per length of the axis, and acts by as much less on it: so much of plane strain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fegear.elasticity.condensed_width import NO_NODES, width_tables
from fegear.elasticity.flank import (
    MAX_TOOTH_OFFSET,
    FlankCompliance,
    flank_compliance,
)
from fegear.elasticity.halfplane import normal_kernel
from fegear.elasticity.line_kernel import DECAY, LineKernel
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import RIGHT, cyclic_sector
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.wide_root import (
    RootModes,
    fillet_nodes,
    root_modes,
    root_places,
)
from fegear.elasticity.wide_sector import WideSector
from fegear.elasticity.width import interpolated
from fegear.elasticity.width_functions import layered_polynomials
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from meshes import MeshSize, SpurGear
from meshes.outline import flank_arcs
from meshes.profile import roll_length_at_arc

DEGREE = 8  # of the polynomials over the width
# Layers at both ends [modules] of what displaces the teeth under loads in polynomials:
# without them the ends of a tip edge are 5 to 8 % too stiff
SHORT_END_LAYERS = 0.4, 0.1
# a coarse mesh, with few points near the tip corner, where the difference is smooth,
# and with the fillet of the default mesh, for the stress there
MESH = replace(
    MeshSize().refined(0.4), flank_edges=10, flank_grading=4.5, fillet_edges=10
)


@dataclass(frozen=True, eq=False)
class WidthModes:
    """Finite elements over the width less those in plane strain [m/N].

    arcs : (n,) of points of the flank from the tip corner [m]
    normal, tangential : (teeth, n, k, n, k) displacement at these points, in
        polynomials k over the width, under forces in such polynomials
    """

    arcs: Array
    normal: Array
    tangential: Array

    @property
    def degree(self) -> int:
        return self.normal.shape[2] - 1


@dataclass(frozen=True, eq=False)
class WideFlank:
    """Smooth compliance of a flank in polynomials over the width [m/N].

    normal, tangential : (teeth, n, k, n, k) as in `WidthModes`, of teeth around the
        loaded one as in `FlankCompliance`; that of the loaded tooth lacks `kernel`
    kernel : of the yielding near a force, on the loaded tooth
    flank_length, grading, both_ends : of the n points, as `flank_stencils` takes them
    """

    normal: Array
    tangential: Array
    kernel: LineKernel
    flank_length: float
    grading: float
    both_ends: bool

    @property
    def width(self) -> float:
        return self.kernel.width

    @property
    def degree(self) -> int:
        return self.normal.shape[2] - 1

    @property
    def mirrored(self) -> WideFlank:
        """Compliance of the gear with the helix in the other direction."""
        sign = (-1.0) ** np.arange(self.degree + 1)
        signs = sign[:, None, None] * sign
        return replace(
            self,
            normal=self.normal * signs,
            tangential=self.tangential * signs,
            kernel=self.kernel.mirrored,
        )


def width_modes(
    gear: SpurGear,
    material: PlaneMaterial,
    degree: int = DEGREE,
    size: MeshSize = MESH,
) -> WidthModes:
    """Solve the finite elements of a gear of the material's width.

    degree : of the polynomials; size : of the mesh
    """
    return _solved(gear, material, degree, size, with_root=False)[0]


def width_and_root_modes(
    gear: SpurGear, material: PlaneMaterial, degree: int = DEGREE, size: MeshSize = MESH
) -> tuple[WidthModes, RootModes]:
    """Solve the finite elements as `width_modes`, and for the root stress."""
    modes, root = _solved(gear, material, degree, size, with_root=True)
    return modes, require_present(root, "root")


def _solved(
    gear: SpurGear,
    material: PlaneMaterial,
    degree: int,
    size: MeshSize,
    with_root: bool,
) -> tuple[WidthModes, RootModes | None]:
    width = material.width
    if width is None:
        raise ValueError(f"plane = {material.plane}; must be width")
    sector = cyclic_sector(gear, material, size)
    layers = [layer * gear.module for layer in SHORT_END_LAYERS]
    functions = layered_polynomials(width, degree, layers, root_places(width))
    loads = tuple(range(degree + 1))
    wide = WideSector(TwistedSector(sector), functions, loads)
    tables = width_tables(wide, nodes=fillet_nodes(wide) if with_root else NO_NODES)
    plane = flank_compliance(sector, split=False)
    arcs = sector.flanks[RIGHT].arcs
    share = _share_of_plane(gear, arcs)
    normal, tangential = (
        table / width**2 - _uniform(share * of_plane, width, degree)
        for table, of_plane in zip(
            (tables.normal, tables.rootward),
            (plane.normal, plane.tangential),
            strict=True,
        )
    )
    modes = WidthModes(arcs, normal, tangential)
    return modes, root_modes(wide, tables, width) if with_root else None


def wide_flank(
    gear: SpurGear, compliance: FlankCompliance, modes: WidthModes, width: float
) -> WideFlank:
    """The compliance over a width [m].

    compliance : of the gear in plane strain
    """
    arcs = _arcs(gear, compliance)
    rolls = roll_length_at_arc(gear, arcs)
    radii = np.hypot(gear.base_radius, rolls)
    share = _share_of_plane(gear, arcs)
    old = _places(gear, modes.arcs)
    new = np.clip(_places(gear, arcs), old[0], old[-1])
    normal, tangential = (
        interpolated(table, old, new, (1, 3))
        + _uniform(share * of_plane, width, modes.degree)
        for table, of_plane in zip(
            (modes.normal, modes.tangential),
            (compliance.normal, compliance.tangential),
            strict=True,
        )
    )
    helix = gear.twist, gear.base_helix_angle
    kernel = LineKernel(
        compliance.modulus, width, DECAY * gear.module, *helix, tip_corner_angle(gear)
    )
    half_plane = normal_kernel(arcs[:, None] - arcs[None, :], compliance.modulus)
    loaded = normal[MAX_TOOTH_OFFSET]
    loaded += _uniform(share * half_plane, width, modes.degree)
    loaded -= kernel.projected(arcs, rolls, radii, modes.degree)
    ends = compliance.flank_length, compliance.grading, gear.is_undercut
    return WideFlank(normal, tangential, kernel, *ends)


def tip_corner_angle(gear: SpurGear) -> float:
    """Angle of the material between flank and tip land [rad]."""
    sine = gear.tip_roll_length / gear.tip_radius * math.cos(gear.base_helix_angle)
    return 0.5 * math.pi + math.asin(sine)


def _arcs(gear: SpurGear, compliance: FlankCompliance) -> Array:
    """Arcs (n,) of the points of a compliance from the tip corner [m]."""
    edges, grading = compliance.normal.shape[1], compliance.grading
    arcs = flank_arcs(gear, MeshSize(flank_edges=edges, flank_grading=grading))
    return arcs[1:-1] if gear.is_undercut else arcs[1:]


def _places(gear: SpurGear, arcs: Array) -> Array:
    """Places (n,) of arcs [m], in nearly equal steps between points of `MESH`."""
    grading, ratio = MESH.flank_grading, arcs / gear.flank_length
    if gear.is_undercut:  # points are graded toward both ends
        part = np.arctanh((2.0 * ratio - 1.0) * np.tanh(0.5 * grading))
        return np.asarray(0.5 + part / grading)
    return np.asarray(np.arcsinh(ratio * np.sinh(grading)) / grading)


def _share_of_plane(gear: SpurGear, arcs: Array) -> Array:
    """cos(beta_r) (n, n) between points of the flank."""
    radii = np.hypot(gear.base_radius, roll_length_at_arc(gear, arcs))
    cosine = 1.0 / np.hypot(1.0, gear.twist * radii)
    return np.asarray(np.sqrt(np.outer(cosine, cosine)))


def _uniform(table: Array, width: float, degree: int) -> Array:
    """A table (..., n, n) per load per width in polynomials (..., n, k, n, k)."""
    return table[..., :, None, :, None] * np.eye(degree + 1)[:, None, :] / width
