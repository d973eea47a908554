"""Pictures of an eccentric gearing: to scale, with its torque, and in motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.commands.eccentric.gearing import Gearing
from lumped.common.array_types import Array
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MM_PER_INCH = 25.4
MARGIN = 0.05  # of the size of a drawing
FRAMES = 60  # of a film, on every turn of the driver
FILM_WIDTH = 6.4  # inch
DOTS = 100  # per inch of a film
MARKS = 60  # on a curve
STYLES: dict[str, dict[str, Any]] = {
    "pitch": {"linestyle": (0, (8, 3, 2, 3)), "linewidth": 0.6},
    "base": {"linestyle": (0, (4, 3)), "linewidth": 0.6},
    "tooth": {"linestyle": "-", "linewidth": 0.9},
}
COLOURS = {"driver": "tab:blue", "driven": "tab:red"}
WORDS = {"pitch": "pitch curve", "base": "base curve", "tooth": "teeth"}


def turned(points: Array, angle: float, shift: float = 0.0) -> Array:
    """Points (n, 2) turned counter-clockwise, then moved along x [m]."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + [shift, 0.0]


def assembled(gearing: Gearing, angle: float = 0.0) -> dict[str, Array]:
    """Curves (n, 2) of both wheels in mesh [mm]; angle : of the driver's centre."""
    pair = gearing.pair
    turns = {
        "driver": (-float(pair.driver_turn(angle)), 0.0),
        "driven": (float(pair.driven_turn(angle)), pair.center_distance),
    }
    return {
        name: 1e3 * turned(points, *turns[name.split("_")[0]])
        for name, points in gearing.curves.items()
    }


def extent(gearing: Gearing) -> tuple[Array, Array]:
    """Lowest and highest corner of what is drawn of both wheels [mm]."""
    drawn = np.vstack([p for p in assembled(gearing).values() if np.isfinite(p).all()])
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    margin = MARGIN * (high - low)[0]
    return low - margin, high + margin


def swept_extent(gearing: Gearing) -> tuple[Array, Array]:
    """Extent of all places that the wheels reach while they turn."""
    radii = {"driver": 0.0, "driven": 0.0}
    for name, points in gearing.curves.items():
        wheel, kind = name.split("_")
        if kind != "base":
            farthest = float(np.hypot(*points.T).max())
            radii[wheel] = max(radii[wheel], 1e3 * farthest)
    distance, high = 1e3 * gearing.pair.center_distance, max(radii.values())
    low_x, high_x = -radii["driver"], distance + radii["driven"]
    margin = MARGIN * (high_x - low_x)
    return (
        np.array([low_x - margin, -high - margin]),
        np.array([high_x + margin, high + margin]),
    )


def draw_to_scale(gearing: Gearing) -> Figure:
    """Outlines without axes, a millimetre a millimetre."""
    from matplotlib.figure import Figure

    low, high = extent(gearing)
    figure = Figure(figsize=tuple((high - low) / MM_PER_INCH))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    _draw_wheels(axes, gearing)
    return figure


def draw_gearing(gearing: Gearing, contact: Mapping[str, Array]) -> Figure:
    """Both wheels, the torque that comes out, and the transmission error if known.

    contact : columns of a turn under load, by their names; none without a load
    """
    low, high = extent(gearing)
    rows = 3 if contact else 2
    tall = 9.0 * float((high - low)[1] / (high - low)[0])
    heights = [tall, *[2.2] * (rows - 1)]
    figure, grid = panels(rows, size=(9.0, sum(heights) + 1.2), heights=heights)
    wheels, torque = grid[0][0], grid[1][0]
    _draw_wheels(wheels, gearing)
    wheels.set_xlabel("x [mm], driver's bearing at 0")
    wheels.set_ylabel("y [mm]")
    wheels.legend(fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    angle = np.linspace(0.0, 2.0 * math.pi * gearing.pair.lobes, 721)
    degrees = np.degrees(gearing.pair.driver_turn(angle))
    torque.plot(degrees, gearing.pair.torque_ratio(angle), "k", label="kinematics")
    torque.set_ylabel("torque ratio\noutput / input")
    if contact:
        error = grid[2][0]
        at = contact["driver_angle_deg"]
        ratio = contact["contact_torque_ratio"]
        shown = slice(None, None, 1 + at.size // MARKS)
        torque.plot(at[shown], ratio[shown], "r.", label="contact")
        torque.legend(fontsize=8)
        error.plot(at, contact["transmission_error_um"], "k", lw=1.0)
        error.set_ylabel("transmission error\non the line of action [um]")
    grid[-1][0].set_xlabel("turn of the driver [degrees]")
    draw_title(figure, _title(gearing))
    return figure


def film_of(gearing: Gearing) -> Iterator[NDArray[np.uint8]]:
    """Images (height, width, 3) of a turn of the driven wheel."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    low, high = swept_extent(gearing)
    width, height = high - low
    size = FILM_WIDTH, 2.0 * round(0.5 * DOTS * FILM_WIDTH * height / width) / DOTS
    figure = Figure(figsize=size)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    lines = _draw_wheels(axes, gearing)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(DOTS)
    turns = gearing.pair.lobes
    for frame in range(FRAMES * turns):
        angle = 2.0 * math.pi * frame / FRAMES
        for name, points in assembled(gearing, angle).items():
            lines[name].set_data(*points.T)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _draw_wheels(axes: Axes, gearing: Gearing) -> dict[str, Any]:
    """Lines by the name of the curve."""
    lines = {}
    for name, points in assembled(gearing).items():
        wheel, kind = name.split("_")
        shown = points if np.isfinite(points).all() else points[:0]
        label = f"{wheel}, {WORDS[kind]}"
        (lines[name],) = axes.plot(
            *shown.T, color=COLOURS[wheel], label=label, **STYLES[kind]
        )
    distance = 1e3 * gearing.pair.center_distance
    axes.plot([0.0, distance], [0.0, 0.0], "k+", ms=8)
    low, high = extent(gearing)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    return lines


def _title(gearing: Gearing) -> str:
    values = gearing.summary
    text = (
        f"Eccentric gearing: radius {values['radius_mm']:g} mm, eccentricity "
        f"{values['eccentricity_mm']:g} mm, ratio {values['ratio']}, pressure angle "
        f"{values['pressure_angle_deg']:g} degrees, centre distance "
        f"{values['center_distance_mm']:.4f} mm"
    )
    return text if values["feasible"] else f"{text}\nnot feasible: {values['reason']}"
