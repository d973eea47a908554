"""Root stress of a gear of finite width under loads that vary over it.

Root stress is the tension in the surface of the fillet, across the helix along which
that runs; of straight teeth it is in the section. The surface is free, and displacement
in it gives the strain across and along the helix. With displacement R(tau z) u in the
frame that turns with the helix, see `fegear.elasticity.twisted_sector`, the derivative
along the helix, per length of the axis, is R (du/dz + tau J u).

Loads are polynomials over the width, and what is solved is the difference to plane
strain under the same density of load, on one mesh, in which the errors of a line load
near the fillet cancel. The root evens out what polynomials of that degree leave out.
The fillet is that of the loaded flanks, where tension is largest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fegear.elasticity.condensed_width import WidthTables
from fegear.elasticity.flank import MAX_TOOTH_OFFSET as SOLVED_OFFSET
from fegear.elasticity.flank import nodal_loads, ring_fields
from fegear.elasticity.flank_grid import flank_stencils
from fegear.elasticity.root_stress import (
    MAX_TOOTH_OFFSET,
    Fillet,
    RootInfluence,
    fillets_of,
    half_plane,
)
from fegear.elasticity.sector import RIGHT, CyclicSector
from fegear.elasticity.wide_sector import WideSector
from fegear.elasticity.width import interpolated
from fegear.elasticity.width_functions import polynomial_values
from lumped.common.array_types import Array, Indices

NEAR_FLANK = 0.25  # of the fillet, in modules, that is not the root
PLACES = 33  # over the width, at which stress is known


@dataclass(frozen=True, eq=False)
class RootModes:
    """Tension across the right fillet less that in plane strain [1/m].

    arcs : (n,) of the points of load from the tip corner [m]
    grading : of these points, as in `FlankCompliance`
    along : (f,) of points of the fillet, from the flank on [m]
    places : (z,) over the width, from its middle, ends included [m]
    stress : (teeth, n, k, f, z) by loaded tooth as in `RootInfluence`, point and
        polynomial of the density of normal force over the width, and point of the
        fillet
    """

    arcs: Array
    grading: float
    along: Array
    places: Array
    stress: Array

    @property
    def mirrored(self) -> RootModes:
        """Stress of the gear with the helix in the other direction."""
        signs = (-1.0) ** np.arange(self.stress.shape[2])
        stress = self.stress[..., ::-1] * signs[:, None, None]
        return replace(self, stress=stress)


def fillet_nodes(wide: WideSector) -> Indices:
    """Nodes (p, 2) of the right fillet, as their freedoms in the plane sector."""
    return np.unique(fillets_of(wide.sector)[0].dofs.reshape(-1, 2), axis=0)


def root_places(width: float) -> Array:
    """Places over a width [m] from its middle, ends included, dense near them."""
    return 0.5 * width * np.sin(np.linspace(-0.5, 0.5, PLACES) * math.pi)


def root_modes(wide: WideSector, tables: WidthTables, width: float) -> RootModes:
    """Stress from tables in which the `fillet_nodes` are chosen.

    wide : of a width [m], loaded by polynomials; its functions have the `root_places`
    """
    sector, places = wide.sector, root_places(width)
    fillet = fillets_of(sector)[0]
    # a load on tooth j does to tooth 0 what one on tooth 0 does to tooth -j
    first = SOLVED_OFFSET - MAX_TOOTH_OFFSET
    displaced = tables.nodes[::-1][first : first + 2 * MAX_TOOTH_OFFSET + 1]
    stress = _tension(wide, fillet, fillet_nodes(wide), displaced)
    density, _ = polynomial_values(width, len(wide.loads) - 1, places)
    plane = np.einsum("tnf,zk->tnkfz", _plane_tension(sector, fillet), density)
    stress -= math.cos(sector.gear.base_helix_angle) * plane
    return RootModes(
        arcs=sector.flanks[RIGHT].arcs,
        grading=sector.size.flank_grading,
        along=arcs_along(fillet.points),
        places=places,
        stress=stress,
    )


def _plane_tension(sector: CyclicSector, fillet: Fillet) -> Array:
    """Tension (teeth, n, f) under unit forces in plane strain, as `RootModes` [1/m]."""
    teeth = range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1)
    dofs = fillet.dofs.ravel()
    fields = ring_fields(sector, nodal_loads(sector), teeth, dofs)
    moved = np.stack([fields[-tooth] for tooth in teeth])
    moved = moved.reshape(len(teeth), *fillet.dofs.shape, -1)
    strain = np.einsum("eqac,teacn->tneq", fillet.strain, moved, optimize=True)
    tension = sector.material.modulus * strain
    return np.asarray(tension.reshape(*tension.shape[:2], -1))


def _tension(
    wide: WideSector, fillet: Fillet, nodes: Indices, displaced: Array
) -> Array:
    """Tension (teeth, n, k, f, z) across a fillet [1/m].

    displaced : (teeth, p, 3, functions, n, k) displacement of nodes (p, 2)
    """
    twist, material = wide.twisted.twist, wide.sector.material
    values, slopes = (
        of_functions[-PLACES:]
        for of_functions in (wide.functions.values, wide.functions.slopes)
    )
    at = np.searchsorted(nodes[:, 0], fillet.dofs[..., 0])
    of_edges = displaced[:, at]
    order = "teacfnk,{}->tnkeqcf"
    along = np.einsum(order.format("eqa"), of_edges, fillet.slopes, optimize=True)
    there = np.einsum(order.format("qa"), of_edges, fillet.values, optimize=True)
    shape = (*along.shape[:3], len(fillet.points), 3)

    def over_width(by_function: Array, functions: Array) -> Array:
        return np.asarray(by_function.reshape(*shape, -1) @ functions.T)

    by_section = over_width(along, values)
    turned = over_width(there, values)
    by_helix = over_width(there, slopes)
    by_helix[..., 0, :] -= twist * turned[..., 1, :]
    by_helix[..., 1, :] += twist * turned[..., 0, :]
    section = np.column_stack([fillet.tangents, np.zeros(len(fillet.points))])
    x, y = fillet.points.T
    helix = np.column_stack([-twist * y, twist * x, np.ones_like(x)])
    length = np.linalg.norm(helix, axis=1)
    helix /= length[:, None]
    by_helix /= length[:, None, None]
    cosine = np.einsum("fc,fc->f", helix, section)
    across = section - cosine[:, None] * helix
    by_across = by_section - cosine[:, None, None] * by_helix
    # one over the length of both directions that are across
    shortened = 1.0 / (1.0 - cosine**2)
    strain_across, strain_along = (
        np.einsum("fc,tnkfcz->tnkfz", direction, derivative, optimize=True)
        for direction, derivative in (
            (shortened[:, None] * across, by_across),
            (helix, by_helix),
        )
    )
    poisson = material.poisson_ratio
    plane = material.young_modulus / (1.0 - poisson**2)
    return np.asarray(plane * (strain_across + poisson * strain_along))


def arcs_along(points: Array) -> Array:
    """Arcs (f,) of points of a fillet from the first one [m]."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def _cosine(influence: RootInfluence) -> float:
    """Part of a normal force that is in the section."""
    return math.cos(influence.gear.base_helix_angle)


class LineLoad(NamedTuple):
    """Normal forces on a tooth at times (t,), over the width (s,).

    tooth : clockwise from the stressed one
    arcs : (t, s) from the tip corner [m]
    places : (t, s) from the middle of the gear [m]
    force : (t, s) [N]
    """

    tooth: int
    arcs: Array
    places: Array
    force: Array


@dataclass(frozen=True, eq=False)
class WideRoot:
    """Tension across the right fillet of one tooth over the width.

    section : the same of the section in plane strain
    width : [m]
    """

    section: RootInfluence
    modes: RootModes
    width: float

    @property
    def mirrored(self) -> WideRoot:
        """Stress of the gear with the helix in the other direction."""
        return replace(self, modes=self.modes.mirrored)

    @property
    def places(self) -> Array:
        """Places (z,) from the middle of the gear, ends included [m]."""
        return self.modes.places

    @cached_property
    def _difference(self) -> Array:
        """Stress as in `RootModes`, at the points of the section's fillet."""
        along = arcs_along(self.section.fillets[0])
        old = self.modes.along
        new = np.clip(along * (old[-1] / along[-1]), old[0], old[-1])
        return interpolated(self.modes.stress, old, new, (3,))

    def stress(self, loads: Sequence[LineLoad]) -> Array:
        """Largest tension along the fillet (t, z) [Pa]; 0 without load."""
        return self.largest(self.along_fillet(loads))

    def largest(self, tension: Array) -> Array:
        """Largest of tensions (t, f, z) over the fillet (t, z) [Pa], 0 at least.

        Near the flank they are those around a contact, not of the root.
        """
        largest = np.take_along_axis(tension, self.largest_at(tension), axis=1)
        return np.maximum(largest[:, 0], 0.0)

    def largest_at(self, tension: Array) -> Indices:
        """Point (t, 1, z) of the fillet of the largest of tensions (t, f, z)."""
        along = arcs_along(self.section.fillets[0])
        is_root = along > NEAR_FLANK * self.section.gear.module
        first = int(np.flatnonzero(is_root)[0])
        return first + tension[:, first:].argmax(axis=1, keepdims=True)

    def along_fillet(self, loads: Sequence[LineLoad]) -> Array:
        """Tension (t, f, z) across the fillet under all loads [Pa]."""
        points = self.section.fillets.shape[1]
        total = np.zeros((len(loads[0].force), points, self.places.size))
        for load in loads:
            if abs(load.tooth) <= MAX_TOOTH_OFFSET:
                total += self._under(load)
        return total

    def _under(self, load: LineLoad) -> Array:
        degree = self.modes.stress.shape[2] - 1
        density, _ = polynomial_values(self.width, degree, load.places.ravel())
        forces = load.force[..., None] * density.reshape(*load.places.shape, -1)
        forces /= self.width
        modes = self._difference[MAX_TOOTH_OFFSET + load.tooth]
        weights = self._weights(load.arcs)
        by_point = np.einsum("tsn,tsk->tnk", weights, forces)
        stress = np.tensordot(by_point, modes, 2)
        uniform = self._uniform(load.tooth, load.arcs, forces)
        over_width, _ = polynomial_values(self.width, degree, self.places)
        plane = _cosine(self.section) * np.einsum(
            "tkf,zk->tfz", uniform, over_width, optimize=True
        )
        return np.asarray(stress + plane)

    def _weights(self, arcs: Array) -> Array:
        """Weights (t, s, n) of the points of load of the modes."""
        gear, count = self.section.gear, len(self.modes.arcs)
        grid = gear.flank_length, self.modes.grading, count, gear.is_undercut
        index, weights = flank_stencils(arcs, *grid)
        return _dense(index, weights, count)

    def _uniform(self, tooth: int, arcs: Array, forces: Array) -> Array:
        """Stress (t, k, f) in plane strain under forces (t, s, k)."""
        section, gear = self.section, self.section.gear
        count = len(section.arcs)
        inside = np.clip(arcs, section.arcs[0], section.arcs[-1])
        grid = gear.flank_length, section.grading, count, gear.is_undercut
        index, weights = flank_stencils(inside, *grid)
        weights = _dense(index, weights, count)
        remainder = section.remainder[MAX_TOOTH_OFFSET + tooth][:, 0, 0]
        by_point = np.einsum("tsn,tsk->tkn", weights, forces, optimize=True)
        total = np.tensordot(by_point, remainder, 1)
        if tooth == 0:
            near = half_plane(gear, inside.ravel(), section.fillets)[:, 0, 0]
            near = near.reshape(*inside.shape, -1)
            total += np.einsum("tsf,tsk->tkf", near, forces, optimize=True)
        return np.asarray(total)


def _dense(index: Indices, weights: Array, count: int) -> Array:
    """Weights (..., count) of all points from those of four."""
    dense = np.zeros((*index.shape[:-1], count))
    np.put_along_axis(dense, index, weights, axis=-1)
    return dense
