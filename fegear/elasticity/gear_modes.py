"""Elastic modes of a whole toothed gear with its hub held, from one sector.

The sectors of a gear are equal, so its modes are cyclic: with n nodal diameters,
sector k moves like sector 0 times exp(2 pi i n k / z), in components that turn with
the sector (Thomas, Int. J. Numer. Meth. Eng. 14 (1979) 81). The right cut then follows
the left one, and every n is a Hermitian eigenproblem of one sector's size. How many
modes it has below the cut-off is counted first (Wittrick & Williams, Q. J. Mech. Appl.
Math. 24 (1971) 263), so that only those n are solved that have any.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigvalsh
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from fegear.elasticity.cache import cached_body
from fegear.elasticity.flank import SectorLoads, nodal_loads, ring_fields
from fegear.elasticity.ring import close_ring, nodal_diameter_phase
from fegear.elasticity.sector import (
    RIGHT,
    Condensation,
    CyclicSector,
    FlankPoints,
    condense,
    cyclic_sector,
)
from fegear.files.timing import stage
from lumped.common.array_types import Array, Complex

Field = NDArray[Any]  # real for a standing mode, else complex
Counts = NDArray[np.int64]
Flanks = tuple[FlankPoints, FlankPoints]
# at least, of shear waves; frequencies are then exact to some 1e-4
MIN_LAYERS_PER_WAVELENGTH = 6.0
FIELDS_PER_MODE = (  # fields of GearModes with an entry for each mode
    *("frequencies_Hz", "nodal_diameters", "normal", "tangential"),
    *("rotation_coupling", "translation_coupling"),
)


@dataclass(frozen=True)
class GearModes:
    """Modes below a cut-off, by rising frequency, of unit mass over the whole gear.

    A mode moves tooth k, counted clockwise from tooth 0 as in a sector mesh, by
    Re(amplitude exp(2 pi i n k / teeth)) in that tooth's own frame. Modes with
    0 < n < teeth/2 come in pairs of equal frequency that follow each other: one
    symmetric about the axis of tooth 0, then one antisymmetric.

    frequencies_Hz : (modes,)
    nodal_diameters : (modes,) n
    normal, tangential : (modes, 2, points) complex amplitude of tooth 0 along the
        inward normal and toward the root, right flank then left one [(kg/m)^-1/2]
    arcs : (points,) of the flank points from the tip corner [m]
    rotation_coupling : (modes,) phi . M r, r a unit clockwise turn of the whole
        gear about its centre [(kg m)^1/2]
    translation_coupling : (modes, 2) the same for unit shifts along x and y of
        tooth 0's frame [(kg/m)^1/2]
    inertia : about the centre [kg m]; mass : of the meshed gear [kg/m]
    """

    teeth: int
    cutoff_Hz: float
    frequencies_Hz: Array
    nodal_diameters: Counts
    normal: Complex
    tangential: Complex
    arcs: Array
    rotation_coupling: Array
    translation_coupling: Array
    inertia: float
    mass: float

    def phases(self, tooth: int) -> Complex:
        """Factors (modes,) from the amplitude of tooth 0 to that of a tooth."""
        turn = self.nodal_diameters * tooth % self.teeth / self.teeth
        return np.exp(2j * np.pi * turn)

    def normal_at(self, tooth: int, flank: int = RIGHT) -> Array:
        """Inward normal displacement (modes, points) of a tooth's flank."""
        return np.real(self.normal[:, flank] * self.phases(tooth)[:, None])

    def tangential_at(self, tooth: int, flank: int = RIGHT) -> Array:
        """Rootward displacement (modes, points) of a tooth's flank."""
        return np.real(self.tangential[:, flank] * self.phases(tooth)[:, None])


@dataclass(frozen=True)
class CyclicModes:
    """Modes with n nodal diameters as complex fields of sector 0.

    omega : (m,) rising [rad/s]
    fields : (freedoms, m) Cartesian displacement; its real and its imaginary part,
        carried around the gear, are modes of unit mass. Real where n is single.
    """

    nodal_diameters: int
    omega: Array
    fields: Field

    @property
    def single(self) -> bool:
        """Whether they are standing: n = 0, or half the number of teeth."""
        return not np.iscomplexobj(self.fields)


def gear_modes(sector: CyclicSector, density: float, cutoff_Hz: float) -> GearModes:
    """All modes of the gear below `cutoff_Hz`, hub held; density in kg/m3.

    Raises ValueError where either is not positive and finite.
    """
    for name, value in (("density", density), ("cutoff_Hz", cutoff_Hz)):
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"{name} = {value}; must be positive and finite")
    sector = resolving_sector(sector, density, cutoff_Hz)
    mass = sector.mass(density)
    modes = cyclic_modes(sector, mass, cutoff_Hz)
    return _collect_modes(sector, cutoff_Hz, mass, modes)


def lowest_modes(
    sector: CyclicSector,
    density: float,
    nodal_diameters: Sequence[int],
    count: int,
    max_nodal_diameters: int = 0,
    below_Hz: float = 0.0,
) -> GearModes:
    """The `count` lowest modes, or pairs of modes, with each number of nodal diameters.

    nodal_diameters : below half the number of teeth; density in kg/m3
    max_nodal_diameters, below_Hz : further numbers follow, below this one, as long as
        the lowest mode of the last one is below a frequency
    """
    assemble_mass = cache(partial(sector.mass, density))

    def cached_family(n: int) -> GearModes:
        inputs = {"density": density, "nodal_diameters": n, "count": count}
        solve_family = partial(_modes_of_family, sector, assemble_mass, n, count)
        return cached_body("modes", sector, inputs, solve_family, GearModes)

    mode_families = [cached_family(n) for n in nodal_diameters]
    for n in range(max(nodal_diameters) + 1, max_nodal_diameters):
        if mode_families[-1].frequencies_Hz.min() >= below_Hz:
            break
        mode_families.append(cached_family(n))
    return _join_families(mode_families)


def _modes_of_family(
    sector: CyclicSector, assemble_mass: Callable[[], csr_array], n: int, count: int
) -> GearModes:
    """The `count` lowest modes, or pairs of modes, with n nodal diameters."""
    with stage("modes"):
        modes = _solve_modes(sector, assemble_mass(), n, count)
    return _collect_modes(sector, math.inf, assemble_mass(), [modes])


def _join_families(families: Sequence[GearModes]) -> GearModes:
    """Modes of several families by rising frequency."""
    joined_arrays: dict[str, Any] = {
        name: np.concatenate([getattr(family, name) for family in families])
        for name in FIELDS_PER_MODE
    }
    frequency_order = np.argsort(joined_arrays["frequencies_Hz"], kind="stable")
    return replace(
        families[0],
        **{name: values[frequency_order] for name, values in joined_arrays.items()},
    )


def static_inertia(sector: CyclicSector, density: float, arc: float) -> float:
    """u'M u of the static displacement u of the whole gear, hub held [m s2/N].

    Under a unit line load inward on a right flank, at an arc from the tip corner [m]:
    the sum of w^2 / omega^4 over all modes, w their inward displacement there.
    """
    load, arcs = nodal_loads(sector), sector.flanks[RIGHT].arcs
    load_column = slice(
        point_index := int(np.abs(arcs - arc).argmin()), point_index + 1
    )
    load = SectorLoads(
        load.force[:, load_column], load.hub[:, load_column], load.jump[:, load_column]
    )
    mass = sector.mass(density)
    fields = ring_fields(sector, load, range(sector.gear.teeth))
    return float(sum((u * (mass @ u)).sum() for u in fields.values()))


def resolving_sector(
    sector: CyclicSector, density: float, highest_Hz: float
) -> CyclicSector:
    """The sector with layers that resolve shear waves up to a frequency."""
    shear_wave_speed = math.sqrt(sector.material.lame[1] / density)
    largest_layer = (
        shear_wave_speed / highest_Hz / (MIN_LAYERS_PER_WAVELENGTH * sector.gear.module)
    )
    largest_layer = min(sector.size.largest_layer, largest_layer)
    size = replace(sector.size, largest_layer=largest_layer)
    return cyclic_sector(sector.gear, sector.material, size, sector.order)


def cyclic_modes(
    sector: CyclicSector, mass: csr_array, cutoff_Hz: float
) -> Iterator[CyclicModes]:
    """Modes below the cut-off for every n = 0 .. teeth // 2, some of them empty."""
    for n, count in enumerate(mode_counts(sector, mass, cutoff_Hz)):
        with stage("modes"):
            modes = _solve_modes(sector, mass, n, int(count))
        yield modes


def mode_counts(sector: CyclicSector, mass: csr_array, cutoff_Hz: float) -> Counts:
    """Number of cyclic modes below the cut-off for each n = 0 .. teeth // 2.

    Negative eigenvalues of K - omega^2 M by Sylvester's law of inertia: those of
    the interior, one factorisation for all n, and those of what remains on the
    constrained cut.
    """
    omega, teeth = 2.0 * math.pi * cutoff_Hz, sector.gear.teeth
    dynamic_condensation = condense(
        sector, csr_array(sector.stiffness - omega**2 * mass)
    )
    n_interior_modes = np.count_nonzero(dynamic_condensation.factor.U.diagonal() < 0.0)
    phases = [nodal_diameter_phase(n, teeth) for n in range(teeth // 2 + 1)]
    cut_eigenvalues = [
        eigvalsh(close_ring(dynamic_condensation.superelement, phase))
        for phase in phases
    ]
    return np.array(
        [
            n_interior_modes + np.count_nonzero(values < 0.0)
            for values in cut_eigenvalues
        ]
    )


def _solve_modes(
    sector: CyclicSector, mass: csr_array, nodal_diameters: int, count: int
) -> CyclicModes:
    """The `count` lowest modes by shift-invert Lanczos about zero."""
    if count == 0:
        no_fields = np.empty((sector.basis.N, 0))
        return CyclicModes(nodal_diameters, np.empty(0), no_fields)
    teeth = sector.gear.teeth
    phase = nodal_diameter_phase(nodal_diameters, teeth)
    constraint = sector.cyclic_constraint(phase)
    K, M = (
        csr_array(constraint.conj().T @ matrix @ constraint)
        for matrix in (sector.stiffness, mass)
    )
    values, vectors = eigsh(
        K,
        count,
        M=M,
        sigma=0.0,
        OPinv=cyclic_inverse(sector.condensation, K, phase),
        v0=np.random.default_rng(0).standard_normal(K.shape[0]),
    )
    order = np.argsort(values)
    vectors = vectors[:, order]
    norm = np.einsum("im,im->m", vectors.conj(), M @ vectors).real
    # a travelling mode shares its kinetic energy between the two that it represents
    n_sharing_teeth = teeth if np.isrealobj(vectors) else 0.5 * teeth
    fields = constraint @ (vectors / np.sqrt(n_sharing_teeth * norm))
    return CyclicModes(nodal_diameters, np.sqrt(values[order]), fields)


def cyclic_inverse(
    condensed: Condensation, stiffness: csr_array, phase: complex
) -> LinearOperator:
    """Inverse of the constrained stiffness by elimination of the interior.

    Its factors are real and shared by all n; what is left is small and dense.
    """
    interior_size = len(condensed.response)
    coupling = stiffness[:interior_size, interior_size:]
    coupling_transpose = coupling.conj().T
    interface_factor = cho_factor(close_ring(condensed.superelement, phase))

    def solve(load: Field) -> Field:
        particular = condensed.solve(load[:interior_size])
        cut = cho_solve(
            interface_factor,
            load[interior_size:] - np.asarray(coupling_transpose @ particular),
        )
        return np.concatenate([particular - condensed.solve(coupling @ cut), cut])

    return LinearOperator(stiffness.shape, matvec=solve, dtype=stiffness.dtype)


def _collect_modes(
    sector: CyclicSector,
    cutoff_Hz: float,
    mass: csr_array,
    modes: Iterable[CyclicModes],
) -> GearModes:
    """The cyclic modes of all n as real modes, sorted, at flanks and hub.

    They come one by one: the fields of all together are the largest arrays here.
    """
    teeth, momentum = sector.gear.teeth, mass @ sector.rigid_body_modes
    inertia, *translational_mass = (
        np.einsum("ic,ic->c", sector.rigid_body_modes, momentum) * teeth
    )
    mode_arrays = [
        _real_modes_at_flanks_and_hub(mode_set, sector.flanks, momentum, teeth)
        for mode_set in modes
    ]
    joined_arrays = [
        np.concatenate(arrays) for arrays in zip(*mode_arrays, strict=True)
    ]
    order = np.argsort(joined_arrays[0], kind="stable")
    frequency, n, normal, tangential, rotation, translation = (
        x[order] for x in joined_arrays
    )
    return GearModes(
        teeth=teeth,
        cutoff_Hz=cutoff_Hz,
        frequencies_Hz=frequency,
        nodal_diameters=n,
        normal=normal,
        tangential=tangential,
        arcs=sector.flanks[RIGHT].arcs,
        rotation_coupling=rotation,
        translation_coupling=translation,
        inertia=float(inertia),
        mass=float(0.5 * sum(translational_mass)),
    )


def _real_modes_at_flanks_and_hub(
    modes: CyclicModes, flanks: Flanks, momentum: Array, teeth: int
) -> tuple[Array, Counts, Complex, Complex, Array, Array]:
    """Frequencies, nodal diameters, flanks and couplings of the real modes."""
    field = _real_modes(modes, flanks)
    n = np.full(field.shape[1], modes.nodal_diameters)
    return (
        np.repeat(modes.omega, 1 if modes.single else 2) / (2.0 * np.pi),
        n,
        _components_on_flanks(field, flanks, "inward"),
        _components_on_flanks(field, flanks, "rootward"),
        *_couplings(field, momentum, n, teeth),
    )


def _components_on_flanks(field: Field, flanks: Flanks, direction: str) -> Complex:
    """Components (modes, 2, points) of fields (freedoms, modes) on both flanks."""
    components = [
        np.einsum("icm,ic->mi", field[flank.dofs], getattr(flank, direction))
        for flank in flanks
    ]
    return np.stack(components, axis=1).astype(complex)


def _real_modes(modes: CyclicModes, flanks: Flanks) -> Complex:
    """Amplitudes (freedoms, modes) whose real parts are modes of the gear."""
    right, left = np.moveaxis(
        _components_on_flanks(modes.fields, flanks, "inward"), 1, 0
    )
    if modes.single:
        phase_factor = np.ones(len(right))
    else:
        # Conjugate and mirrored, a mode is itself up to a phase. Take out the
        # phase, and its real part is symmetric, its imaginary one antisymmetric.
        phase_factor = np.sqrt(np.einsum("mp,mp->m", right, left))
        phase_factor = phase_factor.conj() / np.abs(phase_factor)
    phase_factor = phase_factor * np.where(
        (phase_factor * right[:, 0]).real < 0.0, -1.0, 1.0
    )
    field = modes.fields * phase_factor
    if modes.single:
        return field.astype(complex)
    real_and_imaginary = np.stack([field, -1j * field], axis=2)  # Re(-i f) = Im f
    return real_and_imaginary.reshape(len(field), -1)


def _couplings(
    field: Complex, momentum: Array, n: Counts, teeth: int
) -> tuple[Array, Array]:
    """Rotation (modes,) and translation (modes, 2) of all sectors together.

    A turn is the same in all sectors, so only n = 0 adds up. In the frame of
    sector k a shift turns once around the gear, so only n = 1 does.
    """
    rotation_sum, along_x, along_y = momentum.T @ field
    rotation = np.where(n == 0, teeth * rotation_sum.real, 0.0)
    translation = np.where(n == 1, 0.5 * teeth * (along_x + 1j * along_y), 0.0)
    return rotation, np.stack([translation.real, translation.imag], axis=1)
