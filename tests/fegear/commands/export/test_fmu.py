"""A gear mesh as an FMU: its forces are those of the lumped model it comes from."""

from __future__ import annotations

import json
import math
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fegear
from fegear.files.errors import InputError
from fegear.gearset import make_gear_set
from lumped.train.excitation import MeshExcitation, PairExcitation
from lumped.train.waves import wave_from_samples

pytest.importorskip("pythonfmu")
from fegear.commands.export.fmu.gear_mesh import (
    INPUTS,
    OUTPUTS,
    PARAMETERS,
    GearMeshUnit,
    wave_value,
)
from fegear.commands.export.fmu.unit_file import FmuMesh, wave_data, write_fmu

BACKLASH, DAMPING = 50e-6, 800.0  # m, N s/m


def random_mesh(seed: int = 1, backlash: float = BACKLASH) -> FmuMesh:
    """Two tooth pairs, of which every third one has another gap."""
    rng = np.random.default_rng(seed)
    pairs = [
        PairExcitation(
            wave_from_samples(rng.uniform(1e8, 2e8, 16), 1),
            wave_from_samples(rng.uniform(0.0, 3e-6, 48), 3),
            ahead,
        )
        for ahead in (0, -1)
    ]
    return FmuMesh(
        MeshExcitation(tuple(pairs), 3e8),
        38,
        (0.045, 0.066),
        backlash,
        DAMPING,
        0.3,
        "",
    )


def running(mesh: FmuMesh, folder) -> GearMeshUnit:
    """The program of the FMU, as the loader starts it."""
    (folder / "mesh.json").write_text(json.dumps(mesh.data))
    return GearMeshUnit(instance_name="mesh", resources=str(folder))


def lumped_force(mesh: FmuMesh, position: float, deflection: float) -> float:
    """Drive side k (s - g), back side k (s - g + b), of every pair."""
    total = 0.0
    for pair in mesh.excitation.pairs:
        k, pressed = pair.stiffness(position), deflection - pair.gap(position)
        total += k * (max(pressed, 0.0) + min(pressed + mesh.backlash, 0.0))
    return float(total)


@given(
    st.floats(-50.0, 500.0),
    st.floats(-2.0 * BACKLASH, BACKLASH),
    st.floats(-1.0, 1.0),
)
@settings(max_examples=60, deadline=None)
def test_torques_are_those_of_the_springs_and_the_damper(tmp_path_factory, a, s, rate):
    mesh = random_mesh()
    fmu = running(mesh, tmp_path_factory.mktemp("fmu"))
    one, two = mesh.base_radii
    fmu.driver_angle, fmu.driven_angle = a, (one * a - s) / two
    fmu.driver_speed, fmu.driven_speed = 7.0, (one * 7.0 - rate) / two
    position = 38 * a / (2.0 * math.pi) + 0.3
    force = lumped_force(mesh, position, fmu.deflection)
    assert fmu.position == pytest.approx(position, rel=1e-12)
    assert fmu.deflection == pytest.approx(s, abs=1e-12)
    assert fmu.mesh_force == pytest.approx(force, rel=1e-9, abs=1e-6)
    line = force + DAMPING * rate
    torques = [fmu.driver_torque, fmu.driven_torque]
    assert torques == pytest.approx([-one * line, two * line], rel=1e-9, abs=1e-6)


def test_without_backlash_nothing_presses_the_back_sides(tmp_path):
    fmu = running(random_mesh(backlash=math.inf), tmp_path)
    fmu.driven_angle = 1.0
    assert fmu.deflection < 0.0
    assert fmu.mesh_force == 0.0


@pytest.mark.parametrize("pitches", [1, 4])
def test_a_wave_has_the_values_of_the_lumped_models(pitches):
    rng = np.random.default_rng(4)
    wave = wave_from_samples(rng.normal(size=12 * pitches), pitches)
    data = json.loads(json.dumps(wave_data(wave)))
    inside = rng.uniform(-9.0, 9.0, 100)
    for position in [*inside, *np.arange(-24, 60) / 12.0, 3.0 - 1e-14]:
        expected = float(wave(position))
        assert wave_value(data, float(position)) == pytest.approx(expected, abs=1e-12)


def test_the_archive_describes_its_variables_with_units(tmp_path):
    path = tmp_path / "mesh.fmu"
    write_fmu(path, random_mesh())
    first = path.read_bytes()
    write_fmu(path, random_mesh())
    assert path.read_bytes() == first
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert "resources/mesh.json" in names
    assert "binaries/linux64/GearMesh.so" in names
    assert not [name for name in names if name.endswith((".pkl", ".pyc"))]
    variables = {v.attrib["name"]: v for v in root.iter("ScalarVariable")}
    declared = {**INPUTS, **PARAMETERS, **OUTPUTS}
    assert {name: v.attrib["description"] for name, v in variables.items()} == {
        name: words for name, (_, words) in declared.items()
    }
    units = {name: v[0].attrib["unit"] for name, v in variables.items()}
    assert units == {name: unit for name, (unit, _) in declared.items()}
    assert {u.attrib["name"] for u in root.iter("Unit")} == set(units.values())
    damping = variables["damping"][0].attrib["start"]
    assert float(damping) == DAMPING


def test_other_meshes_are_told_apart(tmp_path):
    """By the identifier that a simulating program compares."""
    for seed in (1, 2):
        write_fmu(tmp_path / f"{seed}.fmu", random_mesh(seed))
    assert len({identifier(tmp_path / f"{seed}.fmu") for seed in (1, 2)}) == 2


def identifier(path) -> str:
    with zipfile.ZipFile(path) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    return root.attrib["guid"]


def test_the_program_needs_the_standard_library_alone():
    """And its loader, which is in the archive."""
    import ast
    import sys

    from fegear.commands.export.fmu.unit_file import PROGRAM

    nodes = [*ast.walk(ast.parse(PROGRAM.read_text()))]
    modules = {n.module for n in nodes if isinstance(n, ast.ImportFrom)}
    modules |= {a.name for n in nodes if isinstance(n, ast.Import) for a in n.names}
    assert modules - set(sys.stdlib_module_names) <= {"pythonfmu"}


def coarse_export(**changes):
    source = fegear.ExcitationSettings(positions=16, resolution="coarse")
    study = fegear.ModelExport(gear_set="liu-idler", excitation=source, **changes)
    return fegear.run(study)


def test_export_writes_the_mesh_of_a_train(tmp_path):
    result = coarse_export(torque=80.0, mesh=2)
    mesh, train = result.fmu_mesh, result.train
    driver, driven = (train.gears[i] for i in (1, 2))
    assert mesh.base_radii == (driver.base_radius, driven.base_radius)
    assert mesh.driver_teeth == driver.teeth
    assert mesh.phase == train.meshes[1].phase
    path = tmp_path / "mesh.fmu"
    result.write(path)
    with zipfile.ZipFile(path) as archive:
        data = json.loads(archive.read("resources/mesh.json"))
    assert data == json.loads(json.dumps(mesh.data))
    assert "liu-idler, mesh 2" in data["description"]
    saved = tmp_path / "r.nc"
    result.save(saved)
    assert fegear.load(saved).fmu_mesh.data == mesh.data


PLANET = {"name": "planet", "teeth": 36, "hub_radius_mm": 20.0}
RING = {"name": "ring", "teeth": 96, "internal": True, "rim_radius_mm": 108.0}


@pytest.mark.parametrize("driver", [0, 1])
def test_a_ring_turns_and_is_loaded_in_the_sense_of_its_mate(tmp_path, driver):
    """Angles in the ratio of teeth deflect nothing, whichever gear drives."""
    gears = [PLANET, RING]
    one, two = (gears[n]["name"] for n in (driver, 1 - driver))
    teeth = gears[driver]["teeth"], gears[1 - driver]["teeth"]
    pair = make_gear_set(
        {
            "name": "planet-ring",
            "defaults": {"module_mm": 2.0, "face_width_mm": 20.0},
            "gear": gears,
            "mesh": [{"driver": one, "driven": two, "center_distance_mm": 60.0}],
            "load": {"gear": one, "torques_Nm": [100.0]},
        }
    )
    source = fegear.ExcitationSettings(positions=16, resolution="coarse")
    study = fegear.ModelExport(gear_set=pair, mesh=1, excitation=source)
    fmu = running(fegear.run(study).fmu_mesh, tmp_path)
    fmu.driver_angle, fmu.driven_angle = 0.3, 0.3 * teeth[0] / teeth[1]
    assert fmu.deflection == pytest.approx(0.0, abs=1e-15)
    fmu.driver_angle += 3e-6 / fmu.radii[0]
    assert fmu.mesh_force > 100.0
    assert fmu.driver_torque < 0.0 < fmu.driven_torque
    ratio = -fmu.driven_torque / fmu.driver_torque
    assert ratio == pytest.approx(teeth[1] / teeth[0], rel=1e-9)


def test_damping_of_a_pair_is_that_of_its_matrices():
    source = fegear.ExcitationSettings(positions=16, resolution="coarse")
    study = {"gear_set": "liu-pair", "stiffness": "fe", "excitation": source}
    result = fegear.run(fegear.ModelExport(mesh=1, **study))
    row, matrix = result.arrays["mesh_vectors"][0], result.arrays["C"]
    expected = matrix[0, 0] / row[0] ** 2
    # the mean of few positions of an FMU against that of the matrices
    assert result.fmu_mesh.damping == pytest.approx(expected, rel=5e-3)


def test_an_ending_that_does_not_fit_is_refused(tmp_path, monkeypatch):
    whole = fegear.ModelExport(gear_set="liu-pair")
    with pytest.raises(InputError, match=r"an \.fmu needs mesh, others have all"):
        fegear.run(whole).write(tmp_path / "m.fmu")
    one = coarse_export(mesh=1)
    with pytest.raises(InputError, match=r"an \.fmu needs mesh, others have all"):
        one.write(tmp_path / "m.mat")
    with pytest.raises(InputError, match="mesh = 3; liu-idler has 2 meshes"):
        coarse_export(mesh=3)
    monkeypatch.setattr("fegear.files.output.has_package", lambda name: False)
    with pytest.raises(InputError, match=r"pip install 'fegear\[fmu\]'"):
        one.write(tmp_path / "m.fmu")
    assert not [*tmp_path.iterdir()]


def test_a_simulating_program_accepts_it_and_gets_the_same_forces(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    mesh, path = random_mesh(), tmp_path / "mesh.fmu"
    write_fmu(path, mesh)
    assert validate_fmu(str(path)) == []
    angles = np.linspace(0.0, 1.0, 41)
    one, two = mesh.base_radii
    driven = (one * angles - 5e-6) / two
    names = ("time", "driver_angle", "driven_angle")
    dtype = [(name, float) for name in names]
    signals = np.array([*zip(angles, angles, driven, strict=True)], dtype)
    result = fmpy.simulate_fmu(
        str(path),
        stop_time=1.0,
        output_interval=1.0 / 40.0,
        input=signals,
        output=["mesh_force", "deflection", "position"],
    )
    for row in result[1:]:
        force = lumped_force(mesh, row["position"], row["deflection"])
        assert row["mesh_force"] == pytest.approx(force, rel=1e-9)
