"""Figures on disk as SVG, PNG and interactive pages, and the SVG inside a page.

Inside a page black becomes the page's ink and white its paper, so that a figure can be
read on light and on dark.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fegear.figures.saving import draw_words_as_they_are
from fegear.files.output import has_plotly, make_directory, write_text, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = "figures"
DOTS_PER_INCH = 160
LONG_FRACTION = re.compile(r"-?\d+\.\d{3,}")  # hundredths of a point are enough
IDENTIFIER = re.compile(r'\sid="([^"]+)"')
REFERENCE = re.compile(r'(?:url\(#|href="#)([^)"]+)')
SIZE = re.compile(r'\s(?:width|height)="[^"]*"')


@dataclass(frozen=True)
class SavedFigure:
    """A figure in the folder of a page.

    caption : what is to be seen; command : that makes it again
    svg, png, interactive : paths relative to the page, the last one empty where plotly
        is not installed
    data : names and relative paths of CSV files
    inline : the SVG element for the page itself
    """

    name: str
    caption: str
    command: str
    svg: str
    png: str
    interactive: str
    data: tuple[tuple[str, str], ...]
    inline: str


def save_figure(
    figure: Figure,
    page_folder: Path,
    name: str,
    caption: str,
    command: str,
    data: tuple[tuple[str, str], ...] = (),
) -> SavedFigure:
    """Write NAME.svg, .png and .html below the page's folder; equal input, equal bytes.

    Raises InputError where they cannot be written.
    """
    folder = make_directory(page_folder / FOLDER)
    draw_words_as_they_are(figure)
    svg = svg_text(figure, name)
    write_text(folder / f"{name}.svg", svg)
    write_whole(
        folder / f"{name}.png",
        lambda path: figure.savefig(
            path, dpi=DOTS_PER_INCH, facecolor="white", metadata={"Software": None}
        ),
    )
    return SavedFigure(
        name=name,
        caption=caption,
        command=command,
        svg=f"{FOLDER}/{name}.svg",
        png=f"{FOLDER}/{name}.png",
        interactive=_write_interactive(figure, folder, name),
        data=data,
        inline=inline_svg(svg, name, caption),
    )


def _write_interactive(figure: Figure, folder: Path, name: str) -> str:
    """Write NAME.html, beside one plotly.js for all figures of the folder."""
    if not has_plotly():
        return ""
    from fegear.figures.interactive.html import LIBRARY, interactive_page, library_text

    library = folder / LIBRARY
    if not library.exists():
        write_text(library, library_text())
    write_text(folder / f"{name}.html", interactive_page(figure, LIBRARY))
    return f"{FOLDER}/{name}.html"


def svg_text(figure: Figure, name: str) -> str:
    """The figure on white, its text as text."""
    import matplotlib

    out = io.StringIO()
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
        figure.savefig(
            out,
            format="svg",
            facecolor="none",
            metadata={"Date": None, "Creator": None, "Format": None, "Type": None},
        )
    text = LONG_FRACTION.sub(lambda match: f"{float(match[0]):.2f}", out.getvalue())
    return text.replace("<svg ", '<svg style="background: #ffffff" ', 1)


def inline_svg(svg: str, name: str, label: str) -> str:
    """An SVG element in the page's colours whose identifiers clash with no other's."""
    start = svg.index("<svg ")
    end = svg.index(">", start)
    first = SIZE.sub("", svg[start:end]).replace(' style="background: #ffffff"', "")
    head = f'<svg role="img" fill="currentColor" aria-label="{_escaped(label)}"'
    element = first.replace("<svg", head) + svg[end:]
    used = set(REFERENCE.findall(element))

    def renamed(match: re.Match[str]) -> str:
        return f' id="{name}-{match[1]}"' if match[1] in used else ""

    element = IDENTIFIER.sub(renamed, element)
    element = REFERENCE.sub(
        lambda match: match[0].replace(f"#{match[1]}", f"#{name}-{match[1]}"), element
    )
    return element.replace("#000000", "currentColor").replace("#ffffff", "none")


def _escaped(text: str) -> str:
    from markupsafe import escape

    return str(escape(text))
