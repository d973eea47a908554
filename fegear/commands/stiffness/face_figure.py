"""Pressure over the flank, and load over the face width."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fegear.contact.face import FaceLoads
from lumped.common.array_types import Array
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fegear.statics.mesh_result import StaticsResult

BEYOND_PATH = 0.15  # that is drawn of the path on either side [base pitches]


def draw_face(result: StaticsResult, title: str = "") -> Figure:
    """Largest pressure on a flank at the largest torque, and the load over the width.

    A tooth passes all places of the path in one turn: what any pair has at a place,
    each tooth has there.
    """
    face, pair = result.cycle.face, result.problem.pair
    if face is None:
        raise ValueError("face = None; loads are equal over the face width")
    largest = int(np.argmax(result.cycle.torque))
    figure, rows = panels(2, size=(9.0, 8.0), heights=(3.0, 2.0), share=True)
    flank, load = (row[0] for row in rows)
    place, path, pressure = _pressure_map(face, largest)
    # edges have no limit and would take all the colours
    most = np.where(face.on_path, face.pressure[largest], 0.0).max()
    drawn = flank.pcolormesh(
        1e3 * place,
        path,
        1e-6 * pressure,
        shading="gouraud",
        cmap="viridis",
        vmin=0.0,
        vmax=1e-6 * most,
    )
    label = "contact pressure [MPa], that of edges beyond the scale"
    figure.colorbar(drawn, ax=[flank, load], label=label, extend="max")
    flank.set_ylim(pair.path[0] - BEYOND_PATH, pair.path[1] + BEYOND_PATH)
    for end in pair.path:
        flank.axhline(end, color="0.4", linewidth=0.8, linestyle="--")
    flank.axhline(0.0, color="0.7", linewidth=0.8)
    flank.set_ylabel(
        "place on the path of contact\n[base pitches from the pitch point]"
    )
    flank.set_title(
        f"{result.cycle.torque[largest]:g} N m; dashed: ends of the path", fontsize=9
    )
    _draw_load(load, face, result)
    load.set_xlabel("place over the face width, from its middle [mm]")
    draw_title(figure, title)
    return figure


def _pressure_map(face: FaceLoads, torque: int) -> tuple[Array, Array, Array]:
    """Place [m], path position and pressure [Pa] (p, m) of one tooth in order."""
    positions, pairs, slices = face.path_position.shape
    path = face.path_position.reshape(positions * pairs, slices)
    pressure = face.pressure[torque].reshape(positions * pairs, slices)
    order = np.argsort(path[:, slices // 2], kind="stable")
    path, pressure = path[order], pressure[order]
    loaded = np.flatnonzero((pressure > 0.0).any(axis=1))
    ends = slice(max(loaded[0] - 1, 0), loaded[-1] + 2)
    place = np.broadcast_to(face.place, path[ends].shape)
    return place, path[ends], pressure[ends]


def _draw_load(axes: Axes, face: FaceLoads, result: StaticsResult) -> None:
    for t, torque in enumerate(result.cycle.torque):
        per_width = 1e-3 * face.per_width[t]
        mean = per_width.mean(axis=0)
        (line,) = axes.plot(1e3 * face.place, mean, label=f"{torque:g} N m")
        low, high = per_width.min(axis=0), per_width.max(axis=0)
        axes.fill_between(
            1e3 * face.place, low, high, color=line.get_color(), alpha=0.2, linewidth=0
        )
    axes.set_ylabel("load per width [N/mm]\nmean and range over the cycle")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)
