"""Depth of wear over both flanks, and what it changes in their mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from lumped.common.units import TO_UM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fegear.commands.wear.archard import WearingMesh, WornFlanks


def draw_wear(
    mesh: WearingMesh, worn: WornFlanks, names: Sequence[str], title: str
) -> Figure:
    """Draw the depth over the roll angle of both gears, loads and transmission error.

    names : of driver and driven gear
    """
    from lumped.figures.drawing import draw_title, panels

    figure, (depths, contact) = panels(2, 2, size=(11.0, 7.5))
    colors = "tab:blue", "tab:red"
    for row, axes in enumerate(depths):
        _draw_depth(axes, mesh, worn, row, colors[row])
        axes.set_title(names[row], fontsize=10)
    _draw_loads(contact[0], mesh, worn)
    draw_errors(contact[1], worn)
    draw_title(figure, title)
    return figure


def _draw_depth(
    axes: Axes, mesh: WearingMesh, worn: WornFlanks, row: int, color: str
) -> None:
    angles = np.degrees(mesh.roll_angles[row])
    axes.plot(angles, TO_UM * worn.depth[row], color=color)
    axes.fill_between(angles, TO_UM * worn.depth[row], color=color, alpha=0.2)
    pitch = np.interp(0.0, mesh.points.position, angles)
    axes.axvline(pitch, color="black", linestyle=":", label="pitch point")
    axes.set_xlabel("roll angle [deg], tip on the right")
    if mesh.roll_lengths[row, 0] < 0.0:  # an internal gear has its tip inside
        axes.invert_xaxis()
    axes.set_ylabel("depth of wear [um]")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)


def _draw_loads(axes: Axes, mesh: WearingMesh, worn: WornFlanks) -> None:
    position = mesh.points.position
    for loaded, label in ((worn.first, "before"), (worn.last, "worn")):
        axes.plot(position, 1e-3 * loaded.line_load, label=label)
    axes.set_xlabel("position of the pair on the path of contact [base pitches]")
    axes.set_ylabel("load per face width [kN/m]")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)


def draw_errors(axes: Axes, worn: WornFlanks) -> None:
    for loaded, label in ((worn.first, "before"), (worn.last, "worn")):
        position = np.append(loaded.position, loaded.position[0] + 1.0)
        ste = np.append(loaded.ste, loaded.ste[0])
        axes.plot(position, TO_UM * ste, label=label)
    axes.set_xlabel("mesh position [base pitches]")
    axes.set_ylabel("static transmission error [um]")
    axes.legend(fontsize=8)
