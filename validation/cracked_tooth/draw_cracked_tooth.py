"""A figure of the drop of mesh stiffness over the depth of a crack.

    python -m validation.cracked_tooth.draw_cracked_tooth -o cracked-tooth.png

With `--tables` the tables of the page are printed as well.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from validation.cracked_tooth import cracked_page as page
from validation.cracked_tooth.drops import CRACK_ANGLE, DropCurves

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLES = {"parallel": "--", "parabola": "-.", "hinge": ":", "finite elements": "o-"}


def draw_drops(curves: DropCurves, title: str) -> Figure:
    """Drop at the pitch point, and added compliance over that by finite elements."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 3.8), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    percent = 100.0 * curves.depths
    for name, drops in curves.drops.items():
        style = STYLES[name]
        values = [100.0 * drop.at_pitch_point for drop in drops]
        color = "k" if name == "finite elements" else None
        left.plot(percent, values, style, color=color, label=page.NAMES[name])
    _draw_ratios(right, curves)
    label = "crack over root thickness [%]"
    left.set(title=title, xlabel=label, ylabel="drop of mesh stiffness [%]")
    right.set(title="compliance added by the crack", xlabel=label)
    right.set_ylabel("formula over finite elements")
    left.legend()
    return figure


def _draw_ratios(axes: Axes, curves: DropCurves) -> None:
    elements = _added(curves, "finite elements")
    for name in curves.drops:
        if name != "finite elements":
            ratio = _added(curves, name) / elements
            axes.plot(100.0 * curves.depths, ratio, STYLES[name])
    axes.axhline(1.0, color="k", lw=1.0)
    axes.set_ylim(bottom=0.0)


def _added(curves: DropCurves, name: str) -> np.ndarray:
    return np.array([drop.added_compliance for drop in curves.drops[name]])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--tables", action="store_true", help="print all tables")
    arguments = parser.parse_args()
    pair = page.pairs()[0]
    title = f"{pair.name}, tooth at the pitch point"
    draw_drops(page.drop_curves(pair, CRACK_ANGLE), title).savefig(arguments.output)
    if arguments.tables:
        parts = [page.factor_table(), page.parts_table(), page.stress_table()]
        parts += [page.corner_table(), page.compliance_table(0, 0.5 * math.pi)]
        for number in range(len(page.pairs())):
            parts += [page.drop_table(number), page.compliance_table(number)]
        sys.stdout.write("\n\n".join(parts) + "\n")


if __name__ == "__main__":
    main()
