"""Pictures and VTK files of gears in contact; the only module that knows VTK."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.fields import ContactField, GearField, PairField, View

if TYPE_CHECKING:
    import pyvista

Array = NDArray[np.float64]
Shown = Literal["von-mises", "principal", "displacement", "pressure"]
QUADRATIC_TRIANGLE = 22  # VTK's cell type
SIZE = (1920, 1080)  # pixels
HEADER, MARGIN = 0.10, 0.13  # parts of the picture for the title and the colour bar
LIFT = 1e-3  # of the view's height between layers, toward the eye
RIBBON, ALONE = 0.16, 0.22  # height of the largest pressure over the view's half
DRAWN_MOTION = 0.02  # the largest motion over the view's height
LARGEST_MOTION = 0.06  # modules of drawn motion, so that teeth stay in their gaps
CUT = 1.25  # of the ribbon, over the height of `Look.pressure`
BODY, RIBBON_COLOUR, INK = "#d5dbe1", "#d01c8b", "#202020"


@dataclass(frozen=True)
class Colours:
    """How a field is shown: its name in files, unit and colour map.

    clipped : whether the contact would hide the rest, so that colours end at the
        largest value in a fillet; signed : whether zero is in the middle
    """

    array: str
    title: str
    unit: str
    scale: float
    map: str
    clipped: bool = False
    signed: bool = False


COLOURS: dict[str, Colours] = {
    "von-mises": Colours(
        "von_mises_Pa", "von Mises\nstress", "MPa", 1e-6, "turbo", clipped=True
    ),
    "principal": Colours(
        "principal_1_Pa",
        "first principal\nstress",
        "MPa",
        1e-6,
        "RdBu_r",
        signed=True,
    ),
    "displacement": Colours(
        "displacement_m", "elastic\ndisplacement", "µm", 1e6, "viridis"
    ),
    "pressure": Colours("pressure_Pa", "contact\npressure", "MPa", 1e-6, "plasma"),
}


@dataclass(frozen=True)
class Look:
    """What is the same in all pictures of a film.

    motion_scale : drawn over true displacement
    limits : of the colours, in the unit shown
    largest : value of the field in view, in the unit shown
    pressure : that is drawn at the ribbon's full height, the peak of the pair with
        the largest load; a tip corner's own peak is cut off a little above [Pa]
    """

    shown: Shown
    view: View
    motion_scale: float
    limits: tuple[float, float]
    largest: float
    pressure: float

    @property
    def ribbon(self) -> float:
        """Full height of the pressure ribbon over the view's half height."""
        return ALONE if self.shown == "pressure" else RIBBON


def picture_aspect(size: tuple[int, int] = SIZE) -> float:
    """Width over height of the part of the picture that shows the gears."""
    return size[0] * (1.0 - MARGIN) / (size[1] * (1.0 - HEADER))


def look_of(
    fields: Sequence[ContactField],
    shown: Shown,
    view: View,
    module: float,
    motion_scale: float | None = None,
) -> Look:
    """Colours and scales that suit all of the fields; motion_scale None chooses."""
    gears = [gear for field in fields for gear in field.gears]
    if motion_scale is None:
        largest = max(
            np.hypot(*gear.motion[_seen(gear, view)].T).max() for gear in gears
        )
        drawn = min(DRAWN_MOTION * 2.0 * view.half_height, LARGEST_MOTION * module)
        motion_scale = _round_down(drawn / float(largest))
    most = [max(field.pairs, key=lambda pair: pair.load) for field in fields]
    pressure = max(float(pair.pressure.max()) for pair in most)
    if shown == "pressure":
        largest = max(float(p.pressure.max()) for f in fields for p in f.pairs)
        scale = COLOURS[shown].scale
        limits = (0.0, scale * pressure)
        return Look(shown, view, motion_scale, limits, scale * largest, pressure)
    limits, largest = _limits(gears, COLOURS[shown], view)
    return Look(shown, view, motion_scale, limits, largest, pressure)


def _limits(
    gears: Sequence[GearField], colours: Colours, view: View
) -> tuple[tuple[float, float], float]:
    """Range of the colours and the largest value in view."""
    largest, fillet = 0.0, 0.0
    for gear in gears:
        seen, values = _seen(gear, view), colours.scale * _scalar(gear, colours.array)
        largest = max(largest, float(values[seen].max()))
        nodes = gear.fillet[seen[gear.fillet]]
        fillet = max(fillet, float(values[nodes].max(initial=0.0)))
    top = fillet if colours.clipped and fillet > 0.0 else largest
    return (-top if colours.signed else 0.0, top), largest


def _seen(gear: GearField, view: View) -> NDArray[np.bool_]:
    """Points (n,) that lie in the view."""
    half = view.half_height * np.array([view.aspect, 1.0])
    return np.all(np.abs(gear.points - [view.x, view.y]) < half, axis=1)


def _round_down(value: float) -> float:
    """To 1, 2 or 5 times a power of ten, at least 1."""
    if not 1.0 < value < np.inf:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value))


def _scalar(gear: GearField, array: str) -> Array:
    if array == "von_mises_Pa":
        return gear.von_mises
    if array == "principal_1_Pa":
        return gear.principal_1
    return np.hypot(*gear.displacement.T)


def grid_of(field: ContactField) -> pyvista.UnstructuredGrid:
    """Both gears, undeformed, with all fields at the points; SI units."""
    import pyvista

    gears = field.gears
    counts = [len(gear.points) for gear in gears]
    shifts = (0, counts[0])
    nodes = np.vstack([g.triangles + s for g, s in zip(gears, shifts, strict=True)])
    grid = pyvista.UnstructuredGrid(
        np.column_stack([np.full(len(nodes), 6), nodes]).ravel(),
        np.full(len(nodes), QUADRATIC_TRIANGLE, np.uint8),
        _spatial(np.vstack([gear.points for gear in gears])),
    )
    stress = np.vstack([gear.stress for gear in gears])
    arrays = {
        "displacement_m": _spatial(np.vstack([g.displacement for g in gears])),
        "motion_m": _spatial(np.vstack([g.motion for g in gears])),
        "von_mises_Pa": np.concatenate([g.von_mises for g in gears]),
        "principal_1_Pa": np.concatenate([g.principal_1 for g in gears]),
        "stress_xx_Pa": stress[:, 0],
        "stress_yy_Pa": stress[:, 1],
        "stress_xy_Pa": stress[:, 2],
        "stress_zz_Pa": np.concatenate([g.out_of_plane for g in gears]),
    }
    for name, values in arrays.items():
        grid.point_data[name] = np.ascontiguousarray(values)
    grid.cell_data["gear"] = np.repeat([0, 1], [len(g.triangles) for g in gears])
    grid.cell_data["tooth"] = np.concatenate([g.tooth for g in gears])
    return grid


def write_vtu(field: ContactField, path: Path) -> None:
    """Both gears with all fields for ParaView; units are in the names."""
    grid = grid_of(field)
    grid.field_data["torque_Nm"] = [field.torque]
    grid.field_data["position_base_pitches"] = [field.position]
    grid.field_data["approach_m"] = [field.approach]
    grid.field_data["pair_load_N"] = [pair.load for pair in field.pairs]
    grid.save(path)


def draw(
    field: ContactField,
    look: Look,
    title: str,
    size: tuple[int, int] = SIZE,
) -> NDArray[np.uint8]:
    """The picture (height, width, 3) of one position."""
    import pyvista

    layout: dict[str, Any] = {
        "shape": (2, 2),
        "row_weights": [HEADER, 1.0 - HEADER],
        "col_weights": [1.0 - MARGIN, MARGIN],
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
        plotter.subplot(1, 0)
        mapper = _draw_picture(plotter, field, look, size)
        plotter.subplot(1, 1)
        _draw_bar(plotter, mapper, look, size)
        plotter.subplot(0, 0)
        _draw_title(plotter, field, look, title, size)
        image = plotter.screenshot(None, return_img=True)
    finally:
        plotter.close()
    return np.asarray(image, np.uint8)[..., :3]


def _draw_picture(
    plotter: Any, field: ContactField, look: Look, size: tuple[int, int]
) -> Any:
    """Gears, outlines, pressure and loads; the mapper of the colours."""
    _look_at(plotter, look.view)
    plotter.enable_anti_aliasing("ssaa" if size[0] < 1000 else "msaa")
    colours = COLOURS[look.shown]
    grid = grid_of(field)
    grid.points += look.motion_scale * grid.point_data["motion_m"]
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
        values = np.concatenate([_scalar(gear, colours.array) for gear in field.gears])
        grid.point_data["shown"] = colours.scale * values
        actor = plotter.add_mesh(grid, scalars="shown", **painted)
    for gear in field.gears:
        lines = _outline(gear, look, LIFT * look.view.half_height)
        plotter.add_mesh(lines, color=INK, line_width=1.5 * size[1] / 1080.0, **flat)
    ribbon = _ribbon(field.pairs, look)
    if look.shown == "pressure":
        actor = plotter.add_mesh(ribbon, scalars="pressure_MPa", **painted)
    else:
        plotter.add_mesh(ribbon, color=RIBBON_COLOUR, **flat)
    _draw_loads(plotter, field.pairs, look, size)
    _draw_names(plotter, field.gears, look, size)
    return actor.mapper


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


def _outline(gear: GearField, look: Look, height: float) -> pyvista.PolyData:
    import pyvista

    where = gear.points + look.motion_scale * gear.motion
    used, nodes = np.unique(gear.outline, return_inverse=True)
    nodes = nodes.reshape(-1, 3)
    lines = np.column_stack([np.full(len(nodes), 3), nodes])
    return pyvista.PolyData(_spatial(where[used], height), lines=lines.ravel())


def ribbon_base(pair: PairField, look: Look) -> Array:
    """Where the loaded contact nodes of a pair are drawn (n, 2)."""
    return pair.points + look.motion_scale * pair.motion


def _ribbon(pairs: Sequence[PairField], look: Look) -> pyvista.PolyData:
    """The pressure of all pairs as an area over the driver's flank."""
    import pyvista

    points, faces, pressure = [], [], []
    count = 0
    full = look.ribbon * look.view.half_height
    for pair in pairs:
        loaded = np.flatnonzero(pair.pressure > 0.0)
        rows = slice(max(0, loaded[0] - 1), loaded[-1] + 2)
        base, p = ribbon_base(pair, look)[rows], pair.pressure[rows]
        height = full * np.minimum(p / look.pressure, CUT)
        crest = base + height[:, None] * pair.normals[rows]
        n = len(base)
        i = count + np.arange(n - 1)
        quads = np.stack([np.full(n - 1, 4), i, i + 1, i + 1 + n, i + n], axis=1)
        points += [base, crest]
        faces.append(quads)
        pressure.append(np.tile(p, 2))
        count += 2 * n
    where = _spatial(np.vstack(points), 2.0 * LIFT * look.view.half_height)
    ribbon = pyvista.PolyData(where, faces=np.vstack(faces).ravel())
    ribbon.point_data["pressure_MPa"] = 1e-6 * np.concatenate(pressure)
    return ribbon


def _draw_loads(
    plotter: Any, pairs: Sequence[PairField], look: Look, size: tuple[int, int]
) -> None:
    """Load and largest pressure of every pair beyond the end of its ribbon."""
    font = _font(22, size)
    lowest = -np.inf
    for pair in sorted(pairs, key=lambda pair: float(pair.center[1])):
        middle = int(pair.pressure.argmax())
        height = look.ribbon * min(float(pair.pressure[middle]) / look.pressure, CUT)
        away = (height + 0.03) * pair.normals[middle]
        at = ribbon_base(pair, look)[middle] + look.view.half_height * away
        row = 2.0 * font * _pixel(look, size)
        at[1] = min(at[1], look.view.y + look.view.half_height - row)
        at[1] = max(at[1], lowest)  # labels may not cover each other
        lowest = at[1] + row
        text = f"{pair.load:.0f} N, {1e-6 * pair.pressure.max():.0f} MPa"
        _draw_label(plotter, text, at, look, font)


def _draw_names(
    plotter: Any, gears: Sequence[GearField], look: Look, size: tuple[int, int]
) -> None:
    """Each gear's name toward its centre, as far as the view goes."""
    view, font = look.view, _font(26, size)
    middle = np.array([view.x, view.y])
    half = view.half_height * np.array([view.aspect, 1.0])
    for gear in gears:
        away = gear.center - middle
        reach = 0.9 / np.max(np.abs(away) / half)
        at = middle + min(1.0, reach) * away
        at[0] -= 0.25 * font * len(gear.name) * _pixel(look, size)
        _draw_label(plotter, gear.name, at, look, font)


def _pixel(look: Look, size: tuple[int, int]) -> float:
    """Length of a pixel in the world [m]."""
    return 2.0 * look.view.half_height / (size[1] * (1.0 - HEADER))


def _draw_label(plotter: Any, text: str, at: Array, look: Look, font: int) -> None:
    plotter.add_point_labels(
        _spatial(at[None], 4.0 * LIFT * look.view.half_height),
        [text],
        font_size=font,
        bold=False,
        text_color=INK,
        shape="rounded_rect",
        shape_color="white",
        shape_opacity=0.85,
        margin=5,
        show_points=False,
        always_visible=True,
        reset_camera=False,
        justification_horizontal="left",
        justification_vertical="bottom",
    )


def _draw_bar(plotter: Any, mapper: Any, look: Look, size: tuple[int, int]) -> None:
    colours = COLOURS[look.shown]
    lines = [colours.title, f"[{colours.unit}]"]
    if colours.clipped:
        lines += ["", "colours end at", "largest in fillets,"]
        lines += [f"contact up to {look.largest:.0f}"]
    elif look.largest > 1.001 * look.limits[1]:
        lines += ["", "corners up to", f"{look.largest:.0f}"]
    plotter.add_text(
        "\n".join(lines),
        position=(0.06, 0.80),
        viewport=True,
        font_size=_font(11, size),
        color=INK,
    )
    plotter.add_scalar_bar(
        title=" ",
        mapper=mapper,
        vertical=True,
        n_labels=6,
        fmt="%.3g",
        width=0.30,
        height=0.70,
        position_x=0.08,
        position_y=0.05,
        label_font_size=_font(22, size),
        title_font_size=1,
        color=INK,
    )


def _draw_title(
    plotter: Any, field: ContactField, look: Look, title: str, size: tuple[int, int]
) -> None:
    times = f"drawn {look.motion_scale:g} times"
    motion = "true to scale" if look.motion_scale == 1.0 else times
    details = (
        f"position {field.position:.3f} base pitches, torque {field.torque:g} N m, "
        f"transmission error {1e6 * field.approach:.2f} µm, "
        f"motion {motion}"
    )
    if look.shown != "pressure":
        details += ", ribbon: contact pressure"
    for text, height, points in ((title, 0.52, 17), (details, 0.10, 12)):
        plotter.add_text(
            text,
            position=(0.012, height),
            viewport=True,
            font_size=_font(points, size),
            color=INK,
        )


def palette(shown: Shown) -> NDArray[np.uint8]:
    """All colours of a picture (256, 3), for files that hold no more."""
    from matplotlib import colormaps
    from matplotlib.colors import to_rgb

    painted = colormaps[COLOURS[shown].map](np.linspace(0.0, 1.0, 200))[:, :3]
    white, shades = np.ones(3), np.linspace(0.0, 1.0, 28)[:, None]
    mixed = [
        np.array(to_rgb(colour)) * (1.0 - shades) + shades * white
        for colour in (INK, RIBBON_COLOUR)
    ]
    return np.round(255.0 * np.vstack([painted, *mixed])).astype(np.uint8)


def _font(points: int, size: tuple[int, int]) -> int:
    return max(6, round(points * size[1] / 1080.0))


def _spatial(plane: Array, height: float = 0.0) -> Array:
    """(n, 3) from (n, 2)."""
    return np.column_stack([plane, np.full(len(plane), height)])
