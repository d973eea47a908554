"""Compliance in mean axes: the inertia relief of a gear that is free to turn."""

from __future__ import annotations

import numpy as np
import pytest
from whole_gear import (
    COARSE,
    DENSITY,
    STEEL,
    WholeGear,
    free_gear_displacement,
    small_gear,
)

from fegear.elasticity.flank import MAX_TOOTH_OFFSET, flank_compliance
from fegear.elasticity.gear_modes import gear_modes
from fegear.elasticity.inertia_relief import inertia_relief
from fegear.elasticity.sector import RIGHT, CyclicSector

TEETH = 12


@pytest.fixture(scope="module")
def sector():
    return CyclicSector(small_gear(TEETH), STEEL, COARSE)


@pytest.fixture(scope="module")
def whole():
    return WholeGear(small_gear(TEETH), COARSE, 20e3)


@pytest.mark.slow
@pytest.mark.parametrize("extra", [0.0, 0.7])
def test_compliance_in_mean_axes_is_that_of_a_free_whole_gear(sector, whole, extra):
    """C - (arm / J) (p_i + p_j) + arm^2 q / J^2, of all flank points, to 1e-8."""
    turn = whole.rigid()[:, 0]
    inertia = (1.0 + extra) * float(turn @ (whole.mass @ turn))
    relief = inertia_relief(sector, DENSITY)
    held = flank_compliance(sector, split=False).normal[MAX_TOOTH_OFFSET]
    flank = sector.flanks[RIGHT]
    rigid = sector.rigid_body_modes[:, 0]
    arm = np.einsum("ic,ic->i", rigid[flank.dofs], flank.inward)
    p, q = relief.inward, relief.work
    expected = held - (p[:, None] * arm + arm[:, None] * p) / inertia
    expected += np.outer(arm, arm) * q / inertia**2
    rows = whole.flank_rows(0)
    compliance = np.empty_like(held)
    for j, load in enumerate(rows):
        field, acceleration = free_gear_displacement(whole, load, inertia)
        assert acceleration == pytest.approx(arm[j] / inertia, rel=1e-9)
        compliance[:, j] = rows @ field
    assert np.abs(compliance - expected).max() < 1e-8 * np.abs(held).max()
    assert np.abs(expected - held).max() > 1e-2 * np.abs(held).max()


def test_sum_of_modes_tends_to_it(sector):
    """p and q are sums over the modes that turn with the body, by rising frequency."""
    relief, errors = inertia_relief(sector, DENSITY), []
    for cutoff in (60e3, 120e3, 240e3):
        modes = gear_modes(sector, DENSITY, cutoff)
        softness = modes.rotation_coupling / (2.0 * np.pi * modes.frequencies_Hz) ** 2
        p = softness @ modes.normal_at(0)
        q = softness @ modes.rotation_coupling
        errors.append(
            [np.abs(p - relief.inward).max() / np.abs(p).max(), 1.0 - q / relief.work]
        )
    errors = np.abs(errors)
    assert (errors[-1] < 1e-3).all()
    assert (errors[-1] <= errors[0]).all()


def test_it_is_in_proportion_to_the_density_and_mirrored_on_left_flanks(sector):
    one, two = (inertia_relief(sector, rho) for rho in (DENSITY, 2.0 * DENSITY))
    np.testing.assert_allclose(two.inward, 2.0 * one.inward, rtol=1e-12)
    np.testing.assert_allclose(two.work, 4.0 * one.work, rtol=1e-12)
