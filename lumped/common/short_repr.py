"""A short `repr` of dataclasses that hold much: what they are, and how large."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Sized
from dataclasses import MISSING, Field, fields
from typing import Any

MAX_LENGTH = 300  # characters of a `repr`
LONGEST = 40  # characters of a text or tuple that is shown as it is
LONGEST_INNER = 60  # characters of a dataclass in another one that is shown as it is
PLAIN = bool | int | float | str | None


class ShortRepr:
    """A dataclass that shows the sizes of what it holds, not all of its numbers.

    Fields with their default values are left out.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "__repr__" not in vars(cls):  # `dataclass` would put its own there
            cls.__repr__ = ShortRepr.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        name, parts = type(self).__name__, list[str]()
        room = MAX_LENGTH - len(f"{name}(, ...)")
        for part in _parts(self):
            room -= len(part) + 2
            if room < 0:
                parts.append("...")
                break
            parts.append(part)
        return f"{name}({', '.join(parts)})"


def _parts(instance: Any) -> Iterator[str]:
    for field in fields(instance):
        value = getattr(instance, field.name)
        if field.repr and not _is_default(field, value):
            yield f"{field.name}={shown(value)}"


def _is_default(field: Field[Any], value: object) -> bool:
    default = field.default
    if default is MISSING and field.default_factory is not MISSING:
        default = field.default_factory()
    if value is default:
        return True
    if type(value) is not type(default):
        return False
    if isinstance(value, Sized) and isinstance(default, Sized) and not len(default):
        return not len(value)
    is_compared = isinstance(value, PLAIN | tuple | ShortRepr)
    return is_compared and bool(value == default)


def shown(value: object) -> str:
    """A plain value as it is, of others their kind and size."""
    if isinstance(value, PLAIN):
        text = repr(value)
        return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
    kind = type(value).__name__
    if kind == "ndarray":
        return f"<array {' x '.join(map(str, getattr(value, 'shape', ())))}>"
    if type(value) is tuple and all(isinstance(item, PLAIN) for item in value):
        text = repr(value) if len(value) <= LONGEST else ""
        if text and len(text) <= LONGEST:
            return text
    if isinstance(value, Mapping | Sequence) and isinstance(value, Sized):
        return f"<{kind} of {len(value)}>"
    if isinstance(value, ShortRepr):
        text = repr(value)
        if len(text) <= LONGEST_INNER:
            return text
    name = getattr(value, "name", None)
    return f"<{kind} {name}>" if isinstance(name, str) else f"<{kind}>"
