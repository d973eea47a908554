"""A ring on springs: against the whole ring, the held one, rigid and thin rings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import spsolve
from thin_ring import RIM, thin_ring
from whole_gear import COARSE, DENSITY, STEEL, WholeGear, small_ring

from fegear.elasticity.flank import MAX_TOOTH_OFFSET, flank_compliance
from fegear.elasticity.gear_modes import gear_modes, lowest_modes
from fegear.elasticity.root_stress import root_influence
from fegear.elasticity.sector import RIGHT, CyclicSector
from meshes import MeshSize
from meshes.internal import Foundation
from meshes.section import section_area

SOFT = Foundation(radial=2e10, tangential=1e10)  # N/m3
CUTOFF = 120e3


def on_springs(ring, radial, tangential, size=COARSE):
    springs = Foundation(radial=radial, tangential=tangential)
    return CyclicSector(replace(ring, foundation=springs), STEEL, size)


@pytest.fixture(scope="module")
def ring():
    return small_ring(18)


@pytest.fixture(scope="module")
def whole(ring):
    return WholeGear(replace(ring, foundation=SOFT), COARSE, CUTOFF)


@pytest.fixture(scope="module")
def sector(ring):
    return on_springs(ring, SOFT.radial, SOFT.tangential)


def test_compliance_is_that_of_the_whole_ring_on_springs(sector, whole):
    springs = flank_compliance(sector, split=False)
    field = spsolve(whole.stiffness, whole.flank_rows(0).T).T
    for offset in range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1):
        for normal, table in ((True, springs.normal), (False, springs.tangential)):
            direct = whole.flank_rows(offset, RIGHT, normal) @ field.T
            difference = table[MAX_TOOTH_OFFSET + offset] - direct
            assert np.abs(difference).max() < 1e-8 * np.abs(springs.normal).max()


def test_frequencies_are_those_of_the_whole_ring_on_springs(sector, whole):
    modes = gear_modes(sector, DENSITY, CUTOFF)
    assert modes.frequencies_Hz.size > 20
    np.testing.assert_allclose(modes.frequencies_Hz, whole.frequencies, rtol=1e-8)


@pytest.mark.parametrize("split", [True, False])
def test_very_stiff_springs_hold_the_ring(ring, split):
    held = flank_compliance(CyclicSector(ring, STEEL, COARSE), split)
    stiff = flank_compliance(on_springs(ring, 1e20, 1e20), split)
    scale = np.abs(held.normal).max()
    assert np.abs(stiff.normal - held.normal).max() < 1e-6 * scale
    assert np.abs(stiff.tangential - held.tangential).max() < 1e-6 * scale


def test_the_difference_to_the_held_ring_falls_with_the_stiffness(ring):
    held = flank_compliance(CyclicSector(ring, STEEL, COARSE)).normal
    differences = [
        np.abs(flank_compliance(on_springs(ring, k, k)).normal - held).max()
        for k in (1e17, 1e18, 1e19)
    ]
    orders = np.diff(np.log10(differences))
    np.testing.assert_allclose(orders, -1.0, atol=0.01)


def test_very_stiff_springs_hold_modes_and_root_stress(ring):
    held = CyclicSector(ring, STEEL, COARSE)
    stiff = on_springs(ring, 1e20, 1e20)
    both = [gear_modes(s, DENSITY, 150e3).frequencies_Hz for s in (held, stiff)]
    np.testing.assert_allclose(both[1], both[0], rtol=1e-6)
    one, two = (root_influence(s).remainder for s in (held, stiff))
    assert np.abs(one - two).max() < 1e-6 * np.abs(one).max()


def rigid_compliance(sector, offset):
    """Inward displacement (n, n) of a rigid ring on springs, in closed form."""
    gear, flank = sector.gear, sector.flanks[RIGHT]
    springs, R = gear.foundation, -gear.hub_radius
    shift = np.pi * R * (springs.radial + springs.tangential)
    rotation = 2.0 * np.pi * R**3 * springs.tangential
    angle = offset * gear.pitch_angle  # clockwise
    c, s = np.cos(angle), np.sin(angle)
    inward = flank.inward @ np.array([[c, -s], [s, c]])
    x, y = flank.points.T
    arm = y * flank.inward[:, 0] - x * flank.inward[:, 1]
    return inward @ flank.inward.T / shift + np.outer(arm, arm) / rotation


@settings(max_examples=8, deadline=None, derandomize=True)
@given(st.floats(0.0, 1e7), st.floats(1e6, 1e7), st.sampled_from([-3, -1, 0, 2]))
def test_soft_springs_let_the_ring_move_as_a_rigid_body(radial, tangential, offset):
    """The rest, the elastic part, is as large as that of the same ring on others."""
    sector = on_springs(small_ring(18), radial, tangential)
    computed = flank_compliance(sector, split=False).normal[MAX_TOOTH_OFFSET + offset]
    rigid = rigid_compliance(sector, offset)
    scale = np.abs(rigid_compliance(sector, 0)).max()
    assert np.abs(computed - rigid).max() < 1e-3 * scale


def test_the_elastic_part_on_soft_springs_does_not_grow_with_compliance(ring):
    """Ten times as soft, the ring moves ten times as much and deforms as before."""
    rests = []
    for k in (1e8, 1e9):
        sector = on_springs(ring, k, k)
        computed = flank_compliance(sector, split=False).normal[MAX_TOOTH_OFFSET]
        rests.append(computed - rigid_compliance(sector, 0))
    assert np.abs(rests[1] - rests[0]).max() < 0.03 * np.abs(rests[0]).max()


@pytest.mark.parametrize("k", [1e9, 1e11, 1e13])
def test_the_half_plane_is_taken_out_as_well_as_on_a_held_ring(ring, k):
    """At teeth beside the loaded one both ways are finite elements alone."""
    size = MeshSize(flank_edges=12, tooth_size=0.3, hub_size=1.2)

    def difference(sector):
        one, two = (flank_compliance(sector, split).normal for split in (True, False))
        beside = np.delete(np.stack([one - two, two]), MAX_TOOTH_OFFSET, axis=1)
        return np.divide(*np.abs(beside).max(axis=(1, 2, 3)))

    held = difference(CyclicSector(ring, STEEL, size))
    assert difference(on_springs(ring, k, k, size)) < 2.0 * held


@pytest.mark.parametrize("mode", [0, 1])
def test_springs_resist_a_rigid_body_as_in_closed_form(ring, mode):
    """Of order 4 in the length of the quadratic edges."""
    errors = []
    for size in (2.4, 1.2):
        sector = on_springs(ring, 3e9, 2e9, MeshSize(hub_size=size, flank_edges=6))
        springs, R = sector.gear.foundation, -ring.hub_radius
        rigid = sector.rigid_body_modes
        work = ring.teeth * np.einsum("ic,ic->c", rigid, sector.springs @ rigid)
        # a sector's share of a shift depends on its direction, that of both does not
        computed = (work[0], work[1] + work[2])[mode]
        expected = (springs.rotation(R), 2.0 * springs.translation(R))[mode]
        errors.append(abs(computed / expected - 1.0))
    assert errors[0] < 1e-5
    assert errors[1] < errors[0] / 8.0


@pytest.mark.parametrize(
    ("radial", "tangential", "rtol"),
    [(1e6, 1e6, 0.02), (1e10, 1e10, 0.02), (1e11, 5e9, 0.03), (3e10, 0.3e10, 0.03)],
)
def test_bending_frequencies_are_those_of_a_thin_ring_on_springs(
    radial, tangential, rtol
):
    """omega^2 = (E I n^2 (n^2 - 1)^2 / R^4 + springs) / (rho A (n^2 + 1)).

    The mean line of an inextensible ring moves by w = n cos(n phi) and v = sin(n phi);
    its outside, half a rim away, by v (1 - (n^2 - 1) h / 2 R). Soedel, Vibrations of
    Shells and Plates, article 5.3; springs by their work.
    """
    gear = thin_ring(Foundation(radial=radial, tangential=tangential))
    numbers = np.arange(2, 7)
    sector = CyclicSector(gear, STEEL, COARSE)
    modes = lowest_modes(sector, DENSITY, numbers.tolist(), 1)
    outside = -gear.hub_radius
    R = outside - 0.5 * RIM
    mass = DENSITY * section_area(gear) / (2.0 * np.pi * R)
    bending = 206e9 * RIM**3 / 12.0
    n2 = numbers**2
    slip = 1.0 - (n2 - 1.0) * 0.5 * RIM / R
    springs = (n2 * radial + slip**2 * tangential) * outside / R
    squared = (bending * n2 * (n2 - 1.0) ** 2 / R**4 + springs) / (mass * (n2 + 1.0))
    for n, omega in zip(numbers, np.sqrt(squared), strict=True):
        lowest = modes.frequencies_Hz[modes.nodal_diameters == n]
        np.testing.assert_allclose(2.0 * np.pi * lowest, omega, rtol=rtol)


@pytest.mark.parametrize("n", [0, 1])
def test_rigid_modes_on_soft_springs_are_those_of_a_mass_and_an_inertia(n):
    springs = Foundation(radial=2e7, tangential=1e7)
    gear = thin_ring(springs)
    modes = lowest_modes(CyclicSector(gear, STEEL, COARSE), DENSITY, [n], 1)
    R = -gear.hub_radius
    squared = {
        0: springs.rotation(R) / modes.inertia,
        1: springs.translation(R) / modes.mass,
    }[n]
    # radial springs deform the ring by their part of 1e-4 in its bending stiffness
    np.testing.assert_allclose(
        2.0 * np.pi * modes.frequencies_Hz, np.sqrt(squared), rtol=1e-3
    )


@pytest.mark.parametrize(
    ("radial", "tangential", "field"),
    [(-1.0, 1e9, "radial"), (1e9, 0.0, "tangential"), (np.nan, 1e9, "radial")],
)
def test_springs_that_do_not_hold_a_ring_are_refused(radial, tangential, field):
    with pytest.raises(ValueError, match=rf"{field} = .* must be"):
        Foundation(radial=radial, tangential=tangential)
