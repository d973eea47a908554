"""What reaches the terminal: everything that a command prints passes here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import typer

from fegear.files.errors import one_line
from fegear.files.output import strict_json
from fegear.files.printable import printable


def print_line(text: str) -> None:
    """A line on the screen, as long as it is."""
    typer.echo(printable(text))


def print_error(message: str) -> None:
    """One line on the error stream."""
    typer.echo(f"fegear: {printable(one_line(message))}", err=True)


def print_announcement(line: str) -> None:
    """A warning or another line, on the error stream."""
    from fegear.files.codes import is_warning

    if is_warning(line):
        print_warnings([line])
    else:
        print_error(line)


def print_warnings(warnings: Iterable[str]) -> None:
    """A line for each on the error stream; ValueError for one without its code."""
    from fegear.files.codes import require_warning_code

    for warning in warnings:
        line = require_warning_code(" ".join(warning.split()))
        typer.echo(f"warning: {printable(line)}", err=True)


def print_json(values: Mapping[str, Any]) -> None:
    typer.echo(strict_json(values), nl=False)
