"""Docstrings with a section of parameters, made when they are first read.

The parameters of a class of options or settings are declared once, as fields with help
and limits; this turns them into the numpydoc section that `help` and Sphinx show.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from textwrap import fill
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

INDENT = " " * 4
WIDTH = 80
OPTION = re.compile(r"(?<![\w`-])--?[a-zA-Z][\w-]*")


class LazyDocstring:
    """The docstring of a class: its text, and a section made from the class.

    Python calls `__get__` where `__doc__` is read, so that importing costs nothing.
    """

    def __init__(self, text: str | None, section: Callable[[type], str]) -> None:
        self.text, self.section = (text or "").rstrip(), section

    def __get__(self, instance: object, owner: type) -> str:
        if "__match_args__" not in vars(owner):  # `dataclass` is not done with it
            return self.text
        return f"{as_rst(self.text)}\n\n{self.section(owner)}\n"


def set_lazy_docstring(kind: type, section: Callable[[type], str]) -> None:
    """Let the docstring of a class end in a section, indented as the text is."""
    type.__setattr__(kind, "__doc__", LazyDocstring(kind.__doc__, section))


def as_rst(text: str) -> str:
    """Text in which options of the command line are literals."""
    return OPTION.sub(r"``\g<0>``", text)


def parameters_section(described: Iterable[tuple[str, Any, Iterable[str]]]) -> str:
    """The section of fields: name, type, and paragraphs or list items."""
    lines = [f"{INDENT}Parameters", f"{INDENT}----------"]
    for name, kind, texts in described:
        lines.append(f"{INDENT}{name} : {type_text(kind)}")
        lines += [_filled(as_rst(text)) if text else "" for text in texts]
    return "\n".join(lines)


def filled_item(text: str) -> str:
    """An item of a list in a section."""
    return _filled(f"- {text}", INDENT)


def _filled(text: str, first: str = 2 * INDENT) -> str:
    later = first + "  " if text.startswith("- ") else first
    return fill(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=later,
        break_on_hyphens=False,
        break_long_words=False,
    )


def type_text(kind: Any) -> str:
    """A type as numpydoc writes it: {'up', 'down'}, float or None, tuple of float."""
    origin, args = get_origin(kind), get_args(kind)
    if kind is None or kind is type(None):
        return "None"
    if origin is Literal:
        return f"{{{', '.join(map(repr, args))}}}"
    if origin in (Union, UnionType):
        none_last = sorted(args, key=lambda arg: arg is type(None))
        return " or ".join(map(type_text, none_last))
    if origin is tuple and args[-1] is Ellipsis:
        return f"tuple of {type_text(args[0])}"
    if origin is tuple:
        return f"tuple of {len(args)} {type_text(args[0])}"
    return str(getattr(kind, "__name__", kind))
