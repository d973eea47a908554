"""Elastic freedoms of a whole toothed gear with its hub held, for time stepping.

The sectors are equal, so that mass and stiffness are block-circulant and one sector
represents all. A field is an array (unknowns, teeth): column k is of sector k, counted
clockwise from tooth 0, and holds its interior freedoms in the frame of its tooth, then
those of its left cut in polar components. Its right cut is the next one's left cut.
A system of equations loses its interior freedoms by one sparse elimination for all
sectors; the ring of cuts falls apart under a Fourier transform. All per unit width.

Products and solutions, most of the work of a time step, take sector arrays: rows of a
sector's freedoms with both cuts (unknowns + m), and columns of the teeth, then zeros.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, hstack, tril, vstack

from fegear.elasticity.ring import harmonics
from fegear.elasticity.sector import CyclicSector, FlankPoints, factorise
from lumped.common.array_types import Array, Indices
from lumped.common.compiled import compiled

REGISTER_NUMBERS = 8  # columns come in multiples of it, so that loops have no rest
TriangularRows = tuple[
    NDArray[np.int32], Array, NDArray[np.int32], NDArray[np.int32], Array
]


@dataclass(frozen=True)
class CyclicGear:
    """Mass and stiffness of the gear, hub held.

    n_interior, unknowns : number of a sector's interior degrees of freedom, and with
        the m of its left cut
    stiffness, mass_matrix : (unknowns + m, unknowns + m) of a sector, right cut last
        [Pa], [kg/m]
    flanks : right and left one, with freedoms as rows of a field
    flank_grid : of their points, as in `CyclicSector`
    rotation : (unknowns,) displacement under a unit clockwise turn of the whole gear
        about its centre [m], equal for all sectors
    momentum : (unknowns,) its momentum [kg], with the share of the nodes on the hub
    inertia : of the meshed gear about its centre [kg m]; mass : [kg/m]
    """

    teeth: int
    n_interior: int
    unknowns: int
    stiffness: csr_array
    mass_matrix: csr_array
    flanks: tuple[FlankPoints, ...]
    flank_grid: tuple[float, float, int, bool]
    rotation: Array
    momentum: Array
    inertia: float
    mass: float

    def stiffness_times(self, u: Array) -> Array:
        """Elastic forces [N/m] at displacements [m], both (unknowns, teeth)."""
        return self._times(self.stiffness, u)

    def mass_times(self, u: Array) -> Array:
        """Momenta of velocities (unknowns, teeth), or forces of accelerations."""
        return self._times(self.mass_matrix, u)

    def sector_mass_times(self, x: Array) -> Array:
        """Momenta of each sector alone, of a sector array."""
        mass = self.mass_matrix
        return np.asarray(multiply_rows(mass.indptr, mass.indices, mass.data, x))

    def _times(self, matrix: csr_array, u: Array) -> Array:
        _require_shape("u", u, (self.unknowns, self.teeth))
        x = sector_array(matrix.shape[0], self.teeth)
        x[: self.unknowns, : self.teeth] = u
        x[self.unknowns :, : self.teeth] = np.roll(u[self.n_interior :], -1, axis=1)
        force = multiply_rows(matrix.indptr, matrix.indices, matrix.data, x)
        return _assemble_cyclic(force[:, : self.teeth], self.n_interior, self.unknowns)

    def factorised(self, mass_factor: float, stiffness_factor: float) -> Factors:
        """Factors of mass_factor M + stiffness_factor K."""
        coefficients = mass_factor, stiffness_factor
        if not (all(0.0 <= f < math.inf for f in coefficients) and any(coefficients)):
            raise ValueError(
                f"mass_factor, stiffness_factor = {coefficients}; must be finite, not "
                "negative and not both zero"
            )
        system = mass_factor * self.mass_matrix + stiffness_factor * self.stiffness
        return _eliminate(csr_array(system), self.n_interior, self.unknowns, self.teeth)


def sector_array(rows: int, teeth: int) -> Array:
    """Zeros (rows, columns) with a column for each tooth or more."""
    columns = math.ceil(teeth / REGISTER_NUMBERS) * REGISTER_NUMBERS
    return np.zeros((rows, columns))


def cyclic_gear(sector: CyclicSector, density: float) -> CyclicGear:
    """Mass and stiffness of the gear that a sector represents; density in kg/m3."""
    if not 0.0 < density < math.inf:
        raise ValueError(f"density = {density}; must be positive and finite")
    mass, rigid_modes, interior = (
        sector.mass(density),
        sector.rigid_body_modes,
        sector.interior,
    )
    left = sector.cyclic_constraint(0.0)
    count, unknowns = len(interior), left.shape[1]
    cut_transformation = hstack(
        [left, (sector.cyclic_constraint(1.0) - left)[:, count:]]
    )
    momentum = mass @ rigid_modes
    inertia, *translational_mass = sector.gear.teeth * np.einsum(
        "ic,ic->c", rigid_modes, momentum
    )
    return CyclicGear(
        teeth=sector.gear.teeth,
        n_interior=count,
        unknowns=unknowns,
        stiffness=csr_array(
            cut_transformation.T @ sector.stiffness @ cut_transformation
        ),
        mass_matrix=csr_array(cut_transformation.T @ mass @ cut_transformation),
        flanks=tuple(
            replace(flank, dofs=np.searchsorted(interior, flank.dofs))
            for flank in sector.flanks
        ),
        flank_grid=sector.flank_grid,
        rotation=left.T @ rigid_modes[:, 0],
        momentum=_assemble_cyclic(
            cut_transformation.T @ momentum[:, :1], count, unknowns
        )[:, 0],
        inertia=float(inertia),
        mass=float(np.mean(translational_mass)),
    )


def _assemble_cyclic(force: Array, n_interior: int, unknowns: int) -> Array:
    """Forces (unknowns + m, teeth), those on right cuts added to the next left ones."""
    force[n_interior:unknowns] += np.roll(force[unknowns:], 1, axis=1)
    return force[:unknowns]


@compiled
def multiply_rows(starts, columns, entries, x):
    """Product (n, k) of rows as in a CSR array with x (m, k)."""
    out = np.empty((starts.size - 1, x.shape[1]))
    for i in range(starts.size - 1):
        out[i] = 0.0
        fours = starts[i + 1] - (starts[i + 1] - starts[i]) % 4
        for p in range(starts[i], fours, 4):
            a, b, c, d = entries[p], entries[p + 1], entries[p + 2], entries[p + 3]
            f, g, h, j = columns[p], columns[p + 1], columns[p + 2], columns[p + 3]
            for k in range(x.shape[1]):
                out[i, k] += (a * x[f, k] + b * x[g, k]) + (c * x[h, k] + d * x[j, k])
        for p in range(fours, starts[i + 1]):
            a, f = entries[p], columns[p]
            for k in range(x.shape[1]):
                out[i, k] += a * x[f, k]
    return out


@compiled
def solve_triangular(sequence, scale, starts, columns, entries, x):
    """x[f] = scale (x[f] - entries x[columns]) for f in sequence, in place; x (n, k).

    starts, columns, entries : Rows as in a CSR array, in that sequence. SuperLU takes
    the right-hand sides one by one, four times as slowly.
    """
    row = np.empty(x.shape[1])
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
    """Cholesky factor of a sector's interior, and inverse of the interface system.

    forward : over the interior freedoms, then both cuts; backward : only those
    interface_inverse : (teeth // 2 + 1, m, m) of the cuts' system by nodal diameters

    `solve` is `eliminate`, then `substitute`. In between displacement is known where
    `condense` was asked for it, and loads of a few teeth can be added.
    """

    n_interior: int
    unknowns: int
    teeth: int
    forward: TriangularRows
    interface_inverse: NDArray[np.complex128]
    backward: TriangularRows

    def solve(self, load: Array) -> Array:
        """Displacement (unknowns, teeth) under loads (unknowns, teeth)."""
        _require_shape("load", load, (self.unknowns, self.teeth))
        x = sector_array(self.rows, self.teeth)
        x[: self.unknowns, : self.teeth] = load
        self.eliminate(x)
        self.substitute(x)
        return x[: self.unknowns, : self.teeth]

    @property
    def rows(self) -> int:
        """Rows of a sector array, unknowns + m."""
        return 2 * self.unknowns - self.n_interior

    def eliminate(self, x: Array) -> None:
        """Replace loads, a sector array, by those that eliminated interior freedoms
        leave, and on the cuts by displacement.
        """
        solve_triangular(*self.forward, x)
        cuts = x[self.n_interior :, : self.teeth]
        cuts[:] = self._cut_displacement(cuts)

    def substitute(self, x: Array) -> None:
        """Replace what `eliminate` made by displacement of all freedoms."""
        solve_triangular(*self.backward, x)

    def condense(self, loads: Array) -> Array:
        """What remains (k, unknowns + m) of loads (unknowns + m, k) of one tooth.

        Times the tooth's column of what `eliminate` made it is the work of that load.
        """
        remaining = solve_triangular(*self.forward, loads.copy())
        return np.ascontiguousarray(remaining.T)

    def add_loads(self, x: Array, loads: Array, teeth: Indices) -> None:
        """Add condensed loads (k, unknowns + m) on teeth (k,) to what `eliminate`
        made.
        """
        on_cuts = np.zeros((self.rows - self.n_interior, self.teeth))
        for load, tooth in zip(loads, teeth.tolist(), strict=True):
            x[: self.n_interior, tooth] += load[: self.n_interior]
            on_cuts[:, tooth] += load[self.n_interior :]
        x[self.n_interior :, : self.teeth] += self._cut_displacement(on_cuts)

    def _cut_displacement(self, load: Array) -> Array:
        """Displacement of left and right cuts under loads on them, (2 m, teeth)."""
        left_load = _assemble_cyclic(load.copy(), 0, len(load) // 2)
        spectrum = np.fft.rfft(left_load).T
        spectrum = (self.interface_inverse @ spectrum[:, :, None])[:, :, 0]
        left = np.fft.irfft(spectrum.T, self.teeth)
        return np.vstack([left, np.roll(left, -1, axis=1)])


def _eliminate(
    system: csr_array, n_interior: int, unknowns: int, teeth: int
) -> Factors:
    """Factors of the symmetric positive definite system of a sector.

    system : (unknowns + m, unknowns + m)
    """
    columns, cuts = system[:, :n_interior], np.arange(n_interior, system.shape[0])
    factor = factorise(columns[:n_interior])
    order, pivots = np.argsort(factor.perm_c), np.sqrt(factor.U.diagonal())
    lower = csr_array(tril(factor.L, -1)).multiply(pivots)
    reduced = columns[n_interior:].toarray()[:, order].T.copy()
    reduced = solve_triangular(
        *_gather_rows(lower, np.arange(n_interior), 1.0 / pivots), reduced
    )
    # sparse too: a cut is reached from few places in the order of elimination
    lower = vstack([lower, csr_array(reduced.T)])
    dofs = np.append(order, cuts)
    scale = np.append(1.0 / pivots, np.ones(len(cuts)))
    interface_inverse = _invert_ring(
        system[n_interior:][:, n_interior:] - reduced.T @ reduced, teeth
    )
    backward = _gather_rows(lower.T, dofs, scale, step=-1)
    return Factors(
        n_interior,
        unknowns,
        teeth,
        _gather_rows(lower, dofs, scale),
        interface_inverse,
        backward,
    )


def _gather_rows(
    matrix: Any, dofs: Indices, scale: Array, step: int = 1
) -> TriangularRows:
    """Rows of a sparse triangle for `substitute`, from the last one if step = -1."""
    row_order = np.arange(matrix.shape[0])[::step]
    rows = csr_array(csr_array(matrix)[row_order])
    indices = dofs[row_order], rows.indptr, dofs[rows.indices]
    sequence, starts, columns = (a.astype(np.int32) for a in indices)
    return sequence, scale[row_order], starts, columns, rows.data


def _invert_ring(superelement: Any, teeth: int) -> NDArray[np.complex128]:
    """Inverses (teeth // 2 + 1, m, m) of the cuts' systems, as in `ring_response`."""
    m = len(superelement) // 2
    inverse = np.empty((teeth // 2 + 1, m, m), complex)
    for diameters, _, system in harmonics(superelement, teeth):
        inverse[diameters] = np.linalg.inv(system)
    return inverse


def _require_shape(name: str, array: Array, shape: tuple[int, int]) -> None:
    if array.shape != shape:
        raise ValueError(f"shape of {name} = {array.shape}; must be {shape}")
