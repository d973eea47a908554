"""Refused values of keys, with limits that are allowed.

A value may break several rules, each of which has its own limit. The tightest is found
by trying: the refused key is set to its limit, and what refuses that comes next.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from fegear.files.errors import InputError
from fegear.gearset.problems import shown
from fegear.gearset.schema import Document
from meshes.gear import Bound

Result = TypeVar("Result")
MAX_TRIES = 20  # limits of one key


@dataclass(frozen=True)
class Key:
    """A key of one table of the document.

    table : "gear" or "mesh"; name : of the gear, or label of the mesh
    parts : key, or keys of tables within, and the index of an entry of a list
    """

    table: str
    name: str
    parts: tuple[str | int, ...]


class Refusal(InputError):
    """A value of a key that is beyond a limit.

    stated : the key with its value, and where it is
    bound, unit : of the key
    """

    def __init__(self, key: Key, stated: str, bound: Bound, unit: str = "") -> None:
        super().__init__(f"{stated}; {bound.stated(unit)}")
        self.key, self.stated, self.bound, self.unit = key, stated, bound, unit

    def between(self, other: Bound) -> InputError:
        """The error of a key whose limits exclude each other."""
        limits = (bound.stated(self.unit) for bound in (self.bound, other))
        return InputError(f"{self.stated}; no value fits: {' and '.join(limits)}")


def build_or_refuse(document: Document, build: Callable[[Document], Result]) -> Result:
    """What is built; the limit that a Refusal states is allowed by all rules."""
    try:
        return build(document)
    except Refusal as refusal:
        raise _with_tightest_limit(document, build, refusal) from None


def _with_tightest_limit(
    document: Document, build: Callable[[Document], Any], first: Refusal
) -> InputError:
    refusal = first
    for _ in range(MAX_TRIES):
        try:
            build(_with_value(document, refusal.key, refusal.bound.inside))
        except Refusal as following:
            if following.key != first.key:
                break
            if following.bound.is_upper != first.bound.is_upper:
                return refusal.between(following.bound)
            refusal = following
        except InputError:  # of another key, or a rule without limit
            break
        else:
            break
    return Refusal(first.key, first.stated, refusal.bound, first.unit)


def _with_value(document: Document, key: Key, value: float) -> Document:
    """The document with a key of a table, and those of equal planets, changed."""
    entries = tuple(
        _changed(entry, key.parts, value) if _is_meant(document, entry, key) else entry
        for entry in getattr(document, key.table)
    )
    return document.model_copy(update={key.table: entries})


def _is_meant(document: Document, entry: Any, key: Key) -> bool:
    name = entry.name if key.table == "gear" else entry.label
    if name == key.name or not document.planetary:
        return bool(name == key.name)
    planetary = document.planetary[0]
    if key.table == "gear":
        return {name, key.name} <= set(planetary.planet_names)
    if key.parts[0] == "center_distance_mm":
        return True
    named = next(mesh for mesh in document.mesh if mesh.label == key.name)
    ends = ({mesh.driver, mesh.driven} for mesh in (entry, named))
    return len({planetary.sun in gears for gears in ends}) == 1


def _changed(table: Any, parts: tuple[str | int, ...], value: float) -> Any:
    """A table or list with the value at the end of a way of keys and indices."""
    if not parts:
        return value
    first, rest = parts[0], parts[1:]
    if isinstance(first, int):
        entry = _changed(table[first], rest, value)
        return (*table[:first], entry, *table[first + 1 :])
    before = getattr(table, first)
    after = _changed(before, rest, value)
    if isinstance(before, int) and not isinstance(before, bool):
        after = round(after)
    return table.model_copy(update={first: after})


def in_unit(bound: Bound, factor: float) -> Bound:
    """The limit of a key in its unit; factor : that unit in SI units."""
    return bound.mapped(lambda value: value / factor)


@dataclass(frozen=True)
class KeyOf:
    """A table of reliefs or profiles in a mesh, and the gear that it is for.

    text : the table in messages; gear : its name in messages
    """

    text: str
    key: Key
    gear: str
    table: Any

    def refusal(
        self, name: str, bound: Bound, unit: str = "", entry: int | None = None
    ) -> Refusal:
        """The error of a key of the table, or of an entry of its list."""
        value, label = getattr(self.table, name), name
        parts: tuple[str | int, ...] = (name,)
        if entry is not None:
            value, label = value[entry], f"{name} entry {entry + 1}"
            parts = name, entry
        key = Key(self.key.table, self.key.name, (*self.key.parts, *parts))
        return Refusal(key, f"{self.text}.{label} = {shown(value)}", bound, unit)
