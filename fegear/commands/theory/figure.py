"""Pictures of closed forms: frequency response with its unstable branches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lumped.closed_forms import contact_loss_amplitude, steady_vibrations
from lumped.closed_forms.predictions import Prediction
from lumped.common.array_types import Array
from lumped.figures.drawing import color_of, draw_legend, draw_title, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure


AMPLITUDES = 400  # along a curve
OPEN_MARKER = (
    2.0  # times that of first lost contact, up to which an open curve is shown
)
SPEED_MARGIN = 0.25  # of the resonant speed, how far from it a curve goes
MARKERS: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 1.8}
PALE_SHARE = 0.3  # share of the colour that unstable vibrations keep


def draw_theory(predictions: Sequence[Prediction], meshes: int, title: str) -> Figure:
    """RMS of the DTE [um] over the mesh frequency, a panel for each mesh."""
    figure, rows = panels(meshes, size=(9.0, 1.2 + 3.4 * meshes), share=True)
    points = [(prediction, *response_points(prediction)) for prediction in predictions]
    points = [entry for entry in points if entry[1].size]
    names = list(
        dict.fromkeys(_prediction_kind(prediction) for prediction, *_ in points)
    )
    for prediction, amplitude, frequency, stable in points:
        full = color_of(names.index(_prediction_kind(prediction)))
        for m, (axes,) in enumerate(rows):
            shape = prediction.resonance.amplitudes(1.0)[m]
            rms = 1e6 * shape / math.sqrt(2.0) * amplitude
            for flags, color in ((~stable, _pale_color(full)), (stable, full)):
                axes.plot(frequency[flags], rms[flags], color=color, **MARKERS)
    for m, (axes,) in enumerate(rows):
        axes.set_ylabel(f"mesh {m + 1}: RMS of dynamic\ntransmission error [um]")
        axes.set_ylim(bottom=0.0)
    rows[-1][0].set_xlabel("mesh frequency of the first mesh [Hz]")
    draw_legend(figure, _legend_handles(names), columns=4)
    draw_title(figure, title)
    return figure


def _prediction_kind(prediction: Prediction) -> str:
    return " and ".join(dict.fromkeys(prediction.kinds.values()))


def _legend_handles(names: list[str]) -> list[object]:
    from matplotlib.lines import Line2D

    large = {"markersize": 5}
    handles: list[object] = [
        Line2D([], [], color=color_of(i), label=name, **(MARKERS | large))
        for i, name in enumerate(names)
    ]
    unstable = MARKERS | large | {"color": _pale_color("black")}
    return [*handles, Line2D([], [], label="unstable", **unstable)]


def _pale_color(color: str) -> tuple[float, ...]:
    """Opaque, for points of one curve lie on each other."""
    from matplotlib.colors import to_rgb

    return tuple(1.0 - PALE_SHARE * (1.0 - part) for part in to_rgb(color))


def response_points(prediction: Prediction) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Amplitudes of the mode, mesh frequencies and stability of n vibrations, (n,)."""
    resonance, top = prediction.resonance, prediction.top
    if top is None:
        max_response = OPEN_MARKER * float(contact_loss_amplitude(resonance).min())
    else:
        max_response = top.amplitude
    points = [
        (vibration.amplitude, vibration.frequency, vibration.stable)
        for amplitude in max_response * np.linspace(0.01, 1.0, AMPLITUDES)
        for vibration in steady_vibrations(resonance, float(amplitude))
        if abs(vibration.frequency / resonance.at - 1.0) < SPEED_MARGIN
    ]
    values = np.array(points, float).reshape(-1, 3)
    return values[:, 0], values[:, 1], values[:, 2] > 0.5
