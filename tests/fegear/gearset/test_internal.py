"""Gear sets with an internal gear: drawn teeth interleave, keys and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.path import Path
from scipy.spatial import cKDTree

from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from fegear.gearset.draw import tooth_outline
from fegear.gearset.phases import geometric_phase, mesh_phases
from fegear.gearset.pitch_errors import mesh_errors
from fegear.gearset.placing import layout

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
        ({"cutter_teeth": 94}, "cutter_teeth = 94; .*allowed 5 to 91"),
        ({"cutter_teeth": 91}, "cutter_teeth = 91; .*allowed 5 to"),
        ({"tip_radius_mm": 91.0, "cutter_teeth": 12}, "no flank below its base circle"),
    ],
)
def test_wrong_keys_are_named(keys, message):
    with pytest.raises(InputError, match=message) as caught:
        planetary([0.0], **keys)
    assert "ring" in str(caught.value)
    assert "\n" not in str(caught.value)
