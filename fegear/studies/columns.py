"""What the columns of tables mean, from the files that declare each of them once.

>>> from fegear.studies.columns import column_meaning
>>> column_meaning("stiffness", "pair2_load_share")
'part of the mesh force that the tooth pair carries, 0 to 1'
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from typing import Any

from fegear.files.keys import unit_of_key
from fegear.studies.registry import folders

MAIN = "table"  # name of the table that every study has
FILE = "columns.toml"  # of this package, and in the folders of commands
PLACEHOLDERS = {r"\{n\}": r"-?\d+", r"\{gear\}": ".+", r"\{parameter\}": ".+"}
PARAMETER = "{parameter}"


@dataclass(frozen=True)
class Column:
    """A column of a table.

    name : may contain `{n}` for a number and `{gear}` for the name of a gear, or be
        `{parameter}`, the name of one that the user chose
    unit : empty for text and what has no dimension, and of `{parameter}`, whose unit is
        that of its name
    commands : that write it
    table : `table`, or the name of another table of the result
    """

    name: str
    unit: str
    meaning: str
    commands: tuple[str, ...]
    table: str = MAIN

    def stands_for(self, name: str) -> bool:
        """Whether a name in a table is this column's."""
        return self._pattern.fullmatch(name) is not None

    @cached_property
    def _pattern(self) -> re.Pattern[str]:
        pattern = re.escape(self.name)
        for placeholder, allowed in PLACEHOLDERS.items():
            pattern = pattern.replace(placeholder, allowed)
        return re.compile(pattern)


@cache
def columns() -> tuple[Column, ...]:
    """Columns of all tables, in the order of the commands' folders."""
    return tuple(
        column for folder in folders() for column in _declared_columns(folder.__name__)
    )


def shared_meaning(group: str, name: str) -> str:
    """What a column of a group means that several commands have; KeyError if none."""
    for declared, meaning in _shared_groups()[group].items():
        if Column(declared, "", meaning, ()).stands_for(name):
            return meaning
    raise KeyError(f"{group}: column {name} is not declared")


@cache
def _shared_groups() -> dict[str, dict[str, str]]:
    packages = (
        __package__,
        *(folder.__name__.rpartition(".")[0] for folder in folders()),
    )
    return {
        group["name"]: group["meaning"]
        for package in dict.fromkeys(packages)
        for group in _columns_file(package).get("shared", ())
    }


def find_column(command: str, name: str, table: str = MAIN) -> Column:
    """The declared column of a name in a table of a command.

    A name as it is declared comes before one with a placeholder, and `{parameter}`
    last. Raises KeyError where there is none.
    """
    for column in _columns_of(command, table):
        if column.stands_for(name):
            return column
    raise KeyError(f"{command}, {table}: column {name} is not declared")


def column_meaning(command: str, name: str, table: str = MAIN) -> str:
    """What a column of a command's table means; KeyError where it is not declared."""
    return find_column(command, name, table).meaning


def meaning_and_unit(
    command: str, name: str, table: str, header: Mapping[str, str]
) -> tuple[str, str]:
    """What a column means and its unit, each empty where there is none.

    The meaning of a column that is not declared may be in the header of the table.
    """
    try:
        meaning = column_meaning(command, name, table)
    except KeyError:
        meaning = header.get(name, "")
    return meaning, unit_of_column(name)


def meanings(command: str, *names: str, table: str = MAIN) -> dict[str, str]:
    """Meanings by column, for the header of a command's table."""
    return {name: column_meaning(command, name, table) for name in names}


def unit_of_column(name: str) -> str:
    """The unit at the end of a name, of a key of a gear set that of its last part."""
    return unit_of_key(name.rpartition(".")[2])


def _columns_file(package: str) -> dict[str, Any]:
    """What the file of a package declares, nothing where there is none."""
    file = resources.files(package) / FILE
    return tomllib.loads(file.read_text("utf-8")) if file.is_file() else {}


def _declared_columns(package: str) -> Iterator[Column]:
    for group in _columns_file(package).get("columns", ()):
        meanings = group.get("meaning") or _shared_groups()[group["shared"]]
        for table, commands in _table_entries(group["commands"]).items():
            for name, meaning in meanings.items():
                yield Column(
                    name, unit_of_column(name), meaning, tuple(commands), table
                )


def _table_entries(entries: Sequence[str]) -> dict[str, list[str]]:
    """Commands by table, from entries such as `sweep` and `sweep: spectra`."""
    commands: dict[str, list[str]] = {}
    for entry in entries:
        command, _, table = entry.partition(": ")
        commands.setdefault(table or MAIN, []).append(command)
    return commands


@cache
def _columns_of(command: str, table: str) -> tuple[Column, ...]:
    """Columns of a table, those that stand for more names later."""
    chosen = (c for c in columns() if command in c.commands and c.table == table)
    return tuple(sorted(chosen, key=lambda c: (c.name == PARAMETER, "{" in c.name)))
