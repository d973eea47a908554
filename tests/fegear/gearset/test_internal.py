"""Gear sets with an internal gear: drawn teeth interleave, keys and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.path import Path
from scipy.spatial import cKDTree

from fegear.commands.show.derived import gear_figures
from fegear.commands.show.gear_set_figure import tooth_outline
from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.inertia import body_inertia, require_inertia_beyond_springs
from fegear.gearset.phases import geometric_phase, mesh_phases
from fegear.gearset.pitch_errors import mesh_errors
from fegear.gearset.placing import layout
from fegear.gearset.plausibility import gear_set_warnings
from meshes.internal import Foundation

SUN = {"name": "sun", "teeth": 24, "hub_radius_mm": 12.0}
PLANET = {"teeth": 36, "hub_radius_mm": 20.0}
RING = {"name": "ring", "teeth": 96, "internal": True, "rim_radius_mm": 108.0}
DEPTH = 1e-8  # m, of chords of the outlines in curved flanks


def planetary(angles, teeth=(24, 36, 96), **keys):
    """Sun > planet > ring for planets at angles [deg], without a shift."""
    distance = float(teeth[0] + teeth[1])
    gears, meshes = [SUN | {"teeth": teeth[0]}], []
    for number, angle in enumerate(angles, start=1):
        name = f"planet-{number}"
        gears.append(PLANET | {"name": name, "teeth": teeth[1]})
        for driver, driven, line in (("sun", name, angle), (name, "ring", angle + 180)):
            meshes.append(
                {"driver": driver, "driven": driven, "center_distance_mm": distance}
                | {"center_line_deg": (line + 180.0) % 360.0 - 180.0}
            )
    gears.append(RING | {"teeth": teeth[2], "rim_radius_mm": teeth[2] + 12.0} | keys)
    defaults = {"module_mm": 2.0, "face_width_mm": 20.0}
    tables = {"name": "planetary", "defaults": defaults, "gear": gears}
    return make_gear_set(tables | {"mesh": meshes})


def outline_of(gear, place, turned):
    """Closed outline (n, 2) [m] of all teeth, turned counter-clockwise [rad]."""
    x, y = tooth_outline(gear, 150)[:-1].T
    tooth = y - 1j * x  # its axis along x
    angles = place.tooth_angle + turned - gear.pitch_angle * np.arange(gear.teeth)
    points = (np.exp(1j * angles)[:, None] * tooth[None, :]).ravel()
    return np.stack([place.x + points.real, place.y + points.imag], axis=-1)


def overlap(one, two, two_is_internal):
    """Depth by which points of each outline are in the other's body, and least gap."""
    near_one = one[cKDTree(two).query(one)[0] < 1e-4]
    near_two = two[cKDTree(one).query(two)[0] < 1e-4]
    inside_two = Path(two).contains_points(near_one) != two_is_internal
    inside_one = Path(one).contains_points(near_two)
    gaps = cKDTree(two).query(near_one)[0]
    depths = np.concatenate(
        [
            edge_distance(near_one[inside_two], two),
            edge_distance(near_two[inside_one], one),
        ]
    )
    return depths.max(initial=0.0), gaps.min()


def edge_distance(points, outline):
    """Distance (n,) of points from the edges of a closed outline."""
    if not len(points):
        return np.empty(0)
    ends = np.roll(outline, -1, axis=0)
    _, nearest = cKDTree(0.5 * (outline + ends)).query(points, k=4)
    start, way = outline[nearest], (ends - outline)[nearest]
    off = points[:, None] - start
    part = np.clip((off * way).sum(-1) / (way**2).sum(-1), 0.0, 1.0)
    return np.hypot(*np.moveaxis(off - part[..., None] * way, -1, 0)).min(axis=1)


SETS = {
    "one": planetary([0.0]),
    "three": planetary([0.0, 120.0, 240.0]),
    "four": planetary([10.0, 100.0, 190.0, 280.0]),
    "unequal": planetary([0.0, 87.0, 201.0]),
    "odd": planetary([0.0, 120.0, 240.0], (21, 30, 81)),
}


@pytest.mark.slow
@pytest.mark.parametrize("gears", SETS.values(), ids=SETS)
@pytest.mark.parametrize("turned", [0.0, 0.3])
def test_drawn_teeth_interleave_and_touch(gears, turned):
    """At any rotation of the sun [pitch angles]; phases of a loop are consistent."""
    placed, senses = layout(gears).places, gears.senses
    places = [placed[index] for index in range(len(gears.gears))]
    angle = 2.0 * math.pi * turned
    outlines = [
        outline_of(gear.geometry, place, sense * angle / gear.geometry.teeth)
        for gear, place, sense in zip(gears.gears, places, senses, strict=True)
    ]
    for mesh in gears.meshes:
        depth, gap = overlap(
            outlines[mesh.driver], outlines[mesh.driven], mesh.pair.is_internal
        )
        assert depth < DEPTH
        assert gap < 5e-6
    for number in range(1, len(gears.meshes)):
        if (geometric := geometric_phase(gears, number)) is not None:
            phase = mesh_phases(gears)[number].value
            assert math.remainder(phase - geometric, 1.0) == pytest.approx(0, abs=1e-9)


def test_phases_of_planets_are_those_of_the_numbers_of_teeth():
    """Parker and Lin (2004): z_sun psi / 2 pi, and z_ring psi / 2 pi, whole or not."""
    angles = [0.0, 90.0, 180.0, 270.0]
    phases = [p.value for p in mesh_phases(planetary(angles, (21, 31, 83)))]
    assert math.remainder(phases[1] - 0.0, 1.0) == pytest.approx(
        math.remainder(phases[3] - phases[2] + (83 + 21) / 4, 1.0), abs=1e-9
    )
    for number, angle in enumerate(angles):
        sun, ring = phases[2 * number], phases[2 * number + 1] - phases[1]
        parts = 21 * angle / 360.0, 83 * angle / 360.0
        assert abs(math.remainder(sun, 1.0)) == pytest.approx(
            abs(math.remainder(parts[0], 1.0)), abs=1e-9
        )
        assert abs(math.remainder(ring, 1.0)) == pytest.approx(
            abs(math.remainder(parts[1], 1.0)), abs=1e-9
        )


def test_pitch_errors_of_a_ring_come_in_the_order_of_its_teeth():
    errors = [float(i) for i in range(96)]
    gears = planetary([0.0], pitch_errors_um=errors, tooth_thinning_um=120.0)
    _, of_ring = mesh_errors(gears, 1)
    np.testing.assert_allclose(of_ring, 1e-6 * np.array(errors))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"hub_radius_mm": 5.0}, "hub_radius_mm = 5; not allowed for an internal gear"),
        ({"span_mm": 50.0}, "span_mm"),
        ({"rim_radius_mm": 90.0}, "rim_radius_mm = 90; at least"),
        ({"cutter_teeth": 94}, "cutter_teeth = 94; at most 87, tips of the cutter"),
        ({"cutter_teeth": 91}, "cutter_teeth = 91; at most"),
        ({"tip_radius_mm": 91.0, "cutter_teeth": 12}, "no flank below its base circle"),
    ],
)
def test_wrong_keys_are_named(keys, message):
    with pytest.raises(InputError, match=message) as caught:
        planetary([0.0], **keys)
    assert "ring" in str(caught.value)
    assert "\n" not in str(caught.value)


SPRINGS = {
    "rim_radial_stiffness_N_per_mm3": 2e3,
    "rim_tangential_stiffness_N_per_mm3": 1e3,
}


def planet_and_ring(**keys):
    gears = [PLANET | {"name": "planet"}, RING | keys]
    mesh = {"driver": "planet", "driven": "ring", "center_distance_mm": 60.0}
    defaults = {"module_mm": 2.0, "face_width_mm": 20.0}
    tables = {"name": "pair", "defaults": defaults, "gear": gears, "mesh": [mesh]}
    return make_gear_set(tables)


def test_springs_of_a_ring_are_those_of_the_file_and_equal_rings_share_them():
    ring = planet_and_ring(**SPRINGS).gears[1]
    assert ring.geometry.foundation == Foundation(radial=2e12, tangential=1e12)
    assert ring == planet_and_ring(**SPRINGS).gears[1]
    assert ring.geometry != planet_and_ring().gears[1].geometry


def test_show_prints_the_springs_of_the_ring_as_a_rigid_body():
    figures = gear_figures(planet_and_ring(**SPRINGS).gears[1])
    width, R = 0.02, 0.108
    assert figures["rim_translation_stiffness_N_per_m"] == pytest.approx(
        width * math.pi * R * 3e12
    )
    assert figures["rim_rotation_stiffness_Nm_per_rad"] == pytest.approx(
        width * 2.0 * math.pi * R**3 * 1e12
    )
    assert not any("rim_" in key for key in gear_figures(planet_and_ring().gears[1]))


@pytest.mark.parametrize("missing", SPRINGS)
def test_one_stiffness_of_a_ring_needs_the_other(missing):
    keys = {key: value for key, value in SPRINGS.items() if key != missing}
    with pytest.raises(InputError, match=f"{missing} is needed with it"):
        planet_and_ring(**keys)


@pytest.mark.parametrize(
    ("key", "value"), [("radial", -1.0), ("tangential", 0.0), ("tangential", 2e12)]
)
def test_stiffnesses_of_a_ring_have_limits(key, value):
    name = f"rim_{key}_stiffness_N_per_mm3"
    with pytest.raises(InputError, match=name):
        planet_and_ring(**(SPRINGS | {name: value}))


def test_springs_are_not_for_external_gears():
    tables = {"name": "sun", "teeth": 24, "hub_radius_mm": 12.0} | SPRINGS
    mesh = {"driver": "sun", "driven": "p", "center_distance_mm": 60.0}
    with pytest.raises(InputError, match=r"rim_radial_.*not allowed for an external"):
        make_gear_set(
            {
                "name": "pair",
                "defaults": {"module_mm": 2.0, "face_width_mm": 20.0},
                "gear": [tables, PLANET | {"name": "p"}],
                "mesh": [mesh],
            }
        )


@pytest.mark.parametrize(("stiffness", "warned"), [(100.0, True), (1000.0, False)])
def test_a_ring_that_moves_on_soft_springs_is_doubted(stiffness, warned):
    gear_set = planet_and_ring(**dict.fromkeys(SPRINGS, stiffness))
    lines = [line for line in gear_set_warnings(gear_set) if line.endswith("[W40]")]
    assert len(lines) == warned
    if warned:  # (1 / 1.357e9 + 0.09021**2 / 1.583e7) N/m, 20 mm of 2e10 N/m2
        assert "rigid body by 0.5 times" in lines[0]


def test_a_rotating_ring_on_springs_needs_inertia_of_what_carries_it():
    held, springs = planet_and_ring(), planet_and_ring(**SPRINGS)
    least = 1.01 * body_inertia(springs.gears[1])
    enough = planet_and_ring(**SPRINGS, inertia_kg_m2=least)
    for gear_set in (held, enough):
        require_inertia_beyond_springs(gear_set, "")
    with pytest.raises(InputError, match=r"ring.*inertia_kg_m2 = .*at least 0.0126"):
        require_inertia_beyond_springs(springs, "")


def test_a_ring_on_springs_that_does_not_rotate_needs_no_more_inertia():
    gears = [SUN, PLANET | {"name": "planet"}, RING | SPRINGS]
    members = {"sun": "sun", "planet": "planet", "ring": "ring", "planets": 3}
    tables = {
        "name": "set",
        "defaults": {"module_mm": 2.0, "face_width_mm": 20.0},
        "gear": gears,
        "planetary": [members],
        "load": {"gear": "sun", "torques_Nm": [30.0]},
    }
    require_inertia_beyond_springs(make_gear_set(tables), "")
    turning = members | {"input": "sun", "output": "ring", "held": "carrier"}
    with pytest.raises(InputError, match=r"ring.*inertia_kg_m2"):
        require_inertia_beyond_springs(
            make_gear_set(tables | {"planetary": [turning]}), ""
        )
