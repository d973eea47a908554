"""Where points of an artist are: in data, in parts of a panel, on the screen."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lumped.common.array_types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path

CURVE_REFINEMENT = 4.0  # of pixels along curves, which become polygons


class FigurePanel(NamedTuple):
    """Axes of matplotlib and the number of their axes in plotly, from 1."""

    axes: Axes
    number: int

    @property
    def ending(self) -> str:
        """Ending of the names of the axes; empty for the first panel."""
        return "" if self.number == 1 else str(self.number)

    @property
    def x(self) -> str:
        return f"x{self.ending}"

    @property
    def y(self) -> str:
        return f"y{self.ending}"


def in_data(panel: FigurePanel, transform: Any) -> tuple[bool, bool]:
    """Whether x and y of a transform's points are data."""
    separate = transform.contains_branch_seperately(panel.axes.transData)
    return bool(separate[0]), bool(separate[1])


def data_points(panel: FigurePanel, transform: Any, points: Any) -> Array:
    """Points (n, 2) as data; those of a part of the panel by its limits now."""
    data: Any = np.ma.filled(np.ma.asarray(points, dtype=float), np.nan)
    if transform == panel.axes.transData:
        return data
    return from_screen(panel, np.asarray(transform.transform(data), float))


def from_screen(panel: FigurePanel, points: Array) -> Array:
    """Data (n, 2) of points in pixels of matplotlib."""
    return np.asarray(panel.axes.transData.inverted().transform(points), float)


def outlines(panel: FigurePanel, transform: Any, path: Path) -> list[Array]:
    """Every part (n, 2) of a path as data; curves become many straight pieces."""
    if path.codes is not None and not _is_straight(path):
        return _flattened(panel, transform, path)
    return [data_points(panel, transform, part) for part in _parts(path)]


def _is_straight(path: Path) -> bool:
    curves = (path.CURVE3, path.CURVE4)
    return path.codes is None or not np.isin(path.codes, curves).any()


def _parts(path: Path) -> list[Array]:
    """Parts of a path of straight pieces; a closed one ends where it begins."""
    vertices = np.asarray(path.vertices, float)
    every: Any = path.codes
    if path.codes is None:
        return [vertices]
    starts = [*np.flatnonzero(path.codes == path.MOVETO), len(vertices)]
    parts = []
    for start, end in pairwise(starts):
        part, codes = vertices[start:end].copy(), every[start:end]
        part[codes == path.CLOSEPOLY] = part[0]
        parts.append(part[codes != path.STOP])
    return parts


def _flattened(panel: FigurePanel, transform: Any, path: Path) -> list[Array]:
    from matplotlib.transforms import Affine2D

    fine = Affine2D().scale(CURVE_REFINEMENT)
    polygons: Any = path.transformed(transform + fine).to_polygons(closed_only=False)
    return [from_screen(panel, part / CURVE_REFINEMENT) for part in polygons]


def joined(parts: list[Array]) -> tuple[Array, Array]:
    """x and y of parts one after the other, with a gap between them."""
    if not parts:
        return np.empty(0), np.empty(0)
    gap = np.full((1, 2), np.nan)
    points = np.concatenate([row for part in parts for row in (part, gap)][:-1])
    return points[:, 0], points[:, 1]
