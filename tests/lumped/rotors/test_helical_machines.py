"""Random machines of shafts with helical gears: properties of matrices and modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from machines_in_space import random_machine

from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem

MACHINES = 20
SPEED = 700.0


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
