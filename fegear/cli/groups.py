"""Options that several commands share, declared once as fields of a frozen dataclass.

A parameter of a command whose type is such a dataclass stands for all its fields:

    @dataclass(frozen=True, kw_only=True)
    class Outputs:
        output: Annotated[Path | None, typer.Option("-o", "--output")] = None

    @grouped
    def show(name: str, outputs: Outputs) -> None: ...

A group may hold other groups. What it checks in `__post_init__` is checked before the
command runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from inspect import Parameter, Signature, signature
from typing import Any, get_type_hints


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """The command as typer sees it: every group spread into its options."""
    hints = get_type_hints(command, include_extras=True)
    given = signature(command).parameters.values()
    groups = {p.name: hints[p.name] for p in given if is_dataclass(hints[p.name])}
    options = [option for p in given for option in _options(p, hints[p.name])]

    def run(**values: Any) -> None:
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
        for inner in signature(group).parameters.values():
            yield from _options(inner, hints[inner.name])
    else:
        yield parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=annotation)


def _gathered(group: Any, values: dict[str, Any]) -> Any:
    """A value of the group, whose options are taken out of the values."""
    hints = get_type_hints(group)
    return group(
        **{
            field.name: _gathered(hints[field.name], values)
            if is_dataclass(hints[field.name])
            else values.pop(field.name)
            for field in fields(group)
        }
    )
