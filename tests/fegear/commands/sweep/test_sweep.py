"""`fegear sweep`: rows, summary, plot, and what an end before the end keeps."""

from __future__ import annotations

import importlib
import json
from dataclasses import replace
from importlib import resources

import pytest
from drawn_figures import are_drawn, axis_labels, saved_figures
from ended_runs import interrupted_after
from typer.testing import CliRunner
from written_tables import read_sweep

from fegear.cli import app
from fegear.files.errors import InputError
from fegear.files.speed_ranges import parsed_speeds, written_speeds
from fegear.gearset import load_gear_set
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from fegear.train.resonances import default_speeds
from lumped.steady.response import Status
from lumped.train.analytic import StiffnessParameters, analytic_excitation

FAST = ("liu-idler", "--excitation", "rectangular", "--torque", "100")


def run(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(
        app, ["sweep", *map(str, arguments)], catch_exceptions=False
    )
    assert result.exit_code == code, result.output
    return result.stdout


def strict(text: str) -> dict:
    def refuse(word):
        raise AssertionError(word)

    return json.loads(text, parse_constant=refuse)


def test_rows_come_by_torque_direction_speed_and_mesh(tmp_path):
    path = tmp_path / "s.csv"
    run(*FAST, "--torque", 50, "--speeds", "900:940:20", "-o", path)
    rows = read_sweep(str(path)).rows
    up, down = [900.0, 920.0, 940.0], [940.0, 920.0, 900.0]
    speeds = [s for s in (*up, *down) for _ in range(2)]
    assert [row.mesh_frequency_Hz for row in rows] == 2 * speeds
    assert [row.mesh for row in rows] == 12 * [1, 2]
    assert [row.torque_Nm for row in rows] == 12 * [100.0] + 12 * [50.0]
    assert [row.direction for row in rows[:12]] == 6 * ["up"] + 6 * ["down"]
    assert {row.period_multiple for row in rows} == {1}


def test_one_speed_shows_amplitude_and_force():
    arguments = (*FAST, "--speeds", "2000", "--direction", "up")
    (branch,) = strict(run(*arguments, "--json"))["branches"]
    printed = run(*arguments)
    assert len(branch["largest"]) == 2
    for mesh in branch["largest"]:
        assert f"{1e6 * mesh['dte_rms_m']:.3f}" in printed
        assert f"{mesh['force_peak_N']:.0f}" in printed


def test_output_is_deterministic(tmp_path):
    files = [tmp_path / name for name in ("a.csv", "b.csv", "a.png", "b.png")]
    with saved_figures() as figures:
        for table, plot in (files[::2], files[1::2]):
            run(*FAST, "--speeds", "1400:1480:20", "-o", table, "--plot", plot)
    assert files[0].read_bytes() == files[1].read_bytes()
    assert files[2].read_bytes() == files[3].read_bytes()
    assert axis_labels(figures[0]) == {
        "mesh frequency of the first mesh [Hz]",
        "mesh 1: RMS of dynamic\ntransmission error [um]",
        "mesh 2: RMS of dynamic\ntransmission error [um]",
    }
    rows = read_sweep(str(files[0])).rows
    points = [(row.mesh_frequency_Hz, 1e6 * row.dte_rms_m) for row in rows]
    assert are_drawn(figures[0], points)


def test_the_summary_lists_peaks_and_jumps():
    arguments = (*FAST, "--speeds", "2800:3500:20", "--direction", "up")
    values = strict(run(*arguments, "--json"))
    (branch,) = values["branches"]
    jump = next(j for j in branch["jumps"] if j["mesh"] == 2)
    assert jump["frequency_to_Hz"] - jump["frequency_from_Hz"] == 20.0
    assert jump["dte_rms_to_m"] > 3.0 * jump["dte_rms_from_m"]
    peak = next(p for p in branch["peaks"] if p["mesh"] == 2)
    assert peak["contact_loss_fraction"] > 0.2
    assert branch["complete"]
    assert values["natural_frequencies"] == (
        "about averages of the mesh stiffness at 100 N m"
    )
    assert values["natural_frequencies_Hz"][1:] == pytest.approx([1605.0, 3230.6], 1e-3)
    printed = run(*arguments)
    for text in ("Peaks", "Jumps", "[Hz]", "RMS of", "wall time"):
        assert text in printed


@pytest.mark.parametrize("model", [1, 2, 3])
def test_finite_elements_drive_all_models(model):
    arguments = ("liu-pair", "--model", model, "--speeds", "2000", "--torque", "100")
    values = strict(run(*arguments, "--json"))
    assert [b["finished_speeds"] for b in values["branches"]] == [1, 1]
    assert values["excitation"] == "finite elements"


def test_tables_take_the_place_of_finite_elements(tmp_path):
    table, out = tmp_path / "mesh.csv", tmp_path / "s.csv"
    rows = [f"100,{i / 8},{3e8 + 4e7 * (i < 4)}" for i in range(8)]
    table.write_text("torque_Nm,position,stiffness_N_per_m\n" + "\n".join(rows))
    arguments = ("liu-pair", "--torque", 100, "--speeds", "1500", "--table", table)
    run(*arguments, "--model", 3, "-o", out)
    assert read_sweep(str(out)).header["excitation"] == "tables mesh.csv"
    with pytest.raises(InputError, match="mesh tables = 1; liu-idler has 2 meshes"):
        run("liu-idler", *arguments[1:])
    run("liu-pair", "--torque", 50, *arguments[3:], "--model", 3)  # one torque fits all
    two_torques = (
        table.read_text()
        + "\n"
        + table.read_text().partition("\n")[2].replace("100,", "200,")
    )
    table.write_text(two_torques)
    with pytest.raises(InputError, match="outside of the mesh table"):
        run("liu-pair", "--torque", 50, *arguments[3:])
    table.write_text(table.read_text().replace("300000000.0", "-3e8", 1))
    with pytest.raises(InputError, match="stiffness_N_per_m is -3e\\+08 at torque"):
        run(*arguments, "--model", 3)
    table.write_text("# teeth: 9 / 9\n" + two_torques)
    with pytest.raises(InputError, match="of teeth 9 / 9, but mesh 1"):
        run(*arguments, "--model", 3)
    with pytest.raises(InputError, match="fourier; --table replaces it"):
        run(*arguments, "--excitation", "fourier")


def test_the_coupled_model_takes_tables_of_several_torques(tmp_path):
    """As solved from its own finite elements, and what a table lacks is named."""
    table, one, out = (tmp_path / name for name in ("t.csv", "one.csv", "s.csv"))
    pair, coarse = load_gear_set("liu-pair"), StaticsSettings(resolution="coarse")
    solve_mesh(pair, 1, [60.0, 150.0], coarse).to_csv(table)
    solve_mesh(pair, 1, [100.0], coarse).to_csv(one)
    arguments = ("liu-pair", "--torque", 100, "--speeds", "1500,2800")
    arguments += ("--direction", "up", "--model", "coupled")
    solved = strict(run(*arguments, "--resolution", "coarse", "--json"))
    arguments += ("--table",)
    tabulated = strict(run(*arguments, table, "-o", out, "--json"))
    assert tabulated["excitation"] == "tables t.csv"
    assert read_sweep(str(out)).rows[0].model == "coupled"
    for name in ("dte_rms_m", "force_peak_N"):
        a, b = (
            summary["branches"][0]["largest"][0][name]
            for summary in (solved, tabulated)
        )
        assert b == pytest.approx(a, rel=0.01)
    a, b = (summary["natural_frequencies_Hz"] for summary in (solved, tabulated))
    assert b == pytest.approx(a, rel=1e-3)
    with pytest.raises(InputError, match=r"one.csv: torques = 1; .* without hardening"):
        run(*arguments, one)
    run(*arguments, one, "--without", "hardening")
    with pytest.raises(InputError, match="torque 200 N m is outside of the mesh table"):
        run("liu-pair", "--torque", 200, *arguments[3:], table)
    with pytest.raises(InputError, match=r"relief.magnitude_um; --table has the teeth"):
        run(*arguments, table, "--set", "mesh.1.tip_relief.magnitude_um=5")


def test_a_divergence_keeps_the_rows_before_it(tmp_path, monkeypatch):
    # by name: the attribute of the package is the function
    module = importlib.import_module("lumped.steady.sweep")
    genuine = module.confirm_steady_state

    def diverging(stepper, frequency, *others):
        response, *rest = genuine(stepper, frequency, *others)
        if frequency > 930.0:
            nothing = response.dte_rms * float("nan")
            response = replace(response, status=Status.DIVERGED, dte_rms=nothing)
        return response, *rest

    monkeypatch.setattr(module, "confirm_steady_state", diverging)
    path = tmp_path / "s.csv"
    arguments = (*FAST, "--speeds", "900:1000:20", "--direction", "up", "--json")
    result = CliRunner().invoke(
        app, ["sweep", *arguments, "-o", str(path)], catch_exceptions=False
    )
    assert result.exit_code == 1
    assert "diverged at 940 Hz within" in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert {r.mesh_frequency_Hz for r in read_sweep(str(path)).rows} == {900.0, 920.0}
    (branch,) = strict(result.stdout)["branches"]
    assert branch["finished_speeds"] == 2
    assert not branch["complete"]


@pytest.mark.slow
def test_ctrl_c_keeps_finished_rows(tmp_path):
    arguments = (*FAST, "--speeds", "800:4200:0.1", "-o", "s.csv")
    process = interrupted_after(500, ["sweep", *arguments], tmp_path)
    assert process.returncode == 130, process.stderr
    assert "interrupted" in process.stderr
    table = read_sweep(str(tmp_path / "s.csv"))
    assert 0 < len(table.rows) < 2 * 2 * 34001
    assert table.header["incomplete"] == f"{len(table.rows) // 2} of 68002 speeds"


@pytest.mark.parametrize(
    ("text", "speeds"),
    [
        ("800", [800.0]),
        ("0.1:0.5:0.1", [0.1, 0.2, 0.3, 0.4, 0.5]),
        ("100:131:10", [100.0, 110.0, 120.0, 130.0]),
        ("130:100:10", [130.0, 120.0, 110.0, 100.0]),
        ("900, 800,900", [900.0, 800.0]),
        ("1:3:1,10", [1.0, 2.0, 3.0, 10.0]),
    ],
)
def test_speeds(text, speeds):
    """Also written, they are read again to the bit."""
    frequencies = parsed_speeds(text)
    assert frequencies == tuple(speeds)
    assert parsed_speeds(written_speeds(frequencies)) == frequencies


class GivenMean:
    """Rectangles of the gear sets' own mean stiffnesses, without finite elements."""

    def mesh_excitation(self, gear_set, mesh, torque, model):
        mean = gear_set.meshes[mesh].mean_stiffness
        figures = StiffnessParameters(mean=mean, variation=0.3, contact_ratio=1.6)
        return analytic_excitation(figures, model)


def test_usual_speeds_span_the_resonances_of_both_meshes():
    spans = {}
    for name in ("liu-idler", "liu-countershaft"):
        gear_set = load_gear_set(name)
        system = lumped_system(
            gear_set, 100.0, LumpedModel(number=1), excitations=GivenMean()
        )
        speeds = default_speeds(system)
        assert 100 < len(speeds) <= 402
        spans[name] = speeds[0], speeds[-1]
    assert spans["liu-idler"] == (800.0, 4200.0)
    rate = 19 / 72  # of the second mesh
    assert spans["liu-countershaft"][1] == pytest.approx(1.3 * 1183.0 / rate, abs=20)


def test_shaft_speed_is_mesh_frequency_over_teeth(tmp_path):
    path = tmp_path / "s.csv"
    run(*FAST, "--rpm", "1500:1530:15", "--direction", "up", "-o", path)
    rows = read_sweep(str(path)).rows
    assert [row.mesh_frequency_Hz for row in rows[::2]] == [950.0, 959.5, 969.0]


def test_figures_can_be_set_for_one_run(tmp_path):
    one, two = tmp_path / "a.csv", tmp_path / "b.csv"
    run(*FAST, "--speeds", "1600", "-o", one)
    run(*FAST, "--speeds", "1600", "--set", "mesh.2.phase=0.5", "-o", two)
    assert one.read_bytes() != two.read_bytes()


def test_outputs_replace_neither_inputs_nor_each_other(tmp_path):
    path = tmp_path / "a.csv"
    with pytest.raises(InputError, match="already by this command"):
        run(*FAST, "--speeds", "1600", "-o", path, "--spectra", path)
    builtin = resources.files("fegear.gearset") / "sets" / "liu-pair.toml"
    gear_set = tmp_path / "own.toml"
    gear_set.write_text(builtin.read_text())
    for output in ("-o", "--spectra"):
        with pytest.raises(InputError, match=r"name must end in"):
            run(gear_set, *FAST[1:], "--speeds", "1600", output, gear_set)
    table = tmp_path / "t.csv"
    run(*FAST, "--speeds", "1600", "-o", table)
    with pytest.raises(InputError, match="already by this command"):
        run(gear_set, "--table", table, "--speeds", "1600", "-o", table)
