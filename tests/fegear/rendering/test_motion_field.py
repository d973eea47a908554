"""Fields of gears in motion: loads of the instant, and gears that stand apart."""

from __future__ import annotations

import numpy as np
import pytest
from cli_commands import printed
from conftest import SMALL_HUBS

from fegear.contact.loads import patch_loads
from fegear.contact.solve import solve_cycle
from fegear.gearset import load_gear_set
from fegear.rendering.fields import contact_field, mesh_scene
from fegear.rendering.mesh_scene import MeshScene
from fegear.rendering.motion_field import instant_field, pair_load
from fegear.rendering.recorded import Instant, mesh_motion, read_history
from fegear.statics.settings import StaticsSettings
from meshes.profile import flank_frame

TORQUE = 100.0  # N m


@pytest.fixture(scope="module")
def scene(compliance_cache) -> MeshScene:
    return mesh_scene(load_gear_set("liu-pair", SMALL_HUBS), 0, StaticsSettings())


@pytest.fixture(scope="module")
def mirrored(compliance_cache) -> MeshScene:
    """Its driver turns clockwise, and there is friction."""
    settings = StaticsSettings(friction=0.1)
    return mesh_scene(load_gear_set("liu-idler"), 1, settings)


def instant(position, ste, loads) -> Instant:
    return Instant(1600.0, "up", 0.0, position, ste, loads)


@pytest.mark.parametrize("position", [0.0, 0.3, 0.62])
def test_a_pair_alone_carries_its_load_as_in_the_whole_contact(scene, position):
    for whole in patch_loads(scene.problem, TORQUE, position):
        load = whole.normal.sum() * scene.problem.face_width
        alone = pair_load(scene.problem, whole.tooth, position, load)
        assert alone.normal.sum() == pytest.approx(whole.normal.sum(), rel=1e-9)
        for name in ("driver_arcs", "driven_arcs"):
            centers = [patch.normal @ getattr(patch, name) for patch in (alone, whole)]
            assert centers[0] == pytest.approx(centers[1], rel=1e-3)


def test_gears_in_steady_motion_are_those_at_rest(scene):
    """Static loads and transmission error give the static fields."""
    view = scene.view("contact", 1.6)
    rest = contact_field(scene, TORQUE, 0.4, view)
    loads = {(pair.tooth, False): pair.load for pair in rest.pairs}
    moving = instant_field(scene, instant(0.3, rest.ste, loads), 0.1, view)
    assert moving.position == pytest.approx(0.4)
    for one, other in zip(moving.gears, rest.gears, strict=True):
        # pairs alone have nodes of their own: elements that are not refined compare
        same = min(len(one.points), len(other.points), 500)
        largest = np.abs(other.displacement).max()
        np.testing.assert_allclose(
            one.displacement[:same], other.displacement[:same], atol=1e-3 * largest
        )
    moving_loads = {(pair.tooth, False): pair.load for pair in moving.pairs}
    assert moving_loads == pytest.approx(loads)


@pytest.mark.parametrize(("name", "lost"), [("scene", 5e-6), ("mirrored", 2e-6)])
def test_flanks_without_load_are_apart_by_their_gap(name, lost, request):
    """Of points that touch on the line of action, the driver's has gone back."""
    scene = request.getfixturevalue(name)
    field = instant_field(scene, instant(0.2, -lost, {}), 0.0, scene.view("tooth", 1.6))
    assert field.pairs == ()
    assert all(not gear.stress.any() for gear in field.gears)
    pair = scene.mesh.pair
    roll = pair.pitch_point + 0.2 * pair.base_pitch
    arc = 0.5 * (pair.driver.tip_roll_length**2 - roll**2) / pair.driver.base_radius
    flank, inward = flank_frame(pair.driver, np.array([arc]))
    frame = scene.frame("driver", 0.2)
    (x, y), normal = frame.places(flank)[0] - frame.center, -frame.vectors(inward)[0]
    turn = -scene.sense * lost / pair.driver.base_radius
    assert turn * np.array([-y, x]) @ normal == pytest.approx(-lost, abs=1e-12)
    gear = field.gears[0]
    np.testing.assert_allclose(
        gear.motion, turn * (gear.points - gear.center)[:, ::-1] * [-1, 1], atol=1e-15
    )


@pytest.mark.parametrize(("name", "position"), [("scene", 0.1), ("mirrored", 0.45)])
def test_back_flanks_touch_where_the_backlash_is_used_up(name, position, request):
    """Loaded points of both gears, moved as drawn, are in the same place."""
    scene = request.getfixturevalue(name)
    cycle = solve_cycle(scene.problem, [-TORQUE], [position])
    ste = float(cycle.ste[0, 0])
    loads = {
        (int(k), True): float(-load)
        for k, load in zip(cycle.teeth, cycle.load[0, 0], strict=True)
        if load
    }
    moment = instant(position, ste, loads)
    assert moment.back
    field = instant_field(scene, moment, 0.0, scene.view("contact", 1.6))
    assert sum(pair.load for pair in field.pairs) == pytest.approx(-moment.force)
    assert {pair.tooth for pair in field.pairs} == {k for k, _ in loads}
    tops = []
    for pair in field.pairs:
        top = int(pair.pressure.argmax())
        tops.append(pair.points[top] + pair.motion[top])
        driven = field.gears[1].points + field.gears[1].motion
        # a node's distance; the backlash is ten times that
        assert np.hypot(*(driven - tops[-1]).T).min() < 6e-5
    for gear in field.gears:
        node = int(gear.von_mises.argmax())
        peak = gear.points[node] + gear.motion[node]
        assert min(np.hypot(*(peak - top)) for top in tops) < 0.3e-3


def test_loads_and_pressures_are_those_of_the_history(tmp_path, compliance_cache):
    """A motion that loses contact, as `fegear dynamics` writes it."""
    command = "dynamics liu-idler --torque 100 --speeds 1600 --direction up --history"
    options = "--fidelity quasistatic --resolution coarse"
    printed(*command.split(), tmp_path, *options.split())
    gear_set = load_gear_set("liu-idler")
    file = read_history(next(tmp_path.iterdir()))
    settings = StaticsSettings(resolution="coarse")
    second_mesh = mesh_scene(gear_set, 1, settings)
    motion = mesh_motion(file, gear_set, 1)
    np.testing.assert_allclose(
        motion.force[:-1], file.column("mesh2_force_N")[:-1], rtol=1e-9, atol=1e-6
    )
    unloaded_count = 0
    for row in range(0, motion.rows, 8):
        moment = motion.at(row)
        unloaded_count += not moment.loads
        for (tooth, _), load in moment.loads.items():
            patches = pair_load(second_mesh.problem, tooth, moment.position, load)
            assert (
                patches.normal.sum() * second_mesh.problem.face_width
                == pytest.approx(load)
            )
            peak = file.column(f"mesh2_pair{tooth}_pressure_Pa")[row]
            if patches.driver_arcs.min() > 0.0 and patches.driven_arcs.min() > 0.0:
                pressure = (patches.normal / patches.step).max()
                assert pressure == pytest.approx(peak, rel=5e-2)
    assert unloaded_count > 2
