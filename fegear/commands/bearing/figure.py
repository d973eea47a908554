"""Load on rolling elements around a bearing, and its stiffness over the load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RACE_RADIUS = 1.0  # of the drawn race, in largest loads


def draw_bearing(
    elements: Mapping[str, Array],
    over_load: Mapping[str, Array],
    load: float,
    title: str,
) -> Figure:
    """Draw load distribution and stiffness.

    elements : angle_deg and load_N of the rolling elements
    over_load : load_N, stiffness_N_per_m and transverse_stiffness_N_per_m
    load : [N] of the distribution
    """
    figure, [[around, stiffness]] = panels(1, 2, size=(9.0, 4.2))
    _draw_distribution(around, elements["angle_deg"], elements["load_N"])
    labels = {
        "stiffness_N_per_m": "along the load",
        "transverse_stiffness_N_per_m": "across the load",
    }
    for number, (name, label) in enumerate(labels.items()):
        stiffness.plot(
            over_load["load_N"],
            1e-6 * over_load[name],
            color=color_of(number),
            label=label,
        )
    stiffness.axvline(load, color="grey", linestyle=":", linewidth=1.0)
    stiffness.set_xscale("log")
    stiffness.set_xlabel("radial load [N]")
    stiffness.set_ylabel("stiffness [N/um]")
    stiffness.legend(fontsize=8)
    draw_title(figure, title)
    return figure


def _draw_distribution(axes: Axes, angle_deg: Array, load: Array) -> None:
    """Loads as bars outward from the race, by the angle of each element."""
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    largest = float(load.max())
    race = RACE_RADIUS * largest
    axes.plot(race * np.cos(around), race * np.sin(around), color="grey")
    angles = np.radians(angle_deg)
    for angle, value in zip(angles, load, strict=True):
        ends = np.array([race, race + value])
        axes.plot(
            ends * np.cos(angle),
            ends * np.sin(angle),
            color=color_of(0),
            linewidth=3.0,
        )
    axes.plot(
        race * np.cos(angles),
        race * np.sin(angles),
        linestyle="none",
        marker="o",
        color=color_of(1),
    )
    limit = 2.15 * largest
    axes.set_xlim(-limit, limit)
    axes.set_ylim(-limit, limit)
    axes.set_aspect("equal")
    axes.set_xlabel("load along x, beyond the race [N]")
    axes.set_ylabel("load along y, beyond the race [N]")
