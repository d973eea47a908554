"""Contents of the figures that commands write as pictures."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

UNIT = re.compile(r"\[[^\]]+\]")
# without a unit
COUNT = re.compile(
    r"number|ratio|share|part|order|teeth|tooth|phase|friction|misfit|speed /"
    r"|over mean|per turn|^x$|^y$"
)


@contextmanager
def saved_figures() -> Iterator[list[Figure]]:
    """Figures of matplotlib that are saved within the `with` block."""
    figures: list[Figure] = []
    savefig = Figure.savefig

    def save(figure: Figure, *arguments: object, **options: object) -> None:
        figures.append(figure)
        savefig(figure, *arguments, **options)

    with patch.object(Figure, "savefig", save):
        yield figures


def axis_labels(figure: Figure) -> set[str]:
    """Labels of all axes of a figure."""
    labels = {axes.get_xlabel() for axes in figure.axes}
    return (labels | {axes.get_ylabel() for axes in figure.axes}) - {""}


def drawn_points(figure: Figure) -> np.ndarray:
    """All points [n, 2] of lines and of scattered markers, in units of the axes."""
    points = [np.empty((0, 2))]
    for axes in figure.axes:
        points += [line.get_xydata() for line in axes.lines]
        points += [np.asarray(shown.get_offsets()) for shown in axes.collections]
    return np.concatenate(points)


def are_drawn(figure: Figure, points: np.ndarray) -> bool:
    """Whether a figure has all points [n, 2], to round-off."""
    drawn, points = drawn_points(figure), np.asarray(points)
    near = np.isclose(drawn[:, None], points, rtol=1e-9, atol=1e-12).all(axis=2)
    return bool(len(points)) and bool(near.any(axis=0).all())


def require_readable(figure: Figure) -> None:
    """Nothing that is written is cut off, and axes have units or count something."""
    figure.canvas.draw()
    for text in figure.findobj(Text):
        if not text.get_visible() or not text.get_text().strip() or _is_clipped(text):
            continue
        box = text.get_window_extent().padded(-1.0)
        assert figure.bbox.x0 <= box.x0, text
        assert box.x1 <= figure.bbox.x1, text
        assert figure.bbox.y0 <= box.y0, text
        assert box.y1 <= figure.bbox.y1, text
    for label in axis_labels(figure):
        assert UNIT.search(label) or COUNT.search(label), label


def _is_clipped(text: Text) -> bool:
    """Whether it is a number of an axis beyond its ends, or within a clipped panel."""
    return text.get_clip_on() or (text.axes is not None and not text.axes.get_visible())
