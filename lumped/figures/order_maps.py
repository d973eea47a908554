"""Maps of orders over speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lumped.common.array_types import Array
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN_HARMONICS = 4  # of the mesh
MIN_RELATIVE_AMPLITUDE = 1e-4  # of the colour scale, over the largest


@dataclass(frozen=True, eq=False)
class OrderCurves:
    """Spectra of one signal.

    name : of the signal, with its unit
    amplitude : (w, o) over windows and orders
    """

    name: str
    amplitude: Array


def draw_order_maps(
    maps: Sequence[OrderCurves],
    axes: tuple[Array, Array],
    teeth: int,
    texts: tuple[str, str],
) -> Figure:
    """Draw amplitudes over orders and speed, a panel for each signal.

    axes : orders (o,), and speeds (w,) of the windows
    teeth : cycles per turn of the gear's mesh
    texts : title, and label of the speeds
    """
    title, label = texts
    rows = len(maps)
    figure, axes_grid = panels(rows, 1, size=(11.0, 1.2 + 3.2 * rows), share=True)
    for (panel,), one in zip(axes_grid, maps, strict=True):
        _draw_map(panel, one, axes, teeth)
        panel.set_ylabel(label)
    axes_grid[-1][0].set_xlabel("cycles per turn")
    draw_title(figure, title)
    return figure


def _draw_map(
    panel: Axes, curves: OrderCurves, axes: tuple[Array, Array], teeth: int
) -> None:
    """Draw the cells of one map; the mean is not shown."""
    from matplotlib.colors import LogNorm

    order, speed = axes
    last = (SHOWN_HARMONICS + 0.5) * teeth
    shown = (order >= 1.0) & (order <= last)
    amplitude = curves.amplitude[:, shown]
    largest = float(amplitude.max()) or 1.0
    cells = panel.pcolormesh(
        _edges(order[shown]),
        _edges(speed),
        np.maximum(amplitude, MIN_RELATIVE_AMPLITUDE * largest),
        norm=LogNorm(MIN_RELATIVE_AMPLITUDE * largest, largest),
        cmap="viridis",
        rasterized=True,
    )
    panel.figure.colorbar(cells, ax=panel, label="amplitude")
    panel.set_title(curves.name, fontsize=10)
    panel.set_xticks([harmonic * teeth for harmonic in range(1, SHOWN_HARMONICS + 1)])
    panel.grid(visible=False)


def _edges(centers: Array) -> Array:
    """Edges (n + 1,) of cells about centers (n,)."""
    if centers.size == 1:
        return np.array([0.99, 1.01]) * centers
    middle = 0.5 * (centers[1:] + centers[:-1])
    ends = 2.0 * centers[[0, -1]] - middle[[0, -1]]
    return np.concatenate([ends[:1], middle, ends[1:]])
