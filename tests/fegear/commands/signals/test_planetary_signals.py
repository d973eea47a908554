"""Signals of planetary sets, beside closed forms and the balance of forces."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

import fegear
from fegear.studies.trains.gear_sets import GearSetRef
from lumped import Settings
from lumped.closed_forms.planet_passing import passing_amplitudes, phasor_sums
from lumped.signals.coordinate_motion import CoordinateMotion, coordinate_motion
from lumped.steady.motion import bounded_response
from lumped.steady.steady_state import Speed
from lumped.steady.steppers import stepper_of

WAVES = tuple(
    f"planetary.1.{side}.{key}={value}"
    for side, mean in (("sun_mesh", 3e8), ("ring_mesh", 4e8))
    for key, value in (
        ("mean_stiffness_N_per_m", mean),
        ("stiffness_variation", 0.3),
        ("load_share", 0.5),
    )
)
MODEL = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="trapezoid")
)
MOVING = replace(MODEL, translations=True)
RECTANGULAR = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)
FINE = Settings(tolerance=1e-11, steps=256)
TEETH_94 = ("gear.sun.teeth=26", "gear.planet.teeth=34", "gear.ring.teeth=94")
SETS = {
    "in phase": ("planetary.1.planets=3",),
    "sequential": (*TEETH_94, "planetary.1.planets=3"),
    "counter-phased": (*TEETH_94, "planetary.1.planets=4"),
    "mixed": (
        *TEETH_94,
        "planetary.1.planets=4",
        "planetary.1.positions_deg=[0,93,180,273]",
    ),
    "unequal": ("planetary.1.positions_deg=[0,99,201]",),
}


def study_of(*edits, **settings):
    defaults = {"speed": 900.0, "torque": 60.0, "model": MODEL, "turns": 1}
    defaults |= {"integration": FINE, "samples": 64, "gear_name": "carrier"}
    gear_set = GearSetRef(name="planetary-24-36-96", edits=(*WAVES, *edits))
    return fegear.Signals(gear_set=gear_set, **defaults | settings)


def test_round_off_of_slow_speeds_is_no_damage():
    """Sound teeth at 0.3 Hz have no kurtosis, although speeds have round-off."""
    carrier = study_of(*SETS["sequential"], speed=0.3, samples=16)
    result = fegear.run(replace(carrier, integration=Settings(), model=RECTANGULAR))
    for entry in result.summary["signals"]:
        if entry["signal"] != "ring_sensor_force_N":  # planets pass it
            assert entry["residual_kurtosis"] is None
            assert entry["fm4"] is None


def motion_of(study) -> CoordinateMotion:
    problem = study.prepare()
    response, _, settings = bounded_response(
        problem.system, study.frequency, problem.integration
    )
    at = response.state, Speed(study.frequency, settings), response.multiple
    stepper = stepper_of(problem.system, settings)
    _, history = stepper.record(*at, with_states=True)
    return coordinate_motion(problem.system, history)


def sensor_of(result, name="ring_sensor_force_N"):
    return result.names.index(name)


@pytest.mark.parametrize("name", SETS)
def test_orders_of_the_sensor_are_those_of_the_passing_planets(name):
    study = study_of(*SETS[name], sensor_deg=25.0, sensor_window_deg=75.0)
    result, motion = fegear.run(study), motion_of(study)
    carrier = study.gear_set.loaded.carrier
    teeth, angles = carrier.members.ring, np.array(carrier.angles)
    times = np.arange(64) / (64 * study.speed)
    forces = motion.mesh_force(times)[:, 1::2]
    harmonics = np.fft.rfft(forces, axis=0).T / 64
    harmonics[:, -1] *= 0.5  # of both signs
    order = np.arange(4 * teeth)
    expected = passing_amplitudes(
        harmonics,
        angles,
        teeth,
        order,
        sensor=math.radians(25.0),
        width=math.radians(75.0),
    )
    amplitude = result.average.amplitude[order, sensor_of(result)]
    assert np.abs(amplitude - expected).max() < 1e-6 * expected[1:].max()


@pytest.mark.parametrize("name", ["in phase", "sequential", "counter-phased"])
def test_planets_that_are_alike_leave_multiples_of_their_number(name):
    # samples and steps that a third of a cycle divides
    settings = {"samples": 48, "integration": replace(FINE, steps=768)}
    result = fegear.run(study_of(*SETS[name], **settings))
    carrier = result.study.gear_set.loaded.carrier
    amplitude = result.average.amplitude[:, sensor_of(result)]
    order = np.arange(amplitude.size)
    sums = phasor_sums(carrier.angles, order)
    assert amplitude[sums < 1e-9].max() < 1e-6 * amplitude[1:].max()
    mesh = amplitude[carrier.members.ring]
    is_multiple = carrier.members.ring % len(carrier.planets) == 0
    assert (mesh > 1e-3 * amplitude[1:].max()) == is_multiple


def test_the_sun_and_the_planets_turn_against_the_carrier():
    """18 teeth a second at 5 Hz and so on; the ring has the turns of the carrier."""
    turns = {
        name: fegear.run(study_of(gear_name=name, samples=8)).summary
        for name in ("sun", "planet-2", "ring", "carrier")
    }
    rpm = [values["gear_speed_rpm"] for values in turns.values()]
    np.testing.assert_allclose(rpm, 60.0 * 900.0 / np.array([24, 36, 96, 96]))
    repeats = [values["motion_repeats_turns"] for values in turns.values()]
    assert repeats == [4, 8, 1, 1]
    assert turns["carrier"]["gear"] == "carrier"


def test_planets_press_on_the_carrier_with_its_torque():
    """Mean of the force on each planet's bearing: along its circle, 300 N m in all."""
    result = fegear.run(study_of(model=MOVING))
    mean = dict(zip(result.names, result.values.mean(axis=0), strict=True))
    carrier = result.study.gear_set.loaded.carrier
    force = 5.0 * 60.0 / (3 * carrier.radius)
    for number, angle in enumerate(carrier.angles, start=1):
        x, y = (mean[f"planet-{number}_bearing_{axis}_N"] for axis in "xy")
        radial = x * math.cos(angle) + y * math.sin(angle)
        along = y * math.cos(angle) - x * math.sin(angle)
        assert abs(along) == pytest.approx(force, rel=1e-6)
        assert abs(radial) < 1e-6 * force
    for body in ("sun", "ring", "carrier"):
        assert abs(mean[f"{body}_bearing_x_N"]) < 1e-6 * force


def test_the_speed_of_the_carrier_is_that_of_its_rotation():
    study = study_of()
    result, motion = fegear.run(study), motion_of(study)
    column = motion.system.modes.coordinates.labels.index(("carrier", "rotation"))
    expected = motion.at(result.time)[1][:, column]
    signal = result.values[:, sensor_of(result, "carrier_speed_deviation_rad_per_s")]
    np.testing.assert_allclose(signal, expected, atol=1e-9 * np.abs(expected).max())


def test_the_acceleration_is_that_of_the_ring_in_space():
    """Second differences of its displacement toward the sensor, which stands still."""
    study = study_of(*SETS["unequal"], model=MOVING, sensor_deg=40.0, samples=16)
    result, motion = fegear.run(study), motion_of(study)
    system = motion.system
    columns = [system.modes.coordinates.labels.index(("ring", a)) for a in "xy"]
    carrier_speed = system.train.carrier_angular_speed(study.speed)

    def toward_sensor(time):
        x = motion.at(time)[0][:, columns] @ (1.0, 1j)
        return (x * np.exp(1j * (carrier_speed * time - math.radians(40.0)))).real

    step = 1.0 / (256 * study.speed)
    time = result.time[1:]
    parts = [toward_sensor(time + shift) for shift in (-step, 0.0, step)]
    expected = (parts[0] - 2.0 * parts[1] + parts[2]) / step**2
    signal = result.values[1:, sensor_of(result, "ring_sensor_acceleration_m_per_s2")]
    assert np.abs(signal - expected).max() < 0.02 * np.abs(expected).max()
    error = np.sqrt(((signal - expected) ** 2).mean())
    assert error < 5e-3 * np.sqrt((expected**2).mean())


HUNTING = ("gear.sun.teeth=27", "gear.planet.teeth=31", "gear.ring.teeth=89")
QUICK = {"integration": Settings(tolerance=1e-8, steps=128), "samples": 32}


def damaged(gear, tooth, teeth, *edits, error=2.0, **settings):
    """Signals of four planets with a tooth of one gear that is set back [um]."""
    errors = [error * (number == tooth) for number in range(1, 1 + teeth)]
    edits = *edits, "planetary.1.planets=4", f"gear.{gear}.pitch_errors_um={errors}"
    return fegear.run(study_of(*edits, gear_name=gear, **QUICK | settings))


def teeth_of_meshes(result):
    """Teeth that transmission errors of the gear's meshes name, and no other signal."""
    entries = result.summary["signals"]
    return {e["signal"]: e["tooth"] for e in entries if e["tooth"] is not None}


@pytest.mark.parametrize(
    ("edits", "teeth", "turns"), [((), 36, 8), (HUNTING, 31, 89)], ids=["36", "31"]
)
@pytest.mark.parametrize("error", [2.0, -2.0])
def test_the_damaged_planet_of_four_and_its_tooth(edits, teeth, turns, error):
    """Its residual is about N - 1 times that of each other."""
    result = damaged("planet-3", 12, teeth, *edits, error=error, turns=turns)
    values = result.summary
    assert (values["differing_gear"], values["differing_tooth"]) == ("planet-3", 12)
    assert "planet-3 at tooth 12 differs most" in str(list(result.page()))
    rms = {entry["gear"]: entry["residual_rms"] for entry in values["separated"]}
    for other in ("planet-1", "planet-2", "planet-4"):
        assert rms["planet-3"] / rms[other] == pytest.approx(3.0, rel=0.1)
    assert teeth_of_meshes(result) == {"mesh5_dte_m": 12, "mesh6_dte_m": 12}


@pytest.mark.parametrize("error", [1.0, -2.0])
def test_the_tooth_of_a_planet_among_members_on_bearings(error):
    """A fault shows in the mesh that it is in, half a turn later in the other."""
    settings = {"turns": 89, "model": MOVING}
    result = damaged("planet-4", 5, 31, *HUNTING, error=error, **settings)
    assert teeth_of_meshes(result) == {"mesh7_dte_m": 5, "mesh8_dte_m": 5}
    assert result.summary["differing_gear"] == "planet-4"
    assert result.summary["differing_tooth"] == 5


def test_the_damaged_tooth_of_the_sun_meets_all_planets_alike():
    result = damaged("sun", 5, 27, *HUNTING, turns=103)
    values = result.summary
    assert (values["differing_gear"], values["differing_tooth"]) == ("sun", 5)
    _, *planets = [entry["residual_rms"] for entry in values["separated"]]
    assert max(planets) < 1.3 * min(planets)  # 0.2 turns more have one planet twice
    meshes = {f"mesh{number}_dte_m": 5 for number in (1, 3, 5, 7)}
    assert teeth_of_meshes(result) == meshes


def test_equal_teeth_of_the_sun_at_the_sensor_leave_two_gears_open():
    """24 and 36 teeth pass a ring of 96 in one sequence."""
    result = damaged("sun", 7, 24, turns=12)
    assert result.summary["differing_gear"] is None
    assert "not sure whether sun at tooth 7 or planet-" in str(list(result.page()))


def test_too_few_turns_are_said():
    result = damaged("planet-3", 12, 31, *HUNTING, turns=10)
    assert result.summary["differing_gear"] is None
    entries = {entry["gear"]: entry for entry in result.summary["separated"]}
    assert entries["planet-2"]["carrier_turns_needed"] == 31
    assert entries["planet-2"]["windows"] is entries["planet-2"]["tooth"] is None
    assert "planet-2" not in set(result.more_tables["separated"]["gear"])


def test_teeth_that_are_alike_have_no_separated_residual():
    result = fegear.run(study_of(gear_name="sun", turns=12))
    for entry in result.summary["separated"]:
        assert entry["tooth"] is None
        assert entry["residual_rms"] < 1e-9 * 900.0
    table = result.more_tables["separated"]
    assert list(dict.fromkeys(table["gear"])) == [
        *("sun", "planet-1", "planet-2", "planet-3")
    ]
    assert np.bincount(table["tooth"])[1:25].tolist() == [64 * 4] * 24


def test_a_ramp_has_the_sensor_over_the_turns_of_the_carrier():
    """Planets pass at the same angles whatever the speed; forces are nearly alike."""
    settings = QUICK | {"samples": 64}
    ramp = fegear.run(study_of(speed=(300.0, 600.0), seconds=0.5, **settings))
    slow = fegear.run(study_of(speed=300.0, turns=2, **settings))
    passing, constant = (
        result.average.amplitude[3, sensor_of(result)] for result in (ramp, slow)
    )
    assert passing == pytest.approx(constant, rel=1e-3)


def test_noise_names_no_tooth_of_teeth_that_are_alike():
    edits = (*HUNTING, "planetary.1.planets=4")
    settings = QUICK | {"gear_name": "sun", "turns": 103, "noise_percent": 10.0}
    result = fegear.run(study_of(*edits, **settings))
    assert result.summary["differing_gear"] is None
    for entry in result.summary["separated"]:
        assert 2.5 < entry["residual_kurtosis"] < 4.0  # windows differ in their number


ROLES = ("sun", "carrier", "ring")


@pytest.mark.parametrize("roles", list(permutations(ROLES)), ids="-".join)
def test_the_damaged_planet_whatever_member_is_held(roles):
    """Senses of rotation and drivers of the meshes differ; sensors are anywhere."""
    keys = zip(("input", "output", "held"), roles, strict=True)
    edits = [f"planetary.1.{key}={member}" for key, member in keys]
    edits.append(f"load.gear={roles[0]}")
    settings = {"turns": 89, "sensor_deg": -77.0}
    result = damaged("planet-2", 5, 31, *HUNTING, *edits, **settings)
    values = result.summary
    assert (values["differing_gear"], values["differing_tooth"]) == ("planet-2", 5)
    assert teeth_of_meshes(result) == {"mesh3_dte_m": 5, "mesh4_dte_m": 5}


@pytest.fixture(scope="module")
def recorded():
    """Signals of four planets, one damaged, over 31 turns of the carrier."""
    errors = [2.0 * (tooth == 12) for tooth in range(1, 32)]
    edits = (*HUNTING, "planetary.1.planets=4")
    fault = f"gear.planet-3.pitch_errors_um={errors}"
    return fegear.run(study_of(*edits, fault, **QUICK | {"turns": 31}))


def measured(path, gear_name, **settings):
    """The sensor's recording on a set without the fault."""
    edits = (*WAVES, *HUNTING, "planetary.1.planets=4")
    gear_set = GearSetRef(name="planetary-24-36-96", edits=edits)
    defaults = {"measured": str(path), "computed": False, "samples": 32}
    defaults |= {"channels": ("acc",), "gear_name": gear_name}
    return fegear.run(fegear.Signals(gear_set=gear_set, **defaults | settings))


def recording(recorded, folder, rpm):
    """File with the force of the sensor and the speed of a shaft [rpm]."""
    path = folder / "rec.csv"
    columns = recorded.time, recorded.values[:, sensor_of(recorded)]
    rows = np.stack([*columns, np.full(recorded.time.size, rpm)], axis=1)
    header = "time_s,acc,rpm"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.12g")
    return path


@pytest.mark.parametrize(
    ("gear", "cycles_per_turn"), [("sun", 27 * 89 / 116), ("carrier", 89.0)]
)
def test_a_recording_names_the_damaged_planet(
    recorded, tmp_path, gear, cycles_per_turn
):
    """The speed measured is that in space: of the sun 116 / 89 of that of its turns."""
    path = recording(recorded, tmp_path, 60.0 * 900.0 / cycles_per_turn)
    result = measured(path, gear, speed_channel="rpm")
    entries = {entry["gear"]: entry for entry in result.summary["separated"]}
    expected = {entry["gear"]: entry for entry in recorded.summary["separated"]}
    for name in ("planet-1", "planet-3"):
        rms = expected[name]["residual_rms"]
        assert entries[name]["residual_rms"] == pytest.approx(rms, rel=0.01)
    assert entries["planet-3"]["tooth"] == 12
    assert "acc: planet-3 at tooth 12 differs most" in str(list(result.page()))
    teeth = {"sun": 27, "carrier": 89}[gear]
    speed = result.summary["gear_speed_rpm"]
    assert speed == pytest.approx(60.0 * 900.0 / teeth)
    assert set(result.more_tables["separated"]["gear"]) >= {"planet-1", "planet-4"}


def test_a_recording_at_constant_speed_has_the_average_of_the_carrier(
    recorded, tmp_path
):
    path = recording(recorded, tmp_path, 1.0)
    result = measured(path, "carrier", speed=900.0)
    average = result.gear_averages.average.values[:, 0]
    expected = recorded.average.values[:, sensor_of(recorded)]
    error = np.abs(average - expected).max()
    assert error < 1e-6 * np.abs(expected).max()


def test_a_picture_has_the_meshes_of_the_gear_and_the_sensor():
    result = damaged("planet-3", 12, 36, turns=8)
    averages = result.averages
    assert [averages.names[c] for c in averages.shown] == [
        *("mesh5_dte_m", "mesh6_dte_m", "planet-3_speed_deviation_rad_per_s"),
        "ring_sensor_force_N",
    ]
    figure = result.figures["separated_plot"]()
    labels = [axes.get_ylabel() for axes in figure.axes[::2]]
    gears = "sun", "planet-1", "planet-2", "planet-3", "planet-4"
    assert labels == [f"{gear}\n[N]" for gear in gears]
    residuals = [axes.get_ylim() for axes in figure.axes[1::2]]
    assert len(set(residuals)) == 1
    assert residuals[0][1] > max(
        e["residual_peak"] for e in result.summary["separated"]
    )
