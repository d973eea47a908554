"""Comparisons with other programs, by the programs where they are installed."""

from __future__ import annotations

import math

import numpy as np
import pytest

import fegear
from validation.programs import (
    exudyn_pair,
    fmu_pair,
    opentorsion_train,
    ross_helical,
    ross_rotor,
)
from validation.programs.comparison import (
    ComparedValue,
    compare_motions,
    format_rows,
    record_rows,
    recorded_page,
    recorded_rows,
)
from validation.programs.export_files import FMU, LINEAR, write_files
from validation.programs.exported_pair import ExportedPair, MeshMotion, read_pair

RECORDED = "exudyn", "opentorsion", "ross", "ross_rotor", "ross_helical", "fmu"


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The folder of files that all comparisons read."""
    folder = tmp_path_factory.mktemp("exported")
    write_files(folder)
    return folder


@pytest.mark.slow
def test_exudyn_gives_our_motions(exported):
    pytest.importorskip("exudyn")
    require_met(exudyn_pair.compare(exported), recorded_rows("exudyn"))


@pytest.mark.slow
def test_opentorsion_gives_our_frequencies_and_our_motion(exported):
    pytest.importorskip("opentorsion")
    require_met(opentorsion_train.compare(exported), recorded_rows("opentorsion"))


def require_met(rows, recorded):
    """Rows within their tolerances, and as recorded."""
    assert [row.quantity for row in rows if not row.is_met] == []
    assert [row.quantity for row in rows] == [row.quantity for row in recorded]
    for row, before in zip(rows, recorded, strict=True):
        assert row.theirs == pytest.approx(before.theirs, rel=1e-2, abs=0.05)


@pytest.mark.parametrize("name", RECORDED)
def test_recorded_differences_are_within_their_tolerances(name):
    rows = recorded_rows(name)
    assert any(row.tolerance for row in rows)
    assert [row.quantity for row in rows if not row.is_met] == []
    assert rows[0].quantity in recorded_page(name)


def test_spinning_rotors_have_the_recorded_frequencies_of_ross():
    """Ours, computed anew, beside those that ROSS had."""
    rows = ross_rotor.compare_recorded()
    assert len(rows) == len(recorded_rows("ross_rotor")) - ross_rotor.CRITICAL_SPEEDS
    for row in rows:
        assert abs(row.difference) < 1e-6, row.quantity  # per cent


def test_a_helical_pair_has_the_recorded_frequencies_of_ross():
    """Ours, computed anew, beside those of ROSS with its mesh mended."""
    rows = ross_helical.compare_recorded()
    assert len(rows) == len(recorded_rows("ross_helical"))
    judged = [row for row in rows if row.tolerance]
    assert len(judged) == 2 * ross_helical.COUNT
    for row in judged:
        assert abs(row.difference) < 1e-7, row.quantity  # per cent


def test_a_row_is_judged_by_its_scale_and_tolerance():
    assert ComparedValue("a", "N", 2.0, 2.1).difference == pytest.approx(5.0)
    assert ComparedValue("a", "N", 0.0, 0.1, 10.0).difference == pytest.approx(1.0)
    assert ComparedValue("a", "N", 2.0, 2.1).is_met
    assert not ComparedValue("a", "N", 2.0, 2.1, tolerance=4.0).is_met
    assert not ComparedValue("a", "N", 2.0, math.nan, tolerance=4.0).is_met


def test_rows_are_recorded_and_read_back(tmp_path):
    row = ComparedValue("force", "N", 2.0, 2.1, tolerance=6.0)
    record_rows(tmp_path / "r.json", [row], ["numpy"])
    text = (tmp_path / "r.json").read_text()
    assert f'"numpy": "{np.__version__}"' in text
    assert format_rows([row]).splitlines()[2].split("|")[1:6] == [
        *(" force    ", " N    ", " 2      ", " 2.1           ", " 5              ")
    ]


def test_equal_motions_do_not_differ():
    time = np.linspace(0.0, 1.0, 9)
    wave = 2.0 + np.sin(2.0 * np.pi * time)
    motion = MeshMotion(time, 1e-6 * wave, wave)
    rows = compare_motions("m", motion, motion, 1e-9)
    assert [row.difference for row in rows] == [0.0] * 6
    shifted = MeshMotion(time, 1e-6 * wave + 2e-7, wave - 2.5)
    rows = compare_motions("m", motion, shifted, None)
    values = {row.quantity: row.difference for row in rows}
    assert values["m: deflection, largest distance"] == pytest.approx(10.0)
    assert values["m: contact lost"] > 0.0


def test_a_pair_is_read_from_the_files_of_two_commands(tmp_path):
    """By the numbers that fegear has in memory."""
    gears = fegear.load_gear_set("liu-pair")
    settings = fegear.StaticsSettings(positions=8, estimate_error=False)
    solved = fegear.solve_mesh(gears, 1, [100.0], settings)
    solved.to_csv(tmp_path / "table.csv")
    study = fegear.ModelExport(gear_set="liu-pair", torque=100.0, stiffness="fe")
    model = fegear.run(study)
    model.write(tmp_path / "train.npz")
    pair = read_pair(tmp_path)
    assert isinstance(pair, ExportedPair)
    assert pair.teeth == (38, 55)
    stiffness = solved.table["stiffness_N_per_m"][0]
    assert pair.stiffness.tolist() == stiffness.tolist()
    third = 2.0 * math.pi / 38 * (2.0 + 3.0 / 8.0)
    assert pair.stiffness_at(third) == pytest.approx(stiffness[3])
    force = pair.force(third, -pair.backlash - 1e-6)
    assert force == pytest.approx(-1e-6 * stiffness[3], rel=1e-6)
    assert pair.force(third, -1e-6) == 0.0
    assert pair.base_radius @ pair.rotation_rates(900.0) == pytest.approx(0.0)
    reduced = 1.0 / float(np.sum(pair.base_radius**2 / pair.inertia))
    expected = 2.0 * 0.04 * math.sqrt(pair.mean_stiffness * reduced)
    assert pair.damping == pytest.approx(expected)


@pytest.mark.slow
def test_fmpy_gives_our_motion_and_converges(exported):
    pytest.importorskip("fmpy")
    pytest.importorskip("pythonfmu")
    require_met(fmu_pair.compare(exported), recorded_rows("fmu"))
    pair, path = read_pair(exported), exported / FMU
    motions = [
        fmu_pair.simulate_pair(path, pair, LINEAR, steps)
        for steps in (64, 128, 256, 512)
    ]
    waves = [motion.deflection[:: motion.time.size // 64] for motion in motions]
    errors = [float(np.abs(wave - waves[-1]).max()) for wave in waves[:-1]]
    assert errors[1] < errors[0] / 3.0  # second order: 4 against the exact motion
    assert errors[2] < errors[1] / 3.0
