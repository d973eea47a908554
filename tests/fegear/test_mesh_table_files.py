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
    write_mat_73(tmp_path / "t.mat")
    require_same(tmp_path / "t.mat", {"teeth": "30 / 40"})


def write_mat_73(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
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


def written_as(path: Path) -> None:
    """Files of each format, with a table in a struct or group, and texts."""
    kind = path.suffix
    if path.name.startswith("long"):
        columns = {k: np.tile(v, 3) for k, v in COLUMNS.items()}
        columns["torque_Nm"] = columns["torque_Nm"] * np.repeat([1.0, 2.5, 7.0], 8)
    else:
        columns = COLUMNS
    if kind == ".mat" and path.name.startswith("seven"):
        write_mat_73(path)
    elif kind == ".mat":
        held = {"a": {"b": {**columns, "units": "m"}}, "author": "someone"}
        savemat(path, held, do_compression=path.name.startswith("long"))
    elif kind == ".nc":
        with netcdf_file(path, "w") as file:
            file.header = b"teeth: 30 / 40"
            file.createDimension("row", len(columns["position"]))
            for name, values in columns.items():
                file.createVariable(name, "f8", ("row",))[:] = values
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            group = file.create_group("mesh")
            group.attrs["teeth"] = "30 / 40"
            options = {"compression": "gzip"} if path.name.startswith("long") else {}
            for name, values in columns.items():
                group.create_dataset(name, data=values, **options)


WRITTEN = ("t.mat", "long.mat", "seven.mat", "t.h5", "long.h5", "t.nc")


def require_table_or_refusal(path: Path) -> None:
    message = ""
    try:
        table = read_mesh_table(str(path))
    except (InputError, TableError) as error:
        message = str(error)
    else:
        assert table["stiffness_N_per_m"].shape[1] == table.position.size
    assert not message or message.startswith(f"{path}: ")
    assert "\n" not in message


def require_damage_is_refused(path: Path, seeds: range) -> None:
    """Files with a few bytes that differ, and every other one cut short."""
    written_as(path)
    content = path.read_bytes()
    for seed in seeds:
        random = np.random.default_rng(seed)
        damaged = bytearray(content)
        # headers and structures are at both ends of most files
        ends = random.integers(0, 2, 8) * max(len(damaged) - 600, 0)
        for place in random.integers(0, min(len(damaged), 600), 8) + ends:
            damaged[place] ^= int(random.integers(1, 256))
        size = len(damaged) if seed % 2 else int(random.integers(1, len(damaged)))
        path.write_bytes(damaged[:size])
        require_table_or_refusal(path)


@pytest.mark.parametrize("name", WRITTEN)
def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path, name):
    require_damage_is_refused(tmp_path / name, range(10))


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITTEN)
def test_many_damaged_files_are_read_or_refused_in_one_line(tmp_path, name):
    require_damage_is_refused(tmp_path / name, range(10, 60))


def test_links_that_lead_nowhere_and_in_circles_are_left_out(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "t.h5", "w") as file:
        file["gone"] = h5py.SoftLink("/nowhere")
        file["other"] = h5py.ExternalLink("missing.h5", "/mesh")
        file["circle"] = h5py.SoftLink("/circle")
        file["type"] = np.dtype("f8")
        itself = file.create_group("itself")
        itself["again"] = itself
        file["nothing"] = h5py.Empty("f8")
        nested = file.create_group("deep")
        for _ in range(1500):
            nested = nested.create_group("n")
        for name, values in LOOKUP.items():
            nested[name] = values
        nested.create_dataset("spare", (3,), h5py.ref_dtype)
        nested["words"] = ["a", "b"]
        nested.attrs["list"] = [1, 2, 3]
    require_same(tmp_path / "t.h5")


def test_cells_without_content_are_no_entries_of_the_header(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "t.mat"
    write_mat_73(path)
    with h5py.File(path, "r+") as file:
        del file["header"]
        cells = file.create_dataset("header", (2, 1), h5py.ref_dtype)
        cells.attrs["MATLAB_class"] = np.bytes_(b"cell")
    require_same(path)


@pytest.mark.parametrize("place", ["mesh", "other"])
def test_huge_arrays_are_refused_by_their_shape(tmp_path, place):
    """Never read: a fill value stands for 80 GB, a chunk for 3."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "t.h5"
    with h5py.File(path, "w") as file:
        for name, values in LOOKUP.items():
            file[f"mesh/{name}"] = values
        file.create_dataset(f"{place}/huge", (10**10,), "f8", chunks=(1000,))
    assert path.stat().st_size < 20_000
    if place == "other":
        return require_same(path)
    with pytest.raises(InputError, match=r"t.h5: huge has shape \(10000000000,\)"):
        read_mesh_table(str(path))
    with h5py.File(path, "w") as file:
        for name, values in COLUMNS.items():
            chunks = (4 * 10**8,) if name == "ste_m" else None
            more = {"maxshape": (None,), "chunks": chunks} if chunks else {}
            file.create_dataset(name, data=values[:0] if chunks else values, **more)
    with pytest.raises(InputError, match=r"t.h5: ste_m has shape .* 400000000"):
        read_mesh_table(str(path))


def test_a_mat_file_that_unpacks_to_too_much_is_refused(tmp_path):
    path = tmp_path / "t.mat"
    savemat(path, {"a": np.zeros(17 * 2**20)}, do_compression=True)
    assert path.stat().st_size < 200_000
    with pytest.raises(InputError, match=r"t.mat: larger than 128 MiB unpacked$"):
        read_mesh_table(str(path))


def test_a_mat_file_with_more_cells_than_bytes_is_refused(tmp_path):
    path = tmp_path / "t.mat"
    savemat(path, {"a": np.full((2, 2), 1.0, dtype=object)})
    content = path.read_bytes()
    place = content.index(np.array([2, 2], "<i4").tobytes(), 128)
    path.write_bytes(
        content[:place]
        + np.array([2**16, 2**15], "<i4").tobytes()
        + content[place + 8 :]
    )
    with pytest.raises(InputError, match=r"t.mat: is no MAT file, or damaged$"):
        read_mesh_table(str(path))


@pytest.mark.parametrize("ending", [".csv", ".mat"])
def test_a_number_far_beyond_all_is_refused_with_its_column(tmp_path, ending):
    path = tmp_path / f"t{ending}"
    columns = COLUMNS | {"stiffness_N_per_m": np.full(8, 1.7e308)}
    savemat(path, columns)
    if ending == ".csv":
        lines = [",".join(columns)]
        rows = zip(*columns.values(), strict=True)
        lines += [",".join("" if v != v else repr(float(v)) for v in r) for r in rows]
        path.write_text("\n".join(lines))
    message = r"column stiffness_N_per_m has 1.7e\+308; allowed -1e\+30 to 1e\+30$"
    with pytest.raises(TableError, match=message):
        read_mesh_table(str(path))
