"""`fegear stability`: chart, picture, interruption, wrong input."""

from __future__ import annotations

import json

import pytest
from cli_commands import printed, rows_of

import fegear
from fegear.cli import run
from fegear.files.errors import InputError
from fegear.studies import stability
from fegear.train import lumped_models
from lumped.steady.maps import Axis

WORDS = [
    *("stability", "liu-idler", "--excitation", "rectangular", "--damping", "0.002"),
    *("--over", "friction=0:0.15:4", "--bending", "0.39", "--speeds", "1400:3600:50"),
]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stability")
    path, plot = folder / "s.csv", folder / "s.png"
    values = printed(*WORDS, "--json", "-o", path, "--plot", plot)
    return json.loads(values), rows_of(path), folder


def test_a_row_for_every_cell(made):
    _, rows, folder = made
    assert list(rows[0]) == ["mesh_frequency_Hz", "friction", "floquet_max", "kind"]
    assert len(rows) == 4 * 45
    assert (folder / "s.png").stat().st_size > 20_000
    assert not list(folder.glob("*.partial"))
    for row in rows:
        assert bool(row["kind"]) == (float(row["floquet_max"]) > 1.0 + 1e-9)


def test_intervals_hold_the_unstable_cells(made):
    values, rows, _ = made
    for row in rows:
        (column,) = [
            c for c in values["columns"] if c["value"] == float(row["friction"])
        ]
        speed = float(row["mesh_frequency_Hz"])
        own = [
            each["kind"]
            for each in column["intervals"]
            if each["from_Hz"] <= speed <= each["to_Hz"]
        ]
        assert own == ([row["kind"]] if row["kind"] else [])


def test_methods_tell_the_same(made, tmp_path):
    _, rows, _ = made
    few = [*WORDS[:-2], "--speeds", "1400:3600:200"]
    printed(*few, "--method", "exponential", "-o", tmp_path / "e.csv")
    at = {
        (r["mesh_frequency_Hz"], r["friction"]): float(r["floquet_max"]) for r in rows
    }
    for row in rows_of(tmp_path / "e.csv"):
        exact = at[row["mesh_frequency_Hz"], row["friction"]]
        assert float(row["floquet_max"]) == pytest.approx(exact, abs=1e-4)


def test_an_interrupted_chart_goes_on_to_the_same_bytes(made, tmp_path, monkeypatch):
    _, _, folder = made
    path, known = tmp_path / "s.csv", stability.scan_stability
    seen = []

    def stopped(*args):
        seen.append(args)
        if len(seen) > 2:
            raise KeyboardInterrupt
        return known(*args)

    monkeypatch.setattr(stability, "scan_stability", stopped)
    printed(*WORDS, "-o", path, code=130)
    assert "incomplete" in path.read_text("utf-8")
    monkeypatch.setattr(stability, "scan_stability", known)
    printed(*WORDS, "-o", path, "--resume")
    assert path.read_bytes() == (folder / "s.csv").read_bytes()


def test_the_bending_ratio_is_told_and_kept_runs_of_another_are_refused(
    made, tmp_path, monkeypatch, capsys
):
    values, _, folder = made
    assert values["friction_bending_ratio"] == "0.39"
    header = (folder / "s.csv").read_text("utf-8")
    assert "# friction-bending ratio: 0.39\n" in header
    assert "# friction coefficient" not in header
    known, seen = stability.scan_stability, []

    def stopped(*given):
        seen.append(given)
        if len(seen) == 3:
            raise KeyboardInterrupt
        return known(*given)

    monkeypatch.setattr(stability, "scan_stability", stopped)
    path = tmp_path / "s.csv"
    printed(*WORDS, "-o", path, code=130)
    capsys.readouterr()
    other = [word if word != "0.39" else "0.4" for word in WORDS]
    assert run([*other, "-o", str(path), "--resume"]) == 2
    assert "was begun with model.bending = '0.39', now '0.4'" in capsys.readouterr().err


def test_what_changes_nothing_is_told():
    words = ["stability", "liu-pair", "--excitation", "rectangular", "--json"]
    over = ["--over", "mesh.1.backlash_um=10,20", "--speeds", "1000:2000:500"]
    values = json.loads(printed(*words, *over))
    warning = "mesh.1.backlash_um does not change the multipliers"
    assert values["warnings"] == [warning]


def test_friction_bending_comes_from_the_finite_elements(monkeypatch):
    given = []
    known = lumped_models.with_bending

    def kept(excitation, friction):
        given.append(friction)
        return known(excitation, friction)

    monkeypatch.setattr(lumped_models, "with_bending", kept)
    words = ["stability", "liu-pair", "--over", "friction=0.1"]
    printed(*words, "--resolution", "coarse", "--speeds", "5000:6000:500")
    assert given[-1].coefficient == 0.1
    assert given[-1].bending == pytest.approx(0.39, abs=0.03)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--over friction=0:1.5:3", "--over friction = 1.5; allowed 0 to below 1"),
        ("--over friction=-0.1,0.1", "--over friction = -0.1; allowed"),
        ("--over friction=0:0.2:3 --friction 0.1", "--over friction replaces it"),
        ("--over friction_bending=0:0.5:3", "needs --friction above 0"),
        ("--over damping_ratio=0.01,0.02 --bending 0.3", "needs --friction above 0"),
        ("--over mesh_frequency_Hz=1:2:3", "is the speed, --speeds"),
        ("--over friction=0.1 --excitation rectangular", "bending is missing"),
        ("--over friction=0.1 --speeds 1000", "two or more are needed"),
        ("--over friction=0.1 --speeds 0.05:10:1", "allowed 0.1 to 1000000 Hz"),
        ("--over friction=0.1 --method euler", "--method = euler; allowed"),
        ("--over friction=0.1 --model 2 --bending 0.3", "--model = 2; allowed is 1"),
        ("--over nothing=0.1,0.2", "nothing"),
        ("--over damping_ratio=0,2", "damping_ratio"),
    ],
)
def test_wrong_input_is_one_line(words, message, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    given = words.split()
    speeds = [] if "--speeds" in given else ["--speeds", "1000:2000:500"]
    elements = [] if "--excitation" in given else ["--resolution", "coarse"]
    assert run(["stability", "liu-pair", *given, *speeds, *elements]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_too_many_cells_are_refused():
    axis = Axis("friction", tuple(i / 1e5 for i in range(10_000)))
    with pytest.raises(InputError, match="4000000 cells"):
        fegear.Stability(gear_set="liu-pair", over=axis, speeds=range(1, 1001))


def test_bending_varies_without_finite_elements():
    words = ["stability", "liu-pair", "--over", "friction_bending=0,0.4"]
    words += ["--friction", "0.1", "--excitation", "rectangular", "--damping", "0.01"]
    values = json.loads(printed(*words, "--speeds", "5500:6500:100", "--json"))
    first, second = values["columns"]
    assert first["largest_multiplier"] != second["largest_multiplier"]


def test_sweeps_and_waves_take_friction(tmp_path):
    at = [*("liu-pair", "--resolution", "coarse", "--torque", "100")]
    sweep = ["sweep", *at, "--speeds", "2000:2200:100", "--json"]
    found = {
        words: json.loads(printed(*sweep, *words.split()))
        for words in ("", "--friction 0.1", "--friction 0.1 --no-bending")
    }
    levels = [
        values["branches"][0]["largest"][0]["dte_rms_m"] for values in found.values()
    ]
    assert len({round(1e9 * level, 3) for level in levels}) == 3
    assert [each["friction_coefficient"] for each in found.values()] == [0.0, 0.1, 0.1]
    shown = printed("motion", *at, "--speed", 2100, "--friction", 0.1)
    assert "friction 0.1, torque of gears without" in shown
    words = ["--friction", "0.1", "--sliding", "instantaneous"]
    assert "friction 0.1 turned by vib" in printed(
        "motion", *at, "--speed", 2100, *words
    )
    values = json.loads(printed(*sweep, *words))
    assert values["sliding"] == "instantaneous"
    assert [each["sliding"] for each in found.values()] == [None, "nominal", "nominal"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--no-bending", "--no-bending; needs --friction above 0"),
        ("--bending 0.3", "--bending = 0.3; needs --friction above 0"),
        ("--friction 0.1 --bending 0.3 --no-bending", "--no-bending replaces it"),
        ("--friction 0.1 --model 2", "--friction needs model 1, got 2"),
        ("--friction 0.1 --model coupled", "--friction needs model 1, got coupled"),
        ("--friction 0.1 --method dopri5", "rk4"),
        ("--friction 0.1 --no-bending --excitation fourier", "every tooth pair"),
        ("--friction 1", "--friction must be 0 to below 1, got 1.0"),
        (
            "--friction 0.1 --bending 0.3 --varying-bending",
            "--varying-bending replaces it",
        ),
        (
            "--friction 0.1 --no-bending --varying-bending",
            "--no-bending; --varying-bending replaces it",
        ),
        (
            "--friction 0.1 --varying-bending --excitation rectangular",
            "bending is missing",
        ),
        (
            "--sliding instantaneous",
            "--sliding = instantaneous; needs --friction above 0",
        ),
        ("--friction 0.1 --sliding rolling", "--sliding = rolling; allowed"),
        (
            "--friction 0.1 --transition-speed 0.1",
            "is of instantaneous sliding, got nominal",
        ),
        (
            "--friction 0.1 --sliding instantaneous --transition-speed -1",
            "--transition-speed must be",
        ),
    ],
)
def test_wrong_friction_of_sweeps_is_one_line(words, message, capsys):
    given = ["--resolution", "coarse"] if "--excitation" not in words else []
    argv = ["sweep", "liu-pair", "--speeds", "2000", *given, *words.split()]
    assert run(argv) == 2
    assert message in capsys.readouterr().err


def test_integration_is_left_to_the_benchmark(capsys):
    """It took 14 s for what the series does in 0.02 s."""
    assert run([*WORDS, "--method", "integration"]) == 2
    assert "--method" in capsys.readouterr().err
