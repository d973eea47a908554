"""Saved results: what is loaded, and what is refused."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from scipy.io import netcdf_file

import fegear
from fegear.files.errors import InputError
from fegear.files.netcdf import read_netcdf, write_netcdf
from fegear.studies import saving


@pytest.fixture(scope="module")
def result():
    model = fegear.LumpedModel(
        number=1, excitation=fegear.ExcitationSettings(kind="rectangular")
    )
    study = fegear.Sweep(
        gear_set="liu-pair", torque=[100.0], speeds=[2000.0, 2100.0], model=model
    )
    return fegear.run(study)


@pytest.fixture
def file(result, tmp_path):
    result.save(tmp_path / "sweep.nc")
    return tmp_path / "sweep.nc"


def test_a_loaded_result_is_one_of_its_kind(result, file):
    loaded = fegear.load(file)
    assert isinstance(loaded, type(result))
    assert loaded.study == result.study
    assert repr(loaded) == repr(result)
    assert loaded.summary == result.summary
    assert loaded.table.csv() == result.table.csv()
    ours, theirs = (r.branches[0][1].responses for r in (loaded, result))
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one.dte_rms, other.dte_rms)


def test_a_loaded_result_is_saved_again_to_the_byte(file, tmp_path):
    fegear.load(file).save(tmp_path / "again.nc")
    assert (tmp_path / "again.nc").read_bytes() == file.read_bytes()


def test_columns_are_variables_for_other_programs(result, file):
    values = zip(*result.table.rows(), strict=True)
    columns = dict(zip(result.table.names, values, strict=True))
    with netcdf_file(file, mmap=False) as content:
        for name in ("mesh_frequency_Hz", "mesh", "dte_rms_m"):
            np.testing.assert_array_equal(content.variables[name][:], columns[name])
        assert content.command == b"sweep"


@pytest.mark.parametrize("name", ["sweep", "sweep.csv"])
def test_the_ending_says_what_the_file_is(result, tmp_path, name):
    with pytest.raises(InputError, match=r"the name of a saved result ends with \.nc$"):
        result.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def edited(file, change):
    attributes, variables = read_netcdf(file)
    tree = json.loads(attributes["result"])
    change(attributes, tree)
    attributes["result"] = json.dumps(tree)
    rows = {n: saving.Variable(v, f"{n}_size") for n, v in variables.items()}
    write_netcdf(file, attributes, rows)


@pytest.mark.parametrize(
    "name",
    [
        "os:system",
        "fegear.commands.sweep.study:Gone",
        "fegear.gone:Sweep",
        "lumped:Wave",
    ],
)
def test_what_this_version_does_not_know_is_said_in_a_line(file, name):
    edited(file, lambda _, tree: tree.update({"class": name}))
    message = f"{file}: was saved by fegear 0.1.0, whose results fegear 0.1.0 cannot"
    with pytest.raises(InputError, match=f"^{re.escape(message)} load$"):
        fegear.load(file)


FORGED = {
    "a circle": {"tuple": [{"see": 0}]},
    "a place that is none": {"tuple": [{"see": 10**6}]},
    "no fraction": {"tuple": [{"fraction": [1, 0]}]},
    "records of 80 GB": {
        "records": {"names": ["a"], "formats": [["<f8", []]], "offsets": [0]},
        "fields": {"a": {"numpy": "<f8", "value": 1.0}},
        "shape": [10**10],
    },
    "a program": {"class": "fegear.__main__:main", "fields": {}},
}


@pytest.mark.parametrize("content", FORGED.values(), ids=FORGED)
def test_a_forged_tree_is_refused_in_a_line(file, content):
    def forge(_, tree):
        tree["shared"][0] = content
        tree["summary"] = {"see": 0}

    edited(file, forge)
    with pytest.raises(InputError, match=r"results fegear \S+ cannot load$"):
        fegear.load(file)


def test_a_file_names_no_module(file):
    """A class that moves to another one is still found."""
    attributes, _ = read_netcdf(file)
    named = re.findall(r'"(?:class|named|enum)": "([^"]*)"', attributes["result"])
    assert "fegear.SweepResult" in named
    assert {name.count(".") for name in named} == {1}


def test_another_format_is_refused(file):
    edited(file, lambda attributes, _: attributes.update(format="other"))
    with pytest.raises(InputError, match=r"is no result that was saved$"):
        fegear.load(file)


def test_values_of_no_tree_are_named(result, tmp_path, monkeypatch):
    monkeypatch.setitem(result.__dict__, "summary", {"a": print})
    with pytest.raises(InputError, match=r"builtin_function_or_method cannot be saved"):
        result.save(tmp_path / "x.nc")
    assert not list(tmp_path.iterdir())


def test_xarray_opens_columns_with_units_and_the_header(result, file):
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(file) as held:
        rows = held[[name for name in held if held[name].dims == ("row",)]]
        for name, values in zip(
            result.table.names, zip(*result.table.rows(), strict=True), strict=True
        ):
            if name in rows:
                np.testing.assert_array_equal(rows[name], values)
        assert rows.dte_rms_m.attrs["units"] == "m"
        assert set(rows) >= {"torque_Nm", "mesh_frequency_Hz", "dte_rms_m"}
        header = held.attrs["header"].splitlines()
    expected = [f"{key}: {text}" for key, text in result.table.header.items()]
    assert header == expected
