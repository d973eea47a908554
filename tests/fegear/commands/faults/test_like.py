"""Runs with the sampling rate, the speed and the noise of a recording."""

from __future__ import annotations

import numpy as np
import pytest
from recorded_signals import RATE, TEETH, pulse_signal, recording_text

import fegear
from fegear.commands.faults.like import RecordedConditions
from fegear.files.errors import InputError
from fegear.studies.trains.gear_sets import GearSetRef
from lumped import Settings

MODEL = fegear.LumpedModel(
    number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
)
PAIR = GearSetRef(name="liu-pair", edits=("gear.1.teeth=19",))
RPM, NOISE, SECONDS = 6300.0, 20.0, 1.0
MESH = TEETH * RPM / 60.0  # Hz
PULSES = 3


def columns(rate=RATE, level=NOISE, seed=1):
    """A recording of a tone and its sidebands, all below a fifth of the rate."""
    time = np.arange(round(rate * SECONDS)) / rate
    turns = RPM / 60.0 * time
    angle = 2.0 * np.pi * turns
    clean = np.cos(TEETH * angle) * (1.0 + 0.3 * np.cos(angle))
    noise = np.random.default_rng(seed).standard_normal(time.size)
    return {
        "time_s": time,
        "acc": clean + 0.01 * level * clean.std() * noise,
        "tacho": pulse_signal(turns, PULSES),
        "rpm": np.full(time.size, RPM),
    }


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("like") / "rec.csv"
    path.write_text(recording_text(columns()))
    return str(path)


def study(*over, **settings):
    defaults = {"gear_set": PAIR, "torque": 100.0, "turns": 8, "samples": 16}
    defaults |= {"tooth": 12, "model": MODEL, "integration": Settings(steps=64)}
    return fegear.FaultSignals(over=over or ("pitch_error=0,2",), **defaults | settings)


@pytest.mark.parametrize(
    "rotation",
    [{"tacho": "tacho", "pulses": PULSES}, {"speed_channel": "rpm"}, {"rpm": RPM}],
)
def test_rate_speed_and_noise_come_back(recording, rotation):
    one = study(like=recording, channels=("acc",), **rotation)
    conditions = RecordedConditions.of(one, one.gear_set.loaded)
    assert conditions.channel == "acc"
    assert conditions.rate == pytest.approx(RATE, rel=1e-12)
    assert conditions.rpm == pytest.approx(RPM, rel=1e-4)
    assert conditions.frequency == pytest.approx(MESH, rel=1e-4)
    assert conditions.rpm_range == pytest.approx((RPM, RPM), rel=1e-2)
    assert conditions.noise_percent == pytest.approx(NOISE, rel=0.03)
    result = fegear.run(one)
    labels = result.labels
    assert labels["sampling_rate_Hz"] == pytest.approx(2 * [conditions.rate], rel=1e-12)
    assert set(labels["speed_rpm"]) == {conditions.rpm}
    assert set(labels["noise_percent"]) == {conditions.noise_percent}
    turns_s = 8 * 60.0 / conditions.rpm
    count = len(result.runs.values[0, 0])
    assert (count - 2) / conditions.rate < turns_s <= (count - 1) / conditions.rate
    assert result.summary["recorded"] == conditions.entries
    assert result.table.header["like"] == f"{recording}, noise of acc"
    assert any("as in" in line and "rec.csv" in line for line in result.facts.notes)


def test_the_speed_of_another_gear_is_that_of_the_driver(recording):
    """The tachometer of the recording is on the gear that is averaged."""
    one = study(like=recording, tacho="tacho", pulses=PULSES, gear_name="idler")
    idler = RecordedConditions.of(one, one.gear_set.loaded)
    teeth = one.gear_set.loaded.gears[1].geometry.teeth
    assert idler.rpm == pytest.approx(RPM * teeth / TEETH, rel=1e-4)
    assert idler.frequency == pytest.approx(RPM / 60.0 * teeth, rel=1e-4)


def test_at_the_rate_of_the_samples_runs_are_those_without_a_recording(tmp_path):
    """But for one sample more, and the spline from samples to angles."""
    path = tmp_path / "same.csv"
    path.write_text(recording_text(columns(rate=16 * MESH, level=1e-3)))
    like = fegear.run(study(like=str(path), rpm=RPM))
    noise = float(like.labels["noise_percent"][0])
    alone = fegear.run(study(rpm=RPM, noise_percent=noise))
    assert noise < 0.01
    values, expected = like.runs.values[..., :-1], alone.runs.values
    assert values.shape == expected.shape
    np.testing.assert_allclose(values, expected, atol=1e-3 * expected.std())
    averages, expected = like.runs.average, alone.runs.average
    np.testing.assert_allclose(averages, expected, atol=1e-3 * expected.std())


@pytest.mark.parametrize("part", [3.7, 6.0])
def test_signals_are_without_what_is_above_half_the_rate(tmp_path, part):
    """Beside the spectrum of four times as many samples, below and above the limit."""
    rate = part * MESH
    path = tmp_path / "slow.csv"
    path.write_text(recording_text(columns(rate=rate, level=1e-3)))
    like = fegear.run(study("pitch_error=2,4", like=str(path), rpm=RPM, samples=64))
    fine = fegear.run(study("pitch_error=2,4", rpm=RPM, samples=64))
    coarse = like.runs.values[0, 0]
    turns = 8 * TEETH
    full = np.fft.rfft(fine.runs.values[0, 0]) * 2.0 / fine.runs.values.shape[-1]
    time = np.arange(coarse.size) / rate
    for line in (8, 16, turns, 2 * turns):  # per 8 turns: orders 1, 2, 19, 38
        tone = np.exp(-2j * np.pi * line / turns * MESH * time)
        window = np.hanning(coarse.size)
        amplitude = (
            2.0 * (window * (coarse - coarse.mean()) * tone).sum() / window.sum()
        )
        limit = 0.5 * rate / MESH
        if line / turns < 0.8 * limit:
            assert abs(amplitude) == pytest.approx(abs(full[line]), rel=0.02)
    # nothing folds back: power is that of the orders below
    below = np.abs(full[1 : int(0.5 * rate / MESH * turns)]) ** 2
    assert coarse.var() == pytest.approx(0.5 * below.sum(), rel=0.02)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "tacho, speed_channel or rpm is needed"),
        ({"rpm": RPM, "noise_percent": 1.0}, "noise of its own"),
        ({"rpm": RPM, "tacho": "tacho"}, "gives the speed"),
        ({"rpm": RPM, "over": ("speed=1,2",)}, "replaces rpm"),
        ({"rpm": RPM, "over": ("noise_percent=1,2",)}, "has it"),
        ({"rpm": RPM, "pulses": 2}, "needs tacho"),
        ({"rpm": 100.0}, "4 turns are needed"),
        ({"rpm": RPM, "channels": ("none",)}, "none"),
    ],
)
def test_what_cannot_be_is_refused(recording, settings, message):
    over = settings.pop("over", ())
    with pytest.raises(InputError, match=message):
        fegear.run(study(*over, like=recording, **settings))


def test_without_a_recording_its_settings_are_refused():
    for settings in ({"tacho": "a"}, {"speed_channel": "a"}, {"rate": 5.0}):
        with pytest.raises(InputError, match="needs like"):
            study(rpm=RPM, **settings)


def test_noise_alone_is_refused(tmp_path):
    table = columns()
    table["acc"] = np.random.default_rng(5).standard_normal(table["acc"].size)
    path = tmp_path / "noise.csv"
    path.write_text(recording_text(table))
    with pytest.raises(InputError, match="acc is noise, more than 90 %"):
        fegear.run(study(like=str(path), rpm=RPM, channels=("acc",)))
