"""Figures as files: pictures, and interactive pages; drawn without a screen."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import IO, TYPE_CHECKING

from fegear.files.output import INTERACTIVE
from fegear.files.printable import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Text of a number by a formatter of matplotlib
POWER_OF_TEN = re.compile(r"\$\\mathdefault\{[-\d.]*(\\times)?(10\^\{[-\d.]+\})?\}\$")


def save_figure(
    figure: Figure, path: Path | IO[bytes], dots_per_inch: int = 130
) -> None:
    """Write a picture of the kind that the ending says; devices and streams take PNG.

    Dates and versions are left out so that equal input gives equal files.
    """
    draw_words_as_they_are(figure)
    ending = path.suffix.lower() if isinstance(path, Path) else ""
    if isinstance(path, Path) and ending == INTERACTIVE:
        from fegear.figures.interactive import interactive_page

        path.write_text(interactive_page(figure), "utf-8")
        return
    kind = ending.removeprefix(".") or "png"
    unused = {"png": "Software", "pdf": "CreationDate", "svg": "Date"}[kind]
    from matplotlib import rc_context

    with warnings.catch_warnings(), rc_context({"svg.hashsalt": "fegear"}):
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        figure.savefig(path, format=kind, dpi=dots_per_inch, metadata={unused: None})


def draw_words_as_they_are(figure: Figure) -> None:
    """No mathematics in names with dollar signs, and nothing that steers a reader.

    Numbers of logarithmic axes, which a figure has that was drawn before, stay powers.
    """
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        content = text.get_text()
        if content and POWER_OF_TEN.fullmatch(content) is None:
            text.set_text(printable(content))
            text.set_parse_math(False)
