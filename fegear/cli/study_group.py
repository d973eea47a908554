"""Groups of commands in which those of studies are loaded when they are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import typer
from typer.core import TyperGroup

from fegear.cli.command import TYPER_OPTIONS, add_command
from fegear.files.errors import nearest
from fegear.studies import load_study
from fegear.studies.registry import commands


def group_class(
    sections: Mapping[str, Sequence[str]], prefix: str = ""
) -> type[TyperGroup]:
    """A class of groups with commands in this order, some of which are studies.

    sections : names of commands by the heading that the help gives them
    prefix : words before the name in the commands of studies
    """

    class LazyGroup(TyperGroup):
        def list_commands(self, ctx: Any) -> list[str]:
            return [name for names in sections.values() for name in names]

        def get_command(self, ctx: Any, cmd_name: str) -> Any:
            command = super().get_command(ctx, cmd_name)
            if command is None and prefix + cmd_name in commands():
                command = _load_command(prefix + cmd_name, cmd_name)
                self.add_command(command, cmd_name)
            return command

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            if self.get_command(ctx, args[0]) is None:
                hint = nearest(args[0], self.list_commands(ctx))
                ctx.fail(f"no such command {args[0]}{hint}")
            return super().resolve_command(ctx, args)

        def format_commands(self, ctx: Any, formatter: Any) -> None:
            width = max(map(len, self.list_commands(ctx)))
            for heading, names in sections.items():
                rows = [(name.ljust(width), self._summary(ctx, name)) for name in names]
                with formatter.section(heading):
                    formatter.write_dl(rows)

        def _summary(self, ctx: Any, name: str) -> str:
            """The first line of the help, without loading the study."""
            if prefix + name in commands():
                return commands()[prefix + name].title
            command: Any = super().get_command(ctx, name)
            return str(command.help).partition("\n\n")[0].replace("\n", " ")

    return LazyGroup


def _load_command(command: str, name: str) -> Any:
    from fegear.cli.studies import command_of

    study = load_study(command)
    single = typer.Typer(add_completion=False, **TYPER_OPTIONS)
    add_command(single, name, command_of(study), study.example)
    return typer.main.get_command(single)
