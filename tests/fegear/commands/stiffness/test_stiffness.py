"""What `fegear stiffness` shows beside stiffness: path, root stress, harmonics."""

from __future__ import annotations

import io
import json
import math

import numpy as np
import pytest
from declared_columns import require_declared
from sector_stress import sector_stress

import fegear
from fegear.cli import run as command
from fegear.contact.loads import patch_loads, tooth_loads
from fegear.contact.problem import ContactFailure
from fegear.contact.solve import solve_cycle
from fegear.files.errors import InputError
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from lumped.train.table import format_table, parse_table
from meshes import MeshSize

COARSE = StaticsSettings(resolution="coarse", positions=16)
TORQUES = (50.0, 100.0)


@pytest.fixture(scope="module")
def result():
    study = fegear.MeshStiffness(torque=TORQUES, elements=COARSE)
    return fegear.run(study)


def test_the_reference_pair_is_at_its_place_until_it_leaves_the_path(result):
    table, pair = result.solved.table, result.solved.problem.pair
    place = np.where(table.position < pair.path[1], table.position, np.nan)
    np.testing.assert_allclose(table["path_length_m"][1], pair.base_pitch * place)
    roll = np.degrees(pair.pitch_point + pair.base_pitch * place)
    roll /= pair.driver.base_radius
    np.testing.assert_allclose(table["driver_roll_angle_deg"][0], roll)
    diameter = 2.0 * np.hypot(
        pair.driver.base_radius, np.radians(roll) * pair.driver.base_radius
    )
    np.testing.assert_allclose(table["driver_diameter_m"][0], diameter)
    assert table["sliding_over_pitch_speed"][0, 0] == 0.0
    assert (table["sliding_over_pitch_speed"][0, 1:8] > 0.0).all()
    # the pair behind comes up to the pitch point
    assert (table["pair2_sliding_over_pitch_speed"][0, 8:] < 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize("position", [0.0, 0.25, 0.625])
def test_root_stress_is_that_of_the_field(friction, position):
    gears = fegear.load_gear_set("liu-pair")
    settings = StaticsSettings(positions=8, friction=friction, estimate_error=False)
    solved = solve_mesh(gears, torques_on_driver=[100.0], settings=settings)
    loads = patch_loads(solved.problem, 100.0, position)
    row = round(8 * position)
    for gear, kind in zip(gears.gears, ("driver", "driven"), strict=True):
        stresses = []
        for number, tooth in ((1, 0), (2, -1)):
            of_tooth = tooth_loads(loads, kind, tooth)
            if not any(load.tooth == tooth for load in loads):
                continue
            field = sector_stress(
                gear.geometry, settings.material(gear), of_tooth, MeshSize().refined(2)
            )
            column = solved.table[f"pair{number}_{kind}_root_stress_Pa"]
            assert column[0, row] == pytest.approx(field.root_stress, rel=0.02)
            stresses.append(column[0, row])
        assert solved.table[f"{kind}_root_stress_Pa"][0, row] == max(stresses)


def test_root_stress_of_the_page_is_the_largest_with_its_estimate(result):
    lines = [part for part in result.page() if isinstance(part, str)]
    assert any(line.endswith("[E20]") for line in lines)
    for t, values in enumerate(result.summary["torques"]):
        for gear in ("driver", "driven"):
            largest = 1e-6 * result.solved.table[f"{gear}_root_stress_Pa"][t].max()
            assert values[f"{gear}_root_stress_MPa"] == pytest.approx(largest)
        assert 0.0 < values["discretisation_root_stress"] < 0.1


def test_without_root_stress_the_rest_is_the_same():
    gears = fegear.load_gear_set("liu-pair")
    tables = [
        solve_mesh(
            gears,
            torques_on_driver=[100.0],
            settings=StaticsSettings(
                resolution="coarse", positions=8, root_stress=root_stress
            ),
        ).table
        for root_stress in (True, False)
    ]
    assert not any("root_stress" in name for name in tables[1].columns)
    for name, values in tables[1].columns.items():
        np.testing.assert_array_equal(values, tables[0][name])


def test_a_table_is_read_back_and_needs_no_column_of_the_path(result):
    table = result.solved.table
    read = parse_table(format_table(table))
    assert read == table
    assert read.pair_count == 2


def test_harmonics_in_the_summary_and_in_their_table(result):
    table = result.more_tables["harmonics"]
    require_declared("stiffness", table.names, "harmonics")
    rows = list(table.rows())
    assert [row[:2] for row in rows] == [(t, h) for t in TORQUES for h in range(1, 6)]
    spectrum = np.fft.rfft(result.solved.table["ste_m"][1]) / 8.0
    first = result.summary["torques"][1]["harmonics"][0]
    assert first["ste_amplitude_m"] == pytest.approx(abs(spectrum[1]))
    assert first["ste_phase_rad"] == pytest.approx(np.angle(spectrum[1]))


def test_loss_factor_lies_about_that_of_rigid_teeth(result):
    start, end = result.solved.problem.pair.path
    sliding = 2.0 * math.pi * (1 / 38 + 1 / 55)
    rigid = sliding * 0.5 * (1.0 - (end - start) + start**2 + end**2)
    for values in result.summary["torques"]:
        assert values["loss_factor"] == pytest.approx(rigid, rel=0.1)


@pytest.mark.parametrize(
    ("text", "torques"),
    [
        ("50:200:50", (50.0, 100.0, 150.0, 200.0)),
        ("80,40", (80.0, 40.0)),
        (["10:20:5", 30.0], (10.0, 15.0, 20.0, 30.0)),
        ((40, 20), (40, 20)),
    ],
)
def test_torques_as_ranges_and_lists(text, torques):
    assert fegear.MeshStiffness(torque=text).torque == torques
    assert fegear.Sweep(gear_set="liu-pair", torque=text).torque == torques


@pytest.mark.parametrize("text", ["50:200", "50:200:0", "a", "1:2:3:4", "-1:5:1"])
def test_wrong_torques_are_refused(text):
    with pytest.raises(InputError, match=r"torque = .*; (must be|torques and step)"):
        fegear.MeshStiffness(torque=text)


def test_a_picture_over_torque_needs_two(tmp_path, capsys):
    picture = tmp_path / "p.png"
    assert command(["stiffness", "--torque", "50", "--harris", str(picture)]) != 0
    assert "needs two values of --torque or more" in capsys.readouterr().err
    assert not picture.exists()


def test_pictures_show_the_path_and_the_torques(result):
    path, harris = (result.figures[name]() for name in ("path", "harris"))
    for figure in (path, harris):
        figure.savefig(io.BytesIO(), format="png")
    roots = path.axes[1]
    assert len(roots.lines) >= 2 * len(TORQUES)
    assert len(roots.get_legend().get_texts()) == 2 * len(TORQUES)
    largest = max(np.nanmax(line.get_ydata()) for line in roots.lines[:4])
    shown = [values["driver_root_stress_MPa"] for values in result.summary["torques"]]
    shown += [values["driven_root_stress_MPa"] for values in result.summary["torques"]]
    assert largest == pytest.approx(max(shown))
    (peaks,) = harris.axes[1].lines
    np.testing.assert_array_equal(peaks.get_xdata(), TORQUES)
    ranges = [values["ste_peak_to_peak_um"] for values in result.summary["torques"]]
    np.testing.assert_allclose(peaks.get_ydata(), ranges)


def test_the_picture_of_the_path_says_how_many_torques_it_draws():
    quick = StaticsSettings(positions=8, resolution="coarse", estimate_error=False)
    titles = []
    for count in (5, 7):
        torques = tuple(np.linspace(20.0, 140.0, count))
        study = fegear.MeshStiffness(torque=torques, elements=quick)
        figure = fegear.run(study).figures["path"]()
        titles.append(
            " ".join(text.get_text() for text in figure.texts)
            + str(figure.get_suptitle())
        )
    assert "torques are drawn" not in titles[0]
    assert "5 of 7 torques are drawn" in titles[1]


def fail_above(monkeypatch, limit):
    """Let the contact have no solution above a torque [N m]."""

    def solve(problem, torques, *others):
        if max(torques) > limit:
            raise ContactFailure(f"contact not solved at torque {max(torques):g} N m")
        return solve_cycle(problem, torques, *others)

    monkeypatch.setattr("fegear.statics.solving.solve_cycle", solve)


def test_torques_that_are_solved_outlive_one_that_is_not(monkeypatch, tmp_path, capsys):
    fail_above(monkeypatch, 150.0)
    monkeypatch.chdir(tmp_path)
    typed = "stiffness liu-pair --torque 50,200,100 --positions 4 --resolution coarse"
    assert command([*typed.split(), "-o", "t.csv", "--json"]) == 1
    printed, error = capsys.readouterr()
    values = json.loads(printed)
    assert [row["torque_Nm"] for row in values["torques"]] == [50.0, 100.0]
    (line,) = [line for line in values["warnings"] if "[W66]" in line]
    assert line.startswith("mesh 1 at 200 N m is left out: contact not solved at")
    assert "torque = 200 N m; not solved; finished rows are in t.csv" in error
    table = parse_table((tmp_path / "t.csv").read_text("utf-8"))
    assert table.torque_Nm.tolist() == [50.0, 100.0]


def test_no_torque_that_is_solved_is_a_failure(monkeypatch, tmp_path, capsys):
    fail_above(monkeypatch, 10.0)
    monkeypatch.chdir(tmp_path)
    typed = "stiffness liu-pair --torque 50,100 --positions 4 --resolution coarse"
    assert command([*typed.split(), "-o", "t.csv"]) == 1
    assert "not solved at torque" in capsys.readouterr().err
    assert not (tmp_path / "t.csv").exists()
