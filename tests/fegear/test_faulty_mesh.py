"""Mesh tables of gears with faults: which teeth, which flanks, which meshes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from slow_tests import first_are_quick

import fegear
from fegear.commands.stiffness.crack_tips import crack_tips
from fegear.commands.stiffness.study import MeshStiffness
from fegear.gearset.phases import mesh_phases
from fegear.statics.mesh_result import StaticsResult
from fegear.statics.settings import StaticsSettings
from fegear.studies.trains.gear_sets import GearSetRef

COARSE = StaticsSettings(
    resolution="coarse", positions=16, estimate_error=False, root_stress=False
)
TORQUE = 100.0


def solved(
    name: str, edits=None, mesh: int = 0, torque: float = TORQUE
) -> StaticsResult:
    gears = fegear.load_gear_set(name, edits or {})
    return fegear.solve_mesh(gears, mesh + 1, [torque], COARSE)


def by_pitch(result: StaticsResult, column: str) -> np.ndarray:
    return result.table[column][0].reshape(result.pitches, -1)


def crack(tooth: int, depth_mm: float = 1.5, **keys) -> list[dict]:
    return [{"tooth": tooth, "depth_mm": depth_mm, **keys}]


@pytest.mark.parametrize(("gear", "teeth"), [("pinion", 38), ("idler", 55)])
@pytest.mark.parametrize("tooth", [1, 7, 30])
def test_a_cracked_tooth_is_soft_when_it_is_the_reference_pair(gear, teeth, tooth):
    edits = {f"gear.{gear}.cracks": crack(tooth)}
    result = solved("liu-pair", edits)
    assert result.pitches == teeth
    stiffness = by_pitch(result, "stiffness_N_per_m")
    healthy = solved("liu-pair").table["stiffness_N_per_m"][0]
    drop = 1.0 - stiffness / healthy
    assert drop[tooth - 1, 0] > 0.05  # at the pitch point it alone carries the load
    far = (np.arange(teeth) - (tooth - 1) + teeth // 2) % teeth - teeth // 2
    assert np.array_equal(drop[np.abs(far) > 5], np.zeros((teeth - 11, 16)))
    # neighbours of the cracked tooth stand on the same body
    assert np.abs(drop[np.abs(far) == 2]).max() < 0.02 * drop.max()


def test_a_deeper_crack_is_softer():
    drops = []
    for depth in (0.2, 0.6, 1.2, 2.0):
        stiffness = solved("liu-pair", {"gear.pinion.cracks": crack(5, depth)})
        drops.append(-stiffness.table["stiffness_N_per_m"][0].min())
    assert np.all(np.diff(drops) > 0.0)


def test_a_crack_in_compression_is_closed():
    healthy = solved("liu-pair").table["stiffness_N_per_m"][0]
    edits = {"gear.pinion.cracks": crack(5, root="back")}
    closed = solved("liu-pair", edits)
    assert closed.pitches == 1  # no tooth differs on the flanks that carry load
    assert np.array_equal(closed.table["stiffness_N_per_m"][0], healthy)


@pytest.mark.parametrize("root", ["loaded", "back"])
def test_a_crack_of_an_idler_opens_in_one_of_its_meshes(root):
    edits = {"gear.idler.cracks": crack(5, root=root)}
    spread = [
        float(np.ptp(by_pitch(solved("liu-idler", edits, mesh), "ste_m"), axis=0).max())
        for mesh in (0, 1)
    ]
    opens = 0 if root == "loaded" else 1
    assert spread[opens] > 1e-7
    assert spread[1 - opens] == 0.0


def test_cracks_of_both_gears_add_up_where_they_meet():
    one = {"gear.pinion.cracks": crack(5)}
    two = {"gear.idler.cracks": crack(5)}
    ste = [
        by_pitch(solved("liu-pair", edits), "ste_m")[4, 0]
        for edits in ({}, one, two, one | two)
        if edits
    ]
    healthy = solved("liu-pair").table["ste_m"][0, 0]
    both = solved("liu-pair", one | two)
    assert both.pitches == math.lcm(38, 55)
    assert_allclose(ste[2] - healthy, ste[0] + ste[1] - 2.0 * healthy, rtol=1e-2)


@pytest.mark.parametrize("seed", first_are_quick(range(3), 1))
def test_offset_centers_project_on_the_line_of_action_of_every_mesh(seed):
    """To first order in the offsets, of all gears of a train at once."""
    random = np.random.default_rng(seed)
    gears = fegear.load_gear_set("liu-idler")
    offsets = {
        gear.name: (random.uniform(1.0, 4.0), random.uniform(0.0, 360.0))
        for gear in gears.gears
    }
    edits: dict[str, float] = {}
    for name, (distance, angle) in offsets.items():
        edits[f"gear.{name}.eccentricity_um"] = distance
        edits[f"gear.{name}.eccentricity_angle_deg"] = angle
    gears = fegear.load_gear_set("liu-idler", edits)
    for number, mesh in enumerate(gears.meshes):
        alone = {
            g: e for g, e in edits.items() if g.split(".")[1] in names(gears, mesh)
        }
        result = solved("liu-idler", alone, number, 1e-6)
        position = result.table.position
        alpha = mesh.pair.operating_pressure_angle
        sense = gears.senses[mesh.driver]
        along = mesh.direction + sense * (0.5 * math.pi - alpha)
        rotated = position - mesh_phases(gears)[number].value
        expected = np.zeros(position.size)
        for gear, sign in zip(mesh.gears, (-1.0, 1.0), strict=True):
            distance, angle = offsets[gears.gears[gear].name]
            first = gears.meshes[gears.meshes_of[gear][0]]
            toward = first.direction + (0.0 if first.driver == gear else math.pi)
            pitch = gears.gears[gear].geometry.pitch_angle
            turn = gears.senses[gear] * rotated * pitch
            direction = toward + math.radians(angle) + turn
            expected += sign * 1e-6 * distance * np.cos(direction - along)
        no_load = result.table["nlte_m"][0]
        assert_allclose(no_load, expected, atol=5e-9)


def names(gears, mesh) -> set[str]:
    return {gears.gears[gear].name for gear in mesh.gears}


def test_the_fundamental_of_an_offset_centre_is_its_distance():
    result = solved("liu-pair", {"gear.pinion.eccentricity_um": 25.0})
    amplitudes = [h.amplitude for h in result.harmonics("nlte_m", 1)[0]]
    spectrum = np.fft.rfft(result.table["nlte_m"][0]) / result.table.position.size
    assert_allclose(2.0 * abs(spectrum[1]), 25e-6, rtol=1e-6)
    assert amplitudes[0] < 1e-9  # of the mesh frequency


def test_the_page_tells_the_largest_drop():
    ref = GearSetRef(
        name="liu-pair", edits=("gear.pinion.cracks=[{tooth=5,depth_mm=2}]",)
    )
    study = MeshStiffness(gear_set=ref, torque=(TORQUE,), elements=COARSE)
    result = fegear.run(study)
    at_torque = result.summary["torques"][0]
    lines = [part for part in result.page() if isinstance(part, str)]
    assert any("root stress is that of teeth without a crack" in line for line in lines)
    healthy = solved("liu-pair").table["stiffness_N_per_m"][0]
    cracked = solved("liu-pair", {"gear.pinion.cracks": crack(5, 2.0)})
    drop = 1.0 - by_pitch(cracked, "stiffness_N_per_m") / healthy
    assert_allclose(at_torque["largest_stiffness_drop_percent"], 100.0 * drop.max())
    assert_allclose(at_torque["largest_drop_at_position"], drop.argmax() / 16)


def test_bodies_that_are_free_have_no_cracks():
    gears = fegear.load_gear_set("liu-pair", {"gear.pinion.cracks": crack(5)})
    free = StaticsSettings(resolution="coarse", positions=16, body="free")
    with pytest.raises(fegear.InputError, match="cracks; not known of bodies that are"):
        fegear.solve_mesh(gears, 1, [TORQUE], free)


def test_root_stress_is_that_of_teeth_without_a_crack():
    settings = StaticsSettings(resolution="coarse", positions=16, estimate_error=False)
    gears = fegear.load_gear_set("liu-pair", {"gear.pinion.cracks": crack(5)})
    cracked = fegear.solve_mesh(gears, 1, [TORQUE], settings)
    healthy = fegear.solve_mesh(fegear.load_gear_set("liu-pair"), 1, [TORQUE], settings)
    stress = by_pitch(cracked, "driver_root_stress_Pa")
    expected = healthy.table["driver_root_stress_Pa"][0]
    assert_allclose(stress[20], expected, rtol=1e-12)
    assert np.isfinite(stress).all()
    # while the cracked tooth alone carries the load, its neighbours have little stress
    assert stress[4, 0] < 0.5 * expected[0]


def tip_of(depth_mm: float, tooth: int = 5):
    edits = {"gear.pinion.cracks": crack(tooth, depth_mm)}
    gears = fegear.load_gear_set("liu-pair", edits)
    result = fegear.solve_mesh(gears, 1, [TORQUE], COARSE)
    (tip,) = crack_tips(gears, result, COARSE)
    return tip, result


@pytest.mark.parametrize("depth", [0.5, 1.5])
def test_the_energy_release_rate_is_what_the_deflection_gains(depth):
    """At the pitch point, where one pair carries all: G b = F / 2 times d(STE) / da."""
    step = 0.02
    tip, result = tip_of(depth)
    position = 4 * 16
    longer, shorter = (
        tip_of(depth + sign * step)[1].table["ste_m"][0, position]
        for sign in (1.0, -1.0)
    )
    force = TORQUE / result.problem.pair.driver.base_radius
    gain = (longer - shorter) / (2e-3 * step)
    expected = 0.5 * force * gain / result.problem.face_width
    assert_allclose(tip.energy_release_rate[0, position], expected, rtol=0.02)
    assert (tip.gear, tip.tooth) == ("pinion", 5)
    assert tip.stress_intensity[0, position, 0] > 0.0
    assert tip.error[0, position] < 0.02 * expected


def test_a_crack_of_a_driven_gear_has_the_same_rate():
    gears = fegear.load_gear_set("liu-pair", {"gear.idler.cracks": crack(9, 1.0)})
    result = fegear.solve_mesh(gears, 1, [TORQUE], COARSE)
    (tip,) = crack_tips(gears, result, COARSE)
    assert (tip.gear, tip.tooth) == ("idler", 9)
    rate = tip.energy_release_rate[0].reshape(55, 16)
    assert rate[8].max() > 0.5 * rate.max() > 0.0
    assert rate[20].max() == 0.0


def test_a_table_of_cracks_has_a_row_for_every_position():
    edit = "gear.pinion.cracks=[{tooth=5,depth_mm=1}]"
    ref = GearSetRef(name="liu-pair", edits=(edit,))
    study = MeshStiffness(gear_set=ref, torque=(TORQUE,), elements=COARSE)
    result = fegear.run(study)
    table = result.more_tables["cracks"]
    rows = [dict(zip(table.names, row, strict=True)) for row in table.rows()]
    assert len(rows) == 38 * 16
    largest = max(rows, key=lambda row: row["energy_release_rate_J_per_m2"])
    assert largest == result.summary["crack_tips"][0]
