"""Bands of gears within their tolerances: distribution, and the mesh cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fegear.commands.tolerances.deviations import PEAK_TO_PEAK
from lumped.common.units import TO_UM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fegear.commands.tolerances.bands import ToleranceBands

MIN_BINS, MAX_BINS = 15, 60
Z_OF_95_PERCENT = 1.645  # standard deviations, from mean to 95 % quantile
OUTER_PERCENT = 0.5  # of the values that are beyond either end of the distribution


def draw_tolerances(bands: ToleranceBands, title: str) -> Figure:
    """Draw the distribution of the peak to peak, and the band of the mesh cycle."""
    from lumped.figures.drawing import draw_title, panels

    figure, ((left, right),) = panels(1, 2, size=(11.0, 4.5))
    _draw_distribution(left, bands)
    _draw_cycle(right, bands)
    draw_title(figure, title)
    return figure


def _draw_distribution(axes: Axes, bands: ToleranceBands) -> None:
    solved = TO_UM * bands.solved.values[PEAK_TO_PEAK]
    linear = TO_UM * bands.linear_values[PEAK_TO_PEAK]
    outer = OUTER_PERCENT, 100.0 - OUTER_PERCENT
    ends = np.array([np.percentile(values, outer) for values in (solved, linear)])
    bins = int(np.clip(np.sqrt(solved.size), MIN_BINS, MAX_BINS))
    edges = np.linspace(ends.min(), ends.max(), bins + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    for values, color, label in (
        (solved, "tab:blue", "solved"),
        (linear, "tab:red", "first order"),
    ):
        density = np.histogram(values, edges)[0] / (values.size * np.diff(edges))
        if values is solved:
            axes.fill_between(
                middles, density, step="mid", color=color, alpha=0.4, label=label
            )
        else:
            axes.plot(middles, density, color=color, label=label)
    nominal = TO_UM * bands.nominal[PEAK_TO_PEAK]
    axes.axvline(nominal, color="black", linestyle="--", label="nominal")
    for percent in (5, 95):
        at = float(np.percentile(solved, percent))
        label = f"{percent} %: {at:.3g} um"
        axes.axvline(at, color="tab:blue", linestyle=":", label=label)
    axes.set_xlabel("peak to peak of the static transmission error [um]")
    axes.set_ylabel("density [1/um]")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)


def _draw_cycle(axes: Axes, bands: ToleranceBands) -> None:
    columns = {name: np.asarray(c) for name, c in bands.cycle_columns.items()}
    position = columns.pop("position")
    ste = {name: TO_UM * values for name, values in columns.items()}
    axes.fill_between(
        position,
        ste["ste_p05_m"],
        ste["ste_p95_m"],
        color="tab:blue",
        alpha=0.3,
        label="5 to 95 %, solved",
    )
    axes.plot(position, ste["ste_p50_m"], color="tab:blue", label="50 %, solved")
    nominal = ste["ste_nominal_m"]
    axes.plot(position, nominal, color="black", linestyle="--", label="nominal")
    width = Z_OF_95_PERCENT * ste["ste_first_order_std_m"]
    for sign, label in ((-1.0, "5 and 95 %, first order"), (1.0, None)):
        axes.plot(position, nominal + sign * width, color="tab:red", lw=1, label=label)
    axes.set_xlabel("mesh position [base pitches from the pitch point]")
    axes.set_ylabel("static transmission error less its mean [um]")
    axes.legend(fontsize=8)
