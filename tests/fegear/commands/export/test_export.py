"""The matrices of a train that other programs read."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.linalg import eigh

import fegear
from fegear.files.errors import InputError

TRAINS = [("liu-pair", False), ("liu-idler", False), ("liu-idler", True)]


def export(name: str, translations: bool = False, **settings: object):
    study = fegear.ModelExport(gear_set=name, translations=translations, **settings)
    return fegear.run(study)


@pytest.mark.parametrize("stiffness", ["auto", "given"])
@pytest.mark.parametrize(("name", "translations"), TRAINS)
def test_eigenvalues_of_the_matrices_are_the_natural_frequencies(
    name, translations, stiffness
):
    model = export(name, translations, stiffness=stiffness).arrays
    modes = fegear.run(
        fegear.NaturalModes(
            gear_set=name, translations=translations, stiffness=stiffness
        )
    )
    expected = [mode["frequency_Hz"] for mode in modes.summary["modes"]]
    angular = np.sqrt(np.abs(eigh(model["K"], model["M"], eigvals_only=True)))
    assert angular / (2.0 * math.pi) == pytest.approx(expected, rel=1e-7, abs=1e-3)
    assert model["natural_frequency_Hz"].tolist() == expected


@pytest.mark.parametrize(("name", "translations"), TRAINS)
def test_every_mode_has_the_damping_ratio(name, translations):
    settings = {"damping_ratio": 0.07, "stiffness": "given"}
    model = export(name, translations, **settings).arrays
    values, shapes = eigh(model["K"], model["M"])
    damping = shapes.T @ model["C"] @ shapes
    expected = 2.0 * 0.07 * np.sqrt(np.abs(values))
    scale = expected.max()
    np.testing.assert_allclose(damping, np.diag(expected), atol=1e-6 * scale)


def test_a_pair_is_its_base_radii_and_its_mesh_stiffness():
    result = export("liu-pair", torque=80.0, stiffness="given")
    model, gears = result.arrays, fegear.load_gear_set("liu-pair").gears
    one, two = (gear.geometry.base_radius for gear in gears)
    stiffness = float(model["mesh_stiffness_N_per_m"][0])
    assert np.abs(model["mesh_vectors"]) == pytest.approx(np.array([[one, two]]))
    row = model["mesh_vectors"]
    np.testing.assert_allclose(model["K"], stiffness * row.T @ row, rtol=1e-12)
    assert model["static_mesh_force_N"] == pytest.approx([80.0 / one])
    assert model["load"] == pytest.approx([80.0, 80.0 * two / one])
    assert result.coordinates == [f"{gear.name} rotation" for gear in gears]


def test_stiffness_is_that_of_meshes_and_of_other_springs():
    """Meshes are taken out by their vectors; bearings alone are left, a diagonal."""
    result = export("liu-idler", translations=True, stiffness="given")
    model, gears = result.arrays, fegear.load_gear_set("liu-idler").gears
    rows, stiffness = model["mesh_vectors"], model["mesh_stiffness_N_per_m"]
    rest = model["K"] - rows.T @ (stiffness[:, None] * rows)
    places = {name: i for i, name in enumerate(result.coordinates)}
    expected = np.zeros(len(places))
    for gear in gears:
        expected[places[f"{gear.name} rotation"]] = gear.coupling_stiffness
        for axis, bearing in zip("xy", gear.bearing_stiffness or (), strict=False):
            expected[places[f"{gear.name} {axis}"]] = bearing
    np.testing.assert_allclose(rest, np.diag(expected), atol=1e-12 * stiffness.max())
    residual = model["K"] @ model["static_displacement"] - model["load"]
    assert np.abs(residual).max() < 1e-9 * np.abs(model["load"]).max()


def test_equations_about_the_loaded_state_are_those_of_the_coupled_model():
    """With masses of rigid gears, and the forces of any model at rest."""
    result = export("liu-idler", translations=True)
    model = result.arrays
    rigid = export("liu-idler", translations=True, stiffness="given").arrays
    n = rigid["M"].shape[0]
    np.testing.assert_allclose(model["M"][:n, :n], rigid["M"], atol=1e-9)
    np.testing.assert_allclose(np.diag(model["M"])[n:], 1.0, atol=0.2)
    assert "pinion body against its hub" in result.coordinates[n:]
    assert result.texts["coordinate_units"][n] == "m sqrt(kg)"
    force = model["static_mesh_force_N"]  # couplings at the ends carry a part
    assert force == pytest.approx(rigid["static_mesh_force_N"], rel=0.01)
    stiffness = model["mesh_stiffness_N_per_m"]
    rest = model["mesh_vectors"] @ model["static_displacement"]
    # hertzian flanks are softer at less load: more than force over tangent
    assert (rest > force / stiffness).all()


@pytest.mark.parametrize("stiffness", ["auto", "given"])
@pytest.mark.parametrize("ending", [".mat", ".npz", ".json"])
def test_every_file_has_the_same_numbers_and_names(tmp_path, ending, stiffness):
    result = export("liu-idler", translations=True, stiffness=stiffness)
    path = tmp_path / f"m{ending}"
    result.write(path)
    first = path.read_bytes()
    result.write(path)
    assert path.read_bytes() == first
    held = READERS[ending](path)
    for name, expected in result.arrays.items():
        actual = np.array(held[name], float).reshape(expected.shape)
        np.testing.assert_array_equal(actual, expected, name)
    for name, labels in result.texts.items():
        assert [str(label) for label in np.ravel(held[name])] == labels
    units = held["units"]
    units = dict(units) if isinstance(units, np.ndarray) else units
    assert set(units) == set(result.arrays)


def read_mat(path):
    held = loadmat(path, simplify_cells=True)
    assert loadmat(path)["load"].shape == (held["load"].size, 1)
    return held


def read_json(path):
    held = json.loads(path.read_text())
    backlash = [math.inf if v is None else v for v in held["mesh_backlash_m"]]
    return held | {"mesh_backlash_m": backlash}


READERS = {".mat": read_mat, ".npz": np.load, ".json": read_json}


def test_what_changes_nothing_is_refused(tmp_path):
    source = fegear.ExcitationSettings(plane="strain")
    with pytest.raises(InputError, match=r"^plane = strain; the gear set gives all"):
        export("liu-pair", excitation=source, stiffness="given")
    with pytest.raises(InputError, match=r"must end in \.mat, \.npz, \.json or \.fmu$"):
        export("liu-pair").write(tmp_path / "m.csv")
