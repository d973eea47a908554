"""Configuration of the documentation: `python -m sphinx -W -b html docs OUT`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "_extensions"))

import fegear  # noqa: E402

project = "fegear"
author = "The fegear developers"
copyright = "the fegear developers"
release = version = fegear.__version__

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_design",
    "sphinxcontrib.bibtex",
    "declared",  # reference pages from the declarations of the program
    "formulas",  # as SVG, without network
    "interactive",  # figures of results
]
exclude_patterns = ["_build", "examples", "**/.ipynb_checkpoints"]
root_doc = "index"
smartquotes = False  # options begin with two dashes

# pages
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "unsrtalpha"
bibtex_reference_style = "author_year"

# tutorials are executed at every build, each in a folder of its own
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 240
nb_merge_streams = True
nb_render_markdown_format = "myst"
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("COLUMNS", "100")  # of tables that commands print

# the Python interface
autosummary_generate = True
autodoc_typehints = "none"  # numpydoc states them
numpydoc_show_class_members = False

html_theme = "pydata_sphinx_theme"
html_title = "fegear"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "navigation_with_keys": False,
    "show_toc_level": 2,
    "header_links_before_dropdown": 5,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_sidebars = {"index": []}
