"""Wear over profile and face width: balances, sections, and what it levels."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sliced_pairs import TORQUE, problem, slope

import fegear
from fegear.commands.wear.archard import StepPlan, path_points, wear_off
from fegear.commands.wear.faces import WearingFaces
from fegear.contact.solve import solve_cycle
from fegear.contact.width.supports import MOTIONS, AxisSupports, GearSupport
from fegear.files.errors import InputError
from fegear.files.toml import toml_text

K = 1e-18  # m2/N


def wearing(
    helix_angle_deg: float, depth: float, ring: str | None = None
) -> WearingFaces:
    contact = problem(helix_angle_deg, slope(depth), ring=ring)
    return WearingFaces(contact, TORQUE, K, path_points(contact.pair, 8))


@pytest.mark.parametrize(
    ("helix_angle_deg", "ring"),
    [(0.0, None), (18.0, None), (18.0, "driven"), (0.0, "driver")],
)
def test_wear_levels_the_load_of_misaligned_gears(helix_angle_deg, ring):
    """K_Hbeta falls with the cycles, and both gears lose the volume of their work."""
    mesh = wearing(helix_angle_deg, 10e-6, ring)
    factors, depth = [], mesh.unworn
    for _ in range(3):
        worn = wear_off(mesh, depth, 1e7, StepPlan(1e-6, 2))
        factors += [worn.first.distribution_factor]
        depth = worn.depth
        volume = K * worn.sliding_work
        areas = mesh.worn_areas(worn.lost) / mesh.passages[:, 0]
        assert areas == pytest.approx(volume, rel=1e-2)
    factors += [worn.last.distribution_factor]
    assert (np.diff(factors) < 0.0).all()


@pytest.mark.parametrize("helix_angle_deg", [0.0, 18.0])
def test_the_error_by_slices_covers_that_beside_finer_ones(helix_angle_deg):
    """Beside four times as many slices; no slice is left out by either."""
    rough = wearing(helix_angle_deg, 10e-6)
    contact = problem(helix_angle_deg, slope(10e-6), slices=64)
    fine = replace(rough, contact=contact)
    taken = [mesh.depth_per_passage(mesh.load(mesh.unworn)) for mesh in (rough, fine)]
    in_slices = taken[1].reshape(*taken[0].shape, 4).mean(axis=-1)
    change = np.abs(taken[0] - in_slices).mean(axis=(1, 2))
    error = (change / in_slices.mean(axis=(1, 2))).max()
    estimated = rough.slice_error(rough.load(rough.unworn), rough.unworn)
    assert 0.7 * error < estimated < 5.0 * error


def test_gears_on_axes_that_yield_wear_with_an_error_by_slices():
    mesh = wearing(18.0, 5e-6)
    compliance = np.diag([1e-9, 1e-9, 1e-9, 1e-6, 1e-6])
    axis = GearSupport(compliance=compliance, motion=np.zeros(MOTIONS))
    solver = replace(mesh.solver, supports=AxisSupports(axis, axis))
    yielding = replace(mesh, contact=replace(mesh.contact, solver=solver))
    loaded = yielding.load(yielding.unworn)
    assert loaded.deflection > mesh.load(mesh.unworn).deflection + 4e-6
    error = yielding.slice_error(loaded, yielding.unworn)
    assert 0.0 < error < 0.2


def test_the_volume_is_that_of_load_times_sliding():
    """Summed over slices of a contact that is solved at other positions."""
    mesh = wearing(18.0, 5e-6)
    loaded = mesh.load(mesh.unworn)
    count = 64
    cycle = solve_cycle(mesh.contact, TORQUE, np.arange(count) / count)
    face, pair = cycle.face, mesh.pair
    position = face.path_position
    inside = (position > pair.path[0]) & (position < pair.path[1])
    path = position * pair.base_pitch
    radii = pair.driver.base_radius, pair.driven.base_radius
    sliding = np.abs(path) * sum(1.0 / radius for radius in radii)  # over the path
    force = face.load[0] / math.cos(face.base_helix_angle) / face.place.size
    work = (force * sliding * inside).sum() * pair.base_pitch / count
    assert mesh.sliding_work(loaded) == pytest.approx(work, rel=0.03)


RING = {
    "name": "ring",
    "teeth": 60,
    "internal": True,
    "rim_radius_mm": 72.0,
}
PINION = {"name": "pinion", "teeth": 20, "hub_radius_mm": 8.0}
WHEEL = {"name": "wheel", "teeth": 30, "hub_radius_mm": 14.0}
HALVES = {"hand": "double", "gap_mm": 4.0}


def set_of(gears, mesh, **defaults) -> dict[str, Any]:
    meshes = {"driver": "pinion", "driven": gears[1]["name"], "backlash_um": 50.0}
    return {
        "name": "set",
        "defaults": {"module_mm": 2.0, "face_width_mm": 20.0} | defaults,
        "gear": list(gears),
        "mesh": [meshes | mesh],
    }


def study(**settings) -> fegear.FlankWear:
    elements = fegear.StaticsSettings(resolution="coarse", positions=8, plane="width")
    return fegear.FlankWear(**{"elements": elements, "torque": TORQUE} | settings)


@pytest.mark.parametrize("is_ring", [False, True])
def test_the_written_topographies_are_the_worn_flanks(tmp_path, is_ring):
    """Statics of the file are those at the end; what follows begins there."""
    edits = (
        "mesh.1.misalignment_um=8",
        "mesh.1.driver_topography={bias_um=4}",
        "gear.1.worn_teeth=[{roll_angle_deg=[14,29],depth_um=[1,1]}]",
    )
    name = "liu-pair"
    if is_ring:
        name = str(tmp_path / "ring.toml")
        tables = set_of((PINION, RING), {"driven_topography": {"bias_um": 4.0}})
        (tmp_path / "ring.toml").write_text(toml_text(tables), "utf-8")
        edits = ("mesh.1.misalignment_um=8",)
    ref = type(study().gear_set)(name=name, edits=edits)
    result = fegear.run(study(gear_set=ref, cycles=2e7, steps=2))
    path = tmp_path / "worn.toml"
    result.more_files["gears"](path)
    again = fegear.run(study(gear_set=str(path), cycles=1e-3))
    before, after = again.worn.first.key_figures, result.worn.last.key_figures
    for name in ("ste_peak_to_peak_um", "load_distribution_factor", "ste_mean_um"):
        assert before[name] == pytest.approx(after[name], rel=1e-3)
    assert result.worn.lost.max() > 3e-7
    rows = result.table.rows()
    assert len(list(rows)) == result.worn.depth.size


def test_aligned_gears_wear_as_in_the_plane():
    """A lead of 1e-9 m makes slices; sections apart from the ends are plane."""
    lead = ("mesh.1.lead={crowning_um=1e-3}",)
    ref = type(study().gear_set)(name="liu-pair", edits=lead)
    faces, plane = (
        fegear.run(study(gear_set=gears, cycles=1e6, steps=2))
        for gears in (ref, "liu-pair")
    )
    middle = faces.worn.depth.shape[-1] // 2
    depth = faces.worn.depth[..., middle]
    deviation = np.abs(depth - plane.worn.depth).max() / plane.worn.depth.max()
    assert deviation < 0.05


@pytest.mark.parametrize(
    ("gears", "mesh", "positions", "message"),
    [
        ((PINION | HALVES, WHEEL | HALVES), {}, 8, 'hand = "double"; worn flanks have'),
        ((PINION, WHEEL), {"misalignment_um": 5.0}, 200, "a topography of 3.. points"),
    ],
)
def test_what_worn_flanks_cannot_be_is_refused(
    gears, mesh, positions, message, tmp_path, monkeypatch
):
    def fail(*_arguments, **_options):
        raise AssertionError("something was computed")

    monkeypatch.setattr("fegear.elasticity.cache.cached_arrays", fail)
    helix = {"helix_angle_deg": 20.0} if "hand" in gears[0] else {}
    tables = set_of(gears, mesh, **helix)
    path = tmp_path / "set.toml"
    path.write_text(toml_text(tables), "utf-8")
    elements = fegear.StaticsSettings(
        resolution="coarse", positions=positions, plane="width"
    )
    with pytest.raises(InputError, match=message):
        fegear.run(study(gear_set=str(path), elements=elements))
