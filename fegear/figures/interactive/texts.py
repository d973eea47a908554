"""Text of a picture as the small subset of HTML that plotly shows."""

from __future__ import annotations

import re
from html import escape
from textwrap import wrap

from fegear.files.printable import printable

TIMES, MINUS = "\N{MULTIPLICATION SIGN}", "\N{MINUS SIGN}"
POWER = re.compile(r"\$\\mathdefault\{(.*)\}\$")  # a number of a logarithmic axis
EXPONENT = re.compile(r"\^\{(.*?)\}")


def markup(text: str, letters: int | None = None) -> str:
    """Text that plotly shows as it is, in lines of a number of letters at most."""
    lines = printable(text).split("\n")
    if letters is not None:
        lines = [part for line in lines for part in wrap(line, letters) or [""]]
    return "<br>".join(_escaped(line) for line in lines)


def _escaped(line: str) -> str:
    # braces after a per cent sign would be filled with values in a hover text, and
    # between dollar signs is mathematics
    return escape(line, quote=False).replace("{", "&#123;").replace("$", "&#36;")


def number_markup(text: str) -> str:
    """A number at a tick of matplotlib, powers of ten among them."""
    match = POWER.fullmatch(text)
    if match is None:
        return markup(text)
    plain = match[1].replace(r"\times", TIMES)
    return EXPONENT.sub(r"<sup>\1</sup>", plain).replace("-", MINUS)


def one_line(text: str) -> str:
    """A label without its line breaks."""
    return markup(" ".join(text.split()))


def line_count(marked: str) -> int:
    """Number of lines of a text with breaks; 0 of an empty one."""
    return marked.count("<br>") + 1 if marked else 0
