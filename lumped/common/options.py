"""Options of solvers: dataclass fields whose help and limits are stated once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields
from math import inf
from types import MappingProxyType
from typing import Any, TypeVar, get_type_hints

from lumped.common.docstrings import parameters_section, set_lazy_docstring

T = TypeVar("T")
NO_NAMES: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True)
class Range:
    """Numbers that a setting takes: from or above, and to or below.

    or_infinite : whether it may also be infinite
    """

    least: float = -inf
    most: float = inf
    unit: str = ""
    above: float = -inf
    below: float = inf
    or_infinite: bool = False

    def __contains__(self, value: float) -> bool:
        if self.or_infinite and value == inf:
            return True
        inside = self.least <= value <= self.most
        return inside and self.above < value < self.below

    def __str__(self) -> str:
        low = f"above {self.above:.12g}" if self.least == -inf else f"{self.least:.12g}"
        high = f"below {self.below:.12g}" if self.most == inf else f"{self.most:.12g}"
        limits = f"{low} to {high} {self.unit}".strip()
        return f"{limits}, or inf" if self.or_infinite else limits


def option(default: Any, text: str, allowed: Range | None = None) -> Any:
    """A field of options.

    text : its help, in sentences, with names of other fields in braces
    allowed : its numbers, which `require_fields` checks
    """
    return field(default=default, metadata={"help": text, "allowed": allowed})


def help_of(kind: Any, name: str, called: Mapping[str, str] = NO_NAMES) -> str:
    """Help of a field of a class, empty where it has none.

    called : what other fields are called in it, where that is not their name
    """
    entries = {entry.name: entry for entry in fields(kind)}
    text: str = entries[name].metadata.get("help", "")
    return text.format_map({**dict(zip(entries, entries, strict=True)), **called})


def allowed_of(entry: Field[Any]) -> Range | None:
    """Numbers that a field takes, None where they are not limited."""
    allowed: Range | None = entry.metadata.get("allowed")
    return allowed


def documented(kind: type[T]) -> type[T]:
    """Decorate a dataclass of options: its docstring lists them."""
    set_lazy_docstring(kind, options_section)
    return kind


def options_section(kind: type) -> str:
    """The section of numpydoc that lists the options of a dataclass."""
    hints = get_type_hints(kind)
    return parameters_section(
        (entry.name, hints[entry.name], [with_limits(text, allowed_of(entry))])
        for entry in fields(kind)
        if (text := help_of(kind, entry.name))
    )


def with_limits(text: str, allowed: Range | None) -> str:
    """The help of a setting, followed by the numbers that it takes."""
    return text if allowed is None else f"{text} Allowed: {allowed}."
