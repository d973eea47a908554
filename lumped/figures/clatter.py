"""Plots of a loose wheel's motion in its plays, and of its impacts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lumped.clatter.gearbox import TEETH, LooseWheel
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import State, simulate
from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LABELS = {
    TEETH: "relative distance\nof teeth [mm]",
    "axial": "axial shift [mm]",
    "radial": "radial shift [mm]",
}


def sample_plays(group: WheelGroup, start: State, times: Array) -> Array:
    """Plays (t, p) of a group at increasing times [s] from a start [m]."""
    state, rows, ratios = start.copy(), group.rows, group.ratios
    samples = np.empty((times.size, ratios.size))
    waves = group.excitation.at(times)
    for number, time in enumerate(times):
        for _ in simulate(group, state, float(time)):
            pass
        samples[number] = ratios * waves[number] + rows @ state.q
    return samples


def draw_motion(
    group: WheelGroup, wheel: LooseWheel, start: State, times: Array, title: str
) -> Figure:
    """Plot every play of a wheel over time, between its edges."""
    indices = [i for i, (owner, _) in enumerate(group.plays) if owner is wheel]
    plays, widths = 1e3 * sample_plays(group, start, times), 1e3 * group.widths(times)
    figure, axes = panels(
        len(indices), size=(9.0, 1.0 + 2.2 * len(indices)), share=True
    )
    for row, number in enumerate(indices):
        name = group.plays[number][1]
        (panel,) = axes[row]
        for edge in (0.0 * times, -widths[:, number]):
            panel.plot(times, edge, color="black", linewidth=0.8)
        panel.plot(times, plays[:, number], color=color_of(row), linewidth=1.0)
        panel.set_ylabel(LABELS[name])
    axes[-1][0].set_xlabel("time [s]")
    draw_title(figure, f"{title}: wheel {wheel.name}")
    return figure


def draw_attractor(phase: Array, speed: Array, edge: Array, title: str) -> Figure:
    """Plot impacts of teeth: excitation phase [periods] and approach speed [m/s]."""
    figure, axes = panels(1, size=(8.0, 5.5))
    panel = axes[0][0]
    for number, (side, label) in enumerate(((1, "upper edge"), (-1, "lower edge"))):
        at_edge = edge == side
        panel.plot(
            *(phase[at_edge], speed[at_edge], "."),
            color=color_of(number),
            markersize=1.5 if at_edge.sum() > 500 else 5.0,
            label=label,
            rasterized=True,
        )
    panel.set(xlim=(0.0, 1.0), xlabel="phase of impact [periods of the excitation]")
    panel.set_ylabel("relative speed before impact [m/s]")
    panel.legend(loc="upper right", markerscale=4.0, fontsize=8)
    draw_title(figure, title)
    return figure
