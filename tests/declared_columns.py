"""Columns that tables have, and those that are declared."""

from __future__ import annotations

from collections.abc import Collection

from fegear.studies.columns import MAIN, PARAMETER, columns, find_column


def declared(command: str, table: str = MAIN) -> set[str]:
    """Declared names of a table."""
    chosen = [c for c in columns() if command in c.commands and c.table == table]
    names = {column.name for column in chosen}
    assert len(names) == len(chosen)
    return names


def require_declared(
    command: str,
    names: Collection[str],
    table: str = MAIN,
    missing: Collection[str] = (),
    parameters: Collection[str] = (),
) -> None:
    """Require that the names of a table are those declared.

    missing : declared ones that this table does not have
    parameters : names in the table that the user chose
    """
    found = {name: find_column(command, name, table).name for name in names}
    of_user = {
        name for name, declared_name in found.items() if declared_name == PARAMETER
    }
    assert of_user == set(parameters)
    assert declared(command, table) - set(found.values()) == set(missing)
