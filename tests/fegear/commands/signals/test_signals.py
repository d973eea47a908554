"""Signals of gear sets with one tooth that differs, and of healthy ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import fegear
from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.sampled_signals import MAX_SAMPLES
from lumped import Settings

MODEL = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)
FINE = Settings(tolerance=1e-10, steps=64)


def faulty(gear=0, tooth=1, error=0.0, name="liu-pair", phase=None):
    """A built-in set, one tooth of which is set back [um], counted from 1."""
    gears = load_gear_set(name)
    if phase is not None:
        other = replace(gears.meshes[1], phase=phase)
        gears = replace(gears, meshes=(gears.meshes[0], other))
    count = gears.gears[gear].geometry.teeth
    errors = tuple(1e-6 * error * (number == tooth - 1) for number in range(count))
    changed = [
        replace(one, pitch_errors=errors if index == gear else ())
        for index, one in enumerate(gears.gears)
    ]
    return replace(gears, gears=tuple(changed))


def signals(gears, **settings):
    defaults = {"speed": 500.0, "torque": 100.0, "model": MODEL, "turns": 2}
    defaults |= {"integration": FINE, "samples": 16}
    return fegear.run(fegear.Signals(gear_set=gears, **defaults | settings))


def entries(result, quantity):
    return np.array([entry[quantity] for entry in result.summary["signals"]])


@pytest.mark.parametrize("number", [1, 2, 3])
def test_healthy_gears_have_no_sidebands(number):
    model = replace(MODEL, number=number, translations=True)
    result = signals(faulty(name="liu-idler"), model=model)
    assert len(result.names) == 2 + 3 + 6
    mesh = entries(result, "mesh_amplitude")
    assert (mesh > 0.0).all()
    assert (entries(result, "sideband_amplitude") < 1e-9 * mesh).all()
    for entry in result.summary["signals"]:
        assert entry["tooth"] is entry["residual_kurtosis"] is None


def test_healthy_gears_have_no_residual_at_the_default_tolerance():
    """Their motion ends where it starts but for the tolerance, in every cycle alike."""
    for rpm in (900.0, 877.3):
        settings = {"speed": None, "rpm": rpm, "integration": Settings(), "turns": 16}
        for entry in signals(faulty(), **settings).summary["signals"]:
            assert entry["tooth"] is entry["residual_kurtosis"] is None


@pytest.mark.parametrize(
    ("gear", "name", "tooth"),
    [(0, "pinion", 1), (0, "pinion", 12), (0, "pinion", 38), (1, "idler", 55)],
)
def test_the_residual_is_largest_at_the_tooth_that_differs(gear, name, tooth):
    result = signals(faulty(gear, tooth, 2.0), gear_name=name)
    assert entries(result, "tooth").tolist() == [tooth] * 3
    assert (entries(result, "residual_kurtosis") > 10.0).all()
    assert result.summary["signals"][0]["residual_peak"] > 1e-6


@pytest.mark.parametrize("phase", [0.0, 0.7, 3.4])
def test_teeth_count_from_the_first_mesh_of_their_gear(phase):
    gears = faulty(2, 20, 2.0, name="liu-idler", phase=phase)
    result = signals(gears, gear_name="follower", turns=1)
    assert result.summary["signals"][1]["signal"] == "mesh2_dte_m"
    assert result.summary["signals"][1]["tooth"] == 20


def test_another_tooth_rotates_the_average():
    first, other = (signals(faulty(0, tooth, 2.0)).average for tooth in (1, 18))
    rotated = np.roll(first.values, 17 * 16, axis=0)
    largest = np.abs(first.residual).max(axis=0)
    assert (np.abs(other.values - rotated).max(axis=0) < 1e-7 * largest).all()


def test_the_residual_grows_with_a_small_error():
    """In proportion while contact lasts, at a torque that keeps it."""
    peaks = [
        entries(signals(faulty(0, 12, error)), "residual_peak")
        for error in (0.05, 0.1, 0.2)
    ]
    for smaller, larger in pairwise(peaks):
        np.testing.assert_allclose(larger / smaller, 2.0, rtol=1e-7)


def test_noise_of_the_residual_falls_with_the_root_of_the_turns():
    rms = [
        entries(
            signals(faulty(), turns=turns, noise_percent=50.0, seed=turns),
            "residual_rms",
        )
        for turns in (4, 64)
    ]
    np.testing.assert_allclose(rms[0] / rms[1], 4.0, rtol=0.2)


def test_a_fault_of_the_other_gear_is_averaged_away():
    """After 38 turns of the wheel its errors have met all teeth of the pinion."""
    gears = faulty(1, 9, 2.0)
    spread = [
        entries(signals(gears, gear_name="pinion", turns=turns), "sideband_amplitude")
        for turns in (5, 55)
    ]
    assert (spread[1] < 1e-6 * spread[0]).all()


def test_meshes_of_other_shafts_fall_out_after_the_turns_of_the_motion():
    """Mesh 2 has 51 * 19 / 72 cycles in a turn of the pinion."""
    gears, sidebands = load_gear_set("liu-countershaft"), []
    for turns in (24, 16):
        result = signals(gears, torque=None, turns=turns, samples=64)
        assert result.summary["motion_repeats_turns"] == 24
        assert ("repeats after 24 turns" in str(list(result.page()))) == (turns == 16)
        sidebands.append(entries(result, "sideband_amplitude"))
    # what remains are harmonics of mesh 2 above half the sampling rate
    assert (sidebands[0] < 0.05 * sidebands[1]).all()


def test_orders_and_tables():
    result = signals(faulty(1, 9, 2.0, "liu-idler"), gear_name="idler", turns=1)
    values = result.summary
    assert values["mesh_orders"] == [55]
    assert values["gear_speed_rpm"] == pytest.approx(60.0 * 500.0 / 55)
    assert values["sampling_rate_Hz"] == pytest.approx(16 * 500.0)
    lines = list(result.more_tables["spectrum"].rows())
    assert lines[54][:4] == (54, pytest.approx(54 * 500 / 55), 1, -1)
    assert lines[1][:4] == (1, pytest.approx(500 / 55), 0, 1)
    average = list(result.more_tables["average"].rows())
    assert len(average) == 55 * 16
    assert [row[1] for row in average[:16]] == [1] * 8 + [2] * 8
    assert len(list(result.table.rows())) == 55 * 16


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"gear_name": "z"}, "gear_name = z; liu-pair has pinion, idler"),
        ({"turns": 10_000, "samples": 1024}, f"at most {MAX_SAMPLES} are allowed"),
        ({"model": replace(MODEL, friction=0.1, bending=0.3)}, "without friction"),
        ({"gear_set": "planetary-24-36-96", "pulses": 3}, "pulses = 3; a tachometer"),
        ({"sensor_deg": 30.0}, "sensor_deg = 30; needs a planetary set, liu-pair is"),
    ],
)
def test_what_has_no_signals_is_refused(settings, message):
    with pytest.raises(InputError, match=message):
        signals(settings.pop("gear_set", faulty()), **settings)


def test_a_motion_that_does_not_repeat_is_refused():
    model = replace(MODEL, damping_ratio=1e-4)
    with pytest.raises(InputError, match="500 Hz does not repeat"):
        signals(faulty(), model=model, integration=Settings(max_periods=40))


def test_hdf5_has_all_tables_with_units(tmp_path):
    h5py = pytest.importorskip("h5py")
    result = signals(faulty(0, 12, 2.0), turns=2)
    result.write(tmp_path / "s.h5")
    with h5py.File(tmp_path / "s.h5") as file:
        assert set(file) == {"table", "average", "spectrum", "orders"}
        for column, name in enumerate(result.names):
            expected = result.values[:, column]
            np.testing.assert_array_equal(file[f"table/{name}"][()], expected)
        assert file["table/mesh1_dte_m"].attrs["units"] == "m"
        assert file["average/tooth"].shape == result.tooth.shape
        assert file.attrs["gear"] == "pinion"


def ramp(gears, **settings):
    defaults = {"speed": (500.0, 900.0), "seconds": 0.4}
    return signals(gears, **defaults | {"turns": 16} | settings)


@pytest.mark.parametrize("speed", [(500.0, 900.0), (900.0, 500.0)])
def test_a_ramp_has_the_tooth_that_differs(speed):
    result = ramp(faulty(0, 12, 2.0), speed=speed)
    assert entries(result, "tooth").tolist() == [12] * 3
    assert (entries(result, "residual_kurtosis") > 5.0).all()  # 3 of noise
    values = result.summary
    assert values["turns"] == int(700.0 * 0.4 / 38)
    assert values["sampling_rate_Hz"] == pytest.approx(16 * 900.0)
    assert (values["speed_Hz"], values["end_speed_Hz"]) == speed
    first, *_, last = result.table.rows()
    assert first[:3] == (0.0, 0.0, pytest.approx(60.0 * speed[0] / 38))
    assert last[0] == pytest.approx(0.4, abs=1.0 / (16 * 900.0))
    assert last[1] == pytest.approx(280.0 / 38, rel=1e-3)
    assert last[2] == pytest.approx(60.0 * speed[1] / 38, rel=1e-3)


def test_healthy_gears_have_lines_of_the_mesh_alone_through_a_ramp():
    """But for the change of the amplitudes with speed, which smears them."""
    result = ramp(faulty(), seconds=2.0)
    orders = result.orders
    amplitude = orders.amplitude[:, :, 0]
    near = np.abs(orders.order - 38.0 * np.round(orders.order / 38.0)) <= 2.0
    mesh = amplitude[:, orders.order == 38.0].min()
    assert amplitude[:, ~near].max() < 0.01 * mesh
    assert orders.turns[0] == 2.0
    rows = list(result.more_tables["orders"].rows())
    assert len(rows) == orders.amplitude.shape[0] * orders.order.size
    assert rows[0][:3] == (2.0, pytest.approx(result._window_rpm[0]), 0.0)
    names = result.more_tables["spectrum"].names
    assert "frequency_Hz" not in names


@pytest.mark.parametrize("speed", [(500.0, 900.0), 500.0])
def test_pulses_of_a_tachometer_follow_the_gear(speed):
    """Vibration moves them by a part of the sampling step."""
    settings = {"speed": speed, "seconds": 0.4 if speed != 500.0 else None}
    by_speed, by_pulses = (
        signals(faulty(0, 12, 2.0), turns=5, pulses=pulses, **settings)
        for pulses in (0, 4)
    )
    turns = by_pulses.average.turns
    assert by_speed.average.turns - turns in (0, 1)
    assert entries(by_pulses, "tooth").tolist() == [12] * 3
    peaks = [entries(result, "residual_peak") for result in (by_speed, by_pulses)]
    np.testing.assert_allclose(peaks[1], peaks[0], rtol=0.1)
    assert by_pulses.summary["pulses_per_turn"] == 4


def test_a_ramp_of_a_set_with_bearings_says_what_turns_it():
    result = ramp(load_gear_set("liu-idler"), model=replace(MODEL, translations=True))
    assert len(result.names) == 2 + 3 + 6
    lines = [part for part in result.page() if isinstance(part, str)]
    assert any("inertial forces of the mean acceleration" in line for line in lines)
    assert "ramp" in result.table.header
    assert set(result.figures) == {"plot", "order_map"}
    assert set(signals(faulty()).figures) == {"plot"}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"seconds": None}, "seconds is missing; a ramp"),
        ({"speed": 500.0}, "seconds = 0.4; needs a speed A:B"),
        ({"speed": (500.0, 500.0)}, "speeds of a ramp must differ"),
        ({"seconds": 0.05}, "pinion turns 0.921 times, 1 turn is needed"),
        ({"pulses": 1, "seconds": 0.2}, "makes 3.68 pulses, 4 or more are needed"),
        ({"integration": Settings(method="dopri5")}, "must be rk4 for a ramp"),
    ],
)
def test_a_ramp_that_gives_no_signals_is_refused(settings, message):
    with pytest.raises(InputError, match=message):
        ramp(faulty(), **settings)


@pytest.mark.slow
def test_signals_of_the_coupled_model_have_the_tooth():
    """At constant speed, and through a ramp."""
    source = fegear.ExcitationSettings(resolution="coarse")
    model = fegear.LumpedModel(number="coupled", excitation=source)
    settings = {"model": model, "integration": Settings(), "samples": 64}
    for at in ({"speed": 570.0}, {"speed": (560.0, 580.0), "seconds": 0.25}):
        result = signals(faulty(0, 12, 3.0), turns=2, **settings | at)
        assert entries(result, "tooth").tolist() == [12] * 3
        assert (entries(result, "residual_kurtosis") > 10.0).all()
        # 4.08 um of finite elements of fidelity reduced at 570 Hz
        peak = result.summary["signals"][0]["residual_peak"]
        assert peak == pytest.approx(4.08e-6, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, "coupled"])
def test_a_ramp_of_hardly_any_rate_has_the_cracked_tooth(number):
    """As at constant speed."""
    cracked = "gear.1.cracks=[{ tooth = 12, depth_mm = 1.5 }]"
    gears = GearSetRef(name="liu-pair", edits=(cracked,))
    source = fegear.ExcitationSettings(resolution="coarse")
    model = fegear.LumpedModel(number=number, excitation=source)
    settings = {"model": model, "integration": Settings(tolerance=1e-8)}
    steady = signals(gears, speed=570.0, turns=2, **settings)
    speed, seconds = (570.0, 570.0001), 2 * 38 / 570.0
    slow = ramp(gears, speed=speed, seconds=seconds, **settings)
    count = min(len(steady.values), len(slow.values))
    error = np.abs(slow.values[:count] - steady.values[:count]).max(axis=0)
    assert (error < 2e-3 * np.ptp(steady.values, axis=0)).all()
    assert steady.summary["signals"][0]["tooth"] == 12


@pytest.mark.parametrize("gear", ["pinion", "idler"])
def test_a_broken_tip_is_at_its_own_tooth(gear):
    """A driving tooth leaves contact with its tip, a driven one enters with it."""
    edit = f"gear.{gear}.broken_tips=[{{ tooth = 10, height_mm = 1.2 }}]"
    source = fegear.ExcitationSettings(resolution="coarse")
    result = fegear.run(
        fegear.Signals(
            gear_set=GearSetRef(name="liu-pair", edits=(edit,)),
            rpm=1500.0,
            gear_name=gear,
            turns=2,
            samples=32,
            model=fegear.LumpedModel(number=1, excitation=source),
        )
    )
    assert entries(result, "tooth").tolist() == [10] * 3
    assert (
        entries(result, "residual_tooth_rms") > entries(result, "residual_rms")
    ).all()


RANDOM_FAULTS = 12


def random_fault(rng: np.random.Generator) -> tuple[dict, int, int]:
    """A pair with a fault of one tooth of either gear; and the gear, and the tooth."""
    ratio = float(rng.uniform(1.2, 2.2))
    high = ratio > 1.75
    counts = [int(rng.integers(*((30, 50) if high else (20, 38)))) for _ in range(2)]
    module = float(rng.choice([1.5, 2.0, 3.0]))
    gears = [
        {"name": name, "teeth": z, "hub_radius_mm": 0.25 * module * z}
        for name, z in zip("ab", counts, strict=True)
    ]
    number = int(rng.integers(2))
    tooth = int(rng.integers(1, counts[number] + 1))
    if rng.random() < 0.5:
        errors = [0.0] * counts[number]
        errors[tooth - 1] = float(rng.uniform(3.0, 15.0))
        gears[number]["pitch_errors_um"] = errors
    else:
        depth = float(rng.uniform(0.4, 0.8)) * module
        gears[number]["cracks"] = [{"tooth": tooth, "depth_mm": depth}]
    rack = {"pressure_angle_deg": 17.5, "dedendum_mm": 1.7 * module} if high else {}
    tables = {
        "name": "random",
        "defaults": {"module_mm": module, "face_width_mm": 8 * module, **rack},
        "gear": gears,
        "mesh": [
            {
                "driver": "a",
                "driven": "b",
                "contact_ratio": round(ratio, 3),
                "backlash_um": 60.0,
            }
        ],
        "load": {"gear": "a", "torques_Nm": [50.0 * module]},
        "dynamics": {"damping_ratio": 0.05},
    }
    if high:
        tables["defaults"]["rack_tip_radius_mm"] = 0.2 * module
    return tables, number, tooth


@pytest.mark.slow
def test_signals_name_the_faulty_tooth_of_random_pairs():
    """Faults of whole engagements, contact ratios of 1.2 to 2.2, either gear."""
    rng, named, runs = np.random.default_rng(20261128), [], 0
    elements = fegear.ExcitationSettings(resolution="coarse", positions=32)
    model = fegear.LumpedModel(number=1, excitation=elements)
    while runs < RANDOM_FAULTS:
        tables, number, tooth = random_fault(rng)
        rpm = float(rng.uniform(200.0, 2500.0))
        try:
            gears = fegear.make_gear_set(tables)
        except InputError:  # an undercut leaves a smaller contact ratio
            continue
        result = fegear.run(
            fegear.Signals(
                gear_set=gears,
                rpm=rpm,
                turns=2,
                gear_name="ab"[number],
                samples=64,
                model=model,
            )
        )
        named.append(entries(result, "tooth") == tooth)
        runs += 1
    assert np.mean(named, axis=0)[0] == 1.0
    assert np.mean(named) > 0.95


def test_signals_that_name_different_teeth_say_so():
    """Noise alone decides where all teeth are alike."""
    result = signals(faulty(), noise_percent=50.0, seed=3)
    named = entries(result, "tooth")
    lines = [line for line in result.summary["warnings"] if line.endswith("[W65]")]
    assert len(lines) == (len(set(named.tolist())) > 1)
    assert lines
    one = signals(faulty(0, 8, 5.0))
    assert not [line for line in one.summary["warnings"] if line.endswith("[W65]")]
