"""Recordings that are made from computed signals, and what comes back of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_signals import TEETH, pulse_signal, recording, recording_text, turns_at
from scipy.io import savemat, wavfile
from small_sets import PAIR, TRAIN

import fegear
from fegear.files.errors import InputError
from fegear.studies.columns import find_column
from lumped.signals.averages import TurnAverage
from lumped.signals.indicators import band_limited, difference_indicators
from lumped.signals.orders import resample_at

MODEL = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)
FAULTY = PAIR | {
    "gear": [
        PAIR["gear"][0] | {"pitch_errors_um": [0.0] * 6 + [4.0] + [0.0] * 12},
        PAIR["gear"][1],
    ]
}
SMALL = fegear.make_gear_set(PAIR)
INDICATORS = "residual_kurtosis", "fm4", "m6a", "na4", "energy_ratio"
RAMP_SPEEDS, RAMP_SECONDS = (600.0, 700.0), 1.2


def ramp(**settings):
    defaults = {"rpm": RAMP_SPEEDS, "seconds": RAMP_SECONDS, "samples": 64}
    gears = fegear.make_gear_set(FAULTY)
    return fegear.run(
        fegear.Signals(gear_set=gears, model=MODEL, **defaults | settings)
    )


def measured(path: Path, gears=SMALL, **settings):
    defaults = {"tacho": "tacho", "computed": False}
    return fegear.run(
        fegear.Signals(gear_set=gears, measured=path, **defaults | settings)
    )


def write(folder: Path, columns: Mapping[str, np.ndarray]) -> Path:
    path = folder / "r.csv"
    path.write_text(recording_text(columns))
    return path


@pytest.fixture(scope="module")
def simulated():
    """Signals of a ramp with noise, of which tooth 7 of the driver differs."""
    return ramp(noise_percent=5.0, seed=3)


@pytest.fixture(scope="module")
def recorded(simulated, tmp_path_factory):
    """The ramp as a recording: jitter, three pulses per turn of which two are lost."""
    time = simulated.time
    turns = simulated.gear.turns(simulated.ramp.cycles_at(time))
    pulses = pulse_signal(turns, 3)
    number = np.round(3.0 * turns)
    pulses = np.where((number < 3) | (number == 11) | (number == 25), 0.0, pulses)
    jitter = np.random.default_rng(4).uniform(-0.5e-4, 0.5e-4, time.size) * time[1]
    jitter[[0, -1]] = 0.0
    signals = dict(zip(simulated.names, simulated.values.T, strict=True))
    columns = {"time_s": time + jitter, **signals, "tacho": pulses}
    return write(tmp_path_factory.mktemp("ramp"), columns)


def test_the_tooth_of_a_simulated_ramp_comes_back(simulated, recorded):
    result = measured(recorded, fegear.make_gear_set(FAULTY), pulses=3)
    values = result.summary
    assert [entry["tooth"] for entry in values["signals"]] == [7, 7, 7]
    assert values["pulses_missing"] == 2
    assert values["pulses_doubled"] == 0
    assert values["pulse_scatter"] < 3e-3
    assert "[E33]" in str(result)
    (warning,) = [line for line in values["warnings"] if line.endswith("[W73]")]
    assert "2 were missing, 0 too many" in warning
    (note,) = values["notes"]
    assert note.startswith("steps of time differ by 0.0001")
    lowest, highest = RAMP_SPEEDS
    assert lowest < values["lowest_gear_speed_rpm"] < 1.03 * lowest
    assert 0.97 * highest < values["highest_gear_speed_rpm"] < highest
    for entry, direct in zip(
        values["signals"], simulated.summary["signals"], strict=True
    ):
        # one turn of the ramp is before the first pulse
        for name in ("mesh_amplitude", "residual_peak", "residual_tooth_rms"):
            assert entry[name] == pytest.approx(direct[name], rel=0.1)
        assert entry["residual_kurtosis"] > 8.0


def test_indicators_are_those_of_the_nominal_angle(simulated, recorded):
    """Of the turns after the first pulse, at the angles that the ramp has."""
    result = measured(recorded, fegear.make_gear_set(FAULTY), pulses=3).gear_averages
    turns, points = result.average.turns, len(result.average.values)
    angle = 1.0 + np.arange(2 * turns * points) / (2 * points)
    time = simulated.ramp.time_at(angle / simulated.gear.turns(1.0))
    time = np.minimum(time, simulated.time[-1])
    values = resample_at(simulated.time, simulated.values, time)
    average = values.reshape(turns, 2 * points, -1).mean(axis=0)
    expected = TurnAverage(band_limited(average, points), turns, (TEETH,))
    error = np.abs(result.average.values - expected.values).max(axis=0)
    assert (error < 2e-4 * np.ptp(expected.values, axis=0)).all()
    for name, indicator in difference_indicators(expected).items():
        np.testing.assert_allclose(result.indicators[name], indicator, rtol=2e-4)


def test_orders_of_a_recording_are_those_of_the_gear(recorded):
    """The peak of a parabola through the highest lines of all turns."""
    result = measured(recorded, fegear.make_gear_set(FAULTY), pulses=3, window=10_000)
    orders = result.orders
    amplitude = orders.amplitude[0, :, 0]
    step = orders.order[1]
    for harmonic in (1, 2, 3):
        near = np.abs(orders.order - harmonic * TEETH) < 0.5
        peak = int(np.flatnonzero(near)[amplitude[near].argmax()])
        left, middle, right = np.log(amplitude[peak - 1 : peak + 2])
        shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
        order = orders.order[peak] + shift * step
        assert order == pytest.approx(harmonic * TEETH, rel=1e-3)


def test_a_recording_of_one_speed_has_the_indicators_of_its_signals(tmp_path):
    """Each sample is a point of the average."""
    direct = ramp(rpm=650.0, seconds=None, turns=6)
    columns = dict(zip(direct.names, direct.values.T, strict=True))
    path = write(tmp_path, {"time_s": direct.time} | columns)
    gears = fegear.make_gear_set(FAULTY)
    result = measured(path, gears, tacho=None, rpm=650.0)
    assert result.gear_averages.average.turns == 6
    entries = zip(result.summary["signals"], direct.summary["signals"], strict=True)
    for entry, expected in entries:
        assert entry["tooth"] == expected["tooth"] == 7
        for name in INDICATORS:
            assert entry[name] == pytest.approx(expected[name], rel=1e-6)
    np.testing.assert_array_equal(result.gear_averages.tooth, direct.tooth)


def test_indicators_are_those_of_the_average_that_is_written(tmp_path):
    path = write(tmp_path, recording())
    result = measured(path)
    table = result.more_tables["average"]
    of_gear = np.array(table["gear"]) == "a"
    for entry in result.summary["signals"]:
        values = np.array(table[entry["signal"]])[of_gear][:, None]
        average = TurnAverage(values, 1, (TEETH,))
        for name, indicator in difference_indicators(average).items():
            assert entry[name] == pytest.approx(indicator[0], rel=1e-9)


ROTATIONS = {
    "tacho": {"tacho": "tacho", "channels": ("acc", "force_N")},
    "speed": {"tacho": None, "speed_channel": "rpm", "channels": ("acc", "force_N")},
}


@pytest.mark.parametrize("rotation", ROTATIONS.values(), ids=ROTATIONS)
def test_lines_of_a_known_recording(tmp_path, rotation):
    """Amplitude 1 at orders 19 and 38, and a shock in each turn."""
    result = measured(write(tmp_path, recording()), **rotation)
    acc, force = result.summary["signals"]
    assert acc["mesh_amplitude"] == pytest.approx(1.0, rel=0.03)
    assert force["mesh_amplitude"] == pytest.approx(1.0, rel=0.03)
    assert acc["unit"] == ""
    assert force["unit"] == "N"
    assert acc["residual_kurtosis"] > 20.0
    assert force["residual_kurtosis"] < 5.0
    assert acc["residual_peak_angle_deg"] == pytest.approx(108.0, abs=3.0)
    assert acc["fm4"] > 5.0 * force["fm4"]


def test_columns_of_all_tables_are_declared(tmp_path):
    result = measured(write(tmp_path, recording()))
    of_channels = {"acc", "force_N", "rpm"}
    for name, table in {"table": result.table, **result.more_tables}.items():
        columns = {n: find_column("signals", n, name).name for n in table.names}
        chosen = {n for n, declared in columns.items() if declared == "{parameter}"}
        assert chosen == (set() if name == "table" else of_channels)


def test_the_format_of_a_recording_changes_nothing(tmp_path):
    columns = recording()
    savemat(tmp_path / "r.mat", {n: v[:, None] for n, v in columns.items()})
    paths = write(tmp_path, columns), tmp_path / "r.mat"
    first, second = (measured(path).summary["signals"] for path in paths)
    for one, other in zip(first, second, strict=True):
        assert one["fm4"] == pytest.approx(other["fm4"], rel=1e-9)
    values = np.stack([columns["acc"], columns["tacho"] / 5.0], axis=1)
    wavfile.write(tmp_path / "r.wav", 20_000, values)
    by_wave = measured(tmp_path / "r.wav", tacho="channel2").summary["signals"]
    assert by_wave[0]["fm4"] == pytest.approx(first[0]["fm4"], rel=1e-6)


def test_every_gear_of_the_set_has_its_averages(tmp_path):
    """A line at 19 cycles per turn of the first gear is one of all meshes."""
    path = write(tmp_path, recording())
    result = measured(path, fegear.make_gear_set(TRAIN), channels=("acc",))
    assert [one.gear.name for one in result.averages] == ["a", "b", "c"]
    for one, teeth in zip(result.averages, (19, 23, 29), strict=True):
        assert len(one.average.values) == 64 * teeth
        assert one.gear.orders == (teeth,)
        assert one.entries[0]["mesh_amplitude"] == pytest.approx(1.0, rel=0.05)
    others = result.summary["other_gears"]
    assert [one["gear"] for one in others] == ["b", "c"]
    table = result.more_tables["average"]
    assert list(dict.fromkeys(table["gear"])) == ["a", "b", "c"]
    assert list(result.table["gear"]) == ["a", "b", "c"]


def test_channels_that_are_named_like_columns(tmp_path):
    columns = recording()
    path = write(tmp_path, {"t": columns["time_s"], "tooth": columns["acc"]} | columns)
    result = measured(path, channels=("tooth", "acc"))
    table = result.more_tables["average"]
    assert set(table["tooth"]) == set(range(1, 24))
    np.testing.assert_array_equal(table["channel_tooth"], table["acc"])


def test_computed_signals_are_at_the_mean_speed(tmp_path):
    settings = {"computed": True, "model": MODEL, "turns": 2, "channels": ("acc",)}
    path = write(tmp_path, recording())
    result = measured(path, **settings)
    mean = result.summary["gear_speed_rpm"]
    assert result.computed.summary["gear_speed_rpm"] == pytest.approx(mean)
    assert mean == pytest.approx(60.0 * (105.0 + 0.5 * 30.0 * 0.2), rel=0.01)
    assert set(result.table["source"]) == {"measured", "computed"}
    text = str(result)
    assert text.count("indicators of damage") == 2
    np.testing.assert_array_equal(
        result.gear_averages.tooth, result.computed.averages.tooth
    )
    measured_at, computed_at = (
        next(iter(one.engagements.values()))[0]
        for one in (result.gear_averages, result.computed.averages)
    )
    assert measured_at.first == computed_at.first
    np.testing.assert_array_equal(measured_at.teeth, computed_at.teeth)
    titles = [axes.get_title() for axes in result.figures["plot"]().axes]
    assert titles[0] == "measured: average over a turn, without mean"
    assert titles[2] == "computed: average over a turn, without mean"
    assert result.figures["order_map"]() is not None


def test_without_a_torque_nothing_is_computed(tmp_path, monkeypatch):
    without_load = {key: value for key, value in PAIR.items() if key != "load"}
    gears = fegear.make_gear_set(without_load)
    result = measured(write(tmp_path, recording()), gears, computed=True)
    assert result.computed is None
    assert "small has no load case" in result.summary["notes"][0]
    by_torque = measured(
        write(tmp_path, recording()), gears, computed=True, torque=5.0, model=MODEL
    )
    assert by_torque.computed.summary["torque_Nm"] == 5.0


def test_a_rate_below_the_mesh_is_warned_of(tmp_path):
    columns = {name: values[::8] for name, values in recording().items()}
    result = measured(write(tmp_path, columns), tacho=None, speed_channel="rpm")
    (warning,) = [w for w in result.summary["warnings"] if w.endswith("[W72]")]
    assert warning.startswith("2500 Hz have frequencies below 1250 Hz; the first mesh")


@pytest.mark.parametrize(("place", "count"), [(0.5, 0), (0.52, 1)])
def test_uneven_marks_of_a_tachometer_are_warned_of(tmp_path, place, count):
    """Two marks, the second one off by 0 or 0.02 turns, 0.38 mesh cycles."""
    turns = turns_at(recording()["time_s"])
    tacho = pulse_signal(turns) + pulse_signal(np.maximum(turns - place, 0.0))
    path = write(tmp_path, changed(tacho=tacho))
    warnings = measured(path, pulses=2).summary["warnings"]
    assert len([w for w in warnings if w.endswith("[W74]")]) == count


def changed(**columns: np.ndarray) -> dict[str, np.ndarray]:
    return dict(recording()) | columns


STILL = np.where(np.arange(4000) == 99, 0.0, recording()["rpm"])
REFUSED = {
    "has no channel acceleration; it has acc, force_N, tacho, rpm": {
        "channels": ("acceleration",)
    },
    "has no channel pulse; it has": {"tacho": "pulse"},
    "has no channel pulse; it has acc": {"tacho": "pulse", "channels": ("acc",)},
    "rpm: 0 rpm in sample 100, 1 such values; must be above 0": {
        "tacho": None,
        "speed_channel": "rpm",
    },
    "a turns 0.02 times, 1 turn is needed": {"tacho": None, "rpm": 6.0},
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_is_no_recording_of_a_gear(tmp_path, message):
    path = write(tmp_path, changed(rpm=STILL))
    with pytest.raises(InputError) as error:
        measured(path, **REFUSED[message])
    assert message in str(error.value)


def test_too_few_pulses_and_no_other_channel(tmp_path):
    path = write(tmp_path, changed(tacho=np.zeros(4000)))
    with pytest.raises(InputError, match="tacho: 0 pulses, 4 or more are needed"):
        measured(path)
    alone = {name: recording()[name] for name in ("time_s", "tacho")}
    with pytest.raises(InputError, match="no channel but that of the rotation"):
        measured(write(tmp_path, alone))


def test_a_study_of_a_recording_can_be_typed(tmp_path):
    study = fegear.Signals(
        gear_set="liu-pair", measured="r.csv", tacho="t", channels=("a", "b")
    )
    argv = study.argv
    assert argv[argv.index("--channels") + 1] == "a,b"
    assert "--measured" in argv
    by_text = replace(study, channels="a, b")
    assert by_text == study


def test_a_recording_that_is_too_long_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("fegear.studies.trains.recorded_rotation.MAX_VALUES", 7999)
    path = write(tmp_path, recording())
    with pytest.raises(InputError, match="3 channels of 4000 samples; at most 7999"):
        measured(path)
    assert measured(path, channels=("acc",)).gear_averages.names == ("acc",)
