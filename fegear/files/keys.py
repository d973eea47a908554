"""Keys of the TOML files that are read, from the schemas that check them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from lumped.common.units import UNITS, split_unit

# by the kind of a file, module and class of its schema; see `register_file`
FILE_KINDS = {
    "gear-set": ("fegear.gearset.schema", "Document"),
    "machine": ("fegear.commands.rattle.machines", "MachineFile"),
    "gearbox": ("fegear.commands.clatter.gearboxes", "GearboxFile"),
    "bearing": ("fegear.commands.bearing.file", "BearingFile"),
}
# a time or part, of what the rest of the name says
UNITS_AT_START = re.compile(r"(?:(us|ms)_per_[a-z]+|(percent)_for_\w+)")
DEFAULT = re.compile(r" ?\[default: (.*)\]$")


@dataclass(frozen=True)
class FileKey:
    """A key of a file.

    table : such as `[load]`, `[[gear]]` or `[mesh.tip_relief]`; empty at the top
    unit : empty for text, truth values and what has no dimension
    default : value, or text that says how it is found; None where there is none
    required : whether the table needs it
    minimum, maximum : of a number, or of each of several
    excluded : names of those limits that are not allowed themselves
    choices : allowed texts, empty where any is
    """

    file: str
    table: str
    key: str
    unit: str
    default: Any
    required: bool
    minimum: float | None
    maximum: float | None
    excluded: tuple[str, ...]
    choices: tuple[str, ...]
    meaning: str

    @property
    def allowed(self) -> str:
        """Limits or choices as a line of text."""
        if self.choices:
            return " or ".join(self.choices)
        low = "" if self.minimum is None else f"{self.minimum:g}"
        high = "" if self.maximum is None else f"{self.maximum:g}"
        low = f"above {low}" if "minimum" in self.excluded else low
        high = f"below {high}" if "maximum" in self.excluded else high
        if low and high:
            return f"{low} to {high}"
        return f"{low} or more" if low else high


def register_file(kind: str, module: str, name: str) -> None:
    """Add a kind of file of another package, listed as in `FILE_KINDS`."""
    FILE_KINDS[kind] = module, name


def file_keys(kind: str) -> list[FileKey]:
    """Keys of a kind of file of `FILE_KINDS`, table by table."""
    from pydantic import TypeAdapter

    module, name = FILE_KINDS[kind]
    schema = TypeAdapter(getattr(import_module(module), name)).json_schema()
    return list(_keys_of(kind, "", schema, schema.get("$defs", {})))


def unit_of_key(key: str) -> str:
    """The unit at the end of a key or of a column, empty where there is none.

    The time of one of many is in the unit that its name begins with, `ms_per_speed`.
    """
    if start := UNITS_AT_START.fullmatch(key):
        return UNITS[start[1] or start[2]]
    return split_unit(key)[1]


def _keys_of(
    kind: str, table: str, schema: Mapping[str, Any], definitions: Mapping[str, Any]
) -> Iterator[FileKey]:
    """Yield the keys of a table, then the keys of the tables inside it."""
    tables = []
    for key, declared in schema["properties"].items():
        value, is_list = _value_schema(declared, definitions)
        if "properties" in value:
            tables.append((key, value, is_list))
            continue
        meaning = declared.get("description", value.get("description", ""))
        rule = DEFAULT.search(meaning)
        default = declared.get("default")
        limits = {
            name: value.get(name, value.get(f"exclusive{name.capitalize()}"))
            for name in ("minimum", "maximum")
        }
        yield FileKey(
            file=kind,
            table=table,
            key=key,
            unit=unit_of_key(key),
            default=rule[1] if rule else default,
            required=key in schema.get("required", ()),
            **limits,
            excluded=tuple(n for n in limits if f"exclusive{n.capitalize()}" in value),
            choices=tuple(value.get("enum", filter(None, [value.get("const")]))),
            meaning=DEFAULT.sub("", meaning),
        )
    for key, value, is_list in tables:
        inner = f"{table.strip('[]')}.{key}".lstrip(".")
        name = f"[[{inner}]]" if is_list else f"[{inner}]"
        yield from _keys_of(kind, name, value, definitions)


def _value_schema(
    declared: Mapping[str, Any], definitions: Mapping[str, Any]
) -> tuple[Mapping[str, Any], bool]:
    """Schema of a value, or of each of several, and whether it is a list of them."""
    for branch in declared.get("anyOf", ()):
        if branch.get("type") != "null":
            return _value_schema(branch, definitions)
    if "$ref" in declared:
        return _value_schema(
            definitions[declared["$ref"].rpartition("/")[2]], definitions
        )
    if declared.get("type") == "array" and "items" in declared:
        return _value_schema(declared["items"], definitions)[0], True
    return declared, False
