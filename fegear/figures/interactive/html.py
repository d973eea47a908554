"""Figures of plotly in HTML: pages for themselves, and parts of others."""

from __future__ import annotations

from base64 import b64encode
from hashlib import sha256
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from fegear.figures.interactive.convert import require_plotly, to_plotly

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCRIPT = Path(__file__).with_name("draw.js")
LIBRARY = "plotly.min.js"  # name of the file of plotly
ID_LETTERS = 12
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light">
<title>{title}</title>
<style>html, body {{ margin: 0; background: #ffffff; }}</style>
{library}
</head>
<body>
{figure}
</body>
</html>
"""


def interactive_page(figure: Figure, library: str | None = None) -> str:
    """A page of one figure; equal figures give equal pages.

    library : URL of plotly.js beside the page; it is in the page where this is None
    """
    part = interactive_part(figure)
    title = " ".join(figure.get_suptitle().split()) or "fegear"
    return PAGE.format(title=escape(title), library=library_tag(library), figure=part)


def library_tag(url: str | None = None) -> str:
    """The script element with plotly.js, from a URL or with the whole of it."""
    if url is not None:
        return f'<script src="{escape(url)}"></script>'
    return f"<script>{library_text()}</script>"


def library_text() -> str:
    """The program plotly.js as it comes with plotly."""
    require_plotly()
    from plotly.offline import get_plotlyjs

    text: str = get_plotlyjs()
    return text


def interactive_part(figure: Figure, picture: bytes | None = None) -> str:
    """An element with a figure; the page has to bring plotly.js.

    picture : a PNG file that is shown until the figure is drawn, and where no program
        of a page runs
    """
    # the sign would end the element of the script
    text = str(to_plotly(figure).to_json()).replace("<", "\\u003c")
    name = f"fegear-{sha256(text.encode()).hexdigest()[:ID_LETTERS]}"
    shown = ""
    if picture is not None:
        content = b64encode(picture).decode("ascii")
        shown = f'<img alt="figure" src="data:image/png;base64,{content}">'
    script = SCRIPT.read_text("utf-8").replace("NAME", name).replace("FIGURE", text, 1)
    return (
        f'<div class="{name}" style="background: #ffffff">{shown}</div>\n'
        f"<script>\n{script}</script>"
    )
