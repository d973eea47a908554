"""Gears with cracked teeth against one direct solve of the whole gear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear
from cracked_gear import CrackedGear
from slow_tests import first_are_quick
from whole_gear import COARSE, small_gear, small_ring

from fegear.elasticity import damaged_ring as module
from fegear.elasticity.cache import (
    cached_compliance_change,
    cached_crack_influence,
    cached_flank_compliance,
)
from fegear.elasticity.crack_influence import crack_influence
from fegear.elasticity.crack_tip import tip_field
from fegear.elasticity.damaged_ring import compliance_change, damaged_ring
from fegear.elasticity.flank import MAX_TOOTH_OFFSET, flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import FlankLoad
from fegear.elasticity.sector import LEFT, RIGHT, cyclic_sector
from meshes import MeshSize
from meshes.crack import Crack
from meshes.internal import Foundation

STEEL = PlaneMaterial(206e9, 0.3)
TEETH = 12
ONE = {3: (Crack(depth=1e-3),)}
MANY = {
    0: (Crack(depth=0.8e-3), Crack(depth=0.6e-3, left=True)),
    1: (Crack(depth=1.2e-3, direction=0.9),),
    8: (Crack(depth=0.8e-3, left=True),),
}
SIZE = MeshSize(flank_edges=12, flank_grading=3.0, fillet_edges=6)
FINER = MeshSize(flank_edges=20, flank_grading=2.0, fillet_edges=14, tooth_size=0.25)


@pytest.fixture(scope="module")
def gear():
    return small_gear(TEETH)


def healthy_block(compliance, gear, receiver, source, side):
    half = gear.teeth // 2
    offset = (receiver - source + half) % gear.teeth - half
    if side == LEFT:  # the mirror image, whose teeth count the other way
        offset = -offset
    return np.stack(
        [
            table[MAX_TOOTH_OFFSET + offset]
            for table in (compliance.normal, compliance.tangential)
        ]
    )


@pytest.mark.parametrize("cracks", [ONE, MANY], ids=["one", "many"])
@pytest.mark.parametrize("side", [RIGHT, LEFT])
def test_ring_is_the_whole_gear(gear, cracks, side):
    """Without split, all pairs of teeth near a crack, to round-off."""
    sector = cyclic_sector(gear, STEEL, COARSE)
    compliance = flank_compliance(sector, split=False)
    change = compliance_change(damaged_ring(sector, cracks, split=False))
    whole = CrackedGear(gear, COARSE, STEEL, cracks)
    points = [1, 4]
    for source in change.affected.tolist():
        u = whole.displacement(source, points, side)
        for offset in range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1):
            receiver = (source + offset) % gear.teeth
            direct = whole.on_flank(u, receiver, side)
            ring = healthy_block(compliance, gear, receiver, source, side)
            ring = ring + change.block(receiver, source, side)
            if receiver not in change.affected:  # neglected, on a solid body small
                continue
            np.testing.assert_allclose(
                ring[:, :, points], direct, rtol=0.0, atol=1e-8 * np.abs(direct).max()
            )


def test_teeth_beyond_those_affected_change_little(gear):
    """What is left out is a small part of their compliance, and `reach` has it."""
    far, points = 7, [1, 4]
    whole = [CrackedGear(gear, COARSE, STEEL, cracks) for cracks in (ONE, {})]
    cracked, healthy = (w.on_flank(w.displacement(far, points), far) for w in whole)
    assert np.abs(cracked - healthy).max() < 3e-4 * np.abs(healthy).max()
    sector = cyclic_sector(gear, STEEL, COARSE)
    ring = replace(damaged_ring(sector, ONE, split=False), reach=4)
    block = compliance_change(ring).block(far, far)[:, :, points]
    direct = cracked - healthy
    np.testing.assert_allclose(block, direct, atol=1e-6 * np.abs(direct).max())


def test_internal_gear_on_springs_is_the_whole_ring():
    ring = replace(small_ring(30), foundation=None)
    cracks = {2: (Crack(depth=0.9e-3, tangent_angle=np.deg2rad(60.0)),)}
    sector = cyclic_sector(ring, STEEL, COARSE)
    change = compliance_change(damaged_ring(sector, cracks, split=False))
    compliance = flank_compliance(sector, split=False)
    whole = CrackedGear(ring, COARSE, STEEL, cracks)
    for source, receiver in ((2, 2), (2, 3), (1, 2), (1, 1)):
        direct = whole.on_flank(whole.displacement(source, [2]), receiver)
        total = healthy_block(compliance, ring, receiver, source, RIGHT)
        total = total + change.block(receiver, source)
        np.testing.assert_allclose(
            total[:, :, [2]], direct, rtol=0.0, atol=1e-8 * np.abs(direct).max()
        )


@pytest.mark.slow
def test_change_is_that_of_an_independent_finer_mesh():
    """Of the whole gear under point loads, and of the ring next to loads.

    Under a point load meshes differ: its displacement is infinite there.
    """
    gear, fine = small_gear(12), FINER.refined(2.0)
    change, finer = (
        compliance_change(damaged_ring(cyclic_sector(gear, STEEL, size), ONE))
        for size in (FINER, fine)
    )
    cracked, healthy = (CrackedGear(gear, fine, STEEL, c) for c in (ONE, {}))
    coarse = np.arange(1, 19)
    points, loaded = 2 * coarse + 1, [1, 14]
    # changes of other pairs are smaller than 1/10 and 1/200 of that of the cracked
    # tooth, and those of the whole gear differences of two meshes
    bounds = {
        (3, 3): (5e-3, 5e-3),
        (3, 4): (0.01, 5e-3),
        (2, 3): (0.01, 5e-3),
        (2, 2): (0.02, 0.01),
    }
    for (source, receiver), (of_whole, of_ring) in bounds.items():
        difference = [
            whole.on_flank(whole.displacement(source, points[loaded]), receiver)
            for whole in (cracked, healthy)
        ]
        direct = (difference[0] - difference[1])[:, points]
        block = change.block(receiver, source)[:, coarse][:, :, coarse]
        apart = np.ones(direct.shape[1:], bool)
        if source == receiver:
            apart = np.abs(np.arange(18)[:, None] - np.array(loaded)) > 2
        error = np.abs(block[:, :, loaded] - direct)[:, apart].max()
        assert error < of_whole * np.abs(direct).max()
        table = finer.block(receiver, source)[:, points][:, :, points]
        assert np.abs(block - table).max() < of_ring * np.abs(table).max()


def random_cracks(rng, count):
    return [
        Crack(
            depth=float(rng.uniform(0.3e-3, 1.2e-3)),
            direction=float(rng.uniform(0.6, 1.4)),
            left=bool(rng.integers(2)),
        )
        for _ in range(count)
    ]


@pytest.mark.parametrize("seed", first_are_quick(range(6)))
def test_change_is_reciprocal_positive_and_grows_with_depth(seed):
    rng = np.random.default_rng(seed)
    teeth = int(rng.integers(10, 40))
    reference = 0.5 * 2.54e-3 * teeth
    gear = make_gear(
        teeth,
        float(rng.uniform(0.3, 0.7)) * (reference - 3.2e-3),
        profile_shift=float(rng.uniform(0.3, 0.6)),
        tip_radius=reference + 3.3e-3,
    )
    sector = cyclic_sector(gear, STEEL, MeshSize().refined(0.6))
    (crack,) = random_cracks(rng, 1)
    shallow, deep = (
        compliance_change(damaged_ring(sector, {5: replace(crack, depth=depth)}))
        for depth in (crack.depth, 1.3 * crack.depth)
    )
    for side in (RIGHT, LEFT):
        full = [assembled(change, side) for change in (shallow, deep)]
        largest = np.abs(full[0]).max()
        assert np.abs(full[0] - full[0].T).max() < 0.02 * largest
        smallest = [np.linalg.eigvalsh(table + table.T)[0] for table in full]
        assert min(smallest) > -0.01 * largest
        growth = np.linalg.eigvalsh(full[1] - full[0] + (full[1] - full[0]).T)
        assert growth[-1] > 0.0
        assert growth[0] > -0.01 * np.abs(full[1]).max()


def assembled(change, side):
    """Normal compliance (T n, T n) over three neighbouring teeth."""
    teeth = (4, 5, 6)
    return np.block([[change.block(i, j, side)[0] for j in teeth] for i in teeth])


def test_a_vanishing_crack_changes_nothing(gear):
    sector = cyclic_sector(gear, STEEL, SIZE)
    scale = np.abs(flank_compliance(sector).normal).max()
    changes = [
        np.abs(
            compliance_change(damaged_ring(sector, {0: Crack(depth=d)})).normal
        ).max()
        for d in (1e-3, 1e-4, 1e-5)
    ]
    assert changes[0] > 0.2 * scale
    assert changes[1] < 0.02 * scale
    assert changes[2] < 2e-3 * scale  # of the mesh


def test_cracks_mirror_each_other(gear):
    """A left flank on a crack is a right one on the mirrored crack."""
    sector = cyclic_sector(gear, STEEL, SIZE)
    crack = ONE[3][0]
    one = compliance_change(damaged_ring(sector, {3: crack}))
    other = compliance_change(damaged_ring(sector, {TEETH - 3: crack.mirrored}))
    for receiver, source in ((3, 3), (4, 3), (2, 3), (1, 2)):
        a = one.block(receiver, source, LEFT)
        b = other.block(-receiver, -source, RIGHT)
        np.testing.assert_allclose(a, b, atol=2e-3 * np.abs(one.normal).max())


def test_a_crack_on_the_compressed_side_closes(gear):
    """Loads on a flank see the cracks of its side alone, as if others had healed."""
    sector = cyclic_sector(gear, STEEL, COARSE)
    right, left = (Crack(depth=d, left=s) for d, s in ((1e-3, False), (0.7e-3, True)))
    closing = compliance_change(damaged_ring(sector, {3: (right, left)}), closing=True)
    for side, crack in ((RIGHT, right), (LEFT, left)):
        alone = compliance_change(damaged_ring(sector, {3: crack}), closing=True)
        is_open = compliance_change(damaged_ring(sector, {3: crack}))
        np.testing.assert_array_equal(closing.normal[side], alone.normal[side])
        np.testing.assert_array_equal(closing.normal[side], is_open.normal[side])
        assert not alone.normal[1 - side].any()
        assert not alone.tangential[1 - side].any()
        assert is_open.normal[1 - side].any()


@pytest.mark.parametrize("seed", range(6))
def test_loads_open_cracks_of_their_side_and_close_others(seed):
    rng = np.random.default_rng(seed)
    teeth = int(rng.integers(12, 60))
    gear = make_gear(teeth, 0.4 * 2.54e-3 * (0.5 * teeth - 1.3), profile_shift=0.4)
    crack = replace(random_cracks(rng, 1)[0], left=False)
    ring = damaged_ring(cyclic_sector(gear, STEEL, COARSE), {0: crack})
    opening = crack_influence(ring, 0, coarser=ring).intensity[0, :, 3, :, 0, 0]
    points = opening.shape[1]
    # those at the form circle push the root more than they bend the tooth
    assert (opening[RIGHT, : 3 * points // 4] > 0.0).all()
    assert (opening[LEFT] < 0.0).all()


def test_blocks_far_from_a_crack_are_zero(gear):
    change = compliance_change(damaged_ring(cyclic_sector(gear, STEEL, COARSE), ONE))
    assert not change.block(3 + MAX_TOOTH_OFFSET + 1, 3).any()
    assert not change.block(8, 8).any()
    assert change.block(3, 3).any()
    np.testing.assert_array_equal(change.block(3 + TEETH, 3), change.block(3, 3))
    with pytest.raises(ValueError, match="flank = 2; must be 0 or 1"):
        change.block(3, 3, 2)


def test_change_turns_with_its_tooth_and_is_stored(gear, monkeypatch):
    two = {2: ONE[3], 4: MANY[8]}
    turned = {(tooth + 9) % TEETH: cracks for tooth, cracks in two.items()}
    first = cached_compliance_change(gear, STEEL, COARSE, two)
    direct = compliance_change(damaged_ring(cyclic_sector(gear, STEEL, COARSE), turned))
    other = cached_compliance_change(gear, STEEL, COARSE, turned)
    for receiver, source in ((11, 11), (1, 1), (0, 1), (11, 1)):
        expected = direct.block(receiver, source)
        scale = np.abs(direct.normal).max()
        np.testing.assert_allclose(
            other.block(receiver, source), expected, atol=1e-9 * scale
        )
        np.testing.assert_allclose(
            first.block(receiver - 9, source - 9), expected, atol=1e-9 * scale
        )
    monkeypatch.setattr(
        "fegear.elasticity.cache.compliance_change",
        lambda *_: pytest.fail("not stored"),
    )
    again = cached_compliance_change(gear, STEEL, COARSE, two)
    np.testing.assert_array_equal(again.normal, first.normal)


def test_healthy_gear_has_no_change(gear):
    with pytest.raises(ValueError, match="cracks: at least one is needed"):
        cached_compliance_change(gear, STEEL, COARSE, {})
    before = cached_flank_compliance(gear, STEEL, COARSE)
    cached_compliance_change(gear, STEEL, COARSE, ONE)
    fresh = flank_compliance(module.cyclic_sector(gear, STEEL, COARSE))
    np.testing.assert_array_equal(fresh.normal, before.normal)


def test_teeth_that_do_not_exist_are_refused(gear):
    with pytest.raises(ValueError, match="tooth = 12; must be 0 to 11"):
        cached_compliance_change(gear, STEEL, COARSE, {12: Crack(depth=1e-3)})
    with pytest.raises(ValueError, match=r"tooth = 4; cracked are \[3\]"):
        cached_crack_influence(gear, STEEL, COARSE, ONE, 4)


@pytest.mark.parametrize("depth", [0.4e-3, 1.5e-3])
@pytest.mark.parametrize("direction", first_are_quick([0.7, None], 1))
def test_energy_release_rate_is_the_growth_of_compliance(depth, direction):
    """Griffith: half the derivative of compliance over depth, mixed modes included."""
    gear, step = make_gear(17, 8e-3, profile_shift=0.4), 0.06 * depth
    sector = cyclic_sector(gear, STEEL, MeshSize())
    crack = Crack(depth=depth, direction=direction)
    shallow, deep = (
        compliance_change(damaged_ring(sector, {0: replace(crack, depth=d)}))
        for d in (depth - step, depth + step)
    )
    influence = crack_influence(damaged_ring(sector, {0: crack}), 0)
    # of loads on a neighbour, whose compliance changes little, differences of meshes
    # are larger than 1 % of the growth of a shallow crack
    for source in (0, 1, -1) if depth > 1e-3 else (0,):
        growth = deep.block(source, source)[0] - shallow.block(source, source)[0]
        rate = 0.25 * np.diag(growth) / step
        loads = [FlankLoad(source, RIGHT, influence.arcs, 1.0)]
        intensity = influence.stress_intensity(loads)[:, 0]
        predicted = (intensity**2).sum(axis=-1) / STEEL.modulus
        np.testing.assert_allclose(rate, predicted, rtol=0.01)
        if source == 0:
            released = influence.energy_release_rate(loads)[:, 0]
            np.testing.assert_allclose(released, predicted, rtol=1e-12)


@pytest.mark.parametrize("side", [RIGHT, LEFT])
def test_stress_intensity_is_that_of_the_whole_gear(gear, side):
    """Rings of the whole mesh, in its own axes, without split."""
    tooth = 3
    sector = cyclic_sector(gear, STEEL, COARSE)
    ring = damaged_ring(sector, ONE, split=False)
    influence = crack_influence(ring, tooth, coarser=ring)
    whole = CrackedGear(gear, COARSE, STEEL, ONE)
    mesh = whole.meshes[tooth]
    (tip,) = mesh.tips
    dofs = whole.dofs[whole.node[np.arange(len(mesh.points)) + whole.first[tooth]]]
    field = tip_field(mesh.points, mesh.triangles, dofs, tip, STEEL)
    angle = gear.pitch_angle * tooth
    c, s = np.cos(angle), np.sin(angle)
    for offset in (-1, 0, 2):
        u = whole.displacement(tooth + offset, [1, 4], side)
        x, y = u[dofs[:, 0]], u[dofs[:, 1]]
        turned = u.copy()  # to the axes of the tooth
        turned[dofs[:, 0]], turned[dofs[:, 1]] = c * x - s * y, s * x + c * y
        expected = field.interaction @ turned[field.rows]
        table = influence.intensity[0, side, MAX_TOOTH_OFFSET + offset, [1, 4], 0]
        np.testing.assert_allclose(table.T, expected, atol=1e-7 * abs(expected).max())
        rate = field.energy_release_rate(turned[field.rows])
        squared = (expected**2).sum(axis=0) / STEEL.modulus
        np.testing.assert_allclose(rate, squared, rtol=0.01)


def test_stress_intensities_by_two_methods_and_meshes_agree():
    gear = make_gear(25, 10e-3, profile_shift=0.2)
    influence = cached_crack_influence(
        gear, STEEL, MeshSize(), {4: Crack(depth=1e-3), 5: Crack(depth=0.5e-3)}, 4
    )
    table = influence.intensity
    for other in (influence.correlated, table - influence.error):
        assert np.abs(other - table).max() < 0.01 * np.abs(table).max()
    arc = 0.3 * gear.flank_length
    loads = [FlankLoad(0, RIGHT, arc, 1e6, 1e5), FlankLoad(1, RIGHT, 2 * arc, 5e5)]
    intensity = influence.stress_intensity(loads)
    assert intensity.shape == (1, 2)
    assert intensity[0, 0] > 0.0  # a load on its side opens a crack
    error = influence.energy_release_rate_error(loads)
    assert 0.0 < error[0] < 0.02 * influence.energy_release_rate(loads)[0]
    assert (influence.stress_intensity_error(loads) < 0.01 * intensity[0, 0]).all()
    closing = [FlankLoad(0, LEFT, arc, 1e6)]
    assert influence.stress_intensity(closing)[0, 0] < 0.0


def test_foundation_carries_a_cracked_ring():
    ring = replace(small_ring(30), foundation=Foundation(radial=1e18, tangential=1e18))
    crack = {0: Crack(depth=0.9e-3, tangent_angle=np.deg2rad(60.0))}
    soft, held = (
        compliance_change(damaged_ring(cyclic_sector(g, STEEL, COARSE), crack))
        for g in (ring, replace(ring, foundation=None))
    )
    scale = np.abs(held.normal).max()
    assert np.abs(soft.normal - held.normal).max() < 1e-3 * scale
