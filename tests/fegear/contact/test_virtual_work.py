"""Steel on plastic: the work of deflected teeth is told from errors of the balance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fegear.contact.virtual_work import work_on_gaps
from fegear.gearset import load_gear_set
from fegear.statics.plausibility import MAX_IMBALANCE
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.statics.table_warnings import table_warnings

PLASTIC = {"gear.2.young_modulus_GPa": 3}
RELIEF = {
    "mesh.1.tip_relief.magnitude_um": 20,
    "mesh.1.tip_relief.length_pitches": 0.4,
}
PITCH_ERRORS = {"gear.1.pitch_errors_um": [10, 0] * 19}


def solved(edits, torques=(1.0, 10.0, 80.0), **settings):
    gear_set = load_gear_set("liu-pair", edits=edits)
    chosen = StaticsSettings(estimate_error=False, **settings)
    return solve_mesh(gear_set, 1, torques, chosen)


@pytest.fixture(scope="module")
def soft():
    return solved(PLASTIC)


def test_steel_on_plastic_is_trusted(soft):
    assert soft.work_balance > 2e-3  # twice what is allowed of an error
    assert soft.virtual_work < 0.2 * MAX_IMBALANCE
    assert table_warnings(soft) == []


@pytest.mark.parametrize(
    ("edits", "settings"),
    [
        ({"gear.1.young_modulus_GPa": 3}, {}),
        (PLASTIC | RELIEF, {}),
        (PLASTIC | RELIEF, {"corner_contact": False}),
        (PLASTIC | PITCH_ERRORS, {}),
        (PLASTIC, {"resolution": "coarse"}),
        ({}, {}),
    ],
)
def test_the_difference_of_the_works_is_that_on_the_gaps(edits, settings):
    result = solved(edits, **settings)
    assert result.virtual_work < 0.2 * MAX_IMBALANCE
    assert result.gap_work < result.deflection_over_pitch
    assert table_warnings(result) == []


def test_it_is_that_of_the_deflections_with_the_other_sign(soft):
    """Around the loops of load over deflection."""
    cycle = soft.cycle
    order = np.argsort(cycle.teeth)
    torques = cycle.torque.size
    load, gap = (
        values[..., order].transpose(0, 2, 1).reshape(torques, -1)
        for values in (cycle.load * cycle.closing, cycle.gap)
    )
    ste = np.tile(cycle.ste, order.size)
    deflection = np.where(load > 0.0, ste - gap, 0.0)
    loops = 0.5 * (
        load[:, :-1] * deflection[:, 1:] - load[:, 1:] * deflection[:, :-1]
    ).sum(axis=1)
    base_pitch = soft.problem.pair.base_pitch
    by_loops = -loops / (cycle.mesh_force[:, 0] * base_pitch)
    by_gaps = work_on_gaps(cycle, base_pitch, 1)
    np.testing.assert_allclose(by_loops, by_gaps, rtol=0.05, atol=1e-5)


def test_it_grows_with_the_deflection_and_changes_sign_with_the_soft_gear(soft):
    base_pitch = soft.problem.pair.base_pitch
    works = work_on_gaps(soft.cycle, base_pitch, 1)
    assert (np.diff(works) > 0.0).all()
    other = solved({"gear.1.young_modulus_GPa": 3})
    assert (work_on_gaps(other.cycle, base_pitch, 1) < 0.0).all()


@pytest.mark.parametrize("factor", [0.995, 1.002, 1.005])
def test_an_error_of_the_moment_arms_is_still_a_warning(soft, factor):
    wrong = replace(soft.cycle, driven_torque=factor * soft.cycle.driven_torque)
    (line,) = table_warnings(replace(soft, cycle=wrong))
    assert "works of both torques over the cycle are off by" in line


def test_more_work_than_deflections_can_do_is_a_warning(soft):
    """Gaps 20 times as wide, and moment arms that agree with them."""
    gap = np.where(soft.cycle.load > 0.0, 20.0 * soft.cycle.gap, soft.cycle.gap)
    wide = replace(soft.cycle, gap=gap)
    base_pitch = soft.problem.pair.base_pitch
    more, less = (work_on_gaps(c, base_pitch, 1) for c in (wide, soft.cycle))
    agreeing = soft.cycle.driven_torque * (1.0 + more - less)[:, None]
    wrong = replace(soft, cycle=replace(wide, driven_torque=agreeing))
    (line,) = table_warnings(wrong)
    assert "works of loads on gaps and of deflection over the cycle are off" in line
