"""Contact with the approach given: the inverse of contact with the torque given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from changed_flanks import with_flanks
from contact_at import contact_at

from fegear.contact.solve import solve_cycle

POSITIONS = np.arange(16) / 16


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_the_approach_of_a_torque_gives_the_torque(problem, friction):
    problem = replace(problem, friction=friction)
    cycle = solve_cycle(problem, [100.0], POSITIONS)
    contact = contact_at(problem, POSITIONS, cycle.ste[0])
    # patches are laid by another guess, which corner contact feels
    np.testing.assert_allclose(contact.torque, 100.0, rtol=3e-3)
    assert np.median(np.abs(contact.torque / 100.0 - 1.0)) < 2e-4
    np.testing.assert_allclose(contact.slope, cycle.local_stiffness[0], rtol=2e-2)


def test_slope_is_that_of_the_force(problem):
    x = np.full(3, 0.5)
    d = 6e-6 + np.array([-1e-8, 0.0, 1e-8])
    contact = contact_at(problem, x, d)
    force = contact.torque / problem.pair.driver.base_radius
    assert contact.slope[1] == pytest.approx((force[2] - force[0]) / 2e-8, rel=1e-3)


def test_nothing_touches_within_the_backlash(problem):
    lash = problem.pair.backlash
    assert lash > 0.0
    inside = np.linspace(-0.99, -0.01, POSITIONS.size) * lash
    contact = contact_at(problem, POSITIONS, inside)
    assert not contact.load.any()
    assert not contact.torque.any()
    assert not contact.slope.any()


def test_back_side_mirrors_the_drive_side(problem):
    cycle = solve_cycle(problem, [-100.0], POSITIONS)
    contact = contact_at(problem, POSITIONS, cycle.ste[0])
    np.testing.assert_allclose(contact.torque, -100.0, rtol=3e-3)
    assert (contact.load <= 0.0).all()


def test_position_counts_on_and_on(problem):
    d = np.full(POSITIONS.size, 8e-6)
    one, two = (contact_at(problem, POSITIONS + n, d) for n in (0.0, 17.0))
    np.testing.assert_allclose(one.torque, two.torque, rtol=1e-9)


def test_pitch_errors_pass_by(problem):
    teeth = problem.pair.driver.teeth
    errors = tuple(2e-6 if tooth == 3 else 0.0 for tooth in range(teeth))
    uneven = with_flanks(problem, driver_pitch_errors=errors)
    d = np.full(teeth, 8e-6)
    contact = contact_at(uneven, np.arange(teeth) + 0.0, d)
    even = contact_at(problem, np.arange(teeth) + 0.0, d)
    differs = np.flatnonzero(np.abs(contact.torque / even.torque - 1.0) > 1e-9)
    assert differs.tolist() == [3]


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_must_be_finite(problem, value):
    with pytest.raises(ValueError, match="must be finite"):
        contact_at(problem, [0.0], [value])


def test_shapes_must_agree(problem):
    with pytest.raises(ValueError, match="must have shape"):
        contact_at(problem, [0.0, 0.5], [1e-6])
