"""The figure of an error budget."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from validation.pages.look import COLORS, WIDTH, grid
from validation.study.budget import COUPLED_MODEL, QUANTITIES, Budget

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_budget(budget: Budget) -> Figure:
    """Draw the difference of each model from the finite elements, for every quantity.

    A dot for each torque, direction, mesh and peak, a bar at their mean; the models
    are below one another, from Model-1 to the coupled one.
    """
    shown = {
        name: quantity
        for name, quantity in QUANTITIES.items()
        if any(row.measured[name] for row in budget.rows)
    }
    lines = (len(shown) + 1) // 2
    height = 0.62 + 0.17 * len(budget.rows)
    figure, panels_ = grid(lines, 2, (WIDTH, 0.3 + height * lines))
    labels = [row.label for row in budget.rows]
    for number, (name, quantity) in enumerate(shown.items()):
        axes = panels_[number // 2][number % 2]
        for place, row in enumerate(budget.rows):
            values = quantity.factor * np.array([*row.measured[name].values()])
            color = (
                "black" if row.model == COUPLED_MODEL else COLORS[place % len(COLORS)]
            )
            level = np.full(values.size, float(place))
            axes.plot(values, level, "o", ms=3.0, alpha=0.5, color=color, mew=0.0)
            if values.size:
                axes.plot(values.mean(), place, "|", ms=9.0, mew=2.0, color=color)
        axes.axvline(0.0, color="black", lw=0.8)
        axes.set_ylim(len(labels) - 0.5, -0.5)
        axes.set_yticks(range(len(labels)), labels if number % 2 == 0 else [])
        axes.set_title(f"{quantity.label} [{quantity.unit}]", fontsize=9)
    for axes in (axes for row in panels_ for axes in row):
        axes.set_visible(axes.has_data())
    return figure
