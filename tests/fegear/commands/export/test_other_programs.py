"""Gear sets as objects of other programs, by those that are installed."""

from __future__ import annotations

import builtins
import importlib

import numpy as np
import pytest

import fegear
from fegear.files.errors import InputError
from fegear.files.templates import template_text
from lumped.train.modes import natural_modes

COARSE = fegear.LumpedModel(
    number=1,
    damping_ratio=0.03,
    excitation=fegear.ExcitationSettings(kind="rectangular"),
)
EXTRA = {
    "gear.1.coupling_stiffness_Nm_per_rad": 2e4,
    "gear.2.coupling_stiffness_Nm_per_rad": 3e4,
}


RING = """
name = "ring"
[defaults]
module_mm = 2.0
face_width_mm = 20.0
[[gear]]
name = "pinion"
teeth = 24
hub_diameter_mm = 20.0
inertia_kg_m2 = 1e-4
[[gear]]
name = "ring"
teeth = 70
internal = true
addendum_mm = 1.6
rim_radius_mm = 85.0
inertia_kg_m2 = 2e-2
[[mesh]]
driver = "pinion"
driven = "ring"
backlash_um = 50.0
mean_stiffness_N_per_m = 4e8
"""


def frequencies(assembly) -> np.ndarray:
    squares, _ = assembly.undamped_modal_analysis()
    return np.sqrt(np.clip(np.sort(np.real(squares)), 0.0, None)) / (2.0 * np.pi)


@pytest.mark.parametrize("edits", [{}, EXTRA], ids=["free", "to-ground"])
@pytest.mark.parametrize("name", ["liu-pair", "liu-idler", "liu-countershaft", "ring"])
def test_opentorsion_has_the_frequencies_about_averages_of_model_1(name, edits):
    opentorsion = pytest.importorskip("opentorsion")
    gears = gear_set(name, edits)
    assembly = fegear.to_opentorsion(gears, 100.0, COARSE)
    assert isinstance(assembly, opentorsion.Assembly)
    model = fegear.LumpedModel(number=1, excitation=COARSE.excitation)
    system = fegear.lumped_system(gears, 100.0, model)
    modes = natural_modes(system.train, list(system.modes.mean_stiffness))
    ours = modes.frequency_Hz
    theirs = frequencies(assembly)
    assert theirs.size == ours.size
    held = ours > 0.0
    np.testing.assert_allclose(theirs[held], ours[held], rtol=1e-6)


def gear_set(name, edits):
    if name == "ring":
        return fegear.read_gear_set(RING, edits=edits)
    return fegear.load_gear_set(name, edits)


def test_a_damped_pair_has_its_damping_ratio():
    pytest.importorskip("opentorsion")
    assembly = fegear.to_opentorsion(fegear.load_gear_set("liu-pair"), 100.0, COARSE)
    mass, stiffness = assembly.M, assembly.K
    damping = assembly.C
    squares, shapes = np.linalg.eig(np.linalg.solve(mass, stiffness))
    shape, omega = shapes[:, np.argmax(squares)], np.sqrt(squares.max())
    modal = shape @ mass @ shape
    ratio = (shape @ damping @ shape) / (2.0 * omega * modal)
    assert ratio == pytest.approx(0.03, rel=1e-9)


def test_the_middle_load_case_is_the_torque_unless_given():
    pytest.importorskip("opentorsion")
    gears = fegear.load_gear_set("liu-pair")
    cases = gears.meshes[0].torques
    one, other = (
        frequencies(fegear.to_opentorsion(gears, torque))
        for torque in (None, cases[len(cases) // 2])
    )
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("make", [fegear.to_opentorsion, fegear.to_ross])
def test_what_other_programs_have_not_is_refused(make, monkeypatch):
    monkeypatch.setattr(
        "fegear.commands.export.other_programs.import_module", lambda name: builtins
    )
    planetary = fegear.read_gear_set(template_text("planetary"))
    with pytest.raises(InputError, match=r"carrier|one mesh"):
        make(planetary, 100.0)


def test_a_package_that_is_missing_is_named(monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr("fegear.commands.export.other_programs.import_module", missing)
    gears = fegear.load_gear_set("liu-pair")
    with pytest.raises(InputError, match="pip install ross-rotordynamics"):
        fegear.to_ross(gears)


@pytest.mark.skipif(
    importlib.util.find_spec("ross") is None, reason="ROSS is not installed"
)
def test_ross_has_the_table_and_frequency_of_a_pair():
    gears = fegear.load_gear_set("liu-pair")
    train = fegear.to_ross(gears, 100.0)
    table = fegear.solve_mesh(
        gears,
        torques_on_driver=[100.0],
        settings=fegear.StaticsSettings(estimate_error=False),
    ).table["stiffness_N_per_m"][0]
    np.testing.assert_allclose(train.mesh.stiffness_range[:-1], table, rtol=1e-12)
    disks = fegear.lumped_system(gears, 100.0, fegear.LumpedModel(number=1)).train.gears
    mobility = sum(disk.base_radius**2 / disk.inertia for disk in disks)
    expected = np.sqrt(table.mean() * mobility) / (2.0 * np.pi)
    frequency_Hz = train.run_modal(0.0).wn / (2.0 * np.pi)
    assert np.abs(frequency_Hz / expected - 1.0).min() < 1e-3
