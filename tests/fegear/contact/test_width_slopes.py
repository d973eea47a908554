"""Slopes by changes of the flanks, where loads vary over the width."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sliced_pairs import WIDTH, problem, slope

from fegear.contact.solve import solve_cycle
from fegear.contact.width.supports import MOTIONS, AxisSupports, GearSupport
from fegear.contact.width.torsion import BodyTorsion
from fegear.gearset.modifications import LEAD_SIZES, FlankLead, FlankProfile, Relief


def twisting(contact):
    """The contact of gears that twist, on axes that are held."""
    torsion = BodyTorsion(np.array([-0.5, 0.5]) * WIDTH, np.array([0.0, 5e-6]))
    gear = GearSupport(np.zeros((MOTIONS, MOTIONS)), np.zeros(MOTIONS), torsion)
    solver = replace(contact.solver, supports=AxisSupports(gear, gear))
    return replace(contact, solver=solver)


TORQUES, PLACES = [80.0, 200.0], np.arange(4) / 4.0 + 0.05
CASES = {
    "straight": lambda: problem(gap=slope(8e-6)),
    "helical": lambda: problem(18.0),
    "friction": lambda: problem(18.0, gap=slope(8e-6), friction=0.05),
}
LEAD_CASES = CASES | {"twisting": lambda: twisting(problem(18.0))}
GEARS = "driver", "driven"


def with_tip_reliefs(contact, sizes):
    """Magnitude [m] and start before the tip [base pitches] of both gears."""
    pair, flanks = contact.pair, {}
    for role, (magnitude, length) in zip(GEARS, sizes, strict=True):
        tip = getattr(pair, role).tip_roll_length
        start = tip - length * pair.base_pitch
        relief = Relief(magnitude=magnitude, start_roll_length=start, shape="parabolic")
        flanks[role] = replace(getattr(contact, role), tip_relief=relief)
    return replace(contact, **flanks)


def errors(contact):
    return solve_cycle(contact, TORQUES, PLACES).ste


@pytest.mark.parametrize("kind", CASES)
def test_slopes_are_those_of_two_solutions(kind):
    """To what is left out: places of contact move with the flank, 3 % of the slope."""
    contact, sizes = CASES[kind](), np.array([[6e-6, 0.4], [5e-6, 0.3]])
    solved = solve_cycle(with_tip_reliefs(contact, sizes), TORQUES, PLACES, 0, True)
    steps = 1e-8, 1e-5
    pitch = contact.pair.base_pitch
    for gear, size in np.ndindex(2, 2):
        step = np.zeros((2, 2))
        step[gear, size] = steps[size]
        above, below = (
            errors(with_tip_reliefs(contact, sizes + sign * step)) for sign in (1, -1)
        )
        expected = (above - below) / (2.0 * steps[size])
        ours = solved.relief_slope[:, :, gear, 0, size] * (1.0, -pitch)[size]
        assert np.abs(ours - expected).max() < 0.03 * np.abs(expected).max()


def test_slopes_by_profiles_are_those_of_two_solutions():
    contact, step = CASES["helical"](), 1e-8

    def with_profile(**sizes):
        driver = replace(contact.driver, profile=FlankProfile(**sizes))
        return replace(contact, driver=driver)

    sizes = {"crowning": 4e-6, "slope": -3e-6}
    solved = solve_cycle(with_profile(**sizes), TORQUES, PLACES, 0, True)
    for i, name in enumerate(sizes):
        above, below = (
            errors(with_profile(**{**sizes, name: sizes[name] + sign * step}))
            for sign in (1, -1)
        )
        expected = (above - below) / (2.0 * step)
        ours = solved.profile_slope[:, :, 0, i]
        assert np.abs(ours - expected).max() < 0.03 * np.abs(expected).max()
    assert (solved.profile_slope[:, :, 1] == 0.0).all()


@pytest.mark.parametrize("kind", LEAD_CASES)
def test_slopes_by_leads_are_those_of_two_solutions(kind):
    """Of the transmission error and of the loads."""
    contact = LEAD_CASES[kind]()
    sizes = {"crowning": 5e-6, "slope": -4e-6, "end_relief": 4e-6, "end_length": 6e-3}

    def solved(with_slopes=False, **changed):
        lead = FlankLead(**{**sizes, **changed})
        driven = replace(contact.driven, lead=lead)
        problem = replace(contact, driven=driven)
        return solve_cycle(problem, TORQUES, PLACES, 0, with_slopes)

    middle = solved(with_slopes=True)
    for i, name in enumerate(LEAD_SIZES):
        step = 1e-5 if name == "end_length" else 1e-8
        above, below = (solved(**{name: sizes[name] + s * step}) for s in (1, -1))
        for ours, of in (
            (middle.lead_slope[:, :, 1, i], lambda cycle: cycle.ste),
            (middle.face.load_change[..., i], lambda cycle: cycle.face.load),
        ):
            expected = (of(above) - of(below)) / (2.0 * step)
            assert np.abs(ours - expected).max() < 0.01 * np.abs(expected).max()
    assert not middle.lead_slope[:, :, 0].any()


def test_nothing_is_kept_that_was_not_asked_for():
    contact = with_tip_reliefs(CASES["straight"](), [[6e-6, 0.4], [5e-6, 0.3]])
    solved = solve_cycle(contact, TORQUES[:1], PLACES[:2])
    assert solved.relief_slope.shape == (1, 0, 2, 2, 2)
    assert solved.face.load_change.size == 0
