"""Potential energy of cracked teeth beside finite elements, and what explains it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fegear.contact.plane.solve import solve_pair_alone
from fegear.gearset import load_gear_set
from fegear.statics.contact_problem import contact_problem
from meshes.crack import Crack, crack_points
from validation.cracked_tooth import cracked_page as page
from validation.cracked_tooth.draw_cracked_tooth import draw_drops
from validation.cracked_tooth.drops import (
    CRACK_ANGLE,
    EnergyDrop,
    StiffnessDrop,
    compare_drops,
    root_thickness,
)
from validation.cracked_tooth.elements import ElementDrop
from validation.cracked_tooth.healthy import stiffness_factors
from validation.cracked_tooth.shallow import mouth_stress, shallow_crack_compliance
from validation.oracles.cut_tooth import CutTooth, tangent_point
from validation.oracles.potential_energy import tooth_compliance
from validation.published.loaded_pair import LoadedPair


def coarse(pair, positions=16):
    settings = replace(pair.settings, resolution="coarse", positions=positions)
    return replace(pair, settings=settings)


@pytest.fixture(scope="module")
def liu_pair():
    return coarse(page.pairs()[0])


def test_crack_begins_where_the_finite_elements_have_it(liu_pair):
    teeth = liu_pair.teeth[0].teeth
    for degrees in (25.0, 30.0, 50.0):
        angle = math.radians(degrees)
        mouth = crack_points(teeth, Crack(depth=1e-4, tangent_angle=angle))[0]
        np.testing.assert_allclose(tangent_point(teeth, angle), mouth[::-1], rtol=2e-5)


def test_cut_tooth_is_near_the_one_with_a_circular_fillet(liu_pair):
    """2 % in bending, 0.5 % in the others: fillets of 0.3 and of 0.38 modules."""
    analytic = LoadedPair(liu_pair.gear_set).analytic[0]
    tooth, roll = liu_pair.teeth[0], liu_pair.pair.pitch_point
    circular = tooth_compliance(analytic, roll, liu_pair.width)
    beam = tooth.beam(roll, liu_pair.width)
    assert beam.bending == pytest.approx(circular.bending[0], rel=0.03)
    assert beam.shear == pytest.approx(circular.shear[0], rel=0.005)
    assert beam.axial == pytest.approx(circular.axial[0], rel=0.005)
    body = tooth.body(roll, liu_pair.width)
    assert body == pytest.approx(circular.body[0], rel=0.01)


@pytest.mark.parametrize(("number", "ratio"), [(0, 1.194), (1, 1.280), (2, 1.436)])
def test_factors_account_for_the_ratio(number, ratio):
    """The page's ratios; twist and neighbours take most of what contact leaves."""
    factors = stiffness_factors(coarse(page.pairs()[number], positions=64))
    product = factors.contact * factors.tooth_and_body
    product *= factors.other_pairs * factors.corners
    assert factors.ratio == pytest.approx(product, rel=1e-12)
    assert factors.ratio == pytest.approx(ratio, rel=0.005)
    assert factors.contact > 1.1
    assert factors.other_pairs > factors.twist > 1.0
    assert factors.tooth_and_body < 1.0
    assert factors.corners < 1.0


def test_no_crack_no_drop(liu_pair):
    for drop in (EnergyDrop(liu_pair, "parallel"), ElementDrop(liu_pair)):
        assert drop(0.0) == StiffnessDrop(0.0, 0.0, 0.0)


def test_drop_at_the_pitch_point_is_that_of_the_pair(liu_pair):
    """One pair is in contact there: its compliance grows by that of the tooth."""
    drop = EnergyDrop(liu_pair, "parabola")(1.2e-3)
    rolls = liu_pair.pair.pitch_point
    rolls = rolls, liu_pair.pair.line_of_action - rolls
    pair = liu_pair.contact_compliance + sum(
        tooth.compliance(roll, liu_pair.width)[0]
        for tooth, roll in zip(liu_pair.teeth, rolls, strict=True)
    )
    expected = drop.added_compliance / (pair + drop.added_compliance)
    assert drop.at_pitch_point == pytest.approx(expected, rel=1e-9)
    assert 0.0 < drop.over_path < drop.at_pitch_point


def test_neighbours_of_a_cracked_tooth_are_healthy(liu_pair):
    """All teeth cracked are softer than one; in single contact there is one only."""
    drop = EnergyDrop(liu_pair, "parallel")
    crack = drop.crack(1.2e-3)
    one, healthy = drop.mesh_stiffness(crack), drop.mesh_stiffness(None)
    every = _with_driver(liu_pair, CutTooth(liu_pair.teeth[0].gear, crack))
    all_cracked = EnergyDrop(every, "parallel").mesh_stiffness(crack)
    assert (one < healthy).all()
    assert (all_cracked <= one * (1.0 + 1e-12)).all()
    assert (all_cracked < 0.999 * one).any()
    assert all_cracked[0] == pytest.approx(one[0], rel=1e-12)


def _with_driver(pair, driver):
    class Cracked(type(pair)):
        teeth = (driver, pair.teeth[1])

    return Cracked(pair.name, pair.gear_set, pair.torque, pair.mesh, pair.settings)


def test_drops_of_the_page(liu_pair):
    """Figures in the text, at 10, 30 and 50 % of the root thickness."""
    curves = compare_drops(liu_pair, (0.1, 0.3, 0.5), ElementDrop(liu_pair))
    expected = {
        "parallel": (1.16, 8.74, 22.03),
        "parabola": (1.97, 9.42, 17.30),
        "hinge": (1.51, 12.31, 33.59),
        "finite elements": (2.59, 12.01, 24.02),
    }
    assert list(curves.drops) == list(expected)
    for name, values in expected.items():
        drops = [100.0 * drop.at_pitch_point for drop in curves.drops[name]]
        np.testing.assert_allclose(drops, values, rtol=0.01, err_msg=name)


def test_finite_elements_are_optional(liu_pair):
    curves = compare_drops(liu_pair, (0.1,))
    assert list(curves.drops) == ["parallel", "parabola", "hinge"]


def test_shallow_crack_adds_what_the_stress_at_the_surface_releases():
    """Figures of the page: the less of it, the deeper, as the stress falls off."""
    pair = page.pairs()[0]
    stress = mouth_stress(pair)
    assert stress.concentration == pytest.approx(1.95, abs=0.03)
    thickness, drop = root_thickness(pair), ElementDrop(pair)
    ratios = [
        drop(part * thickness).added_compliance
        / shallow_crack_compliance(pair, stress.elements, part * thickness)
        for part in (0.02, 0.05)
    ]
    np.testing.assert_allclose(ratios, (0.79, 0.61), atol=0.02)


def test_pair_alone_has_the_fault_of_its_teeth(liu_pair):
    """Pair 1 is a base pitch ahead; its driving tooth has a cracked neighbour alone."""
    cracks = {"gear.1.cracks": [{"tooth": 1, "depth_mm": 1.0}]}
    gear_sets = liu_pair.gear_set, load_gear_set("liu-pair", cracks)
    healthy, cracked = (contact_problem(g, 0, liu_pair.settings) for g in gear_sets)
    drops = [
        1.0
        - solve_pair_alone(cracked, 100.0, position, pair).stiffness[0, 0]
        / solve_pair_alone(healthy, 100.0, position, pair).stiffness[0, 0]
        for position, pair in ((0.0, 0), (-1.0, 1))
    ]
    assert drops[0] > 0.05
    assert 0.0 < drops[1] < 0.001


def test_tables_and_figure_of_the_page(liu_pair, monkeypatch):
    monkeypatch.setattr(page, "pairs", lambda: (liu_pair,))
    monkeypatch.setattr(page, "DEPTHS", (0.1, 0.3))
    figure = draw_drops(page.drop_curves(liu_pair, CRACK_ANGLE), "title")
    assert [len(axes.lines) for axes in figure.axes] == [4, 4]
    for text in (page.drop_table(0), page.compliance_table(0)):
        assert text.splitlines()[2].startswith("| 10 % |")
        assert text.count("\n") == 3
    for make in (page.parts_table, page.factor_table, page.stress_table):
        assert make().splitlines()[2].startswith("| liu-pair |")
    assert "| liu-pair | 24.0 | 24.0 |" in page.corner_table()
