"""Functions and commands of one mesh take the torque on its driver."""

from __future__ import annotations

import json

import pytest

import fegear
from fegear.cli import run

SECOND, TORQUE = 2, 100.0
COARSE = fegear.StaticsSettings(positions=4, resolution="coarse", estimate_error=False)


@pytest.fixture(scope="module")
def gears():
    return fegear.load_gear_set("liu-idler")


def test_stress_and_table_are_of_one_torque(gears, tmp_path, capsys):
    table = fegear.solve_mesh(
        gears, SECOND, torques_on_driver=[TORQUE], settings=COARSE
    )
    stress = fegear.solve_stress(
        gears, torque_on_driver=TORQUE, mesh=SECOND, settings=COARSE
    )
    assert stress.field.torque == TORQUE
    assert stress.field.ste == pytest.approx(table.table["ste_m"][0, 0], rel=1e-9)
    argv = ["liu-idler", "--mesh", "2", "--torque", "100", "--resolution", "coarse"]
    file = tmp_path / "c.vtu"
    assert run(["render", *argv, "-o", str(file), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["largest_von_mises_MPa"] == {
        name: pytest.approx(1e-6 * value) for name, value in stress.largest_Pa.items()
    }
