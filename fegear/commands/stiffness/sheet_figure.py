"""One page of a pair whose loads vary over the width: over the cycle and the flank."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fegear.commands.stiffness.face_figure import (
    PLACES_LABEL,
    draw_flank,
    draw_load,
    draw_roots,
)
from fegear.commands.stiffness.figure import (
    HEIGHTS,
    draw_cycle,
    torque_colors,
    torque_labels,
)
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fegear.statics.mesh_result import StaticsResult

SIZE = 17.0, 12.4  # [inch]
HARMONICS = 8  # of the mesh frequency
GROUP = 0.8  # of a harmonic's place that its bars take


def draw_sheet(result: StaticsResult, title: str = "") -> Figure:
    """Draw stiffness, motion and load sharing, contact pattern, loads and spectrum."""
    figure, rows = panels(len(HEIGHTS), 2, size=SIZE, heights=HEIGHTS)
    cycle, face = (list(column) for column in zip(*rows, strict=True))
    draw_cycle(cycle, result)
    pattern, load, *lower = face
    label = "contact pressure [MPa]\nthat of edges beyond the scale"
    figure.colorbar(draw_flank(pattern, result), ax=pattern, label=label, extend="max")
    draw_load(load, result)
    over_width = result.roots.over_width if result.roots else ()
    roots, spectrum = lower if over_width else (None, lower[0])
    if roots is None:
        lower[1].set_axis_off()
    else:
        draw_roots(roots, result, over_width)
        roots.sharex(pattern)
    load.sharex(pattern)
    (load if roots is None else roots).set_xlabel(PLACES_LABEL)
    _draw_spectrum(spectrum, result)
    draw_title(figure, title)
    return figure


def _draw_spectrum(axes: Axes, result: StaticsResult) -> None:
    """Amplitudes of the transmission error at harmonics of the mesh frequency."""
    table, harmonics = result.table, result.harmonics("ste_m", HARMONICS)
    count = len(harmonics)
    labels = torque_labels(table, "{:.4g} N m")
    for t, (of_torque, color, label) in enumerate(
        zip(harmonics, torque_colors(table), labels, strict=True)
    ):
        shift = GROUP * ((t + 0.5) / count - 0.5)
        numbers = np.array([one.order for one in of_torque], float)
        amplitudes = [1e6 * one.amplitude for one in of_torque]
        axes.bar(numbers + shift, amplitudes, GROUP / count, color=color, label=label)
    axes.set_xlabel("harmonic of the mesh frequency")
    axes.set_ylabel("amplitude of the\ntransmission error [um]")
    axes.set_xticks(np.arange(1, max(len(h) for h in harmonics) + 1))
    axes.legend(fontsize=8)
