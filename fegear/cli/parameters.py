"""Parameters of a command as typer sees them: settings of a study, one by one.

A field of a study that is a group of settings, or a dataclass with settings, stands for
all of its settings. `Range` in an annotation is checked before the command runs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING
from inspect import Parameter
from keyword import iskeyword
from typing import Annotated, Any, get_args, get_origin

import typer

from fegear.files.errors import InputError
from fegear.studies.settings import (
    AS_OPTIONS,
    ExposedField,
    Setting,
    SettingsGroup,
    exposed_fields,
    option_names,
    options_of,
    parse_setting,
    parse_several,
)
from lumped.common.checks import format_number
from lumped.common.options import Range

NAMED_PART = re.compile(r'"|\d+(:| has )')  # a mesh or gear after its kind


def setting_parameters(group: SettingsGroup, value: Any = None) -> Iterator[Parameter]:
    """A parameter for each setting of a group, those of inner groups among them.

    value : of the group, whose settings are the defaults; None for those of its class
    """
    for member in exposed_fields(group):
        default = member.default
        if isinstance(value, group.kind):
            default = getattr(value, member.name)
        if isinstance(member.declared, Setting):
            yield _setting_parameter(member, member.declared, default)
        elif member.group is not None:
            yield from setting_parameters(member.group, default)


def option_parameter(
    name: str, kind: Any, text: str, *names: str, default: Any = None, **shown: Any
) -> Parameter:
    """The parameter of an option that is no setting; default : MISSING for none.

    names : where they are not that of the parameter
    """
    shown_default = Parameter.empty if default is MISSING else default
    annotation = Annotated[kind, typer.Option(*names, help=text, **shown)]
    return Parameter(
        name, Parameter.KEYWORD_ONLY, default=shown_default, annotation=annotation
    )


def _setting_parameter(
    member: ExposedField, declared: Setting, default: Any
) -> Parameter:
    """Option or argument of typer's, with its range."""
    kind = member.kind if declared.parse is None else str | None
    if declared.several:
        kind = list[str] | None
    elif get_origin(kind) is tuple:
        kind = list[get_args(kind)[0]] | None  # type: ignore[misc]
    info: Any
    if declared.place:
        info = typer.Argument(metavar=declared.place, help=declared.text)
    else:
        names = option_names(declared.option) if declared.option else ()
        info = typer.Option(*names, help=declared.text, metavar=declared.metavar)
    return Parameter(
        _parameter_of(member.name, declared),
        Parameter.KEYWORD_ONLY,
        default=_parameter_default(declared, default),
        annotation=Annotated[kind, info, None if declared.parse else declared.allowed],
    )


def _parameter_default(declared: Setting, value: Any) -> Any:
    """A default as the command line has it."""
    if value is MISSING:
        return Parameter.empty
    if value is None or value == ():
        return None
    return declared.write(value) if declared.parse else value


def _parameter_of(name: str, declared: Setting) -> str:
    """The parameter of a setting, that of its option: fields may have one name."""
    name = declared.option.removeprefix("--").replace("-", "_") or name
    return f"{name}_" if iskeyword(name) else name


def require_allowed(parameters: Iterable[Parameter], values: Mapping[str, Any]) -> None:
    """InputError for a number, or one of several, out of the range of its option."""
    for parameter in parameters:
        value = values[parameter.name]
        numbers = value if isinstance(value, list) else [value]
        for allowed in get_args(parameter.annotation)[1:]:
            for number in numbers if isinstance(allowed, Range) else ():
                if number is not None and number not in allowed:
                    name = parameter.name.replace("_", "-")
                    raise InputError(
                        f"--{name} = {format_number(number)}; must be {allowed}"
                    )


def group_value(group: SettingsGroup, values: dict[str, Any]) -> Any:
    """A value of the group, whose settings are taken out of those of parameters."""
    arguments = dict[str, Any]()
    with named_as_options(group, every=True):
        for member in exposed_fields(group):
            if isinstance(member.declared, Setting):
                arguments |= _setting_value(member, member.declared, values)
            elif member.group is not None:
                arguments[member.name] = group_value(member.group, values)
        return group.kind(**arguments)


def _setting_value(
    member: ExposedField, declared: Setting, values: dict[str, Any]
) -> dict[str, Any]:
    """The value of a setting by its name, nothing where none is given."""
    value = values.pop(_parameter_of(member.name, declared), None)
    if value is not None and declared.parse is not None:
        parse = parse_several if declared.several else parse_setting
        value = parse(member, value)
    if isinstance(value, list):
        value = tuple(value)
    return {} if value is None else {member.name: value}


@contextmanager
def named_as_options(group: SettingsGroup, every: bool = False) -> Iterator[None]:
    """Errors that begin with the name of a setting begin with its option instead.

    every : whether every other ValueError becomes an InputError too
    """
    names, token = options_of(group), AS_OPTIONS.set(True)
    try:
        yield
    except ValueError as error:
        name, _, rest = str(error).partition(" ")
        if NAMED_PART.match(rest):  # a mesh or gear of the set, and no setting
            name = ""
        if name not in names and every:
            raise InputError(str(error)) from None
        if name not in names:
            raise
        # None is an option that is not given
        message = f"{names[name]} {rest}".removesuffix(" or None")
        raise InputError(message) from None
    finally:
        AS_OPTIONS.reset(token)
