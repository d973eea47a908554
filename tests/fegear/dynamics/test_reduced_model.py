"""Statics of the dynamic model, teeth counted anew, and trains in a mirror."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import fegear.statics.solving as statics
from fegear.contact.solve import solve_cycle
from fegear.dynamics.kernels import reduced as kernel
from fegear.dynamics.stepper import MotionState, TimeSteps
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.statics.contact_problem import contact_problem
from fegear.statics.settings import Resolution, StaticsSettings
from lumped import LumpedSystem, Train
from meshes import MeshSize

HELD = 1e7  # N m/rad, holds the driven gear
CUTOFF = 30e3  # Hz
POSITIONS = 64
CYCLE = 128  # positions of the laws


@cache
def static_error(case_of, track, *, relief=0.0, resolution="default", cutoff=None):
    """Deflection at rest over that of the contact problem, less 1, over a cycle."""
    case = case_of(relief=relief, held=HELD, resolution=resolution)
    level = statics.RESOLUTIONS[resolution]
    problem = contact_problem(case.gear_set, 0, StaticsSettings(), resolution=level)
    table = solve_cycle(problem, [100.0], np.arange(POSITIONS) / POSITIONS)
    deflection, moment = at_rest(case.stepper(cutoff, remaining=0.0), track)
    assert np.abs(moment / 100.0 - 1.0).max() < 1e-9
    return deflection / table.ste[0] - 1.0, deflection


def at_rest(stepper, track):
    """(deflection, moment of the contact forces on the driver) at rest."""
    state = stepper.start()
    lever = stepper.model.sides[0].load_curves.moment_arms[..., 0]
    deflections, moments = [], []
    for n in range(POSITIONS):
        position = n * CYCLE // POSITIONS
        run = track(stepper, state, TimeSteps(0.0, 1e-2, 6, CYCLE, position))
        motion = run.motion[-1]
        motion[1:3] = 0.0
        state = MotionState(motion, run.contact[-1])
        deflections.append(run.deflection[-1, 0])
        moments.append(run.contact[-1, kernel.LOAD] @ lever[position])
    return np.array(deflections), np.array(moments)


def test_deflection_at_rest_is_the_static_transmission_error(case_of, track):
    error, _ = static_error(case_of, track)
    assert np.median(np.abs(error)) < 1e-4
    assert np.abs(error).max() < 2e-3  # where a corner comes into contact


def test_the_same_with_relief(case_of, track):
    error, _ = static_error(case_of, track, relief=8.0)
    assert np.abs(error).max() < 3e-4


@pytest.mark.slow
def test_what_is_left_is_the_discretisation_of_the_patches(case_of, track, monkeypatch):
    for name, nodes in (("coarse", 49), ("fine", 97)):
        level = Resolution(MeshSize(), nodes)
        monkeypatch.setitem(statics.RESOLUTIONS, name, level)
    levels = ("default", "coarse", "fine")  # by rising nodes
    errors = [static_error(case_of, track, resolution=name)[0] for name in levels]
    medians = [np.median(np.abs(error)) for error in errors]
    largest = [np.abs(error).max() for error in errors]
    for coarse, fine in pairwise(medians):
        assert fine < 0.5 * coarse
    for coarse, fine in pairwise(largest):
        assert fine < 0.75 * coarse
    assert largest[-1] < 6e-4


@pytest.mark.parametrize("relief", [0.0, 8.0], ids=["plain", "relieved"])
def test_kept_modes_do_not_change_statics(case_of, track, relief):
    _, rigid = static_error(case_of, track, relief=relief)
    _, elastic = static_error(case_of, track, relief=relief, cutoff=CUTOFF)
    np.testing.assert_allclose(elastic, rigid, rtol=1e-9)


@pytest.mark.parametrize("relief", [0.0, 8.0], ids=["plain", "relieved"])
def test_slow_motion_with_friction_is_static(case_of, track, relief):
    """Friction reverses at the pitch point; rest itself leaves its sense open."""
    case = case_of(relief=relief, held=HELD, friction=0.1, damping=0.2)
    problem = contact_problem(
        case.gear_set,
        0,
        StaticsSettings(friction=0.1),
    )
    table = solve_cycle(problem, [100.0], np.arange(POSITIONS) / POSITIONS)
    stepper = case.stepper(CUTOFF, remaining=0.0)
    frequency, steps = 0.5, 64 * POSITIONS
    _, motion = stepper.integrate(
        stepper.start(), TimeSteps(frequency, 1.0 / (frequency * steps), steps, steps)
    )
    deflection = motion.deflection[: -1 : steps // POSITIONS, 0]
    # at the pitch point itself, and off balance at the very start
    error = np.abs(deflection / table.ste[0] - 1.0)[1:]
    assert np.median(error) < 1e-4
    assert error.max() < (2e-3 if relief == 0.0 else 3e-4)
    frictionless = solve_cycle(
        replace(problem, friction=0.0), [100.0], table.position
    ).ste
    assert np.abs(table.ste / frictionless - 1.0).max() > 5e-3


@pytest.mark.parametrize("cutoff", [None, CUTOFF], ids=["rigid", "elastic"])
def test_start_balances_the_torques(case_of, cutoff):
    case = case_of("liu-idler-small-hubs")
    model = case.model(cutoff)
    touch = case.stepper(cutoff).start().contact
    radius = case.gear_set.meshes[0].pair.driver.base_radius
    forces = [touch[kernel.LOAD, model.jacobian.mesh_of == m].sum() for m in range(2)]
    # the couplings take a part of what the input gear gives
    rotation = model.modal.rotation @ case.stepper(cutoff).start().motion[0, :3]
    held = [gear.coupling_stiffness for gear in case.gear_set.gears]
    assert forces[0] * radius == pytest.approx(100.0 - held[0] * rotation[0], rel=1e-8)
    assert forces[0] == pytest.approx(forces[1], rel=1e-8)  # the idler is free


def uncompiled(part: Any) -> Any:
    return part.py_func


def next_contact(model, c):
    """The contact that c becomes with the next cycle, None where it leaves."""
    mesh, pair, side = model.contact_labels[c]
    labels = model.contact_labels
    following = (mesh, pair + 1, side)
    return labels.index(following) if following in labels else None


@pytest.fixture(scope="session")
def both_sides(case_of):
    """Three gears with all that counts: back sides, friction and elastic modes."""
    return case_of("liu-idler-small-hubs", backlash=20e-6, friction=0.1).model(CUTOFF)


def test_contacts_come_on_both_sides_of_both_meshes(both_sides):
    kinds = {(mesh, side) for mesh, _, side in both_sides.contact_labels}
    assert kinds == {(0, 1), (0, -1), (1, 1), (1, -1)}


@pytest.mark.parametrize("kind", [2, 3], ids=["closing", "rootward"])
def test_teeth_counted_anew_stand_where_they_stood(both_sides, kind):
    """A contact at the end of a cycle sees what the next one sees at its start."""
    model = both_sides
    state = np.random.default_rng(1).standard_normal((4, model.size))
    after = state.copy()
    for gear in range(3):
        uncompiled(kernel.shift_tooth_index)(model.modal, gear, after)
    assert not np.allclose(after, state)
    count, columns, mesh_of = (
        model.jacobian.widths,
        model.jacobian.columns,
        model.jacobian.mesh_of,
    )
    compared = 0
    for c in range(model.contact_count):
        d = next_contact(model, c)
        m = mesh_of[c]
        width = columns[m, : count[m]]
        # a contact whose flanks do not face each other has no place on them
        if d is None or model.contacts.gap[c, -1] > 1e-3:
            continue
        before = model.jacobian[kind][c, -1, : count[m]] @ state[0, width]
        behind = model.jacobian[kind][d, 0, : count[m]] @ after[0, width]
        scale = np.abs(model.jacobian[kind][c, -1]).sum()
        assert behind == pytest.approx(before, abs=1e-5 * scale)
        compared += 1
    assert compared >= 8


def test_laws_go_on_over_the_end_of_a_cycle(both_sides):
    gap, law = both_sides.contacts.gap, both_sides.contacts.load_curve
    arms = np.concatenate(
        [side.load_curves.moment_arms.swapaxes(0, 1) for side in both_sides.sides]
    )
    normal = both_sides.contacts.normal_compliance
    follow = {c: next_contact(both_sides, c) for c in range(both_sides.contact_count)}
    pairs = [(c, d) for c, d in follow.items() if d is not None and gap[c, -1] < 1e-3]
    for c, d in pairs:
        assert gap[d, 0] == pytest.approx(gap[c, -1], abs=1e-12)
        np.testing.assert_allclose(arms[d, 0], arms[c, -1], atol=1e-9)
        scale = np.abs(law[c, -1, :, :, 0]).max()
        np.testing.assert_allclose(
            law[d, 0, ..., 0], law[c, -1, ..., 0], atol=1e-5 * scale
        )
    size = np.abs(normal).max()
    for c, d in pairs:
        for e, f in pairs:
            assert normal[0, d, f] == pytest.approx(normal[-1, c, e], abs=1e-5 * size)


def test_a_march_is_continuous_where_teeth_are_counted_anew(case_of, track):
    """No jump of squeeze or load is larger there than at other steps."""
    stepper = case_of("liu-idler-small-hubs").stepper(CUTOFF)
    steps = 1024
    run = track(
        stepper,
        stepper.start(),
        TimeSteps(300.0, 1.0 / (300.0 * steps), 2 * steps, steps),
    )
    force = np.stack(
        [
            run.contact[:, kernel.LOAD, stepper.model.jacobian.mesh_of == m].sum(1)
            for m in (0, 1)
        ]
    )
    bend = np.abs(np.diff(force, 2, axis=1)).max(axis=0)
    around = slice(steps - 4, steps + 4)
    assert bend[around].max() <= np.quantile(bend, 0.99)


class ReversedGearSet(GearSet):
    """A gear set whose first driver turns clockwise."""

    @property
    def senses(self):
        return tuple(-sense for sense in super().senses)


class ReversedTrain(Train):
    @property
    def speeds(self):
        return tuple(-speed for speed in super().speeds)


def same_parts(kind, value):
    return kind(**{f.name: getattr(value, f.name) for f in fields(value)})


def moving_in_the_plane(case, torque, mirrored):
    """The case on its bearings, or its picture along the row of its centres."""
    gear_set, kind = case.gear_set, Train
    if mirrored:
        gear_set, kind = same_parts(ReversedGearSet, gear_set), ReversedTrain
    train = same_parts(kind, train_of(gear_set, torque, translations=True))
    reference = LumpedSystem(train, case.reference.excitations)
    return replace(case, gear_set=gear_set, reference=reference)


@pytest.fixture(scope="session")
def both_ways(case_of):
    case = case_of("liu-idler-small-hubs", backlash=20e-6, friction=0.1)
    return [moving_in_the_plane(case, 20.0, mirrored) for mirrored in (False, True)]


@pytest.mark.parametrize("cutoff", [None, CUTOFF], ids=["rigid", "elastic"])
def test_a_mirrored_train_moves_alike(both_ways, cutoff):
    """With contact on both sides, friction and bearings."""
    one, other = (case.stepper(cutoff) for case in both_ways)
    assert (one.model.kinematics.speed == -other.model.kinematics.speed).all()
    runs = []
    for stepper in (one, other):
        state = stepper.start()
        deflection = stepper.model.kinematics.deflection
        kick = np.linalg.pinv(deflection) @ [0.2, -0.2]  # m/s
        state.motion[kernel.V, : kick.size] += kick
        step = 1.0 / (1500.0 * 256)
        runs.append(stepper.integrate(state, TimeSteps(1500.0, step, 512, 256))[1])
    force = runs[0].force
    assert (force == 0.0).any()
    assert (force < 0.0).any()
    np.testing.assert_allclose(runs[1].force, force, atol=1e-6 * force.max(), rtol=0.0)
    np.testing.assert_allclose(
        runs[1].pair_load, runs[0].pair_load, atol=1e-6 * force.max(), rtol=0.0
    )
