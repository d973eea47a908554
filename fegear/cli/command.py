"""A command that names option, value and what is allowed where words are wrong.

It takes no option twice where the first would change nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperCommand

from fegear.files.errors import InputError

TYPER_OPTIONS: dict[str, Any] = {
    "rich_markup_mode": None,  # square brackets are units
    "pretty_exceptions_enable": False,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}


def add_command(
    group: typer.Typer, name: str, command: Callable[..., None], example: str
) -> None:
    """The example has a line of its own, which is not broken."""
    epilog = f"\b\nExample:\n  {example}"
    group.command(name, cls=RefusingCommand, epilog=epilog)(command)


class RefusingCommand(TyperCommand):
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if ctx.resilient_parsing:  # completing a line that is half written
            return super().parse_args(ctx, args)
        params, _, order = self.make_parser(ctx).parse_args(args=list(args))
        counts = Counter(param.name for param in order)
        for param in order:
            if counts[param.name] > 1 and not getattr(param, "multiple", True):
                times = counts[param.name]
                raise InputError(f"{_option_name(param)} is given {times} times")
            value = params[param.name]
            values = value if isinstance(value, list | tuple) else [value]
            if "" in values and param.param_type_name == "option":
                raise InputError(f"{_option_name(param)} is empty; a value is needed")
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            wrong: Any = getattr(error, "param", None)
            if wrong is None or params.get(wrong.name) is None:  # missing
                raise
            reason = _shown_reason(str(getattr(error, "message", error)))
            value = params[wrong.name]
            shown = ", ".join(value) if isinstance(value, list) else value
            raise InputError(f"{_option_name(wrong)} = {shown}; {reason}") from None


def _option_name(param: Any) -> str:
    return str(max(param.opts, key=len))


def _shown_reason(message: str) -> str:
    """Rewrite the parser's message in our style."""
    if "integer" in message:
        return "must be a whole number"
    if "number" in message or "float" in message:
        return "must be a number"
    _, is_choice, allowed = message.partition(" is not one of ")
    if not is_choice:
        return message
    *others, last = allowed.rstrip(".").replace("'", "").split(", ")
    return f"must be {', '.join(others)} or {last}" if others else f"must be {last}"
