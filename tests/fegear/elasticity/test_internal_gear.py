"""An internal gear from one sector against finite elements of the whole ring.

See `whole_gear` for what the whole ring shares with the program.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from whole_gear import (
    COARSE,
    DENSITY,
    STEEL,
    WholeGear,
    free_gear_displacement,
    require_same_shapes,
    same_frequency,
    small_ring,
)

from fegear.elasticity.flank import MAX_TOOTH_OFFSET, flank_compliance
from fegear.elasticity.gear_modes import gear_modes
from fegear.elasticity.inertia_relief import inertia_relief
from fegear.elasticity.sector import LEFT, RIGHT, CyclicSector

CUTOFF = 230e3  # modes of body and teeth


@pytest.fixture(scope="module")
def sector():
    return CyclicSector(small_ring(18), STEEL, COARSE)


@pytest.fixture(scope="module")
def whole(sector):
    return WholeGear(sector.gear, COARSE, CUTOFF)


@pytest.fixture(scope="module")
def modes(sector):
    return gear_modes(sector, DENSITY, CUTOFF)


def displacements(whole, loads):
    """Of the ring, held at its outside, under each of loads (n, freedoms)."""
    free, field = whole.free, np.zeros_like(loads)
    field[:, free] = spsolve(whole.stiffness[free][:, free], loads[:, free].T).T
    return field


def test_compliance_is_that_of_the_whole_ring(sector, whole):
    """Of loads on nodes of tooth 0, at the flanks of all teeth beside it."""
    held = flank_compliance(sector, split=False).normal
    field = displacements(whole, whole.flank_rows(0))
    for offset in range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1):
        direct = whole.flank_rows(offset) @ field.T
        computed = held[MAX_TOOTH_OFFSET + offset]
        assert np.abs(computed - direct).max() < 1e-9 * np.abs(held).max()
    # a tooth deflects the one that it presses toward more than the one behind
    assert np.abs(held[MAX_TOOTH_OFFSET + 1] - held[MAX_TOOTH_OFFSET - 1]).max() > (
        1e-3 * np.abs(held).max()
    )


def test_frequencies_are_those_of_the_whole_ring(modes, whole):
    assert modes.frequencies_Hz.size > 20
    np.testing.assert_allclose(modes.frequencies_Hz, whole.frequencies, rtol=1e-8)


@pytest.mark.parametrize("side", [RIGHT, LEFT])
@pytest.mark.parametrize("tooth", [0, 1, -3])
def test_shapes_are_those_of_the_whole_ring(modes, whole, tooth, side):
    require_same_shapes(modes, whole, tooth, side)


def test_coupling_with_the_rim_is_that_of_the_whole_ring(modes, whole):
    """Of a mode and a flank, whose sign tells in which sense both count."""
    rigid = whole.rigid()
    direct = whole.fields.T @ (whole.mass @ rigid[:, 0])
    scale = np.sqrt(modes.inertia) * np.abs(modes.normal).max()
    for group in same_frequency(modes.frequencies_Hz):
        one = modes.rotation_coupling[group] @ modes.normal_at(0)[group]
        two = direct[group] @ whole.flank(0, RIGHT)[group]
        np.testing.assert_allclose(one / scale, two / scale, atol=1e-8)
    inertia, *mass = np.einsum("ic,ic->c", rigid, whole.mass @ rigid)
    assert modes.inertia == pytest.approx(inertia, rel=1e-11)
    assert [modes.mass] * 2 == pytest.approx(mass, rel=1e-11)


@pytest.mark.slow
def test_compliance_in_mean_axes_is_that_of_a_free_whole_ring(sector, whole):
    turn = whole.rigid()[:, 0]
    inertia = 1.3 * float(turn @ (whole.mass @ turn))
    relief = inertia_relief(sector, DENSITY)
    held = flank_compliance(sector, split=False).normal[MAX_TOOTH_OFFSET]
    p, arm = relief.inward, relief.inward_arm
    expected = held - (p[:, None] * arm + arm[:, None] * p) / inertia
    expected += np.outer(arm, arm) * relief.work / inertia**2
    rows, node = whole.flank_rows(0), 3
    field, acceleration = free_gear_displacement(whole, rows[node], inertia)
    assert acceleration == pytest.approx(arm[node] / inertia, rel=1e-9)
    assert np.abs(rows @ field - expected[:, node]).max() < 1e-8 * np.abs(held).max()


def test_arms_of_a_ring_are_its_base_radius(sector):
    """A clockwise turn moves the right flank, which is below the centre, inward."""
    arm = inertia_relief(sector, DENSITY).inward_arm
    np.testing.assert_allclose(arm, -sector.gear.base_radius, rtol=1e-12)
