"""Texts from the templates in this folder."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

FOLDER = Path(__file__).parent / "templates"


def filled(template: str, **values: Any) -> str:
    """A template's text with values; in .html they are escaped, Markup is not."""
    return _environment().get_template(template).render(**values)


@lru_cache(maxsize=1)
def _environment() -> Environment:
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
    )
    environment.filters["figure"] = shown
    return environment


def shown(value: float | tuple[float, ...] | None, digits: int = 3) -> str:
    """A number or a point as a table shows it, a dash where there is none."""
    if isinstance(value, tuple):
        return f"({', '.join(shown(each, digits) for each in value)})"
    if value is None or math.isnan(value):
        return "-"
    rounded = float(f"{value:.{digits}g}")
    plain = rounded == 0.0 or 1e-3 <= abs(rounded) < 1e6
    return f"{rounded:.6g}" if plain else f"{rounded:.{digits}g}"
