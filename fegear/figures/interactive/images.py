"""Images and meshes of colours of matplotlib."""

from __future__ import annotations

import io
from base64 import b64encode
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.figures.interactive.coordinates import Array, FigurePanel, in_data
from fegear.figures.interactive.elements import (
    Element,
    Elements,
    hover_text,
    label_of,
)
from fegear.figures.interactive.styles import css
from fegear.figures.interactive.texts import one_line

if TYPE_CHECKING:
    from matplotlib.collections import QuadMesh
    from matplotlib.image import AxesImage

COLOR_COUNT = 256  # of a continuous colour map


def add_image(elements: Elements, panel: FigurePanel, image: AxesImage) -> None:
    """Colours as a picture, numbers as a heat map in the same colours."""
    values: Any = np.ma.asarray(image.get_array())
    if in_data(panel, image.get_transform()) != (True, True):
        raise TypeError("no interactive form of an image that is not in data")
    left, right, low, high = image.get_extent()
    first, last = (high, low) if image.origin == "upper" else (low, high)
    if values.ndim == 3:
        corners = (left, right), (first, last)
        elements.traces.append(
            _colors(panel, image.to_rgba(values, bytes=True), corners)
        )
        return
    rows, columns = values.shape
    x, y = np.linspace(left, right, columns + 1), np.linspace(first, last, rows + 1)
    elements.traces.append(_heat_map(panel, image, x, y, values))


def _colors(
    panel: FigurePanel,
    pixels: NDArray[np.uint8],
    corners: tuple[tuple[float, float], ...],
) -> Element:
    """A picture; corners : left and right, then the edges of its first and last row."""
    (left, right), (first, last) = corners
    rows, columns = pixels.shape[:2]
    dx, dy = (right - left) / columns, (last - first) / rows
    return {
        "type": "image",
        "source": _png(pixels),
        "colormodel": "rgba256",
        "x0": left + 0.5 * dx,
        "dx": dx,
        "y0": first + 0.5 * dy,
        "dy": dy,
        "xaxis": panel.x,
        "yaxis": panel.y,
        "hovertemplate": hover_text(panel, ""),
    }


def _png(pixels: NDArray[np.uint8]) -> str:
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(pixels, "RGBA").save(content, format="png")
    return "data:image/png;base64," + b64encode(content.getvalue()).decode("ascii")


def add_mesh(elements: Elements, panel: FigurePanel, mesh: QuadMesh) -> None:
    """A heat map; TypeError where columns and rows of the mesh are not straight."""
    corners = np.asarray(mesh.get_coordinates(), float)
    x, y = corners[0, :, 0], corners[:, 0, 1]
    if not (np.all(corners[..., 0] == x) and np.all(corners[..., 1] == y[:, None])):
        raise TypeError("no interactive form of a mesh of colours that is not straight")
    values: Any = np.ma.asarray(mesh.get_array()).reshape(y.size - 1, -1)
    if values.shape[1] != x.size - 1:
        raise TypeError("no interactive form of a mesh whose colours are interpolated")
    elements.traces.append(_heat_map(panel, mesh, x, y, values))


def _heat_map(
    panel: FigurePanel, mappable: Any, x: Array, y: Array, values: np.ma.MaskedArray
) -> Element:
    """Cells between edges x and y; each is coloured by its norm and says its value."""
    data = np.ma.filled(values.astype(float), np.nan)
    colors = mappable.norm(np.ma.masked_invalid(data))
    count = mappable.cmap.N
    # of a norm of classes the number of a colour, else a part of the colour map
    if np.issubdtype(colors.dtype, np.integer):
        colors = (colors + 0.5) / count
    bar = getattr(mappable, "colorbar", None)
    name = one_line(bar.ax.get_ylabel() or bar.ax.get_xlabel()) if bar else "value"
    more = f"{name}: %{{customdata:.5g}}"
    return {
        "type": "heatmap",
        "x": x,
        "y": y,
        "customdata": data,
        "z": np.ma.filled(np.ma.clip(np.ma.asarray(colors, float), 0.0, 1.0), np.nan),
        "zmin": 0.0,
        "zmax": 1.0,
        "colorscale": color_scale(mappable.cmap),
        "xaxis": panel.x,
        "yaxis": panel.y,
        "showscale": False,
        "name": one_line(label_of(mappable)),
        "showlegend": False,
        "hovertemplate": hover_text(panel, label_of(mappable), more),
        "hoverongaps": False,
    }


def color_scale(cmap: Any) -> list[tuple[float, str]]:
    """Colours of a map in steps of one colour each."""
    count = min(cmap.N, COLOR_COUNT)
    colors = [css(cmap((i + 0.5) / count)) for i in range(count)]
    edges = [i / count for i in range(count + 1)]
    steps = zip(edges[:-1], edges[1:], colors, strict=True)
    return [(edge, color) for low, high, color in steps for edge in (low, high)]
