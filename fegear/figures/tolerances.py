"""Bands of gears within their tolerances: distribution, and the mesh cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.statics.tolerances import PEAK_TO_PEAK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS = 60
OUTER_PERCENT = 0.5  # of the values that are beyond either end of the distribution
UM = 1e6  # micrometres of a metre


def draw_tolerances(result: Any) -> Figure:
    """Draw a `TolerancesResult`: peak to peak, and transmission error over position."""
    from lumped.figures.drawing import draw_title, panels

    figure, ((left, right),) = panels(1, 2, size=(11.0, 4.5))
    _draw_distribution(left, result)
    _draw_cycle(right, result)
    draw_title(
        figure,
        f"{result.gear_set}, mesh {result.study.mesh}, {result.torque:g} N m, "
        f"{len(result.ste)} pairs of gears within their tolerances",
    )
    return figure


def _draw_distribution(axes: Axes, result: Any) -> None:
    values = UM * result.values[PEAK_TO_PEAK]
    linear = UM * result.linear_values[PEAK_TO_PEAK]
    ends = [
        np.percentile(v, (OUTER_PERCENT, 100 - OUTER_PERCENT)) for v in (values, linear)
    ]
    edges = np.linspace(min(e[0] for e in ends), max(e[1] for e in ends), BINS + 1)
    axes.hist(values, edges, density=True, color="tab:blue", alpha=0.4, label="solved")
    density, _ = np.histogram(linear, edges)
    density = density / (linear.size * np.diff(edges))
    middles = 0.5 * (edges[1:] + edges[:-1])
    axes.plot(middles, density, color="tab:red", label="first order")
    nominal = UM * result.nominal[PEAK_TO_PEAK]
    axes.axvline(nominal, color="black", linestyle="--", label="nominal")
    for percent in (5, 95):
        at = np.percentile(values, percent)
        axes.axvline(
            at, color="tab:blue", linestyle=":", label=f"{percent} %: {at:.3g} um"
        )
    axes.set_xlabel("peak to peak of the static transmission error [um]")
    axes.set_ylabel("density [1/um]")
    axes.legend(fontsize=8)


def _draw_cycle(axes: Axes, result: Any) -> None:
    position, ste = result.position, UM * result.ste
    low, middle, high = np.percentile(ste, (5, 50, 95), axis=0)
    axes.fill_between(
        position, low, high, color="tab:blue", alpha=0.3, label="5 to 95 %, solved"
    )
    axes.plot(position, middle, color="tab:blue", label="50 %, solved")
    nominal = UM * result.linear.ste
    axes.plot(position, nominal, color="black", linestyle="--", label="nominal")
    width = 1.645 * UM * result.linear_ste_std  # of a normal distribution
    for sign, label in ((-1.0, "5 and 95 %, first order"), (1.0, None)):
        axes.plot(position, nominal + sign * width, color="tab:red", lw=1, label=label)
    axes.set_xlabel("mesh position [base pitches from the pitch point]")
    axes.set_ylabel("static transmission error [um]")
    axes.legend(fontsize=8)
