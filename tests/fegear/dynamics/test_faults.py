"""Faulty teeth in the coupled model and in finite elements in motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from changed_flanks import with_flanks
from contact_at import integrated_deflection
from numpy.testing import assert_allclose, assert_array_equal
from slow_tests import first_are_quick

from fegear.contact.offset_centers import CenterOffset, moved_lines
from fegear.contact.pairs import back_side_position
from fegear.contact.tooth_faults import FlankSpall, ToothFaults
from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.different_teeth import MIN_CHANGE, side_differences
from fegear.dynamics.history import history_table
from fegear.dynamics.sides import BACK, DRIVE
from fegear.dynamics.stepper import DynamicSettings
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set, make_gear_set
from fegear.statics.contact_problem import contact_problem
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import RESOLUTIONS, StaticsSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.signals.averages import order_amplitudes, residual_of
from lumped.steady.respond import respond_with_history
from lumped.steady.steady_state import steady_state

TORQUE, TEETH = 100.0, 38
SPEED = 570.0  # mesh frequency [Hz], 900 rpm of the pinion
SPALL = {"start_roll_angle_deg": 18.0, "end_roll_angle_deg": 24.0, "width_share": 0.5}
WEAR = {"roll_angle_deg": [12.0, 20.0, 29.0], "depth_um": [5.0, 2.0, 5.0]}
FAULTS = {
    "crack": {"cracks": [{"tooth": 5, "depth_mm": 1.5}]},
    "spall": {"spalls": [{"tooth": 5, **SPALL}]},
    "broken tip": {"broken_tips": [{"tooth": 5, "height_mm": 0.8}]},
    "wear": {"worn_teeth": [{"tooth": 5, **WEAR}]},
    "eccentricity": {"eccentricity_um": 20.0, "eccentricity_angle_deg": 70.0},
}
SOURCE = ExcitationSettings(positions=64, resolution="coarse")


@pytest.fixture(scope="module")
def elements(compliance_cache):
    return Excitations(SOURCE)


@pytest.fixture(scope="module")
def few_positions(compliance_cache):
    """For which teeth have which curves."""
    return Excitations(replace(SOURCE, positions=16))


def gears_with(fault, gear="pinion", **edits):
    values = {f"gear.{gear}.{key}": value for key, value in FAULTS[fault].items()}
    return load_gear_set("liu-pair", values | edits)


def system_of(gear_set, number, elements, **more):
    model = LumpedModel(number=number, excitation=elements.settings, **more)
    return lumped_system(gear_set, TORQUE, model, elements)


def prepared(gear_set, elements, fidelity="quasistatic", **more):
    reference = system_of(gear_set, 1, elements)
    chosen = FiniteElements(fidelity=fidelity, **more)
    arguments = [SPEED], chosen, DynamicSettings(), elements
    return prepare(gear_set, TORQUE, reference, *arguments)


def over_a_turn(motion, frequency, points=128):
    """Transmission error at equal steps through a turn of the pinion."""
    time = np.arange(TEETH * points) / (points * frequency)
    return np.interp(time, motion.time - motion.time[0], motion.deflection[:, 0])


def residual_peak(motion):
    turn = over_a_turn(motion, SPEED)
    return float(np.abs(residual_of(turn[:, None], [TEETH])).max())


@pytest.mark.parametrize("gear", first_are_quick(["pinion", "idler"], 1))
@pytest.mark.parametrize("fault", [fault for fault in FAULTS if fault != "spall"])
def test_at_rest_the_coupled_model_has_the_static_error(elements, fault, gear):
    edits = {"roll_angle_deg": [15.0, 20.0, 25.0]} if gear == "idler" else {}
    values = FAULTS[fault]
    if fault == "wear":
        values = {"worn_teeth": [FAULTS[fault]["worn_teeth"][0] | edits]}
    keys = {f"gear.{gear}.{key}": value for key, value in values.items()}
    system = system_of(load_gear_set("liu-pair", keys), "coupled", elements)
    (check,) = system.static_checks
    # of the peak to peak; without faults it is 0.3 %
    assert abs(check.error) < 0.02
    assert abs(check.mean_error) < 1e-3


def test_at_rest_a_spalled_pair_has_the_static_error(elements):
    (check,) = system_of(gears_with("spall"), "coupled", elements).static_checks
    assert abs(check.error) < 2e-3
    assert check.peak_to_peak > 4e-6  # 3e-6 without the spall


def tall_pair(missing: tuple[int, ...]):
    """A pair of contact ratio 2.16, whose other teeth carry for a missing one."""
    tall = {"module_mm": 2.0, "face_width_mm": 10.0, "hub_radius_mm": 16.0}
    tall |= {"addendum_mm": 2.7, "dedendum_mm": 3.0, "tooth_thinning_um": 50.0}
    driver = {"name": "p", "teeth": 30, "missing_teeth": list(missing)}
    return make_gear_set(
        {
            "name": "tall teeth",
            "defaults": tall,
            "gear": [driver, {"name": "w", "teeth": 35}],
            "mesh": [{"driver": "p", "driven": "w", "center_distance_mm": 65.0}],
            "load": {"gear": "p", "torques_Nm": [TORQUE]},
            "dynamics": {"damping_ratio": 0.05},
        }
    )


def test_a_missing_tooth_carries_nothing_in_motion(elements):
    gear_set = tall_pair((20,))
    system = system_of(gear_set, "coupled", elements)
    (check,) = system.static_checks
    assert abs(check.error) < 0.02
    _, motion = steady_state(
        prepared(gear_set, elements).stepper, 40.0, DynamicSettings(steps=64)
    )
    healthy = prepared(tall_pair(()), elements).stepper
    _, whole = steady_state(healthy, 40.0, DynamicSettings(steps=64))
    largest = motion.deflection[:, 0].max()
    assert largest > 1.2 * whole.deflection[:, 0].max()
    static = elements.table(gear_set, 0, TORQUE)["ste_m"][0]
    assert_allclose(largest, static.max(), rtol=0.05)


@pytest.mark.parametrize("fault", first_are_quick(FAULTS))
def test_slow_motion_has_the_statics_of_every_pair(elements, fault):
    """Over a turn, all pairs with their own teeth and centres together."""
    gear_set = gears_with(fault)
    static = elements.table(gear_set, 0, TORQUE)
    slow, steps = 40.0, DynamicSettings(steps=512, hub_angle=2.0)
    choice = prepared(gear_set, elements)
    _, motion = steady_state(choice.stepper, slow, steps)
    # the first mesh is at its pitch point at the start
    deflection = over_a_turn(motion, slow, 64)
    deviation = deflection - static["ste_m"][0]
    # beside a crack, neighbours yield 8 % more to the load of its tooth than is
    # modelled; entering a spall makes gears ring, at any speed
    spread, largest = (0.05, 0.2) if fault == "spall" else (0.02, 0.05)
    assert deviation.std() < spread * static["ste_m"][0].std()
    assert np.abs(deviation).max() < largest * np.ptp(static["ste_m"][0])
    system = system_of(gear_set, "coupled", elements)
    _, history = respond_with_history(system, slow)
    coupled, whole = over_a_turn(history, slow), over_a_turn(motion, slow)
    assert (coupled - whole).std() < spread * whole.std()


@pytest.mark.parametrize("number", ["coupled", "quasistatic"])
def test_an_eccentric_gear_turns_the_error_by_its_eccentricity(elements, number):
    gear_set = gears_with("eccentricity")
    reference = lumped_system(
        gear_set, 2.0, LumpedModel(number=1, excitation=SOURCE), elements
    )
    if number == "coupled":
        model = LumpedModel(number=number, excitation=SOURCE)
        system = lumped_system(gear_set, 2.0, model, elements)
        _, motion = respond_with_history(system, 10.0)
    else:
        chosen = FiniteElements(fidelity="quasistatic")
        steps = DynamicSettings(steps=64, hub_angle=10.0)
        arguments = [10.0], chosen, steps, elements
        choice = prepare(gear_set, 2.0, reference, *arguments)
        _, motion = steady_state(choice.stepper, 10.0, steps)
    amplitude = order_amplitudes(over_a_turn(motion, 10.0)[:, None])[1, 0]
    assert amplitude == pytest.approx(20e-6, rel=1e-3)


@pytest.mark.parametrize("fault", first_are_quick(FAULTS))
def test_coupled_and_finite_elements_have_the_same_residual(elements, fault):
    gear_set = gears_with(fault)
    _, coupled = respond_with_history(system_of(gear_set, "coupled", elements), SPEED)
    choice = prepared(gear_set, elements, "reduced")
    _, reduced = steady_state(choice.stepper, SPEED, DynamicSettings())
    assert residual_peak(coupled) == pytest.approx(residual_peak(reduced), rel=0.03)
    # springs without what bodies do to the motion
    _, springs = respond_with_history(system_of(gear_set, 1, elements), SPEED)
    assert residual_peak(springs) == pytest.approx(residual_peak(reduced), rel=0.25)


def test_the_residual_of_a_crack_grows_with_its_depth(elements):
    peaks = []
    for depth in (0.0, 0.5, 1.0, 1.5):
        cracks = [{"tooth": 5, "depth_mm": depth}] if depth else []
        gear_set = load_gear_set("liu-pair", {"gear.pinion.cracks": cracks})
        system = system_of(gear_set, "coupled", elements)
        _, history = respond_with_history(system, SPEED)
        if not cracks:  # a period of one cycle has no order but those of the mesh
            assert system.common_period == (1,)
            continue
        peaks.append(residual_peak(history))
    assert np.all(np.diff([0.0, *peaks]) > 0.0)
    assert peaks[-1] > 4.0 * peaks[0]


def test_equal_teeth_have_one_curve_and_no_cycles(few_positions):
    contacts = prepared(load_gear_set("liu-pair"), few_positions).stepper.model.contacts
    assert contacts.curve_rows.size == contacts.gap_changes.size == 0
    assert len(contacts.load_curve) == contacts.side.size


def test_contacts_have_the_curves_of_their_own_teeth(few_positions):
    """By the teeth that pitch errors count, of both gears and on both flanks."""
    tips = {
        "gear.pinion.broken_tips": [{"tooth": 5, "height_mm": 0.5}],
        "gear.idler.broken_tips": [{"tooth": 7, "height_mm": 0.6}],
        "mesh.1.backlash_um": 40.0,
    }
    gear_set = load_gear_set("liu-pair", tips)
    model = prepared(gear_set, few_positions).stepper.model
    contacts, row = model.contacts, 0
    assert [side.flank_sign for side in model.sides] == [DRIVE, BACK]
    assert contacts.curve_rows.shape[1] == math.lcm(38, 55)
    for side in model.sides:
        back = side.flank_sign == BACK
        for offset in side.load_curves.pair_offsets:
            for cycle in range(0, 2090, 7):
                pair = cycle - int(offset)
                driver, driven = (pair - back) % 38, pair % 55
                other = driver == 4 or driven == 6
                assert (contacts.curve_rows[row, cycle] != row) == other
            row += 1
    # three kinds of pairs: either tooth broken, or both
    assert len(contacts.load_curve) == 4 * contacts.side.size


def test_arrays_of_unlike_teeth_are_as_those_of_like_ones(few_positions):
    """In another order of columns numba compiles kernels of motion once more."""
    for gear_set in (load_gear_set("liu-pair"), gears_with("crack")):
        contacts = prepared(gear_set, few_positions).stepper.model.contacts
        assert [
            name
            for name, array in contacts._asdict().items()
            if not array.flags.c_contiguous
        ] == []


def test_flank_faults_leave_back_flanks_alone(few_positions):
    gear_set = gears_with("spall", **{"mesh.1.backlash_um": 40.0})
    drive, back = prepared(gear_set, few_positions).stepper.model.sides
    assert len(drive.differences.curves) == 1
    assert back.differences is None
    cracked = gears_with("crack", **{"mesh.1.backlash_um": 40.0})
    drive, back = prepared(cracked, few_positions).stepper.model.sides
    assert len(drive.differences.curves) == 1  # neighbours are as good as whole
    assert back.differences is None


def test_neighbours_of_a_crack_are_hardly_changed(elements):
    problem = contact_problem(gears_with("crack"), 0, SOURCE.statics)
    faults = problem.driver.faults
    changes = {
        tooth: np.abs(faults.change.block(*[faults.clockwise * tooth % 38] * 2)).max()
        for tooth in faults.damaged
    }
    largest = changes.pop(4)
    assert max(changes.values()) < 0.5 * MIN_CHANGE * largest


def test_centers_open_back_flanks_by_what_they_close(elements):
    """Across the line of centres both flanks move alike; toward it, apart."""
    problem = contact_problem(load_gear_set("liu-pair"), 0, SOURCE.statics)
    angle = problem.pair.operating_pressure_angle
    position = np.linspace(0.0, 1.0, 9)
    for direction in (0.0, 0.5 * math.pi):
        offset = CenterOffset(10e-6, direction)
        moved = with_flanks(problem, driver_offset=offset)
        gaps = []
        for back in (False, True):
            side = back_side_position(problem.pair, position) if back else position
            pitch = np.zeros(9, np.int64)
            gaps.append(
                moved_lines(moved.pair, moved.offsets, side, pitch, back).gap[0]
            )
        along = 10e-6 * (math.sin(angle) if direction == 0.0 else math.cos(angle))
        signs = (-1.0, -1.0) if direction == 0.0 else (-1.0, 1.0)
        assert_allclose(gaps, np.multiply(signs, along), rtol=2e-2)


def test_spalls_of_all_teeth_are_one_kind_of_pair(elements):
    problem = contact_problem(load_gear_set("liu-pair"), 0, SOURCE.statics)
    spall = (FlankSpall(0.015, 0.018, 0.4),)
    faults = ToothFaults(teeth=38, spalls=dict.fromkeys(range(38), spall))
    from fegear.contact.pair_load_curves import pair_load_curves

    position = np.linspace(0.0, 1.0, 9)
    alike = pair_load_curves(problem, position, 6e-5)
    spalled = with_flanks(problem, driver_faults=faults)
    differences = side_differences(spalled, position, alike)
    assert differences.number.min() == 1  # none is like teeth without
    loads = np.stack([curves.load for curves in differences.curves])
    assert_array_equal(loads, np.broadcast_to(loads[0], loads.shape))


def test_healthy_teeth_of_a_faulty_gear_keep_their_curves(few_positions):
    healthy = prepared(load_gear_set("liu-pair"), few_positions).stepper.model.contacts
    cracked = prepared(gears_with("crack"), few_positions).stepper.model.contacts
    count = healthy.side.size
    assert_array_equal(cracked.load_curve[:count], healthy.load_curve)
    assert_array_equal(cracked.gap, healthy.gap)
    assert_array_equal(cracked.normal_compliance, healthy.normal_compliance)


def test_history_has_the_pressure_of_spalled_flanks(elements):
    """Half the width carries the load: pressure grows by the root of two."""
    choice = prepared(gears_with("spall"), elements)
    settings = DynamicSettings(steps=256, hub_angle=2.0)
    _, motion = steady_state(choice.stepper, 40.0, settings)
    steps = (motion.time.size - 1) // TEETH
    table = history_table(choice.stepper.model, motion, steps)
    teeth = table.columns["mesh1_driver_tooth"]
    assert sorted(set(teeth)) == list(range(1, TEETH + 1))
    pressure = table.columns["mesh1_pair0_pressure_Pa"].reshape(-1)[:-1]
    of_tooth = pressure.reshape(TEETH, steps)
    at_pitch_point = of_tooth[:, steps // 16]
    other = np.delete(at_pitch_point, 4)
    assert_allclose(other, other[0], rtol=5e-3)
    assert at_pitch_point[4] / other[0] == pytest.approx(math.sqrt(2.0), rel=0.05)


def test_without_hardening_teeth_keep_secants_of_their_own(elements):
    model = LumpedModel(number="coupled", without=("hardening",), excitation=SOURCE)
    system = lumped_system(gears_with("spall"), TORQUE, model, elements)
    curves = system.coupled_arrays.contacts.load_curve
    assert np.isfinite(curves).all()
    _, history = respond_with_history(system, SPEED)
    whole = system_of(gears_with("spall"), "coupled", elements)
    _, expected = respond_with_history(whole, SPEED)
    assert residual_peak(history) == pytest.approx(residual_peak(expected), rel=0.25)


def test_cracks_are_refused_by_whole_bodies(elements):
    with pytest.raises(InputError, match=r"cracks; not modelled by .* fidelity full"):
        prepared(gears_with("crack"), elements, "full")


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["spall", "crack", "eccentricity"])
def test_motion_is_that_of_rigid_gears_on_the_contact_of_every_instant(elements, fault):
    """Classical steps over all pairs, contact solved anew at each; no pair laws."""
    gear_set = gears_with(fault)
    frequency, cycle_steps, start, cycles = 1500.0, 64, -12, 10
    choice = prepared(gear_set, elements)
    settings, resolution = StaticsSettings(), RESOLUTIONS["coarse"]
    problem = contact_problem(gear_set, 0, settings, resolution=resolution)
    _, motion = steady_state(choice.stepper, frequency, DynamicSettings(steps=256))

    time = motion.time - motion.time[0]
    rate = np.gradient(motion.deflection[:, 0], time)
    begin = (start % TEETH) / frequency
    state = np.array(
        [np.interp(begin, time, values) for values in (motion.deflection[:, 0], rate)]
    )
    steps = range(start * cycle_steps, cycles * cycle_steps)
    expected = integrated_deflection(
        *(problem, choice.stepper.system, TORQUE, state, steps, frequency, cycle_steps)
    )
    deflection = np.interp(
        np.arange(len(expected)) / (frequency * cycle_steps),
        time,
        motion.deflection[:, 0],
    )
    deviation = deflection - expected
    assert deviation.std() < 0.02 * np.std(expected)
    assert abs(deviation.mean()) < 0.01 * np.abs(expected).mean()
