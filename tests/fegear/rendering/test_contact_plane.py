"""Pressure and stress beside a contact are those of Hertz in plane strain."""

from __future__ import annotations

import numpy as np
import pytest

from fegear import InputError, StaticsSettings, load_gear_set, make_gear_set, solve_mesh
from fegear.contact.loads import patch_loads
from fegear.elasticity.body_stress import von_mises
from fegear.rendering.fields import contact_field, mesh_scene
from fegear.rendering.loaded_gears import LoadedGear, LoadedMesh, MeshSide
from fegear.rendering.mesh_scene import RelativePose
from meshes.profile import flank_frame
from validation.commands.validate.random_sets.generator import draw_pair, draw_torque
from validation.oracles import hertz

SEED, PAIRS, QUICK = 57, 20, 2
CASES = [
    pytest.param(number, plane, marks=[pytest.mark.slow] * (number >= QUICK))
    for number in range(PAIRS)
    for plane in ("stress", "strain")
]


def random_pair(number: int):
    """A pair of random teeth, widths and reliefs, and its torque [N m]."""
    rng = np.random.default_rng([SEED, number])
    while True:
        try:
            gear_set = make_gear_set(draw_pair(rng) | {"name": f"pair {number}"})
            return gear_set, draw_torque(gear_set, rng)
        except InputError:
            continue


def largest_von_mises(ratio: float) -> float:
    """Below a Hertzian line contact, over its largest pressure (Johnson, eq. 4.46)."""
    z = np.linspace(0.0, 2.0, 20_001)  # over the half-width
    root = np.sqrt(1.0 + z**2)
    x, y = -((1.0 + 2.0 * z**2) / root - 2.0 * z), -1.0 / root
    out = ratio * (x + y)
    squares = (x - y) ** 2 + (y - out) ** 2 + (out - x) ** 2
    return float(np.sqrt(0.5 * squares).max())


def hertz_pressure(gear_set, load: float) -> float:
    """At the pitch point of a pair in plane strain [Pa]; load : [N/m]."""
    mesh = gear_set.meshes[0]
    first, second = (
        hertz.Material(gear.young_modulus, gear.poisson_ratio)
        for gear in (gear_set.gears[index] for index in mesh.gears)
    )
    arm = mesh.pair.pitch_point
    radius = hertz.effective_radius(arm, mesh.pair.line_of_action - arm)
    modulus = hertz.effective_modulus(first, second, "strain")
    return float(hertz.peak_pressure(load, radius, modulus))


@pytest.mark.parametrize(("number", "plane"), CASES)
def test_random_pairs_at_the_pitch_point(number, plane):
    gear_set, torque = random_pair(number)
    scene = mesh_scene(gear_set, 0, StaticsSettings(plane=plane))
    field = contact_field(scene, torque, 0.0, scene.view("contact", 1.6))
    pair = next(pair for pair in field.pairs if pair.tooth == 0)
    if pair.has_edge:
        pytest.skip("an edge is in contact, whose pressure has no limit")
    expected = hertz_pressure(gear_set, pair.load / scene.problem.face_width)
    assert pair.pressure.max() == pytest.approx(expected, rel=0.01)
    for gear, index in zip(field.gears, gear_set.meshes[0].gears, strict=True):
        ratio = gear_set.gears[index].poisson_ratio
        half_plane, whole = below_contact(scene, torque, index, ratio)
        share = largest_von_mises(ratio)
        assert half_plane == pytest.approx(share * expected, rel=0.02)
        # the tooth is no half-plane: it is pulled along its flank by the load
        assert share * expected < whole < 1.2 * share * expected
        beside = np.hypot(*(gear.points - pair.center).T) < 0.2 * scene.module
        assert gear.von_mises[beside].max() == pytest.approx(whole, rel=0.02)


def below_contact(scene, torque: float, index: int, ratio: float):
    """Largest von Mises stress in plane strain on the normal through the pitch point:
    of the half-plane under the contact load, and of the whole tooth [Pa]."""
    loads = patch_loads(scene.problem, torque, 0.0)
    role = ("driver", "driven")[scene.mesh.gears.index(index)]
    side = MeshSide(LoadedMesh(scene, RelativePose(0.0, 0.0), loads), role)
    sectors = LoadedGear((side,)).sectors()
    sector = next(one for one in sectors if one.tooth == 0)
    (load,) = sector.loads
    center = load.arcs @ load.normal / load.normal.sum()
    place, inward = flank_frame(sector.body.sector.gear, np.array([center]))
    pressure = (load.normal / load.step).max()
    half_width = 2.0 * load.normal.sum() / (np.pi * pressure)
    points = place + np.linspace(0.3, 1.3, 101)[:, None] * half_width * inward
    largest = []
    for stress in (sector.local(points)[:, 2:], sector.at(points)[:, 2:]):
        out_of_plane = ratio * stress[:, :2].sum(axis=1)
        largest.append(float(von_mises(stress, out_of_plane).max()))
    return largest


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_both_planes_are_in_the_summary(plane):
    """Rating programs print plane strain; the ratio is the root of 1 - nu^2."""
    gear_set = load_gear_set("liu-pair")
    settings = StaticsSettings(plane=plane, positions=8, estimate_error=False)
    solved = solve_mesh(gear_set, 1, [100.0], settings)
    values = solved.key_figures[0]
    for name in ("pressure_at_pitch_point", "max_pressure"):
        strain, stress = (values[f"{name}_plane_{p}_MPa"] for p in ("strain", "stress"))
        assert stress / strain == pytest.approx(np.sqrt(1.0 - 0.3**2), rel=1e-12)
    number = int(solved.table.position.searchsorted(values["max_pressure_at_position"]))
    column = solved.table["max_pressure_Pa"][0, number]
    assert values["max_pressure_plane_strain_MPa"] == 1e-6 * column
