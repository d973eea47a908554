"""Housings of gear sets: MAT files that are read, and those that are refused."""

from __future__ import annotations

import numpy as np
import pytest
from free_housings import HOUSINGS, STORED, two_shafts, write_housing
from scipy.io import savemat
from scipy.sparse import csc_matrix
from small_sets import BENT, HOUSED, SHAFT

import fegear
from fegear.files.toml import toml_text
from fegear.gearset.read import files_of_gear_set, load_gear_set

VALUES = {
    "stiffness": 1e8 * np.eye(12),
    "mass": np.eye(12),
    "nodes": np.array([[1.0, 2.0], [0.0, 1.0]]),
}


@pytest.fixture
def read(tmp_path):
    """The housing of a gear set beside a file with some variables."""

    def with_variables(**changes):
        values = {k: v for k, v in (VALUES | changes).items() if v is not None}
        savemat(tmp_path / "h.mat", values)
        path = tmp_path / "set.toml"
        path.write_text(toml_text(BENT | {"housing": {"file": "h.mat"}}))
        return load_gear_set(path).housing.housing

    return with_variables


@pytest.mark.parametrize("name", STORED)
def test_stored_housings_are_those_that_tests_make(tmp_path, name):
    write_housing(tmp_path / name, STORED[name]())
    assert len((tmp_path / name).read_bytes()) == len((HOUSINGS / name).read_bytes())


def test_a_file_is_read_to_the_last_bit(tmp_path):
    housing = two_shafts()
    path = tmp_path / "set.toml"
    write_housing(tmp_path / "h.mat", housing)
    path.write_text(toml_text(HOUSED | {"housing": {"file": "h.mat"}}))
    gear_set = load_gear_set(path)
    assert gear_set.housing.housing == housing
    assert hash(gear_set.housing.housing) == hash(housing)
    assert gear_set == load_gear_set(path)
    assert gear_set.housing.stated == "h.mat, 32 coordinates, 5 nodes, 4 of bearings"
    assert files_of_gear_set(str(path), {}) == [str(tmp_path / "h.mat")]
    other = load_gear_set(path, {"housing.file": str(HOUSINGS / "sensor.mat")})
    assert other != gear_set


def test_sparse_matrices_and_integers_are_taken(read):
    nodes = np.array([[1, 2], [0, 1]], dtype=np.int16)
    assert read(stiffness=csc_matrix(1e8 * np.eye(12)), nodes=nodes) == read()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"nodes": None},
            "has no variable nodes; needs stiffness, mass, nodes, has stif",
        ),
        ({"mass": "one"}, "mass is of <U3; must be a matrix of real numbers"),
        ({"mass": 1j * np.eye(12)}, "mass is of complex128; must be a matrix of real"),
        ({"nodes": np.ones((2, 3))}, "nodes is 2 x 3; must have 2 columns"),
        ({"nodes": [[1.0, 1.5]]}, "nodes row 1 = 1, 1.5; must be whole numbers"),
        ({"nodes": [[0, 1], [3, 1]]}, "nodes row 2 = 3, 1; the shaft must be 1 to 2"),
        (
            {"nodes": [[2, 3]]},
            "nodes row 1 = 2, 3; the bearing of shaft 2 must be 1 to 2",
        ),
        ({"nodes": [[2, 1], [2, 1]]}, "nodes row 1 = 2, 1; the bearing is named more"),
        (
            {"stiffness": np.eye(11)},
            "stiffness is 11 x 11; must have 6 rows for each of 2",
        ),
        ({"mass": np.diag([1.0] * 11 + [-1.0])}, "mass has an eigenvalue of -1 times"),
        (
            {"mass": np.diag([1.0] * 11 + [np.inf])},
            r"mass\(12, 12\) = inf; must be finite",
        ),
        ({"damping": np.triu(np.ones((12, 12)))}, "the matrix must be symmetric"),
    ],
)
def test_variables_that_are_refused(read, changes, message):
    with pytest.raises(fegear.InputError, match=message) as refused:
        read(**changes)
    assert 'housing: file = "h.mat"; ' in str(refused.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"MATLAB 5.0 nothing", "is no MAT file, or damaged"),
        (b"\x89HDF\r\n\x1a\n", "is HDF5; save it as version 7"),
    ],
)
def test_files_that_are_refused(tmp_path, content, message):
    (tmp_path / "h.mat").write_bytes(content)
    path = tmp_path / "set.toml"
    path.write_text(toml_text(BENT | {"housing": {"file": "h.mat"}}))
    with pytest.raises(fegear.InputError, match=message):
        load_gear_set(path)


def test_bearings_of_a_shaft_that_does_not_bend_are_refused(tmp_path):
    tables = SHAFT | {"housing": {"file": "h.mat"}}
    savemat(tmp_path / "h.mat", VALUES)
    path = tmp_path / "set.toml"
    path.write_text(toml_text(tables))
    with pytest.raises(fegear.InputError, match="bearing of shaft 1 has none"):
        load_gear_set(path)
