"""From gear set to table: resolution, chunks, bodies, plane state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear

from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.solve import solve_cycle
from fegear.elasticity import flank
from fegear.elasticity.flank import flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector
from fegear.gearset import load_gear_set
from fegear.gearset.read import read_gear_set
from fegear.statics.settings import RESOLUTIONS, StaticsSettings
from fegear.statics.solving import solve_mesh
from lumped.train.table import format_table, pair_compliance_name, parse_table
from meshes import MeshSize
from validation.oracles import ring

STEEL = PlaneMaterial(206e9, 0.3)


@pytest.fixture(scope="module")
def pair_set():
    return load_gear_set("liu-pair")


@pytest.fixture(scope="module")
def result(pair_set):
    return solve_mesh(pair_set, settings=StaticsSettings(positions=24))


def test_table_survives_its_file(result):
    assert parse_table(format_table(result.table)) == result.table


def test_estimate_bounds_the_true_error(pair_set, result):
    fine = StaticsSettings(positions=24, resolution="fine", estimate_error=False)
    reference = solve_mesh(pair_set, 1, [100.0], fine)
    change = result.table["ste_m"][1] / reference.table["ste_m"][0] - 1.0
    assert np.abs(change).max() < 1e-2
    mean = result.table["ste_m"][1].mean() / reference.table["ste_m"][0].mean() - 1.0
    assert abs(mean) < result.errors[1].mean
    assert abs(mean) < 1e-3


@pytest.mark.slow
def test_mean_error_falls_with_at_least_the_square_of_the_size(pair):
    def mean(factor):
        size = MeshSize().refined(factor)
        one, two = (
            flank_compliance(CyclicSector(g, STEEL, size))
            for g in (pair.driver, pair.driven)
        )
        problem = ContactProblem(
            pair=pair,
            driver=ContactFlank(compliance=one),
            driven=ContactFlank(compliance=two),
            face_width=25.4e-3,
            solver=PlaneContact(nodes=49),
        )
        return solve_cycle(problem, [100.0], np.arange(32) / 32).ste.mean()

    reference = mean(2.2)
    factors = np.array([0.4, 0.57, 0.8, 1.1])
    errors = [abs(mean(f) / reference - 1.0) for f in factors]
    assert -np.polyfit(np.log(factors), np.log(errors), 1)[0] > 2.0


def test_pieces_join_to_the_whole(pair_set, result, monkeypatch):
    monkeypatch.setattr(PlaneContact, "positions_at_once", 7)
    pieces = solve_mesh(pair_set, settings=StaticsSettings(positions=24))
    assert list(pieces.table.columns) == list(result.table.columns)
    for name in ("ste_m", "pair2_gap_m", pair_compliance_name(0, 1)):
        np.testing.assert_allclose(
            pieces.table[name], result.table[name], rtol=1e-9, atol=1e-15
        )


def test_plane_strain_is_some_per_cent_stiffer(pair_set, result):
    strain = StaticsSettings(positions=24, plane="strain", estimate_error=False)
    other = solve_mesh(pair_set, settings=strain)
    ratio = other.table["stiffness_N_per_m"] / result.table["stiffness_N_per_m"]
    assert 1.03 < ratio.mean() < 1.10


def test_equal_gears_share_one_compliance(pair_set, monkeypatch, tmp_path):
    monkeypatch.setenv("FEGEAR_CACHE_DIR", str(tmp_path))
    spec = pair_set.meshes[0]
    twin = replace(pair_set.gears[0], name="twin")
    distance = 2.01 * twin.geometry.reference_radius
    pair = replace(
        spec.pair, driver=twin.geometry, driven=twin.geometry, center_distance=distance
    )
    mesh = replace(spec, driver=0, driven=1, pair=pair)
    twins = replace(pair_set, gears=(pair_set.gears[0], twin), meshes=(mesh,))
    settings = StaticsSettings(positions=4, estimate_error=False)
    solve_mesh(twins, 1, [50.0], settings)
    for kind in ("flank", "root"):
        assert len(list(tmp_path.glob(f"{kind}-*/arrays.npz"))) == 1


def test_body_twist_is_that_of_the_ring(monkeypatch):
    """All teeth loaded alike: enlarging the hub saves the twist of a thick ring."""
    monkeypatch.setattr(flank, "MAX_TOOTH_OFFSET", 9)
    radii = (8e-3, 14e-3)
    gears = [make_gear(19, r) for r in radii]
    sums = [
        flank_compliance(CyclicSector(g, STEEL)).normal.sum(axis=0)[12, 12]
        for g in gears
    ]
    torque = 19 * gears[0].base_radius
    shear = ring.shear_modulus(206e9, 0.3)
    twists = [
        ring.rotation(
            ring.Ring(
                hub_radius=r,
                outer_radius=18e-3,
                shear_modulus=shear,
                face_width=1.0,
            ),
            torque,
        )
        for r in radii
    ]
    saved = gears[0].base_radius * (twists[0] - twists[1])
    assert sums[0] - sums[1] == pytest.approx(saved, rel=2e-2)


def test_settings_are_checked():
    with pytest.raises(ValueError, match="positions"):
        StaticsSettings(positions=0)
    with pytest.raises(ValueError, match="resolution"):
        StaticsSettings(resolution="finest")


def test_levels_grow(pair_set):
    counts = [RESOLUTIONS[n].size.flank_edges for n in ("coarse", "default", "fine")]
    assert counts == sorted(counts)


@pytest.mark.parametrize("mesh", [-1, 0, 2])
def test_a_mesh_that_is_not_there(pair_set, mesh):
    message = rf"mesh = {mesh}; .* has 1 mesh, from mesh 1 on"
    with pytest.raises(ValueError, match=message):
        solve_mesh(pair_set, mesh)


def test_a_header_names_no_error_that_is_not_estimated(pair_set):
    settings = StaticsSettings(positions=4, resolution="coarse", corner_contact=False)
    header = solve_mesh(pair_set, 1, [100.0], settings).table.header
    (estimate,) = (text for key, text in header.items() if "estimated" in key)
    assert "corner" not in estimate
    assert not any("nan" in text.split() for text in header.values())


def test_deep_relief_moves_the_closest_point_of_a_pair_far():
    """Load closes the pair farther than no load does, and contact stiffens."""
    gears = "".join(
        f'[[gear]]\nname = "{name}"\nteeth = {teeth}\nhub_radius_mm = {hub}\n'
        for name, teeth, hub in (("one", 23, 12), ("two", 61, 25))
    )
    text = (
        'name = "deep"\n[defaults]\nmodule_mm = 2.5\nface_width_mm = 20\n'
        f'{gears}[[mesh]]\ndriver = "one"\ndriven = "two"\ncenter_distance_mm = 105.7\n'
        'tip_relief = { magnitude_um = 200, start = "HPSTC" }\n'
    )
    settings = StaticsSettings(positions=64, estimate_error=False)
    table = solve_mesh(read_gear_set(text), 1, [60.0], settings).table
    stiffness, local = table["stiffness_N_per_m"], table["local_stiffness_N_per_m"]
    assert (stiffness > 0.0).all()
    assert (stiffness < local).all()
