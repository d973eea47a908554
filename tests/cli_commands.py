"""Commands of the command line as tests run them, and all of them."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from fegear.cli import app, run

ROOT_COMMAND = typer.main.get_command(app)

PROGRESS = re.compile(r"fegear: [\d.]+ min: ")


def commands(group: Any = ROOT_COMMAND, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the full name and the command of all commands, also those of groups."""
    for name in group.list_commands(None):
        command, full_name = group.get_command(None, name), f"{path} {name}".strip()
        if hasattr(command, "commands"):
            yield from commands(command, full_name)
        else:
            yield full_name, command


def printed(*arguments: object, code: int = 0) -> str:
    """Run a command, which must end with this exit code; return what it prints."""
    result = CliRunner().invoke(app, list(map(str, arguments)))
    assert result.exit_code == code, result.output
    return result.stdout


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run a command, which must end with exit code 2 and one line; return the line."""
    assert run([str(word) for word in arguments]) == 2
    printed, error = capsys.readouterr()
    assert not printed
    # a command prints a line every minute, and a busy machine may take some
    error = "".join(
        line for line in error.splitlines(keepends=True) if not PROGRESS.match(line)
    )
    assert error.startswith("fegear: ")
    assert error.count("\n") == len(error.splitlines()) == 1
    assert "Traceback" not in error
    return error


def rows_of(path: Path) -> list[dict[str, str]]:
    """Of a CSV file that a command has written."""
    lines = path.read_text("utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
