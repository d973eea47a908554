"""Root stress over the width, beside plane strain and another program."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_gear, make_helical

from fegear.elasticity.condensed_width import width_tables
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import MAX_TOOTH_OFFSET, root_influence
from fegear.elasticity.sector import cyclic_sector
from fegear.elasticity.twisted_sector import TwistedSector
from fegear.elasticity.wide_flank import DEGREE, MESH, width_and_root_modes
from fegear.elasticity.wide_root import (
    LineLoad,
    WideRoot,
    fillet_nodes,
    root_modes,
    root_places,
)
from fegear.elasticity.wide_sector import WideSector
from fegear.elasticity.width_functions import WidthFunctions, polynomials
from fegear.gearset import make_gear_set
from meshes import MeshSize

STEEL = PlaneMaterial(206e9, 0.3, "strain")
WIDTH = 12e-3
COARSE = replace(MESH, fillet_edges=4)


def root_of(gear, width=WIDTH, degree=2, size=COARSE):
    material = replace(STEEL, plane="width", width=width)
    _, modes = width_and_root_modes(gear, material, degree, size)
    section = root_influence(cyclic_sector(gear, STEEL, MeshSize()))
    return WideRoot(section, modes, width)


def line_load(gear, density, tooth=0, part=0.5, width=WIDTH, count=48):
    """A normal force per width along a flank, at a part of its length from the tip."""
    places = width * ((np.arange(count) + 0.5) / count - 0.5)
    arcs = np.full((1, count), part * gear.flank_length)
    return LineLoad(tooth, arcs, places[None], density(places)[None] * width / count)


def test_one_constant_function_leaves_plane_strain():
    """A uniform load, of all teeth whose loads count."""
    gear = make_gear(13, 6e-3)
    sector = cyclic_sector(gear, STEEL, COARSE)
    weights = np.append(polynomials(WIDTH, 0).weights, 0.0 * root_places(WIDTH))
    constant = np.ones((weights.size, 1))
    functions = WidthFunctions(constant, 0.0 * constant, weights)
    wide = WideSector(TwistedSector(sector), functions, (0,))
    every = np.arange(13 // 2 + 1)
    modes = root_modes(wide, width_tables(wide, every, fillet_nodes(wide)), WIDTH)
    section = root_influence(cyclic_sector(gear, STEEL, MeshSize()))
    largest = np.abs(section.remainder).max()
    assert np.abs(modes.stress).max() < 1e-10 * largest


def test_the_other_hand_is_the_mirror_image():
    loads = {
        20.0: lambda z: 1e5 * (1.0 + z / WIDTH),
        -20.0: lambda z: 1e5 * (1.0 - z / WIDTH),
    }
    right, left = (make_helical(13, 6e-3, angle) for angle in loads)
    one, other = root_of(right), root_of(left)
    for tooth in range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1):
        stress = one.along_fillet([line_load(right, loads[20.0], tooth)])
        same = one.mirrored.along_fillet([line_load(right, loads[-20.0], tooth)])
        solved = other.along_fillet([line_load(left, loads[-20.0], tooth)])
        np.testing.assert_allclose(same[..., ::-1], stress, rtol=1e-12)
        error = np.abs(solved[..., ::-1] - stress).max()
        assert error < 1e-7 * np.abs(stress).max()


# CalculiX, quadratic wedges of the whole gear of 12 teeth in 10 and 12 layers that are
# thin at the ends, 12 edges along each fillet: helix angle [deg], width [modules] and
# arc of the load from the tip corner [mm]; places over the width [mm]; tension across
# the fillet [MPa] of the loaded tooth and of the next one clockwise, under 1e5 N/m
# (1 + 1.6 z / b)
OTHER_PROGRAM = {
    "straight": (
        (0.0, 4.0, 2.4439767),
        [-5.407, -4.431, -3.141, -1.628, 0.0, 1.628, 3.141, 4.431, 5.407],
        [66.9, 75.7, 85.0, 94.9, 105.1, 114.4, 121.2, 123.1, 116.5],
        [8.5, 8.8, 9.0, 9.3, 9.7, 10.1, 10.4, 10.5, 10.4],
    ),
    "helical": (
        (25.0, 6.0, 2.6733517),
        [-8.3, -7.193, -5.73, -3.985, -2.043, 0.0, 2.043, 3.985, 5.73, 7.193, 8.3],
        [40.1, 49.5, 59.4, 69.0, 79.0, 89.4, 99.2, 106.9, 110.8, 109.1, 99.9],
        [3.7, 4.2, 4.9, 5.9, 7.1, 8.3, 9.5, 10.5, 11.2, 11.6, 11.3],
    ),
}


@pytest.mark.parametrize("kind", OTHER_PROGRAM)
def test_tension_is_that_of_another_program(kind):
    (helix, modules, arc), places, loaded, beside = OTHER_PROGRAM[kind]
    width = 3e-3 * modules
    defaults = {"module_mm": 3.0, "face_width_mm": 1e3 * width}
    if helix:
        defaults["helix_angle_deg"] = helix
    gears = [
        {"name": "a", "teeth": 12, "hub_radius_mm": 9.9, "profile_shift": 0.3},
        {"name": "b", "teeth": 44, "hub_radius_mm": 25.0},
    ]
    meshes = [{"driver": "a", "driven": "b"}]
    entries = {"name": kind, "defaults": defaults, "gear": gears, "mesh": meshes}
    gear = make_gear_set(entries).gears[0].geometry
    root = root_of(gear, width, DEGREE, MESH)
    part = 1e-3 * arc / gear.flank_length

    def density(z):
        return 1e5 * (1.0 + 1.6 * z / width)

    # a load on the tooth counter-clockwise of the one beside it
    for tooth, expected in ((0, loaded), (-1, beside)):
        stress = root.stress([line_load(gear, density, tooth, part, width, 200)])[0]
        ours = 1e-6 * np.interp(places, 1e3 * root.places, stress)
        assert np.abs(ours - expected).max() < 0.02 * max(expected)
