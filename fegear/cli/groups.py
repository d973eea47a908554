"""Options that several commands share, declared once as fields of a frozen dataclass.

A parameter of a command whose type is such a dataclass stands for all its fields:

    @dataclass(frozen=True, kw_only=True)
    class Outputs:
        output: Path | None = option("Write the results to this file.")

    @grouped
    def show(name: str, outputs: Outputs) -> None: ...

A field is an option by `option`, has an annotated type of typer's, or is a group again.
A `Range` in the type, and what a group asks for in `__post_init__`, are checked before
the command runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import Field, dataclass, field, fields, is_dataclass
from inspect import Parameter, Signature, signature
from math import inf
from typing import Annotated, Any, get_args, get_type_hints

import typer

from fegear.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Range:
    """Numbers that an option takes: from or above, and to or below."""

    least: float = -inf
    above: float = -inf
    most: float = inf
    below: float = inf
    unit: str = ""

    def __contains__(self, value: float) -> bool:
        inside = self.least <= value <= self.most
        return inside and self.above < value < self.below

    def __str__(self) -> str:
        low = f"above {self.above:.12g}" if self.least == -inf else f"{self.least:.12g}"
        high = f"below {self.below:.12g}" if self.most == inf else f"{self.most:.12g}"
        return f"{low} to {high} {self.unit}".strip()


def option(
    text: str,
    *names: str,
    default: Any = None,
    metavar: str | None = None,
    allowed: Range | None = None,
) -> Any:
    """A field of a group that is an option.

    text : its help; names : where they are not that of the field
    default : `dataclasses.MISSING` where it must be given
    """
    shown = typer.Option(*names, help=text, metavar=metavar)
    return field(default=default, metadata={"typer": (shown, allowed)})


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """The command as typer sees it: every group spread into its options."""
    hints = get_type_hints(command, include_extras=True)
    given = signature(command).parameters.values()
    groups = {p.name: hints[p.name] for p in given if is_dataclass(hints[p.name])}
    options = [option for p in given for option in _options(p, hints[p.name])]

    def run(**values: Any) -> None:
        for each in options:
            _require_allowed(each, values[each.name])
        for name, group in groups.items():
            values[name] = _gathered(group, values)
        command(**values)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__module__ = command.__module__
    run.__annotations__ = {option.name: option.annotation for option in options}
    run.__dict__["__signature__"] = Signature(options)
    return run


def _options(parameter: Parameter, annotation: Any) -> Iterator[Parameter]:
    """The parameter by keyword, or those of the group that it stands for."""
    if is_dataclass(annotation):
        hints = get_type_hints(annotation, include_extras=True)
        group: Any = annotation
        inner = signature(group).parameters
        for each in fields(annotation):
            yield from _options(inner[each.name], _annotated(each, hints[each.name]))
    else:
        yield parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=annotation)


def _annotated(each: Field[Any], hint: Any) -> Any:
    """The type with its option, where the field is one by `option`."""
    return Annotated[hint, *each.metadata["typer"]] if each.metadata else hint


def _require_allowed(option: Parameter, value: Any) -> None:
    """InputError for a number, or one of several, out of the option's range."""
    ranges = get_args(option.annotation)[1:]
    for allowed in (each for each in ranges if isinstance(each, Range)):
        for number in value if isinstance(value, list) else [value]:
            if number is not None and number not in allowed:
                name = option.name.replace("_", "-")
                raise InputError(f"--{name} = {number:.12g}; allowed {allowed}")


def _gathered(group: Any, values: dict[str, Any]) -> Any:
    """A value of the group, whose options are taken out of the values."""
    hints = get_type_hints(group)
    return group(
        **{
            each.name: _gathered(hints[each.name], values)
            if is_dataclass(hints[each.name])
            else values.pop(each.name)
            for each in fields(group)
        }
    )
