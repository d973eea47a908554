"""Faults of sun, planets and ring: which tooth each mesh meets, and when."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from slow_tests import first_are_quick

from fegear.commands.faults.axes import GearSetEdits
from fegear.gearset import load_gear_set, make_gear_set
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.read import load_tables
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from fegear.studies.trains.gear_sets import GearSetRef

SET = "planetary-24-36-96"
TEETH = {"sun": 24, "planet": 36, "ring": 96}
COARSE = StaticsSettings(
    resolution="coarse", positions=16, estimate_error=False, root_stress=False
)
TORQUES = 10.0, 20.0  # on the driver of a mesh
COLUMNS = "stiffness_N_per_m", "ste_m", "nlte_m"
MEMBERS = {
    "sun": {"input": "sun", "output": "carrier", "held": "ring"},
    "carrier": {"input": "carrier", "output": "ring", "held": "sun"},
    "ring": {"input": "ring", "output": "carrier", "held": "sun"},
}
POSITIONS = {
    "three": [0.0, 120.0, 240.0],
    "unequal": [12.0, 129.0, 252.0],
    "four": [0.0, 90.0, 180.0, 270.0],
    "pairs": [0.0, 87.0, 180.0, 267.0],
}
SPALL = {"start_roll_angle_deg": 20.0, "end_roll_angle_deg": 23.0, "width_share": 0.6}
WEAR = {"roll_angle_deg": [18.0, 25.0], "depth_um": [3.0, 6.0]}
SUN_FAULTS = {
    "cracks": [{"tooth": 5, "depth_mm": 1.0}],
    "spalls": [{"tooth": 5, **SPALL}],
    "broken_tips": [{"tooth": 5, "height_mm": 0.4}],
    "worn_teeth": [{"tooth": 5, **WEAR}],
}
RING_FAULTS = {
    "broken_tips": SUN_FAULTS["broken_tips"],
    "spalls": [
        SPALL | {"tooth": 5, "start_roll_angle_deg": 19.0, "end_roll_angle_deg": 20.0}
    ],
    "worn_teeth": [WEAR | {"tooth": 5, "roll_angle_deg": [18.0, 20.0]}],
}


def planetary(positions: str = "three", member: str = "sun", **faults) -> GearSet:
    """The built-in set; faults : by `gear__key`, with _ for - in names of planets."""
    stated = POSITIONS[positions]
    edits = {f"planetary.1.{key}": value for key, value in MEMBERS[member].items()}
    edits |= {"planetary.1.planets": len(stated), "planetary.1.positions_deg": stated}
    edits |= {"load.gear": member}
    for name, value in faults.items():
        gear, key = name.split("__")
        edits[f"gear.{gear.replace('_', '-')}.{key}"] = value
    return load_gear_set(SET, edits)


def pair_alone(gear_set: GearSet, mesh: int, faulty: str, faults: dict) -> GearSet:
    """Driver and driven gear of a mesh as a set of two, one of them with faults."""
    gears = []
    for index in gear_set.meshes[mesh].gears:
        gear = gear_set.gears[index]
        kind = gear.name.split("-")[0]
        rim = {"internal": True, "rim_radius_mm": 112.0}
        bodies = {
            "sun": {"hub_radius_mm": 12.0},
            "planet": {"hub_radius_mm": 20.0},
            "ring": rim,
        }
        table = {"name": kind, "teeth": TEETH[kind], **bodies[kind]}
        gears.append(table | (faults if kind == faulty else {}))
    names = [gear["name"] for gear in gears]
    defaults = {"module_mm": 2.0, "face_width_mm": 20.0, "tooth_thinning_um": 40.0}
    mesh_table = {
        "driver": names[0],
        "driven": names[1],
        "center_distance_mm": 60.0,
    }
    return make_gear_set(
        {
            "name": "alone",
            "plane": "stress",
            "defaults": defaults,
            "gear": gears,
            "mesh": [mesh_table],
            "load": {"gear": names[0], "torques_Nm": [20.0]},
        }
    )


def table_of(gear_set: GearSet, mesh: int):
    return solve_mesh(gear_set, mesh + 1, list(TORQUES), COARSE).table


def passing_cycles(gear_set: GearSet, gear: str, mesh: int) -> float:
    """Mesh cycles from a tooth's mesh with planet 1 to that with another planet.

    By the angle that the gear turns relative to the carrier.
    """
    angles, planet = gear_set.carrier.angles, mesh // 2
    index = [g.name for g in gear_set.gears].index(gear)
    turned = gear_set.senses[index] * (angles[planet] - angles[0])
    return TEETH[gear] * turned / (2.0 * math.pi)


CASES = [
    ("three", "sun"),
    ("pairs", "ring"),
    ("unequal", "carrier"),
    ("four", "sun"),
]


@pytest.mark.parametrize("case", first_are_quick(CASES, 2))
@pytest.mark.parametrize(
    ("gear", "key"),
    [
        ("sun", "cracks"),
        ("ring", "broken_tips"),
        *(pytest.param("sun", key, marks=pytest.mark.slow) for key in SUN_FAULTS),
        *(pytest.param("ring", key, marks=pytest.mark.slow) for key in RING_FAULTS),
    ],
)
def test_planets_meet_a_faulty_tooth_as_the_pair_alone_but_later(
    compliance_cache, key, gear, case
):
    positions, member = case
    faults = {key: (SUN_FAULTS if gear == "sun" else RING_FAULTS)[key]}
    gear_set = planetary(positions, member, **{f"{gear}__{key}": faults[key]})
    first = 0 if gear == "sun" else 1
    alone = table_of(pair_alone(gear_set, first, gear, faults), 0)
    healthy = table_of(planetary(positions, member), first)
    assert np.ptp(alone["ste_m"]) > 1.01 * np.ptp(healthy["ste_m"])
    phases = [phase.value for phase in mesh_phases(gear_set)]
    for mesh in range(first, len(gear_set.meshes), 2):
        later = passing_cycles(gear_set, gear, mesh) + phases[mesh] - phases[first]
        assert later == pytest.approx(round(later), abs=1e-9)
        table = table_of(gear_set, mesh)
        assert table.position.size == 16 * TEETH[gear]
        for column in COLUMNS:
            expected = np.roll(alone[column], 16 * round(later), axis=1)
            scale = np.abs(expected).max()
            assert_allclose(table[column], expected, rtol=0, atol=1e-12 * scale)


def effect_of(faulty: GearSet, healthy: GearSet, mesh: int) -> np.ndarray:
    """Change of the deflection in a mesh's table over a turn."""
    one, two = table_of(faulty, mesh), table_of(healthy, mesh)
    turns = one.position.size // two.position.size
    return one["ste_m"][1] - np.tile(two["ste_m"][1], turns)


@pytest.mark.parametrize("member", first_are_quick(list(MEMBERS), 1))
@pytest.mark.parametrize("planet", [1, 3])
def test_a_planets_tooth_is_in_both_meshes_half_a_turn_less_its_thickness_apart(
    compliance_cache, planet, member
):
    key = {f"planet_{planet}__broken_tips": [{"tooth": 7, "height_mm": 0.4}]}
    gear_set, healthy = planetary("three", member, **key), planetary("three", member)
    phases = mesh_phases(gear_set)
    times = []
    for mesh in (2 * planet - 2, 2 * planet - 1):
        driver = gear_set.meshes[mesh].driver
        drives = gear_set.gears[driver].name == f"planet-{planet}"
        broken = {"broken_tips": [{"tooth": 1, "height_mm": 0.4}]}
        pair = pair_alone(gear_set, mesh, "planet", broken)
        alone = effect_of(pair, pair_alone(gear_set, mesh, "", {}), 0)
        change = effect_of(gear_set, healthy, mesh)
        shifts = [
            n
            for n in range(36)
            if np.allclose(change, np.roll(alone, 16 * n), 0, 1e-15)
        ]
        assert len(shifts) == 1
        times.append((drives, shifts[0] - phases[mesh].value))
    # the planet is driven on its rear flank and drives with its front one
    driven_at, driving_at = (t for _, t in sorted(times))
    pair = gear_set.meshes[0].pair
    gear = pair.driver if pair.driver.teeth == TEETH["planet"] else pair.driven
    half_angles = [
        gear.half_angle(gear.base_radius / math.cos(m.pair.operating_pressure_angle))
        for m in gear_set.meshes[:2]
    ]
    expected = 36 * (math.pi - sum(half_angles)) / (2.0 * math.pi)
    difference = (driving_at - driven_at - expected) / 36
    assert difference == pytest.approx(round(difference), abs=1e-9)


@pytest.mark.parametrize(
    ("key", "value", "sun", "ring"),
    [
        ("cracks", SUN_FAULTS["cracks"], True, False),
        ("cracks", [{"tooth": 5, "depth_mm": 1.0, "root": "back"}], False, True),
        ("spalls", SUN_FAULTS["spalls"], True, False),
        ("worn_teeth", SUN_FAULTS["worn_teeth"], True, False),
        ("broken_tips", SUN_FAULTS["broken_tips"], True, True),
        ("eccentricity_um", 4.0, True, True),
    ],
)
def test_a_planets_flanks_have_the_faults_of_their_side(
    compliance_cache, key, value, sun, ring
):
    """Spalls and wear on the flank to the sun, cracks where the root is in tension."""
    gear_set, healthy = planetary(**{f"planet_2__{key}": value}), planetary()
    for mesh, has_effect in ((2, sun), (3, ring), (0, False), (1, False)):
        change = np.abs(effect_of(gear_set, healthy, mesh)).max()
        assert (change > 1e-8) if has_effect else (change < 1e-15)


def test_the_planet_of_the_file_is_all_planets_and_one_may_differ():
    tips = [{"tooth": 3, "height_mm": 0.4}]
    everyone = planetary(planet__broken_tips=tips)
    counts = [len(gear.faults.broken_tips) for gear in everyone.gears]
    assert counts == [0, 1, 1, 1, 0]
    other = planetary(planet__broken_tips=tips, planet_2__broken_tips=[])
    counts = [len(gear.faults.broken_tips) for gear in other.gears]
    assert counts == [0, 1, 0, 1, 0]


@pytest.mark.parametrize("case", first_are_quick(CASES, 2))
def test_offset_centers_project_on_the_lines_of_action(compliance_cache, case):
    """To first order in the offsets of all gears, in the frame of the carrier."""
    positions, member = case
    random = np.random.default_rng(3)
    faults = {}
    for gear in ("sun", "planet_1", "planet_2", "planet_3", "ring"):
        faults[f"{gear}__eccentricity_um"] = random.uniform(1.0, 3.0)
        faults[f"{gear}__eccentricity_angle_deg"] = random.uniform(-180.0, 180.0)
    gear_set = planetary(positions, member, **faults)
    for number in range(6):
        mesh = gear_set.meshes[number]
        pair = pair_of_mesh(positions, member, gear_set, number, faults)
        table = solve_mesh(pair, number + 1, [1e-6], COARSE).table
        cycles = table.position - mesh_phases(gear_set)[number].value
        # from the driver at the origin to the driven gear; the force is on the latter
        toward = mesh.direction + (math.pi if mesh.pair.is_internal else 0.0)
        rolls = gear_set.senses[mesh.driver] * mesh.pair.driver.sign
        alpha = mesh.pair.operating_pressure_angle
        force = np.exp(1j * (toward + rolls * (0.5 * math.pi - alpha)))
        expected = np.zeros(cycles.size)
        for gear, sign in zip(mesh.gears, (-1.0, 1.0), strict=True):
            center = center_of(gear_set, gear, cycles)
            expected += sign * (center * force.conjugate()).real
        assert_allclose(table["nlte_m"][0], expected, rtol=0, atol=3e-9)


def pair_of_mesh(positions, member, gear_set, number, faults) -> GearSet:
    """The set with the faults of the gears of one mesh only."""
    names = {gear_set.gears[gear].name for gear in gear_set.meshes[number].gears}
    chosen = {
        key: value
        for key, value in faults.items()
        if key.split("__")[0].replace("_", "-") in names
    }
    return planetary(positions, member, **chosen)


def center_of(gear_set: GearSet, gear: int, cycles: np.ndarray) -> np.ndarray:
    """Offset of a gear's centre over mesh cycles [m], x + i y on the carrier."""
    body = gear_set.gears[gear]
    angles = gear_set.carrier.angles
    if body.name.startswith("planet"):
        toward_mate = angles[int(body.name[-1]) - 1] + math.pi  # the sun
    else:
        toward_mate = angles[0]
    turned = gear_set.senses[gear] * 2.0 * math.pi * cycles / body.geometry.teeth
    direction = toward_mate + body.faults.eccentricity_angle
    return body.faults.eccentricity * np.exp(1j * (direction + turned))


def test_a_data_set_varies_the_fault_of_one_planet():
    """Its key has the planet's name: the file has the planet once, by number 2."""
    tips = {"gear.planet.broken_tips": [{"tooth": 3, "height_mm": 0.2}]}
    edits = GearSetEdits(load_tables(SET, tips), tips, gear=3, teeth=36)
    texts = edits.texts({"broken_tip": 0.4}, 5)
    gear_set = GearSetRef(name=SET, edits=texts).loaded
    teeth = [[t.tooth for t in g.faults.broken_tips] for g in gear_set.gears]
    assert teeth == [[], [2], [2, 4], [2], []]
    assert gear_set.gears[2].faults.broken_height(4) == pytest.approx(0.4e-3)
