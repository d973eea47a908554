"""`fegear validate`: table, exit codes, files."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from fegear.cli import app
from fegear.errors import InputError
from lumped.sweep_table import read_sweep

CASE = """
name = "tiny"
title = "Tiny"
gear_set = "liu-pair"
torques_Nm = [100]
speeds_Hz = "1000:1200:50"
fidelity = "quasistatic"

[[model]]
number = 1

[[metric]]
name = "rms_distance"
allowed = {allowed}
reason = "for a test"
"""


def run(*words):
    return CliRunner().invoke(
        app, ["validate", *map(str, words)], catch_exceptions=False
    )


def own_case(folder, allowed=0.5):
    path = folder / f"tiny-{allowed}.toml"
    path.write_text(CASE.format(allowed=allowed))
    return path


def test_within_ends_with_0_and_outside_with_1(tmp_path):
    out = tmp_path / "report"
    good = run(own_case(tmp_path), "-o", out)
    assert good.exit_code == 0
    assert "All are within." in good.stdout
    names = ("index.html", "report.md", "report.json")
    assert all(str(out / name) in good.stdout.splitlines()[-1] for name in names)
    bad = run(own_case(tmp_path, 0), "-o", out)
    assert bad.exit_code == 1
    line = "tiny, model-1, 100 N m, up, mesh 1, 5 speeds: rms_distance 0."
    assert line in bad.stdout
    assert "allowed 0\n" in bad.stdout
    assert len(list((out / "runs").iterdir())) == 2


def test_json_is_the_report_and_names_the_csv_files(tmp_path):
    out = tmp_path / "report"
    result = run(own_case(tmp_path), "-o", out, "--json")
    text = (out / "report.json").read_text()
    assert result.stdout == text
    (case,) = json.loads(text)["cases"]
    assert case["fidelity"] == "quasistatic"
    assert case["models"][0]["within"] == len(case["verdicts"]) == 2
    assert {v["metric"] for v in case["verdicts"]} == {"rms_distance"}
    for each in case["runs"]:
        table = read_sweep(str(out / each["directory"] / "sweep.csv"))
        assert len(table.rows) == 10
    again = run(own_case(tmp_path), "-o", out, "--json")
    assert again.stdout == text


def test_fidelity_of_the_option_wins(tmp_path):
    out = tmp_path / "report"
    words = ("--fidelity", "reduced", "--json")
    case = json.loads(run(own_case(tmp_path), "-o", out, *words).stdout)["cases"][0]
    assert case["fidelity"] == "reduced"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["idler"], "-o DIR is missing"),
        (["-o", "out"], "a case or --all is missing; allowed are countershaft"),
        (["idler", "--all", "-o", "out"], "--all and idler exclude each other"),
        (["idler", "idler", "-o", "out"], "case idler is given 2 times"),
        (["idlr", "-o", "out"], "did you mean idler"),
    ],
)
def test_wrong_words_end_in_one_line(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        run(*words)
    assert not list(tmp_path.iterdir())
