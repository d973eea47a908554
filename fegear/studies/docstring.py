"""Docstrings of studies: the settings as their fields declare them, and the command."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any, get_type_hints

from fegear.studies.columns import MAIN, columns
from fegear.studies.python_example import python_example
from fegear.studies.settings import (
    ExposedField,
    SettingsGroup,
    exposed_fields,
    group_of,
)
from lumped.common.docstrings import INDENT, filled_item, parameters_section
from lumped.common.options import allowed_of, help_of, with_limits


def study_section(study: Any) -> str:
    """The command of a study, and the numpydoc section of its settings."""
    command = "\n\n".join(_examples(study))
    columns_section = "\n".join(_columns(study))
    if not fields(study):
        return f"{command}\n\n{columns_section}" if columns_section else command
    hints, group = get_type_hints(study), group_of(study)
    members = {member.name: member for member in exposed_fields(group)}
    settings = parameters_section(
        (
            name,
            _accepted_type(hints[name], members.get(name)),
            list(_setting_help_lines(group, name, members.get(name))),
        )
        for name in (entry.name for entry in fields(study))
    )
    return "\n\n".join(filter(None, (command, settings, columns_section)))


def _examples(study: Any) -> Iterator[str]:
    """Paragraphs with an example as a command, and the same in Python."""
    yield f"{INDENT}The command is ``fegear {study.command}``, for example::"
    yield f"{2 * INDENT}{study.example}"
    if lines := python_example(study):
        yield f"{INDENT}In Python::"
        yield "\n".join(f"{2 * INDENT}{line}" for line in lines)


def _columns(study: Any) -> Iterator[str]:
    """Lines of the section that says what the columns of the result's table mean."""
    main_columns = [
        column
        for column in columns()
        if study.command in column.commands and column.table == MAIN
    ]
    if main_columns:
        yield from (f"{INDENT}Notes", f"{INDENT}-----")
        yield f"{INDENT}Columns of ``table`` of the result:"
        yield ""
    for column in main_columns:
        yield filled_item(f"`{column.name}`: {column.meaning}")


def _accepted_type(kind: Any, member: ExposedField | None) -> Any:
    """What a field takes: also text that is parsed, a name, or what that refers to."""
    if member is None or member.group is None:
        parser = getattr(getattr(member, "declared", None), "parse", None)
        return kind | str if parser else kind
    converted_types = get_type_hints(kind.of) if hasattr(kind, "of") else {}
    return converted_types.get("value", kind) | kind


def _setting_help_lines(
    group: SettingsGroup, name: str, member: ExposedField | None
) -> Iterator[str]:
    """Help of a setting; of a group what it is, and its settings as a list."""
    if member is None:
        yield f"{help_of(group.kind, name)} The command has no option for it."
    elif member.group is None:
        yield _setting_help(group, member)
    else:
        group_summary = (member.group.kind.__doc__ or "").partition("\n")[0]
        yield f"{group_summary} The command has options for these fields:"
        yield ""
        yield from (
            f"- `{inner}`: {text}" for inner, text in _group_help_items(member.group)
        )


def _group_help_items(
    group: SettingsGroup, prefix: str = ""
) -> Iterator[tuple[str, str]]:
    """Name and help of the settings of a group and of the groups in it."""
    for member in exposed_fields(group):
        if member.group is not None:
            yield from _group_help_items(member.group, f"{prefix}{member.name}.")
        else:
            yield f"{prefix}{member.name}", _setting_help(group, member)


def _setting_help(group: SettingsGroup, member: ExposedField) -> str:
    """Help, limits, and how the command calls it where that is not its name."""
    declared: Any = group.exposed[member.name]  # a Setting, as it is no group
    text = declared.text or help_of(group.kind, member.name)
    text = with_limits(text, declared.allowed or allowed_of(member.field))
    name = declared.place or member.option
    if name == f"--{member.name.replace('_', '-')}":
        return text
    return f"{text} On the command line: ``{name}``."
