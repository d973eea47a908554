"""Panes of a picture below its title, drawn off screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.rendering.look import HEADER


@contextmanager
def panes(size: tuple[int, int], widths: Sequence[float]) -> Iterator[Any]:
    """A plotter whose first row is the title, and whose second one has panes.

    size : of the picture in pixels; widths : of the panes, over that of the picture
    """
    import pyvista

    layout: dict[str, Any] = {
        "shape": (2, len(widths)),
        "row_weights": [HEADER, 1.0 - HEADER],
        "col_weights": list(widths),
        "groups": [(0, slice(None))],
    }
    plotter: Any = pyvista.Plotter(
        off_screen=True,
        window_size=list(size),
        border=False,
        lighting="none",
        **layout,
    )
    try:
        plotter.set_background("white")
        yield plotter
    finally:
        plotter.close()


def screenshot(plotter: Any) -> NDArray[np.uint8]:
    """The picture (height, width, 3) of a plotter."""
    image = plotter.screenshot(None, return_img=True)
    return np.asarray(image, np.uint8)[..., :3]
