"""Excitations of a gear set: tables of finite elements and key figures."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from fegear.files.errors import InputError
from fegear.gearset import load_gear_set
from fegear.gearset.unmodified import unmodified
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.gap_points import CURVE_POINTS, gap_points
from fegear.statics.inputs import statics_inputs
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import mesh_statics
from lumped.train.analytic import static_error

RELIEVED = {f"mesh.{m}.tip_relief.magnitude_um": 10 for m in (1, 2)}


@pytest.fixture(scope="module")
def elements(compliance_cache):
    return Excitations(ExcitationSettings(positions=64))


def test_statics_of_model_1_are_those_of_the_elements(elements):
    gear_set = load_gear_set("liu-idler")
    excitation = elements.mesh_excitation(gear_set, 0, 100.0, 1)
    table = elements.table(gear_set, 0, 100.0)
    force = 100.0 / gear_set.meshes[0].pair.driver.base_radius
    error = static_error(excitation.pairs, force)(table.position)
    on_path = np.abs(table["driven_torque_Nm"][0] / 100.0 * 38 / 55 - 1.0) < 1e-9
    np.testing.assert_allclose(error[on_path], table["ste_m"][0][on_path], rtol=1e-9)
    # in corner contact the normals are tilted and the levers longer
    np.testing.assert_allclose(error, table["ste_m"][0], rtol=3e-3)
    assert on_path.sum() > 40


def test_relief_leaves_the_pair_stiffness_of_the_source():
    """Modified teeth that carry nothing at rest may meet in motion."""
    source = Excitations(
        ExcitationSettings(positions=64, relief_stiffness="unmodified")
    )
    plain = source.mesh_excitation(load_gear_set("liu-idler"), 0, 100.0, 1)
    relieved = source.mesh_excitation(load_gear_set("liu-idler", RELIEVED), 0, 100.0, 1)
    x = np.arange(64) / 64
    for one, two in zip(plain.pairs, relieved.pairs, strict=True):
        np.testing.assert_array_equal(one.stiffness(x), two.stiffness(x))
    assert max(np.ptp(pair.gap(x[16:48])) for pair in relieved.pairs) > 9e-6


@pytest.mark.parametrize("torque", [20.0, 100.0, 250.0])
def test_relieved_pairs_carry_at_rest_what_those_of_the_elements_do(elements, torque):
    gear_set = load_gear_set("liu-idler", RELIEVED)
    table = elements.table(gear_set, 0, torque)
    excitation = elements.mesh_excitation(gear_set, 0, torque, 1)
    force = torque / gear_set.meshes[0].pair.driver.base_radius
    error = static_error(excitation.pairs, force)(table.position)
    np.testing.assert_allclose(error, table["ste_m"][0], rtol=3e-3)
    plain = elements.mesh_excitation(unmodified(gear_set, 0), 0, torque, 1)
    stiffness = [
        [p.stiffness(table.position) for p in e.pairs] for e in (excitation, plain)
    ]
    # where a pair carries nothing at rest, it may touch in motion as others would
    for relieved, other, pair in zip(*stiffness, excitation.pairs, strict=True):
        separated = pair.gap(table.position) >= table["ste_m"][0] * (1.0 + 1e-9)
        np.testing.assert_allclose(relieved[separated], other[separated], rtol=1e-9)


def test_gap_on_the_path_is_that_of_the_elements(elements):
    gear_set = load_gear_set("liu-idler", RELIEVED)
    table = elements.table(gear_set, 0, 100.0)
    points = np.array(gap_points(gear_set.meshes[0]))
    inside = (table.position > points[0, 0] + 0.01) & (
        table.position < points[-1, 0] - 0.01
    )
    expected = np.interp(table.position[inside], points[:, 0], points[:, 1])
    # a relieved flank is tilted, which moves its contact to where the gap is less
    # by slope^2 R / 2, 0.2 um here
    difference = expected - table["pair1_gap_m"][0][inside]
    assert difference.min() > -1e-9
    assert difference.max() < 0.25e-6


def test_parabolic_relief_is_a_polygon_of_it():
    edits = RELIEVED | {"mesh.1.tip_relief.shape": "parabolic"}
    points = dict(gap_points(load_gear_set("liu-idler", edits).meshes[0]))
    linear = dict(gap_points(load_gear_set("liu-idler", RELIEVED).meshes[0]))
    assert len(points) > len(linear)
    for x, gap in points.items():
        straight = np.interp(x, list(linear), list(linear.values()))
        assert gap == pytest.approx(straight**2 / 10e-6, abs=1e-12)
    # and points are near enough for the straight lines between them
    middles = [0.5 * (a + b) for a, b in pairwise(points)]
    on_lines = np.interp(middles, list(points), list(points.values()))
    straight = np.interp(middles, list(linear), list(linear.values()))
    assert np.abs(on_lines - straight**2 / 10e-6).max() < 0.26 * 10e-6 / CURVE_POINTS**2


def test_unmodified_touches_one_mesh_only():
    gear_set = load_gear_set("liu-idler", RELIEVED)
    plain = unmodified(gear_set, 1)
    assert plain.meshes[1].driver_flank.tip_relief is None
    assert plain.meshes[0] == gear_set.meshes[0]


def test_tables_are_solved_once(elements, monkeypatch):
    gear_set = load_gear_set("liu-idler")
    table = elements.table(gear_set, 0, 100.0)
    monkeypatch.setattr(Excitations, "_solve_statics", lambda *_: pytest.fail("again"))
    varied = load_gear_set("liu-idler", {"mesh.2.phase": 0.3})
    assert elements.table(varied, 0, 100.0) is table


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("liu-idler", {"gear.pinion.inertia_kg_m2": 1.0, "mesh.1.backlash_um": 30.0}),
        ("liu-idler", {"mesh.1.center_line_deg": 30.0, "mesh.2.center_line_deg": 80.0}),
        ("liu-countershaft", {"mesh.1.tip_relief.magnitude_um": 5.0}),
        ("planetary-24-36-96", {"gear.sun.mass_kg": 2.0}),
        ("liu-idler", {"gear.idler.pitch_errors_um": [3.0, *[0.0] * 54]}),
    ],
)
def test_statics_read_their_inputs_alone(name, changes):
    """What the memory of tables does not tell apart changes no table."""
    gear_set = load_gear_set(name, changes)
    settings = StaticsSettings(
        positions=4, resolution="coarse", estimate_error=False, root_stress=False
    )
    for mesh in range(min(2, len(gear_set.meshes))):
        inputs = statics_inputs(gear_set, mesh)
        reduced, full = (
            mesh_statics(gears, mesh, [20.0], settings) for gears in (inputs, gear_set)
        )
        assert reduced.table.header == full.table.header
        assert reduced.table.columns.keys() == full.table.columns.keys()
        for column in full.table.columns:
            np.testing.assert_array_equal(reduced.table[column], full.table[column])


def test_tables_of_other_places_over_the_width_differ():
    """An axial offset, and misalignment, are no gaps of single flanks."""
    tables = {"mesh.1.misalignment_um": 4.0}
    plain, moved, tilted = (
        statics_inputs(load_gear_set("liu-pair", {**tables, **extra}), 0)
        for extra in ({}, {"mesh.1.offset_mm": 2.0}, {"mesh.1.misalignment_um": 5.0})
    )
    assert len({plain, moved, tilted}) == 3


def test_tables_that_were_used_last_are_kept(monkeypatch):
    gear_set, solved = load_gear_set("liu-pair"), []
    result = SimpleNamespace(table="table")

    def solve(source, gear_set, mesh, torque, settings):
        solved.append(torque)
        return result

    monkeypatch.setattr(Excitations, "_solve_statics", solve)
    monkeypatch.setattr("fegear.statics.excitation.MAX_TABLES", 2)
    source = Excitations()
    for torque in (1.0, 2.0, 1.0, 3.0, 1.0, 2.0):
        source.table(gear_set, 0, torque)
    assert solved == [1.0, 2.0, 3.0, 2.0]


def test_printed_figures_win_over_tables():
    source = Excitations(ExcitationSettings(kind="rectangular"))
    excitation = source.mesh_excitation(load_gear_set("liu-idler"), 0, 100.0, 1)
    assert excitation.mean_stiffness == 2.9831e8


@pytest.mark.parametrize("kind", ["trapezoid", "fourier"])
def test_other_waves_keep_the_mean(kind):
    source = Excitations(ExcitationSettings(kind=kind))
    excitation = source.mesh_excitation(load_gear_set("liu-idler"), 0, 100.0, 3)
    assert excitation.pairs[0].stiffness.mean == pytest.approx(2.9831e8, rel=1e-9)


def test_fourier_knows_no_relief():
    source = Excitations(ExcitationSettings(kind="fourier"))
    with pytest.raises(InputError, match="mesh 1 has a profile modification"):
        source.mesh_excitation(load_gear_set("liu-idler", RELIEVED), 0, 100.0, 1)


def test_elements_need_a_load(elements):
    with pytest.raises(InputError, match="need a load"):
        elements.mesh_excitation(load_gear_set("liu-idler"), 0, 0.0, 1)


def test_profiles_are_gaps_along_the_path():
    """Crowning is zero in the middle; what is measured shows at its position."""
    profile = {"crowning_um": 6.0, "slope_um": 2.0}
    mesh = load_gear_set("liu-pair", {"mesh.1.driver_profile": profile}).meshes[0]
    x, gap = np.array(gap_points(mesh)).T
    start, end = mesh.pair.path
    u = (x - start) / (end - start)
    np.testing.assert_allclose(gap, 6e-6 * (2 * u - 1) ** 2 - 2e-6 * u, atol=1e-15)
    points = {"roll_angle_deg": [20.0, 21.0, 22.0], "deviation_um": [0.0, -5.0, 0.0]}
    mesh = load_gear_set("liu-pair", {"mesh.1.driven_profile": points}).meshes[0]
    pair, points = mesh.pair, dict(gap_points(mesh))
    roll = pair.line_of_action - np.radians(21.0) * pair.driven.base_radius
    position = (roll - pair.pitch_point) / pair.base_pitch
    nearest = min(points, key=lambda x: abs(x - position))
    assert nearest == pytest.approx(position)
    assert points[nearest] == pytest.approx(5e-6)
