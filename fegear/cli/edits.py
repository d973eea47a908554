"""The option that changes figures of a gear set without a new file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer

Edits = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a figure of the gear set, such as "
        "mesh.1.tip_relief.magnitude_um=10; may be repeated.",
    ),
]


def parsed_edits(given: Sequence[str] | None) -> dict[str, Any]:
    """Values by key; InputError where there is no `=` between them."""
    from fegear.errors import InputError
    from fegear.gearset.edit import parsed_value

    edits: dict[str, Any] = {}
    for text in given or ():
        key, separator, value = text.partition("=")
        if not (separator and key.strip() and value.strip()):
            raise InputError(f"--set {text}; KEY=VALUE is needed")
        edits[key.strip()] = parsed_value(value.strip())
    return edits


def edit_entries(edits: Mapping[str, Any]) -> dict[str, str]:
    """Entries for the header of a file: what was changed."""
    return {f"set {key}": str(value) for key, value in edits.items()}


def edits_in_words(header: Mapping[str, str]) -> str:
    """`KEY = VALUE, ...` of the entries in a header, for a title."""
    changes = (item for item in header.items() if item[0].startswith("set "))
    return ", ".join(f"{key[4:]} = {value}" for key, value in changes)
