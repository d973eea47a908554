"""Plots of basins of attraction, with one colour per kind of motion in all plots."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lumped.figures.drawing import draw_legend, draw_title, panels
from lumped.rattle.attractors import CHAOTIC, QUIET
from lumped.rattle.basins import BasinMap
from lumped.rattle.machine import Machine

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lumped.rattle.manifolds import PlaneCurve
    from lumped.rattle.noise import NoiseSample

# Quiet, chaotic, undecided
QUIET_COLOR, CHAOTIC_COLOR, UNDECIDED_COLOR = "#1b2a6b", "#8c1515", "#d0d0d0"
OTHERS_COLOR = "#707070"
Color = tuple[float, float, float]
ORBIT_NAME = re.compile(r"P\((\d+),(\d+),(\d+)\)(?: (\w))?")
STICKING_NAME = re.compile(r"sticking\((\d+|irregular)\)(?: (\w))?")
# Part of a turn of the hue from one itinerary to the next
HUE_STEP = 0.6180339887498949
TONES = (0.45, 1.0), (1.0, 0.9), (0.55, 0.65), (0.95, 0.5)  # saturation and value
STICKING_TONE = 0.7, 0.42  # saturation and value of motions that come to rest
MAX_NAMED = 12
# Least distance of colours, and most steps to reach it
MIN_COLOR_DISTANCE, MAX_COLOR_STEPS = 0.2, 50
# colours of curves alone, and over basins
CURVE_COLORS = ("black", "tab:orange", "tab:red", "tab:blue", "tab:green", "tab:purple")
CURVE_COLORS_ON_BASINS = (
    "white",
    "black",
    "yellow",
    "magenta",
    "lime",
    "cyan",
    "orange",
)


def color_of_motion(name: str, shift: int = 0) -> Color:
    """Colour of a motion by its itinerary, so that it is the same in all plots.

    shift : steps from this colour, for motions that would look like others
    """
    from matplotlib.colors import hsv_to_rgb, to_rgb

    if name == QUIET:
        return to_rgb(QUIET_COLOR)
    if (match := ORBIT_NAME.match(name)) is not None:
        turns, upper, lower, copy = match.groups()
        number, begin = (
            _itinerary_index(int(turns), int(upper), int(lower)) + shift,
            0.47,
        )
        saturation, value = TONES[number % len(TONES)]
    elif (match := STICKING_NAME.match(name)) is not None:
        turns, copy = match.groups()
        number = shift + (int(turns) if turns.isdigit() else 0)
        (saturation, value), begin = STICKING_TONE, 0.7
    else:
        return to_rgb(CHAOTIC_COLOR if name.startswith(CHAOTIC) else UNDECIDED_COLOR)
    hue = begin + HUE_STEP * number + 0.09 * (ord(copy or "a") - ord("a"))
    red, green, blue = hsv_to_rgb([hue % 1.0, saturation, value])
    return float(red), float(green), float(blue)


def _itinerary_index(turns: int, upper: int, lower: int) -> int:
    """Index of an itinerary in a list of all of them, short ones first."""
    one, two = turns - 1 + upper - 1 + lower, upper - 1 + lower
    return one * (one + 1) * (one + 2) // 6 + two * (two + 1) // 2 + lower


def colors_of(basins: BasinMap) -> list[Color]:
    """Colours of the attractors by itinerary, shifted as far as necessary to differ
    from those of larger basins; the smallest of many share one."""
    from matplotlib.colors import to_rgb

    colors: list[Color] = len(basins.attractors) * [to_rgb(OTHERS_COLOR)]
    used_colors: list[Color] = [to_rgb(UNDECIDED_COLOR), to_rgb(OTHERS_COLOR)]
    for number in _largest(basins):
        name = basins.attractors[number].name
        choices = (color_of_motion(name, away) for away in range(MAX_COLOR_STEPS))
        first = color_of_motion(name)
        colors[number] = next(
            (
                c
                for c in choices
                if min(math.dist(c, t) for t in used_colors) > MIN_COLOR_DISTANCE
            ),
            first,
        )
        used_colors.append(colors[number])
    return colors


def _largest(basins: BasinMap) -> list[int]:
    """Indices of the attractors that are named, those with large basins first."""
    order = np.argsort(-basins.fractions, kind="stable")
    return [int(number) for number in order[:MAX_NAMED]]


def draw_basins(basins: BasinMap, name: str) -> Figure:
    """Plot the attractors of lift-offs from the upper flank over time and speed."""
    figure, ((axes,),) = panels(1, size=(8.0, 7.0))
    draw_legend(figure, _show_basins(axes, basins), 4)
    draw_title(figure, f"{name}: {axis_labels(basins.machine)}")
    return figure


def _show_basins(axes: Axes, basins: BasinMap) -> list[Any]:
    """Draw basins and return the handles of a legend."""
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    axes.grid(False)
    colors = colors_of(basins)
    palette = np.array([*colors, to_rgb(UNDECIDED_COLOR)])
    axes.imshow(
        palette[basins.attractor],
        origin="lower",
        extent=(0.0, 1.0, *basins.grid.velocity),
        aspect="auto",
        interpolation="nearest",
    )
    for attractor in basins.attractors:
        if attractor.period:
            axes.plot(*attractor.point, "kx", ms=6)
    _label_axes(axes, basins.grid.velocity)
    shown = _largest(basins)
    parts = 100.0 * basins.fractions
    handles: list[Any] = [
        Patch(color=colors[i], label=f"{basins.attractors[i].name} {parts[i]:.3g} %")
        for i in sorted(shown)
    ]
    if others := len(basins.attractors) - len(shown):
        part = parts.sum() - parts[shown].sum()
        handles.append(Patch(color=OTHERS_COLOR, label=f"{others} others {part:.3g} %"))
    if (basins.attractor < 0).any():
        handles.append(Patch(color=UNDECIDED_COLOR, label="undecided"))
    return handles


def _label_axes(axes: Axes, velocity: tuple[float, float]) -> None:
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(*velocity)
    axes.set_xlabel("time of lift-off from the upper flank [turns]")
    axes.set_ylabel("speed of lift-off [rad per turn]")


def draw_curves(
    curves: Sequence[tuple[str, PlaneCurve]],
    marks: Sequence[tuple[float, float]],
    velocity: tuple[float, float],
    title: str,
    basins: BasinMap | None = None,
) -> Figure:
    """Plot curves by their labels, over basins if given.

    marks : lift-offs of saddles
    """
    from matplotlib.patches import Patch

    figure, ((axes,),) = panels(1, size=(8.0, 7.0))
    handles = [] if basins is None else _show_basins(axes, basins)
    palette = list(CURVE_COLORS if basins is None else CURVE_COLORS_ON_BASINS)
    labels = list(dict.fromkeys(label for label, _ in curves))
    for label, curve in curves:
        color = palette[labels.index(label) % len(palette)]
        is_labelled = label in {handle.get_label() for handle in handles}
        axes.plot(*_split_at_jumps(curve).T, "-", color=color, lw=0.8)
        patch = Patch(facecolor=color, edgecolor="black", lw=0.5, label=label)
        handles += [] if is_labelled else [patch]
    for time, speed in marks:
        axes.plot(time, speed, "P", color="white", mec="black", ms=7)
    _label_axes(axes, velocity)
    draw_legend(figure, handles, 4)
    draw_title(figure, title)
    return figure


def _split_at_jumps(curve: PlaneCurve) -> NDArray[np.float64]:
    """Points of a curve, separated where it jumps from one side of the plot to the
    other."""
    jumps = np.flatnonzero(np.abs(np.diff(curve.points[:, 0])) > 0.5) + 1
    return np.insert(curve.points, jumps, np.nan, axis=0)


def draw_noise(noise: NoiseSample, title: str) -> Figure:
    """Plot the fraction of the runs below a noise level, and their motions."""
    figure, ((axes,),) = panels(1, size=(8.0, 5.0))
    order = np.argsort(noise.level, kind="stable")
    order = order[np.isfinite(noise.level[order])]
    fraction = (np.arange(order.size) + 1.0) / len(noise.level)
    axes.step(noise.level[order], fraction, color="black", lw=0.8, where="post")
    for number in range(-1, len(noise.attractors)):
        selected = noise.motion[order] == number
        color = (
            UNDECIDED_COLOR
            if number < 0
            else color_of_motion(noise.attractors[number].name)
        )
        label = "undecided" if number < 0 else noise.attractors[number].name
        if selected.any():
            levels = noise.level[order][selected]
            axes.plot(levels, fraction[selected], ".", color=color, ms=4, label=label)
    axes.set_xlabel("noise level: squared speeds of impacts [rad² per turn³]")
    axes.set_ylabel("part of the runs that are less loud")
    axes.set_ylim(0.0, 1.02)
    if not order.size:
        message = "no attractor identified"
        axes.text(0.5, 0.5, message, ha="center", transform=axes.transAxes)
    draw_legend(figure, axes.get_legend_handles_labels()[0][:MAX_NAMED], 4)
    draw_title(figure, title)
    return figure


def axis_labels(machine: Machine, *without: str) -> str:
    """Description of a machine for a title.

    without : parameters that vary
    """
    contact = "impacts" if machine.is_impact else f"stiffness {machine.stiffness:g}"
    if machine.is_impact and "restitution" not in without:
        contact += f" with restitution {machine.restitution:g}"
    labels = {
        "damping": f"damping {machine.damping:g}",
        "eccentricity": f"eccentricity {machine.eccentricity:g} rad",
        "half_backlash": f"half backlash {machine.half_backlash:g} rad",
        "stiffness": contact,
    }
    if machine.ripple:
        labels["ripple"] = f"ripple {machine.ripple:g} of order {machine.ripple_order}"
    return ", ".join(text for name, text in labels.items() if name not in without)
