"""Frozen values as plain data, and back: for files that are data, never code.

A value is a tree of numbers, texts, arrays, sequences, mappings, enumerations, paths,
named tuples and dataclasses. Classes are named by their package, not by their module,
and only those of this program are loaded. A value that several others hold is written
once. What properties cached is left out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from fractions import Fraction
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path, PurePath
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.files.netcdf import EXACT_INTEGERS, largest_integer

PACKAGES = frozenset({"fegear", "lumped", "meshes"})  # whose classes files may name
CLASS = re.compile(r"^class (\w+)", re.MULTILINE)
SEQUENCES = {"tuple": tuple, "list": list, "set": set, "frozenset": frozenset}


def plain_of(value: Any) -> dict[str, Any]:
    """Convert a value to what JSON holds, arrays as lists of their numbers."""
    encoder = Encoder()
    tree = encoder.plain(value)
    arrays = [[array.dtype.str, array.tolist()] for array in encoder.arrays]
    return {"value": tree, "shared": encoder.shared, "arrays": arrays}


def value_of(plain: Mapping[str, Any]) -> Any:
    """Convert what `plain_of` made of a value back, to the bit."""
    arrays = [np.array(numbers, dtype) for dtype, numbers in plain["arrays"]]
    return Decoder(arrays, plain["shared"]).value(plain["value"])


@dataclass
class Encoder:
    """Arrays and shared values of a tree that is made plain.

    packages : whose classes values may have
    """

    packages: frozenset[str] = PACKAGES
    arrays: list[NDArray[Any]] = field(default_factory=list)
    shared: list[Any] = field(default_factory=list)
    seen: dict[int, tuple[Any, Any]] = field(default_factory=dict)

    def plain(self, value: Any) -> Any:
        """Convert a value to what JSON holds; ValueError for other types."""
        if value is None or (isinstance(value, str) and type(value) is str):
            return value
        if type(value) in (bool, int):
            return value
        if isinstance(value, float):
            return _plain_float(value)
        if isinstance(value, complex):
            return {"complex": [_plain_float(value.real), _plain_float(value.imag)]}
        if isinstance(value, np.generic):
            return {"numpy": value.dtype.str, "value": self.plain(value.item())}
        if isinstance(value, Enum):
            return {
                "enum": name_of_class(type(value), self.packages),
                "name": value.name,
            }
        if isinstance(value, PurePath):
            return {"path": str(value)}
        if isinstance(value, Fraction):
            return {"fraction": [value.numerator, value.denominator]}
        if isinstance(value, range):
            return {"range": [value.start, value.stop, value.step]}
        return self._plain_shared(value)

    def _plain_shared(self, value: Any) -> Any:
        """A reference to a value that may be held by several."""
        if id(value) not in self.seen:
            content = self._plain_content(value)
            self.seen[id(value)] = {"see": len(self.shared)}, value  # kept alive
            self.shared.append(content)
        return self.seen[id(value)][0]

    def _plain_content(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return self._array(value)
        if is_dataclass(value) and not isinstance(value, type):
            names = [f.name for f in fields(value)]
            parts = {n: self.plain(getattr(value, n)) for n in names}
            return {"class": name_of_class(type(value), self.packages), "fields": parts}
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return {
                "named": name_of_class(type(value), self.packages),
                "items": [self.plain(item) for item in value],
            }
        for name, kind in SEQUENCES.items():
            if type(value) is kind:
                return {name: [self.plain(item) for item in value]}
        if isinstance(value, dict | MappingProxyType):
            items = [[self.plain(k), self.plain(v)] for k, v in value.items()]
            return {"dict" if isinstance(value, dict) else "mapping": items}
        raise ValueError(f"{type(value).__module__}.{type(value).__qualname__}")

    def _array(self, value: NDArray[Any]) -> Any:
        kind, shape = value.dtype.kind, list(value.shape)
        if value.dtype.names:
            parts = {n: self.plain(np.array(value[n])) for n in value.dtype.names}
            return {"records": _type_of(value.dtype), "fields": parts, "shape": shape}
        if kind in "UO" or not value.size or largest_integer(value) > EXACT_INTEGERS:
            items = [self.plain(item) for item in value.ravel().tolist()]
            return {"items": items, "type": value.dtype.str, "shape": shape}
        flat = np.ascontiguousarray(value).ravel()
        self.arrays.append(flat.view(flat.real.dtype) if kind == "c" else flat)
        return {"array": len(self.arrays) - 1, "type": value.dtype.str, "shape": shape}


@dataclass
class Decoder:
    """Values from plain data and arrays; packages : as in `Encoder`."""

    arrays: list[NDArray[Any]]
    shared: list[Any]
    packages: frozenset[str] = PACKAGES
    objects: dict[int, Any] = field(default_factory=dict)

    def value(self, plain: Any) -> Any:
        """The value; ValueError for what `Encoder` does not write."""
        if not isinstance(plain, dict):
            return plain
        if "see" in plain:
            number = plain["see"]
            if number not in self.objects:
                self.objects[number] = self._plain_content(self.shared[number])
            return self.objects[number]
        if "float" in plain:
            return float(plain["float"])
        if "complex" in plain:
            return complex(*map(self.value, plain["complex"]))
        if "numpy" in plain:
            return np.dtype(plain["numpy"]).type(self.value(plain["value"]))
        if "enum" in plain:
            return class_of(plain["enum"], self.packages)[plain["name"]]
        if "path" in plain:
            return Path(plain["path"])
        if "fraction" in plain:
            return Fraction(*plain["fraction"])
        if "range" in plain:
            return range(*plain["range"])
        raise ValueError(f"unknown value {sorted(plain)}")

    def _plain_content(self, plain: Any) -> Any:
        for name, kind in SEQUENCES.items():
            if name in plain:
                return kind(map(self.value, plain[name]))
        if "class" in plain:
            kind = class_of(plain["class"], self.packages)
            restored = object.__new__(kind)
            for name, part in plain["fields"].items():
                object.__setattr__(restored, name, self.value(part))
            return restored
        if "named" in plain:
            return class_of(plain["named"], self.packages)(
                *map(self.value, plain["items"])
            )
        if "records" in plain:
            return self._records(plain)
        if "items" in plain:
            flat = np.empty(len(plain["items"]), np.dtype(plain["type"]))
            flat[:] = [self.value(item) for item in plain["items"]]
            return flat.reshape(plain["shape"])
        if "array" in plain:
            flat = self.arrays[plain["array"]].view(plain["type"])
            return flat.reshape(plain["shape"])
        for name in ("dict", "mapping"):
            if name in plain:
                restored = {self.value(k): self.value(v) for k, v in plain[name]}
                return restored if name == "dict" else MappingProxyType(restored)
        raise ValueError(f"unknown value {sorted(plain)}")

    def _records(self, plain: Any) -> NDArray[Any]:
        parts = {name: self.value(part) for name, part in plain["fields"].items()}
        shape = tuple(plain["shape"])
        if any(part.shape[: len(shape)] != shape for part in parts.values()):
            raise ValueError(f"records of another shape than {shape}")
        out = np.zeros(shape, _dtype_of(plain["records"]))
        for name, part in parts.items():
            out[name] = part
        return out


def _plain_float(value: float) -> Any:
    return float(value) if math.isfinite(value) else {"float": repr(float(value))}


def name_of_class(kind: type, packages: frozenset[str] = PACKAGES) -> str:
    """Package and name of a class of this program; ValueError for others.

    Its module is no part of it: files outlive a class that moves.
    """
    package = kind.__module__.partition(".")[0]
    if package not in packages:
        raise ValueError(f"{kind.__module__}.{kind.__qualname__}")
    return f"{package}.{kind.__qualname__}"


def class_of(name: str, packages: frozenset[str] = PACKAGES) -> Any:
    """The class that a name stands for: a dataclass, named tuple or enumeration."""
    package, _, path = name.partition(".")
    outer, *inner = path.split(".")
    modules = _modules_of_package(package).get(outer, ()) if package in packages else ()
    if len(modules) != 1:
        raise ValueError(f"{name} is no class of this program")
    kind: Any = getattr(import_module(modules[0]), outer, None)
    for part in inner:
        kind = getattr(kind, part, None)
    valid = isinstance(kind, type) and (
        is_dataclass(kind) or hasattr(kind, "_fields") or issubclass(kind, Enum)
    )
    if not valid:
        raise ValueError(f"{name} is no class of values")
    return kind


@cache
def _modules_of_package(package: str) -> Mapping[str, list[str]]:
    """Modules of a package that define a class, by its name; none of them is run."""
    spec = find_spec(package)
    homes: dict[str, list[str]] = {}
    for root in spec.submodule_search_locations or () if spec else ():
        for path in sorted(Path(root).rglob("*.py")):
            module = ".".join([package, *path.relative_to(root).with_suffix("").parts])
            for name in CLASS.findall(path.read_text("utf-8")):
                homes.setdefault(name, []).append(module.removesuffix(".__init__"))
    return homes


def _type_of(dtype: np.dtype[Any]) -> dict[str, Any]:
    """A type of records: offsets, and types of fields with their shapes."""
    found: Mapping[str, Any] = dtype.fields or {}
    return {
        "names": list(found),
        "formats": [[part[0].base.str, list(part[0].shape)] for part in found.values()],
        "offsets": [part[1] for part in found.values()],
        "itemsize": dtype.itemsize,
    }


def _dtype_of(plain: dict[str, Any]) -> np.dtype[Any]:
    formats = [(kind, tuple(shape)) for kind, shape in plain["formats"]]
    described: Any = {**plain, "formats": formats}
    return np.dtype(described)
