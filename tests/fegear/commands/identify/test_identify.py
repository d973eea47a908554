"""`fegear identify` on the screen, in files and as JSON."""

from __future__ import annotations

import json
from functools import cache
from importlib import resources

import pytest
from drawn_figures import axis_labels, drawn_points, saved_figures
from typer.testing import CliRunner

from fegear.cli import app
from fegear.files.errors import InputError

FAST = ("liu-pair", "--resolution", "coarse")


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["identify", *arguments], catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


@cache
def best(*options: str) -> dict[str, float]:
    return json.loads(run(*FAST, *options, "--json"))["best"]


@pytest.mark.slow
def test_figures_of_the_gear_set_by_default(tmp_path):
    table, plot = str(tmp_path / "v.csv"), str(tmp_path / "v.png")
    with saved_figures() as figures:
        text = run(*FAST, "-o", table, "--plot", plot)
    for word in ("hub radius", "of idler", "face width", "* the set chosen", "2.9800"):
        assert word in text
    header, *rows = (tmp_path / "v.csv").read_text().splitlines()[2:]
    assert header.startswith("set,pinion_face_width_mm")
    kinds = [row.partition(",")[0] for row in rows]
    assert kinds[0] == "chosen"
    assert set(kinds[1:]) == {"equally good", "worse"}
    assert axis_labels(*figures) == {
        *("hub radius of pinion [mm]", "[mm]", "mean stiffness\n[1e8 N/m]"),
        *("peak to peak\nover mean", "misfit"),
    }
    assert len(drawn_points(*figures)) > 4 * (len(rows) - 1)


@pytest.mark.slow
def test_the_set_chosen_meets_the_figures():
    fitted = best("--mean", "2.5e8", "--variation", "0.33")
    assert fitted["mesh1_mean_stiffness_N_per_m"] == pytest.approx(2.5e8, rel=5e-3)
    assert fitted["mesh1_stiffness_variation"] == pytest.approx(0.33, abs=5e-3)


@pytest.mark.slow
def test_along_chooses_the_gear_of_the_valley():
    values = json.loads(run(*FAST, "--along", "idler", "--json"))
    assert values["equally_good_from"] == "idler"
    hubs = [row["idler_hub_radius_mm"] for row in values["valley"]]
    assert hubs == sorted(hubs)


def test_teeth_must_be_equal():
    errors = "gear.1.pitch_errors_um=[" + ", ".join(["0", "3"] * 19) + "]"
    with pytest.raises(InputError, match=r"pinion.* has pitch_errors_um"):
        run(*FAST, "--set", errors)


@pytest.mark.slow
def test_figures_that_no_set_meets_are_named():
    result = CliRunner().invoke(
        app,
        ["identify", *FAST, "--mean", "3e7", "--variation", "0.33"],
        catch_exceptions=False,
    )
    assert result.exit_code == 0
    assert (
        "warning: no set agrees with the measured values: the best one is"
        in result.stderr
    )
    assert "at their limit, 0.25 of those given" in result.stderr
    fitting = CliRunner().invoke(app, ["identify", *FAST], catch_exceptions=False)
    assert "warning" not in fitting.stderr


def test_nothing_measured_names_the_options(tmp_path):
    text = (resources.files("fegear.gearset") / "sets" / "liu-pair.toml").read_text()
    gear_set = tmp_path / "own.toml"
    lines = [
        line
        for line in text.splitlines()
        if not line.startswith(("mean_stiffness", "stiffness_variation"))
    ]
    gear_set.write_text("\n".join(lines))
    with pytest.raises(InputError, match="--mean or --variation is missing; liu-pair"):
        CliRunner().invoke(app, ["identify", str(gear_set)], catch_exceptions=False)
