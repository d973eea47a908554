"""Pairs solved alone, and coupled, against all pairs solved together."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from changed_flanks import with_flanks
from contact_at import contact_at
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator
from scipy.optimize import root

from fegear.contact.pair_load_curves import NOMINAL, REVERSED, pair_load_curves
from fegear.contact.pairs import back_side_position
from fegear.contact.plane.contact import PlaneContact
from fegear.gearset.modifications import Relief

POSITION = np.arange(32) / 32
DEPTH = 9e-6  # m, about that of 100 N m
REACH = 50e-6
CASES = ("plain", "relieved", "friction")
SIDES = ("driver", "driven")


class Problems:
    """Contact problems by name and their laws; pytest prints no arrays of these."""

    def __init__(self, problems):
        self._problems = problems
        self.laws = cache(
            lambda name: pair_load_curves(problems[name], POSITION, REACH)
        )

    def __getitem__(self, name):
        return self._problems[name]


@pytest.fixture(scope="session")
def cases(problem):
    tips = {
        side: replace(
            getattr(problem, side),
            tip_relief=Relief(
                magnitude=8e-6,
                start_roll_length=0.85 * tip_roll(getattr(problem.pair, side)),
                shape="parabolic",
            ),
        )
        for side in SIDES
    }
    return Problems(
        {
            "plain": problem,
            "relieved": replace(problem, **tips),
            "friction": replace(problem, friction=0.1),
        }
    )


def tip_roll(gear):
    return np.sqrt(gear.tip_radius**2 - gear.base_radius**2)


def together(laws, problem, approach):
    """Loads (n, k) of coupled pairs at approaches (n,)."""
    loads = np.zeros(laws.gap.shape)
    for n, depth in enumerate(approach):
        law = PchipInterpolator(laws.penetration, laws.load[n, :, NOMINAL], axis=1)
        drag = problem.friction * laws.sliding_sign[n]
        compliance = laws.normal_compliance[n] + laws.tangential_compliance[n] * drag
        closing = laws.moment_arms[n, :, 0] / problem.pair.driver.base_radius
        free = depth * closing - laws.gap[n]

        def load(squeeze, law=law):
            return np.diagonal(law(np.clip(squeeze, 0.0, REACH))).copy()

        def error(squeeze, load=load, compliance=compliance, free=free):
            return (squeeze + compliance @ load(squeeze) - free) / DEPTH

        solution = root(error, free, options={"xtol": 1e-12})
        assert np.abs(error(solution.x)).max() < 1e-9
        loads[n] = load(solution.x)
    return loads


def difference(problem, scale=1.0):
    """Of the total load to that of all pairs at once, over its mean (n,)."""
    laws = pair_load_curves(problem, POSITION, REACH)
    approach = np.full(POSITION.size, scale * DEPTH)
    total_load = together(laws, problem, approach).sum(axis=1)
    exact = contact_at(problem, POSITION, approach).load.sum(axis=1)
    return (total_load - exact) / exact.mean()


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("scale", [0.3, 1.0, 3.0])
def test_coupled_laws_are_the_whole_contact(cases, case, scale):
    error = np.abs(difference(cases[case], scale))
    assert np.median(error) < 2e-4
    assert error.max() < 2e-3


def test_each_pair_carries_its_own_load(cases):
    problem = cases["plain"]
    laws, approach = cases.laws("plain"), np.full(POSITION.size, DEPTH)
    loads = together(laws, problem, approach)
    exact = contact_at(problem, POSITION, approach)
    assert ((loads > 0.0).sum(axis=1) == 2).any()
    for column, tooth in enumerate(laws.pair_offsets):
        pair_load = exact.load[:, exact.teeth == tooth].sum(axis=1)
        np.testing.assert_allclose(
            loads[:, column],
            pair_load,
            atol=3e-3 * exact.load.max(),
            err_msg=str(tooth),
        )


def test_difference_shrinks_with_the_patches(cases):
    """It is the discretisation of the whole contact, where a corner comes in.

    What is left at large loads is from the coupling of corners to other pairs.
    """
    largest = []
    for nodes in (25, 49, 97):
        problem = replace(cases["plain"], solver=PlaneContact(nodes=nodes))
        errors = [difference(problem, scale) for scale in (0.3, 1.0, 3.0)]
        largest.append(np.abs(errors).max())
    for coarse, fine in pairwise(largest):
        assert fine < coarse
    assert largest[0] < 2e-4


@pytest.mark.parametrize("case", CASES)
def test_loads_grow_from_nothing(cases, case):
    laws = cases.laws(case)
    assert (laws.load[..., 0] == 0.0).all()
    assert (laws.load >= 0.0).all()
    facing = laws.gap < 1e-3
    assert (np.diff(laws.load[facing], axis=-1) > 0.0).all()
    assert (laws.load[~facing] == 0.0).all()
    # contact stiffens as it grows
    slope = np.diff(laws.load[facing], axis=-1) / np.diff(laws.penetration)
    assert (np.diff(slope, axis=-1) > -1e-3 * slope.max()).all()


def test_reversed_friction_has_the_opposite_effect(cases):
    laws = cases.laws("friction")
    nominal, reversed_load = laws.load[:, :, NOMINAL], laws.load[:, :, REVERSED]
    assert np.abs(nominal - reversed_load).max() > 1e-3 * nominal.max()
    plain = cases.laws("plain").load[:, :, NOMINAL]
    between = 0.5 * (nominal + reversed_load)
    np.testing.assert_allclose(between, plain, atol=2e-3 * plain.max())


@pytest.mark.parametrize("case", CASES)
def test_back_side_is_the_drive_side_of_the_mirrored_mesh(cases, case):
    problem = cases[case]
    back = pair_load_curves(problem, POSITION, REACH, back=True)
    mirror = pair_load_curves(
        problem, back_side_position(problem.pair, POSITION), REACH
    )
    order = [list(mirror.pair_offsets).index(-tooth) for tooth in back.pair_offsets]
    for name in ("gap", "moment_arms", "arc", "load", "pressure"):
        one, other = getattr(back, name), getattr(mirror, name)[:, order]
        np.testing.assert_array_equal(one, other, err_msg=name)
    # the same laws are passed through, in another order
    assert back.load.max() == pytest.approx(cases.laws(case).load.max(), rel=0.02)


def test_back_side_carries_what_contact_at_finds_there(cases):
    problem = cases["plain"]
    back = pair_load_curves(problem, POSITION, REACH, back=True)
    depth = np.full(POSITION.size, DEPTH)
    loads = together(back, problem, depth)
    exact = contact_at(problem, POSITION, -problem.pair.backlash - depth)
    error = np.abs(-loads.sum(axis=1) / exact.load.sum(axis=1) - 1.0)
    assert np.median(error) < 2e-4
    assert error.max() < 2e-3


def test_twice_the_width_carries_twice_the_load(cases):
    one, problem = cases.laws("friction"), cases["friction"]
    wide = replace(problem, face_width=2.0 * problem.face_width)
    two = pair_load_curves(wide, POSITION, REACH)
    np.testing.assert_allclose(two.load, 2.0 * one.load, rtol=1e-9)
    np.testing.assert_allclose(
        two.normal_compliance, 0.5 * one.normal_compliance, rtol=1e-9
    )
    np.testing.assert_allclose(two.pressure, one.pressure, rtol=1e-9)


def test_coupling_is_mutual(cases):
    """Maxwell's theorem; a pair's own compliance is in its law."""
    normal = cases.laws("plain").normal_compliance
    size = np.abs(normal).max()
    assert size > 0.0
    np.testing.assert_allclose(normal, normal.transpose(0, 2, 1), atol=1e-3 * size)
    assert (np.diagonal(normal, axis1=1, axis2=2) == 0.0).all()


@given(
    magnitude=st.floats(1e-6, 30e-6),
    begin=st.floats(0.6, 0.95),
    shape=st.sampled_from(["linear", "parabolic"]),
    side=st.sampled_from(SIDES),
    scale=st.floats(0.2, 3.0),
)
@settings(max_examples=8, deadline=None, derandomize=True)
def test_any_relief(cases, magnitude, begin, shape, side, scale):
    problem = cases["plain"]
    start = begin * tip_roll(getattr(problem.pair, side))
    relief = Relief(magnitude=magnitude, start_roll_length=start, shape=shape)
    relieved = with_flanks(problem, **{f"{side}_tip_relief": relief})
    error = np.abs(difference(relieved, scale))
    assert np.median(error) < 5e-4
    assert error.max() < 5e-3


def test_curves_of_equal_teeth_are_solved_once(cases):
    plain = cases["plain"]
    compliance = plain.driver.compliance
    assert compliance.origin is not None
    first = pair_load_curves(plain, POSITION[:2], REACH)
    # another problem of the same teeth, whose arrays are others
    copied = replace(compliance, normal=compliance.normal.copy())
    flank = replace(plain.driver, compliance=copied)
    again = pair_load_curves(replace(plain, driver=flank), POSITION[:2], REACH)
    assert again is first
    with_errors = with_flanks(
        plain, driver_pitch_errors=(1e-6,) * plain.pair.driver.teeth
    )
    assert pair_load_curves(with_errors, POSITION[:2], REACH) is first


@pytest.mark.parametrize(
    "change",
    [
        {"friction": 0.1},
        {"face_width": 0.03},
        {"corner_contact": False},
        {"solver": PlaneContact(nodes=15)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_curves_of_others_are_their_own(cases, change):
    plain = cases["plain"]
    first = pair_load_curves(plain, POSITION[:2], REACH)
    other = pair_load_curves(replace(plain, **change), POSITION[:2], REACH)
    assert other is not first
    assert not np.array_equal(other.load, first.load) or "corner_contact" in change
    compliance = replace(plain.driver.compliance, origin=None)
    free = with_flanks(plain, driver_compliance=compliance)
    assert pair_load_curves(free, POSITION[:2], REACH) is not first
