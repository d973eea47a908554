"""Figures of matplotlib with every kind of artist that the pictures have."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch, Rectangle

from lumped.figures.drawing import draw_legend, draw_title, panels

X = np.linspace(0.0, 1.0, 6)
Y = np.array([1.0, 2.0, np.nan, 3.0, 2.5, 1.5])


def lines() -> Figure:
    """Line styles, steps, gaps, shared and inverted axes, lines across panels."""
    figure, rows = panels(2, size=(7.0, 6.0), share=True)
    (top,), (low,) = rows
    top.plot(X, Y, "o--", color="tab:red", label="gaps", mfc="white")
    top.step(X, 2.0 * X, where="post", label="steps", ls=(0, (3, 1.5)))
    top.axhline(1.5, color="0.4", ls=":")
    top.axvspan(0.2, 0.4, color="tab:cyan", alpha=0.1, lw=0)
    top.text(0.3, 1.01, "above", transform=top.get_xaxis_transform(), ha="center")
    top.legend(title="dotted: <mean> & $x$")
    low.loglog(X + 0.1, np.abs(Y) + 1.0, "x", label="marks")
    low.invert_yaxis()
    low.axvline(0.5, color="tab:green", label="across")
    low.set_xlabel("time [s]")
    low.set_ylabel("force\n[N]")
    low.legend(loc="upper left")
    draw_title(figure, "lines <b> & %{x}")
    return figure


def areas() -> Figure:
    """Filled areas, patches, arrows and annotations; a legend of handles."""
    figure, ((axes, beside),) = panels(1, 2, size=(9.0, 4.0))
    axes.fill_between(X, X**2, where=X > 0.3, color="tab:blue", alpha=0.2, lw=0.0)
    axes.add_collection(LineCollection([[(0, 0), (1, 1)], [(0, 1), (1, 0)]]))
    axes.add_collection(PolyCollection([[(0, 0), (0.2, 0), (0.1, 0.3)]], color="gold"))
    axes.broken_barh([(0.1, 0.2), (0.5, 0.3)], (0.6, 0.2), color="tab:green", lw=0.0)
    axes.annotate(
        "", xy=(0.9, 0.1), xytext=(0.2, 0.8), arrowprops={"arrowstyle": "-|>"}
    )
    axes.annotate("here", (0.5, 0.5), xytext=(4, 4), textcoords="offset points")
    axes.vlines([0.2, 0.4], 0.1, 0.3)
    beside.add_patch(Circle((0.5, 0.5), 0.3, fc="none", ec="tab:red"))
    beside.add_patch(Rectangle((0.1, 0.1), 0.2, 0.3, hatch="//", fill=False))
    arrow = (0.1, 0.9), (0.9, 0.9)
    beside.add_patch(FancyArrowPatch(*arrow, arrowstyle="-|>", mutation_scale=10))
    beside.set_aspect("equal")
    beside.set_title("a long title of a panel that is wider than the panel itself")
    handles = [
        Patch(color="gold", label="gold"),
        Line2D([], [], color="tab:red", ls="--", marker="s", label="red"),
        Patch(fill=False, hatch="//", label="hatched"),
    ]
    draw_legend(figure, handles, 3)
    return figure


def colors() -> Figure:
    """Colours by values with their bars, contours, meshes and images."""
    figure, rows = panels(3, 2, size=(9.0, 9.0))
    values = np.outer(X + 0.1, X + 1.0)
    shown = rows[0][0].scatter(X, X, 14.0, X + 0.01, norm=LogNorm(0.01, 1.1))
    figure.colorbar(shown, ax=rows[0][0], label="size [um]")
    filled = rows[0][1].contourf(X, X, values, 5)
    rows[0][1].clabel(rows[0][1].contour(X, X, values, filled.levels, colors="white"))
    rows[0][1].contourf(X, X, values, [0.5, 2.0], colors="none", hatches=["//"])
    figure.colorbar(filled, ax=rows[0][1], label="height")
    mesh = rows[1][0].pcolormesh(
        X, X, values[1:, 1:], norm=BoundaryNorm([0, 1, 2], 256)
    )
    figure.colorbar(mesh, ax=rows[1][0], orientation="horizontal")
    image = np.linspace(0.0, 1.0, 36).reshape(3, 3, 4)
    rows[1][1].imshow(image, extent=(0, 1, 0, 5), aspect="auto", origin="lower")
    rows[2][0].imshow(values, extent=(0, 1, 0, 5), aspect="auto")
    rows[2][1].set_yticks(range(3), ["one", "two", "three"])
    return figure


def more_axes() -> Figure:
    """A twin, a secondary axis, and a panel without axes."""
    figure, ((axes, other),) = panels(1, 2, size=(9.0, 4.0))
    axes.plot(X, X, label="left")
    twin: Axes = axes.twinx()
    twin.plot(X, 100.0 * X, "r", label="right")
    twin.set_ylabel("right [%]")
    ratio: tuple[Callable, Callable] = (lambda x: 60.0 * x, lambda x: x / 60.0)
    axes.secondary_xaxis("top", functions=ratio).set_xlabel("speed [rpm]")
    other.plot(X, X)
    other.set_axis_off()
    return figure


FIGURES = [lines, areas, colors, more_axes]
