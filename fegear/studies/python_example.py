"""The example of a command as the call in Python that does the same."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from types import NoneType
from typing import Any, get_args, get_origin

from fegear.studies.public import public_homes
from fegear.studies.settings import (
    ExposedField,
    Setting,
    exposed_fields,
    group_of,
    option_names,
)

_Path = tuple[ExposedField, ...]  # through groups to a setting
RUN = "result = fegear.run(study)"


@dataclass
class _SettingsCall:
    """Settings that an example gives to a class, as text of Python."""

    kind: type
    values: dict[str, Any] = field(default_factory=dict)

    def give(self, path: _Path, text: str) -> None:
        first, *rest = path
        if first.group is not None:
            inner = self.values.setdefault(first.name, _SettingsCall(first.group.kind))
            inner.give(tuple(rest), text)
        elif _is_list(first):
            self.values[first.name] = (*self.values.get(first.name, ()), text)
        else:
            self.values[first.name] = text

    @property
    def kinds(self) -> set[str]:
        """Classes that are named, in it and in what it holds."""
        inner = [v for v in self.values.values() if isinstance(v, _SettingsCall)]
        return {self.kind.__name__}.union(*(v.kinds for v in inner if not v.is_name))

    @property
    def is_name(self) -> bool:
        """Whether a name may stand for it."""
        return [*self.values] == ["name"]

    @property
    def text(self) -> str:
        settings = ", ".join(
            f"{name}={_text_code(v)}" for name, v in self.values.items()
        )
        return f"fegear.{self.kind.__name__}({settings})"


def python_example(study: Any) -> list[str]:
    """Lines that make the study of the command's example, run it and write files.

    None where that needs a class which is not public.
    """
    _, *arguments = shlex.split(study.example)
    del arguments[: len(study.command.split())]
    places, options = list[_Path](), dict[str, _Path]()
    for path in _setting_paths(group_of(study)):
        if isinstance(path[-1].declared, Setting) and path[-1].declared.place:
            places.append(path)
        else:
            options |= dict.fromkeys(option_names(path[-1].option), path)
    settings, files = _SettingsCall(study), list[str]()
    while arguments:
        word = arguments.pop(0)
        if word in options:
            path = options[word]
            is_flag = _value_type(path[-1]) is bool
            settings.give(
                path, "True" if is_flag else _value_code(path, arguments.pop(0))
            )
        elif word.startswith("-"):
            files.append(
                _file_code(study, word.lstrip("-").replace("-", "_"), arguments.pop(0))
            )
        else:
            path = places[0]
            settings.give(path, _value_code(path, word))
            if not _is_list(path[-1]):
                del places[0]
    if not settings.kinds <= set(public_homes().keys()):
        return []
    return [f"study = {settings.text}", RUN, *files]


def _setting_paths(group: Any) -> Iterator[_Path]:
    """Ways to the settings of a group and of the groups in it."""
    for member in exposed_fields(group):
        if member.group is None:
            yield (member,)
        else:
            yield from ((member, *path) for path in _setting_paths(member.group))


def _value_type(member: ExposedField) -> Any:
    """Type of a value, or of each of several."""
    kinds = [kind for kind in get_args(member.kind) if kind not in (NoneType, ...)]
    return kinds[0] if len(kinds) == 1 else member.kind


def _is_list(member: ExposedField) -> bool:
    """Whether it has several values, of which the command line gives one at a time."""
    is_read_whole = getattr(member.declared, "parse", None) is not None
    several = getattr(member.declared, "several", False) or not is_read_whole
    return get_origin(member.kind) is tuple and several


def _value_code(path: _Path, word: str) -> str:
    """A value of the command line as it is written in Python.

    A study reads text of its settings, a group in it does not.
    """
    member = path[-1]
    parse = getattr(member.declared, "parse", None)
    with suppress(ValueError):
        if _value_type(member) in (int, float):
            return repr(_value_type(member)(word))
        if parse is not None and len(path) > 1:
            return repr(parse(word))
    return f'"{word}"'


def _text_code(value: Any) -> str:
    if isinstance(value, _SettingsCall):
        return str(value.values["name"]) if value.is_name else value.text
    if isinstance(value, tuple):
        return f"[{', '.join(value)}]"
    return str(value)


def _file_code(study: Any, name: str, path: str) -> str:
    """The call that writes a file of the result."""
    if name == "plot":
        return f'result.draw("{path}")'
    if name in study.pictures:
        return f'result.draw("{path}", "{name}")'
    if name in study.more_tables:
        return f'result.write_table("{path}", "{name}")'
    if name in study.more_files:
        return f'result.more_files["{name}"]("{path}")'
    return f'result.write("{path}")'
