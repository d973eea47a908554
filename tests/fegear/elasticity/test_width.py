"""Teeth of their true width: limits, rigid motions, one function as plane strain."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear, make_helical
from scipy.sparse import block_array
from slow_tests import first_are_quick
from whole_gear import small_ring

from fegear.elasticity import width as of_width
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.condensed_width import spaced_diameters, width_tables
from fegear.elasticity.flank import MAX_TOOTH_OFFSET, flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import cyclic_sector
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.wide_sector import WideSector
from fegear.elasticity.width import width_correction
from fegear.elasticity.width_functions import WidthFunctions, layered_functions
from fegear.gearset import load_gear_set, make_gear_set
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.statics.table_warnings import table_warnings
from meshes import MeshSize
from meshes.internal import Foundation

STEEL = PlaneMaterial(206e9, 0.3, "strain")
SMALL = MeshSize().refined(0.3)
MODULE = make_gear(23, 8e-3).module


def of_width_modules(modules: float) -> PlaneMaterial:
    return replace(STEEL, plane="width", width=modules * MODULE)


def random_gear(chance: random.Random):
    teeth = chance.randint(14, 60)
    hub = chance.uniform(0.3, 0.7) * 0.5 * (teeth - 2.5) * MODULE
    return make_gear(teeth, hub)


def functions(z, weights, *pairs):
    """Functions and their slopes at points of a quadrature."""
    values, slopes = (np.stack([one[i](z) for one in pairs], 1) for i in (0, 1))
    return WidthFunctions(values, slopes, weights)


def quadrature(width):
    points, weights = np.polynomial.legendre.leggauss(40)
    return 0.5 * width * points, 0.5 * width * weights


@pytest.mark.parametrize("body", ["wheel", "ring", "ring on springs"])
def test_one_constant_function_is_plane_strain(body):
    gear = make_gear(23, 8e-3) if body == "wheel" else small_ring(46)
    if body == "ring on springs":
        # soft springs amplify rounding: 1e-10 at a hundredth of these, by any solver
        gear = replace(gear, foundation=Foundation(radial=2e13, tangential=1e13))
    sector, teeth = cyclic_sector(gear, STEEL, SMALL), gear.teeth
    z, weights = quadrature(0.02)
    constant = functions(z, weights, (np.ones_like, np.zeros_like))
    wide = WideSector(TwistedSector(sector), constant)
    solved = width_tables(wide, np.arange(teeth // 2 + 1))
    tables = [table[:, :, 0, :, 0] / 0.02 for table in (solved.normal, solved.rootward)]
    plane = flank_compliance(sector, split=False)
    for table, expected in zip(tables, (plane.normal, plane.tangential), strict=True):
        assert np.abs(table - expected).max() < 1e-12 * plane.normal.max()


@pytest.mark.parametrize("helix_angle_deg", [0.0, 15.8, -30.0])
def test_rigid_motions_in_the_turning_frame_have_no_force(helix_angle_deg):
    gear = make_gear(23, 8e-3)
    if helix_angle_deg:
        gear = make_helical(23, 8e-3, helix_angle_deg)
    sector, twist = cyclic_sector(gear, STEEL, SMALL), gear.twist
    twisted = TwistedSector(sector)
    z, weights = quadrature(0.05)
    x, y = _node_locations(twisted)
    zero = np.zeros_like(x)
    cos, sin = (lambda z: np.cos(twist * z)), (lambda z: np.sin(twist * z))
    shapes = functions(
        *(z, weights),
        (np.ones_like, np.zeros_like),
        (cos, lambda z: -twist * sin(z)),
        (sin, lambda z: twist * cos(z)),
        (lambda z: z * cos(z), lambda z: cos(z) - twist * z * sin(z)),
        (lambda z: z * sin(z), lambda z: sin(z) + twist * z * cos(z)),
    )
    one, c, s, zc, zs = range(5)
    motions = {
        "turn about the axis": {one: (-y, x, zero)},
        "shift along the axis": {one: (zero, zero, zero + 1.0)},
        "shift across it": {c: (zero + 1.0, zero, zero), s: (zero, zero - 1.0, zero)},
        "tilt": {
            s: (zero, zero, x),
            c: (zero, zero, y),
            zs: (zero - 1.0, zero, zero),
            zc: (zero, zero - 1.0, zero),
        },
    }
    stiffness = _stiffness(twisted, shapes)
    for name, parts in motions.items():
        motion = np.zeros((5, 3 * x.size))
        for function, components in parts.items():
            for component, values in enumerate(components):
                motion[function, twisted._nodes[:, component]] = values
        scale = np.abs(stiffness) @ np.abs(motion.ravel())
        assert np.abs(stiffness @ motion.ravel()).max() < 1e-12 * scale.max(), name


def _node_locations(twisted):
    plane = twisted.sector.basis
    return plane.doflocs[:, twisted._plane_nodes[:, 0]]


def _stiffness(twisted, shapes):
    a0, a1, a2 = twisted.section_matrices
    count = range(shapes.values.shape[1])
    return block_array(
        [
            [
                shapes.mass[k, m] * a0
                + shapes.cross[k, m] * a1
                + shapes.cross[m, k] * a1.T
                + shapes.stretch[k, m] * a2
                for m in count
            ]
            for k in count
        ]
    ).tocsr()


def test_reciprocity():
    correction = width_correction(make_gear(30, 8e-3), of_width_modules(5.0))
    for table in (correction.normal,):
        mirrored = table[::-1].transpose(0, 2, 1)
        assert np.abs(table - mirrored).max() < 1e-12 * np.abs(table).max()


def loaded_tooth(gear, material):
    """Compliance of the loaded tooth under its own loads, on one mesh."""
    sector = cyclic_sector(gear, material, MeshSize().refined(0.4))
    plane = flank_compliance(sector, split=False).normal[MAX_TOOTH_OFFSET]
    if material.plane != "width":
        return plane
    return plane + width_correction(gear, material).normal[MAX_TOOTH_OFFSET]


@pytest.mark.parametrize("number", first_are_quick(range(4)))
def test_widths_are_between_plane_stress_and_plane_strain(number):
    gear = random_gear(random.Random(number))
    stress = loaded_tooth(gear, replace(STEEL, plane="stress"))
    strain = loaded_tooth(gear, STEEL)
    between = [loaded_tooth(gear, of_width_modules(w)) for w in (0.5, 4.0, 12.0, 24.0)]
    for softer, stiffer in zip([stress, *between], [*between, strain], strict=True):
        assert (np.diag(softer) > np.diag(stiffer)).all()
    # thin ones are near plane stress, wide ones leave plane strain as 1 / width
    added = [np.diag(table - strain) for table in between]
    assert np.mean(added[0] / np.diag(stress - strain)) > 0.85
    assert np.mean(added[3] / added[2]) == pytest.approx(0.5, rel=0.1)


@pytest.mark.slow
def test_more_layers_change_little(monkeypatch):
    gear = make_gear(23, 8e-3)
    for width in (1.0, 6.0, 25.0):
        two = width_correction(gear, of_width_modules(width)).normal
        with monkeypatch.context() as patch:
            patch.setattr(of_width, "END_LAYERS", (4.0, 2.0, 1.0, 0.5, 0.25))
            five = width_correction(gear, of_width_modules(width)).normal
        plane = loaded_tooth(gear, STEEL)
        assert np.abs(two - five).max() < 1.2e-3 * plane.max()
        assert np.abs(two - five).max() > 1e-6 * plane.max()


@pytest.mark.parametrize("teeth", [8, 19, 60])
def test_spaced_diameters_give_what_all_of_them_give(teeth):
    gear = make_gear(teeth, 0.6 * 0.5 * (teeth - 2.5) * MODULE)
    sector = cyclic_sector(gear, STEEL, SMALL)
    layers = layered_functions(5.0 * MODULE, [MODULE])
    wide = WideSector(TwistedSector(sector), layers)
    every = width_tables(wide, np.arange(teeth // 2 + 1)).normal[:, :, 0, :, 0]
    some = width_tables(wide).normal[:, :, 0, :, 0]
    every, some = every / (5.0 * MODULE), some / (5.0 * MODULE)
    plane = flank_compliance(sector, split=False).normal
    spaced = spaced_diameters(teeth)
    assert np.abs(some - every).max() < 1e-3 * np.abs(every - plane).max()
    assert (spaced[0], spaced[-1]) == (0, teeth // 2)


def test_a_mesh_of_another_size_gives_the_same(monkeypatch):
    gear, material = make_gear(23, 8e-3), of_width_modules(5.0)
    coarse = width_correction(gear, material)
    monkeypatch.setattr(of_width, "MESH_REFINEMENT", 0.8)
    fine = width_correction(gear, material)
    plane = cached_flank_compliance(gear, STEEL, MeshSize())
    one, two = (table.added_to(plane, gear).normal for table in (coarse, fine))
    largest = np.abs(one - plane.normal).max()
    # where loads meet the fillet; on most of the flank a quarter of that
    assert np.abs(one - two).max() < 1e-2 * largest


def test_a_plane_state_has_no_width():
    with pytest.raises(ValueError, match="plane = strain; must be width"):
        width_correction(make_gear(23, 8e-3), STEEL)


def test_a_table_of_their_width_is_between_those_of_plane_states():
    gears = load_gear_set("liu-pair")
    coarse = {"positions": 8, "resolution": "coarse", "root_stress": False}
    stress, width, strain = (
        solve_mesh(gears, 1, [100.0], StaticsSettings(plane=plane, **coarse))
        for plane in ("stress", "width", "strain")
    )
    means = [one.table["stiffness_N_per_m"].mean() for one in (stress, width, strain)]
    assert means[0] * 1.01 < means[1] < means[2] * 0.99
    assert width.table.header["plane"] == "width"
    assert not table_warnings(width)


def test_thin_teeth_are_warned_of():
    edits = {"defaults.face_width_mm": 1.0}  # 0.39 modules
    gears = load_gear_set("liu-pair", edits)
    settings = StaticsSettings(
        plane="width", positions=4, resolution="coarse", root_stress=False
    )
    solved = solve_mesh(gears, 1, [4.0], settings)
    assert any("[W56]" in line for line in table_warnings(solved))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
def test_pairs_are_between_plane_stress_and_plane_strain(number):
    """Their mean stiffness.

    Teeth leave plane strain as one over the width, and bodies more slowly until the
    width is more than that of the body from bore to root.
    """
    chance = random.Random(1000 + number)
    teeth = chance.randint(16, 45), chance.randint(16, 80)
    tables = {
        "name": "random",
        "defaults": {
            "module_mm": round(chance.uniform(1.0, 8.0), 2),
            "face_width_mm": 1.0,
            "profile_shift": round(chance.uniform(0.0, 0.3), 2),
        },
        "gear": [
            {"name": name, "teeth": z, "hub_radius_mm": 1.0}
            for name, z in zip("ab", teeth, strict=True)
        ],
        "mesh": [{"driver": "a", "driven": "b"}],
    }
    module = tables["defaults"]["module_mm"]
    for gear, z in zip(tables["gear"], teeth, strict=True):
        hub = chance.uniform(0.3, 0.7) * (0.5 * z - 1.25) * module
        gear["hub_radius_mm"] = round(hub, 3)

    def compliance(plane, modules):
        """Mean compliance of the mesh per width, at one load per width."""
        tables["defaults"]["face_width_mm"] = modules * module
        gears = make_gear_set(tables)
        torque = 50e3 * module * gears.gears[0].geometry.base_radius
        solved = solve_mesh(
            gears,
            1,
            [torque * gears.common_width(0)],
            StaticsSettings(
                plane=plane,
                positions=4,
                resolution="coarse",
                estimate_error=False,
                root_stress=False,
            ),
        )
        return float((1.0 / solved.cycle.stiffness).mean()) * gears.common_width(0)

    stress, strain = (compliance(plane, 8.0) for plane in ("stress", "strain"))
    narrow, usual, wide, widest = (
        compliance("width", modules) for modules in (0.5, 8.0, 16.0, 32.0)
    )
    assert stress > narrow > usual > wide > widest > strain
    assert (narrow - strain) / (stress - strain) > 0.8
    assert 0.45 < (widest - strain) / (wide - strain) < 0.68
