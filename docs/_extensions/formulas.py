"""Formulas as SVG: pages show them without a script, a font or a network."""

from __future__ import annotations

from html import escape
from typing import Any

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger
from sphinx.util.math import get_node_equation_number

SIZE = 17.0  # of letters in pixels, beside text of 16
LINE_HEIGHT = 45.0  # at most; delimiters around sums may be stretched without bound
LOGGER = getLogger(__name__)

ziamath.config.math.color = "currentColor"  # of the page, light or dark


def picture(latex: str, inline: bool) -> str:
    """The formula as an SVG element on the baseline of its line."""
    formula = ziamath.Latex(latex, size=SIZE, inline=inline)
    height = formula.getsize()[1]
    if height > LINE_HEIGHT * (2 + latex.count(r"\\")):
        LOGGER.warning("formula is drawn %.0f pixels high: %s", height, latex)
    depth = formula.getyofst()
    return (
        f'<span role="img" aria-label="{escape(latex)}" '
        f'style="display: inline-block; vertical-align: {depth:.2f}px">'
        f"{formula.svg()}</span>"
    )


def visit_inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(f'<span class="math">{picture(node.astext(), True)}</span>')
    raise nodes.SkipNode


def visit_block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(writer.starttag(node, "div", CLASS="math equation"))
    writer.body.append(f"<div>{picture(node.astext(), False)}</div>")
    if node["number"]:
        number = get_node_equation_number(writer, node)
        writer.body.append(f'<span class="eqno">({number})')
        writer.add_permalink_ref(node, "Link to this equation")
        writer.body.append("</span>")
    writer.body.append("</div>")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_html_math_renderer("svg", (visit_inline, None), (visit_block, None))
    app.config.html_math_renderer = "svg"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
