"""Elastic freedoms of a whole toothed gear with its hub held, for time stepping.

The sectors are equal, so that mass and stiffness are block-circulant and one sector
stands for all. A field is an array (own, teeth): column k belongs to sector k, counted
clockwise from tooth 0, and holds its inner freedoms in the frame of its tooth, then
those of its left cut in polar components. Its right cut is the next one's left cut.
A system of equations loses its inner freedoms by one sparse elimination for all
sectors; the ring of cuts falls apart under a Fourier transform. All per unit width.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array, hstack, tril, vstack

from fegear.contact.compliance import STENCIL, set_stencil
from fegear.elasticity.flank import FlankPoints
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.modes import both_flanks, rigid_fields, tie
from fegear.elasticity.ring import harmonics
from fegear.elasticity.sector import assemble_mass, assemble_sector, condense, factorise
from fegear.timing import stage
from lumped.compiled import compiled
from meshes import MeshSize, SpurGear, sector_mesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Rows = tuple[NDArray[np.int32], Array, NDArray[np.int32], NDArray[np.int32], Array]


@dataclass(frozen=True)
class ContactRow:
    """How displacement at n places of a flank is read from its tooth's column.

    freedoms : (n, 8) rows of the field; normal, rootward : (n, 8) their weights,
        which also spread a line load there
    """

    freedoms: Indices
    normal: Array
    rootward: Array


@dataclass(frozen=True)
class WholeGear:
    """Mass and stiffness of the gear, hub held.

    inner, own : number of a sector's inner freedoms, and with the m of its left cut
    stiffness, mass_matrix : (own + m, own + m) of a sector, right cut last [Pa], [kg/m]
    flanks : right and left one, with freedoms as rows of a field
    rotation : (own,) displacement under a unit clockwise turn of the whole gear about
        its centre [m], equal for all sectors
    momentum : (own,) its momentum [kg], with the share of the nodes on the hub
    inertia : of the meshed gear about its centre [kg m]; mass : [kg/m]
    """

    teeth: int
    inner: int
    own: int
    stiffness: csr_array
    mass_matrix: csr_array
    flanks: tuple[FlankPoints, ...]
    flank_grading: float
    rotation: Array
    momentum: Array
    inertia: float
    mass: float

    def stiffness_times(self, u: Array) -> Array:
        """Elastic forces (own, teeth) [N/m] at displacements (own, teeth) [m]."""
        return self._times(self.stiffness, u)

    def mass_times(self, u: Array) -> Array:
        """Momenta (own, teeth) of velocities, or inertial forces of accelerations."""
        return self._times(self.mass_matrix, u)

    def _times(self, matrix: csr_array, u: Array) -> Array:
        _require_shape("u", u, (self.own, self.teeth))
        force = matrix @ np.vstack([u, np.roll(u[self.inner :], -1, axis=1)])
        return _folded(force, self.inner, self.own)

    def factorised(self, mass_factor: float, stiffness_factor: float) -> Factors:
        """Factors of mass_factor M + stiffness_factor K."""
        given = mass_factor, stiffness_factor
        if not (all(0.0 <= f < math.inf for f in given) and any(given)):
            raise ValueError(
                "mass_factor and stiffness_factor must be finite, not negative and "
                f"not both zero, got {given}"
            )
        system = mass_factor * self.mass_matrix + stiffness_factor * self.stiffness
        return _eliminated(csr_array(system), self.inner, self.own, self.teeth)

    def contact_row(self, flank: int, arcs: ArrayLike) -> ContactRow:
        """Cubic rows at arc lengths (n,) from the tip corner [m], RIGHT or LEFT."""
        place = cast(Any, set_stencil).py_func  # the kernel's own, uncompiled
        points, places = self.flanks[flank], np.atleast_1d(np.asarray(arcs, float))
        first = np.zeros((1, len(places)), np.int64)
        patch = SimpleNamespace(first=first, weights=np.zeros((*first.shape, STENCIL)))
        grid = SimpleNamespace(length=points.arcs[-1], grading=self.flank_grading)
        for i, arc in enumerate(places.tolist()):
            place(patch, 0, i, arc, grid, len(points.arcs))
        near = first[0][:, None] + np.arange(STENCIL)
        weights, shape = patch.weights[0][:, :, None], (len(near), 2 * STENCIL)
        return ContactRow(
            points.freedoms[near].reshape(shape),
            (weights * points.inward[near]).reshape(shape),
            (weights * points.rootward[near]).reshape(shape),
        )


def whole_gear(
    gear: SpurGear,
    material: PlaneMaterial,
    density: float,
    size: MeshSize | None = None,
) -> WholeGear:
    """Assemble one sector of the gear; density in kg/m3."""
    if not 0.0 < density < math.inf:
        raise ValueError(f"density must be positive and finite, got {density}")
    size = size or MeshSize()
    with stage("meshing"):
        mesh = sector_mesh(gear, size)
    with stage("assembling"):
        model = assemble_sector(mesh, material)
        mass = assemble_mass(model, density)
    polar = condense(model, gear.teeth).polar
    left = tie(model, polar, 0.0)
    inner, own = len(model.inner), left.shape[1]
    ties = hstack([left, (tie(model, polar, 1.0) - left)[:, inner:]])
    rigid = rigid_fields(model)
    momentum = mass @ rigid
    inertia, *shifted = gear.teeth * np.einsum("ic,ic->c", rigid, momentum)
    return WholeGear(
        teeth=gear.teeth,
        inner=inner,
        own=own,
        stiffness=csr_array(ties.T @ model.stiffness @ ties),
        mass_matrix=csr_array(ties.T @ mass @ ties),
        flanks=tuple(
            replace(flank, freedoms=np.searchsorted(model.inner, flank.freedoms))
            for flank in both_flanks(gear, mesh, model)
        ),
        flank_grading=size.flank_grading,
        rotation=left.T @ rigid[:, 0],
        momentum=_folded(ties.T @ momentum[:, :1], inner, own)[:, 0],
        inertia=float(inertia),
        mass=float(np.mean(shifted)),
    )


def _folded(force: Array, inner: int, own: int) -> Array:
    """Forces (own + m, teeth) with those on a right cut added to the next left one."""
    force[inner:own] += np.roll(force[own:], 1, axis=1)
    return force[:own]


@compiled
def substitute(sequence, scale, starts, columns, entries, load):
    """x[f] = scale (x[f] - entries x[columns]) for f in sequence, from x = load (n, k).

    starts, columns, entries : Rows as in a CSR array, in that sequence. SuperLU takes
    the right-hand sides one by one, four times as slowly.
    """
    x, row = load.copy(), np.empty(load.shape[1])
    for i in range(sequence.size):
        row[:] = x[sequence[i]]
        fours = starts[i + 1] - (starts[i + 1] - starts[i]) % 4
        for p in range(starts[i], fours, 4):  # fewer loads and stores of the row
            a, b, c, d = entries[p], entries[p + 1], entries[p + 2], entries[p + 3]
            f, g, h, j = columns[p], columns[p + 1], columns[p + 2], columns[p + 3]
            for k in range(row.size):
                row[k] -= (a * x[f, k] + b * x[g, k]) + (c * x[h, k] + d * x[j, k])
        for p in range(fours, starts[i + 1]):
            a, f = entries[p], columns[p]
            for k in range(row.size):
                row[k] -= a * x[f, k]
        for k in range(row.size):
            x[sequence[i], k] = scale[i] * row[k]
    return x


@dataclass(frozen=True)
class Factors:
    """Cholesky factor of a sector as far as its inner freedoms, and the ring of cuts.

    forward : over the inner freedoms, then both cuts; backward : inner ones only
    ring : (teeth // 2 + 1, m, m) inverse of the cuts' system by wave number
    """

    inner: int
    own: int
    teeth: int
    forward: Rows
    ring: NDArray[np.complex128]
    backward: Rows

    def solve(self, load: Array) -> Array:
        """Displacement (own, teeth) under loads (own, teeth)."""
        _require_shape("load", load, (self.own, self.teeth))
        right = np.zeros((self.own - self.inner, self.teeth))
        x = substitute(*self.forward, np.vstack([load, right]))
        waves = np.fft.rfft(_folded(x, self.inner, self.own)[self.inner :]).T
        waves = (self.ring @ waves[:, :, None])[:, :, 0]
        x[self.inner : self.own] = np.fft.irfft(waves.T, self.teeth)
        x[self.own :] = np.roll(x[self.inner : self.own], -1, axis=1)
        return substitute(*self.backward, x)[: self.own]


def _eliminated(system: csr_array, inner: int, own: int, teeth: int) -> Factors:
    """Factors of a sector's (own + m, own + m) symmetric positive definite system."""
    columns, cuts = system[:, :inner], np.arange(inner, system.shape[0])
    factor = factorise(columns[:inner])
    order, pivots = np.argsort(factor.perm_c), np.sqrt(factor.U.diagonal())
    lower = csr_array(tril(factor.L, -1)).multiply(pivots)
    reduced = columns[inner:].toarray()[:, order].T.copy()
    reduced = substitute(*_rows(lower, np.arange(inner), 1.0 / pivots), reduced)
    # sparse too: a cut is reached from few places in the order of elimination
    lower = vstack([lower, csr_array(reduced.T)])
    freedoms = np.append(order, cuts)
    scale = np.append(1.0 / pivots, np.ones(len(cuts)))
    ring = _ring_inverse(system[inner:][:, inner:] - reduced.T @ reduced, teeth)
    backward = _rows(lower.T, freedoms, scale, step=-1)
    return Factors(inner, own, teeth, _rows(lower, freedoms, scale), ring, backward)


def _rows(matrix: Any, freedoms: Indices, scale: Array, step: int = 1) -> Rows:
    """Rows of a sparse triangle for `substitute`, from the last one if step = -1."""
    places = np.arange(matrix.shape[0])[::step]
    rows = csr_array(csr_array(matrix)[places])
    indices = freedoms[places], rows.indptr, freedoms[rows.indices]
    sequence, starts, columns = (a.astype(np.int32) for a in indices)
    return sequence, scale[places], starts, columns, rows.data


def _ring_inverse(superelement: Any, teeth: int) -> NDArray[np.complex128]:
    """Inverses (teeth // 2 + 1, m, m) of the cuts' systems, as in `ring_response`."""
    m = len(superelement) // 2
    inverse = np.empty((teeth // 2 + 1, m, m), complex)
    for waves, _, system in harmonics(superelement, teeth):
        inverse[waves] = np.linalg.inv(system)
    return inverse


def _require_shape(name: str, array: Array, shape: tuple[int, int]) -> None:
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, got {array.shape}")
