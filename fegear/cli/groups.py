"""Options that several commands share, declared once as fields of a frozen dataclass.

A parameter of a command whose type is such a dataclass represents all its fields:

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
from dataclasses import field, fields, is_dataclass
from inspect import Parameter, Signature, signature
from keyword import iskeyword
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer

from fegear.files.errors import InputError
from fegear.studies.settings import (
    AS_OPTIONS,
    ExposedField,
    Setting,
    SettingsGroup,
    declared_fields,
    exposed_fields,
    options_of,
    parse_setting,
    parse_several,
)
from lumped.common.options import Range


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
    parameters = signature(command).parameters.values()
    groups = {p.name: hints[p.name] for p in parameters if is_dataclass(hints[p.name])}
    options = [option for p in parameters for option in _options(p, hints[p.name])]

    def run(**values: Any) -> None:
        for parameter in options:
            _require_allowed(parameter, values[parameter.name])
        for name, group in groups.items():
            values[name] = _gathered(_group_of(group), values)
        command(**values)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__module__ = command.__module__
    run.__annotations__ = {option.name: option.annotation for option in options}
    run.__dict__["__signature__"] = Signature(options)
    return run


def _options(
    parameter: Parameter, annotation: Any, group: SettingsGroup | None = None
) -> Iterator[Parameter]:
    """The parameter by keyword, or the parameters of the group that it represents."""
    if not is_dataclass(annotation):
        yield parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=annotation)
        return
    group = group or _group_of(annotation)
    hints = get_type_hints(group.kind, include_extras=True)
    parameters = signature(group.kind).parameters
    for member in exposed_fields(group):
        child, declared = parameters[member.name], member.declared
        if isinstance(parameter.default, group.kind):  # stronger than its class's own
            child = child.replace(default=getattr(parameter.default, member.name))
        if isinstance(declared, Setting):
            yield from _of_setting(child, declared, hints[member.name])
        elif member.group is not None:
            inner = None if declared is None else member.group
            yield from _options(child, member.group.kind, inner)
        else:
            typed = member.field.metadata.get("typer")
            hint = hints[member.name]
            yield from _options(child, Annotated[hint, *typed] if typed else hint)


def _group_of(kind: Any) -> SettingsGroup:
    """What a dataclass declares, options of typer's among it."""
    declarations = declared_fields(kind)
    if any(declarations.values()):
        return SettingsGroup(kind=kind, exposed=declarations)
    return SettingsGroup(
        kind=kind, exposed={e.name: declarations.get(e.name, ()) for e in fields(kind)}
    )


def _of_setting(
    parameter: Parameter, declared: Setting, hint: Any
) -> Iterator[Parameter]:
    """Option or argument of typer's, with its range, and one for each flag."""
    kind = hint if declared.parse is None else str | None
    if declared.several:
        kind = list[str] | None
    elif get_origin(hint) is tuple and declared.parse is None:
        kind = list[get_args(hint)[0]] | None  # type: ignore[misc]
    default = None if parameter.default == () else parameter.default
    if default is not None and default is not Parameter.empty and declared.parse:
        default = declared.write(default)
    if declared.place:
        info = typer.Argument(metavar=declared.place, help=declared.text)
    else:
        names = list(filter(None, (declared.short, declared.option)))
        info = typer.Option(*names, help=declared.text, metavar=declared.metavar)
    if not (declared.flags and hint is bool):
        yield parameter.replace(
            name=_parameter(parameter.name, declared),
            kind=Parameter.KEYWORD_ONLY,
            default=default,
            annotation=Annotated[
                kind, info, None if declared.parse else declared.allowed
            ],
        )
    for flag, _, text in declared.flags:
        shown = Annotated[bool, typer.Option(flag, help=text)]
        yield Parameter(
            _name_of(flag), Parameter.KEYWORD_ONLY, default=False, annotation=shown
        )


def _parameter(name: str, declared: Setting) -> str:
    """The parameter of a setting, that of its option: fields may have one name."""
    return _name_of(declared.option) if declared.option else name


def _name_of(flag: str) -> str:
    name = flag.removeprefix("--").replace("-", "_")
    return f"{name}_" if iskeyword(name) else name


def _require_allowed(option: Parameter, value: Any) -> None:
    """InputError for a number, or one of several, out of the option's range."""
    ranges = get_args(option.annotation)[1:]
    for allowed in (
        annotation for annotation in ranges if isinstance(annotation, Range)
    ):
        for number in value if isinstance(value, list) else [value]:
            if number is not None and number not in allowed:
                name = option.name.replace("_", "-")
                raise InputError(f"--{name} = {number:.12g}; allowed {allowed}")


def _gathered(group: SettingsGroup, values: dict[str, Any]) -> Any:
    """A value of the group, whose options are taken out of the values."""
    arguments = dict[str, Any]()
    with named_as_options(group, every=True):
        for member in exposed_fields(group):
            if isinstance(member.declared, Setting):
                arguments |= _taken(member, member.declared, values)
            elif member.group is not None:
                inner = (
                    _group_of(member.kind) if member.declared is None else member.group
                )
                arguments[member.name] = _gathered(inner, values)
            else:
                arguments[member.name] = values.pop(member.name)
        return group.kind(**arguments)


def _taken(
    member: ExposedField, declared: Setting, values: dict[str, Any]
) -> dict[str, Any]:
    """The value of a setting by its name, nothing where none is given."""
    value = values.pop(_parameter(member.name, declared), None)
    flags = {
        flag: meant for flag, meant, _ in declared.flags if values.pop(_name_of(flag))
    }
    if value is not None and declared.parse is not None:
        value = (
            parse_several(member, value)
            if declared.several
            else parse_setting(member, value)
        )
    options = [*flags, *([member.option] if flags and value is not None else [])]
    if len(options) > 1:
        raise InputError(f"{options[1]}; {options[0]} replaces it, leave it out")
    for meant in flags.values():
        value = meant
    if isinstance(value, list):
        value = tuple(value)
    return {} if value is None else {member.name: value}


@contextmanager
def named_as_options(group: SettingsGroup, every: bool = False) -> Iterator[None]:
    """Errors that begin with the name of a setting begin with its option instead.

    every : whether other errors of values are those of the input as well
    """
    names, token = options_of(group), AS_OPTIONS.set(True)
    try:
        yield
    except ValueError as error:
        name, _, rest = str(error).partition(" ")
        if name not in names and every:
            raise InputError(str(error)) from None
        if name not in names:
            raise
        raise InputError(f"{names[name]} {rest}") from None
    finally:
        AS_OPTIONS.reset(token)
