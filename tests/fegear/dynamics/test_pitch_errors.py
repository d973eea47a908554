"""Gears in motion whose teeth are not all equal."""

from __future__ import annotations

import numpy as np
import pytest
from contact_at import integrated_deflection
from oracles import reduced_motion

from fegear.contact.solve import solve_cycle
from fegear.dynamics import stepper as stepping
from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.history import history_table
from fegear.dynamics.sides import BACK, DRIVE
from fegear.dynamics.stepper import DynamicSettings, TimeSteps, steps_per_cycle
from fegear.files.errors import InputError
from fegear.gearset.phases import mesh_phases
from fegear.statics.contact_problem import contact_problem
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import RESOLUTIONS, StaticsSettings
from lumped.steady.steady_state import steady_state

PINION, WHEEL = (0.0, 3e-6), (1e-6, -2e-6, 0.5e-6, 2e-6, -1e-6)  # repeated around
ERRORS = (PINION * 19, WHEEL * 11)
CYCLES = 10


@pytest.fixture(scope="module")
def uneven(case_of):
    return case_of(errors=ERRORS)


def idler_errors():
    rng = np.random.default_rng(2)
    return tuple(tuple(rng.uniform(-1e-6, 1e-6, z).tolist()) for z in (38, 55, 94))


def test_contacts_have_the_errors_of_their_own_teeth(case_of):
    """By the teeth that elastic modes and root stresses count, in another way."""
    errors = idler_errors()
    case = case_of("liu-idler", errors=errors, backlash=20e-6)
    senses, row = case.gear_set.senses, 0
    model = case.model()
    assert {side.flank_sign for side in model.sides} == {DRIVE, BACK}
    for side in model.sides:
        for pair in range(side.load_curves.pair_offsets.size):
            for cycle in (0, 1, 17, 60, 98229):
                expected = 0.0
                for g in side.gears:
                    clockwise = side.teeth(g)[pair]
                    tooth = senses[g] * clockwise + cycle
                    # the idler is driven in its first mesh and drives in the second
                    sign = -1.0 if (g == 1 and side.mesh == 1) else 1.0
                    expected += (
                        side.flank_sign * sign * errors[g][tooth % len(errors[g])]
                    )
                tooth_errors = model.contacts.errors[row]
                assert tooth_errors[cycle % tooth_errors.size] == pytest.approx(
                    expected, abs=1e-15
                )
            row += 1
    assert row == model.contact_count


def test_equal_teeth_have_no_errors(case_of):
    assert case_of().model().contacts.errors.shape[1] == 0
    zero = case_of(errors=((0.0,) * 38, (0.0,) * 55)).model()
    assert zero.contacts.errors.shape[1] == 0


def test_slow_motion_has_the_statics_of_every_pair(uneven):
    """Ten mesh cycles, in each of which other teeth carry."""
    stepper, slow = uneven.stepper(None), 40.0
    response, motion = steady_state(stepper, slow, DynamicSettings(steps=512))
    assert response.period_multiple.tolist() == [CYCLES]
    gear_set = uneven.gear_set
    settings = StaticsSettings()
    problem = contact_problem(gear_set, 0, settings)
    position = np.arange(CYCLES * 16) / 16
    mesh_position = mesh_phases(gear_set)[0].value + position % 1.0
    expected = solve_cycle(
        problem, [100.0], mesh_position, np.floor(position).astype(int)
    )
    time = position / slow
    deflection = np.interp(time, motion.time, motion.deflection[:, 0])
    deviation = deflection - expected.ste[0]
    assert deviation.std() < 0.02 * expected.ste[0].std()
    assert abs(deviation.mean()) < 0.02 * expected.ste[0].mean()


@pytest.mark.slow
def test_motion_is_that_of_rigid_gears_on_the_contact_of_every_instant(uneven):
    """Classical steps over all pairs, contact solved anew at each; no pair laws."""
    frequency, cycle_steps, transient_cycles = 1500.0, 64, 20
    settings, resolution = StaticsSettings(), RESOLUTIONS["default"]
    problem = contact_problem(uneven.gear_set, 0, settings, resolution=resolution)
    expected = integrated_deflection(
        problem,
        uneven.reference,
        100.0,
        np.array([8e-6, 0.0]),
        range(-transient_cycles * cycle_steps, CYCLES * cycle_steps),
        frequency,
        cycle_steps,
    )
    _, motion = steady_state(
        uneven.stepper(None), frequency, DynamicSettings(steps=256)
    )
    time = np.arange(CYCLES * cycle_steps) / (frequency * cycle_steps)
    deflection = np.interp(time, motion.time, motion.deflection[:, 0])
    deviation = deflection - expected
    assert deviation.std() < 0.02 * np.std(expected)
    assert abs(deviation.mean()) < 0.01 * np.mean(expected)


@pytest.mark.slow
def test_steps_are_those_of_the_equations(uneven):
    """Against a general solver, over cycles with different pairs, contact lost."""
    stepper, frequency, cycles = uneven.stepper(20e3), 1600.0, 3
    shape = stepper.model.kinematics.deflection[0]
    state = stepper.start()
    state.motion[1, : shape.size] += 0.15 * shape / (shape @ shape)
    _, states = reduced_motion.march(
        *(reduced_motion.equations(stepper.model), state.motion[:2]),
        *(frequency, cycles),
        tolerance=1e-8,
    )
    steps = 128 * 8
    _, motion = stepper.integrate(
        state, TimeSteps(frequency, 1.0 / (frequency * steps), cycles * steps, steps)
    )
    deflection = motion.deflection[::8, 0]
    exact = states[:, 0, : shape.size] @ shape
    assert (motion.force == 0.0).any()
    assert np.sqrt(np.mean((deflection - exact) ** 2)) < 2e-3 * exact.std()


def test_a_later_start_is_another_pair(uneven):
    """Marching on from a step is marching through it; from the start it is not."""
    stepper, cycle = uneven.stepper(None), 128
    size = 1.0 / (1600.0 * cycle)
    first = stepper.start()
    _, whole = stepper.integrate(first, TimeSteps(1600.0, size, 4 * cycle, cycle))
    half, _ = stepper.integrate(first, TimeSteps(1600.0, size, 2 * cycle, cycle))
    _, later = stepper.integrate(
        half, TimeSteps(1600.0, size, 2 * cycle, cycle, 2 * cycle)
    )
    np.testing.assert_array_equal(later.deflection, whole.deflection[2 * cycle :])
    _, again = stepper.integrate(half, TimeSteps(1600.0, size, 2 * cycle, cycle))
    assert np.abs(again.pair_load - later.pair_load).max() > 10.0


def test_long_periods_are_run_in_pieces(uneven, monkeypatch):
    """With the same result, and a look at the clock between them."""
    stepper, settings = uneven.stepper(None), DynamicSettings(tolerance=1e-3)
    looks: list[int] = []
    one, _ = steady_state(stepper, 1600.0, settings)
    monkeypatch.setattr(stepping, "PERIODS_PER_PIECE", 3)
    callback = lambda frequency, period: looks.append(period)  # noqa: E731
    other, motion = steady_state(stepper, 1600.0, settings, callback=callback)
    np.testing.assert_array_equal(one.dte_rms, other.dte_rms)
    np.testing.assert_array_equal(one.state.motion, other.state.motion)
    assert looks.count(0) == 3  # pieces of 3, 3, 3 and 1 cycles
    assert (
        len(motion.time)
        == CYCLES * steps_per_cycle(stepper.model, 1600.0, settings) + 1
    )


def test_the_speed_changes_within_whole_periods(uneven):
    """After a change of speed the same pairs are in mesh at the same time."""
    stepper, settings = uneven.stepper(None), DynamicSettings(tolerance=1e-4)
    state = steady_state(stepper, 1500.0, settings)[0].state
    response, _ = steady_state(stepper, 1600.0, settings, state, 1500.0)
    rested, _ = steady_state(stepper, 1600.0, settings)
    np.testing.assert_allclose(response.dte_rms, rested.dte_rms, rtol=1e-3)
    np.testing.assert_allclose(
        response.state.motion[0], rested.state.motion[0], rtol=1e-2
    )


def test_history_names_the_teeth_of_the_reference_pair(uneven, case_of):
    stepper, settings = uneven.stepper(None), DynamicSettings(tolerance=1e-2)
    _, motion = steady_state(stepper, 1600.0, settings)
    steps = steps_per_cycle(stepper.model, 1600.0, settings)
    columns = history_table(stepper.model, motion, steps).columns
    for role, teeth in (("driver", 38), ("driven", 55)):
        tooth_numbers = columns[f"mesh1_{role}_tooth"]
        assert tooth_numbers[::steps].tolist() == [
            1 + n % teeth for n in range(CYCLES + 1)
        ]
        assert tooth_numbers[steps - 1] == 1
    stepper = case_of().stepper(None)
    _, motion = steady_state(stepper, 1600.0, settings)
    plain = history_table(stepper.model, motion, steps)
    assert not any("tooth" in name for name in (*plain.columns, *plain.header))


@pytest.mark.parametrize("fidelity", ["quasistatic", "reduced"])
def test_every_fidelity_moves_as_the_pairs_of_teeth(fidelity, case_of):
    """Two mesh cycles; beside Model-1, whose pairs stiffen less with load."""
    errors = ((2e-6, -2e-6) * 19, (0.0,) * 55)
    case = case_of(errors=errors, resolution="coarse")
    elements = FiniteElements(fidelity=fidelity)
    settings = DynamicSettings(tolerance=1e-2, multiples=1)
    source = Excitations(ExcitationSettings(resolution="coarse"))
    args = case.reference, [1000.0], elements, settings, source
    choice = prepare(case.gear_set, 100.0, *args)
    response, _ = steady_state(choice.stepper, 1000.0, settings)
    assert response.period_multiple.tolist() == [2]
    from lumped.steady.respond import respond as lumped_respond

    one = lumped_respond(case.reference, 1000.0)
    assert one.period_multiple.tolist() == [2]
    assert response.dte_rms[0] == pytest.approx(one.dte_rms[0], rel=0.1)


def test_motion_that_memory_cannot_hold_is_refused_with_its_length(case_of):
    case = case_of("liu-idler", errors=idler_errors())
    with pytest.raises(InputError, match=r"98230 cycles .* GB of motion"):
        steady_state(case.stepper(None), 1600.0, DynamicSettings())


def test_a_motion_that_does_not_repeat_is_recorded_over_a_common_period(uneven):
    """And not over as many as multiples are looked for: one is long."""
    stepper = uneven.stepper(None)
    settings = DynamicSettings(tolerance=1e-12, max_periods=1, multiples=2, windows=1)
    steps = steps_per_cycle(stepper.model, 1600.0, settings)
    response, motion = steady_state(stepper, 1600.0, settings)
    assert response.multiple == 0
    assert len(motion.time) == CYCLES * steps + 1
