"""Random machines of shafts with helical gears: properties of matrices and modes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lumped.rotors.description import (
    Bearing,
    Disk,
    MeshSpring,
    Rotor,
    RotorSystem,
    Section,
)
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem

MACHINES = 20
SPEED = 700.0
GRID = 0.025  # m


def place_on(rng, length):
    """A place on a shaft that is not an end."""
    return GRID * float(rng.integers(1, round(length / GRID)))


def random_rotor(rng, number, ratio):
    # no element is short, for its stiffness would bring round-off
    lengths = GRID * rng.integers(4, 12, rng.integers(1, 4))
    total = math.fsum(lengths)
    return Rotor(
        name=f"shaft {number}",
        sections=tuple(
            Section(length=L, diameter=rng.uniform(0.03, 0.08), bore=0.01)
            for L in lengths
        ),
        disks=tuple(
            Disk(
                position=place_on(rng, total),
                mass=rng.uniform(1.0, 20.0),
                polar_inertia=rng.uniform(0.01, 0.2),
                transverse_inertia=rng.uniform(0.01, 0.2),
            )
            for _ in range(rng.integers(1, 3))
        ),
        bearings=tuple(
            Bearing(
                position=place,
                stiffness=(rng.uniform(1e7, 1e9), 0.0, 0.0, rng.uniform(1e7, 1e9)),
                axial_stiffness=axial,
                tilt_stiffness=rng.choice([0.0, 1e5]),
            )
            for place, axial in ((0.0, rng.uniform(1e6, 1e8)), (total, 0.0))
        ),
        young_modulus=2.06e11,
        shear_modulus=7.9e10,
        density=7850.0,
        speed_ratio=ratio,
    )


def random_machine(rng):
    """Two or three shafts in a row, whose gears are somewhere along them."""
    radii = rng.uniform(0.03, 0.15, 4)
    shafts = int(rng.integers(2, 4))
    ratios = [1.0, -radii[0] / radii[1]]
    ratios.append(-ratios[1] * radii[2] / radii[3])
    rotors = tuple(random_rotor(rng, i, ratios[i]) for i in range(shafts))
    meshes = []
    for i in range(shafts - 1):
        angle, pressure = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.2, 0.5)
        pitch = radii[2 * i] * math.tan(pressure)
        meshes.append(
            MeshSpring(
                rotors=(i, i + 1),
                positions=tuple(place_on(rng, r.length) for r in rotors[i : i + 2]),
                offsets=tuple(rng.uniform(-0.01, 0.01, 2)),
                base_radii=tuple(radii[2 * i : 2 * i + 2]),
                direction=(math.cos(angle), math.sin(angle)),
                sense=1 if ratios[i] > 0.0 else -1,
                stiffness=rng.uniform(1e8, 1e9),
                width=rng.uniform(0.02, 0.08),
                base_helix_angle=rng.uniform(-0.6, 0.6),
                pressure_angle=pressure,
                path=(pitch - rng.uniform(0.0, 0.01), pitch + rng.uniform(0.0, 0.01)),
            )
        )
    return RotorSystem(
        rotors=rotors, meshes=tuple(meshes), elements=3, axial_motion=True
    )


def mirrored(system):
    """The machine with z reversed, so that all hands are the other ones."""

    def flipped(parts, length):
        return tuple(replace(p, position=length - p.position) for p in parts)

    rotors = tuple(
        replace(
            r,
            sections=r.sections[::-1],
            disks=flipped(r.disks, r.length),
            bearings=flipped(r.bearings, r.length),
        )
        for r in system.rotors
    )
    meshes = tuple(
        replace(
            m,
            positions=tuple(
                system.rotors[r].length - z
                for r, z in zip(m.rotors, m.positions, strict=True)
            ),
            offsets=tuple(-z for z in m.offsets),
            base_helix_angle=-m.base_helix_angle,
        )
        for m in system.meshes
    )
    return replace(system, rotors=rotors, meshes=meshes)


@pytest.fixture(scope="module", params=range(MACHINES))
def machine(request):
    return random_machine(np.random.default_rng([73, request.param]))


def test_matrices_are_symmetric_and_none_is_negative(machine):
    system = assemble(machine)
    for matrix, least in (
        (system.mass, 0.0),
        (system.stiffness, -1e-14),
        *((mesh, -1e-14) for mesh in system.mesh_stiffness),
    ):
        np.testing.assert_allclose(
            matrix, matrix.T, rtol=0.0, atol=1e-15 * np.abs(matrix).max()
        )
        scale = np.sqrt(np.maximum(np.diag(matrix), 1e-30 * np.diag(matrix).max()))
        values = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
        assert values.min() >= least * values.max()
    skew = system.gyroscopic + system.gyroscopic.T
    assert np.abs(skew).max() <= 1e-15 * np.abs(system.gyroscopic).max()


def test_a_motion_of_the_whole_machine_along_its_axes_strains_no_mesh(machine):
    system = assemble(machine)
    together = system.is_axial.astype(float)
    alone = together * (system.rotor_of == 0)
    scale = np.abs(system.mesh_stiffness).max()
    assert np.abs(system.mesh_stiffness @ together).max() <= 1e-15 * scale
    assert np.abs(system.mesh_stiffness[0] @ alone).max() > 1e-3 * (
        machine.meshes[0].stiffness * abs(machine.meshes[0].base_helix_angle)
    )


def test_a_machine_and_its_mirror_have_the_same_frequencies(machine):
    one, other = (
        WhirlProblem(assemble(m)).solve(SPEED, 12) for m in (machine, mirrored(machine))
    )
    np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-10)
    np.testing.assert_allclose(one.axial, other.axial, atol=1e-6)


def test_the_other_hand_alone_has_other_frequencies(machine):
    other_hand = replace(
        machine,
        meshes=tuple(
            replace(m, base_helix_angle=-m.base_helix_angle) for m in machine.meshes
        ),
    )
    one, other = (
        WhirlProblem(assemble(m)).solve(SPEED, 12).frequency
        for m in (machine, other_hand)
    )
    assert np.abs(one / other - 1.0).max() > 1e-6


def test_shares_of_the_kinetic_energy_sum_to_one(machine):
    system = assemble(machine)
    modes = WhirlProblem(system).solve(SPEED, 20)

    def share(chosen):
        shapes = modes.shapes * chosen[:, None]
        return np.einsum("nk,nm,mk->k", shapes.conj(), system.mass, shapes).real

    sideways = ~(system.is_rotation | system.is_axial)
    np.testing.assert_allclose(share(system.is_axial), modes.axial, atol=1e-12)
    np.testing.assert_allclose(share(system.is_rotation), modes.torsion, atol=1e-12)
    total = modes.axial + modes.torsion + share(sideways)
    np.testing.assert_allclose(total, 1.0, rtol=1e-12)
    assert (modes.axial > 1e-6).any()
    assert (modes.mesh_energy > -1e-12).all()
    assert (modes.mesh_energy.sum(axis=0) <= 1.0 + 1e-9).all()
