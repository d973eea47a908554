"""What a result shows in a notebook: its page and its first figure, as HTML."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

from fegear.files.output import has_plotly
from fegear.files.printable import printable
from fegear.studies.page import ColumnTable, Page, RowTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def page_html(
    page: Page, figure: Figure | None = None, dots_per_inch: int = 130
) -> str:
    """The page of a result: a paragraph for each line, its tables, and a figure.

    The figure is interactive where plotly is installed, else a picture. All of it is
    part of the HTML: a notebook shows that alone.
    """
    parts = [_part_html(part) for part in page]
    if figure is not None:
        parts.append(figure_html(figure, dots_per_inch))
    return "\n".join(parts)


def figure_html(figure: Figure, dots_per_inch: int) -> str:
    """A figure as part of a page."""
    picture = figure_png(figure, dots_per_inch)
    if has_plotly():
        from fegear.figures.interactive import notebook_part

        return notebook_part(figure, picture)
    content = b64encode(picture).decode("ascii")
    return f'<img alt="figure" src="data:image/png;base64,{content}">'


def figure_png(figure: Figure, dots_per_inch: int) -> bytes:
    """A figure as the content of a PNG file."""
    from fegear.figures.saving import save_figure

    content = BytesIO()
    save_figure(figure, content, dots_per_inch)
    return content.getvalue()


def _part_html(part: str | RowTable | ColumnTable) -> str:
    if isinstance(part, RowTable):
        return _table_html(part.title, part.columns, part.cells())
    if isinstance(part, ColumnTable):
        names = [part.corner, *part.columns]
        return _table_html(part.title, names, _row_cells(part.labels, part.columns))
    return f"<p>{_text_html(part)}</p>"


def _row_cells(labels: Iterable[str], columns: Mapping[str, Iterable[str]]) -> Iterator:
    for label, *cells in zip(labels, *columns.values(), strict=True):
        yield [label, *cells]


def _table_html(
    title: str | None, names: Iterable[str], rows: Iterable[list[str]]
) -> str:
    caption = f"<caption>{_text_html(title)}</caption>" if title else ""
    head = "".join(f"<th>{_text_html(name)}</th>" for name in names)
    body = "".join(
        f"<tr>{''.join(f'<td>{_text_html(cell)}</td>' for cell in row)}</tr>"
        for row in rows
    )
    return (
        f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _text_html(text: str) -> str:
    return escape(printable(text)).replace("\n", "<br>")
