"""Commands of the command line as tests run them, and all of them."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
from typer.testing import CliRunner

from fegear.cli import app

ROOT_COMMAND = typer.main.get_command(app)


def commands(group: Any = ROOT_COMMAND, path: str = "") -> Iterator[tuple[str, Any]]:
    """Commands by their words, those of groups too."""
    for name in group.list_commands(None):
        command, words = group.get_command(None, name), f"{path} {name}".strip()
        if hasattr(command, "commands"):
            yield from commands(command, words)
        else:
            yield words, command


def printed(*words: object, code: int = 0) -> str:
    """What a command prints that ends with a code."""
    result = CliRunner().invoke(app, list(map(str, words)))
    assert result.exit_code == code, result.output
    return result.stdout


def rows_of(path: Path) -> list[dict[str, str]]:
    """Of a CSV file that a command has written."""
    lines = path.read_text("utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
