"""Axes of data sets of signals: settings, faults of a tooth, and keys of the gear set.

A fault is changed in the tables of the gear-set file: its list gets an entry for the
tooth, or the entry that is there gets another size. Size 0 is a healthy tooth.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from fegear.files.errors import InputError, nearest
from fegear.files.toml import toml_value
from fegear.gearset.edit import find_entry, require_known_key
from fegear.studies.settings import display_name
from fegear.studies.trains.axes import require_within
from fegear.studies.trains.loads import require_torque_axis
from lumped.common.checks import format_number
from lumped.steady.maps import Axis


@dataclass(frozen=True)
class Fault:
    """A fault that an axis varies, by where the gear-set file has it.

    column : name of the axis in tables, with its unit
    key : of the gear
    entry : in the table of a tooth in the list of the key that has its size; empty
        where the list has a number for every tooth, or the key is a number itself
    is_of_gear : whether it is a number of the gear, not of a tooth
    needs_entry : whether the list must have an entry of the tooth, which says more
    replaces : what that entry may have instead of `entry`
    """

    column: str
    key: str
    entry: str = ""
    is_of_gear: bool = False
    needs_entry: bool = False
    replaces: str = ""


# those whose keys the gear-set file has are allowed
FAULTS = {
    "pitch_error": Fault("pitch_error_um", "pitch_errors_um"),
    "crack": Fault("crack_mm", "cracks", "depth_mm"),
    "spall": Fault(
        "spall_width_share",
        "spalls",
        "width_share",
        needs_entry=True,
        replaces="length_mm",
    ),
    "broken_tip": Fault("broken_tip_mm", "broken_tips", "height_mm"),
    "wear": Fault("wear_um", "worn_teeth", "depth_um", needs_entry=True),
    "eccentricity": Fault("eccentricity_um", "eccentricity_um", is_of_gear=True),
}
# setting of a run and column by the name of the axis
SETTINGS = {
    "speed": ("rpm", "speed_rpm"),
    "torque_Nm": ("torque", "torque_Nm"),
    "noise_percent": ("noise_percent", "noise_percent"),
    "seed": ("seed", "seed"),
    "tooth": ("tooth", "faulty_tooth"),
}
WHOLE_NUMBERS = frozenset(("seed", "tooth"))
PLANETS = re.compile(r"planetary\.\d+\.(planets|positions_deg)")


def column_of(axis: str) -> str:
    """Name of the column of an axis."""
    if axis in SETTINGS:
        return SETTINGS[axis][1]
    return FAULTS[axis].column if axis in FAULTS else axis


def require_fault_axes(study: Any) -> None:
    """InputError for axes of a study that are unknown, or fixed by a setting as well.

    Axes are `study.over`; settings are its fields.
    """
    over, names = display_name(study, "over"), [axis.name for axis in study.over]
    for axis in study.over:
        if names.count(axis.name) > 1:
            raise InputError(f"{over} {axis.name}; is given twice")
        _require_axis(study, axis, over)


def _require_axis(study: Any, axis: Axis, over: str) -> None:
    name, fields_of_study = axis.name, type(study).__dataclass_fields__
    if name in WHOLE_NUMBERS and not all(v.is_integer() for v in axis.values):
        raise InputError(f"{over} {name}; must be whole numbers")
    if name in SETTINGS:
        field = SETTINGS[name][0]
        if getattr(study, field) != fields_of_study[field].default:
            shown = display_name(study, field)
            raise InputError(f"{over} {name}; replaces {shown}, leave that out")
        allowed = fields_of_study[field].metadata["setting"].allowed
        if allowed is not None:
            require_within(axis, allowed, over)
        else:
            require_torque_axis(axis, over)
        return
    if name in FAULTS:
        if name != "pitch_error" and min(axis.values) < 0.0:
            raise InputError(
                f"{over} {name} = {format_number(min(axis.values))}; must be 0 or more"
            )
        return
    if "." not in name:
        allowed = [*SETTINGS, *FAULTS]
        raise InputError(
            f"{over} {name}; allowed are {', '.join(allowed)} and keys of the gear "
            f"set, such as mesh.1.phase{nearest(name, allowed)}"
        )
    key, _ = _split_key(name)
    require_known_key(key)
    if key.endswith(".teeth") or PLANETS.fullmatch(key):
        raise InputError(f"{over} {name}; all runs have the same gears and samples")
    if key in study.gear_set.overrides and key == name:
        raise study.gear_set.rejection(key, f"{over} varies it, leave it out")


def _split_key(name: str) -> tuple[str, list[str]]:
    """Key of a gear-set file and the path within its value, from the first number on.

    The number of a gear or mesh is part of the key.
    """
    parts = name.split(".")
    for position in range(2, len(parts)):
        if parts[position].isdecimal():
            return ".".join(parts[:position]), parts[position:]
    return name, []


@dataclass(frozen=True)
class GearSetEdits:
    """Changes of a gear set by the values of axes.

    tables : of its file, with the changes that all runs share
    overrides : these changes by key
    gear : number of the gear with the faults, from 1; teeth : of it
    """

    tables: Mapping[str, Any]
    overrides: Mapping[str, Any]
    gear: int
    teeth: int

    def texts(self, values: Mapping[str, float], tooth: int) -> tuple[str, ...]:
        """Changes `KEY=VALUE` for values by the names of axes.

        tooth : from 1, that has the faults
        """
        changes = dict(self.overrides)
        for name, value in values.items():
            fault = FAULTS.get(name)
            key, path = (
                _split_key(self._name_with_number(name))
                if fault is None
                else self._entry_path(fault, tooth)
            )
            if not path:
                changes[key] = _number_as_in_file(value)
                continue
            present_value = deepcopy(changes.get(key, self._table_value(key)))
            if fault is None:
                _set_value_at_path(present_value, path, value, name)
                changes[key] = present_value
            elif fault.entry:
                changes[key] = [
                    *self._with_entry(present_value or [], fault, tooth, value)
                ]
            else:
                errors = present_value or [0.0] * self.teeth
                changes[key] = [*errors[: tooth - 1], value, *errors[tooth:]]
        return tuple(f"{key}={toml_value(value)}" for key, value in changes.items())

    def _name_with_number(self, name: str) -> str:
        """A key with the number of its gear or mesh, which it may have by name."""
        kind, which, *path = name.split(".")
        entry, entries = find_entry(self.tables, kind, which), self.tables.get(kind)
        if entry is None or not isinstance(entries, list) or self._is_expanded(kind):
            return name
        return ".".join([kind, str(1 + entries.index(entry)), *path])

    def _entry_path(self, fault: Fault, tooth: int) -> tuple[str, list[str]]:
        path = [] if fault.is_of_gear else [str(tooth)]
        gear = str(self.gear)
        if self._is_expanded("gear"):
            gear = self.tables["gear"][self.gear - 1]["name"]
        return f"gear.{gear}.{fault.key}", path

    def _is_expanded(self, kind: str) -> bool:
        """Whether tables of a kind count otherwise in the file, one for all planets."""
        return kind == "gear" and "planetary" in self.tables

    def _table_value(self, key: str) -> Any:
        """What the file has for a key, None where it has nothing."""
        kind, *path = key.split(".")
        table: Any = self.tables.get(kind)
        if isinstance(table, list):
            table, path = find_entry(self.tables, kind, path[0]), path[1:]
        for step in path:
            table = table.get(step) if isinstance(table, dict) else None
        return table

    def _with_entry(
        self, entries: Sequence[Any], fault: Fault, tooth: int, size: float
    ) -> Iterator[Any]:
        """Entries of a list, that of a tooth with another size; 0 removes it."""
        present_value = [entry for entry in entries if entry.get("tooth") == tooth][:1]
        if fault.needs_entry and not present_value:
            raise InputError(
                f"gear {self.gear} has no entry of tooth {tooth} in {fault.key}, of "
                f"which {fault.entry} varies"
            )
        yield from (entry for entry in entries if entry not in present_value)
        if size == 0.0:
            return
        entry = {"tooth": tooth, **next(iter(present_value), {})}
        entry.pop(fault.replaces, None)
        yield {**entry, fault.entry: _scaled_entry(entry.get(fault.entry), size)}


def _scaled_entry(present_value: Any, size: float) -> Any:
    """A size in place of one that is there; of a list the largest becomes the size."""
    if not isinstance(present_value, list):
        return size
    largest = max(present_value, default=0.0)
    return [size * one / largest if largest > 0.0 else size for one in present_value]


def _set_value_at_path(
    value: Any, path: Sequence[str], number: float, name: str
) -> None:
    """Set an entry within a list, which counts from 1; InputError where none is."""
    *inner, last = (int(s) - 1 if s.isdecimal() else s for s in path)
    try:
        for step in inner:
            value = value[step]
        if min(step for step in (*inner, last) if isinstance(step, int)) < 0:
            raise IndexError
        _ = value[last]
        value[last] = _number_as_in_file(number)
    except (LookupError, TypeError):
        raise InputError(f"{name}: the gear set has no such entry") from None


def _number_as_in_file(value: float) -> float:
    """A whole number without a fraction, as keys that count need it."""
    return int(value) if float(value).is_integer() else value
