"""Mesh tables whose torque or friction is not that of the run are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.given_tables import (
    GivenTables,
    given_table_warnings,
    read_mesh_tables,
)
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from lumped import MeshTable
from lumped.train.table import format_table, parse_table

SETTINGS = StaticsSettings(positions=8, resolution="coarse", estimate_error=False)
IDLER = load_gear_set("liu-idler")


def hand_table(*torques, header=None):
    shape = len(torques), 8
    columns = {"stiffness_N_per_m": np.full(shape, 3e8), "ste_m": np.full(shape, 1e-5)}
    return MeshTable(np.array(torques), np.arange(8) / 8, columns, header or {})


def tables(*of_meshes):
    return GivenTables(tuple((f"{i}.csv", t) for i, t in enumerate(of_meshes, 1)))


def lines(mesh_tables, torque):
    return list(given_table_warnings(mesh_tables, IDLER, torque))


def test_a_single_torque_serves_within_a_factor():
    mesh_tables = tables(hand_table(100.0), hand_table(144.74))
    for torque in (68.0, 100.0, 149.0):
        assert lines(mesh_tables, torque) == []
    one, two = lines(mesh_tables, 1000.0)
    assert one.startswith("1.csv: a mesh table of 100 N m alone serves 1000 N m on")
    assert two.startswith("2.csv: a mesh table of 144.74 N m alone serves 1447 N m on")
    assert "beyond a factor of 1.5" in one
    assert len(lines(mesh_tables, 60.0)) == 2


def test_tables_of_several_torques_and_finite_elements_are_silent():
    several = hand_table(1.0, 1e6)
    assert lines(tables(several, several), 50.0) == []
    assert lines(ExcitationSettings(), 50.0) == []


def test_a_table_with_friction_is_named():
    pair = load_gear_set("liu-pair")
    rubbed, smooth = (
        solve_mesh(pair, 1, [100.0], replace(SETTINGS, friction=mu)).table
        for mu in (0.05, 0.0)
    )
    (line,) = given_table_warnings(tables(rubbed), pair, 100.0)
    assert line.startswith("1.csv: a mesh table with friction coefficient 0.05")
    assert list(given_table_warnings(tables(smooth), pair, 100.0)) == []
    unknown = hand_table(100.0, header={"friction coefficient": "high"})
    assert "coefficient high" in lines(tables(unknown, hand_table(140.0)), 100.0)[0]


@pytest.mark.parametrize("torque", [0.0, -5.0])
def test_torques_that_are_no_load_are_refused_on_reading(tmp_path, torque):
    text = format_table(hand_table(torque, 100.0))
    with pytest.raises(
        ValueError, match=rf"own: torque_Nm = {torque:g}; must be above"
    ):
        parse_table(text, "own")
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InputError, match=r"t.csv: torque_Nm = .*; must be above 0 N m"):
        read_mesh_tables([tmp_path / "t.csv"], load_gear_set("liu-pair"))


def test_model_2_names_the_file_of_another_torque():
    mesh_tables = tables(hand_table(100.0), hand_table(144.74))
    assert mesh_tables.mesh_excitation(IDLER, 1, 144.736842, 2).pairs
    with pytest.raises(InputError, match=r"1.csv: torque 1000 N m; the mesh table is"):
        mesh_tables.mesh_excitation(IDLER, 0, 1000.0, 2)
