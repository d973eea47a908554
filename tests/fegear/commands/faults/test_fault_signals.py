"""Labelled sets of signals: their labels, noise, order, files and refusals."""

from __future__ import annotations

import json
import pickle
import tomllib
from contextlib import suppress
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from cli_commands import printed
from scipy.io import loadmat, netcdf_file

import fegear
from fegear.commands.faults.axes import FAULTS, GearSetEdits
from fegear.commands.faults.problem import MAX_SAMPLES, RunComputations, noise_seed
from fegear.commands.faults.study import random_points
from fegear.files.contents import exact_repr
from fegear.files.errors import InputError
from fegear.files.store import CheckpointOptions
from fegear.gearset.read import load_tables
from fegear.studies.page import RowTable
from fegear.studies.trains.gear_sets import GearSetRef
from lumped import Settings
from lumped.common.workers import Cluster
from lumped.steady.maps import Axis

MODEL = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)
FINE = Settings(tolerance=1e-10, steps=64)
SIGNALS = [
    *("mesh1_dte_m", "pinion_speed_deviation_rad_per_s"),
    "idler_speed_deviation_rad_per_s",
]


def study(*over, **settings):
    defaults = {"gear_set": "liu-pair", "rpm": 900.0, "torque": 100.0, "turns": 2}
    defaults |= {"samples": 8, "tooth": 12, "model": MODEL, "integration": FINE}
    return fegear.FaultSignals(over=over, **defaults | settings)


def signals_of_run(result, run, **settings):
    """What `fegear signals` gives for a run of axes pitch_error and speed."""
    labels = {name: values[run] for name, values in result.labels.items()}
    errors = [0.0] * 38
    errors[labels["faulty_tooth"] - 1] = float(labels["pitch_error_um"])
    edits = (f"gear.pinion.pitch_errors_um={errors}",)
    return fegear.run(
        fegear.Signals(
            gear_set=GearSetRef(name="liu-pair", edits=edits),
            rpm=float(labels["speed_rpm"]),
            torque=float(labels["torque_Nm"]),
            turns=2,
            samples=8,
            **{"model": MODEL, "integration": FINE} | settings,
        )
    )


@pytest.fixture(scope="module")
def noisy():
    """Two errors, two speeds and two repetitions with noise."""
    axes = "pitch_error=0,2", "speed=900,1100", "seed=5,6"
    return study(*axes, noise_percent=20.0, rpm=None)


@pytest.fixture(scope="module")
def result(noisy):
    return fegear.run(noisy, workers=2)


def test_labels_are_the_inputs(result):
    points = np.array(list(product((0.0, 2.0), (900.0, 1100.0), (5, 6))))
    columns = "pitch_error_um", "speed_rpm", "seed"
    for name, expected in zip(columns, points.T, strict=True):
        np.testing.assert_array_equal(result.labels[name], expected)
    assert result.labels["run"].tolist() == [*range(1, 9)]
    faulty = points[:, 0] != 0.0
    assert result.labels["faulty_tooth"].tolist() == [12 * has for has in faulty]
    assert set(result.labels["torque_Nm"]) == {100.0}
    assert set(result.labels["noise_percent"]) == {20.0}
    rate = result.labels["speed_rpm"] / 60.0 * 38 * 8
    np.testing.assert_allclose(result.labels["sampling_rate_Hz"], rate, rtol=1e-14)
    assert result.runs.settled.all()


@pytest.mark.parametrize("run", [0, 5, 7])
def test_a_run_is_that_of_signals_to_the_bit(result, run):
    """With the noise seed that the table names, noise included."""
    seed = int(result.labels["noise_seed"][run])
    single = signals_of_run(result, run, noise_percent=20.0, seed=seed)
    assert list(result.runs.names) == list(single.names) == SIGNALS
    np.testing.assert_array_equal(result.runs.values[run].T, single.values)
    np.testing.assert_array_equal(result.runs.average[run].T, single.average.values)
    for c, entry in enumerate(single.summary["signals"]):
        for name in ("residual_rms", "residual_peak", "residual_kurtosis", "tooth"):
            assert result.runs.indicators[name][run, c] == entry[name]
    rms = result.runs.indicators["rms"][run]
    np.testing.assert_allclose(rms, single.values.std(axis=0), rtol=1e-13)


def test_runs_without_noise_are_those_of_signals_too(result):
    clean = fegear.run(study("pitch_error=0,2", "speed=900,1100", rpm=None))
    for run in range(4):
        single = signals_of_run(clean, run)
        np.testing.assert_array_equal(clean.runs.values[run].T, single.values)
    assert np.isnan(clean.runs.indicators["tooth"][:2]).all()
    assert (clean.runs.indicators["tooth"][2:, 0] == 12).all()


@pytest.mark.slow
def test_a_run_of_the_coupled_model_is_that_of_signals_to_the_bit():
    source = fegear.ExcitationSettings(resolution="coarse")
    model = fegear.LumpedModel(number="coupled", excitation=source)
    settings = {"model": model, "integration": Settings()}
    runs = fegear.run(study("pitch_error=0,3", **settings))
    assert runs.runs.settled.all()
    single = signals_of_run(runs, 1, **settings)
    np.testing.assert_array_equal(runs.runs.values[1].T, single.values)
    assert runs.runs.indicators["tooth"][1, 0] == 12


def test_noise_differs_from_run_to_run_and_not_with_workers(noisy, result):
    assert len(set(result.labels["noise_seed"])) == 8
    alone = fegear.run(noisy, workers=1)
    np.testing.assert_array_equal(alone.runs.values, result.runs.values)
    assert alone.table.csv() == result.table.csv()
    assert noise_seed(3, 7) == noise_seed(3, 7) != noise_seed(7, 3)
    assert 0 <= noise_seed(1, 0) < 2**32


def test_runs_can_go_to_other_processes(noisy, result):
    """As they are sent: systems with what they have worked out, and what is asked."""
    runs = RunComputations(noisy.prepare())
    arrays = pickle.loads(pickle.dumps(runs["6"]))()
    np.testing.assert_array_equal(arrays["values"], result.runs.values[5])


@pytest.mark.slow
def test_runs_of_a_cluster_are_those_of_threads(noisy, result):
    pytest.importorskip("distributed")
    cluster = fegear.run(noisy, workers=Cluster())
    np.testing.assert_array_equal(cluster.runs.values, result.runs.values)
    assert cluster.table.csv() == result.table.csv()


def test_interrupted_and_resumed_is_whole_to_the_byte(noisy, result, tmp_path):
    checkpoint, path = tmp_path / "s.partial", tmp_path / "s.h5"
    options = CheckpointOptions(checkpoint=checkpoint)

    def stop(stage, done, total):
        if stage == "runs" and done == 3:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        fegear.run(noisy, options, stop, workers=1)
    assert checkpoint.exists()
    messages = []
    options = replace(options, resume=True)
    resumed = fegear.run(noisy, options, notify=messages.append)
    assert "runs are finished" in messages[0]
    pytest.importorskip("h5py")
    result.write(path)
    expected = path.read_bytes()
    resumed.write(path)
    assert path.read_bytes() == expected


def test_the_residual_grows_with_a_small_error():
    """In proportion while contact lasts."""
    grown = fegear.run(study("pitch_error=0.05,0.1,0.2", averages=True))
    rms = grown.runs.indicators["residual_rms"]
    np.testing.assert_allclose(rms[1:] / rms[:-1], 2.0, rtol=1e-7)
    assert grown.runs.values is None


def test_another_tooth_is_an_axis():
    moved = fegear.run(study("pitch_error=2", "tooth=3,38", tooth=1))
    assert moved.runs.indicators["tooth"][:, 0].tolist() == [3, 38]
    assert moved.labels["faulty_tooth"].tolist() == [3, 38]
    assert moved.summary["signals"][0]["runs_with_faulty_tooth"] == 2


def test_a_key_is_an_axis():
    key = "mesh.1.stiffness_variation"
    varied = fegear.run(study(f"{key}=0.2,0.4", "speed=900", rpm=None, tooth=1))
    assert varied.labels[key].tolist() == [0.2, 0.4]
    assert "faulty_tooth" not in varied.labels
    assert varied.summary["signals"][0]["runs_with_faulty_tooth"] is None
    rms = varied.runs.indicators["rms"][:, 0]
    assert rms[1] > 1.5 * rms[0]


def test_random_points_are_a_latin_hypercube():
    axes = Axis("pitch_error", (0.0, 3.0)), Axis("speed", (600.0, 1200.0))
    points = np.array(random_points(axes, 10, 4))
    assert random_points(axes, 10, 4) == tuple(map(tuple, points.tolist()))
    assert random_points(axes, 10, 5) != random_points(axes, 10, 4)
    cells = np.floor(10 * (points - [0.0, 600.0]) / [3.0, 600.0])
    for column in cells.T:
        assert sorted(column) == [*range(10)]
    whole = random_points((Axis("tooth", (1.0, 3.0)),), 60, 0)
    assert [whole.count((n,)) for n in (1.0, 2.0, 3.0)] == [20, 20, 20]


def test_a_random_set_is_reproducible():
    axes = "pitch_error=0:3:2", "speed=800:1200:2"
    first, again, other = (
        fegear.run(study(*axes, rpm=None, random=4, random_seed=seed, averages=True))
        for seed in (1, 1, 2)
    )
    assert first.table.csv() == again.table.csv() != other.table.csv()
    assert len(first.runs.statuses) == 4
    assert (first.labels["pitch_error_um"] <= 3.0).all()
    assert (first.labels["speed_rpm"] >= 800.0).all()


def test_files_hold_signals_and_labels(result, tmp_path):
    h5py = pytest.importorskip("h5py")
    for ending in (".h5", ".nc", ".mat", ".csv"):
        result.write(tmp_path / f"s{ending}")
    assert (tmp_path / "s.csv").read_text("utf-8") == result.table.csv()
    with h5py.File(tmp_path / "s.h5") as file:
        hdf5 = {name: file[f"signals/{name}"][()] for name in SIGNALS}
        assert file["labels/pitch_error_um"][()].tolist() == [0.0] * 4 + [2.0] * 4
        assert file["labels/status"].asstr()[0] == "periodic"
        assert dict(file["signals/mesh1_dte_m"].attrs)["units"] == "m"
        residual = file["residuals/mesh1_dte_m"][()]
        assert file["turn/tooth"].shape == (38 * 8,)
        assert file.attrs["command"].startswith("fegear faults liu-pair ")
    with netcdf_file(tmp_path / "s.nc", mmap=False) as file:
        netcdf = {name: file.variables[f"signals_{name}"][:] for name in SIGNALS}
        assert file.variables["labels_speed_rpm"].units == b"rpm"
    matlab = loadmat(tmp_path / "s.mat", simplify_cells=True)
    assert matlab["units"]["signals"]["mesh1_dte_m"] == "m"
    for c, name in enumerate(SIGNALS):
        expected = result.runs.values[:, c]
        np.testing.assert_array_equal(hdf5[name], expected)
        np.testing.assert_array_equal(netcdf[name], expected)
        np.testing.assert_array_equal(matlab["signals"][name], expected)
    rms = np.sqrt((residual**2).mean(axis=1))
    expected = result.runs.indicators["residual_rms"][:, 0]
    np.testing.assert_allclose(rms, expected, rtol=1e-12)


def test_names_of_gears_fit_into_every_file(tmp_path):
    h5py = pytest.importorskip("h5py")
    gears = fegear.load_gear_set("liu-pair")
    named = [
        replace(gear, name=name)
        for gear, name in zip(gears.gears, ("a/b", "日本"), strict=True)
    ]
    gears = replace(gears, gears=tuple(named))
    few = fegear.run(study("speed=900,950", gear_set=gears, rpm=None, tooth=1))
    for ending in (".h5", ".nc", ".mat"):
        few.write(tmp_path / f"s{ending}")
    signals = few.runs.values
    with h5py.File(tmp_path / "s.h5") as file:
        first = file["signals/a_b_speed_deviation_rad_per_s"][()]
        second = file["signals/日本_speed_deviation_rad_per_s"][()]
    np.testing.assert_array_equal(np.stack([first, second], axis=1), signals[:, 1:])
    with netcdf_file(tmp_path / "s.nc", mmap=False) as file:
        second = file.variables["signals_x____speed_deviation_rad_per_s"][:]
    np.testing.assert_array_equal(second, signals[:, 2])


def test_the_picture_shows_every_run_and_names_the_colours(result):
    """Residual and kurtosis over the first axis, a colour for each speed."""
    figure = result.figures["plot"]()
    left, right = figure.axes[:2]
    heights = np.concatenate([line.get_ydata() for line in left.lines])
    residual = 1e6 * result.runs.indicators["residual_rms"][:, 0]
    np.testing.assert_array_equal(np.sort(heights), np.sort(residual))
    assert set(np.concatenate([line.get_xdata() for line in left.lines])) == {0.0, 2.0}
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["speed [rpm] 900", "speed [rpm] 1100"]
    assert len({line.get_color() for line in right.lines}) == 2
    assert figure.axes[-1].get_xlabel() == "pitch error [um]"
    assert left.get_ylabel().endswith("[um]")


def test_runs_without_signals_keep_their_labels():
    """Teeth that jam are no gear set; a motion that does not repeat has no signals."""
    jammed = fegear.run(study("pitch_error=0,900", averages=True))
    assert jammed.runs.settled.tolist() == [True, False]
    assert jammed.runs.statuses[1].startswith("impossible: ")
    assert "teeth would jam" in jammed.runs.statuses[1]
    assert np.isnan(jammed.runs.average[1]).all()
    assert jammed.labels["pitch_error_um"].tolist() == [0.0, 900.0]
    (warning,) = jammed.summary["warnings"]
    begin, reason = warning.split("; the first, ")
    assert begin == "1 of 2 runs have no signals: 1 impossible"
    cause = reason.removesuffix(" [W48]")
    assert jammed.runs.statuses[1] == f"impossible: {cause}"
    with pytest.raises(InputError, match=r"no run has signals: impossible: .* jam"):
        fegear.run(study("pitch_error=900"))


@pytest.mark.parametrize(
    ("over", "settings", "message"),
    [
        ((), {}, "over = 0; one axis or more is needed"),
        (
            ("dent=0:1:2",),
            {},
            "over dent; allowed are speed, torque_Nm, noise_percent, ",
        ),
        (("pitch_eror=1",), {}, "pitch_error"),
        (("gear.1.mas_kg=1",), {"tooth": 1}, "unknown key mas_kg"),
        (("gear.1.teeth=30:40:2",), {"tooth": 1}, "all runs have the same gears"),
        (("speed=900",), {"tooth": 1}, "over speed; replaces rpm, leave that out"),
        (("pitch_error=1",), {"rpm": None}, "rpm RPM or over speed=A:B:N is needed"),
        (("pitch_error=1", "pitch_error=2"), {}, "pitch_error; is given twice"),
        (("pitch_error=1",), {"tooth": 39}, "tooth = 39; gear pinion has 38 teeth"),
        (("pitch_error=1", "tooth=39"), {"tooth": 1}, "tooth = 39; gear pinion has"),
        (("pitch_error=1", "tooth=1.5"), {"tooth": 1}, "tooth; must be whole numbers"),
        (("pitch_error=1", "tooth=2,-3"), {"tooth": 1}, "over tooth = -3; must be 1"),
        (("pitch_error=1", "tooth=2,0"), {"tooth": 1}, "over tooth = 0; must be 1 to"),
        (("pitch_error=1", "noise_percent=1,-5"), {}, "noise_percent = -5; must be 0"),
        (
            ("noise_percent=1", "seed=1,-5"),
            {"tooth": 1},
            "over seed = -5; must be 0 to 4294967295",
        ),
        (("noise_percent=1", "seed=1e19"), {"tooth": 1}, "over seed = 1e+19; must be"),
        (("speed=900,-1",), {"tooth": 1, "rpm": None}, "over speed = -1; must be"),
        (
            ("torque_Nm=50,-1",),
            {"tooth": 1, "torque": None},
            "over torque_Nm = -1; must be 0, or at least 1e-6",
        ),
        (("torque_Nm=50,100",), {"tooth": 1}, "torque_Nm; replaces torque"),
        (("torque_Nm=50,100",), {"torque": None}, "tooth = 12; needs a fault"),
        (("speed=900", "tooth=1"), {"tooth": 1, "rpm": None}, "tooth; needs a fault"),
        (("pitch_error=1", "seed=1,2"), {}, "over seed; needs noise_percent"),
        (("pitch_error=1",), {"random_seed": 1}, "random_seed = 1; needs random"),
        (("pitch_error=1",), {"seed": 1}, "seed = 1; needs noise_percent"),
        (("pitch_error=1",), {"gear_name": "z"}, "gear_name = z; liu-pair has pinion"),
        (
            ("gear.pinion.pitch_errors_um.3=1",),
            {"tooth": 1},
            "gear.pinion.pitch_errors_um.3: the gear set has no such entry",
        ),
        (
            ("pitch_error=0:1:10000",),
            {"turns": 100},
            f"at most {MAX_SAMPLES} are allowed; use averages",
        ),
    ],
)
def test_wrong_sets_are_refused_in_one_line(over, settings, message):
    with pytest.raises(InputError) as error:
        fegear.run(study(*over, **settings))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_healthy_runs_have_no_faulty_tooth():
    """The faulty tooth is found in all runs that have one."""
    result = fegear.run(study("pitch_error=0,2", "speed=900,1100", rpm=None))
    assert result.labels["faulty_tooth"].tolist() == [0, 0, 12, 12]
    entry = result.summary["signals"][0]
    assert (entry["runs_with_faulty_tooth"], entry["faulty_runs"]) == (2, 2)
    table = next(part for part in result.page() if isinstance(part, RowTable))
    assert next(table.cells())[-1] == "2 of 2"


@pytest.mark.parametrize(
    "over", ["gear.pinion.pitch_errors_um.3=0,5", "pitch_error=900"]
)
def test_an_axis_without_a_run_leaves_no_checkpoint(over, tmp_path):
    """So that the corrected command runs."""
    options = CheckpointOptions(checkpoint=tmp_path / "s.csv.partial")
    with pytest.raises(InputError):
        fegear.run(study(over, tooth=1), options)
    assert not options.checkpoint.exists()


PLANETARY = {
    "gear_set": "planetary-24-36-96",
    "torque": 60.0,
    "integration": Settings(),
}


def test_a_run_with_a_pin_out_of_place_is_that_of_signals():
    name, pins = "planetary-24-36-96", "planetary.1.position_errors_um"
    errors = [0.0] * 11 + [5.0] + [0.0] * 24
    gear = {"gear_name": "planet-2", "turns": 2, "samples": 8}
    settings = (
        PLANETARY
        | gear
        | {"gear_set": GearSetRef(name=name, edits=(f"{pins}=[0,0,0]",))}
    )
    result = fegear.run(study(f"{pins}.2=0,2", "pitch_error=0,5", **settings))
    assert result.labels[f"{pins}.2"].tolist() == [0.0, 0.0, 2.0, 2.0]
    assert result.labels["faulty_tooth"].tolist() == [0, 12, 0, 12]
    edits = f"{pins}=[0,2,0]", f"gear.planet-2.pitch_errors_um={errors}"
    gears = GearSetRef(name=name, edits=edits)
    settings = PLANETARY | gear | {"gear_set": gears, "rpm": 900.0, "model": MODEL}
    single = fegear.run(fegear.Signals(**settings))
    np.testing.assert_array_equal(result.runs.values[3].T, single.values)
    assert np.abs(result.runs.values[3] - result.runs.values[1]).max() > 1e-7


@pytest.mark.parametrize(
    ("over", "settings", "message"),
    [
        ("pitch_error=1", {}, "carrier; has no teeth for over pitch_error, take ring"),
        ("planetary.1.planets=3,4", {"tooth": 1}, "all runs have the same gears"),
    ],
)
def test_faults_that_planetary_sets_do_not_have(over, settings, message):
    with pytest.raises(InputError) as error:
        fegear.run(study(over, **PLANETARY | {"gear_name": "carrier"} | settings))
    assert message in str(error.value)


def edited(tables, values, tooth=5, overrides=None):
    """Values by key that edits of a gear set of 20 teeth make."""
    texts = GearSetEdits(tables, overrides or {}, 1, 20).texts(values, tooth)
    keys = {}
    for text in texts:
        key, _, value = text.partition("=")
        keys[key] = tomllib.loads(f"value = {value}")["value"]
    return keys


def test_a_fault_is_an_entry_of_its_tooth():
    tables = {"gear": [{"name": "a", "pitch_errors_um": [0.5] * 20}]}
    errors = [0.5] * 4 + [2.0] + [0.5] * 15
    assert edited(tables, {"pitch_error": 2.0}) == {"gear.1.pitch_errors_um": errors}
    other = {"tooth": 2, "depth_mm": 0.3, "root": "back"}
    tables = {"gear": [{"name": "a", "cracks": [other]}]}
    crack = {"tooth": 5, "depth_mm": 1.5}
    assert edited(tables, {"crack": 1.5}) == {"gear.1.cracks": [other, crack]}
    assert edited(tables, {"crack": 0.0}) == {"gear.1.cracks": [other]}
    deeper = {**other, "depth_mm": 0.7}
    assert edited(tables, {"crack": 0.7}, tooth=2) == {"gear.1.cracks": [deeper]}
    assert edited(tables, {"eccentricity": 8.0}) == {"gear.1.eccentricity_um": 8}


def test_a_spall_and_wear_change_the_size_of_an_entry():
    spall = {"tooth": 5, "start_roll_angle_deg": 15.0, "width_share": 0.2}
    worn = {"tooth": 5, "diameter_mm": [50.0, 55.0], "depth_um": [1.0, 4.0]}
    tables = {"gear": [{"name": "a", "spalls": [spall], "worn_teeth": [worn]}]}
    changed = edited(tables, {"spall": 0.5, "wear": 10.0})
    assert changed["gear.1.spalls"] == [{**spall, "width_share": 0.5}]
    assert changed["gear.1.worn_teeth"] == [{**worn, "depth_um": [2.5, 10.0]}]
    length = {"tooth": 5, "start_roll_angle_deg": 15.0, "length_mm": 4.0}
    tables = {"gear": [{"name": "a", "spalls": [length], "worn_teeth": [worn]}]}
    (spall_by_share,) = edited(tables, {"spall": 0.5})["gear.1.spalls"]
    assert spall_by_share == {**spall, "width_share": 0.5}
    with pytest.raises(InputError, match="no entry of tooth 6 in spalls"):
        edited(tables, {"spall": 0.5}, tooth=6)


BASES = {
    "spall": "gear.1.spalls=[{ tooth = 7, start_roll_angle_deg = 20.0, "
    "end_roll_angle_deg = 22.0, width_share = 0.1 }]",
    "wear": "gear.1.worn_teeth=[{ tooth = 7, roll_angle_deg = [15.0, 20.0], "
    "depth_um = [0.0, 2.0] }]",
}


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_makes_another_gear_and_size_0_a_healthy_one(name):
    edits = (BASES[name],) if name in BASES else ()
    base = GearSetRef(name="liu-pair", edits=edits)
    tables = load_tables("liu-pair", base.overrides)
    changes = GearSetEdits(tables, base.overrides, 1, 38)
    healthy, small, large = (
        replace(base, edits=changes.texts({name: size}, 7)).loaded.gears
        for size in (0.0, 0.2, 0.4)
    )
    assert healthy[1] == small[1] == large[1]
    assert len({exact_repr(gears[0]) for gears in (healthy, small, large)}) == 3
    if name != "pitch_error":  # a list of zeros in place of none
        assert healthy[0] == fegear.load_gear_set("liu-pair").gears[0]


def test_entries_of_lists_are_keys_that_name_gears_or_number_them():
    tables = {"gear": [{"name": "a", "cracks": [{"tooth": 2, "depth_mm": 0.3}]}]}
    values = {"gear.a.cracks.1.depth_mm": 0.9, "crack": 1.0, "gear.a.mass_kg": 2.0}
    assert edited(tables, values) == {
        "gear.1.cracks": [{"tooth": 2, "depth_mm": 0.9}, {"tooth": 5, "depth_mm": 1}],
        "gear.1.mass_kg": 2,
    }
    for path in ("2.depth_mm", "0.depth_mm", "1.depth"):
        with pytest.raises(InputError, match="the gear set has no such entry"):
            edited(tables, {f"gear.a.cracks.{path}": 1.0})


def test_changes_of_all_runs_are_kept():
    overrides = {"mesh.1.phase": 0.5}
    changed = edited({"gear": [{"name": "a"}]}, {"crack": 1.0}, overrides=overrides)
    assert changed["mesh.1.phase"] == 0.5
    errors = "gear.pinion.pitch_errors_um=" + str([1.0] + [0.0] * 37)
    base = GearSetRef(name="liu-pair", edits=(errors,))
    result = fegear.run(study("pitch_error=0", gear_set=base))
    assert result.runs.indicators["tooth"][:, 0].tolist() == [1]


def test_every_fault_has_a_declared_column():
    from fegear.studies.columns import find_column

    for fault in FAULTS.values():
        assert find_column("faults", fault.column).name == fault.column


def test_the_command_writes_the_table_beside_the_signals(tmp_path):
    pytest.importorskip("h5py")
    text = printed(
        *("faults", "liu-pair", "--rpm", 900, "--torque", 100, "--samples", 8),
        *("--turns", 1, "--excitation", "rectangular", "--over", "pitch_error=0,1"),
        *("-o", tmp_path / "s.h5", "--labels", tmp_path / "s.csv", "--json"),
    )
    values = json.loads(text)
    assert values["runs"] == 2
    assert values["statuses"] == {"periodic": 2}
    lines = (tmp_path / "s.csv").read_text("utf-8").splitlines()
    assert len([line for line in lines if not line.startswith("#")]) == 3
    assert (tmp_path / "s.h5").read_bytes().startswith(b"\x89HDF")


@pytest.mark.parametrize("name", [name for name in FAULTS if name != "pitch_error"])
def test_sizes_of_faults_are_not_negative(name):
    with pytest.raises(InputError, match=f"{name} = -1; must be 0 or more"):
        fegear.FaultSignals(gear_set="liu-pair", over=f"{name}=-1,2", rpm=900.0)
