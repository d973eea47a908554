"""Tooth pairs in the time history of the coupled model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fegear.statics.solving import solve_mesh
from fegear.train.coupled import contacts_from_load_curves
from lumped import TrainError, respond
from lumped.steady.motion import sweep_to_speed, time_history
from lumped.train.table import pair_names, pair_teeth

PINION, WHEEL = (0.0, 3e-6), (1e-6, -2e-6, 0.5e-6, 2e-6, -1e-6)  # repeated around
ERRORS = (PINION * 19, WHEEL * 11)
SLOW = 20.0  # Hz, where only the change of stiffness itself still excites vibration


def coupled(case):
    contacts = contacts_from_load_curves(
        case.gear_set, case.reference, case.laws, case.settings
    )
    return replace(case.reference, contacts=contacts)


@pytest.fixture(scope="module")
def slow(case_of):
    return time_history(coupled(case_of("liu-pair")), SLOW)


@pytest.fixture(scope="module")
def uneven(case_of):
    """Tooth pairs that repeat after ten mesh cycles."""
    return time_history(coupled(case_of("liu-pair", errors=ERRORS)), SLOW)


@pytest.fixture(scope="module")
def lost(case_of):
    """Little load on the upper branch of the resonance."""
    system = coupled(case_of("liu-pair", torque=10.0, backlash=1e-6, damping=0.01))
    return time_history(system, 2600.0, state=sweep_to_speed(system, 3600.0, 2600.0))


@pytest.fixture(scope="module")
def shifted(case_of):
    """Two meshes, the second at another position of its cycle."""
    edits = (("mesh.2.phase", -0.4),)
    return time_history(coupled(case_of("liu-idler", edits=edits)), 2000.0)


@pytest.mark.parametrize("name", ["slow", "lost", "shifted"])
def test_forces_of_the_pairs_add_up_to_that_of_the_mesh(name, request):
    motion = request.getfixturevalue(name)
    for m, pairs in enumerate(motion.pairs):
        total = motion.history.force[:, m]
        np.testing.assert_allclose(pairs.force.sum(axis=1), total, atol=1e-9)
        np.testing.assert_array_equal(np.sign(pairs.force), pairs.state)
        assert set(pairs.count) == {1, 2}


@pytest.mark.parametrize(("motion", "errors"), [("slow", ()), ("uneven", ERRORS)])
def test_slow_motion_has_the_load_sharing_of_the_static_table(
    motion, errors, case_of, request
):
    """Within the vibration that is left at 20 Hz: 0.6 % of the load, 1.1 % where teeth
    that stand out come into contact, and 0.04 % on average."""
    slow_motion = request.getfixturevalue(motion)
    case = case_of("liu-pair", errors=errors)
    settings = replace(case.settings, positions=64, estimate_error=False)
    table = solve_mesh(case.gear_set, 1, [100.0], settings).table
    gear = case.gear_set.meshes[0].pair.driver
    shares = dict(zip(pair_teeth(table), pair_names(table, "load_share"), strict=True))
    assert sorted(shares) == [-1, 0]
    error = []
    for p, k in enumerate(sorted(shares)):
        static = np.nan_to_num(table[shares[k]][0]) * 100.0 / gear.base_radius
        position = SLOW * slow_motion.history.time
        force = np.interp(table.position, position, slow_motion.pairs[0].force[:, p])
        error.append(np.abs(force - static) * gear.base_radius / 100.0)
    assert np.max(error) < 0.015
    assert np.mean(error) < 0.001


def test_pairs_take_the_place_of_those_ahead_at_the_pitch_point(shifted):
    """A tooth pair's force goes on smoothly where it is counted anew."""
    motion, pairs = shifted, shifted.pairs[1]
    position = (-0.4 + 1e-9 + 2000.0 * motion.history.time) % 1.0
    (turn,) = np.flatnonzero(np.diff(position) < -0.5)
    before, after = pairs.force[turn], pairs.force[turn + 1]
    step = np.abs(np.diff(pairs.force, axis=0)).max(axis=1)
    assert after[1] == pytest.approx(before[0], abs=np.median(step) * 3.0)
    # the mesh is at its pitch point, where one pair carries
    assert before[1] == 0.0
    assert after[0] == 0.0


def test_engaged_is_the_nominal_path_of_contact(lost, slow):
    for motion in (lost, slow):
        ratio = 1.504
        conditions = motion.pairs[0].conditions
        assert sum(conditions.values()) == pytest.approx(ratio - 1.0, abs=1e-3)


def test_states_last_as_long_as_the_response_says(lost):
    pairs, response = lost.pairs[0], lost.response
    step = np.diff(lost.history.time) / lost.history.time[-1]
    is_separated = (pairs.state == 0).all(axis=1)[:-1]
    assert (is_separated * step).sum() == pytest.approx(
        response.contact_loss[0], abs=0.03
    )
    behind = (pairs.state == -1).any(axis=1)[:-1]
    assert response.back_side[0] > 0.1
    assert (behind * step).sum() == pytest.approx(response.back_side[0], abs=0.03)
    assert {"I", "III", "back"} <= set(pairs.conditions)


def test_corners_carry_before_the_nominal_path(slow):
    """Under load teeth touch early: with a force, though not yet engaged."""
    pairs = slow.pairs[0]
    beyond = (pairs.state == 1) & ~pairs.engaged
    assert 0.05 < beyond.any(axis=1).mean() < 0.5
    assert pairs.in_mesh[beyond].all()


def test_a_motion_that_memory_cannot_hold_is_refused_with_its_length(case_of):
    rng = np.random.default_rng(2)
    errors = tuple(tuple(rng.uniform(-1e-6, 1e-6, z).tolist()) for z in (38, 55, 94))
    system = coupled(case_of("liu-idler", errors=errors))
    with pytest.raises(TrainError, match=r"98230 periods .* GB of motion, .* allowed"):
        respond(system, 1600.0)
    assert coupled(case_of("liu-idler")).fits_memory(64)
