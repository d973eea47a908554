"""Figures that results show on the site are interactive, by one file for all pages."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from fegear.figures.interactive.html import LIBRARY, library_text

# as pages with figures see it
os.environ["FEGEAR_PLOTLY_URL"] = f"../_static/{LIBRARY}"


def write_library(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html":
        target = Path(app.outdir) / "_static" / LIBRARY
        target.write_text(library_text(), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    app.connect("build-finished", write_library)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
