"""Machines in space whose bearings are in a housing, in motion."""

from __future__ import annotations

import numpy as np
import pytest
from free_housings import bearing_nodes, write_housing
from small_sets import HOUSED

import fegear
from fegear.files.toml import toml_text
from fegear.gearset import read_gear_set
from fegear.train.model_settings import LumpedModel
from fegear.train.rotors import rotor_system
from lumped.rotors.housing import Housing

ON_GROUND = {name: value for name, value in HOUSED.items() if name != "housing"}
COARSE = fegear.ExcitationSettings(resolution="coarse", plane="width")


@pytest.fixture
def set_file(tmp_path):
    def write(tables, housing=None):
        if housing is not None:
            write_housing(tmp_path / "h.mat", housing)
            tables = tables | {"housing": {"file": "h.mat"}}
        path = tmp_path / "set.toml"
        path.write_text(toml_text(tables))
        return str(path)

    return write


def modes_of(path):
    study = fegear.NaturalModes(
        gear_set=path, motion="space", torque=20.0, excitation=COARSE
    )
    return fegear.run(study)


def test_a_stiff_housing_without_mass_is_ground(set_file):
    """Its coordinates have no mass, and are none of the reduced machine."""
    on_ground = modes_of(set_file(ON_GROUND)).modes.frequency_Hz
    system = rotor_system(read_gear_set(toml_text(ON_GROUND)), [1e8], 3)
    nodes = bearing_nodes(system)
    errors = []
    for factor in (1e3, 1e4):
        values = np.tile(factor * np.array([5e7, 5e7, 5e7, 1e4, 1e4, 1e4]), len(nodes))
        stiff = Housing(
            stiffness=np.diag(values), mass=np.zeros((values.size,) * 2), nodes=nodes
        )
        housed = modes_of(set_file(ON_GROUND, stiff)).modes.frequency_Hz
        errors.append(np.abs(housed[1:12] / on_ground[1:12] - 1.0).max())
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)


def test_modes_are_those_of_the_campbell_diagram_at_rest(set_file):
    path = set_file(HOUSED)
    result = modes_of(path)
    diagram = fegear.CampbellDiagram(
        gear_set=path,
        motion="space",
        stiffness="fe",
        torque=20.0,
        excitation=COARSE,
        points=2,
        max_rpm=1.0,
    )
    at_rest = np.sort(fegear.run(diagram).curves.frequency_Hz[0])
    modes = result.modes.frequency_Hz
    for frequency in at_rest[np.isfinite(at_rest)][:8]:
        assert np.abs(modes / frequency - 1.0).min() < 5e-3
    moving = result.shares.kinetic["housing"]
    assert moving.max() > 0.5
    assert not any("W70" in line for line in result.summary["warnings"])


def test_sensors_are_on_the_housing(set_file):
    path = set_file(HOUSED)
    model = LumpedModel(motion="space", excitation=COARSE)
    study = fegear.Signals(
        gear_set=path, speed=1500.0, torque=20.0, turns=1, samples=16, model=model
    )
    result = fegear.run(study)
    names = result.table.names
    on_nodes = [name for name in names if name.startswith("housing_node")]
    assert len(on_nodes) == 15
    columns = np.array(list(result.table.rows()), float)
    values = dict(zip(names, columns.T, strict=True))
    for name in on_nodes:
        assert np.std(values[name]) > 0.0, name
    # mean forces on bearings hold the gears against each other
    means = [np.mean(v) for n, v in values.items() if n.endswith("_x_N")]
    # but for harmonics of the mesh that 16 samples of a cycle take for the mean
    assert abs(sum(means)) < 1e-3 * max(map(abs, means))
