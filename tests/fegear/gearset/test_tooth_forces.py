"""Forces of teeth and reactions of bearings: closed forms and equilibrium in space."""

from __future__ import annotations

import copy
import json
import math
from typing import Any

import numpy as np
import pytest

from fegear.cli import run
from fegear.commands.show.derived import gear_set_figures
from fegear.commands.show.force_values import force_figures, force_lines
from fegear.files.toml import toml_text
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.placing import layout
from fegear.gearset.shaft_reactions import reactions_of_two_bearings
from fegear.gearset.tooth_forces import tooth_forces

RTOL = 1e-9


def pair_tables(line_deg: float, helix_deg: float = 0.0) -> dict[str, Any]:
    return {
        "name": "pair",
        "defaults": {"module_mm": 2.0, "face_width_mm": 20.0, "hub_radius_mm": 8.0}
        | {"helix_angle_deg": helix_deg},
        "gear": [{"name": "a", "teeth": 20}, {"name": "b", "teeth": 40}],
        "mesh": [{"driver": "a", "driven": "b", "center_line_deg": line_deg}],
        "load": {"gear": "a", "torques_Nm": [10.0, 30.0]},
    }


def ring_tables(ring_drives: bool) -> dict[str, Any]:
    gears = [
        {"name": "p", "teeth": 36, "hub_radius_mm": 20.0},
        {"name": "r", "teeth": 96, "internal": True, "rim_radius_mm": 112.0},
    ]
    ends = ("r", "p") if ring_drives else ("p", "r")
    return {
        "name": "ring",
        "defaults": {"module_mm": 2.0, "face_width_mm": 10.0},
        "gear": gears,
        "mesh": [
            dict(zip(("driver", "driven"), ends, strict=True))
            | {"center_distance_mm": 60.0, "center_line_deg": 25.0}
        ],
        "load": {"gear": ends[0], "torques_Nm": [20.0]},
    }


def test_a_standard_pair_by_hand():
    """z = 20, m = 2: r = 20 mm; 10 N m are 500 N, and 500 tan(20) across."""
    driver, driven = force_figures(make_gear_set(pair_tables(0.0)))["tooth_forces"]
    radial = 500.0 * math.tan(math.radians(20.0))
    for row in (driver, driven):
        assert row["tangential_forces_N"] == pytest.approx([500.0, 1500.0], rel=RTOL)
        assert row["radial_forces_N"] == pytest.approx([radial, 3 * radial], rel=RTOL)
        assert row["axial_forces_N"] == [0.0, 0.0]
    # the driver turns counter-clockwise, its mate is on the right: pushed up and away
    assert driven["tangential_direction_deg"] == pytest.approx(90.0)
    assert math.cos(math.radians(driven["radial_direction_deg"])) == pytest.approx(1.0)
    assert driver["tangential_direction_deg"] == pytest.approx(270.0)
    assert driver["radial_direction_deg"] == pytest.approx(180.0)


@pytest.mark.parametrize(
    "tables",
    [
        *(pair_tables(line, helix) for line in (0.0, 200.0) for helix in (0.0, 25.0)),
        ring_tables(False),
        ring_tables(True),
    ],
)
def test_the_force_is_along_a_common_tangent_of_the_base_circles(tables):
    """Moments about both centres are torques, of a force T / r_b that pushes."""
    gear_set = make_gear_set(tables)
    mesh, places = gear_set.meshes[0], layout(gear_set).places
    forces = tooth_forces(gear_set)
    centers = {i: np.array([place.x, place.y]) for i, place in places.items()}
    torque = mesh.torques[0]
    for force in forces:
        gear = mesh.pair.driver if force.role == "driver" else mesh.pair.driven
        ratio = gear.teeth / mesh.pair.driver.teeth
        vector = force.vectors[0, :2]
        assert np.hypot(*vector) == pytest.approx(
            torque * ratio / abs(gear.base_radius), rel=RTOL
        )
        moment = force.arm[0] * vector[1] - force.arm[1] * vector[0]
        sense = gear_set.senses[force.gear] * (-1 if force.role == "driver" else 1)
        assert moment == pytest.approx(sense * torque * ratio, rel=RTOL)
        # of an external gear toward its axis, of an internal one outward
        inward = -np.dot(vector, force.arm) * gear.sign
        assert inward > 0.0
    one, two = forces
    np.testing.assert_allclose(one.vectors, -two.vectors, rtol=RTOL, atol=1e-9)
    points = [centers[force.gear] + force.arm for force in forces]
    np.testing.assert_allclose(points[0], points[1], atol=1e-12)


def test_the_sum_of_equal_planets_is_nothing_on_the_sun():
    """The pin of a planet carries both tangential forces, 2 T / (n r)."""
    values = force_figures(load_gear_set("planetary-24-36-96"))
    largest = max(values["tooth_forces"][0]["tangential_forces_N"])
    sums = {row["gears"][0]: row for row in values["axis_forces"]}
    for name in ("sun", "ring"):
        for axis in "xy":
            np.testing.assert_allclose(
                sums[name][f"forces_{axis}_N"], 0.0, atol=1e-9 * largest
            )
    planet = sums["planet-1"]
    assert planet["forces_y_N"][-1] == pytest.approx(2.0 * largest, rel=RTOL)
    assert planet["forces_x_N"][-1] == pytest.approx(0.0, abs=1e-9 * largest)


def test_helical_planets_are_tilted_and_not_pushed():
    """T = F_a (r_w + r_w), the axial force of the sun T / n tan(beta) / r on a planet.

    Seen from the near end the sun turns counter-clockwise; right-handed it is pushed
    toward the near end, and pushes the planet toward the far one.
    """
    edits = {"defaults.helix_angle_deg": 15.0}
    values = force_figures(load_gear_set("planetary-24-36-96", edits))
    sums = {row["gears"][0]: row for row in values["axis_forces"]}
    module = 2.0 / math.cos(math.radians(15.0))
    torques = np.array([30.0, 60.0, 120.0])
    axial = torques / 3.0 * math.tan(math.radians(15.0)) / (12e-3 * module)
    planet = sums["planet-1"]
    np.testing.assert_allclose(planet["axial_forces_N"], 0.0, atol=1e-9)
    moments = np.array(planet["tilting_moments_x_Nm"])
    np.testing.assert_allclose(moments, 36e-3 * module * axial, rtol=RTOL)
    np.testing.assert_allclose(planet["tilting_moments_y_Nm"], 0.0, atol=1e-9)
    for name, sign in (("sun", -1.0), ("ring", 1.0)):
        row = sums[name]
        np.testing.assert_allclose(row["axial_forces_N"], sign * 3.0 * axial)
        np.testing.assert_allclose(row["tilting_moments_x_Nm"], 0.0, atol=1e-9)
    (line,) = [
        line
        for line in force_lines(values | {"shafts": []})
        if line.startswith("- planet-1, sum")
    ]
    assert "tilts its far end toward 0 deg with 8.0385, 16.077, 32.154 N m" in line


LENGTHS = {"lengths_mm": [240.0], "diameters_mm": [30.0]}
BEARINGS = {
    "bearing_positions_mm": [20.0, 220.0],
    "bearing_kx_N_per_m": [1e8, 1e8],
    "bearing_ky_N_per_m": [1e8, 1e8],
}


def counter_shaft(
    teeth=(20, 40, 20, 50),
    helix_deg=(0.0, 0.0),
    hands=("right", "right"),
    lines_deg=(0.0, 90.0),
    positions_mm=(70.0, 170.0),
    bearings_mm=(20.0, 220.0),
    offsets_mm=(0.0, 0.0),
    torques=(10.0,),
) -> dict[str, Any]:
    """Four gears, of which "b" and "c" are on one shaft between two bearings."""
    helices = [helix_deg[0], helix_deg[0], helix_deg[1], helix_deg[1]]
    gears: list[dict[str, Any]] = [
        {"name": name, "teeth": z, "helix_angle_deg": helix}
        for name, z, helix in zip("abcd", teeth, helices, strict=True)
    ]
    for gear, hand, helix in zip(gears[::2], hands, helix_deg, strict=True):
        if helix:
            gear["hand"] = hand
    meshes = [
        {"driver": ends[0], "driven": ends[1], "center_line_deg": line}
        | ({"offset_mm": offset} if offset else {})
        for ends, line, offset in zip(("ab", "cd"), lines_deg, offsets_mm, strict=True)
    ]
    body = LENGTHS | BEARINGS | {"bearing_positions_mm": list(bearings_mm)}
    shaft = {"gears": ["b", "c"], "positions_mm": list(positions_mm)} | body
    return {
        "name": "counter-shaft",
        "defaults": {"module_mm": 2.0, "face_width_mm": 20.0, "hub_radius_mm": 8.0},
        "gear": gears,
        "mesh": meshes,
        "shaft": [shaft],
        "load": {"gear": "a", "torques_Nm": list(torques)},
    }


def test_a_counter_shaft_by_hand():
    """b at a quarter of the span of 200 mm, c at three quarters.

    T = 10 N m on 20 teeth of module 2 are 500 N up on b (mate to its left), 20 N m on c
    are 1000 N, along x since its mate above it, which c turns to the left, holds it.
    """
    (row,) = force_figures(make_gear_set(counter_shaft()))["shaft_reactions"]
    t = math.tan(math.radians(20.0))
    # b: (500 t, 500); c turns clockwise and pushes d, above it, to the right
    b, c = np.array([500.0 * t, 500.0]), np.array([-1000.0, -1000.0 * t])
    first, second = -(0.75 * b + 0.25 * c), -(0.25 * b + 0.75 * c)
    bearings = row["bearings"]
    assert [bearing["position_mm"] for bearing in bearings] == [20.0, 220.0]
    for bearing, force in zip(bearings, (first, second), strict=True):
        assert bearing["forces_x_N"] == pytest.approx([force[0]], rel=RTOL)
        assert bearing["forces_y_N"] == pytest.approx([force[1]], rel=RTOL)
    assert row["axial_forces_N"] == [0.0]


def test_an_axial_force_bends_its_shaft_by_its_arm():
    """One helical pair: R2 x of b by F_a r over the span, F_a = F_t tan(beta)."""
    tables = counter_shaft(helix_deg=(20.0, 0.0))
    (row,) = force_figures(make_gear_set(tables))["shaft_reactions"]
    cosine = math.cos(math.radians(20.0))
    radius = 40.0 / cosine  # mm, of b
    tangential = 20e3 / radius
    axial = tangential * math.tan(math.radians(20.0))
    radial = tangential * math.tan(math.radians(20.0)) / cosine
    t = math.tan(math.radians(20.0))
    # a is right-handed and counter-clockwise: it goes to the near end, b to the far one
    moment = 50.0 * radial + 150.0 * -1000.0 - (-radius) * axial
    assert row["bearings"][1]["forces_x_N"][0] == pytest.approx(-moment / 200.0)
    moment = 50.0 * tangential + 150.0 * -1000.0 * t
    assert row["bearings"][1]["forces_y_N"][0] == pytest.approx(-moment / 200.0)
    assert row["axial_forces_N"] == pytest.approx([-axial], rel=RTOL)


def middle_of_common_width(offset: float) -> tuple[float, float]:
    """From the middles of driver and driven gear [mm], both 20 mm wide."""
    low, high = max(-10.0, offset - 10.0), min(10.0, offset + 10.0)
    return 0.5 * (low + high), 0.5 * (low + high) - offset


@pytest.mark.parametrize("seed", range(30))
def test_forces_and_moments_on_a_shaft_of_two_meshes_are_zero(seed):
    """Everything from what `show` prints, and moments by vector products."""
    rng = np.random.default_rng(seed)
    teeth = tuple(int(z) for z in rng.integers(20, 60, 4))
    lines = tuple(float(v) for v in rng.uniform(-180.0, 180.0, 2))
    positions = tuple(float(v) for v in rng.uniform(0.0, 240.0, 2))
    near = float(rng.uniform(0.0, 100.0))
    far = float(rng.uniform(near + 30.0, 240.0))
    bearings = (near, far) if rng.random() < 0.5 else (far, near)
    offsets = tuple(float(v) for v in rng.uniform(-8.0, 8.0, 2))
    tables = counter_shaft(
        teeth=teeth,
        helix_deg=tuple(float(v) for v in rng.uniform(5.0, 30.0, 2)),
        hands=tuple(str(v) for v in rng.choice(["right", "left"], 2)),
        lines_deg=lines,
        positions_mm=positions,
        bearings_mm=bearings,
        offsets_mm=offsets,
        torques=(10.0, 70.0),
    )
    figures = gear_set_figures(make_gear_set(tables))
    rows = {row["gear"]: row for row in figures["tooth_forces"]}
    (reactions,) = figures["shaft_reactions"]
    distances = [mesh["center_distance_mm"] for mesh in figures["meshes"]]
    # pitch points of b, whose mate is against its centre line, and of c
    radius_b = distances[0] * teeth[1] / (teeth[0] + teeth[1])
    radius_c = distances[1] * teeth[2] / (teeth[2] + teeth[3])
    line_b, line_c = (math.radians(line) for line in lines)
    far_ends = (
        positions[0] + middle_of_common_width(offsets[0])[1],
        positions[1] + middle_of_common_width(offsets[1])[0],
    )
    # right-handed axes: x to the right, y up, z toward the viewer at the near end
    points = [
        [-radius_b * math.cos(line_b), -radius_b * math.sin(line_b), -far_ends[0]],
        [radius_c * math.cos(line_c), radius_c * math.sin(line_c), -far_ends[1]],
    ]
    for case in range(2):
        forces = []
        for row in (rows["b"], rows["c"]):
            total = np.zeros(3)
            for side in ("tangential", "radial"):
                angle = math.radians(row[f"{side}_direction_deg"])
                size = row[f"{side}_forces_N"][case]
                total += size * np.array([math.cos(angle), math.sin(angle), 0.0])
            total[2] = -row["axial_forces_N"][case]
            forces.append(total)
        places = [np.array(point) for point in points]
        for bearing in reactions["bearings"]:
            x, y = (bearing[f"forces_{axis}_N"][case] for axis in "xy")
            forces.append(np.array([x, y, 0.0]))
            places.append(np.array([0.0, 0.0, -bearing["position_mm"]]))
        forces.append(np.array([0.0, 0.0, -reactions["axial_forces_N"][case]]))
        places.append(np.array([0.0, 0.0, -bearings[0]]))
        largest = max(np.abs(forces).max(), 1.0)
        np.testing.assert_allclose(np.sum(forces, axis=0), 0.0, atol=1e-9 * largest)
        moments = np.cross(places, forces)
        np.testing.assert_allclose(
            moments.sum(axis=0), 0.0, atol=1e-9 * np.abs(moments).max()
        )


def test_a_simply_supported_beam():
    """Load P at a from the first of two bearings L apart: P (1 - a/L) and P a/L."""
    points = np.array([[0.0, 0.0, 0.3]])
    forces = np.array([[[0.0, -12.0, 5.0]]])
    radial, axial = reactions_of_two_bearings((0.1, 0.9), points, forces)
    np.testing.assert_allclose(radial[0], [[0.0, 9.0], [0.0, 3.0]], rtol=1e-14)
    np.testing.assert_allclose(axial, [-5.0])


@pytest.mark.parametrize("positions", [[20.0, 120.0, 220.0], [120.0], [60.0, 60.0]])
def test_other_bearings_are_not_determined_by_statics(positions, tmp_path, capsys):
    tables = counter_shaft(bearings_mm=tuple(positions))
    for key in ("bearing_kx_N_per_m", "bearing_ky_N_per_m"):
        tables["shaft"][0][key] = [1e8] * len(positions)
    values = force_figures(make_gear_set(tables))
    assert values["shaft_reactions"] == []
    assert len(values["axis_forces"]) == 1
    path = tmp_path / "shaft.toml"
    path.write_text(toml_text(tables))
    assert run(["show", str(path)]) == 0
    assert "- b, c: statics needs two bearings" in capsys.readouterr().out


def test_bearings_that_resist_tilting_are_not_determined_by_statics():
    tables = counter_shaft()
    tables["shaft"][0]["bearing_tilt_stiffness_Nm_per_rad"] = [0.0, 1e3]
    assert force_figures(make_gear_set(tables))["shaft_reactions"] == []


def test_without_loads_there_are_no_forces():
    tables = copy.deepcopy(counter_shaft())
    del tables["load"]
    assert not any(force_figures(make_gear_set(tables)).values())


def test_show_says_directions_in_words(tmp_path, capsys):
    path = tmp_path / "shaft.toml"
    path.write_text(toml_text(counter_shaft(torques=(10.0, 20.0))))
    assert run(["show", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    (line,) = [line for line in lines if line.startswith("- a, driver of mesh 1: ")]
    assert "tangential 500, 1000 N, against its rotation, toward 270 deg" in line
    assert "radial 181.99, 363.97 N, toward its axis, toward 180 deg" in line
    (line,) = [line for line in lines if line.startswith("- b, driven of mesh 1: ")]
    assert "500, 1000 N, in the sense of its rotation, toward 90 deg" in line
    (line,) = [line for line in lines if line.startswith("- b, c, sum on their axis")]
    x, y = 500.0 * math.tan(math.radians(20.0)) - 1000.0, 500.0 - 363.97
    assert f"{math.hypot(x, y):.4g}" in line
    assert any(line.startswith("- b, c: bearing at 20 mm, ") for line in lines)


def test_of_equal_planets_the_first_is_listed(capsys):
    assert run(["show", "planetary-24-36-96"]) == 0
    text = capsys.readouterr().out
    assert "- planet-1, driven of mesh 1: " in text
    assert "- planet-2, driven" not in text
    assert "- sun, sum of all its meshes: 0 N" in text
    assert run(["show", "planetary-24-36-96", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["tooth_forces"]) == 12
