"""Figures of mesh tables; functions of a result, drawn without a screen."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fegear.statics.mesh_result import StaticsResult
    from lumped.train.table import MeshTable

SHOWN_PITCHES = 8
PAIR_COLORS = (
    *("tab:orange", "tab:red", "tab:brown", "tab:pink", "tab:olive"),
    *("tab:green", "tab:purple", "tab:gray", "black"),
)
HEIGHTS = 1.35, 1.0, 1.0, 0.8  # of panels
DARKEST, LIGHTEST = 0.0, 0.85  # of the colours of torques


def draw_table(result: StaticsResult, title: str = "") -> Figure:
    """Stiffness, transmission error and load sharing over one base pitch.

    Over SHOWN_PITCHES at most where tooth pairs differ, around the one that differs
    most.
    """
    figure, rows = panels(4, size=(10.0, 11.6), heights=HEIGHTS)
    draw_cycle([row[0] for row in rows], result)
    draw_title(figure, title)
    return figure


def draw_cycle(panels_of_cycle: Sequence[Axes], result: StaticsResult) -> None:
    """Draw into four panels, from the upper one down, as `draw_table`."""
    shown = min(result.pitches, SHOWN_PITCHES)
    first = _most_different(result.table, result.pitches, shown)
    table = _pitches_window(result.table, result.pitches, first, shown)
    stiffness, error, varying, share = panels_of_cycle
    middle = table.torque_Nm.size // 2
    _draw_stiffness(stiffness, table, middle)
    _draw_error(error, table)
    _draw_varying_error(varying, table, result.table)
    _draw_share(share, table, middle)
    for axes in panels_of_cycle:
        if axes is not share:
            axes.sharex(share)
            axes.tick_params(labelbottom=False)
        _shade_contact(axes, table, middle, named=axes is stiffness)
        # outside the panel, where it covers no curve
        axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5))
    left = f", {shown} of {result.pitches}" if shown < result.pitches else ""
    share.set_xlabel(f"mesh position [base pitches from the pitch point{left}]")
    share.set_xlim(first, first + shown)


def _most_different(table: MeshTable, pitches: int, shown: int) -> int:
    """First of the base pitches around the one that differs most from the others."""
    stiffness = table["stiffness_N_per_m"]
    by_pitch = stiffness.reshape(stiffness.shape[0], pitches, -1)
    deviation = np.abs(by_pitch - np.median(by_pitch, axis=1, keepdims=True))
    worst = int(deviation.max(axis=(0, 2)).argmax())
    return min(max(worst - shown // 2, 0), pitches - shown)


def _pitches_window(
    table: MeshTable, pitches: int, first: int, shown: int
) -> MeshTable:
    """The table cut to the base pitches that are shown."""
    per_pitch = table.position.size // pitches
    window = slice(first * per_pitch, (first + shown) * per_pitch)
    columns = {name: values[:, window] for name, values in table.columns.items()}
    return replace(table, position=table.position[window], columns=columns)


def _closed_cycle(table: MeshTable, values: NDArray) -> tuple[NDArray, NDArray]:
    """A column over one base pitch with its first value repeated at position 1."""
    if table.position[-1] >= 1.0:
        return table.position, values
    return np.append(table.position, table.position[0] + 1.0), np.append(
        values, values[0]
    )


def torque_colors(table: MeshTable) -> list[Any]:
    """A colour for each torque, lighter from one to the next."""
    from matplotlib import colormaps

    return list(
        colormaps["viridis"](np.linspace(DARKEST, LIGHTEST, table.torque_Nm.size))
    )


def _draw_by_torque(
    axes: Axes, table: MeshTable, values: NDArray, labels: Sequence[str]
) -> None:
    """A curve for each torque with its label."""
    for color, label, curve in zip(torque_colors(table), labels, values, strict=True):
        axes.plot(*_closed_cycle(table, curve), color=color, lw=1.8, label=label)


def torque_labels(table: MeshTable, template: str) -> list[str]:
    return [template.format(torque) for torque in table.torque_Nm]


def _draw_stiffness(axes: Axes, table: MeshTable, middle: int) -> None:
    labels = torque_labels(table, "total at {:.4g} N m")
    _draw_by_torque(axes, table, 1e-6 * table["stiffness_N_per_m"], labels)
    torque, color = table.torque_Nm[middle], torque_colors(table)[middle]
    position, k = _closed_cycle(table, table["local_stiffness_N_per_m"][middle])
    label = f"local slope dF/dδ\nat {torque:.4g} N m"
    axes.plot(position, 1e-6 * k, ":", color=color, lw=1.4, label=label)
    for pair in range(1, table.pair_count + 1):
        values = table[f"pair{pair}_stiffness_N_per_m"][middle]
        shown = np.where(values > 0.0, values, np.nan)
        axes.plot(
            table.position,
            1e-6 * shown,
            color=PAIR_COLORS[(pair - 1) % len(PAIR_COLORS)],
            ls="--",
            lw=1.4,
            label=f"pair {pair} at {torque:.4g} N m",
        )
    axes.set_ylabel("mesh stiffness F / (δ - δ₀) [N/um]")
    axes.set_ylim(bottom=0.0)


def _draw_error(axes: Axes, table: MeshTable) -> None:
    labels = torque_labels(table, "loaded, {:.4g} N m")
    _draw_by_torque(axes, table, 1e6 * table["ste_m"], labels)
    position, nlte = _closed_cycle(table, table["nlte_m"][0])
    axes.plot(position, 1e6 * nlte, "r--", lw=1.2, label="no load")
    axes.set_ylabel("static transmission\nerror δ [um]")
    axes.set_ylim(bottom=min(0.0, 1.1e6 * float(nlte.min())))


def _draw_varying_error(axes: Axes, table: MeshTable, complete: MeshTable) -> None:
    """The transmission error about its mean, which excites vibration.

    complete : over all base pitches after which tooth pairs repeat, of which the table
        has the first. Mean and peak to peak are those over all of them
    """
    error, every = 1e6 * table["ste_m"], 1e6 * complete["ste_m"]
    pitches = _pitches(complete)
    of = f"\nof all {pitches} pitches" if every.size > error.size else ""
    labels = [
        f"{torque:.4g} N m,\npeak to peak {range_:.3g} um{of}"
        for torque, range_ in zip(table.torque_Nm, np.ptp(every, axis=1), strict=True)
    ]
    mean = every.mean(axis=1, keepdims=True)
    _draw_by_torque(axes, table, error - mean, labels)
    axes.set_ylabel("transmission error\nabout its mean [um]")


def _pitches(table: MeshTable) -> int:
    """Number of base pitches that a table covers."""
    return math.floor(table.position[-1]) + 1


def _draw_share(axes: Axes, table: MeshTable, middle: int) -> None:
    for pair in range(1, table.pair_count + 1):
        axes.plot(
            table.position,
            100.0 * table[f"pair{pair}_load_share"][middle],
            color=PAIR_COLORS[(pair - 1) % len(PAIR_COLORS)],
            label=f"pair {pair}",
        )
    axes.set_ylabel(f"load share [%]\nat {table.torque_Nm[middle]:.4g} N m")
    axes.set_ylim(-3.0, 103.0)


def _shade_contact(axes: Axes, table: MeshTable, middle: int, named: bool) -> None:
    """Shade where two and more pairs are loaded; name the stretches."""
    count = table["n_pairs"][middle].astype(int)
    edges = np.flatnonzero(np.diff(count)) + 1
    position = np.append(table.position, float(_pitches(table)))
    bounds = [0, *edges, len(count)]
    names = {1: "single", 2: "double", 3: "triple"}
    for low, high in itertools.pairwise(bounds):
        pairs = int(count[low])
        start, end = position[low], position[high]
        if pairs > 1:
            axes.axvspan(start, end, color="tab:cyan", alpha=0.06 * pairs, lw=0)
        if named and end - start > 0.08:
            axes.text(
                0.5 * (start + end),
                1.01,
                names.get(pairs, f"{pairs} pairs"),
                transform=axes.get_xaxis_transform(),
                ha="center",
                fontsize=8,
            )
