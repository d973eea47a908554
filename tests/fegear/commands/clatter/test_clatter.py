"""`fegear clatter`: tables, noise, going on after a stop, wrong gearboxes."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from cli_commands import printed, rows_of

from fegear.cli import run
from fegear.commands.clatter.gearboxes import load_gearbox
from fegear.commands.clatter.study import Clatter
from fegear.files.store import CheckpointOptions
from fegear.studies import running
from lumped.clatter.groups import WheelGroup

GEARBOX = """
name = "own"
[excitation]
frequency_Hz = 25
amplitude_mm = 0.15
[[wheel]]
name = "first"
base_radius_mm = 40
inertia_kg_m2 = 1e-3
tooth_play_mm = 0.1
tooth_restitution = 0.8
drag_Nm = -0.05
"""
SIGNAL = GEARBOX.replace(
    "frequency_Hz = 25\namplitude_mm = 0.15",
    'speed_file = "speed.csv"\nbase_radius_mm = 50',
)
SPUR_AXIAL = "mass_kg = 1\naxial_play_mm = 0.1\naxial_restitution = 0.5"
WIDE = "tooth_play_amplitude_mm = 0.1"
LIGHT = "mass_kg = 1e-3\nradial_play_mm = 0.1\nradial_restitution = 0.5"


def test_a_row_for_each_impact_and_noise_that_belongs_to_it(tmp_path):
    table = tmp_path / "i.csv"
    arguments = "clatter", "seed-five-speed", "--seconds", 2, "-o", table, "--json"
    (wheel,) = json.loads(printed(*arguments))["wheels"]
    rows = rows_of(table)
    assert len(rows) == wheel["impacts"] > 400
    times = [float(row["time_s"]) for row in rows]
    assert times == sorted(times)
    for play in wheel["plays"]:
        impacts = [row for row in rows if row["play"] == play["play"]]
        speeds = [float(row["approach_speed_m_per_s"]) for row in impacts]
        assert len(impacts) == play["impacts"] > 0
        assert sum(v * v for v in speeds) / 2.0 == pytest.approx(
            play["noise_m2_per_s3"]
        )
        assert max(speeds) == play["fastest_m_per_s"]
        dissipated = sum(float(row["lost_energy_J"]) for row in impacts)
        assert dissipated / 2.0 == pytest.approx(play["lost_power_W"])


def test_what_was_printed_is_in_the_gearbox():
    (wheel,) = load_gearbox("seed-five-speed").gearbox.wheels
    assert wheel.ratio == 0.87
    plays = [freedom.play for freedom in wheel.freedoms.values()]
    assert plays == pytest.approx([1e-4, 1e-4, 5e-5])


def test_the_play_varies_as_the_file_says(tmp_path, capsys):
    variation = "tooth_play_amplitude_mm = 0.04\ntooth_play_order = 2\n"
    (tmp_path / "own.toml").write_text(
        f"{GEARBOX}{variation}tooth_play_phase_deg = 90\n"
    )
    gearbox = load_gearbox(str(tmp_path / "own.toml")).gearbox
    group = WheelGroup(gearbox.groups[0], gearbox.excitation)
    times = np.array([0.0, 0.01, 0.02])
    np.testing.assert_allclose(group.widths(times)[:, 0], [1.4e-4, 6e-5, 1.4e-4])
    assert run(["clatter", str(tmp_path / "own.toml"), "--map", "fermi"]) == 2
    assert "that varies; maps need a constant one" in capsys.readouterr().err


def test_a_run_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr("lumped.clatter.group_runs.CHUNK", 100)
    study = Clatter(gearbox="seed-five-speed", seconds=3.0)
    uninterrupted, calls = running.run(study), []

    def stop(label: str, done: int, total: int) -> None:
        calls.append(done)
        if len(calls) == 5:
            raise KeyboardInterrupt

    path = tmp_path / "i.csv.partial"
    with pytest.raises(KeyboardInterrupt):
        running.run(study, CheckpointOptions(checkpoint=path), stop)
    assert path.exists()
    assert calls[-1] < 1000
    later = running.run(study, CheckpointOptions(checkpoint=path, resume=True))
    assert later.table.csv() == uninterrupted.table.csv()
    assert not path.exists()


def test_a_speed_file_ends_the_run(tmp_path, capsys):
    rows = [f"{0.001 * k},{800 + 30 * math.sin(0.157 * k)}" for k in range(400)]
    (tmp_path / "speed.csv").write_text("\n".join(["time_s,speed_rpm", *rows]))
    (tmp_path / "own.toml").write_text(SIGNAL)
    arguments = ["clatter", str(tmp_path / "own.toml"), "--json", "--seconds"]
    assert run([*arguments, "0.399"]) == 0
    assert json.loads(capsys.readouterr().out)["wheels"][0]["impacts"] > 10
    assert run([*arguments, "0.4"]) == 2
    assert "the speed file of own ends after 0.399 s" in capsys.readouterr().err


def test_the_exponent_of_a_map_is_that_of_the_end_of_its_run(tmp_path):
    """Chaos of a long time ends in a motion of two impacts that repeats."""
    keys = {"damping_Nms_per_rad": "1e-3", "ratio": "0.9", "tooth_restitution": "0.9"}
    text = GEARBOX.replace("tooth_restitution = 0.8\n", "")
    text = text.replace("amplitude_mm = 0.15", "amplitudes_mm = [0.15, 0.04]")
    text = text.replace("[[wheel]]", "phases_deg = [0, 30]\n[[wheel]]")
    text += "\n".join(f"{key} = {value}" for key, value in keys.items())
    (tmp_path / "own.toml").write_text(text)
    table = tmp_path / "i.csv"
    arguments = "clatter", tmp_path / "own.toml", "--map", "fermi", "--seconds", 1000
    values = json.loads(printed(*arguments, "--chaos", "--json", "-o", table))
    (wheel,) = values["wheels"]
    speeds = [float(r["approach_speed_m_per_s"]) for r in rows_of(table)[-9:]]
    exponent = wheel["lyapunov_exponent_per_impact"]
    if speeds[2:] == pytest.approx(speeds[:-2], rel=1e-6):
        assert exponent == pytest.approx(math.log(0.9) / 2.0, abs=0.002)
    else:
        assert exponent > 0.5


def test_chaos_is_told_with_its_error_and_not_of_a_wheel_that_rests(tmp_path):
    arguments = "clatter", "seed-five-speed", "--seconds", 40, "--chaos"
    (wheel,) = json.loads(printed(*arguments, "--json"))["wheels"]
    assert not wheel["superstable"]
    assert 0.0 < wheel["correlation_dimension_error"] < 0.5
    assert 1.0 < wheel["correlation_dimension"] < 2.0
    assert f"{wheel['correlation_dimension']:.2f} +- " in printed(*arguments)
    resting = GEARBOX.replace("0.8", "0.3").replace("-0.05", "-0.5")
    (tmp_path / "own.toml").write_text(resting)
    arguments = "clatter", tmp_path / "own.toml", "--chaos"
    (wheel,) = json.loads(printed(*arguments, "--json"))["wheels"]
    assert wheel["superstable"]
    assert wheel["lyapunov_exponent_per_s"] is None
    assert wheel["correlation_dimension"] is None
    page = printed(*arguments)
    assert "contact erases the initial state" in page
    assert "dimension" not in page


def test_nothing_that_moves_is_refused(tmp_path, capsys):
    still = GEARBOX.replace("0.15", "0.0")
    (tmp_path / "own.toml").write_text(still.replace("drag_Nm = -0.05", ""))
    assert run(["clatter", str(tmp_path / "own.toml")]) == 2
    assert "so that nothing moves" in capsys.readouterr().err
    (tmp_path / "own.toml").write_text(still)  # it falls by its drag
    assert run(["clatter", str(tmp_path / "own.toml")]) == 0


@pytest.mark.parametrize("kind", ["event", "implicit", "fermi"])
def test_a_run_ends_at_its_last_impact(tmp_path, kind):
    path, table = tmp_path / "own.toml", tmp_path / "i.csv"
    path.write_text(GEARBOX.replace("drag_Nm = -0.05", ""))
    arguments = ["clatter", path, "--map", kind, "--seconds", 9, "-o", table, "--json"]
    values = json.loads(printed(*arguments, "--impacts", 7))
    (wheel,) = values["wheels"]
    rows = rows_of(table)
    assert len(rows) == wheel["impacts"] == 7
    assert float(rows[-1]["time_s"]) == wheel["seconds"]
    assert "ends after" in values["warnings"][0]
    assert values["warnings"][0].endswith(" [W21]")
    assert "and 7 impacts" in table.read_text("utf-8").partition("time_s")[0]
    printed(*arguments)
    assert rows_of(table)[:7] == rows
    printed("clatter", path, "--seconds", 1, "-o", table)
    assert rows_of(table)[0] == rows[0]  # maps begin with the first one by events


def test_a_periodic_motion_loses_neighbours_by_its_restitution(tmp_path):
    """Without damping, multipliers of a stable focus have the modulus eps an impact."""
    path = tmp_path / "own.toml"
    path.write_text(GEARBOX.replace("drag_Nm = -0.05", ""))
    arguments = "clatter", path, "--seconds", 40, "--chaos", "--json"
    (events,) = json.loads(printed(*arguments))["wheels"]
    (mapped,) = json.loads(printed(*arguments, "--map", "implicit"))["wheels"]
    rate = events["impacts"] / events["seconds"]
    assert mapped["lyapunov_exponent_per_impact"] == pytest.approx(math.log(0.8), 0.01)
    expected = pytest.approx(rate * math.log(0.8), rel=0.05)
    assert events["lyapunov_exponent_per_s"] == expected


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("tooth_play_mm = 0.1", "tooth_play_mm = 0.0", "tooth_play_mm = 0; must be"),
        ("tooth_play_mm = 0.1", "tooth_play_mm = -1.0", "tooth_play_mm = -1; must be"),
        ("restitution = 0.8", "restitution = 1.2", "tooth_restitution = 1.2; must be"),
        ("restitution = 0.8", "restitution = -0.1", "tooth_restitution = -0.1"),
        ("inertia_kg_m2 = 1e-3", "inertia_kg_m2 = -1.0", "inertia_kg_m2 = -1; must"),
        ("drag_Nm = -0.05", "drag = 1.0", "unknown key"),
        ("drag_Nm = -0.05", "mass_kg = 1.0", "mass_kg needs axial_play_mm"),
        ("drag_Nm = -0.05", "axial_play_mm = 0.1", "axial_restitution is needed"),
        ("drag_Nm = -0.05", 'driver = "none"', "driver none of wheel first"),
        ("frequency_Hz = 25", "", "frequency_Hz is missing"),
        ("amplitude_mm = 0.15", "amplitudes_mm = []", "amplitudes_mm has 0 entries"),
        (
            "drag_Nm = -0.05",
            SPUR_AXIAL,
            "axial_play_mm needs helix_angle_deg",
        ),
        ("drag_Nm = -0.05", WIDE, "= 0.1; its size must be below tooth_play_mm"),
        ("drag_Nm = -0.05", "tooth_play_order = 2", "needs tooth_play_amplitude_mm"),
        ("drag_Nm = -0.05", LIGHT, "the radius of gyration, 1000 mm, must be 0.4 to"),
        ("drag_Nm = -0.05", "damping_Nms_per_rad = 1e4", "must be at most 250, with"),
        (GEARBOX[GEARBOX.index("[[wheel]]") :], "", "wheel is missing"),
    ],
)
def test_a_wrong_gearbox_is_refused_in_a_line(tmp_path, capsys, old, new, message):
    assert old in GEARBOX
    (tmp_path / "own.toml").write_text(GEARBOX.replace(old, new))
    assert run(["clatter", str(tmp_path / "own.toml")]) == 2
    line = capsys.readouterr().err
    assert len(line.splitlines()) == 1
    assert message in line


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no column names"),
        ("time_s,speed_rpm\n", "rows of a speed signal = 0; must be 4 or more"),
        ("time_s,speed\n0,1\n", "needed are time_s and either"),
        ("time_s,speed_rpm\n0,1\n1,a\n", "must hold numbers"),
        ("time_s,speed_rpm,speed_rad_per_s\n0,1,1\n", "either speed_rpm or"),
        ("time_s,speed_rpm\n0,1\n1,1e300\n2,1\n3,1\n", "up to 1e+06 rad/s"),
        ("time_s,speed_rpm\n0,1\n1,nan\n2,1\n3,1\n", "up to 1e+06 rad/s"),
        ("time_s,speed_rpm\n0,1\n1,2\n1,3\n2,4\n", "must rise"),
    ],
)
def test_a_wrong_speed_file_is_refused_in_a_line(tmp_path, capsys, text, message):
    (tmp_path / "own.toml").write_text(SIGNAL)
    (tmp_path / "speed.csv").write_text(text)
    assert run(["clatter", str(tmp_path / "own.toml")]) == 2
    line = capsys.readouterr().err
    assert len(line.splitlines()) == 1
    assert message in line
