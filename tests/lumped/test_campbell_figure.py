"""Campbell diagrams: every line can be told from the others."""

from __future__ import annotations

import numpy as np

from lumped.figures.campbell import (
    KIND_COLORS,
    CampbellCurves,
    OrderLine,
    draw_campbell,
)


def diagram(orders: int):
    """One mode of every kind, and lines of orders."""
    kinds = len(KIND_COLORS)
    rpm, rest = np.linspace(0.0, 6000.0, 3), np.zeros((3, kinds))
    whirl, torsion, axial, housing = (rest.copy() for _ in range(4))
    whirl[:, 0], whirl[:, 1], torsion[:, 3] = 1.0, -1.0, 1.0
    axial[:, 4], housing[:, 5] = 1.0, 1.0
    curves = CampbellCurves(
        rpm=rpm,
        frequency_Hz=np.tile(100.0 * np.arange(1, kinds + 1), (3, 1)),
        damping_ratio=rest,
        whirl=whirl,
        torsion=torsion,
        axial=axial,
        housing=housing,
        mesh_energy=rest,
    )
    lines = [OrderLine(f"order {n}", float(n)) for n in range(1, orders + 1)]
    return draw_campbell(curves, lines, [(60.0, 100.0)], [], "machine")


def test_lines_of_orders_differ_in_colour_and_from_modes():
    """Up to seven orders in colour alone, more by dashes too."""
    (axes,) = diagram(7).axes
    orders = [one for one in axes.lines if str(one.get_label()).startswith("order")]
    colors = [one.get_color() for one in orders]
    assert len(set(colors)) == 7
    assert not set(colors) & set(KIND_COLORS.values())
    assert all(one.get_linestyle() != "-" for one in orders)


def test_looks_of_many_orders_differ():
    (axes,) = diagram(28).axes
    orders = [one for one in axes.lines if str(one.get_label()).startswith("order")]
    looks = {(one.get_color(), str(one._unscaled_dash_pattern)) for one in orders}
    assert len(orders) == len(looks) == 28


def test_the_legend_is_outside_of_the_curves():
    figure = diagram(5)
    figure.canvas.draw()
    (legend,), (axes,) = figure.legends, figure.axes
    assert legend.get_window_extent().y1 <= axes.get_window_extent().y0
    labels = {text.get_text() for text in legend.get_texts()}
    assert labels == {*KIND_COLORS, *(f"order {n}" for n in range(1, 6))} | {
        "critical speed"
    }
