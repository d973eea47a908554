"""Faults of teeth in the lumped models 1 to 3: at rest, over turns, at slow speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from slow_tests import first_are_quick

from fegear.files.errors import InputError
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.given_tables import read_mesh_tables
from fegear.statics.mesh_table_files import read_mesh_table
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.signals.averages import order_amplitudes
from lumped.steady.respond import respond_with_history

TORQUE = 100.0
SLOW_HZ = 16.0  # of the mesh, a hundredth of the lowest resonance or less
SOURCE = ExcitationSettings(positions=16, resolution="coarse")
PAIR = {
    "name": "small",
    "defaults": {"module_mm": 2.0, "face_width_mm": 20.0},
    "gear": [
        {"name": "a", "teeth": 17, "hub_radius_mm": 8.0},
        {"name": "b", "teeth": 23, "hub_radius_mm": 12.0},
    ],
    "mesh": [{"driver": "a", "driven": "b", "center_distance_mm": 40.2}],
    "load": {"gear": "a", "torques_Nm": [TORQUE]},
}
SPALL = {"start_roll_angle_deg": 20.0, "end_roll_angle_deg": 25.0, "width_share": 0.5}
FAULTS = {
    "crack": {"cracks": [{"tooth": 5, "depth_mm": 0.8}]},
    "spall": {"spalls": [{"tooth": 5, **SPALL}]},
    "broken tip": {"broken_tips": [{"tooth": 5, "height_mm": 0.3}]},
    "wear": {
        "worn_teeth": [{"tooth": 5, "roll_angle_deg": [18, 30], "depth_um": [3, 8]}]
    },
    "eccentricity": {"eccentricity_um": 15.0, "eccentricity_angle_deg": 40.0},
}


@pytest.fixture(scope="module")
def elements(compliance_cache):
    return Excitations(SOURCE)


def pair_with(driver=None, driven=None, **mesh) -> GearSet:
    """The pair with more keys of its gears and its mesh."""
    one, two = (
        gear | more
        for gear, more in zip(PAIR["gear"], (driver or {}, driven or {}), strict=True)
    )
    return make_gear_set(PAIR | {"gear": [one, two], "mesh": [PAIR["mesh"][0] | mesh]})


def system_of(gear_set, model, elements, torque=TORQUE, **more):
    chosen = LumpedModel(number=model, excitation=SOURCE, **more)
    return lumped_system(gear_set, torque, chosen, elements)


def order_of_turn(deflection, order: int = 1) -> float:
    """Amplitude at an order of a record of one turn, both ends of it included."""
    return float(order_amplitudes(deflection[:-1, None])[order, 0])


@pytest.mark.parametrize("model", [1, 2, 3])
@pytest.mark.parametrize("side", ["driver", "driven"])
@pytest.mark.parametrize("fault", FAULTS)
def test_at_rest_models_have_the_static_error_of_faulty_teeth(
    elements, fault, side, model
):
    gear_set = pair_with(**{side: FAULTS[fault]})
    system = system_of(gear_set, model, elements)
    (check,) = system.static_checks
    assert system.common_period == (17 if side == "driver" else 23,)
    # springs of teeth without wear, which share the load otherwise
    assert abs(check.error) < (1e-2 if fault == "wear" and model == 1 else 2e-3)
    healthy = system_of(pair_with(), model, elements).static_checks[0]
    assert check.peak_to_peak > 1.02 * healthy.peak_to_peak


@pytest.mark.parametrize("model", [1, 2, 3])
def test_faults_of_both_gears_meet_over_the_hunting_period(elements, model):
    gear_set = pair_with(FAULTS["crack"], FAULTS["eccentricity"])
    system = system_of(gear_set, model, elements)
    assert system.common_period == (17 * 23,)
    assert abs(system.static_checks[0].error) < 2e-3


@pytest.mark.parametrize("model", [1, 2, 3])
def test_an_eccentric_gear_turns_the_error_by_its_eccentricity(elements, model):
    """Rigid kinematics: the flanks' distance varies by the eccentricity, as a sine.

    Under little load: the contact ratio varies over the turn as well, and with it how
    much the teeth yield.
    """
    eccentric = pair_with(FAULTS["eccentricity"])
    system = system_of(eccentric, model, elements, 2.0)
    _, history = respond_with_history(system, SLOW_HZ)
    amplitude = order_of_turn(history.deflection[:, 0])
    assert amplitude == pytest.approx(15e-6, rel=1e-3)
    system = system_of(eccentric, model, elements)
    _, history = respond_with_history(system, SLOW_HZ)
    static = elements.table(eccentric, 0, TORQUE)["ste_m"][0]
    expected = order_of_turn(np.append(static, static[0]))
    amplitude = order_of_turn(history.deflection[:, 0])
    assert amplitude == pytest.approx(expected, rel=1e-3)


def test_eccentricities_of_both_gears_superpose(elements):
    gears = {"eccentricity_um": 10.0}, {"eccentricity_um": 25.0}
    system = system_of(pair_with(*gears), 1, elements, 2.0)
    _, history = respond_with_history(system, 100.0)
    turns = 23, 17  # of driver and driven gear in the hunting period
    amplitudes = [order_of_turn(history.deflection[:, 0], n) for n in turns]
    assert_allclose(amplitudes, [10e-6, 25e-6], rtol=2e-3)


@pytest.mark.parametrize("model", [1, 2, 3])
def test_equal_faults_of_all_teeth_are_another_healthy_gear(elements, model):
    table = {"roll_angle_deg": [16.0, 24.0, 32.0], "depth_um": [4.0, 1.0, 6.0]}
    worn = pair_with({"worn_teeth": [table]})
    profile = {
        "roll_angle_deg": table["roll_angle_deg"],
        "deviation_um": [-depth for depth in table["depth_um"]],
    }
    relieved = pair_with(driver_profile=profile)
    one, two = (system_of(g, model, elements) for g in (worn, relieved))
    assert one.common_period == two.common_period == (1,)
    times = np.linspace(0.0, 0.99, 37)
    for a, b in zip(
        one.excitation.evaluate(times), two.excitation.evaluate(times), strict=True
    ):
        assert_allclose(a, b, rtol=1e-12)


@pytest.mark.parametrize("model", [1, 2, 3])
def test_spalls_of_all_teeth_repeat_with_each_base_pitch(elements, model):
    spalls = [{"tooth": tooth, **SPALL} for tooth in range(1, 18)]
    system = system_of(pair_with({"spalls": spalls}), model, elements)
    times = np.linspace(0.0, 0.99, 37)
    first = system.excitation.evaluate(times)
    for pitch in (1, 7, 16):
        for one, other in zip(
            first, system.excitation.evaluate(times + pitch), strict=True
        ):
            assert_allclose(other, one, rtol=1e-9)


def test_a_healthy_gear_has_no_sidebands_and_a_cracked_one_more_with_depth(elements):
    peaks = []
    for depth in (0.0, 0.4, 0.8):
        cracks = [{"tooth": 5, "depth_mm": depth}] if depth else []
        # the tables of a gear without faults cover a base pitch, its turn 17
        system = system_of(pair_with({"cracks": cracks}), 1, elements)
        _, history = respond_with_history(system, 255.0)
        deflection = history.deflection[:-1, 0]
        turn = np.resize(deflection, (17 // system.common_period[0]) * deflection.size)
        lines = np.fft.rfft(turn)
        lines[::17] = 0.0
        peaks.append(np.abs(np.fft.irfft(lines, turn.size)).max())
    assert peaks[0] < 1e-12
    assert 1e-8 < peaks[1] < 0.6 * peaks[2]


HIGH_CONTACT_RATIO = {
    "driver": {"teeth": 40, "addendum_mm": 2.6, "dedendum_mm": 3.1},
    "driven": {"teeth": 52, "addendum_mm": 2.6, "dedendum_mm": 3.1},
    "center_distance_mm": 92.1,
}


@pytest.mark.parametrize("model", first_are_quick([1, 3, 2]))
@pytest.mark.parametrize("side", first_are_quick(["driver", "driven"], 1))
def test_a_missing_tooth_leaves_the_load_to_its_neighbours(elements, side, model):
    edits = HIGH_CONTACT_RATIO | {
        side: HIGH_CONTACT_RATIO[side] | {"missing_teeth": [3]}
    }
    system = system_of(pair_with(**edits), model, elements)
    # the neighbours carry in corner contact, where model 1 leaves tilted normals out
    assert abs(system.static_checks[0].error) < 3e-3
    _, history = respond_with_history(system, 5.0)
    assert np.isfinite(history.deflection).all()
    force = TORQUE / system.train.gears[0].base_radius
    assert_allclose(history.force.mean(), force, rtol=1e-3)
    if model != 1:
        return
    times = np.arange(0.0, system.common_period[0], 1.0 / 16)
    stiffness, gap = system.excitation.evaluate(times)
    assert np.isfinite(gap).all()
    pairs = (stiffness > 0.0).sum(axis=1)
    assert pairs.min() == 1  # two carry everywhere else
    assert np.isin(pairs[: 16 * 20], [1, 2, 3]).all()


def test_pitch_errors_come_on_top_of_faults(elements):
    """Where one pair alone is in contact, the errors of its teeth add."""
    errors = [0.0] * 17
    errors[9] = 2.0
    both = pair_with(FAULTS["spall"] | {"pitch_errors_um": errors}, backlash_um=60.0)
    system = system_of(both, 1, elements)
    assert system.common_period == (17,)
    table = solve_mesh(both, 1, [TORQUE], replace(SOURCE.statics, positions=16)).table
    _, history = respond_with_history(system, SLOW_HZ)
    ends = history.deflection[:-1, 0]
    x = np.arange(ends.size) * 17 / ends.size
    static = np.interp(x, np.append(table.position, 17.0), np.append(table["ste_m"], 0))
    inside = x < 16.9
    difference = (ends - static)[inside]
    assert np.sqrt((difference**2).mean()) < 0.06 * np.ptp(table["ste_m"])


def test_friction_goes_with_faults(elements):
    system = system_of(pair_with(FAULTS["spall"]), 1, elements, friction=0.05)
    _, history = respond_with_history(system, 50.0)
    assert np.isfinite(history.deflection).all()


@settings(max_examples=8, deadline=None, derandomize=True)
@given(
    teeth=st.sets(st.integers(1, 17), min_size=1, max_size=4),
    depth=st.floats(0.1, 0.8),
    share=st.floats(0.05, 0.9),
    eccentricity=st.floats(0.0, 30.0),
    model=st.sampled_from([1, 2, 3]),
)
def test_any_faults_have_their_static_error(
    elements, teeth, depth, share, eccentricity, model
):
    *cracked, spalled = sorted(teeth)
    gear_set = pair_with(
        {
            "cracks": [{"tooth": tooth, "depth_mm": depth} for tooth in cracked],
            "spalls": [{"tooth": spalled} | SPALL | {"width_share": share}],
            "eccentricity_um": eccentricity,
        }
    )
    system = system_of(gear_set, model, elements)
    assert abs(system.static_checks[0].error) < 5e-3


def test_a_table_of_faulty_teeth_replaces_their_elements(elements, tmp_path):
    gear_set = pair_with(FAULTS["spall"])
    path = tmp_path / "spalled.csv"
    elements._statics_result(gear_set, 0, TORQUE).to_csv(path)
    tables = read_mesh_tables([path], gear_set)
    one = lumped_system(gear_set, TORQUE, LumpedModel(number=1, excitation=tables))
    two = system_of(gear_set, 1, elements)
    times = np.linspace(0.0, 16.9, 101)
    for a, b in zip(
        one.excitation.evaluate(times), two.excitation.evaluate(times), strict=True
    ):
        assert_allclose(a, b, rtol=1e-9)
    assert "faults" in read_mesh_table(path).header
    healthy = solve_mesh(pair_with(), 1, [TORQUE], StaticsSettings(positions=16))
    healthy.to_csv(tmp_path / "healthy.csv")
    tables = read_mesh_tables([tmp_path / "healthy.csv"], gear_set)
    with pytest.raises(InputError, match="repeat after 17 for their faults"):
        lumped_system(gear_set, TORQUE, LumpedModel(number=1, excitation=tables))


@pytest.mark.parametrize("kind", ["rectangular", "trapezoid", "fourier"])
def test_key_figures_have_no_faults(kind):
    gear_set = pair_with(FAULTS["spall"])
    model = LumpedModel(number=1, excitation=ExcitationSettings(kind=kind))
    with pytest.raises(InputError, match=f"spalls; not modelled by {kind} stiffness"):
        lumped_system(gear_set, TORQUE, model)


def test_tables_of_faulty_teeth_belong_to_a_place_in_the_set(elements):
    """Another phase turns the centres and pairs other teeth; healthy ones are alike."""
    one, two, healthy, again = (
        elements.table(
            load_gear_set(
                "liu-idler",
                {"gear.idler.eccentricity_um": size, "mesh.2.phase": phase},
            ),
            *(1, TORQUE),
        )
        for size in (15.0, 0.0)
        for phase in (0.0, 0.3)
    )
    # by 0.3 of 55 teeth of a turn
    expected = 2.0 * 15e-6 * np.sin(np.pi * 0.3 / 55)
    difference = np.abs(one["ste_m"] - two["ste_m"]).max()
    assert difference == pytest.approx(expected, rel=0.1)
    assert again is healthy
