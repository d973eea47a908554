"""Texts from the templates in this folder."""

from __future__ import annotations

import math
import re
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

if TYPE_CHECKING:
    from jinja2 import Environment

SPECIAL = re.compile(r"[\\`*_\[\]<>|&~]")  # in Markdown, anywhere in a line
# headings, lists and underlines
AT_START = re.compile(r"^(\s*\d*)([#+.)=-])(?=[\s#=-]|$)")
FOLDER = Path(__file__).parent / "templates"


def filled(template: str, **values: Any) -> str:
    """A template's text with values.

    In .html they are escaped, Markup is not; in .md they are escaped, and what the
    filters `code` and `address` make is not.
    """
    environment = _environment(template.endswith(".md"))
    return environment.get_template(template).render(**values)


class Markdown(str):
    """Text that is Markdown already."""


def escaped(value: Any) -> Any:
    """Text of a value that Markdown shows as it is, on one line."""
    if not isinstance(value, str) or isinstance(value, Markdown):
        return value
    text = SPECIAL.sub(r"\\\g<0>", " ".join(re.split(r"[\r\n]+", value)))
    return Markdown(AT_START.sub(r"\g<1>\\\g<2>", text))


def code(value: str) -> Markdown:
    """A command between backticks, of which there are more than in it."""
    longest = max(map(len, re.findall("`+", value)), default=0)
    ticks, room = "`" * (longest + 1), " " * bool(longest)
    return Markdown(f"{ticks}{room}{' '.join(value.split())}{room}{ticks}")


def address(value: str) -> Markdown:
    """The path of a file in a link."""
    return Markdown(quote(value))


@lru_cache(maxsize=2)
def _environment(markdown: bool) -> Environment:
    from jinja2 import (
        Environment,
        FileSystemLoader,
        StrictUndefined,
        select_autoescape,
    )

    environment = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=select_autoescape(["html"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        finalize=escaped if markdown else None,
    )
    environment.filters["figure"] = _shown_as_it_is if markdown else shown
    environment.filters |= {"code": code, "address": address}
    return environment


def shown(value: float | tuple[float, ...] | None, digits: int = 3) -> str:
    """A number or a point as a table shows it, a dash where there is none."""
    if isinstance(value, tuple):
        return f"({', '.join(shown(coordinate, digits) for coordinate in value)})"
    if value is None or math.isnan(value):
        return "-"
    rounded = float(f"{value:.{digits}g}")
    plain = rounded == 0.0 or 1e-3 <= abs(rounded) < 1e6
    return f"{rounded:.6g}" if plain else f"{rounded:.{digits}g}"


def _shown_as_it_is(value: float | tuple[float, ...] | None, digits: int = 3) -> str:
    return Markdown(shown(value, digits))
