"""Values as plain data and in NetCDF files, and back to the last bit."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, fields
from enum import Enum
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as numpy_st

from fegear.files.errors import InputError
from fegear.files.netcdf import Variable, read_netcdf, write_netcdf
from fegear.files.values import (
    Decoder,
    Encoder,
    class_of,
    name_of_class,
    plain_of,
    value_of,
)
from fegear.gearset import load_gear_set
from lumped import Status

PLAIN = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
NUMBERS = numpy_st.arrays(
    st.sampled_from([np.float64, np.float32, np.int64, np.bool_, np.complex128]),
    numpy_st.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3),
)
TREES = st.recursive(
    PLAIN | NUMBERS | st.fractions() | st.sampled_from(Status),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.tuples(inner, inner)
        | st.dictionaries(st.text(max_size=3), inner, max_size=3)
    ),
    max_leaves=8,
)


def there_and_back(value, path):
    """The value from a file, by JSON and arrays."""
    encoder = Encoder()
    plain = encoder.plain(value)
    text = json.dumps([plain, encoder.shared], allow_nan=False)
    variables = {f"a{i}": Variable(a, f"d{i}") for i, a in enumerate(encoder.arrays)}
    write_netcdf(path, {"tree": text}, variables)
    attributes, arrays = read_netcdf(path)
    plain, shared = json.loads(attributes["tree"])
    return Decoder([arrays[f"a{i}"] for i in range(len(arrays))], shared).value(plain)


def one_nan(array):
    """The numbers of an array with one kind of NaN, as in JSON."""
    numbers = np.atleast_1d(array).copy()
    parts = numbers.view(numbers.real.dtype)
    if parts.dtype.kind == "f":
        parts[np.isnan(parts)] = np.nan
    return numbers


def same(a, b, nan_bits=True):
    """Equal in kind and to the last bit, NaN with NaN; nan_bits : of arrays as well."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        equal = a.dtype == b.dtype and a.shape == b.shape
        a, b = (a, b) if nan_bits else (one_nan(a), one_nan(b))
        return equal and a.tobytes() == b.tobytes()
    if isinstance(a, list | tuple):
        pairs = zip(a, b, strict=False)
        return len(a) == len(b) and all(same(*pair, nan_bits) for pair in pairs)
    if isinstance(a, dict | MappingProxyType):
        return list(a) == list(b) and all(same(a[k], b[k], nan_bits) for k in a)
    if hasattr(a, "__dataclass_fields__"):
        names = [f.name for f in fields(a)]
        return all(same(getattr(a, n), getattr(b, n), nan_bits) for n in names)
    if isinstance(a, float):
        return (
            a == b and math.copysign(1.0, a) == math.copysign(1.0, b)
        ) or a != a != b
    return a == b


@given(TREES)
@settings(
    deadline=None,
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_a_tree_comes_back_to_the_last_bit(tmp_path, tree):
    assert same(there_and_back(tree, tmp_path / "x.nc"), tree)


@given(TREES)
@example(np.array(np.copysign(np.nan, -1.0)))
@settings(deadline=None, max_examples=150)
def test_a_tree_comes_back_from_json(tree):
    assert same(value_of(json.loads(json.dumps(plain_of(tree)))), tree, nan_bits=False)


def test_values_of_the_program_come_back(tmp_path):
    records = np.zeros(2, np.dtype([("a", "?"), ("b", "f8", (2,))], align=True))
    records["b"][1] = 1.0 / 3.0
    value = {
        "gears": load_gear_set("liu-idler"),
        "fraction": Fraction(1, 3),
        "path": Path("a/b.toml"),
        "numpy": np.float32(0.1),
        "range": range(1, 9, 2),
        "records": records,
        "sets": frozenset({1, 2}),
        "view": MappingProxyType({"a": (1, [2])}),
    }
    assert same(there_and_back(value, tmp_path / "x.nc"), value)
    assert same(value_of(json.loads(json.dumps(plain_of(value)))), value)


def test_what_two_values_share_they_share_again(tmp_path):
    array = np.arange(4.0)
    one, two = there_and_back([(array,), (array,)], tmp_path / "x.nc")
    assert one[0] is two[0]


class Colour(Enum):
    RED = 1


@dataclass(frozen=True)
class Foreign:
    value: int


@pytest.mark.parametrize("value", [Foreign(1), Colour.RED, len, object(), {1: print}])
def test_other_values_are_refused(value):
    with pytest.raises(ValueError, match=r"\w"):
        Encoder().plain(value)


@pytest.mark.parametrize(
    "name",
    [
        "os.system",
        "builtins.eval",
        "fegear.os.system",
        "fegear.main",
        "fegear.InputError",
        "fegear.Job",
        "fegear.GearSet.__init__",
        "lumped.GearSet",
    ],
)
def test_names_of_no_class_of_values_are_refused(name):
    with pytest.raises(ValueError, match="is no class"):
        class_of(name)


def test_classes_have_names():
    assert class_of(name_of_class(Status)) is Status


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"x\.nc: cannot be read"):
        read_netcdf(tmp_path / "x.nc")


@pytest.mark.parametrize("values", [np.array([2**60]), np.array(["a"])])
def test_arrays_that_the_format_cannot_hold_are_refused(tmp_path, values):
    with pytest.raises(ValueError, match="cannot be saved"):
        write_netcdf(tmp_path / "x.nc", {}, {"a": Variable(values, "n")})
    assert not list(tmp_path.iterdir())
