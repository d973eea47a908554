"""Pictures and VTK files of gears in contact; the only module that knows VTK."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fegear.rendering.fields import ContactField
from fegear.rendering.frames import View
from fegear.rendering.gear_fields import GearField, PairField
from fegear.rendering.labels import (
    details,
    draw_bar,
    draw_loads,
    draw_mesh_forces,
    draw_names,
    draw_names_of_set,
    draw_title,
    legend,
)
from fegear.rendering.look import (
    BODY,
    COLOURS,
    INK,
    MARGIN,
    RIBBON_COLOUR,
    SIZE,
    RenderStyle,
    mesh_forces,
    ribbon_of,
)
from fegear.rendering.panes import panes, screenshot
from lumped.common.array_types import Array

if TYPE_CHECKING:
    import pyvista

QUADRATIC_TRIANGLE = 22  # VTK's cell type
LAYER_HEIGHT = 1e-3  # of the view's height between bodies, lines and loads
GEAR_DEPTH = 1e-2  # of the view's height between gears on a shaft, away from the eye


def grid_of(field: ContactField) -> pyvista.UnstructuredGrid:
    """All gears, undeformed, with all fields at the points; SI units."""
    import pyvista

    cells = {QUADRATIC_TRIANGLE: field.nodes_of_gears("triangles")}
    grid = pyvista.UnstructuredGrid(cells, _spatial(field.of_gears("points")))
    stress = field.of_gears("stress")
    arrays = {
        "displacement_m": _spatial(field.of_gears("displacement")),
        "motion_m": _spatial(field.of_gears("motion")),
        "von_mises_Pa": field.of_gears("von_mises"),
        "principal_1_Pa": field.of_gears("principal_1"),
        "stress_xx_Pa": stress[:, 0],
        "stress_yy_Pa": stress[:, 1],
        "stress_xy_Pa": stress[:, 2],
        "stress_zz_Pa": field.of_gears("out_of_plane"),
    }
    for name, values in arrays.items():
        grid.point_data[name] = np.ascontiguousarray(values)
    counts = [len(gear.tooth) for gear in field.gears]
    grid.cell_data["gear"] = np.repeat(np.arange(len(counts)), counts)
    grid.cell_data["tooth"] = field.of_gears("tooth")
    return grid


def write_vtu(field: ContactField, path: Path) -> None:
    """All gears with all fields for ParaView; units are in the names."""
    grid = grid_of(field)
    grid.field_data["torque_Nm"] = [field.torque]
    grid.field_data["position_base_pitches"] = [field.position]
    if field.ste is not None:
        grid.field_data["approach_m"] = [field.ste]
    else:
        grid.field_data["gear_name"] = [gear.name for gear in field.gears]
        grid.field_data["pair_mesh"] = [pair.mesh + 1 for pair in field.pairs]
    grid.field_data["pair_load_N"] = [pair.load for pair in field.pairs]
    grid.save(path)


def draw(
    field: ContactField,
    look: RenderStyle,
    title: str,
    size: tuple[int, int] = SIZE,
) -> NDArray[np.uint8]:
    """The picture (height, width, 3) of one position."""
    with panes(size, [1.0 - MARGIN, MARGIN]) as plotter:
        plotter.subplot(1, 0)
        mapper = _draw_picture(plotter, field, look, size)
        plotter.subplot(1, 1)
        draw_bar(plotter, mapper, legend(look), size)
        plotter.subplot(0, 0)
        draw_title(plotter, title, details(field, look), size)
        return screenshot(plotter)


def _draw_picture(
    plotter: Any, field: ContactField, look: RenderStyle, size: tuple[int, int]
) -> Any:
    """Gears, outlines, pressure and loads; the mapper of the colours."""
    _look_at(plotter, look.view)
    plotter.enable_anti_aliasing("ssaa" if size[0] < 1000 else "msaa")
    colours = COLOURS[look.shown]
    grid = grid_of(field)
    grid.points += look.motion_scale * grid.point_data["motion_m"]
    counts = [len(gear.points) for gear in field.gears]
    depths = [_depth(gear, look.view) for gear in field.gears]
    grid.points[:, 2] -= np.repeat(depths, counts)
    flat: dict[str, Any] = {"lighting": False, "reset_camera": False}
    painted = {
        "cmap": colours.map,
        "clim": look.limits,
        "show_scalar_bar": False,
        **flat,
    }
    if look.shown == "pressure":
        plotter.add_mesh(grid, color=BODY, **flat)
    else:
        grid.point_data["shown"] = colours.scale * field.of_gears(colours.quantity)
        actor = plotter.add_mesh(grid, scalars="shown", **painted)
    for gear in field.gears:
        height = LAYER_HEIGHT * look.view.half_height - _depth(gear, look.view)
        lines, width = _outline(gear, look, height), 1.5 * size[1] / 1080.0
        if field.is_gear_set:  # teeth are small, but a thinner line has gaps
            width = max(0.5 * width, 1.0)
        plotter.add_mesh(lines, color=INK, line_width=width, **flat)
    ribbon = _ribbon(field.pairs, look) if look.force is None else _arrows(field, look)
    if look.shown == "pressure":
        actor = plotter.add_mesh(ribbon, scalars="pressure_MPa", **painted)
    elif field.pairs:
        plotter.add_mesh(ribbon, color=RIBBON_COLOUR, **flat)
    if field.is_gear_set:
        draw_mesh_forces(plotter, field.pairs, look, size)
        draw_names_of_set(plotter, field, look, size)
    else:
        draw_loads(plotter, field.pairs, look, size)
        draw_names(plotter, field.gears, look, size)
    return actor.mapper


def _depth(gear: GearField, view: View) -> float:
    """How far a gear is behind those in front [m]."""
    return gear.layer * GEAR_DEPTH * view.half_height


def _look_at(plotter: Any, view: View) -> None:
    """Straight down on the plane, from the geometry alone."""
    camera = plotter.camera
    camera.parallel_projection = True
    camera.focal_point = (view.x, view.y, 0.0)
    camera.position = (view.x, view.y, 10.0 * view.half_height)
    camera.up = (0.0, 1.0, 0.0)
    camera.parallel_scale = view.half_height
    camera.clipping_range = (5.0 * view.half_height, 15.0 * view.half_height)
    plotter.renderer.camera_set = True


def _outline(gear: GearField, look: RenderStyle, height: float) -> pyvista.PolyData:
    import pyvista

    where = gear.points + look.motion_scale * gear.motion
    used, nodes = np.unique(gear.outline, return_inverse=True)
    nodes = nodes.reshape(-1, 3)
    lines = np.column_stack([np.full(len(nodes), 3), nodes])
    return pyvista.PolyData(_spatial(where[used], height), lines=lines.ravel())


def _ribbon(pairs: Sequence[PairField], look: RenderStyle) -> pyvista.PolyData:
    """The pressure ribbon; without any pairs a point out of view, which carries the
    colours.
    """
    import pyvista

    height = 2.0 * LAYER_HEIGHT * look.view.half_height
    geometry = ribbon_of(pairs, look)
    if geometry is None:
        ribbon = pyvista.PolyData(np.array([[1e3, 1e3, height]]))
        ribbon.point_data["pressure_MPa"] = [0.0]
        return ribbon
    points, faces, pressure = geometry
    sizes = np.full(len(faces), 4)
    ribbon = pyvista.PolyData(
        _spatial(points, height), faces=np.column_stack([sizes, faces]).ravel()
    )
    ribbon.point_data["pressure_MPa"] = 1e-6 * pressure
    return ribbon


def _arrows(field: ContactField, look: RenderStyle) -> pyvista.PolyData:
    """The force of each mesh on its driven gear; without any a point out of view."""
    import pyvista

    height = 2.0 * LAYER_HEIGHT * look.view.half_height
    forces = mesh_forces(field.pairs)
    if not forces:
        return pyvista.PolyData(np.array([[1e3, 1e3, height]]))
    corners = [force.arrow(look) for force in forces]
    count = len(corners[0])
    nodes = np.arange(count * len(forces)).reshape(-1, count)
    faces = np.column_stack([np.full(len(forces), count), nodes])
    arrows = pyvista.PolyData(_spatial(np.vstack(corners), height), faces=faces.ravel())
    return arrows.triangulate()


def _spatial(plane: Array, height: float = 0.0) -> Array:
    """(n, 3) from (n, 2)."""
    return np.column_stack([plane, np.full(len(plane), height)])
