"""Depth of wear over profile and face width, and what it changes in a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fegear.commands.wear.faces import loads_over_width
from fegear.commands.wear.figure import draw_errors
from lumped.common.units import MM, TO_UM
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

    from fegear.commands.wear.archard import WornFlanks
    from fegear.commands.wear.faces import WearingFaces


def draw_worn_faces(
    mesh: WearingFaces, worn: WornFlanks, names: Sequence[str], title: str
) -> Figure:
    """Draw the depth over both flanks, loads over the width and transmission error.

    names : of driver and driven gear
    """
    figure, (depths, contact) = panels(2, 2, size=(11.0, 8.0), heights=(1.5, 1.0))
    for row, axes in enumerate(depths):
        drawn = _draw_depth(axes, mesh, worn, row)
        axes.set_title(names[row], fontsize=10)
    figure.colorbar(drawn, ax=depths, label="depth of wear [um]")
    _draw_loads(contact[0], mesh, worn)
    draw_errors(contact[1], worn)
    draw_title(figure, title)
    return figure


def _draw_depth(axes: Axes, mesh: WearingFaces, worn: WornFlanks, row: int) -> QuadMesh:
    order = np.argsort(mesh.roll_angles[row])
    angles = np.degrees(mesh.roll_angles[row])
    drawn = axes.pcolormesh(
        mesh.places[row] / MM,
        angles[order],
        TO_UM * worn.depth[row, order],
        shading="nearest",
        cmap="viridis",
        rasterized=True,
        vmin=0.0,
        vmax=TO_UM * float(worn.depth.max()),
    )
    pitch = np.interp(0.0, mesh.points.position, angles)
    axes.axhline(pitch, color="white", linestyle=":", label="pitch point")
    axes.set_xlabel("place over the face width [mm], near end left")
    axes.set_ylabel("roll angle [deg], tip above")
    axes.grid(visible=False)
    return drawn


def _draw_loads(axes: Axes, mesh: WearingFaces, worn: WornFlanks) -> None:
    labels = "before", "worn"
    for loaded, label in zip(loads_over_width(worn), labels, strict=True):
        text = f"{label}, K_Hbeta = {loaded.distribution_factor:.3g}"
        places = mesh.solver.places / MM
        axes.plot(places, 1e-3 * loaded.per_width, marker=".", label=text)
    axes.set_xlabel("place over the common face width [mm], near end left")
    axes.set_ylabel("load per face width [kN/m],\nmean over the cycle")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)
