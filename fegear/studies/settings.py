"""Settings of studies: declared once with help and limits, given as values or as text.

A field whose type is a dataclass represents its fields; by `group` it may be a class of
the library that knows of no options.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass, replace
from functools import lru_cache
from itertools import chain
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

from fegear.files.errors import InputError
from lumped.common.options import Range, allowed_of, help_of


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Help, limits and text form of a field.

    text : that of the field itself where it is empty
    option : its name on the command line, that of the field where it is empty; a field
        with `place` has none, it is found by its place
    reads : whether it names files that are read; checkpoints depend on their content
    parse, write : convert text to a value and back, where types do not say how
    several : whether the option is repeated for a tuple of values that are read, of
        which a text may give more than one, as a tuple
    """

    text: str = ""
    allowed: Range | None = None
    option: str = ""
    place: str = ""
    metavar: str | None = None
    reads: bool = False
    several: bool = False
    parse: Callable[[str], Any] | None = None
    write: Callable[[Any], str] = str  # of floats to the last bit


UnusedOptions = Callable[[Any], Iterator[tuple[str, str]]]


@dataclass(frozen=True, kw_only=True)
class SettingsGroup:
    """A field whose value has settings of its own.

    kind : its class; exposed : which fields of it are settings here, and how
    unused_options : as `Study.unused_options`, of a value of the class
    default : its value where it is not given, None for that of the class
    """

    kind: type
    exposed: Mapping[str, Setting | SettingsGroup]
    unused_options: UnusedOptions = lambda value: iter(())
    default: Any = None


def expose(
    *names: str, **changes: Setting | SettingsGroup
) -> dict[str, Setting | SettingsGroup]:
    """Fields of a class of options, in order, some with changes on the command line."""
    return {name: changes.get(name, Setting()) for name in names}


def setting(
    default: Any, text: str, allowed: Range | None = None, **options: Any
) -> Any:
    """A field of a study; options : see `Setting`."""
    declared = Setting(text=text, allowed=allowed, **options)
    return field(default=default, metadata={"setting": declared})


def setting_of(kind: type, name: str, **options: Any) -> Any:
    """A field of a study that is the option of a class; options : see `Setting`."""
    entry = next(entry for entry in fields(kind) if entry.name == name)
    text = help_of(kind, name)
    return setting(entry.default, text, allowed_of(entry), **options)


def argument(place: str, text: str, default: Any = MISSING, reads: bool = False) -> Any:
    """A positional argument of a command.

    reads : whether it is, or may be, the name of a file that is read
    """
    declared = Setting(text=text, place=place, reads=reads)
    return field(default=default, metadata={"setting": declared})


def group(declared: SettingsGroup) -> Any:
    """A field with settings of its own, by default those of the group."""
    metadata = {"group": declared}
    if declared.default is not None:
        return field(default=declared.default, metadata=metadata)
    return field(default_factory=declared.kind, metadata=metadata)


@dataclass(frozen=True)
class ExposedField:
    """A setting of a class, as a study or group offers it."""

    field: Field[Any]
    kind: Any  # annotated type
    declared: (
        Setting | SettingsGroup | None
    )  # None for a dataclass with its own settings
    default: Any

    @property
    def name(self) -> str:
        return self.field.name

    @property
    def option(self) -> str:
        """Its name on the command line."""
        named = self.declared.option if isinstance(self.declared, Setting) else ""
        return named or f"--{self.name.replace('_', '-')}"

    @property
    def group(self) -> SettingsGroup | None:
        """The group that it represents, if it does."""
        if self.declared is None:
            return group_of(self.kind)
        return self.declared if isinstance(self.declared, SettingsGroup) else None


def option_names(option: str) -> list[str]:
    """An option, after its short name where it has one."""
    return ["-o", option] if option == "--output" else [option]


def parse_setting(member: ExposedField, text: str) -> Any:
    """Parse a setting from its command-line text."""
    parse = getattr(member.declared, "parse", None)
    if parse is None:
        raise InputError(f"{member.name} = {text}; is no setting that text gives")
    try:
        return parse(text)
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{member.name} = {text}; {error}") from None


def parse_several(member: ExposedField, values: Iterable[Any]) -> tuple[Any, ...]:
    """Values of a setting that is repeated, each of which may be given as text."""
    return tuple(chain.from_iterable(_parsed_values(member, v) for v in values))


def _parsed_values(member: ExposedField, value: Any) -> tuple[Any, ...]:
    parsed = parse_setting(member, value) if isinstance(value, str) else value
    gives_several = isinstance(value, str) and type(parsed) is tuple
    return parsed if gives_several else (parsed,)


def read_value(member: ExposedField, value: Any) -> Any:
    """A value of a setting, which may be given as text, or of a group by its `of`."""
    declared = member.declared
    if member.group is not None:
        kind: Any = member.group.kind
        converts = hasattr(kind, "of") and not isinstance(value, kind)
        return kind.of(value) if converts else value
    if not isinstance(declared, Setting):
        return value
    value = _as_one_or_several_values(value, member.kind)
    if declared.parse is None:
        return value
    if declared.several and isinstance(value, list | tuple):
        return parse_several(member, value)
    if not isinstance(value, str):
        return value
    several = declared.several
    return parse_several(member, [value]) if several else parse_setting(member, value)


@lru_cache(maxsize=256)
def _type_hints(kind: Any) -> dict[str, Any]:
    """Types of the fields of a class, which take long to resolve."""
    return get_type_hints(kind)


@lru_cache(maxsize=256)
def declared_fields(kind: Any) -> dict[str, Any]:
    """Declared fields of a dataclass, in the order of its help.

    What is found by its place comes first, then its settings, then groups; None for a
    dataclass with its own settings.
    """
    places, settings, groups = dict[str, Any](), dict[str, Any](), dict[str, Any]()
    hints = _type_hints(kind)
    for member in fields(kind):
        declared = member.metadata.get("setting") or member.metadata.get("group")
        if declared is None and not is_dataclass(hints[member.name]):
            continue
        inner = [declared] if declared else declared_fields(hints[member.name]).values()
        if any(getattr(setting, "place", "") for setting in inner):
            places[member.name] = declared
        elif isinstance(declared, Setting):
            settings[member.name] = declared
        else:
            groups[member.name] = declared
    return places | settings | groups


def exposed_fields(group: SettingsGroup) -> Iterator[ExposedField]:
    """Settings of a group, in order."""
    hints, by_name = _type_hints(group.kind), {f.name: f for f in fields(group.kind)}
    options = {
        name: getattr(declared, "option", "") or f"--{name.replace('_', '-')}"
        for name, declared in group.exposed.items()
    }
    for name, declared in group.exposed.items():
        entry = by_name[name]
        default = getattr(group.default, name, entry.default)
        if isinstance(declared, Setting):
            text = declared.text or help_of(group.kind, name, options)
            declared = replace(declared, text=text)
        yield ExposedField(entry, hints[name], declared, default)


def to_argv(settings: Any, group: SettingsGroup | None = None) -> list[str]:
    """Command-line arguments that give the settings which are not default."""
    places, options = list[str](), list[str]()
    group = group or group_of(settings)
    if not isinstance(settings, group.kind):
        raise InputError(f"{settings!r} has no words of a command")
    for member in exposed_fields(group):
        value = getattr(settings, member.name)
        if member.group is not None:
            options += to_argv(value, member.group)
            continue
        declared = member.declared
        if not isinstance(declared, Setting):
            continue
        if declared.place:
            places += map(str, value if isinstance(value, tuple) else [value])
        elif value != member.default:
            name = option_names(member.option)[0]
            options += _option_words(name, declared, value)
    return [*places, *options]


def _as_one_or_several_values(value: Any, kind: Any) -> Any:
    """One number for a setting of several, and the only one of a list for one."""
    kinds = get_args(kind) if isinstance(kind, UnionType) else (kind,)
    if any(get_origin(one) is tuple and get_args(one)[1:] == (...,) for one in kinds):
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return (value,) if is_number else value
    takes_one = not any(get_origin(one) is tuple for one in kinds)
    is_list = isinstance(value, list | tuple) and len(value) == 1
    return value[0] if is_list and takes_one else value


def options_of(group: SettingsGroup) -> dict[str, str]:
    """Options by the names of settings, those of groups among them."""
    options: dict[str, str] = {}
    for member in exposed_fields(group):
        if member.group is not None:
            options = options_of(member.group) | options
        elif not getattr(member.declared, "place", ""):
            options[member.name] = member.option
    return options


def group_of(settings: Any) -> SettingsGroup:
    """Fields that a dataclass, or a value of one, declares itself."""
    kind = settings if isinstance(settings, type) else type(settings)
    return SettingsGroup(kind=kind, exposed=declared_fields(kind))


def _option_words(option: str, declared: Setting, value: Any) -> list[str]:
    if isinstance(value, bool):
        return [option if value else option.replace("--", "--no-", 1)]
    is_one_word = declared.parse is not None and not declared.several
    values = value if isinstance(value, tuple) and not is_one_word else (value,)
    return [word for item in values for word in (option, declared.write(item))]


def take_plain_values(settings: Any) -> None:
    """Lists and arrays become tuples, paths text, and numbers Python's."""
    for name, value in vars(settings).items():
        if value is not (plain := _plain_value(value)):
            object.__setattr__(settings, name, plain)


def _plain_value(value: Any) -> Any:
    from lumped.common.checks import plain_numbers

    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | range) or type(value) is tuple:
        return tuple(map(_plain_value, value))
    return plain_numbers(value)


def require_settings(settings: Any) -> None:
    """Raise InputError for a field outside its type or range.

    See also `take_plain_values`.
    """
    from lumped.common.checks import format_value, is_number, require_fields

    take_plain_values(settings)
    infinite = []
    for member in exposed_fields(group_of(settings)):
        allowed = getattr(member.declared, "allowed", None)
        if allowed is None:
            continue
        infinite += [member.name] * allowed.or_infinite
        values = getattr(settings, member.name)
        for value in values if isinstance(values, tuple) else (values,):
            if is_number(value) and value not in allowed:
                text = shown(value) if isinstance(value, float) else format_value(value)
                raise InputError(f"{member.name} = {text}; must be {allowed}")
    try:
        require_fields(settings, infinite=infinite)
    except ValueError as error:
        raise InputError(str(error)) from None


# whether messages call settings by their options, as on the command line
AS_OPTIONS = ContextVar("AS_OPTIONS", default=False)


def display_name(settings: Any, name: str) -> str:
    """Name of a setting in messages: its option or its field."""
    return _name_in_message(group_of(settings), name)


def _name_in_message(group: SettingsGroup, name: str) -> str:
    return options_of(group).get(name, name) if AS_OPTIONS.get() else name


def refuse_unused_settings(settings: Any, group: SettingsGroup) -> None:
    """Raise InputError for a setting that is given and changes nothing."""
    if not isinstance(settings, group.kind):
        return
    for member in exposed_fields(group):
        if member.group is not None:
            refuse_unused_settings(getattr(settings, member.name), member.group)
    defaults = {member.name: member.default for member in exposed_fields(group)}
    for name, reason in group.unused_options(settings):
        if name in defaults and getattr(settings, name) != defaults[name]:
            raise refusal(settings, name, reason, group)


def refusal(
    settings: Any, name: str, reason: str, group: SettingsGroup | None = None
) -> InputError:
    """Why the value of a setting is refused; names in braces are those of settings."""
    group = group or group_of(settings)
    value, names = getattr(settings, name), options_of(group)
    value_text = "" if value is True else f" = {stated(settings, name, group)}"
    name_in_message = _name_in_message(group, name)
    reason = reason.format_map({key: _name_in_message(group, key) for key in names})
    return InputError(f"{name_in_message}{value_text}; {reason}")


def refuse_non_default(
    settings: Any, names: Sequence[str], reason: str, group: SettingsGroup
) -> None:
    """Refuse the settings that are not the default; see `refusal`."""
    default_settings = group.kind() if group.default is None else group.default
    for name in names:
        if getattr(settings, name) != getattr(default_settings, name):
            raise refusal(settings, name, reason, group)


def stated(settings: Any, name: str, group: SettingsGroup | None = None) -> str:
    """The value of a setting in a message, several values as an option takes them."""
    value, group = getattr(settings, name), group or group_of(settings)
    for member in exposed_fields(group):
        declared = member.declared
        if member.name != name or not isinstance(declared, Setting):
            continue
        if isinstance(value, tuple) and declared.write is not str:
            return declared.write(value)
    return shown(value)


def shown(value: Any) -> str:
    """A value in a message."""
    if isinstance(value, tuple):
        return ", ".join(map(shown, value))
    return f"{value:.12g}" if isinstance(value, float) else str(value)
