"""Options that several commands share, declared once as fields of a frozen dataclass.

A parameter of a command whose type is such a dataclass stands for all its fields:

    @dataclass(frozen=True, kw_only=True)
    class Outputs:
        output: Path | None = option("Write the results to this file.")

    @grouped
    def show(name: str, outputs: Outputs) -> None: ...

A field is an option by `option` or a setting of a study, has an annotated type of
typer's, or is a group again. A `Range` in the type, and what a group asks for in
`__post_init__`, are checked before the command runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, Field, field, fields, is_dataclass
from inspect import Parameter, Signature, signature
from typing import Annotated, Any, get_args, get_type_hints

import typer

from fegear.errors import InputError
from fegear.studies.study import Range, Setting, option_of, setting_of


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
    if not is_dataclass(annotation):
        yield parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=annotation)
        return
    hints = get_type_hints(annotation, include_extras=True)
    group: Any = annotation
    inner = signature(group).parameters
    for each in fields(annotation):
        own, kind = inner[each.name], _annotated(each, hints[each.name])
        declared = setting_of(each)
        if declared is not None and declared.read is not None:
            own = own.replace(default=_written(each, declared))
        yield from _options(own, kind)


def _annotated(each: Field[Any], hint: Any) -> Any:
    """The type with its option, where the field is one."""
    declared = setting_of(each)
    if declared is not None:
        return Annotated[*_words_of(declared, hint)]
    return Annotated[hint, *each.metadata["typer"]] if each.metadata else hint


def _words_of(declared: Setting, hint: Any) -> tuple[Any, ...]:
    """Type on the command line, option or argument of typer's, range."""
    kind = hint if declared.read is None else str | None
    if declared.place:
        return kind, typer.Argument(metavar=declared.place, help=declared.text)
    names = [declared.option] if declared.option else []
    shown = typer.Option(*names, help=declared.text, metavar=declared.metavar)
    return kind, shown, declared.allowed


def _written(each: Field[Any], declared: Setting) -> Any:
    """The default in the words of the command line."""
    if each.default is MISSING:
        return Parameter.empty
    return None if each.default is None else declared.write(each.default)


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
    hints, given = get_type_hints(group), dict[str, Any]()
    with named_as_options(group):
        for each in fields(group):
            if is_dataclass(hints[each.name]):
                given[each.name] = _gathered(hints[each.name], values)
                continue
            value, declared = values.pop(each.name), setting_of(each)
            if value is not None and declared is not None and declared.read is not None:
                value = declared.read(value)
            given[each.name] = value
        return group(**given)


@contextmanager
def named_as_options(group: Any) -> Iterator[None]:
    """Errors that begin with the name of a field begin with its option instead."""
    names = {each.name: option_of(each) for each in fields(group)}
    try:
        yield
    except InputError as error:
        name, _, rest = str(error).partition(" ")
        if name not in names:
            raise
        raise InputError(f"{names[name]} {rest}") from None
