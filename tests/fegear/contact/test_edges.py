"""Positions where a contact pressure follows the grid are told from the others."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from fegear.cli import run
from fegear.contact.edges import edge_pairs, edge_positions, finite_pressures, has_edge
from fegear.contact.loads import patch_loads
from fegear.gearset import load_gear_set
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from lumped.train.table import read_table

COLUMN = "max_pressure_Pa"
TORQUE = 400.0


def relieved(shape, end="tip"):
    name = f"mesh.1.{end}_relief"
    edits = {
        f"{name}.magnitude_um": 15,
        f"{name}.length_pitches": 0.3,
        f"{name}.shape": shape,
    }
    return load_gear_set("liu-pair", edits=edits)


def solved(gear_set, resolution="default", torque=TORQUE, **settings):
    chosen = StaticsSettings(resolution=resolution, estimate_error=False, **settings)
    return solve_mesh(gear_set, 1, [torque], chosen)


@pytest.mark.parametrize("end", ["tip", "root"])
def test_the_largest_pressure_does_not_follow_the_mesh(end):
    gear_set = relieved("linear", end)
    results = [solved(gear_set, name) for name in ("coarse", "default", "fine")]
    largest = [
        result.key_figures[0]["max_pressure_plane_strain_MPa"] for result in results
    ]
    assert np.ptp(largest) < 0.005 * largest[1]
    for result in results:
        pressure = result.table[COLUMN][0]
        off_path = result.cycle.corner_positions(0)
        assert pressure[~off_path].max() > 1.4e6 * max(largest)


@pytest.mark.parametrize("shape", ["linear", "parabolic"])
def test_edges_are_those_of_the_nodes_under_load(shape):
    result = solved(relieved(shape), "coarse")
    by_width = edge_positions(result.problem, result.cycle, 0)
    by_nodes = np.array(
        [
            any(
                has_edge(result.problem, load)
                for load in patch_loads(result.problem, TORQUE, position)
            )
            for position in result.table.position
        ]
    )
    assert not (by_nodes & ~by_width).any()
    assert (by_width & ~by_nodes).sum() <= 8  # nearby


def test_a_parabolic_relief_has_no_kink():
    result = solved(relieved("parabolic"), "coarse")
    corners = result.cycle.corner_positions(0)
    edges = edge_positions(result.problem, result.cycle, 0)
    assert (edges == corners).all()
    linear = solved(relieved("linear"), "coarse")
    more = edge_positions(linear.problem, linear.cycle, 0)
    assert more.sum() > corners.sum() + 8


def test_a_wide_contact_reaches_a_tip_corner_that_the_path_does_not():
    """Of soft teeth, whose contact is wider than the path's usual margin."""
    gears = load_gear_set("liu-pair", edits={"gear.1.young_modulus_GPa": 3})
    result = solved(gears, torque=20.0)
    corners = result.cycle.corner_positions(0)
    edges = edge_positions(result.problem, result.cycle, 0)
    assert edges.sum() > corners.sum()


def test_a_kink_at_the_pitch_point_has_no_pressure_there():
    pair = load_gear_set("liu-pair").meshes[0].pair
    length = (pair.path_end - pair.pitch_point) / pair.base_pitch
    edits = {
        "mesh.1.driver_tip_relief.magnitude_um": 15,
        "mesh.1.driver_tip_relief.length_pitches": length,
    }
    gears = load_gear_set("liu-pair", edits=edits)
    assert (
        solved(gears, "coarse").key_figures[0][
            "pressure_at_pitch_point_plane_strain_MPa"
        ]
        is None
    )


KINK = [f"--set=mesh.1.tip_relief.{x}" for x in ("magnitude_um=15", "length_pitches=1")]


def test_commands_leave_the_pressure_of_a_kink_out(capsys, tmp_path):
    argv = ["liu-pair", *KINK, "--torque", "400", "--resolution", "coarse"]
    table = tmp_path / "t.csv"
    assert run(["stiffness", *argv, "--json", "-o", str(table)]) == 0
    (values,) = json.loads(capsys.readouterr().out)["torques"]
    header = table.read_text().split("torque_Nm,")[0]
    assert "# pressure: plane strain, as below a narrow contact" in header
    assert values["positions_with_edge_contact"] > 10
    assert (
        values["max_pressure_plane_strain_MPa"] < 1e-6 * read_table(table)[COLUMN].max()
    )
    output = ["--position", "0.25", "-o", str(tmp_path / "c.html")]
    assert run(["render", *argv, *output]) == 0
    assert "the start of a linear relief, in contact" in capsys.readouterr().out


def test_an_end_of_a_spall_is_an_edge_of_its_tooth_alone():
    """At the pitch point of the others the pressure is that of healthy teeth."""
    pair = load_gear_set("liu-pair").meshes[0].pair
    middle = math.degrees(pair.pitch_point / pair.driver.base_radius)
    spall = {"tooth": 1, "width_share": 0.4}
    spall |= {"start_roll_angle_deg": middle - 2.0, "end_roll_angle_deg": middle}
    edits = {"gear.pinion.spalls": [spall]}
    result = solved(load_gear_set("liu-pair", edits), "coarse", 50.0)
    of_positions = edge_pairs(result.problem, result.cycle, 0)
    at_start = of_positions[:: result.table.position.size // 38]
    of_pair = at_start[:, result.cycle.teeth.tolist().index(0)]
    assert of_pair.tolist() == [True] + 37 * [False]
    values = result.key_figures[0]
    healthy = solved(load_gear_set("liu-pair"), "coarse", 50.0).key_figures[0]
    name = "pressure_at_pitch_point_plane_strain_MPa"
    assert values[name] == pytest.approx(healthy[name], rel=1e-9)
    # beside its edges the tooth has the pressure of 0.6 of the width
    ratio = values["max_pressure_plane_strain_MPa"] / healthy[name]
    assert 1.2 < ratio < 1.45


def test_another_pair_counts_while_a_tip_corner_is_in_contact():
    """The largest pressure is that at the end of single contact, by Hertz."""
    result = solved(load_gear_set("liu-pair"), "fine")
    values = result.key_figures[0]
    pressures = finite_pressures(result.problem, result.cycle, 0)
    corners = result.cycle.corner_positions(0)
    assert pressures[corners].max() > 0.0
    largest = 1e6 * values["max_pressure_plane_strain_MPa"]
    assert largest == pytest.approx(pressures.max(), rel=1e-14)
