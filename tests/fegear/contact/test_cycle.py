"""Balances, limits and symmetries of the static contact over a mesh cycle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from changed_flanks import with_flanks
from conftest import make_gear
from hypothesis import given, settings
from hypothesis import strategies as st

from fegear.contact.pairs import back_side_position, pair_gaps
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.gearset.modifications import Relief
from meshes import GearPair

POSITIONS = np.arange(48) / 48
TORQUES = [50.0, 100.0, 150.0]


@pytest.fixture(scope="module")
def plain(problem):
    return solve_cycle(problem, TORQUES, POSITIONS)


def with_relief(problem: ContactProblem, magnitude: float, shape="linear"):
    """Tip relief on both gears from their highest point of single contact."""
    pair = problem.pair
    driver = pair.path_start + pair.base_pitch
    driven = pair.line_of_action - (pair.path_end - pair.base_pitch)
    return replace(
        problem,
        driver=replace(
            problem.driver,
            tip_relief=Relief(
                magnitude=magnitude, start_roll_length=driver, shape=shape
            ),
        ),
        driven=replace(
            problem.driven,
            tip_relief=Relief(
                magnitude=magnitude, start_roll_length=driven, shape=shape
            ),
        ),
    )


def test_mean_and_fluctuation_are_those_of_the_field(plain):
    k = plain.stiffness[1]
    assert 2.7e8 < k.mean() < 3.3e8
    assert 0.28 < np.ptp(k) / k.mean() < 0.40


def test_complementarity_is_met_to_roundoff(plain):
    assert plain.residual.max() < 1e-12
    assert (plain.load >= 0.0).all()


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_torques_balance_on_the_nominal_path(problem, friction):
    nominal = replace(problem, corner_contact=False, friction=friction)
    cycle = solve_cycle(nominal, TORQUES, POSITIONS)
    pair = problem.pair
    s1 = pair.pitch_point + pair.base_pitch * np.add.outer(POSITIONS, cycle.teeth)
    s2 = pair.line_of_action - s1
    drag = friction * np.where(np.isclose(s1, pair.pitch_point), 0.0, 1.0)
    drag *= np.sign(pair.pitch_point - s1)
    input_torque = (cycle.load * (pair.driver.base_radius - drag * s1)).sum(axis=2)
    output_torque = (cycle.load * (pair.driven.base_radius - drag * s2)).sum(axis=2)
    np.testing.assert_allclose(
        input_torque, np.broadcast_to(cycle.torque[:, None], input_torque.shape), 1e-12
    )
    np.testing.assert_allclose(output_torque, cycle.driven_torque, 1e-12)
    if friction == 0.0:
        ratio = cycle.driven_torque / cycle.torque[:, None]
        np.testing.assert_allclose(ratio, 55 / 38, rtol=1e-9)
        total = cycle.load.sum(axis=2) / cycle.mesh_force
        np.testing.assert_allclose(total, 1.0, rtol=1e-12)


def test_corner_contact_unbalances_torque_only_at_the_ends(problem, plain):
    error = np.abs(plain.driven_torque / plain.torque[:, None] * 38 / 55 - 1.0)
    pair = problem.pair
    s1 = pair.pitch_point + pair.base_pitch * np.add.outer(POSITIONS, plain.teeth)
    outside = (s1 < pair.path_start) | (s1 > pair.path_end)
    corner = ((plain.load > 0.0) & outside).any(axis=2)
    assert error[~corner].max() < 1e-9
    assert 1e-6 < error[corner].max() < 0.02


def test_transmission_error_tends_to_no_load_error(problem):
    relieved = with_relief(problem, 10e-6)
    cycle = solve_cycle(relieved, [1e-4, 1e-2, 1.0, 100.0], POSITIONS)
    excess = (cycle.ste - cycle.no_load).max(axis=1)
    assert (excess > 0.0).all()
    assert (np.diff(excess) > 0.0).all()
    assert excess[0] < 1e-10


def test_no_load_error_is_the_envelope_of_the_gap_functions(problem):
    relieved = replace(with_relief(problem, 10e-6), corner_contact=False)
    cycle = solve_cycle(relieved, [100.0], POSITIONS)
    pair = problem.pair
    s1 = pair.pitch_point + pair.base_pitch * np.add.outer(POSITIONS, cycle.teeth)
    inside = (s1 > pair.path_start) & (s1 < pair.path_end)

    def depth(relief, end, s):
        return relief.magnitude * np.clip(
            (s - relief.start_roll_length) / (end - relief.start_roll_length), 0, None
        )

    ends = pair.driver.tip_roll_length, pair.driven.tip_roll_length
    gap = depth(relieved.driver.tip_relief, ends[0], s1)
    gap += depth(relieved.driven.tip_relief, ends[1], pair.line_of_action - s1)
    envelope = np.where(inside, gap, np.inf).min(axis=1)
    # the closest point leaves the nominal one along the slope e' of the relief by
    # R e', which saves R e'^2 / 2
    slope = 10e-6 / (ends[0] - relieved.driver.tip_relief.start_roll_length)
    slack = 0.5 * 0.02 * (slope * pair.line_of_action / 10e-3) ** 2
    assert (cycle.no_load[0] <= envelope + 1e-15).all()
    assert (envelope - cycle.no_load[0]).max() < max(slack, 0.2e-6)


@pytest.mark.parametrize("factor", [2.0, 0.25])
def test_width_and_torque_scale_together(problem, plain, factor):
    wide = replace(problem, face_width=factor * problem.face_width)
    cycle = solve_cycle(wide, factor * np.array(TORQUES), POSITIONS)
    np.testing.assert_allclose(cycle.ste, plain.ste, rtol=1e-12)
    np.testing.assert_allclose(cycle.load, factor * plain.load, rtol=1e-9, atol=1e-9)


def test_exchanging_driver_and_driven_mirrors_the_table(problem, plain):
    swapped = replace(
        problem, pair=problem.pair.swapped, driver=problem.driven, driven=problem.driver
    )
    torque = np.array(TORQUES) * 55 / 38
    cycle = solve_cycle(swapped, torque, -POSITIONS)
    error = np.abs(plain.driven_torque / plain.torque[:, None] * 38 / 55 - 1.0)
    on_path = error < 1e-9
    at_pitch = POSITIONS == 0.0  # either flank may carry the nodes there
    for where, rtol in ((on_path & ~at_pitch, 1e-9), (on_path, 2e-6)):
        np.testing.assert_allclose(cycle.ste[where], plain.ste[where], rtol=rtol)
    # off the path the driven torque, not the mesh force, differs by the tilt
    np.testing.assert_allclose(cycle.ste, plain.ste, rtol=2e-2)


def test_a_turn_by_one_tooth_changes_nothing(problem, plain):
    cycle = solve_cycle(problem, TORQUES, POSITIONS + 3.0)
    np.testing.assert_allclose(cycle.ste, plain.ste, rtol=1e-9)
    np.testing.assert_allclose(
        cycle.load.sum(axis=2), plain.load.sum(axis=2), rtol=1e-9
    )


def test_order_of_positions_does_not_matter(problem, plain):
    shuffled = np.random.default_rng(0).permutation(POSITIONS.size)
    cycle = solve_cycle(problem, TORQUES, POSITIONS[shuffled])
    np.testing.assert_allclose(cycle.ste, plain.ste[:, shuffled], rtol=1e-11)


def test_local_stiffness_is_the_slope_of_force(problem):
    torque = np.array([99.9, 100.0, 100.1])
    cycle = solve_cycle(problem, torque, POSITIONS)
    force = cycle.mesh_force[:, 0]
    slope = (force[2] - force[0]) / (cycle.ste[2] - cycle.ste[0])
    # patches are sized by load, so that the slope of the discrete answer differs
    np.testing.assert_allclose(slope, cycle.local_stiffness[1], rtol=1e-2)
    assert np.median(np.abs(slope / cycle.local_stiffness[1] - 1.0)) < 1e-3


def test_back_side_is_the_drive_side_in_a_mirror(problem):
    position = np.array([0.1, 0.4, 0.7])
    back = solve_cycle(problem, [-100.0], position)
    front = solve_cycle(problem, [100.0], back_side_position(problem.pair, position))
    backlash = problem.pair.backlash
    np.testing.assert_allclose(back.ste, -(backlash + front.ste))
    assert (back.driven_torque < 0.0).all()
    assert (back.stiffness > 0.0).all()


def test_pitch_errors_delay_their_own_pairs(problem):
    errors = tuple(5e-6 if tooth == 0 else 0.0 for tooth in range(38))
    late = with_flanks(problem, driver_pitch_errors=errors)
    teeth = np.array([0, -1, 1])
    np.testing.assert_array_equal(pair_gaps(late, teeth), [5e-6, 0.0, 0.0])
    one, other = (solve_cycle(p, [100.0], [0.4]) for p in (problem, late))
    assert other.load[0, 0, 0] < one.load[0, 0, 0]
    single = solve_cycle(late, [100.0], [0.0]).no_load
    np.testing.assert_allclose(single, 5e-6, rtol=1e-9)


def test_friction_stiffens_in_approach_and_softens_in_recess(problem):
    position = [-0.2, 0.2]
    nominal = replace(problem, corner_contact=False)
    dry = solve_cycle(replace(nominal, friction=0.1), [100.0], position)
    smooth = solve_cycle(nominal, [100.0], position)
    ratio = dry.pair_stiffness[0, :, 0] / smooth.pair_stiffness[0, :, 0]
    beta = smooth.friction_bending[0, :, 0]
    np.testing.assert_allclose(ratio, 1.0 + 0.1 * beta * [1.0, -1.0], rtol=1e-2)


@settings(max_examples=25, deadline=None)
@given(
    torque=st.floats(1e-3, 3e3),
    position=st.floats(-2.0, 2.0),
    friction=st.floats(0.0, 0.3),
    relief=st.floats(0.0, 40e-6),
    shape=st.sampled_from(["linear", "parabolic"]),
    corner=st.booleans(),
)
def test_any_load_is_carried(
    problem, torque, position, friction, relief, shape, corner
):
    case = with_relief(problem, relief, shape) if relief > 1e-9 else problem
    case = replace(case, friction=friction, corner_contact=corner)
    cycle = solve_cycle(case, [torque], [position])
    assert cycle.residual.max() < 1e-9
    assert cycle.ste[0, 0] > cycle.no_load[0, 0]
    assert np.isfinite(cycle.local_stiffness).all()
    arm = cycle.load.sum() * problem.pair.driver.base_radius / torque
    assert 0.8 < arm < 1.25


def test_corners_far_off_the_path_do_not_touch():
    """Few teeth: beyond the mate's involute a corner has no flank to meet."""
    gear = make_gear(17, 7.6e-3, profile_shift=0.1, tip_radius=24.4e-3)
    pair = GearPair(gear, gear, 43.95e-3)
    flank = cached_flank_compliance(gear, PlaneMaterial(206e9, 0.3))
    case = ContactProblem(
        pair=pair,
        driver=ContactFlank(compliance=flank),
        driven=ContactFlank(compliance=flank),
        face_width=0.02,
    )
    cycle = solve_cycle(case, [20.0], np.arange(16) / 16)
    assert (cycle.no_load > -1e-12).all()
    np.testing.assert_allclose(cycle.ste[0, 1:], cycle.ste[0, :0:-1], 1e-2)


@pytest.mark.parametrize(
    ("torques", "positions", "message"),
    [
        ([0.0], [0.0], "not zero"),
        ([np.nan], [0.0], "finite"),
        ([1.0, -1.0], [0.0], "one sign"),
        ([1.0], [np.inf], r"positions = .*; must be finite"),
    ],
)
def test_bad_input_is_named(problem, torques, positions, message):
    with pytest.raises(ValueError, match=message):
        solve_cycle(problem, torques, positions)
