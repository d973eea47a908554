"""Load on rolling elements: Stribeck, Harris's table, equilibrium, stiffness."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lumped.bearings.kinematics import (
    ball_pass_over_shaft,
    cage_over_shaft,
    element_spin_over_shaft,
    inner_ball_pass_over_shaft,
)
from lumped.bearings.load_integral import load_integral, max_element_load
from lumped.bearings.rolling import BallBearing, RollerBearing, Waviness
from lumped.bearings.statics import RingSupport, load_distribution, mean_support

BALL = BallBearing(balls=9, element_diameter=7.94e-3, pitch_diameter=38.5e-3)
ROLLER = RollerBearing(
    rollers=13, element_diameter=7.5e-3, pitch_diameter=39e-3, length=7.5e-3
)
# Harris (2007), table 7.1
ZONES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
OF_POINTS = (
    *(0.1156, 0.1590, 0.1892, 0.2117, 0.2288),
    *(0.2416, 0.2505, 0.2559, 0.2576, 0.2546),
)
OF_LINES = (
    *(0.1268, 0.1737, 0.2055, 0.2286, 0.2453),
    *(0.2568, 0.2636, 0.2658, 0.2628, 0.2523),
)


@pytest.mark.parametrize("bearing", [BALL, ROLLER], ids=["ball", "roller"])
def test_load_integrals_are_those_of_the_table(bearing):
    table = OF_POINTS if bearing is BALL else OF_LINES
    # the table has rounded exponents of its rollers, 1.11
    exponent = 1.5 if bearing is BALL else 1.11
    values = [load_integral(zone, exponent) for zone in ZONES]
    np.testing.assert_allclose(values, table, rtol=3e-3)


def test_the_number_of_stribeck():
    assert 1.0 / load_integral(0.5, 1.5) == pytest.approx(4.37, abs=1e-2)
    assert 1.0 / load_integral(0.5, 10.0 / 9.0) == pytest.approx(4.08, abs=1e-2)


def test_without_clearance_the_integral_is_a_beta_function():
    for n in (1.5, 10.0 / 9.0):
        beta = math.gamma(0.5) * math.gamma(0.5 * n + 1.0) / math.gamma(0.5 * n + 1.5)
        assert load_integral(0.5, n) == pytest.approx(beta / (2.0 * math.pi), rel=1e-10)


def test_a_6205_bearing_under_1_kN():
    largest = load_distribution(BALL, (1000.0, 0.0)).loads.max()
    assert largest == pytest.approx(4.37 * 1000.0 / 9.0, rel=0.01)
    assert largest == pytest.approx(max_element_load(BALL, 1000.0), rel=0.01)
    # five elements by hand: cos^(5/2) of 0, 40 and 80 degrees
    total = sum(math.cos(math.radians(a)) ** 2.5 for a in (0, 40, 40, 80, 80))
    assert largest == pytest.approx(1000.0 / total, rel=1e-9)


@pytest.mark.parametrize("bearing", [BALL, ROLLER], ids=["ball", "roller"])
@pytest.mark.parametrize("clearance", [-8e-6, -1e-6, 0.0, 2e-6, 10e-6, 30e-6])
def test_many_elements_approach_the_load_integral(bearing, clearance):
    """The sum over elements tends to the integral at least as 1 / number."""
    count = {"balls": 400} if bearing is BALL else {"rollers": 400}
    small = replace(
        bearing,
        **count,
        element_diameter=1e-4,
        clearance=clearance,
        contact_stiffness=bearing.coefficient * bearing.elements / 400,
    )
    largest = load_distribution(small, (1000.0, 0.0)).loads.max()
    assert largest == pytest.approx(max_element_load(small, 1000.0), rel=1e-3)


def test_clearance_raises_the_largest_load_to_stribecks_five():
    """Some 5 times the mean with usual clearance, all of the load with much."""
    clearances = (0.0, 5e-6, 10e-6, 15e-6, 1e-3)
    loads = [
        max_element_load(replace(BALL, clearance=c), 1000.0) * 9.0 / 1000.0
        for c in clearances
    ]
    assert (np.diff(loads) > 0.0).all()
    assert loads[3] == pytest.approx(5.0, rel=0.01)
    alone = load_distribution(replace(BALL, clearance=9e-3), (1000.0, 0.0))
    assert (alone.loads > 0.0).sum() == 1
    assert alone.loads.max() == pytest.approx(1000.0, rel=1e-9)


cases = st.fixed_dictionaries(
    {
        "clearance": st.floats(-20e-6, 60e-6),
        "runout": st.floats(0.0, 10e-6),
        "film_thickness": st.floats(0.0, 2e-6),
        "waves": st.lists(
            st.builds(
                Waviness,
                order=st.integers(1, 20),
                amplitude=st.floats(0.0, 3e-6),
                phase=st.floats(-4.0, 4.0),
                inner=st.booleans(),
            ),
            max_size=2,
        ).map(tuple),
    }
)


@settings(max_examples=40)
@given(
    bearing=st.sampled_from([BALL, ROLLER]),
    changes=cases,
    load=st.floats(1.0, 2e4),
    direction=st.floats(-math.pi, math.pi),
    cage=st.floats(-10.0, 10.0),
)
def test_elements_balance_any_load(bearing, changes, load, direction, cage):
    bearing = replace(bearing, **changes)
    force = load * math.cos(direction), load * math.sin(direction)
    state = load_distribution(bearing, force, cage)
    normals = np.stack([np.cos(state.angles), np.sin(state.angles)])
    np.testing.assert_allclose(normals @ state.loads, force, atol=2e-6 * load)
    assert (state.loads >= 0.0).all()
    assert ((state.loads > 0) == (state.approaches > 0)).all()
    np.testing.assert_allclose(
        state.stiffness, state.stiffness.T, atol=1e-9 * state.stiffness.max()
    )
    assert np.linalg.eigvalsh(state.stiffness).min() >= -1e-9 * state.stiffness.max()


@settings(max_examples=40)
@given(
    bearing=st.sampled_from([BALL, ROLLER]),
    changes=cases,
    x=st.floats(-4e-5, 4e-5),
    y=st.floats(-4e-5, 4e-5),
    cage=st.floats(-10.0, 10.0),
)
def test_force_and_stiffness_are_derivatives_of_the_energy(
    bearing, changes, x, y, cage
):
    support = RingSupport(replace(bearing, **changes), cage)
    u, step = np.array([x, y]), 1e-9
    by_energy = [
        (support.energy(u + step * e) - support.energy(u - step * e)) / (2.0 * step)
        for e in np.eye(2)
    ]
    scale = float(support.loads(support.approaches(u)).sum())
    np.testing.assert_allclose(support.force(u), by_energy, atol=1e-5 * scale + 1e-3)


def test_the_tangent_is_the_slope_of_the_force():
    bearing = replace(BALL, clearance=10e-6, runout=2e-6)
    state = load_distribution(bearing, (700.0, -300.0), 0.3)
    support, step = RingSupport(bearing, 0.3), 1e-10
    columns = [
        (
            support.force(state.displacement + step * e)
            - support.force(state.displacement - step * e)
        )
        / (2.0 * step)
        for e in np.eye(2)
    ]
    np.testing.assert_allclose(state.stiffness, np.array(columns).T, rtol=1e-6)


def test_stiffness_of_many_balls_follows_power_laws():
    """Without clearance F = c r^n: 1.5 F / r along the load, F / r across it."""
    support = mean_support(BALL, 1000.0)
    secant = 1000.0 / support.displacement
    assert support.along == pytest.approx(1.5 * secant, rel=2e-3)
    assert support.across == pytest.approx(secant, rel=8e-3)
    heavier = mean_support(BALL, 8000.0)
    assert heavier.along / support.along == pytest.approx(2.0, rel=1e-9)


def test_preloaded_elements_are_springs():
    """All in contact: half of n k delta^(n - 1) per element in every direction."""
    tight = replace(BALL, clearance=-200e-6)
    support = mean_support(tight, 1.0)
    expected = 0.5 * 9 * 1.5 * tight.coefficient * math.sqrt(100e-6)
    assert support.along == pytest.approx(expected, rel=1e-6)
    assert support.across == pytest.approx(expected, rel=1e-6)
    assert support.variation < 1e-6


def test_a_film_is_a_smaller_clearance():
    film = replace(BALL, clearance=10e-6, film_thickness=1e-6)
    dry = replace(BALL, clearance=6e-6)
    one, two = (load_distribution(b, (500.0, 0.0)) for b in (film, dry))
    np.testing.assert_allclose(one.loads, two.loads, rtol=1e-9, atol=1e-6)


def test_runout_shifts_the_ring():
    eccentric = replace(BALL, runout=5e-6)
    cage = 0.4
    shaft = cage / cage_over_shaft(BALL)
    one = load_distribution(eccentric, (500.0, 200.0), cage)
    two = load_distribution(BALL, (500.0, 200.0), cage)
    shift = 5e-6 * np.array([math.cos(shaft), math.sin(shaft)])
    np.testing.assert_allclose(one.displacement, two.displacement - shift, atol=1e-12)


def test_published_frequencies_of_a_6205_bearing():
    """SKF 6205-2RS JEM, as printed by Case Western Reserve University for its bearing
    data: balls of 0.3126 inches on 1.537 inches; 0.39828 cage, 3.5848 outer, 5.4152
    inner race, and 4.7135 passes of a spot on a ball, which is twice the spin."""
    bearing = BallBearing(
        balls=9, element_diameter=0.3126 * 25.4e-3, pitch_diameter=1.537 * 25.4e-3
    )
    assert cage_over_shaft(bearing) == pytest.approx(0.39828, abs=3e-5)
    assert ball_pass_over_shaft(bearing) == pytest.approx(3.5848, abs=1e-4)
    assert inner_ball_pass_over_shaft(bearing) == pytest.approx(5.4152, abs=1e-4)
    assert 2.0 * element_spin_over_shaft(bearing) == pytest.approx(4.7135, abs=3e-4)


@given(ratio=st.floats(0.05, 0.3), balls=st.integers(3, 9))
def test_rolling_without_slip(ratio, balls):
    """Speeds of both contact points of a ball, from cage and spin."""
    bearing = BallBearing(
        balls=balls, element_diameter=ratio * 40e-3, pitch_diameter=40e-3
    )
    cage, spin = cage_over_shaft(bearing), element_spin_over_shaft(bearing)
    ball = 0.5 * bearing.element_diameter
    inner, outer = (0.5 * d for d in bearing.race_diameters)
    # relative to the cage, the ball turns against the inner ring
    assert (1.0 - cage) * inner == pytest.approx(spin * ball, rel=1e-12)
    assert -cage * outer == pytest.approx(-spin * ball, rel=1e-12)
    total = ball_pass_over_shaft(bearing) + inner_ball_pass_over_shaft(bearing)
    assert total == pytest.approx(balls, rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"balls": 2}, "balls = 2; must be 3 to 1000"),
        ({"balls": 16}, "ball_diameter = .*; must be at most"),
        ({"element_diameter": 0.0}, "ball_diameter = .*; must be"),
        ({"pitch_diameter": -1.0}, "pitch_diameter = .*; must be"),
        ({"clearance": 1.0}, "clearance = .*; must be -0.01 to 0.01"),
        ({"inner_conformity": 0.5}, "inner_conformity = .*; must be"),
        ({"contact_stiffness": 0.0}, "contact_stiffness = .*; must be"),
        ({"runout": math.nan}, "runout = .*; must be"),
    ],
)
def test_wrong_bearings_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(BALL, **changes)


@pytest.mark.parametrize("load", [0.0, math.nan, math.inf])
def test_without_load_there_is_no_equilibrium(load):
    with pytest.raises(ValueError, match=r"load = .*; must be"):
        load_distribution(BALL, (load, 0.0))
