"""Campbell diagrams: natural frequencies over the speed, and orders of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lumped.common.array_types import Array
from lumped.figures.drawing import draw_legend, draw_title, panels
from lumped.rotors.whirl import ModeKind, mode_kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KIND_COLORS: dict[ModeKind, str] = {
    "forward": "tab:blue",
    "backward": "tab:red",
    "planar": "tab:green",
    "torsion": "tab:purple",
    "axial": "tab:brown",
    "housing": "tab:olive",
}
# of orders, none that a kind of mode has; with the styles 28 lines differ
ORDER_COLORS = (
    *("black", "tab:cyan", "tab:orange", "deeppink", "limegreen", "navy", "0.55"),
)
ORDER_STYLES = "--", "-.", ":", (0, (6, 1.5, 1, 1.5, 1, 1.5))
UNSTABLE_COLOR = "tab:orange"
TOP_MARGIN = 1.05  # of the ordinate, over the highest frequency


@dataclass(frozen=True)
class OrderLine:
    """Frequency that is proportional to the speed.

    order : cycles per turn of the system
    """

    name: str
    order: float


@dataclass(frozen=True, eq=False, kw_only=True)
class CampbellCurves:
    """Modes over speeds, NaN where a mode has ended; arrays are (speeds, modes).

    rpm : speeds (speeds,) of the system [rpm]
    """

    rpm: Array
    frequency_Hz: Array
    damping_ratio: Array
    whirl: Array
    torsion: Array
    axial: Array
    housing: Array
    mesh_energy: Array

    @property
    def count(self) -> int:
        """Number of modes."""
        return int(self.frequency_Hz.shape[1])

    def kind(self, mode: int) -> ModeKind:
        """Kind of a mode at the highest speed that it has."""
        last = int(np.flatnonzero(np.isfinite(self.frequency_Hz[:, mode])).max())
        parts = self.whirl, self.torsion, self.axial, self.housing
        return mode_kind(*(float(part[last, mode]) for part in parts))


def draw_campbell(
    curves: CampbellCurves,
    orders: Sequence[OrderLine],
    critical: Sequence[tuple[float, float]],
    unstable: Sequence[tuple[float, float]],
    title: str,
) -> Figure:
    """Plot frequencies over speed, coloured by the kind at the highest speed.

    critical : speeds [rpm] and frequencies [Hz], marked by points
    unstable : speeds [rpm] between which vibration grows, shaded
    """
    figure, ((axes,),) = panels(1, size=(9.0, 6.5))
    top = TOP_MARGIN * float(np.nanmax(curves.frequency_Hz))
    handles = _draw_modes(axes, curves)
    handles += _draw_orders(axes, orders, float(curves.rpm[-1]), top)
    for low, high in unstable:
        span = axes.axvspan(low, high, color=UNSTABLE_COLOR, alpha=0.15, lw=0)
        span.set_label("vibration grows")
        handles.append(span)
    if critical:
        rpm, hertz = np.array(critical).T
        style: dict[str, Any] = {"ms": 4, "zorder": 4, "label": "critical speed"}
        handles += axes.plot(rpm, hertz, "ko", **style)
    axes.set_xlim(0.0, float(curves.rpm[-1]))
    axes.set_ylim(0.0, top)
    axes.set_xlabel("speed of the first mesh's driver [rpm]")
    axes.set_ylabel("natural frequency [Hz]")
    unique = {handle.get_label(): handle for handle in handles}
    draw_legend(figure, unique.values(), 4)
    draw_title(figure, title)
    return figure


def _draw_modes(axes: Axes, curves: CampbellCurves) -> list[Any]:
    handles = {}
    for mode in range(curves.count):
        kind = curves.kind(mode)
        style: dict[str, Any] = {"color": KIND_COLORS[kind], "lw": 1.2, "label": kind}
        (handles[kind],) = axes.plot(curves.rpm, curves.frequency_Hz[:, mode], **style)
    return [handles[kind] for kind in KIND_COLORS if kind in handles]


def _draw_orders(
    axes: Axes, orders: Sequence[OrderLine], last: float, top: float
) -> list[Any]:
    handles = []
    for number, line in enumerate(orders):
        end = min(last, 60.0 * top / line.order)
        look: dict[str, Any] = {
            "color": ORDER_COLORS[number % len(ORDER_COLORS)],
            "ls": ORDER_STYLES[number % len(ORDER_STYLES)],
            "lw": 1.3,
        }
        ends = [0.0, end], [0.0, line.order * end / 60.0]
        handles += axes.plot(*ends, label=line.name, **look)
    return handles
