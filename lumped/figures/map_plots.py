"""Plots of parameter maps: contours over two axes, a curve over one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lumped.common.units import split_unit
from lumped.figures.drawing import draw_title, panels
from lumped.steady.maps import ParameterMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

N_LEVELS = 14
MAX_CONTACT_LOSS = 1e-3  # fraction of the cycle above which contact counts as lost


def draw_map(parameter_map: ParameterMap, title: str = "") -> Figure:
    """Plot the RMS of the DTE [um] for each mesh; loss of contact is hatched.

    A last panel has the largest Lyapunov exponents, where the map has them.
    """
    count = parameter_map.meshes + parameter_map.with_exponents
    figure, (row,) = panels(1, count, size=(5.4 * count, 5.0))
    if parameter_map.with_exponents:
        _draw_exponents(row[-1], parameter_map)
    for mesh, axes in enumerate(row[: parameter_map.meshes]):
        if len(parameter_map.axes) == 2:
            _draw_contours(axes, parameter_map, mesh)
        else:
            _draw_curve(axes, parameter_map, mesh)
        axes.set_title(f"mesh {mesh + 1}", fontsize=10)
    draw_title(figure, title)
    return figure


def _draw_contours(axes: Axes, parameter_map: ParameterMap, mesh: int) -> None:
    from matplotlib.patches import Patch

    axes.grid(False)
    one, two = parameter_map.axes
    x, y = np.array(one.values), np.array(two.values)
    rms = 1e6 * parameter_map.on_grid("dte_rms_m", mesh).T
    lost = parameter_map.on_grid("contact_loss_fraction", mesh).T
    if min(x.size, y.size) < 2 or np.isnan(rms).all():
        axes.text(0.5, 0.5, "no contours", transform=axes.transAxes, ha="center")
        return
    filled = axes.contourf(x, y, rms, N_LEVELS, cmap="viridis")
    lines = axes.contour(x, y, rms, filled.levels, colors="white", linewidths=0.6)
    axes.clabel(lines, fontsize=7, fmt="%g")
    if np.nanmax(lost) > MAX_CONTACT_LOSS:
        axes.contourf(
            x, y, lost, [MAX_CONTACT_LOSS, 2.0], colors="none", hatches=["//"]
        )
        swatch = Patch(fill=False, hatch="//", label="contact is lost")
        axes.legend(handles=[swatch], loc="upper right", fontsize=8)
    axes.figure.colorbar(filled, ax=axes, label="RMS of the DTE without mean [um]")
    axes.set_xlabel(axis_label(one.name))
    axes.set_ylabel(axis_label(two.name))


def _draw_exponents(axes: Axes, parameter_map: ParameterMap) -> None:
    """Largest Lyapunov exponents, with the boundary of chaos as a line."""
    axes.set_title("largest Lyapunov exponent", fontsize=10)
    exponents, first = parameter_map.exponents, parameter_map.axes[0]
    axes.set_xlabel(axis_label(first.name))
    label = "largest Lyapunov exponent [1/period]"
    if len(parameter_map.axes) == 1:
        axes.axhline(0.0, color="0.4", lw=0.8)
        axes.plot(first.values, exponents, "o-", markersize=4)
        axes.set_ylabel(label)
        return
    axes.grid(False)
    second = parameter_map.axes[1]
    largest = float(np.nanmax(np.abs(exponents), initial=0.0))
    if min(exponents.shape) < 2 or largest == 0.0:
        axes.text(0.5, 0.5, "no contours", transform=axes.transAxes, ha="center")
        return
    mesh = axes.pcolormesh(
        *(first.values, second.values, exponents.T),
        cmap="RdBu_r",
        vmin=-largest,
        vmax=largest,
        shading="nearest",
    )
    axes.contour(first.values, second.values, exponents.T, [0.0], colors="k")
    axes.figure.colorbar(mesh, ax=axes, label=label)
    axes.set_ylabel(axis_label(second.name))


def _draw_curve(axes: Axes, parameter_map: ParameterMap, mesh: int) -> None:
    axis = parameter_map.axes[0]
    rms = 1e6 * parameter_map.on_grid("dte_rms_m", mesh)
    lost = parameter_map.on_grid("contact_loss_fraction", mesh) > MAX_CONTACT_LOSS
    axes.plot(axis.values, rms, "o-", markersize=4)
    axes.plot(np.array(axis.values)[lost], rms[lost], "s", label="contact is lost")
    if lost.any():
        axes.legend(fontsize=8)
    axes.set_xlabel(axis_label(axis.name))
    axes.set_ylabel("RMS of the DTE without mean [um]")


def axis_label(name: str) -> str:
    """Label of an axis from its name, such as `mesh 1, tip relief, magnitude [um]`."""
    *path, last = name.split(".")
    quantity, unit = split_unit(last)
    last = quantity.replace("_", " ")
    last = f"{last} [{unit}]" if unit else last
    labels = [step.replace("_", " ") for step in path]
    if len(labels) > 1 and labels[0] in ("mesh", "gear", "shaft"):
        labels = [f"{labels[0]} {labels[1]}", *labels[2:]]
    return ", ".join([*labels, last])
