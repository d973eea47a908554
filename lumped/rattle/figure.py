"""Basins of attraction, drawn: one colour for one kind of motion in all pictures."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.drawing import draw_legend, draw_title, panels
from lumped.rattle.basins import CHAOTIC, QUIET, Attractor, Basins
from lumped.rattle.machine import Machine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NIGHT, RED, GREY = "#1b2a6b", "#8c1515", "#d0d0d0"  # quiet, chaotic, not clear
ORBIT = re.compile(r"P\((\d+),(\d+),(\d+)\)")
GOLDEN = 0.6180339887498949  # of a turn of the hue, from one itinerary to the next
MOST_NAMED = 14


def color_of(attractor: Attractor) -> Any:
    """By the itinerary, so that it is the same in all pictures."""
    from matplotlib.colors import hsv_to_rgb

    if attractor.name == QUIET:
        return NIGHT
    found = ORBIT.match(attractor.name)
    if attractor.name.startswith(CHAOTIC) or found is None:
        return RED
    turns, upper, lower = map(int, found.groups())
    number = 37 * turns + 7 * upper + 3 * lower + 101 * attractor.name.count(" ")
    return tuple(hsv_to_rgb([(0.47 + GOLDEN * number) % 1.0, 0.55, 0.95]))


def draw_basins(basins: Basins, name: str) -> Figure:
    """Where departures from the upper flank lead, over their time and speed."""
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    figure, ((axes,),) = panels(1, size=(8.0, 7.0))
    axes.grid(False)
    colors = [color_of(attractor) for attractor in basins.attractors]
    palette = np.array([to_rgb(color) for color in [*colors, GREY]])
    low, high = basins.grid.velocity
    axes.imshow(
        palette[basins.attractor],
        origin="lower",
        extent=(0.0, 1.0, low, high),
        aspect="auto",
        interpolation="nearest",
    )
    for attractor in basins.attractors:
        time, speed = attractor.point
        if attractor.period:
            axes.plot(time, speed, "kx", ms=6)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(low, high)
    axes.set_xlabel("time of departure from the upper flank [turns]")
    axes.set_ylabel("speed of departure [rad per turn]")
    shown = np.argsort(-basins.fractions, kind="stable")[:MOST_NAMED]
    handles: list[Any] = [
        Patch(
            color=colors[i],
            label=f"{basins.attractors[i].name} {100.0 * basins.fractions[i]:.3g} %",
        )
        for i in sorted(shown)
    ]
    if (basins.attractor < 0).any():
        handles.append(Patch(color=GREY, label="not clear"))
    draw_legend(figure, handles, 4)
    draw_title(figure, f"{name}: {words_of(basins.machine)}")
    return figure


def words_of(machine: Machine, *without: str) -> str:
    """What a title says of a machine; without : figures of it that vary."""
    law = "impacts" if machine.is_impact else f"stiffness {machine.stiffness:g}"
    words = {
        "damping": f"damping {machine.damping:g}",
        "eccentricity": f"eccentricity {machine.eccentricity:g} rad",
        "half_backlash": f"half backlash {machine.half_backlash:g} rad",
        "stiffness": law,
    }
    return ", ".join(text for name, text in words.items() if name not in without)
