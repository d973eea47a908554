"""A command that takes no option twice, where the first would change nothing."""

from __future__ import annotations

from collections import Counter
from typing import Any

from typer.core import TyperCommand


class Command(TyperCommand):
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        from fegear.errors import InputError

        if not ctx.resilient_parsing:  # completing a line that is half written
            _, _, order = self.make_parser(ctx).parse_args(args=list(args))
            counts = Counter(param.name for param in order)
            for param in order:
                if counts[param.name] > 1 and not getattr(param, "multiple", True):
                    times = counts[param.name]
                    raise InputError(
                        f"{param.opts[-1]} is given {times} times; once is allowed"
                    )
        return super().parse_args(ctx, args)
