"""`fegear validate`: table, exit codes, files."""

from __future__ import annotations

import json

import pytest
from case_files import case_text
from typer.testing import CliRunner
from written_tables import read_sweep

import validation.commands.validate.random_sets.set_runs
import validation.study.runs
from fegear.cli import app
from fegear.files.errors import InputError
from validation.commands.validate.random_sets.set_runs import SetRun


def run(*arguments):
    return CliRunner().invoke(
        app, ["validate", *map(str, arguments)], catch_exceptions=False
    )


def own_case(folder, allowed=0.5):
    path = folder / f"tiny-{allowed}.toml"
    path.write_text(case_text(allowed=allowed))
    return path


@pytest.mark.slow
def test_within_ends_with_0_and_outside_with_1(tmp_path):
    out = tmp_path / "report"
    good = run(own_case(tmp_path), "-o", out)
    assert good.exit_code == 0
    assert "All are within." in good.stdout
    names = ("index.html", "report.md", "report.json")
    assert all(str(out / name) in good.stdout.splitlines()[-2] for name in names)
    bad = run(own_case(tmp_path, 0), "-o", out)
    assert bad.exit_code == 1
    line = "tiny, model-1, 100 N m, up, mesh 1, 5 speeds: rms_distance 0."
    assert line in bad.stdout
    assert "allowed 0; the model is off\n" in bad.stdout
    assert len(list((out / "runs").iterdir())) == 2


@pytest.mark.slow
def test_a_model_that_cannot_be_judged_fails(tmp_path):
    """No peak in the band: a tolerance of peaks says nothing about the model."""
    case = tmp_path / "silent.toml"
    case.write_text(case_text(name="silent").replace("rms_distance", "peak_frequency"))
    result = run(case, "-o", tmp_path / "report")
    assert result.exit_code == 1
    assert "no value of peak_frequency: silent, model-1\n" in result.stdout
    assert "All are within." not in result.stdout
    assert "no value to judge: silent, model-1" in result.stderr


@pytest.mark.slow
def test_json_is_the_report_and_names_the_csv_files(tmp_path):
    out = tmp_path / "report"
    result = run(own_case(tmp_path), "-o", out, "--json")
    text = (out / "report.json").read_text()
    printed = json.loads(result.stdout)
    assert printed.pop("wall_time_s") > 0.0
    assert printed == json.loads(text)
    (case,) = json.loads(text)["cases"]
    assert case["fidelity"] == "quasistatic"
    assert case["models"][0]["within"] == len(case["verdicts"]) == 2
    assert {v["metric"] for v in case["verdicts"]} == {"rms_distance"}
    for case_run in case["runs"]:
        table = read_sweep(str(out / case_run["directory"] / "sweep.csv"))
        assert len(table.rows) == 10
    again = run(own_case(tmp_path), "-o", out, "--json")
    assert json.loads(again.stdout).keys() == {*printed, "wall_time_s"}
    assert (out / "report.json").read_text() == text


@pytest.mark.slow
def test_fidelity_of_the_option_wins(tmp_path):
    out = tmp_path / "report"
    options = ("--fidelity", "reduced", "--json")
    case = json.loads(run(own_case(tmp_path), "-o", out, *options).stdout)["cases"][0]
    assert case["fidelity"] == "reduced"


@pytest.mark.parametrize(("complete", "code"), [(True, 1), (False, 130)])
def test_random_sets_run_alone(complete, code, tmp_path, monkeypatch):
    def runs(store, report, workers, extent):
        table = store / "random-pair-1" / "speeds.csv"
        return [SetRun("pair-1", table, False, "here", "it diverged")], complete

    monkeypatch.setattr(
        validation.commands.validate.random_sets.set_runs, "run_random_sets", runs
    )
    result = run("random-sets", "-o", tmp_path)
    assert result.exit_code == code
    assert "0 of 1 random gear sets keep what is promised" in result.stdout
    assert "it diverged" in (tmp_path / "index.html").read_text()


@pytest.mark.slow
def test_after_ctrl_c_there_is_a_report_of_the_finished_cases(tmp_path, monkeypatch):
    out = tmp_path / "report"
    run_case = validation.study.runs.run_case

    def first_only(case, *others):
        if case.name == "friction-pair":
            raise KeyboardInterrupt
        return run_case(case, *others)

    monkeypatch.setattr(validation.study.runs, "run_case", first_only)
    arguments = ["validate", str(own_case(tmp_path)), "friction-pair", "-o", str(out)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 130
    values = json.loads((out / "report.json").read_text())
    assert [case["case"] for case in values["cases"]] == ["tiny"]
    assert (out / "index.html").is_file()


def test_a_gear_set_that_cannot_be_used_is_told_before_any_run(tmp_path):
    other = tmp_path / "other.toml"
    text = case_text().replace("liu-pair", "liu-par")
    other.write_text(text.replace("tiny", "other"))
    out = tmp_path / "report"
    with pytest.raises(InputError, match="liu-par"):
        run(own_case(tmp_path), other, "-o", out)
    assert not list((out / "runs").iterdir())
