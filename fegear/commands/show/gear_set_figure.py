"""A picture of a gear set: true profiles, in mesh at the first pitch point."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.commands.show.fault_figure import draw_faults, fault_handles
from fegear.commands.show.faulty_teeth import FaultyTeeth, faulty_teeth
from fegear.gearset.faults.building import roll_length_below_tip
from fegear.gearset.model import GearSet, Mesh
from fegear.gearset.placing import Layout, Place, at_place, layout
from lumped.common.units import TO_MM
from meshes.gear import SpurGear
from meshes.profile import Points, fillet_points, flank_points, polar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

COLOURS = ("#4477aa", "#cc9944", "#559966", "#aa5588", "#8866bb", "#778899")
CARRIER_COLOUR = "#444444"
ACTION_COLOUR = "#cc2222"
BORE_POINTS = 360
ROOT_POINTS = 12  # of the arc where a tooth is missing
DETAIL_HALF_HEIGHT = 3.2  # half height of the detail, in modules


def tooth_outline(
    gear: SpurGear, points_per_curve: int = 24, broken_height: float = 0.0
) -> Points:
    """Closed-pitch outline of one tooth (n, 2) [m], clockwise, axis along y.

    From the middle of one root land to the next: root, fillet, flank and tip of the
    left half, then the right half mirrored.

    broken_height : of the tip that is missing [m]
    """
    radius = gear.tip_radius - broken_height
    tip = gear.half_angle(radius)
    top_roll_length = roll_length_below_tip(gear, broken_height)
    rolls = np.linspace(top_roll_length, gear.form_roll_length, points_per_curve)
    steepest = gear.form_normal_angle
    right = np.concatenate(
        [
            polar(radius, np.linspace(0.0, tip, 6)[:-1]),
            flank_points(gear, rolls),
            fillet_points(gear, np.linspace(steepest, 0.0, points_per_curve)[1:]),
            polar(gear.root_radius, 0.5 * gear.pitch_angle)[None],
        ]
    )
    left = right[:0:-1] * [-1.0, 1.0]
    return np.concatenate([left, right])


def gear_outline(
    gear: SpurGear, place: Place, damaged: Mapping[int, Points] | None = None
) -> Points:
    """Closed outline of all teeth (n, 2) [m] at a place.

    damaged : outlines of teeth that differ, by their number clockwise from the one at
        the place's angle, counter-clockwise of an internal gear
    """
    damaged_teeth, whole_tooth = damaged or {}, tooth_outline(gear)
    pieces = (
        at_place(
            damaged_teeth.get(turn, whole_tooth)[:-1],
            gear,
            place,
            turn,
        )  # ends begin the next
        for turn in range(gear.teeth)
    )
    return np.concatenate(list(pieces))


def damaged_outlines(teeth: FaultyTeeth) -> dict[int, Points]:
    """Outlines of broken and missing teeth by their number from the place's angle."""
    gear, faults = teeth.gear, teeth.faults
    half = 0.5 * gear.pitch_angle
    root = polar(gear.root_radius, np.linspace(-half, half, ROOT_POINTS))
    broken = {
        teeth.turn(tip.tooth): tooth_outline(gear, broken_height=tip.height)
        for tip in faults.broken_tips
        if not tip.is_corner  # the section in the middle misses corners
    }
    return broken | {teeth.turn(tooth): root for tooth in faults.missing}


def outlines(gear_set: GearSet) -> dict[str, Points]:
    """Closed curves (n, 2) [mm] by name: teeth and bore of each gear, in mesh."""
    placed, curves = layout(gear_set), {}
    angles = np.linspace(0.0, 2.0 * math.pi, BORE_POINTS, endpoint=False)
    for index, gear in enumerate(gear_set.gears):
        teeth, place = gear.geometry, placed.places[index]
        damaged = damaged_outlines(faulty_teeth(gear_set, placed, index))
        bore = np.array([place.x, place.y]) + polar(teeth.hub_radius, angles)
        curves[gear.name] = TO_MM * gear_outline(teeth, place, damaged)
        inner_curve = "bore" if teeth.sign > 0 else "rim"
        curves[f"{gear.name} {inner_curve}"] = TO_MM * bore
    return curves


def gear_set_figure(gear_set: GearSet) -> Figure:
    """All gears on the left, the first mesh close up on the right; axes in mm."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    placed = layout(gear_set)
    figure = Figure(figsize=(13.0, 5.8), layout="constrained")
    FigureCanvasAgg(figure)
    whole_axes, detail = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    _draw_gears(whole_axes, gear_set, placed, outline_width=0.5)
    _draw_gears(detail, gear_set, placed, outline_width=1.3)
    for axes in (whole_axes, detail):
        draw_faults(axes, gear_set, placed)
    _label_gears(whole_axes, gear_set, placed)
    _draw_carrier(whole_axes, gear_set, placed)
    for number, mesh in enumerate(gear_set.meshes):
        _draw_action(whole_axes, mesh, placed, number)
    _draw_detail(detail, gear_set, placed)
    _draw_legend(figure, gear_set)
    helical = any(mesh.is_helical for mesh in gear_set.meshes)
    section = "\ntransverse section, in the middle of the width" if helical else ""
    figure.suptitle(f"{gear_set.title}{section}", fontsize=12)
    return figure


def _draw_gears(
    axes: Axes, gear_set: GearSet, placed: Layout, outline_width: float
) -> None:
    """Every gear with hub, base, reference and tip circle; rear layers behind."""
    from matplotlib.patches import Circle, Polygon

    for index, gear in enumerate(gear_set.gears):
        place, teeth = placed.places[index], gear.geometry
        colour, depth = COLOURS[index % len(COLOURS)], 10 + place.layer
        damaged = damaged_outlines(faulty_teeth(gear_set, placed, index))
        body = TO_MM * gear_outline(teeth, place, damaged)
        center = TO_MM * place.x, TO_MM * place.y
        hub = TO_MM * abs(teeth.hub_radius)
        inside = "none" if teeth.sign < 0 else "white"
        filled = _filled_body(teeth, body, center, fc=colour, ec="none", alpha=0.30)
        outline = Polygon(body, fc="none", ec=colour, lw=outline_width)
        for patch in (filled, outline):
            # `add_patch` would walk along thousands of edges to find the limits
            axes.add_artist(patch).set_zorder(depth)
            axes.update_datalim(patch.get_path().vertices)
        patches = [Circle(center, hub, fc=inside, ec=colour, lw=outline_width)]
        for radius, dashes in (
            (teeth.base_radius, ":"),
            (teeth.reference_radius, "-."),
            (teeth.tip_radius, "--"),
        ):
            style = {"fc": "none", "ec": colour, "ls": dashes, "lw": 0.7}
            patches.append(Circle(center, TO_MM * abs(radius), **style))
        for patch in patches:
            axes.add_patch(patch).set_zorder(depth)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")


def _draw_carrier(axes: Axes, gear_set: GearSet, placed: Layout) -> None:
    """The circle of the planets' axes, an arm to each, and what arrows are against."""
    from matplotlib.patches import Circle

    carrier = gear_set.carrier
    if carrier is None:
        return
    sun = placed.places[carrier.sun]
    style: dict[str, Any] = {"color": CARRIER_COLOUR, "lw": 1.6, "zorder": 24}
    circle = Circle(
        (TO_MM * sun.x, TO_MM * sun.y),
        TO_MM * carrier.radius,
        fill=False,
        ls="--",
        **style,
    )
    axes.add_patch(circle)
    for place in (placed.places[planet] for planet in carrier.planets):
        arm = np.array([[sun.x, place.x], [sun.y, place.y]])
        axes.plot(*(TO_MM * arm), marker="o", ms=3.5, **style)
    axes.set_title(
        "carrier: dashed circle and arms; arrows show rotation against it", size=9
    )


def _filled_body(
    teeth: SpurGear, body: Points, center: tuple[float, float], **style: Any
) -> Patch:
    """The body within its teeth, or between the teeth of a ring and its outside."""
    from matplotlib.patches import PathPatch, Polygon
    from matplotlib.path import Path

    if teeth.sign > 0:
        return Polygon(body, **style)
    angles = np.linspace(0.0, 2.0 * math.pi, BORE_POINTS)
    outside = np.array(center) + TO_MM * polar(teeth.hub_radius, angles)
    hole = np.vstack([body, body[:1]])
    if _is_clockwise(outside) == _is_clockwise(hole):
        hole = hole[::-1]
    curves = Path(outside, closed=True), Path(hole, closed=True)
    return PathPatch(Path.make_compound_path(*curves), **style)


def _is_clockwise(points: Points) -> bool:
    x, y = points.T
    return bool(x[:-1] @ y[1:] - x[1:] @ y[:-1] < 0.0)


def _label_gears(axes: Axes, gear_set: GearSet, placed: Layout) -> None:
    """Name and teeth below each gear, above it in a further layer; its rotation."""
    for index, gear in enumerate(gear_set.gears):
        place, teeth = placed.places[index], gear.geometry
        outward_sign, aligned = (-1.0, "top") if place.layer == 0 else (1.0, "bottom")
        at = TO_MM * place.x, TO_MM * (place.y + outward_sign * teeth.outer_radius)
        style = {"ha": "center", "va": aligned}
        _write_label(
            axes,
            f"{gear.name}, {teeth.teeth} teeth",
            at,
            (0.0, 4.0 * outward_sign),
            style,
        )
        _draw_rotation(axes, teeth, place, COLOURS[index % len(COLOURS)])
    axes.margins(0.09)


def _write_label(
    axes: Axes,
    text: str,
    at: tuple[float, float],
    offset: tuple[float, float],
    style: dict[str, Any],
) -> None:
    """Small text on white; offset : from the place, in points."""
    axes.annotate(
        text,
        at,
        xytext=offset,
        textcoords="offset points",
        fontsize=8,
        zorder=30,
        bbox={"fc": "white", "ec": "none", "alpha": 0.75, "pad": 0.8},
        **style,
    )


def _draw_rotation(axes: Axes, gear: SpurGear, place: Place, colour: str) -> None:
    """An arrow inside the root circle in the sense of rotation."""
    from matplotlib.patches import FancyArrowPatch

    radius = gear.root_radius - 0.6 * gear.module
    start, end = (
        complex(place.x, place.y) + cmath.rect(radius, 0.5 * math.pi + angle)
        for angle in (-0.5 * place.sense, 0.5 * place.sense)
    )
    arrow = FancyArrowPatch(
        (TO_MM * start.real, TO_MM * start.imag),
        (TO_MM * end.real, TO_MM * end.imag),
        connectionstyle=f"arc3,rad={0.25 * place.sense}",
        arrowstyle="-|>",
        mutation_scale=11,
        color=colour,
        linewidth=1.4,
        zorder=25,
    )
    axes.add_patch(arrow)


@dataclass(frozen=True)
class LineOfAction:
    """Points on the line of action by the driver's roll length; all in mm."""

    tangency: complex
    along: complex

    def at(self, roll_length: float) -> tuple[float, float]:
        point = self.tangency + TO_MM * roll_length * self.along
        return point.real, point.imag


def line_of_action(mesh: Mesh, driver: Place, direction: float) -> LineOfAction:
    """From the driver's point of tangency in the sense that contact moves."""
    angle = mesh.pair.operating_pressure_angle
    gear = mesh.pair.driver
    centers = mesh.pair.sign * cmath.exp(1j * direction)
    sense = gear.sign * driver.sense
    along = centers * complex(math.sin(angle), sense * math.cos(angle))
    pitch_radius = mesh.pair.driver.base_radius / math.cos(angle)
    pitch_point = complex(driver.x, driver.y) + pitch_radius * centers
    return LineOfAction(TO_MM * (pitch_point - mesh.pair.pitch_point * along), along)


def _draw_action(axes: Axes, mesh: Mesh, placed: Layout, number: int) -> LineOfAction:
    """Line of action between the base circles, path of contact, pitch point."""
    pair = mesh.pair
    line = line_of_action(mesh, placed.places[mesh.driver], placed.directions[number])
    ends = np.array([line.at(0.0), line.at(pair.line_of_action)]).T
    path = np.array([line.at(pair.path_start), line.at(pair.path_end)]).T
    axes.plot(*ends, color=ACTION_COLOUR, lw=0.8, zorder=20)
    axes.plot(*path, color=ACTION_COLOUR, lw=1.8, zorder=21)
    return line


def _draw_detail(axes: Axes, gear_set: GearSet, placed: Layout) -> None:
    """Frame the first mesh at its pitch point, name what is seen there."""
    mesh = gear_set.meshes[0]
    pair = mesh.pair
    line = _draw_action(axes, mesh, placed, 0)
    marked_points = (
        (pair.path_start, "start of contact"),
        (pair.pitch_point, "pitch point"),
        (pair.path_end, "end of contact"),
    )
    for roll_length, name in marked_points:
        x, y = line.at(roll_length)
        axes.plot(x, y, "o", mfc="white", mec=ACTION_COLOUR, ms=5, zorder=22)
        _write_label(axes, name, (x, y), (10, -3), {"color": ACTION_COLOUR})
    x, y = line.at(pair.pitch_point)
    half_height = DETAIL_HALF_HEIGHT * TO_MM * pair.driver.module
    axes.set_xlim(x - half_height, x + half_height)
    axes.set_ylim(y - half_height, y + half_height)
    names = gear_set.gears[mesh.driver].name, gear_set.gears[mesh.driven].name
    axes.set_title(
        f"{names[0]} drives {names[1]}: contact ratio {pair.contact_ratio:.3f}"
        f"{_helix_in_words(gear_set)},\n"
        f"operating pressure angle "
        f"{math.degrees(pair.operating_pressure_angle):.2f} deg, "
        f"backlash {round(1e6 * pair.backlash)} um",
        fontsize=9,
    )


def _helix_in_words(gear_set: GearSet) -> str:
    """Overlap ratio and helix angle of the first mesh, nothing for spur gears."""
    teeth = gear_set.meshes[0].pair.driver
    if not teeth.twist:
        return ""
    angle = math.degrees(math.atan(abs(teeth.twist) * teeth.reference_radius))
    return (
        f",\noverlap ratio {gear_set.overlap_ratio(0):.3f}, helix angle {angle:.2f} deg"
    )


def _draw_legend(figure: Figure, gear_set: GearSet) -> None:
    """What the circles, the red line and the lines of faults are."""
    from matplotlib.lines import Line2D

    grey = "#555555"
    handles = [
        Line2D([], [], color=grey, ls="--", lw=0.8, label="tip circle"),
        Line2D([], [], color=grey, ls="-.", lw=0.8, label="reference circle"),
        Line2D([], [], color=grey, ls=":", lw=0.8, label="base circle"),
        Line2D([], [], color=ACTION_COLOUR, lw=1.8, label="path of contact"),
        *fault_handles(gear_set),
    ]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=len(handles),
        fontsize=8,
        frameon=False,
    )
