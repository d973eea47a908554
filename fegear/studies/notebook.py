"""What a result shows in a notebook: its page and its first figure, as HTML."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

from fegear.files.printable import printable
from fegear.studies.page import ColumnTable, Page, RowTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def page_html(page: Page, picture: bytes | None = None) -> str:
    """The page of a result: a paragraph for each line, its tables, and a picture.

    The picture, a PNG file, is part of the HTML: a notebook shows that alone.
    """
    parts = [_part(part) for part in page]
    if picture is not None:
        content = b64encode(picture).decode("ascii")
        parts.append(f'<img alt="figure" src="data:image/png;base64,{content}">')
    return "\n".join(parts)


def figure_png(figure: Figure, dots_per_inch: int) -> bytes:
    """A figure as the content of a PNG file."""
    from fegear.figures.statics import save_figure

    content = BytesIO()
    save_figure(figure, content, dots_per_inch)
    return content.getvalue()


def _part(part: str | RowTable | ColumnTable) -> str:
    if isinstance(part, RowTable):
        return _table(part.title, part.columns, part.cells())
    if isinstance(part, ColumnTable):
        names = [part.corner, *part.columns]
        return _table(part.title, names, _rows(part.labels, part.columns))
    return f"<p>{_text(part)}</p>"


def _rows(labels: Iterable[str], columns: Mapping[str, Iterable[str]]) -> Iterator:
    for label, *cells in zip(labels, *columns.values(), strict=True):
        yield [label, *cells]


def _table(title: str | None, names: Iterable[str], rows: Iterable[list[str]]) -> str:
    caption = f"<caption>{_text(title)}</caption>" if title else ""
    head = "".join(f"<th>{_text(name)}</th>" for name in names)
    body = "".join(
        f"<tr>{''.join(f'<td>{_text(cell)}</td>' for cell in row)}</tr>" for row in rows
    )
    return (
        f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _text(text: str) -> str:
    return escape(printable(text)).replace("\n", "<br>")
