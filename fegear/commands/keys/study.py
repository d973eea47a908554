"""Keys of the files that commands read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

from fegear.files.errors import InputError
from fegear.files.keys import FILE_KINDS, FileKey, file_keys
from fegear.studies.page import Page
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import argument
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table

COLUMNS = (
    *("file", "table", "key", "unit", "default", "required"),
    *("minimum", "maximum", "choices", "meaning"),
)


@dataclass(frozen=True, kw_only=True)
class KeyList(Study, command="keys", example="keys gear-set"):
    """List the keys of files: unit, default, limits and meaning.

    Files are TOML. A key of a table such as [load] follows that line; [[gear]] begins
    one of several gears.
    """

    pictures = NO_PICTURES

    kind: str = argument(
        "KIND",
        "gear-set, bearing, machine, gearbox or case. [default: all]",
        default="",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind and self.kind not in FILE_KINDS:
            raise InputError(f"kind = {self.kind}; allowed are {', '.join(FILE_KINDS)}")

    def tasks(self) -> Iterator[Task]:
        yield Task("keys", self._list_keys)

    def _list_keys(self, job: Job) -> KeyListResult:
        kinds = [self.kind] if self.kind else list(FILE_KINDS)
        return KeyListResult(self, [key for kind in kinds for key in file_keys(kind)])


@dataclass(frozen=True, eq=False)
class KeyListResult(StudyResult):
    """Keys by file and table."""

    study: KeyList
    keys: list[FileKey]

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {"keys": [asdict(key) for key in self.keys]}

    @property
    def table(self) -> Table:
        rows = [[_as_text(getattr(key, name)) for name in COLUMNS] for key in self.keys]
        return Table(COLUMNS, lambda: rows)

    def page(self) -> Page:
        for (file, table), keys in groupby(self.keys, lambda k: (k.file, k.table)):
            yield f"{file} file{f': {table}' if table else ''}"
            for key in keys:
                yield from _lines(key)


def _lines(key: FileKey) -> Iterator[str]:
    """Two lines: what may be given, and what it means."""
    unit = f" [{key.unit}]" if key.unit else ""
    default = _as_text(key.default)
    rules = (
        "required" if key.required else f"default {default}" if default != "" else ""
    )
    limits = ", ".join(filter(None, (key.allowed, rules)))
    yield f"  {key.key}{unit}{f': {limits}' if limits else ''}"
    yield f"      {key.meaning}"


def _as_text(value: Any) -> Any:
    """A value as a cell of a CSV file."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple | list):
        return " ".join(map(str, value))
    return "" if value is None else value
