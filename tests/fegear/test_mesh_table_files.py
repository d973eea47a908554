"""Mesh tables in files of other programs are read as their CSV."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import netcdf_file, savemat

import fegear
from fegear.files.errors import InputError
from fegear.statics.mesh_table_files import read_mesh_table
from lumped.common.csv_text import TableError
from lumped.train.table import format_table, parse_table

TORQUES, POSITIONS = np.array([50.0, 100.0]), np.arange(4) / 4.0
STIFFNESS = 3e8 + 1e7 * np.random.default_rng(3).standard_normal((2, 4))
STE = np.full((2, 4), 1e-5)
STE[1, 2] = np.nan
LOOKUP = {
    "torque_Nm": TORQUES,
    "position": POSITIONS,
    "stiffness_N_per_m": STIFFNESS,
    "ste_m": STE,
}
COLUMNS = {
    "torque_Nm": np.repeat(TORQUES, 4),
    "position": np.tile(POSITIONS, 2),
    "stiffness_N_per_m": STIFFNESS.ravel(),
    "ste_m": STE.ravel(),
}
TEXT = "torque_Nm;position;stiffness_N_per_m;ste_m\n" + "\n".join(
    ";".join(repr(float(v)).replace(".", ",").replace("nan", "") for v in row)
    for row in zip(*COLUMNS.values(), strict=True)
)


def require_same(path: Path, header: dict[str, str] | None = None) -> None:
    table = read_mesh_table(str(path))
    for name, values in LOOKUP.items():
        actual = getattr(table, name, None)
        actual = table[name] if actual is None else actual
        np.testing.assert_array_equal(actual, values)
    assert dict(table.header) == (header or {})


@pytest.mark.parametrize("held", [LOOKUP, COLUMNS], ids=["lookup", "columns"])
@pytest.mark.parametrize("place", ["top", "struct"])
def test_mat_files(tmp_path, held, place):
    path, more = tmp_path / "t.mat", {"teeth_of_pinion": 30.0, "author": "someone"}
    inner = held if place == "top" else {"a": {"b": {**held, "units": {"ste_m": "m"}}}}
    savemat(path, {**inner, **more}, oned_as="row")
    require_same(path, {"author": "someone"})


def test_a_decimal_comma(tmp_path):
    (tmp_path / "t.csv").write_text(TEXT)
    assert "," in TEXT
    require_same(tmp_path / "t.csv")


@pytest.mark.parametrize("held", [LOOKUP, COLUMNS], ids=["lookup", "columns"])
@pytest.mark.parametrize("ending", [".h5", ".hdf5"])
def test_hdf5_files(tmp_path, held, ending):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / f"t{ending}", "w") as file:
        group = file.create_group("mesh")
        group.attrs["teeth"] = "30 / 40"
        for name, values in held.items():
            group[name] = values
    require_same(tmp_path / f"t{ending}", {"teeth": "30 / 40"})


def test_mat_files_of_version_73(tmp_path):
    """By columns, with a class for each variable, and cells as references."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "t.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        struct = file.create_group("lookup")
        struct.attrs["MATLAB_class"] = np.bytes_(b"struct")
        for name, values in LOOKUP.items():
            store(struct, name, np.atleast_2d(values).T, b"double")
        texts = ["teeth", "30 / 40"]
        codes = [np.array([[ord(c)] for c in text], "u2") for text in texts]
        places = [
            store(file, f"#refs#/{i}", c, b"char").ref for i, c in enumerate(codes)
        ]
        cells = np.array([[place] for place in places], dtype=h5py.ref_dtype)
        store(file, "header", cells, b"cell")
    with path.open("r+b") as written:
        written.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    require_same(path, {"teeth": "30 / 40"})


def store(group: Any, name: str, values: Any, kind: bytes) -> Any:
    made = group.create_dataset(name, data=values)
    made.attrs["MATLAB_class"] = np.bytes_(kind)
    return made


def test_netcdf_files(tmp_path):
    with netcdf_file(tmp_path / "t.nc", "w") as file:
        file.createDimension("t", 2)
        file.createDimension("n", 4)
        file.createDimension("other", 7)
        file.createVariable("spare", "f8", ("other",))[:] = 1.0
        dimensions = {"torque_Nm": ("t",), "position": ("n",)}
        for name, values in LOOKUP.items():
            made = file.createVariable(name, "f8", dimensions.get(name, ("t", "n")))
            made[:] = values
    require_same(tmp_path / "t.nc")


@pytest.mark.parametrize("ending", [".mat", ".nc"])
def test_a_table_that_was_written_is_read_with_its_header(tmp_path, ending):
    elements = fegear.StaticsSettings(resolution="coarse", positions=16)
    study = fegear.MeshStiffness(torque=[100.0, 200.0], elements=elements)
    result = fegear.run(study)
    result.write(tmp_path / f"t{ending}")
    actual = read_mesh_table(str(tmp_path / f"t{ending}"))
    expected = parse_table(result.table.csv())
    assert {k: actual.header[k] for k in expected.header} == dict(expected.header)
    for name in expected.columns:
        np.testing.assert_array_equal(actual[name], expected[name])


def test_a_run_with_a_mat_file_is_that_with_its_csv(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    savemat("t.mat", LOOKUP)
    table = read_mesh_table("t.mat")
    Path("t.csv").write_text(format_table(table))
    model = fegear.LumpedModel(number=1)
    runs = [
        fegear.run(
            fegear.Theory(gear_set="liu-pair", torque=100.0, table=[name], model=model)
        )
        for name in ("t.mat", "t.csv")
    ]
    assert [*runs[0].table.rows()] == [*runs[1].table.rows()]


BAD = {
    "position": (POSITIONS[::-1], "position must increase"),
    "torque_Nm": (-TORQUES, "torque_Nm = -100; must be above 0 N m"),
    "stiffness_N_per_m": (STIFFNESS.T, r"must have a row .*, 2 x 4, got 4 x 2$"),
    "ste_m": (STE[:, :3], r"ste_m must have a row .*, 2 x 4, got 2 x 3$"),
}


@pytest.mark.parametrize("name", BAD)
def test_impossible_values_are_refused(tmp_path, name):
    values, message = BAD[name]
    savemat(tmp_path / "t.mat", {**LOOKUP, name: values})
    with pytest.raises(TableError, match=rf"t\.mat: .*{message}"):
        read_mesh_table(str(tmp_path / "t.mat"))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": np.where(POSITIONS, POSITIONS, np.nan)}, "must have finite"),
        ({"stiffness_N_per_m": 1j * STIFFNESS}, "must hold real numbers"),
        ({"stiffness_N_per_m": "soft"}, "must hold real numbers"),
    ],
)
def test_wrong_kinds_are_refused(tmp_path, changes, message):
    savemat(tmp_path / "t.mat", LOOKUP | changes)
    with pytest.raises(TableError, match=rf"t\.mat: .*{message}"):
        read_mesh_table(str(tmp_path / "t.mat"))


@pytest.mark.parametrize("ending", [".mat", ".h5", ".nc"])
def test_other_files_are_refused_in_one_line(tmp_path, ending):
    path = tmp_path / f"t{ending}"
    with pytest.raises(InputError, match=f"t{ending}: "):
        read_mesh_table(str(path))
    path.write_bytes(bytes(range(256)) * 8)
    with pytest.raises(InputError, match=f"t{ending}: is no .* file, or damaged$"):
        read_mesh_table(str(path))


def test_what_is_missing_is_named(tmp_path, monkeypatch):
    savemat(tmp_path / "t.mat", {"torque_Nm": TORQUES, "a": {"position": POSITIONS}})
    names = "the variables torque_Nm, position and stiffness_N_per_m$"
    with pytest.raises(TableError, match=names):
        read_mesh_table(str(tmp_path / "t.mat"))
    monkeypatch.setattr(
        "fegear.statics.mesh_table_files.has_package", lambda name: False
    )
    (tmp_path / "t.h5").write_bytes(b"")
    with pytest.raises(InputError, match=r"needs h5py: pip install 'fegear\[hdf5\]'$"):
        read_mesh_table(str(tmp_path / "t.h5"))
