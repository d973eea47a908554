"""Files of an eccentric gearing, by their endings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fegear.commands.eccentric.gearing import Gearing
from fegear.commands.eccentric.gearing_figure import (
    assembled,
    draw_to_scale,
    film_of,
    turned,
)
from fegear.commands.eccentric.turn import wheel_meshes
from fegear.files.dxf import write_dxf
from fegear.files.output import write_whole

DRAWINGS, MESHES = (".svg", ".dxf"), (".msh", ".vtu")


def write_drawing(
    gearing: Gearing, path: Path, bore_mm: float | None, resolution: str
) -> None:
    """Curves to scale as .svg and .dxf [mm], meshes as .msh and .vtu [m]."""
    kind = path.suffix.lower()
    if kind == ".svg":
        _write_svg(gearing, path)
    elif kind == ".dxf":
        curves = assembled(gearing).items()
        write_dxf(path, {name: points[:-1] for name, points in curves})
    else:
        _write_meshes(gearing, path, bore_mm, resolution)


def write_animation(gearing: Gearing, path: Path) -> None:
    """A turn of the driven wheel."""
    from PIL import Image as pillow

    from fegear.figures.film import write_film

    images = list(film_of(gearing))
    colours = pillow.fromarray(images[0]).quantize(256).getpalette() or []
    palette = np.zeros((256, 3), np.uint8)
    palette.ravel()[: len(colours)] = colours
    write_whole(path, lambda place: write_film(images, place, palette))


def _write_svg(gearing: Gearing, path: Path) -> None:
    from matplotlib import rc_context

    from fegear.figures.saving import save_figure

    with rc_context({"path.simplify": False}):  # which leaves out what no eye sees
        write_whole(path, lambda place: save_figure(draw_to_scale(gearing), place))


def _write_meshes(
    gearing: Gearing, path: Path, bore_mm: float | None, resolution: str
) -> None:
    """Both wheels in mesh."""
    from meshes.files import write_triangles

    meshes = wheel_meshes(gearing, bore_mm, resolution)
    driver, driven = meshes
    points = np.vstack(
        [driver.points, turned(driven.points, 0.0, gearing.pair.center_distance)]
    )
    triangles = np.vstack([driver.triangles, driven.triangles + len(driver.points)])
    wheel: NDArray[np.int64] = np.repeat([0, 1], [len(m.triangles) for m in meshes])
    parts = "wheel", wheel, ("driver", "driven")
    write_whole(path, lambda place: write_triangles(place, points, triangles, *parts))
