"""Data files (TOML) checked against a frozen dataclass; what is wrong in one line."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from decimal import Decimal
from functools import cached_property
from typing import Annotated, Any, Generic, TypeVar

from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from fegear.files.errors import InputError
from fegear.files.kinds import require_kind
from fegear.files.speed_ranges import parsed_speeds
from fegear.gearset.edit import parsed_value
from fegear.gearset.problems import PHRASES, nearest, shown
from fegear.gearset.read import parsed_toml

T = TypeVar("T")
MAX_SPEEDS = 10_000
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


def _require_edit(text: str) -> str:
    key, separator, value = text.partition("=")
    if not (separator and key.strip() and value.strip()):
        raise ValueError("KEY=VALUE is needed, as for --set")
    return text


def _require_speeds(text: str) -> str:
    parsed_speeds(text, MAX_SPEEDS)
    return text


Text = Annotated[str, Field(min_length=1)]
Number = Annotated[float, Field(strict=True)]
Positive = Annotated[Number, Field(gt=0.0, lt=1e9)]
Speeds = Annotated[str, AfterValidator(_require_speeds)]
Edit = Annotated[str, AfterValidator(_require_edit)]
Flag = Annotated[bool, Field(strict=True)]


def few_speeds(text: str, count: int = 5) -> str:
    """At most `count` of the speeds, evenly spread: a range stays one."""
    speeds = parsed_speeds(text)
    stride = math.ceil((len(speeds) - 1) / (count - 1))
    if stride <= 1:
        return text
    if "," not in text:
        start, end, step = text.split(":")
        return f"{start}:{end}:{stride * Decimal(step)}"
    return ",".join(f"{speed:.12g}" for speed in speeds[::stride])


def edits_by_key(edits: Sequence[str]) -> dict[str, Any]:
    """Edits `KEY=VALUE` of a gear set as values by their keys."""
    pairs = [text.partition("=") for text in edits]
    return {key.strip(): parsed_value(value.strip()) for key, _, value in pairs}


def require_own_names(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Each name is there once."""
    names = [value.name for value in values]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"{name} is there {names.count(name)} times")
    return values


@dataclass(frozen=True)
class DataFile(Generic[T]):
    """What a file holds, and its tables in lists.

    tables : by the key of the list the class of its entries, or the classes by the
        `kind` that an entry names
    kind : of a file that a user writes, see `fegear.files.kinds`, or nothing
    """

    content: type[T]
    tables: Mapping[str, type | Mapping[str, type]]
    kind: str = ""

    @cached_property
    def _adapter(self) -> TypeAdapter[T]:
        """Checks of the class, which take longer to make than to run."""
        return TypeAdapter(self.content)

    def read(self, text: str, source: str) -> T:
        """The content of TOML text; `source` begins the message of an InputError."""
        try:
            tables = parsed_toml(text)
            if self.kind:
                require_kind(tables, self.kind)
            return self._adapter.validate_python(tables)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
        except ValidationError as error:
            details = error.errors(include_url=False)
            unknown = [item for item in details if "unexpected" in item["type"]]
            sentence = self._sentence((unknown or details)[0])
            raise InputError(f"{source}: {sentence}") from None

    def _sentence(self, item: ErrorDetails) -> str:
        """`metric 2, allowed = -1; must be at least 0`."""
        loc, kind = item["loc"], item["type"]
        where, key = self._where_and_key(loc)
        before = f"{where}, " if where else ""
        if kind == "unexpected_keyword_argument":
            field_names = [field.name for field in fields(self._class_of(loc))]
            return f"{before}unknown key {key}{nearest(key, field_names)}"
        if kind == "union_tag_invalid":
            tag, allowed = item["ctx"]["tag"], item["ctx"]["expected_tags"]
            return f"{key}, kind = {shown(tag)}; must be one of {allowed}"
        if kind == "union_tag_not_found":
            return f"{key}, kind is missing"
        if kind in ("missing", "missing_argument"):
            return f"{before}{key} is missing"
        if kind == "value_error":
            reason = str(item["ctx"]["error"])
            return f"{before}{key} = {shown(item['input'])}; {reason}"
        phrase = PHRASES.get(kind, item["msg"]).format(**item.get("ctx", {}))
        return f"{before}{key} = {shown(item['input'])}; {phrase}"

    def _class_of(self, loc: Sequence[int | str]) -> Any:
        table = self.tables.get(str(loc[0]), self.content)
        return table[str(loc[2])] if isinstance(table, Mapping) else table

    def _where_and_key(self, loc: Sequence[int | str]) -> tuple[str, str]:
        """('metric 2', 'allowed') of an error's location."""
        table = self.tables.get(str(loc[0])) if loc else None
        if table is None or len(loc) < 2:
            return "", _in_words(loc)
        # an entry that names its kind has it in the location
        inner = loc[3:] if isinstance(table, Mapping) else loc[2:]
        where = f"{loc[0]} {int(loc[1]) + 1}"
        return (where, _in_words(inner)) if len(loc) > 2 else ("", where)


def _in_words(loc: Sequence[int | str]) -> str:
    return " ".join(f"entry {p + 1}" if isinstance(p, int) else p for p in loc)


def require_name(name: str) -> str:
    """Require a file name of small letters, digits and hyphens."""
    if not re.fullmatch("[a-z0-9][a-z0-9-]*", name):
        raise ValueError("must be small letters, digits and hyphens, no hyphen first")
    return name
