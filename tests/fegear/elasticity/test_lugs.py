"""A ring on lugs: against finite elements of the whole ring, and a clamped arch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.linalg import spsolve
from thin_ring import RIM, THIN_TEETH, thin_ring
from whole_gear import COARSE, STEEL, WholeGear, small_ring

from fegear.elasticity.lugs import Lugs, ToothForce, ring_on_lugs
from fegear.elasticity.sector import CyclicSector
from meshes.internal import Foundation

TEETH = 18
SPRINGS = Foundation(radial=2e10, tangential=1e10)
LUGS = Lugs(count=3, radial=3e10, tangential=5e10)


@pytest.fixture(scope="module")
def ring():
    return replace(small_ring(TEETH), foundation=SPRINGS)


@pytest.fixture(scope="module")
def lugged(ring):
    return ring_on_lugs(CyclicSector(ring, STEEL, COARSE), LUGS)


class WholeRingOnLugs:
    """Finite elements of the whole ring with springs added at the lugs."""

    def __init__(self, ring):
        self.whole = WholeGear(ring, COARSE, 20e3)
        self.means = [self.whole.mean_outside(tooth) for tooth in range(TEETH)]
        stiffness = self.whole.stiffness
        for tooth in range(0, TEETH, TEETH // LUGS.count):
            for mean, k in zip(
                self.means[tooth], (LUGS.radial, LUGS.tangential), strict=True
            ):
                column = csr_array(mean[:, None])
                stiffness = stiffness + k * (column @ column.T)
        self.stiffness = stiffness.tocsc()

    def outside(self, load):
        field = spsolve(self.stiffness, load)
        return np.array(self.means) @ field, field


@pytest.fixture(scope="module")
def direct(ring):
    return WholeRingOnLugs(ring)


@pytest.mark.parametrize("tooth", [0, 1, 3, 7])
def test_deflection_under_a_tooth_load_is_that_of_the_whole_ring(lugged, direct, tooth):
    node = 3
    arc = lugged.sector.flanks[0].arcs[node]
    result = lugged.deflection([ToothForce(tooth, arc, 1.0)])
    expected, _ = direct.outside(direct.whole.flank_rows(tooth)[node])
    scale = np.abs(expected).max()
    assert np.abs(result.outside - expected).max() < 1e-8 * scale
    forces = -expected[lugged.positions] * [LUGS.radial, LUGS.tangential]
    np.testing.assert_allclose(result.lug_forces, forces, atol=1e-8)


@pytest.mark.parametrize("tooth", [0, 2, 3])
def test_compliance_of_a_tooth_is_that_of_the_whole_ring(lugged, direct, tooth):
    rows = direct.whole.flank_rows(tooth)
    with_lugs = rows @ spsolve(direct.stiffness, rows.T)
    without = rows @ spsolve(direct.whole.stiffness, rows.T)
    change = lugged.compliance_change(tooth)
    assert np.abs(change - (with_lugs - without)).max() < 1e-8 * np.abs(without).max()
    assert (np.diag(change) < 0.0).all()


def test_compliance_repeats_from_lug_to_lug_and_differs_between(lugged):
    one, two, other = (lugged.compliance_change(tooth) for tooth in (1, 7, 4))
    np.testing.assert_allclose(one, two, rtol=1e-9)
    assert np.abs(one - other).max() > 1e-2 * np.abs(one).max()


def test_forces_on_the_ring_are_in_balance(ring):
    """Of stiff lugs, beside which the foundation carries next to nothing."""
    soft = replace(ring, foundation=Foundation(radial=1e8, tangential=1e8))
    lugged = ring_on_lugs(CyclicSector(soft, STEEL, COARSE), Lugs(count=6))
    flank = lugged.sector.flanks[0]
    result = lugged.deflection([ToothForce(2, flank.arcs[3], 1.0)])
    x, y = flank.points[3]
    arm = y * flank.inward[3, 0] - x * flank.inward[3, 1]  # clockwise
    moment = -ring.hub_radius * result.lug_forces[:, 1].sum()
    assert moment == pytest.approx(-arm, rel=2e-3)
    # the ring without lugs moves 1e3 times as much, which round-off is relative to
    at_pins = np.abs(result.outside[lugged.positions])
    assert at_pins.max() < 1e-7 * np.abs(result.outside).max()


def clamped_arch(half_angle, radius, bending, axial, shear):
    """Deflection of the crown of a clamped arch under a unit radial load on it.

    By Castigliano: crown force and moment take the values of least complementary
    energy. bending, axial, shear : E I, E A, k G A
    """
    angle = np.linspace(0.0, half_angle, 4001)
    zero = np.zeros_like(angle)
    # moment, normal and shear force by load, crown force and crown moment
    moment = [
        -0.5 * radius * np.sin(angle),
        radius * (1.0 - np.cos(angle)),
        zero + 1.0,
    ]
    normal = [0.5 * np.sin(angle), np.cos(angle), zero]
    across = [0.5 * np.cos(angle), -np.sin(angle), zero]
    energy = np.zeros((3, 3))
    for parts, stiffness in ((moment, bending), (normal, axial), (across, shear)):
        stacked = np.stack(parts)
        products = stacked[:, None] * stacked[None]
        energy += 2.0 * radius * np.trapezoid(products, angle) / stiffness
    return energy[0, 0] - energy[0, 1:] @ np.linalg.solve(energy[1:, 1:], energy[1:, 0])


@pytest.mark.parametrize("count", [3, 4, 6])
def test_a_thin_ring_on_pins_bends_as_a_clamped_arch(count):
    """Equal loads midway between all pins: neither pins nor loads see a slope."""
    gear = thin_ring(Foundation(radial=1e6, tangential=1e6))
    lugged = ring_on_lugs(CyclicSector(gear, STEEL, COARSE), Lugs(count=count))
    loads = np.zeros((THIN_TEETH, 2))
    middle = lugged.positions + THIN_TEETH // count // 2
    loads[middle, 0] = -1.0
    result = lugged.deflection([], loads)
    E, G = 206e9, 206e9 / 2.6
    arch = clamped_arch(
        np.pi / count,
        -gear.hub_radius - 0.5 * RIM,
        E * RIM**3 / 12.0,
        E * RIM,
        G * RIM / 1.2,
    )
    np.testing.assert_allclose(-result.outside[middle, 0], arch, rtol=0.04)


@pytest.mark.parametrize(
    ("lugs", "message"),
    [({"count": 1}, "count = 1; must be 2"), ({"count": 3, "radial": 0.0}, "radial")],
)
def test_lugs_that_carry_nothing_are_refused(lugs, message):
    with pytest.raises(ValueError, match=message):
        Lugs(**lugs)


def test_lugs_that_do_not_fit_the_teeth_are_refused(lugged):
    with pytest.raises(ValueError, match=f"count = 4; must divide .* {TEETH}"):
        ring_on_lugs(lugged.sector, Lugs(count=4))
    with pytest.raises(ValueError, match="not held"):
        ring_on_lugs(CyclicSector(small_ring(TEETH), STEEL, COARSE), LUGS)
