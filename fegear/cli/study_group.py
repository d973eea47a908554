"""Groups of commands in which those of studies are loaded when they are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import typer
from typer.core import TyperGroup

from fegear.cli.command import TYPER_OPTIONS, add_command
from fegear.studies import ALIASES, STUDIES, load_study


def group_class(names: Sequence[str], prefix: str = "") -> type[TyperGroup]:
    """A class of groups with commands in this order, some of which are studies.

    prefix : words before the name in the commands of studies
    """

    class LazyGroup(TyperGroup):
        def list_commands(self, ctx: Any) -> list[str]:
            return [n for n in names if prefix + n in STUDIES or n in self.commands]

        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            cmd_name = ALIASES.get(prefix + cmd_name, cmd_name)
            command = super().get_command(ctx, cmd_name)
            if command is None and prefix + cmd_name in STUDIES:
                command = _load_command(prefix + cmd_name, cmd_name)
                self.add_command(command, cmd_name)
            return command

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            commands = self.list_commands(ctx)
            rows = [(name, self._summary(ctx, name)) for name in commands]
            with formatter.section("Commands"):
                formatter.write_dl(rows)

        def _summary(self, ctx: Any, name: str) -> str:
            """The first line of the help, without loading the study."""
            if prefix + name in STUDIES:
                return STUDIES[prefix + name][2]
            command: Any = super().get_command(ctx, name)
            return str(command.help).partition("\n\n")[0].replace("\n", " ")

    return LazyGroup


def _load_command(command: str, name: str) -> Any:
    from fegear.cli.studies import command_of

    study = load_study(command)
    single = typer.Typer(add_completion=False, **TYPER_OPTIONS)
    add_command(single, name, command_of(study), study.example)
    return typer.main.get_command(single)
