"""Elastic modes of a whole toothed gear with its hub held, from one sector.

The sectors of a gear are equal, so its modes are waves: with n nodal diameters,
sector k moves like sector 0 times exp(2 pi i n k / z), in components that turn with
the sector (Thomas, Int. J. Numer. Meth. Eng. 14 (1979) 81). The right cut is then tied
to the left one, and every n is a Hermitian eigenproblem of one sector's size. How many
modes it has below the cut-off is counted first (Wittrick & Williams, Q. J. Mech. Appl.
Math. 24 (1971) 263), so that only those n are solved that have any.

Everything is per unit width.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigvalsh
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from fegear.elasticity.flank import FlankPoints, flank_points_of
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import (
    CondensedSector,
    SectorModel,
    assemble_mass,
    assemble_sector,
    condense,
)
from fegear.timing import stage
from meshes import MeshSize, SectorMesh, SpurGear, sector_mesh

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Field = NDArray[Any]  # real where a wave stands, else complex
Counts = NDArray[np.int64]
RIGHT, LEFT = 0, 1  # flanks of a tooth
LAYERS_PER_WAVE = 6.0  # at least; frequencies are then exact to some 1e-4


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
class Waves:
    """Modes with n nodal diameters as complex fields of sector 0.

    omega : (m,) rising [rad/s]
    fields : (freedoms, m) Cartesian displacement; its real and its imaginary part,
        carried around the gear, are modes of unit mass. Real where n is single.
    """

    nodal_diameter: int
    omega: Array
    fields: Field

    @property
    def single(self) -> bool:
        """Whether the wave stands: n = 0, or half the number of teeth."""
        return not np.iscomplexobj(self.fields)


def gear_modes(
    gear: SpurGear,
    material: PlaneMaterial,
    density: float,
    cutoff_Hz: float,
    size: MeshSize | None = None,
) -> GearModes:
    """All modes of the gear below `cutoff_Hz`, hub held; density in kg/m3."""
    for name, value in (("density", density), ("cutoff_Hz", cutoff_Hz)):
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"{name} must be positive and finite, got {value}")
    size = resolving(size or MeshSize(), gear, material, density, cutoff_Hz)
    with stage("meshing"):
        mesh = sector_mesh(gear, size)
    with stage("assembling"):
        model = assemble_sector(mesh, material)
        mass = assemble_mass(model, density)
    flanks = both_flanks(gear, mesh, model)
    with stage("modes"):
        waves = sector_waves(model, mass, gear.teeth, cutoff_Hz)
        return _gathered(gear, cutoff_Hz, model, mass, flanks, waves)


def resolving(
    size: MeshSize,
    gear: SpurGear,
    material: PlaneMaterial,
    density: float,
    highest_Hz: float,
) -> MeshSize:
    """With layers of the body that resolve shear waves up to a frequency."""
    wave = math.sqrt(material.lame[1] / density) / highest_Hz
    largest = wave / (LAYERS_PER_WAVE * gear.module)
    return replace(size, largest_layer=min(size.largest_layer, largest))


def sector_waves(
    model: SectorModel, mass: csr_array, teeth: int, cutoff_Hz: float
) -> Iterator[Waves]:
    """Modes below the cut-off for every n = 0 .. teeth // 2, some of them empty."""
    counts = mode_counts(model, mass, teeth, cutoff_Hz)
    sector = condense(model, teeth)
    for n, count in enumerate(counts):
        yield _solved(model, mass, sector, teeth, n, int(count))


def mode_counts(
    model: SectorModel, mass: csr_array, teeth: int, cutoff_Hz: float
) -> Counts:
    """Number of waves below the cut-off for each n = 0 .. teeth // 2.

    Negative eigenvalues of K - omega^2 M by Sylvester's law of inertia: those of
    the inner freedoms, one factorisation for all n, and those of what remains on
    the tied cut.
    """
    omega = 2.0 * math.pi * cutoff_Hz
    dynamic = csr_array(model.stiffness - omega**2 * mass)
    sector = condense(replace(model, stiffness=dynamic), teeth)
    inner = np.count_nonzero(sector.factor.U.diagonal() < 0.0)
    phases = [wave_phase(n, teeth) for n in range(teeth // 2 + 1)]
    tied = [eigvalsh(_tied(sector.superelement, phase)) for phase in phases]
    return np.array([inner + np.count_nonzero(values < 0.0) for values in tied])


def wave_phase(nodal_diameter: int, teeth: int) -> complex:
    """exp(2 pi i n / z), a real number where the wave stands."""
    if nodal_diameter == 0:
        return 1.0
    if 2 * nodal_diameter == teeth:
        return -1.0
    return complex(np.exp(2j * np.pi * nodal_diameter / teeth))


def _tied(superelement: Array, phase: complex) -> Field:
    """Super-element over both cuts with the right one `phase` times the left one."""
    m = len(superelement) // 2
    ahead = phase * superelement[:m, m:]
    return superelement[:m, :m] + superelement[m:, m:] + ahead + ahead.conj().T


def tie(model: SectorModel, polar: Array, phase: complex) -> csr_array:
    """(freedoms, inner + m) from inner and polar left-cut displacement to all."""
    half, free = len(model.cut) // 2, len(model.inner)
    cut = polar[:, :half] + phase * polar[:, half:]
    rows, columns = np.nonzero(cut)
    entries = np.concatenate([np.ones(free), cut[rows, columns]])
    places = (
        np.concatenate([model.inner, model.cut[rows]]),
        np.concatenate([np.arange(free), free + columns]),
    )
    return csr_array((entries, places), shape=(model.basis.N, free + half))


def _solved(
    model: SectorModel,
    mass: csr_array,
    sector: CondensedSector,
    teeth: int,
    nodal_diameter: int,
    count: int,
) -> Waves:
    """The `count` lowest waves by shift-invert Lanczos about zero."""
    if count == 0:
        return Waves(nodal_diameter, np.empty(0), np.empty((model.basis.N, 0)))
    phase = wave_phase(nodal_diameter, teeth)
    ties = tie(model, sector.polar, phase)
    K, M = (
        csr_array(ties.conj().T @ matrix @ ties) for matrix in (model.stiffness, mass)
    )
    values, vectors = eigsh(
        K,
        count,
        M=M,
        sigma=0.0,
        OPinv=_inverse(sector, K, phase),
        v0=np.random.default_rng(0).standard_normal(K.shape[0]),
    )
    order = np.argsort(values)
    vectors = vectors[:, order]
    norm = np.einsum("im,im->m", vectors.conj(), M @ vectors).real
    # a travelling wave shares its kinetic energy between its two modes
    share = teeth if np.isrealobj(vectors) else 0.5 * teeth
    fields = ties @ (vectors / np.sqrt(share * norm))
    return Waves(nodal_diameter, np.sqrt(values[order]), fields)


def _inverse(
    sector: CondensedSector, stiffness: csr_array, phase: complex
) -> LinearOperator:
    """Inverse of the tied stiffness by elimination of the inner freedoms.

    Their factors are real and shared by all n; what is left is small and dense.
    """
    free = len(sector.response)
    coupling = stiffness[:free, free:]
    back = coupling.conj().T
    ring = cho_factor(_tied(sector.superelement, phase))

    def solve(load: Field) -> Field:
        settled = _solve_inner(sector, load[:free])
        cut = cho_solve(ring, load[free:] - np.asarray(back @ settled))
        return np.concatenate([settled - _solve_inner(sector, coupling @ cut), cut])

    return LinearOperator(stiffness.shape, matvec=solve, dtype=stiffness.dtype)


def _solve_inner(sector: CondensedSector, load: Field) -> Field:
    if np.isrealobj(load):
        return sector.factor.solve(load)
    parts = sector.factor.solve(np.stack([load.real, load.imag], axis=1))
    return np.asarray(parts[:, 0] + 1j * parts[:, 1])


def both_flanks(
    gear: SpurGear, mesh: SectorMesh, model: SectorModel
) -> tuple[FlankPoints, FlankPoints]:
    """The load points of the right flank, and their mirror images."""
    right = flank_points_of(gear, mesh, model)
    mirror = np.array([-1.0, 1.0])
    left = FlankPoints(
        right.points * mirror,
        right.inward * mirror,
        right.rootward * mirror,
        right.arcs,
        model.node_freedoms[mesh.edges["left_flank"][:, 1]],
    )
    return right, left


def rigid_fields(model: SectorModel) -> Array:
    """(freedoms, 3): unit clockwise turn about the centre, unit shifts in x and y."""
    x, y = model.locations.T
    along_x = np.ones(model.basis.N, bool)
    along_x[model.basis.split_indices()[1]] = False
    return np.stack([np.where(along_x, y, -x), along_x, ~along_x], axis=1)


def _gathered(
    gear: SpurGear,
    cutoff_Hz: float,
    model: SectorModel,
    mass: csr_array,
    flanks: tuple[FlankPoints, FlankPoints],
    waves: Iterable[Waves],
) -> GearModes:
    """The waves of all n as real modes, sorted, seen from flanks and hub.

    They come one by one: the fields of all together are the largest arrays here.
    """
    rigid = rigid_fields(model)
    momentum = mass @ rigid
    inertia, along_x, along_y = np.einsum("ic,ic->c", rigid, momentum) * gear.teeth
    parts = [_of_wave(wave, flanks, momentum, gear.teeth) for wave in waves]
    joined = [np.concatenate(each) for each in zip(*parts, strict=True)]
    order = np.argsort(joined[0], kind="stable")
    frequency, n, normal, tangential, rotation, translation = (x[order] for x in joined)
    return GearModes(
        teeth=gear.teeth,
        cutoff_Hz=cutoff_Hz,
        frequencies_Hz=frequency,
        nodal_diameters=n,
        normal=normal,
        tangential=tangential,
        arcs=flanks[RIGHT].arcs,
        rotation_coupling=rotation,
        translation_coupling=translation,
        inertia=float(inertia),
        mass=float(0.5 * (along_x + along_y)),
    )


def _of_wave(
    wave: Waves, flanks: tuple[FlankPoints, FlankPoints], momentum: Array, teeth: int
) -> tuple[Array, Counts, Complex, Complex, Array, Array]:
    """Frequencies, nodal diameters, flanks and couplings of a wave's modes."""
    field = _as_modes(wave, flanks)
    n = np.full(field.shape[1], wave.nodal_diameter)
    return (
        np.repeat(wave.omega, 1 if wave.single else 2) / (2.0 * np.pi),
        n,
        _seen(field, flanks, "inward"),
        _seen(field, flanks, "rootward"),
        *_couplings(field, momentum, n, teeth),
    )


def _seen(
    field: Field, flanks: tuple[FlankPoints, FlankPoints], direction: str
) -> Complex:
    """Components (modes, 2, points) of fields (freedoms, modes) on both flanks."""
    sides = [
        np.einsum("icm,ic->mi", field[side.freedoms], getattr(side, direction))
        for side in flanks
    ]
    return np.stack(sides, axis=1).astype(complex)


def _as_modes(wave: Waves, flanks: tuple[FlankPoints, FlankPoints]) -> Complex:
    """Amplitudes (freedoms, modes) whose real parts are the modes of a wave."""
    right, left = np.moveaxis(_seen(wave.fields, flanks, "inward"), 1, 0)
    if wave.single:
        turn = np.ones(len(right))
    else:
        # Conjugate and mirrored, a wave is itself up to a phase. Take out the
        # phase, and its real part is symmetric, its imaginary one antisymmetric.
        turn = np.sqrt(np.einsum("mp,mp->m", right, left))
        turn = turn.conj() / np.abs(turn)
    turn = turn * np.where((turn * right[:, 0]).real < 0.0, -1.0, 1.0)
    field = wave.fields * turn
    if wave.single:
        return field.astype(complex)
    pair = np.stack([field, -1j * field], axis=2)  # Re(-i f) = Im f
    return pair.reshape(len(field), -1)


def _couplings(
    field: Complex, momentum: Array, n: Counts, teeth: int
) -> tuple[Array, Array]:
    """Rotation (modes,) and translation (modes, 2) of all sectors together.

    A turn is the same in all sectors, so only n = 0 adds up. In the frame of
    sector k a shift turns once around the gear, so only n = 1 does.
    """
    turn, along_x, along_y = momentum.T @ field
    rotation = np.where(n == 0, teeth * turn.real, 0.0)
    shift = np.where(n == 1, 0.5 * teeth * (along_x + 1j * along_y), 0.0)
    return rotation, np.stack([shift.real, shift.imag], axis=1)
