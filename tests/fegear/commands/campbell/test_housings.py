"""Campbell diagrams of machines whose bearings are in a housing."""

from __future__ import annotations

import numpy as np
import pytest
from free_housings import bearing_nodes, free_block, write_housing
from short_uses import SHORT_USES
from small_sets import BALLS, BENT, HOUSED

import fegear
from fegear.cli import run
from fegear.files.toml import toml_text
from fegear.gearset import read_gear_set
from fegear.train.rotors import rotor_system
from lumped.rotors.housing import Housing

SHORT = {"points": 3, "elements": 3, "modes": 8}
SOLVED = {
    "stiffness": "fe",
    "motion": "space",
    "excitation": fegear.ExcitationSettings(resolution="coarse"),
    "torque": 20.0,
    "max_rpm": 6000.0,
}
ON_GROUND = {name: value for name, value in HOUSED.items() if name != "housing"}
SPRUNG = ON_GROUND | {
    "shaft": [
        {
            name: v
            for name, v in shaft.items()
            if "kxy" not in name and "kyx" not in name
        }
        for shaft in ON_GROUND["shaft"]
    ]
}


KEYS = ("bearing_kx_N_per_m", "bearing_ky_N_per_m", "bearing_kz_N_per_m")
ALIKE = {key: [4e7, 4e7] for key in KEYS}
ALIKE["bearing_tilt_stiffness_Nm_per_rad"] = [1e4, 1e4]
UNDAMPED = SPRUNG | {
    "shaft": [
        {name: v for name, v in shaft.items() if "_c" not in name} | ALIKE
        for shaft in SPRUNG["shaft"]
    ]
}


@pytest.fixture
def campbell(tmp_path):
    def solve(tables, housing=None, **changes):
        if housing is not None:
            write_housing(tmp_path / "h.mat", housing)
            tables = tables | {"housing": {"file": "h.mat"}}
        path = tmp_path / "set.toml"
        path.write_text(toml_text(tables))
        study = fegear.CampbellDiagram(gear_set=str(path), **(SHORT | changes))
        return fegear.run(study)

    return solve


def springs(tables, factor):
    """Massless springs under all bearings, much stiffer than these."""
    system = rotor_system(read_gear_set(toml_text(tables)), [1e8], 3)
    nodes = bearing_nodes(system)
    values = np.tile(factor * np.array([5e7, 5e7, 5e7, 1e4, 1e4, 1e4]), len(nodes))
    mass = np.zeros((len(values),) * 2)
    return Housing(stiffness=np.diag(values), mass=mass, nodes=nodes)


@pytest.mark.parametrize("motion", ["plane", "space"])
def test_a_stiff_housing_is_ground(campbell, motion):
    on_ground = campbell(SPRUNG, motion=motion, max_rpm=6000.0)
    errors = []
    for factor in (1e3, 1e4):
        stiff = springs(SPRUNG, factor)
        held = campbell(SPRUNG, stiff, motion=motion, max_rpm=6000.0)
        ratio = held.curves.frequency_Hz / on_ground.curves.frequency_Hz
        errors.append(np.abs(ratio - 1.0).max())
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.03)
    assert errors[1] < 1e-3


def test_series_of_bearing_and_housing(campbell):
    """Springs of the housing as stiff as the bearings halve their stiffness."""
    halved = [
        shaft | {key: [0.5 * k for k in shaft[key]] for key in ALIKE}
        for shaft in UNDAMPED["shaft"]
    ]
    values = np.tile([4e7, 4e7, 4e7, 1e4, 1e4, 1e4], 4)
    housing = Housing(
        stiffness=np.diag(values),
        mass=np.zeros((24, 24)),
        nodes=springs(UNDAMPED, 1.0).nodes,
    )
    one = campbell(UNDAMPED, housing, max_rpm=6000.0)
    other = campbell(SPRUNG | {"shaft": halved}, max_rpm=6000.0)
    expected = other.curves.frequency_Hz
    assert one.curves.frequency_Hz == pytest.approx(expected, rel=1e-9)


def test_a_housing_that_nothing_holds_is_refused(campbell):
    rng = np.random.default_rng(100)
    nodes = springs(UNDAMPED, 1.0).nodes
    points = rng.uniform(0.0, 0.2, (len(nodes), 3))
    with pytest.raises(fegear.InputError, match=r"h\.mat.*nothing holds .* motions"):
        campbell(UNDAMPED, free_block(rng, points, nodes), stiffness="fe")
    # a bearing of each shaft on ground holds it, and their nodes are sensors
    held = (None, nodes[1], None, nodes[3])
    result = campbell(UNDAMPED, free_block(rng, points, held))
    assert result.curves.frequency_Hz[0, 0] > 0.0


def test_accelerations_are_those_of_forces_on_the_housing(campbell, tmp_path):
    result = campbell(HOUSED, **SOLVED)
    response = result.response
    assert response.housing_acceleration.shape == (3, 5, 3)
    assert not response.housing_acceleration[0].any()
    assert (response.housing_acceleration[1:] > 0.0).all()
    assert [node[0] for node in response.housing_nodes] == ["a", "a", "b", "b", ""]
    table = result.more_tables["housing"]
    rows = list(table.rows())
    assert len(rows) == 15
    assert rows[5][:4] == (3000.0, 1, "a", pytest.approx(0.01))
    assert rows[-1][1:4] == (5, "", None)
    largest = result.summary["vibration"]["housing"]
    assert [entry["node"] for entry in largest] == [1, 2, 3, 4, 5]
    assert result.summary["housing"].endswith("32 coordinates, 5 nodes, 4 of bearings")
    assert "32 coordinates" in table.header["housing"]
    assert not any("W70" in line for line in result.summary["warnings"])


def test_a_heavy_housing_on_stiff_feet_hardly_moves(campbell):
    """Accelerations fall as the inverse of the mass where feet do not count."""
    nodes = springs(SPRUNG, 1.0).nodes
    size = 6 * len(nodes)
    heavy = [
        Housing(
            stiffness=100.0 * mass * np.eye(size), mass=mass * np.eye(size), nodes=nodes
        )
        for mass in (1e5, 1e6)
    ]
    settings = SOLVED | {"modes": 1}
    light, heavier = (
        campbell(SPRUNG, one, **settings).response.housing_acceleration[1:, :, :2]
        for one in heavy
    )
    assert light / heavier == pytest.approx(10.0, rel=1e-2)


def test_modes_have_the_part_of_the_housing(campbell):
    result = campbell(HOUSED)
    modes = result.summary["modes"]
    assert {mode["kind"] for mode in modes} >= {"housing"}
    parts = np.array([mode["housing_fraction"] for mode in modes])
    assert ((parts >= 0.0) & (parts <= 1.0)).all()
    assert (parts > 0.5).any()
    on_ground = campbell(ON_GROUND)
    assert not any(m["housing_fraction"] for m in on_ground.summary["modes"])


def test_the_table_of_the_housing_needs_one():
    study = fegear.CampbellDiagram(gear_set="helical-machine", stiffness="fe")
    ((name, reason),) = study.unused_options({"housing": "x"})
    assert (name, reason) == ("housing", "needs a gear set with [housing]")


ROLLING = [gear | {"ball_bearing": BALLS} for gear in BENT["gear"]]


@pytest.mark.parametrize(
    "command", ["show", "modes", "mesh", "stiffness", "motion", "sweep", "shafts"]
)
def test_others_leave_the_housing_out_with_a_warning(
    command, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "set.toml"
    tables = BENT | {"housing": HOUSED["housing"], "gear": ROLLING}
    path.write_text(toml_text(tables))
    short_use = SHORT_USES[command].text.replace("SET", str(path))
    arguments = [command, *short_use.split()]
    assert run(arguments) == 0
    error = capsys.readouterr().err
    assert error.count("[W70]") == 1, error
