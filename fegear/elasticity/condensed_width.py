"""Flank tables of a gear of finite width, by one real factorisation.

Only the tie between the two cuts of a sector depends on the nodal diameter. With both
cuts free the sector over the functions of the width is one real symmetric matrix
K = L D L^T, in which the cuts come last. The trailing blocks of the factors are the
Schur complement S of the cuts, and what one forward substitution makes of loads F and
measures W, f = L^-1 F and w = L^-1 W, has two parts: of the interior that is displaced
with held cuts, w_I^T D_I^-1 f_I, and of the forces that held cuts take, g = L_B f_B and
h = L_B w_B. With T = [1; phase] of a nodal diameter

    W^T u = w_I^T D_I^-1 f_I + h^T T (T^H S T)^-1 T^H g,

a dense system of some hundreds of unknowns for each. Nodes whose displacement is asked
for are eliminated late, so that the last rows of the factors alone have it:

    L_I^T u_I = D_I^-1 f_I - L_B^T u_B,   u_B = T (T^H S T)^-1 T^H g.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csc_array, csr_array, diags_array, hstack

from fegear.elasticity.flank import MAX_TOOTH_OFFSET
from fegear.elasticity.ring import nodal_diameter_phase
from fegear.elasticity.sector import RIGHT
from fegear.elasticity.wide_sector import Modes, WideSector
from fegear.files.timing import stage
from lumped.common.array_types import Array, Complex, Indices
from lumped.common.workers import require_running

TEETH = 2 * MAX_TOOTH_OFFSET + 1
NO_NODES: Indices = np.empty((0, 2), np.int64)
MAX_STEP = 0.15  # between nodal diameters n that are solved, in ln(1 + n)


@dataclass(frozen=True, eq=False)
class FreeCuts:
    """Displacement of all freedoms from that of a sector whose cuts are both free.

    matrix : (n, interior + 2 m), columns of the interior, the left and the right cut
    """

    matrix: csr_array
    interior: int

    @classmethod
    def of(cls, constraint: Callable[[complex], csr_array], cut: int) -> FreeCuts:
        """Take the part that the phase multiplies apart from the other.

        constraint : of the cuts at a phase; cut : freedoms of one of them
        """
        one, other = (csr_array(constraint(phase)).real for phase in (1.0, -1.0))
        interior = one.shape[1] - cut
        right = csr_array(0.5 * (one - other))[:, interior:]
        return cls(csr_array(hstack([0.5 * (one + other), right])), interior)

    @property
    def cut(self) -> int:
        """Freedoms of one cut."""
        return int((self.matrix.shape[1] - self.interior) // 2)


@dataclass(frozen=True, eq=False)
class Condensed:
    """A sector over the width on its cuts, with loads and measures (2 sets of them).

    schur : (2 m, 2 m) stiffness of the cuts, left ones first
    forces : (2 m, q) that held cuts take of the loads
    measured : (2, 2 m, q) the same of forces as the measures are
    held : (2, q, q) measures under loads with held cuts
    moved : (p, 2 m + q) displacement of chosen freedoms by that of the cuts, and under
        loads with held cuts
    """

    schur: Array
    forces: Array
    measured: Array
    held: Array
    moved: Array

    def at_phase(self, phase: complex) -> tuple[Complex, Complex]:
        """Measures (2, q, q) and displacement of the cuts (2 m, q).

        The right cut moves `phase` times as much as the left.
        """
        from scipy.linalg import lu_factor, lu_solve

        half = len(self.schur) // 2
        left, right = self.schur[:half], self.schur[half:]
        stiffness = left[:, :half] + right[:, half:]
        stiffness = (
            stiffness + phase * left[:, half:] + phase.conjugate() * right[:, :half]
        )
        load, measured = (
            part[..., :half, :] + phase.conjugate() * part[..., half:, :]
            for part in (self.forces, self.measured)
        )
        # functions that are nearly alike leave it positive up to round-off alone
        displacement = lu_solve(lu_factor(stiffness), load)
        back = np.conj(np.swapaxes(measured, 1, 2)) @ displacement
        cuts = np.vstack([displacement, phase * displacement])
        return np.asarray(self.held + back, complex), cuts

    def of_teeth(self, cuts: Array) -> Array:
        """Displacement (teeth, p, q) of the chosen freedoms of teeth around the loaded.

        cuts : (teeth, 2 m, q) displacement of their cuts
        """
        by_cuts, of_loads = np.split(self.moved, [len(self.schur)], axis=1)
        displacement = by_cuts @ cuts
        displacement[MAX_TOOTH_OFFSET] += of_loads
        return np.asarray(displacement)


@dataclass(frozen=True, eq=False)
class WidthTables:
    """Displacement of teeth around a loaded one.

    Forces are along the inward normal, and their density over the width is the load
    function l.

    normal, rootward : (teeth, n, k, n, l) integral of the load function k times
        displacement of flank points along the inward normal, and toward the root
        [m3/N]
    nodes : (teeth, p, 3, f, n, l) displacement of chosen nodes, in the section and
        along the axis, in functions f of the width [m2/N]
    """

    normal: Array
    rootward: Array
    nodes: Array


def width_tables(
    wide: WideSector,
    diameters: NDArray[np.int64] | None = None,
    nodes: Indices = NO_NODES,
) -> WidthTables:
    """Solve a sector for all nodal diameters of its gear.

    diameters : nodal ones that are solved, by default `spaced_diameters`
    nodes : (p, 2) that are chosen, as their freedoms in the plane sector
    """
    sector, teeth = wide.sector, wide.sector.gear.teeth
    if diameters is None:
        diameters = spaced_diameters(teeth)
    points, count = len(sector.flanks[RIGHT].arcs), len(wide.loads)
    shape = points, count, points, count
    spectrum = np.zeros((len(diameters), 2, *shape), complex)
    functions = wide.functions.values.shape[1]
    displaced = np.zeros((TEETH, len(nodes), 3, functions, points, count))
    cuts = (
        FreeCuts.of(sector.cyclic_constraint, len(sector.cut) // 2),
        FreeCuts.of(wide.twisted.axial_constraint, len(sector.cut) // 4),
    )
    for group, modes in wide.groups:
        require_running()
        columns = [wide.loads.index(load) for load in group]
        at = np.ix_(range(2), range(points), columns, range(points), columns)
        with stage("width"):
            condensed = condense(wide, cuts, group, modes, nodes)
            cut_spectrum = []
            for i, diameter in enumerate(diameters):
                phase = nodal_diameter_phase(int(diameter), teeth)
                tables, of_cuts = condensed.at_phase(phase)
                by_load = tables.reshape(2, len(group), points, len(group), points)
                spectrum[i][at] = by_load.transpose(0, 2, 1, 4, 3)
                cut_spectrum.append(of_cuts)
            if len(nodes):
                of_teeth = condensed.of_teeth(
                    ring_tables(cut_spectrum, diameters, teeth)
                )
                _place_nodes(displaced, of_teeth, modes, columns)
    return WidthTables(
        normal=ring_tables(spectrum[:, 0], diameters, teeth),
        rootward=ring_tables(spectrum[:, 1], diameters, teeth),
        nodes=displaced,
    )


def _place_nodes(
    displaced: Array, of_teeth: Array, modes: Modes, columns: list[int]
) -> None:
    """Put displacement of chosen freedoms, mode by mode, to its places among all.

    displaced : as `WidthTables.nodes`; columns : load functions of the group
    """
    teeth, nodes, _, _, points, _ = displaced.shape
    begin = 0
    for a, k in modes:
        components = [2] if a else [0, 1]
        rows = slice(begin, begin := begin + nodes * len(components))
        by_load = of_teeth[:, rows].reshape(
            teeth, nodes, len(components), len(columns), points
        )
        for i, component in enumerate(components):
            values = by_load[:, :, i].transpose(0, 1, 3, 2)
            displaced[:, :, component, k, :, columns] = np.moveaxis(values, -1, 0)


def condense(
    wide: WideSector,
    cuts: tuple[FreeCuts, FreeCuts],
    group: tuple[int, ...],
    modes: Modes,
    nodes: Indices = NO_NODES,
) -> Condensed:
    """The sector on its cuts, under the loads of a group that move some modes.

    cuts : freedoms in the section and along the axis
    nodes : (p, 2) whose displacement is wanted, as freedoms of the plane sector
    """
    from scipy.linalg import solve_triangular
    from scipy.sparse.linalg import splu

    blocks = {
        (order, a, b): csr_array(cuts[a].matrix.T @ matrix @ cuts[b].matrix)
        for (order, a, b), matrix in wide.blocks.items()
    }
    order, (interface, loaded, last) = _ordering(wide, cuts, modes, nodes)
    stiffness = csc_array(csr_array(wide.stiffness(blocks, modes))[order][:, order])
    factor = splu(
        stiffness,
        permc_spec="NATURAL",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    if not (factor.perm_r == np.arange(len(order))).all():
        raise ArithmeticError("the stiffness of a sector over the width is singular")
    lower = factor.L
    on_cuts = lower[-interface:, -interface:].toarray()
    schur = on_cuts @ factor.U[-interface:, -interface:].toarray()
    loads, measures = (
        np.vstack([np.kron(wide.functions.mass[k, group], part[a]) for a, k in modes])
        for part in _loads_and_measures(wide, cuts)
    )
    # nothing acts on what comes before: there the substitution leaves zeros
    both = np.hstack([loads, measures])[order[-loaded:]]
    trailing = lower[-loaded:, -loaded:].toarray()
    reduced = solve_triangular(trailing, both, lower=True, unit_diagonal=True)
    interior, count = reduced[:-interface], loads.shape[1]
    scaled = interior[:, :count] / factor.U.diagonal()[-loaded:-interface, None]
    forces = on_cuts @ reduced[-interface:]
    moved = np.zeros((0, interface + count))
    if len(nodes):
        # by the cuts alone, and under loads with held cuts
        effects = np.zeros((last - interface, interface + count))
        effects[:, :interface] = -lower[-interface:, -last:-interface].toarray().T
        effects[interface - loaded :, interface:] = scaled
        late_rows = lower[-last:-interface, -last:-interface].toarray()
        of_interior = solve_triangular(late_rows.T, effects, unit_diagonal=True)
        of_all = np.vstack([of_interior, np.eye(interface, interface + count)])
        moved = _rows_of(wide, cuts, modes, nodes)[:, order[-last:]] @ of_all
    return Condensed(
        schur=0.5 * (schur + schur.T),
        forces=forces[:, :count],
        measured=np.stack([forces[:, :count], forces[:, count:]]),
        held=np.stack([interior[:, :count].T @ scaled, interior[:, count:].T @ scaled]),
        moved=moved,
    )


def _rows_of(
    wide: WideSector, cuts: tuple[FreeCuts, FreeCuts], modes: Modes, nodes: Indices
) -> csr_array:
    """Displacement of chosen nodes, mode by mode, from all freedoms of the modes."""
    freedoms = nodes.ravel(), wide.twisted.node_of[nodes[:, 0]]
    chosen = [csr_array(cut.matrix)[at] for cut, at in zip(cuts, freedoms, strict=True)]
    return csr_array(block_diag([chosen[a] for a, _ in modes], format="csr"))


def _loads_and_measures(
    wide: WideSector, cuts: tuple[FreeCuts, FreeCuts]
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Forces along the normals at points of the flank, and toward the root.

    Over what is free in the section and along the axis, a column for each point.
    """
    flank = wide.sector.flanks[RIGHT]
    points = np.arange(len(flank.arcs))
    toward_root = np.zeros((wide.sector.basis.N, points.size))
    for component in range(2):
        at = flank.dofs[:, component], points
        toward_root[at] = flank.rootward[:, component]
    in_section, along = (
        cut.matrix.T @ normals
        for cut, normals in zip(cuts, wide.twisted.flank_normals, strict=True)
    )
    rootward = cuts[0].matrix.T @ toward_root, np.zeros_like(along)
    return (in_section, along), rootward


def _ordering(
    wide: WideSector,
    cuts: tuple[FreeCuts, FreeCuts],
    modes: Modes,
    chosen: Indices,
) -> tuple[Indices, tuple[int, int, int]]:
    """Order of all freedoms for the factors, and how many are last.

    Those on cuts, with those that are loaded, and with those of chosen nodes. Cuts are
    last, behind the nodes of the flank, where loads act, and these behind chosen ones.
    The others are in an order of minimum degree of their nodes: all freedoms of a node
    follow each other, and the graph of the nodes is small.
    """
    # nodes of the freedoms of either component, in the order of its columns
    in_section, along = (
        np.asarray(abs(cut.matrix).argmax(axis=0)).ravel() for cut in cuts
    )
    nodes_of = wide.twisted.node_of[in_section], along
    starts = np.cumsum([0, *(len(nodes_of[a]) for a, _ in modes)])
    parts: tuple[list[Indices], list[Indices], list[Indices]] = ([], [], [])
    for (a, _), start in zip(modes, starts, strict=False):
        ends = np.cumsum([0, cuts[a].interior, cuts[a].cut, cuts[a].cut])
        for part, low, high in zip(parts, ends, ends[1:], strict=False):
            part.append(start + np.arange(low, high))
    interior, left, right = (np.concatenate(part) for part in parts)
    nodes = np.concatenate([nodes_of[a] for a, _ in modes])
    on_flank = np.unique(wide.twisted.node_of[wide.sector.flanks[RIGHT].dofs])
    late = np.setdiff1d(wide.twisted.node_of[chosen[:, 0]], on_flank)
    late = np.concatenate([late, on_flank])
    others = np.setdiff1d(nodes[interior], late)
    rank = _ranks(wide.blocks[2, 1, 1], others)
    rank[late] = len(others) + np.arange(len(late))
    by_rank = interior[np.argsort(rank[nodes[interior]], kind="stable")]
    loaded, last = (
        int(np.isin(nodes[interior], some).sum()) + 2 * len(left)
        for some in (on_flank, late)
    )
    return np.concatenate([by_rank, left, right]), (2 * len(left), loaded, last)


def _ranks(graph: csr_array, nodes: Indices) -> Indices:
    """Rank of each of some nodes in an order of minimum degree, 0 of others."""
    from scipy.sparse.linalg import splu

    chosen = abs(graph[nodes][:, nodes])
    # what dominates its diagonal is factorised without exchanges
    dominant = diags_array(np.asarray(chosen.sum(axis=1)).ravel() + 1.0)
    factor = splu(
        csc_array(chosen + dominant),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    ranks = np.zeros(graph.shape[0], np.int64)
    ranks[nodes] = factor.perm_c
    return ranks


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
