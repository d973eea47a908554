"""`fegear rattle`: machines, quiet motion and basins, and what is said on the way."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from drawn_figures import axis_labels, drawn_points, saved_figures
from ended_runs import killed_after
from typer.testing import CliRunner

from fegear.cli import app, run
from fegear.commands.rattle.basin import default_side
from fegear.commands.rattle.machine_studies import default_returns

GUIDE = Path(__file__).parents[4] / "docs" / "howto" / "rattle.md"
BASIN = "rattle", "basin", "roots-scaled"
SMALL = (*BASIN, "--grid", "30", "--delta", "0.575")


def json_output(*arguments: str) -> dict:
    result = CliRunner().invoke(app, [*arguments, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_critical_eccentricity_of_the_built_in_pump():
    values = json_output("rattle", "critical", "roots-a")
    assert values["critical_eccentricity_rad"] == pytest.approx(9.378e-5, rel=1e-4)
    assert not values["quiet_motion_exists"]
    helps = values["critical_sensitivity"]
    assert helps["damping"] == pytest.approx(1.0, abs=1e-3)
    assert 0.0 < helps["stiffness"] < 0.1
    quieter = json_output("rattle", "critical", "roots-a", "--epsilon", "9e-5")
    assert quieter["quiet_motion_exists"]
    impact = json_output("rattle", "critical", "roots-a", "--kappa", "inf")
    assert impact["stiffness"] is None
    assert impact["critical_eccentricity_rad"] == pytest.approx(3e-4 / math.pi)


def test_basins_on_screen_in_files_and_for_machines(tmp_path):
    """All say the same."""
    file, plot = tmp_path / "b.npz", tmp_path / "b.png"
    with saved_figures() as figures:
        values = json_output(*SMALL, "-o", str(file), "--plot", str(plot))
    names = [attractor["name"] for attractor in values["attractors"]]
    assert names == ["quiet", "P(1,1,0)", "P(1,2,0)", "P(2,2,1)"]
    total = sum(attractor["fraction"] for attractor in values["attractors"])
    assert total == pytest.approx(1.0)
    with np.load(file) as archive:
        assert archive["names"].tolist() == names
        assert int(archive["iterations"]) == 1499
        cells = archive["attractor"]
        fractions = np.bincount(cells.ravel()) / cells.size
        np.testing.assert_allclose(fractions, archive["fraction"])
        assert cells.shape == (30, 30)
        assert float(archive["damping"]) == 0.575
    (figure,) = figures
    assert axis_labels(figure) == {
        "time of lift-off from the upper flank [turns]",
        "speed of lift-off [rad per turn]",
    }
    (colours,) = (image.get_array() for axes in figure.axes for image in axes.images)
    for number in np.unique(cells):  # in one colour, which no other has
        colour = np.unique(colours[cells == number], axis=0)
        assert len(colour) == 1
        assert not (colours[cells != number] == colour).all(axis=-1).any()
    page = CliRunner().invoke(app, list(SMALL)).stdout
    for attractor in values["attractors"]:
        assert attractor["name"] in page
        assert f"{100.0 * attractor['fraction']:.2f}" in page


def test_motions_that_repeat_are_listed_with_their_stability():
    values = json_output("rattle", "periodic", "roots-scaled", "--max-liftoffs", "1")
    stability = [(orbit["name"], orbit["stable"]) for orbit in values["orbits"]]
    assert stability == [
        *(("P(1,1,0)", True), ("P(1,1,0)", False)),
        *[("P(1,1,1)", False)] * 2,
    ]
    assert (
        max(orbit["distance_to_closed_form"] or 0.0 for orbit in values["orbits"])
        < 1e-9
    )
    assert values["least_eccentricity_of_P(1,1,0)_rad"] == pytest.approx(
        0.05964, abs=1e-5
    )
    arguments = "rattle", "periodic", "roots-scaled", "--max-liftoffs", "1"
    page = CliRunner().invoke(app, arguments).stdout
    assert page.count("P(1,1,0)") == 3  # one below the table
    assert "P(1,1,0) exists from 0.05964 rad up to 0.4707 rad" in page
    arguments = "rattle", "periodic", "roots-scaled", "--max-liftoffs", "3"
    page = CliRunner().invoke(app, arguments).stdout
    assert "P(3,3,2)" in page  # fits a narrow screen


def small_play(tmp_path, **changes):
    """A machine whose play is too small for the flight of one impact a turn."""
    keys = {"damping": 0.02, "half_backlash_rad": 2e-3, "eccentricity_rad": 5e-3}
    keys |= {"restitution": 0.9, **changes}
    lines = "\n".join(f"{key} = {value}" for key, value in keys.items())
    path = tmp_path / "mine.toml"
    path.write_text(f'name = "mine"\n[machine]\n{lines}\n')
    return str(path)


def test_rattle_that_the_play_forbids_is_not_said_to_exist(tmp_path):
    """The flight is 0.031 rad high in a play of 0.004 rad, 0.01 rad less or more."""
    former = {
        "critical": "simple_rattle_in_impacts_from_rad",
        "periodic": "least_eccentricity_of_P(1,1,0)_rad",
    }
    for command, name in former.items():
        path = small_play(tmp_path)
        values = json_output("rattle", command, path)
        conditions = values["single_impact"]
        assert values[name] is conditions["from_rad"] is conditions["to_rad"] is None
        assert conditions["orbit_from_rad"] == pytest.approx(0.001119, abs=1e-6)
        assert conditions["play_rad"] == 0.004 < conditions["least_play_rad"]
        heights = [flight["height_rad"] for flight in conditions["flights"]]
        assert heights == pytest.approx([0.0220, 0.0412], abs=1e-4)
        assert {flight["meets_flank"] for flight in conditions["flights"]} == {"back"}
        page = CliRunner().invoke(app, ["rattle", command, path]).stdout
        assert (
            "exists at no eccentricity: impacts balance the drag from 0.001119" in page
        )
        assert "is 0.02199 rad high, the play is 0.004 rad: it meets the back" in page
        path = small_play(tmp_path, half_backlash_rad=5e-2)
        values = json_output("rattle", command, path)
        assert values[name] == pytest.approx(0.001119, abs=1e-6)
        path = small_play(tmp_path, eccentricity_rad=1e-3)
        page = CliRunner().invoke(app, ["rattle", command, path]).stdout
        assert "at 0.001 rad impacts do not balance the drag" in page
        path = small_play(tmp_path, restitution=0.0)
        page = CliRunner().invoke(app, ["rattle", command, path]).stdout
        assert "exists at no eccentricity: flanks do not rebound" in page


def test_the_machine_of_a_new_file_rattles_within_its_play(tmp_path):
    path = str(tmp_path / "machine.toml")
    assert CliRunner().invoke(app, ["new", "machine", "-o", path]).exit_code == 0
    values = json_output("rattle", "critical", path)
    eccentricity, conditions = values["eccentricity_rad"], values["single_impact"]
    assert conditions["from_rad"] < eccentricity < conditions["to_rad"]
    orbits = json_output("rattle", "periodic", path, "--max-liftoffs", "1")["orbits"]
    assert ("P(1,1,0)", True) in [(o["name"], o["stable"]) for o in orbits]
    basins = json_output("rattle", "basin", path, "--grid", "20")["attractors"]
    assert {"quiet", "P(1,1,0)"} <= {attractor["name"] for attractor in basins}
    noise = json_output("rattle", "noise", path, "--starts", "50")
    assert 0.0 < noise["quiet_probability"] < 1.0


def test_a_machine_file_is_read(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\n[machine]\ndamping = 0.6\neccentricity_rad = 0.059\n'
        "half_backlash_rad = 0.6\n"
    )
    values = json_output("rattle", "basin", str(path), "--grid", "10")
    assert [attractor["name"] for attractor in values["attractors"]] == ["quiet"]


@pytest.mark.slow
def test_a_killed_run_loses_the_tiles_under_way_only(tmp_path):
    """And gives the same file when it is taken up again."""
    arguments = [*BASIN, "--grid", "120", "-o"]
    program = [sys.executable, "-c", "from fegear.cli import main; main()"]
    whole, file = tmp_path / "whole.npz", tmp_path / "b.npz"
    assert run([*arguments, str(whole)]) == 0
    checkpoint = tmp_path / "b.npz.partial"
    killed_after(3, [*arguments, str(file)])
    assert not file.exists()
    assert checkpoint.exists()
    resumed = subprocess.run(
        [*program, *arguments, str(file), "--resume"], capture_output=True, text=True
    )
    assert resumed.returncode == 0
    assert re.search(r" [1-9]\d* tiles are finished$", resumed.stderr, re.MULTILINE)
    with np.load(whole) as one, np.load(file) as two:
        for name in one.files:
            np.testing.assert_array_equal(one[name], two[name])
    assert not checkpoint.exists()


def test_a_run_taken_up_where_there_is_none_says_so_once(tmp_path, capsys):
    file = str(tmp_path / "b.npz")
    assert run([*BASIN, "--grid", "10", "-o", file, "--resume"]) == 0
    assert capsys.readouterr().err.count("\n") == 1


def test_what_comes_to_rest_has_one_name_in_all_commands():
    arguments = "roots-scaled", "--epsilon", "0.2", "--restitution", "0.95"
    basins = json_output("rattle", "basin", *arguments, "--grid", "40")
    (attractor,) = basins["attractors"]
    assert (attractor["name"], attractor["period"]) == ("sticking(1)", 1)
    assert attractor["lyapunov_per_turn"] is None
    noise = json_output(
        "rattle", "noise", *arguments, "--starts", "20", "--turns", "20"
    )
    assert [motion["name"] for motion in noise["motions"]] == ["sticking(1)"]
    periodic = json_output("rattle", "periodic", *arguments, "--max-liftoffs", "1")
    (rests,) = [o for o in periodic["orbits"] if o["name"] == "sticking(1)"]
    assert rests["liftoffs"] == [pytest.approx(attractor["point"], abs=1e-9)]
    assert not json_output("rattle", "periodic", "roots-scaled", "--restitution", "0")[
        "orbits"
    ]


def test_speeds_are_those_of_the_machine():
    """And not those of another: of roots-a twice 2 pi damping and 4 half backlashes."""
    options = "--grid", "5", "--iterations", "100"
    low, high = json_output("rattle", "basin", "roots-a", *options)[
        "velocity_rad_per_turn"
    ]
    assert low == 0.0
    assert high == pytest.approx(4.0 * math.pi * 3e-4 + 4.0 * 6e-4)


@pytest.mark.slow
def test_what_has_not_settled_is_told_and_left_out():
    """Where damping is low 1499 returns are few; enough of them are the default."""
    basin = "rattle", "basin", "roots-a", "--grid", "5", "--iterations", "1499"
    result = CliRunner().invoke(app, list(basin))
    assert (
        "100 % of the cells have reached no attractor in 1499 returns" in result.stderr
    )
    assert "--iterations 138200" in result.stderr
    assert "basin entropy" not in result.stdout
    values = json_output(*basin)
    assert (values["attractors"], values["basin_entropy"]) == ([], None)
    assert values["undecided_fraction"] == 1.0
    arguments = "noise", "roots-a", "--starts", "4", "--turns", "20"
    few = json_output("rattle", *arguments, "--iterations", "200")
    assert few["noise_rad2_per_turn3"] is None
    assert few["undecided_fraction"] == 1.0
    enough = json_output("rattle", *arguments)
    assert enough["iterations"] == 138_200
    assert enough["noise_rad2_per_turn3"] > 0.0
    assert not enough["warnings"]


@pytest.mark.slow
def test_basins_of_low_damping_are_followed_until_transients_end(tmp_path):
    """The machine of the guide, whose basin was grey: no cell had an attractor."""
    blocks = re.findall(r"```toml\n(.*?)```", GUIDE.read_text("utf-8"), re.DOTALL)
    (text,) = [block for block in blocks if 'name = "my-pump"' in block]
    machine = tmp_path / "my-pump.toml"
    machine.write_text(text, "utf-8")
    values = json_output("rattle", "basin", str(machine), "--grid", "5")
    assert values["iterations"] == 138_200
    assert values["undecided_fraction"] < 0.5
    assert len(values["attractors"]) > 1


def test_returns_by_default_are_those_of_the_damping():
    """One rule for basins and noise; a grid takes no more returns for it."""
    assert default_returns(1499) == 1499
    assert default_returns(138_200) == 138_200
    assert default_returns(4.14e10) == default_returns(math.inf) == 1499
    assert default_side(1499) == 400
    assert default_side(138_200) ** 2 * 138_200 <= 400**2 * 1499
    assert default_side(10_000_000) == 20


@pytest.mark.parametrize("arguments", ["basin --grid 5", "noise --starts 4"])
def test_no_more_returns_are_advised_than_are_allowed(arguments):
    command, *options = arguments.split()
    machine = "roots-scaled", "--delta", "1e-9", *options
    (warning,) = json_output("rattle", command, *machine)["warnings"]
    assert warning.startswith("100 % of the")
    assert warning.endswith(
        "half the damping ends transients in 4.14e+10, which --iterations cannot be: "
        "10000000 are the most [W22]"
    )
    assert run(["rattle", command, *machine, "--iterations", "10000001"]) == 2


def test_tables_of_noise_say_how_they_were_made(tmp_path):
    file = tmp_path / "noise.csv"
    arguments = "rattle", "noise", "roots-scaled", "--starts", "3", "--seed", "5"
    assert run([*arguments, "-o", str(file), "--turns", "20"]) == 0
    lines = set(file.read_text().splitlines())
    assert {"# starts: 3", "# seed: 5", "# turns: 20", "# iterations: 1499"} <= lines


def test_a_map_without_inverse_has_no_manifolds(capsys):
    arguments = ["rattle", "manifold", "roots-scaled", "--restitution", "0"]
    assert run(arguments) == 2
    assert "lift-offs have no pre-images" in capsys.readouterr().err


def test_a_plot_of_runs_that_settle_to_nothing(tmp_path, recwarn):
    plot = tmp_path / "n.png"
    options = ("--starts", "2", "--turns", "5", "--iterations", "200", "--plot", plot)
    with saved_figures() as figures:
        assert run(["rattle", "noise", "roots-a", *map(str, options)]) == 0
    assert "part of the runs that are less loud" in axis_labels(*figures)
    assert not len(drawn_points(*figures))
    assert not [w for w in recwarn if "constrained_layout" in str(w.message)]
