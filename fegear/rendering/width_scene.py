"""Pictures and VTK files of contact over the face width, in space.

Side by side are the flanks of the driver and those of the driven gear that carry the
load: of each gear the other one hides them, which is translucent there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.rendering.flank_surfaces import (
    GearInSpace,
    ToothSurface,
    band_surface,
    tooth_surface,
)
from fegear.rendering.labels import draw_bar, draw_label, draw_title, scaled
from fegear.rendering.look import BODY, COLOURS, INK, MARGIN
from fegear.rendering.panes import panes, screenshot
from fegear.rendering.width_contact import PairLoad, WidthMoment, pair_number
from fegear.rendering.width_look import (
    EDGE_COLOUR,
    LIFT,
    VIEWS,
    Eye,
    WidthStyle,
    details_of,
    gear_text,
    legend_of,
    numbered,
    pair_text,
)
from lumped.common.array_types import Array, Indices

if TYPE_CHECKING:
    import pyvista

MATE_OPACITY, LINE_OPACITY = 0.08, 0.25  # of the gear in front
AMBIENT, DIFFUSE, LIGHT = 0.35, 0.60, 1.0
QUAD = 9  # VTK's cell type
PLAIN = {"color": INK, "scalars": None}  # of contacts beside the root stress


def draw_over_width(
    moment: WidthMoment, style: WidthStyle, title: str, size: tuple[int, int]
) -> NDArray[np.uint8]:
    """The picture (height, width, 3) of one position."""
    side = (1.0 - MARGIN) / VIEWS
    with panes(size, [*VIEWS * [side], MARGIN]) as plotter:
        for gear in range(VIEWS):
            plotter.subplot(1, gear)
            mapper = _draw_view(plotter, moment, style, gear, size)
        plotter.subplot(1, VIEWS)
        draw_bar(plotter, mapper, legend_of(moment, style.shown), size)
        plotter.subplot(0, 0)
        draw_title(plotter, title, details_of(moment, style), size)
        return screenshot(plotter)


def _draw_view(
    plotter: Any,
    moment: WidthMoment,
    style: WidthStyle,
    index: int,
    size: tuple[int, int],
) -> Any:
    """Loaded flanks of one gear behind its mate; the mapper of the colours."""
    import pyvista

    gear, mate = moment.gears[index], moment.gears[1 - index]
    eye = style.eyes[index]
    _look_from(plotter, eye)
    plotter.enable_anti_aliasing("ssaa" if size[0] < 1000 else "msaa")
    of_teeth: Any = None
    light = pyvista.Light(light_type="headlight", intensity=LIGHT)
    plotter.add_light(light, only_active=True)
    line = max(1.0, 1.5 * size[1] / 1080.0)
    for one, opacity, of_lines in (
        (gear, 1.0, 1.0),
        (mate, MATE_OPACITY, LINE_OPACITY),
    ):
        teeth = [tooth_surface(one, moment.place, pair) for pair in style.pairs]
        surface, edges = _surface(teeth), _edges(teeth)
        painted: dict[str, Any] = {"color": BODY}
        if style.shown == "root-stress" and one is gear:
            surface["root_stress_MPa"] = 1e-6 * np.concatenate(
                [
                    moment.root_stress(index, pair, tooth)
                    for pair, tooth in zip(style.pairs, teeth, strict=True)
                ]
            )
            painted = _colours(style, "root_stress_MPa", BODY)
        body = plotter.add_mesh(
            surface,
            **painted,
            opacity=opacity,
            ambient=AMBIENT,
            diffuse=DIFFUSE,
            smooth_shading=False,
            reset_camera=False,
        )
        of_teeth = body if one is gear else of_teeth
        plotter.add_mesh(
            edges,
            color=INK,
            line_width=line,
            opacity=of_lines,
            lighting=False,
            reset_camera=False,
        )
    bands, is_pressure = _bands(moment, style, index), style.shown == "pressure"
    of_bands = plotter.add_mesh(
        bands,
        **(_colours(style, "pressure_MPa", EDGE_COLOUR) if is_pressure else PLAIN),
        lighting=False,
        reset_camera=False,
    )
    _draw_names(plotter, moment, style, index, size)
    return (of_bands if is_pressure else of_teeth).mapper


def _colours(style: WidthStyle, scalars: str, elsewhere: str) -> dict[str, Any]:
    """How a field is painted; elsewhere : colour where it has no value."""
    return {
        "scalars": scalars,
        "cmap": COLOURS[style.shown].map,
        "clim": (0.0, 1e-6 * style.limit),
        "nan_color": elsewhere,
        "show_scalar_bar": False,
    }


def write_width_vtu(moment: WidthMoment, pairs: Sequence[int], path: Path) -> None:
    """Teeth and contacts of both gears for ParaView, true to scale; SI units."""
    import pyvista

    parts = [
        part
        for gear in (0, 1)
        for part in (
            *(_tooth_data(moment, gear, pair) for pair in pairs),
            _band_data(moment, gear),
        )
    ]
    starts = np.cumsum([0, *(len(part.points) for part in parts)])[:-1]
    faces = [part.faces + at for part, at in zip(parts, starts, strict=True)]
    points = np.vstack([part.points for part in parts])
    grid = pyvista.UnstructuredGrid({QUAD: np.vstack(faces)}, points)
    for name in parts[0].at_points:
        grid.point_data[name] = np.concatenate([p.at_points[name] for p in parts])
    for name in parts[0].at_cells:
        grid.cell_data[name] = np.concatenate([p.at_cells[name] for p in parts])
    loads = moment.pair_loads(0)
    grid.field_data["torque_Nm"] = [moment.torque]
    grid.field_data["position_base_pitches"] = [moment.position]
    grid.field_data["transmission_error_m"] = [moment.ste]
    grid.field_data["pair"] = [pair.pair for pair in loads]
    grid.field_data["pair_load_N"] = [pair.load for pair in loads]
    grid.save(path)


@dataclass(frozen=True, eq=False)
class SurfaceData:
    """A surface of quadrilaterals with its fields by name."""

    points: Array
    faces: Indices
    at_points: dict[str, Array]
    at_cells: dict[str, Indices]


def _tooth_data(moment: WidthMoment, gear: int, pair: int) -> SurfaceData:
    tooth = tooth_surface(moment.gears[gear], moment.place, pair)
    pressure, place = np.zeros(len(tooth.points)), -tooth.points[:, 2]
    at_points = {"pressure_Pa": pressure, "arc_m": tooth.arc, "place_m": place}
    if moment.tensions:
        at_points["root_stress_Pa"] = moment.root_stress(gear, pair, tooth)
    return SurfaceData(
        points=tooth.points,
        faces=tooth.faces,
        at_points=at_points,
        at_cells=_cell_data(len(tooth.faces), gear, pair),
    )


def _band_data(moment: WidthMoment, gear: int) -> SurfaceData:
    band = moment.band(gear)
    surface = band_surface(moment.gears[gear], band, moment.place)
    pressure = np.broadcast_to(surface.pressure[:, None], surface.arc.shape).ravel()
    points, faces = surface.points.reshape(-1, 3), surface.faces
    of_slice = np.repeat(np.arange(band.pair.size), len(faces) // band.pair.size)
    data = {"pressure_Pa": pressure, "arc_m": surface.arc.ravel()}
    if moment.tensions:
        data["root_stress_Pa"] = np.full(len(points), np.nan)
    return SurfaceData(
        points=points,
        faces=faces,
        at_points=data | {"place_m": -points[:, 2]},
        at_cells=_cell_data(
            len(faces), gear, band.pair[of_slice], 1, band.on_path[of_slice]
        ),
    )


def _cell_data(
    count: int, gear: int, pair: Any, contact: int = 0, on_path: Any = 0
) -> dict[str, Indices]:
    """Fields of faces; on_path : whether flanks touch, 0 of edges and of teeth."""
    values = {"gear": gear, "pair": pair, "contact": contact, "on_path": on_path}
    return {
        name: np.broadcast_to(value, count).astype(np.int64)
        for name, value in values.items()
    }


def _look_from(plotter: Any, eye: Eye) -> None:
    camera, distance = plotter.camera, 20.0 * eye.half_height
    camera.parallel_projection = True
    camera.focal_point = tuple(eye.middle)
    camera.position = tuple(eye.middle + distance * eye.toward)
    camera.up = tuple(eye.up)
    camera.parallel_scale = eye.half_height
    camera.clipping_range = (0.75 * distance, 1.25 * distance)
    plotter.renderer.camera_set = True


def _surface(teeth: Sequence[ToothSurface]) -> pyvista.PolyData:
    import pyvista

    faces = numbered(teeth, "faces")
    counts = np.full(len(faces), faces.shape[1])
    points = np.vstack([tooth.points for tooth in teeth])
    return pyvista.PolyData(points, faces=np.column_stack([counts, faces]).ravel())


def _edges(teeth: Sequence[ToothSurface]) -> pyvista.PolyData:
    import pyvista

    edges = numbered(teeth, "edges")
    points = np.vstack([tooth.points for tooth in teeth])
    lines = np.column_stack([np.full(len(edges), 2), edges])
    return pyvista.PolyData(points, lines=lines.ravel())


def _bands(moment: WidthMoment, style: WidthStyle, index: int) -> pyvista.PolyData:
    """Contacts on the flanks of a gear, toward the eye; edges have no value."""
    import pyvista

    gear, band = moment.gears[index], moment.band(index)
    surface = band_surface(gear, band, moment.place, style.widening)
    shown = np.where(band.on_path[:, None], 1e-6 * surface.pressure, np.nan)
    shown = np.broadcast_to(shown[:, None], surface.arc.shape)
    lift = LIFT * gear.teeth.module * style.eyes[index].toward
    faces = surface.faces
    counts = np.full(len(faces), 4)
    bands = pyvista.PolyData(
        surface.points.reshape(-1, 3) + lift,
        faces=np.column_stack([counts, faces]).ravel(),
    )
    bands.point_data["pressure_MPa"] = shown.ravel()
    return bands


def _draw_names(
    plotter: Any,
    moment: WidthMoment,
    style: WidthStyle,
    index: int,
    size: tuple[int, int],
) -> None:
    """The gear's name, its ends, and the load of every pair."""
    gear, eye = moment.gears[index], style.eyes[index]
    _draw_text(plotter, gear_text(gear), (0.03, 0.02), scaled(13, size))
    for text, place in zip(("near end", "far end"), gear.ends, strict=True):
        side = np.sign((eye.right @ [0.0, 0.0, -1.0]) * place)
        corner = (0.84 if side > 0 else 0.02, 0.93)
        _draw_text(plotter, text, corner, scaled(12, size))
    loads = moment.pair_loads(index)
    for pair in loads:
        at = _right_end(gear, pair, moment, eye)
        draw_label(plotter, f"{pair_number(pair.pair)}", at, scaled(20, size))
    if index != 0:
        return  # the loads are those of both gears
    text = "\n".join(pair_text(pair) for pair in loads)
    _draw_text(plotter, text, (0.03, 0.07), scaled(11, size))


def _draw_text(plotter: Any, text: str, at: tuple[float, float], font: int) -> None:
    """Text whose lower left corner is at a part of the view's width and height."""
    plotter.add_text(text, position=at, viewport=True, font_size=font, color=INK)


def _right_end(
    gear: GearInSpace, pair: PairLoad, moment: WidthMoment, eye: Eye
) -> Array:
    """Beside the end of a contact at the right of the picture, toward the eye (3,)."""
    band = pair.band
    ends = gear.flank(band.arc, band.place, moment.place, pair.pair).reshape(-1, 3)
    end = ends[(ends @ eye.right).argmax()]
    return end + eye.half_height * (0.02 * eye.right + eye.toward)
