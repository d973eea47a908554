"""All commands of the command line, for tests that go through every one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer

from fegear.cli import app

ROOF = typer.main.get_command(app)


def commands(group: Any = ROOF, path: str = "") -> Iterator[tuple[str, Any]]:
    """Commands by their words, those of groups too."""
    for name, command in group.commands.items():
        words = f"{path} {name}".strip()
        if hasattr(command, "commands"):
            yield from commands(command, words)
        else:
            yield words, command
