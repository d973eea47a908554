"""Where the outputs of a notebook take plotly.js from."""

from __future__ import annotations

import os
from html import escape
from typing import TYPE_CHECKING

from fegear.figures.interactive.html import interactive_part, library_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VARIABLE = "FEGEAR_PLOTLY_URL"  # of the environment
LOADER = """<script>
if (!window.Plotly && !document.querySelector("script[data-fegear-plotly]")) {{
  const script = document.createElement("script");
  script.dataset.fegearPlotly = "";
  script.src = "{url}";
  document.head.append(script);
}}
</script>"""


class _Source:
    """url : None for plotly.js within the first output; sent : whether it was there."""

    url: str | None = None
    sent = False


def set_plotly_source(url: str | None) -> None:
    """Set where the figures of a notebook or of a site load plotly.js from.

    Without it the first figure of a session has plotly.js in it, about 5 MB, and the
    others use that. The environment variable FEGEAR_PLOTLY_URL does the same.

    Parameters
    ----------
    url : str or None
        Address of `plotly.min.js`, relative to the page, such as
        ``_static/plotly.min.js``. None for plotly.js in the next figure.
    """
    _Source.url, _Source.sent = url, False


def notebook_part(figure: Figure, picture: bytes) -> str:
    """A figure in an output of a notebook.

    picture : PNG file that is shown where plotly.js is not there, as on a page that
        shows notebooks without running their programs
    """
    return f"{_library()}\n{interactive_part(figure, picture)}"


def _library() -> str:
    url = _Source.url or os.environ.get(VARIABLE)
    if url:
        return LOADER.format(url=escape(url))
    if _Source.sent:
        return ""
    _Source.sent = True
    return f"<script>{library_text()}</script>"
