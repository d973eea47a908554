"""Teeth of their true width under loads that are uniform over it.

A tooth of finite width is softer than one in plane strain: at its free ends material
can move along the axis. The difference is found by finite elements on one mesh, so that
the singular errors of a point load cancel, and added to the flank compliance in plane
strain, whose half-plane part is exact. Displacement is the mean over the width.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, csr_array

from fegear.elasticity.flank import (
    MAX_TOOTH_OFFSET,
    FlankCompliance,
    flank_compliance,
    resolve_on_flank,
)
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.ring import nodal_diameter_phase
from fegear.elasticity.sector import RIGHT, CyclicSector, cyclic_sector, factorise
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.width_functions import (
    END_LAYERS,
    WidthFunctions,
    layered_functions,
)
from fegear.files.timing import stage
from lumped.common.array_types import Array, Complex
from lumped.common.workers import require_running
from meshes import MeshSize, SpurGear

MAX_STEP = 0.35  # between nodal diameters n that are solved, in ln(1 + n)
SPLINE_DEGREE = 3  # over the flank
MESH_REFINEMENT = 0.4  # of the default mesh, whose errors cancel in the difference
NEGLIGIBLE = 1e-12  # integral over the width over the largest one of its kind
# A0, A1, A2 (0, 1, 2) between freedoms in the section (0) and along the axis (1)
Blocks = dict[tuple[int, int, int], Any]


@dataclass(frozen=True, eq=False)
class WidthCorrection:
    """Flank compliance of teeth of a width less that in plane strain [m/(N/m)].

    normal, tangential : (teeth, n, n), as in `FlankCompliance`, at points of a mesh
    """

    normal: Array
    tangential: Array

    def added_to(self, compliance: FlankCompliance, gear: SpurGear) -> FlankCompliance:
        """The compliance of a gear's teeth of that width."""
        table_places = flank_places(gear, self.normal.shape[1])
        places = flank_places(gear, compliance.normal.shape[1])
        tables = (
            interpolated(table, table_places, places)
            for table in (self.normal, self.tangential)
        )
        normal, tangential = tables
        return replace(
            compliance,
            normal=compliance.normal + normal,
            tangential=compliance.tangential + tangential,
        )


def interpolated(
    table: Array, table_places: Array, places: Array, axes: tuple[int, int] = (1, 2)
) -> Array:
    """A table of flank places along two axes, such as (teeth, n, n), at others."""
    from scipy.interpolate import make_interp_spline

    for axis in axes:
        spline = make_interp_spline(table_places, table, SPLINE_DEGREE, axis=axis)
        # the result has the interpolated axis in its place
        table = spline(places)
    return table


def flank_places(gear: SpurGear, count: int) -> Array:
    """Places of so many points of a flank, in equal steps from vertex to vertex.

    Corners at the ends are none, see `FlankPoints`; the vertices of meshes of any size
    are graded alike.
    """
    if gear.is_undercut:
        return np.linspace(0.0, 1.0, count + 2)[1:-1]
    return np.linspace(0.0, 1.0, count + 1)[1:]


def width_correction(gear: SpurGear, material: PlaneMaterial) -> WidthCorrection:
    """Mean displacement of teeth of the material's width less that in plane strain."""
    if material.width is None:
        raise ValueError(f"plane = {material.plane}; must be width")
    sector = cyclic_sector(gear, material, MeshSize().refined(MESH_REFINEMENT))
    layers = [layer * gear.module for layer in END_LAYERS]
    wide = WideSector(TwistedSector(sector), layered_functions(material.width, layers))
    plane = flank_compliance(sector, split=False)
    # the mean over the width of displacement under loads of one per width
    normal, tangential = (
        table[:, :, 0, :, 0] / material.width for table in wide.flank_tables()
    )
    return WidthCorrection(normal - plane.normal, tangential - plane.tangential)


@dataclass(frozen=True, eq=False)
class WideSector:
    """A sector of a gear of finite width.

    functions : even and odd ones in turn
    loads : the functions that loads are made of
    """

    twisted: TwistedSector
    functions: WidthFunctions
    loads: tuple[int, ...] = (0,)

    @property
    def sector(self) -> CyclicSector:
        return self.twisted.sector

    def flank_tables(
        self, diameters: NDArray[np.int64] | None = None
    ) -> tuple[Array, Array]:
        """Displacement of flank points over the width (teeth, n, k, n, l) [m3/N].

        Integral of the load function k times displacement along the inward normal, and
        toward the root, under forces along the inward normal on one tooth, whose
        density over the width is the load function l.

        diameters : nodal ones that are solved, by default `spaced_diameters`
        """
        teeth = self.sector.gear.teeth
        if diameters is None:
            diameters = spaced_diameters(teeth)
        spectrum = np.stack([self._harmonic(int(n)) for n in diameters])
        normal = ring_tables(spectrum[:, 0], diameters, teeth)
        return normal, ring_tables(spectrum[:, 1], diameters, teeth)

    @cached_property
    def _blocks(self) -> dict[tuple[int, int, int], csr_array]:
        """A0, A1, A2 between freedoms in the section (0) and along the axis (1)."""
        freedoms = self.twisted.freedoms
        return {
            (order, a, b): csr_array(matrix[rows][:, columns])
            for order, matrix in enumerate(self.twisted.section_matrices)
            for a, rows in enumerate(freedoms)
            for b, columns in enumerate(freedoms)
        }

    @property
    def _groups(self) -> list[tuple[tuple[int, ...], list[tuple[int, int]]]]:
        """Loads that act on each other, and the modes (component, function) they move.

        Components are in the section (0) and along z (1). In a spur gear even loads
        have even displacement in the section and odd displacement along z.
        """
        count = range(self.functions.values.shape[1])
        if self.twisted.twist:
            return [(self.loads, [(a, k) for a in (0, 1) for k in count])]
        groups = []
        for parity in (0, 1):
            loads = tuple(load for load in self.loads if load % 2 == parity)
            modes = [(0, k) for k in count if k % 2 == parity]
            modes += [(1, k) for k in count if k % 2 != parity]
            if loads:
                groups.append((loads, modes))
        return groups

    def _harmonic(self, diameters: int) -> Complex:
        """Displacement (2, n, k, n, l), as in `flank_tables`, with nodal diameters."""
        require_running()
        phase = nodal_diameter_phase(diameters, self.sector.gear.teeth)
        in_section = self.sector.cyclic_constraint(phase)
        return self.solve((in_section, self.twisted.axial_constraint(phase)))

    def solve(self, constraints: tuple[csr_array, csr_array]) -> Complex:
        """Displacement (2, n, k, n, l), as in `flank_tables`, of a constrained sector.

        constraints : from what is free to all freedoms, in the section and along z
        """
        flank = self.sector.flanks[RIGHT]
        blocks = {
            (order, a, b): constraints[a].conj().T @ matrix @ constraints[b]
            for (order, a, b), matrix in self._blocks.items()
        }
        normals = self.twisted.flank_normals
        loads = [c.conj().T @ n for c, n in zip(constraints, normals, strict=True)]
        points, count = len(flank.arcs), len(self.loads)
        result = np.zeros((2, points, count, points, count), complex)
        with stage("width"):
            for group, modes in self._groups:
                factor = factorise(self._stiffness(blocks, modes))
                shares = self.functions.mass[:, group]
                load = np.vstack([np.kron(shares[k], loads[a]) for a, k in modes])
                solved = factor.solve(load)
                columns = [self.loads.index(one) for one in group]
                at = np.ix_(range(2), range(points), columns, range(points), columns)
                result[at] = self._on_flank(solved, modes, group, constraints)
        return result

    def _on_flank(
        self,
        solved: Complex,
        modes: list[tuple[int, int]],
        loads: tuple[int, ...],
        constraints: tuple[csr_array, csr_array],
    ) -> Complex:
        """Displacement (2, n, k, n, l) of the flank from the solution of a group."""
        flank, normals = self.sector.flanks[RIGHT], self.twisted.flank_normals
        axial, in_section = self.twisted.node_of[flank.dofs[:, 0]], flank.dofs.ravel()
        on_flank = constraints[0][in_section], constraints[1][axial]
        points, count = len(flank.arcs), len(loads)
        moved = [
            np.zeros((count, rows.shape[0], solved.shape[1]), complex)
            for rows in on_flank
        ]
        start = 0
        for component, k in modes:
            rows = on_flank[component]
            part = rows @ solved[start : start + rows.shape[1]]
            moved[component] += self.functions.mass[loads, k][:, None, None] * part
            start += rows.shape[1]
        cosine = math.cos(self.sector.gear.base_helix_angle)
        normal, rootward = resolve_on_flank(flank, moved[0])
        along = np.asarray(normals[1][axial, np.arange(points)])
        normal = cosine * normal + along[:, None] * moved[1]
        tables = np.stack([normal, rootward])
        # columns are loads k by points j
        by_load = tables.reshape(2, count, points, count, points)
        return np.asarray(by_load.transpose(0, 2, 1, 4, 3))

    def _stiffness(self, blocks: Blocks, modes: list[tuple[int, int]]) -> csr_array:
        rows = [[self._block(blocks, one, two) for two in modes] for one in modes]
        return csr_array(block_array(rows))

    def _block(
        self,
        blocks: Blocks,
        row: tuple[int, int],
        column: tuple[int, int],
    ) -> Any:
        """Stiffness between two modes (component, function)."""
        (a, k), (b, m) = row, column
        functions = self.functions
        terms = [
            (functions.mass[k, m], 0, False),
            (functions.cross[k, m], 1, False),
            (functions.cross[m, k], 1, True),
            (functions.stretch[k, m], 2, False),
        ]
        total = None
        for factor, order, is_mirrored in terms:
            if abs(factor) < NEGLIGIBLE * functions.scale[order]:
                continue
            block = blocks[order, b, a].conj().T if is_mirrored else blocks[order, a, b]
            total = factor * block if total is None else total + factor * block
        return total


def spaced_diameters(teeth: int, step: float = MAX_STEP) -> NDArray[np.int64]:
    """Nodal diameters to solve: the first ones, then in steps that grow with n.

    step : largest one in ln(1 + n)
    """
    last = teeth // 2
    count = max(4, 1 + int(np.ceil(np.log1p(last) / step)))
    spaced = np.expm1(np.linspace(0.0, np.log1p(last), count))
    return np.unique(
        np.concatenate([np.arange(min(3, last) + 1), np.rint(spaced)])
    ).astype(np.int64)


def ring_tables(
    spectrum: Sequence[Complex] | Complex, diameters: NDArray[np.int64], teeth: int
) -> Array:
    """Displacement (teeth, n, n) of teeth around a loaded one, from a spectrum.

    spectrum : (k, n, n) of the nodal diameters; a spline in ln(1 + n) has the others
    """
    from scipy.interpolate import CubicSpline

    every = np.arange(teeth // 2 + 1)
    values = np.asarray(spectrum)
    if len(diameters) < len(every):
        # those of teeth - n are conjugate, which leads the spline past the last one
        beyond = [n for n in range(2) if teeth - diameters[-1 - n] > diameters[-1]]
        solved_diameters = [*diameters, *(teeth - diameters[-1 - n] for n in beyond)]
        mirrored = [np.conj(values[-1 - n]) for n in beyond]
        spline = CubicSpline(np.log1p(solved_diameters), np.stack([*values, *mirrored]))
        values = spline(np.log1p(every))
    standing = (every == 0) | (2 * every == teeth)
    weights = np.where(standing, 1.0, 2.0) / teeth
    offsets = np.arange(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1)
    phases = weights * np.exp(2j * np.pi * np.outer(offsets, every) / teeth)
    return np.real(np.tensordot(phases, values, 1))
