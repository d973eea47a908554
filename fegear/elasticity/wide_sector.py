"""A sector of a gear of finite width: stiffness between functions of the width."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import block_array, csr_array

from fegear.elasticity.flank import resolve_on_flank
from fegear.elasticity.sector import RIGHT, CyclicSector, factorise
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.width_functions import WidthFunctions
from fegear.files.timing import stage
from lumped.common.array_types import Complex

NEGLIGIBLE = 1e-12  # integral over the width over the largest one of its kind
# A0, A1, A2 (0, 1, 2) between freedoms in the section (0) and along the axis (1)
Blocks = dict[tuple[int, int, int], Any]
Modes = list[tuple[int, int]]  # component, 0 or 1, and function of the width


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

    @cached_property
    def blocks(self) -> dict[tuple[int, int, int], csr_array]:
        """A0, A1, A2 between freedoms in the section (0) and along the axis (1)."""
        freedoms = self.twisted.freedoms
        return {
            (order, a, b): csr_array(matrix[rows][:, columns])
            for order, matrix in enumerate(self.twisted.section_matrices)
            for a, rows in enumerate(freedoms)
            for b, columns in enumerate(freedoms)
        }

    @property
    def groups(self) -> list[tuple[tuple[int, ...], Modes]]:
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

    def solve(self, constraints: tuple[csr_array, csr_array]) -> Complex:
        """Displacement (2, n, k, n, l) of a constrained sector [m3/N].

        Integral of the load function k times displacement along the inward normal, and
        toward the root, under forces along the inward normal, whose density over the
        width is the load function l.

        constraints : from what is free to all freedoms, in the section and along z
        """
        flank = self.sector.flanks[RIGHT]
        blocks = {
            (order, a, b): constraints[a].conj().T @ matrix @ constraints[b]
            for (order, a, b), matrix in self.blocks.items()
        }
        normals = self.twisted.flank_normals
        loads = [c.conj().T @ n for c, n in zip(constraints, normals, strict=True)]
        points, count = len(flank.arcs), len(self.loads)
        result = np.zeros((2, points, count, points, count), complex)
        with stage("width"):
            for group, modes in self.groups:
                factor = factorise(self.stiffness(blocks, modes))
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
        modes: Modes,
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

    def stiffness(self, blocks: Blocks, modes: Modes) -> csr_array:
        """Stiffness between modes, from blocks as of `blocks` of what is free."""
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
