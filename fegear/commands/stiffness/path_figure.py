"""Contact along the path of contact, and transmission error over torque."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.contact.edges import edge_pairs
from fegear.contact.path import (
    face_along_path,
    path_positions,
    roll_angles,
    sliding_over_pitch_speed,
)
from fegear.contact.virtual_work import arrange_along_path
from lumped.common.array_types import Array
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fegear.statics.mesh_result import StaticsResult

MAX_CURVES = 5  # torques that are drawn along the path
DARKEST, LIGHTEST = 0.0, 0.85  # of the colours of torques
BEYOND_PATH = 0.1  # that is drawn of a helical gear's path [base pitches]
PATH_POINTS = 400  # of helical gears
LEGEND_PLACE = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5), "fontsize": 8}


class PairAlongPath(NamedTuple):
    """One tooth pair from its first to its last contact, at t torques and m places.

    angle, sliding : (m,) driver's roll angle [deg] and sliding over pitch-line speed
    pressure, driver_root, driven_root : (t, m) [Pa], pressure of plane strain
    share, line_load : (t, m) part of the mesh force, and largest load per length of a
        helical line of contact [N/m]; NaN without load, and where the other is drawn
    is_edge : (t, m) whether an edge is in contact, where pressure has no limit
    """

    angle: Array
    sliding: Array
    pressure: Array
    share: Array
    line_load: Array
    driver_root: Array
    driven_root: Array
    is_edge: NDArray[np.bool_]


def pair_along_path(result: StaticsResult) -> PairAlongPath:
    """The tooth pair that is the reference pair in the first base pitch.

    Of helical gears all pairs, whose lines are at many places of the path at once.
    """
    cycle, pair = result.cycle, result.problem.pair
    if cycle.face.base_helix_angle:
        return _helical_along_path(result)

    def along(values: Array) -> Array:
        return arrange_along_path(cycle, values, result.pitches)[:, 0]

    loaded = along(cycle.load) > 0.0
    place = along(np.broadcast_to(path_positions(cycle), cycle.load.shape))[0]
    every = slice(*_path_ends(loaded))

    def under_load(values: Array) -> Array:
        return np.where(loaded, along(values), np.nan)[:, every]

    return PairAlongPath(
        angle=np.degrees(roll_angles(pair, place)[0])[every],
        sliding=sliding_over_pitch_speed(pair, place)[every],
        pressure=under_load(_pressure(result)),
        share=under_load(cycle.load_share),
        line_load=under_load(np.full(cycle.load.shape, np.nan)),
        driver_root=under_load(_root_stress(result, "driver")),
        driven_root=under_load(_root_stress(result, "driven")),
        is_edge=along(_is_edge_contact(result))[:, every] > 0.0,
    )


def _helical_along_path(result: StaticsResult) -> PairAlongPath:
    """The largest over the face width at each place of the path."""
    cycle, face, pair = result.cycle, result.cycle.face, result.problem.pair
    start, end = pair.path
    place = np.linspace(start - BEYOND_PATH, end + BEYOND_PATH, PATH_POINTS)

    def along(values: Array) -> Array:
        largest = [face_along_path(cycle, one, place).max(1) for one in values]
        return np.where(np.array(largest) > 0.0, largest, np.nan)

    pressure = along(face.pressure)
    none = np.full_like(pressure, np.nan)
    outside = np.where(face.on_path, 0.0, 1.0)
    off_path = face_along_path(cycle, outside, place).max(1) > 0.0
    return PairAlongPath(
        angle=np.degrees(roll_angles(pair, place)[0]),
        sliding=sliding_over_pitch_speed(pair, place),
        pressure=result.problem.plane_strain_pressure * pressure,
        share=none,
        line_load=along(face.load),
        driver_root=none,
        driven_root=none,
        is_edge=np.broadcast_to(off_path, pressure.shape),
    )


def _pressure(result: StaticsResult) -> Array:
    """Largest contact pressure of pairs (t, n, k), in plane strain [Pa].

    Of slices of the face width those on the path, unless all are at its ends.
    """
    cycle = result.cycle
    pressure = result.problem.plane_strain_pressure * cycle.pressure
    on_path = np.where(cycle.face.on_path, cycle.face.pressure, 0.0).max(axis=3)
    return np.where(on_path > 0.0, on_path, pressure)


def _is_edge_contact(result: StaticsResult) -> Array:
    """1 where the contact of a pair contains an edge, else 0 (t, n, k)."""
    torques = range(result.cycle.torque.size)
    pairs = [edge_pairs(result.problem, result.cycle, t) for t in torques]
    return np.array(pairs, float)


def _path_ends(loaded: NDArray[np.bool_]) -> tuple[int, int]:
    """First place (t, m) with load at some torque, and the one after the last."""
    places = np.flatnonzero(np.any(loaded, axis=0))
    return int(places[0]), int(places[-1]) + 1


def _root_stress(result: StaticsResult, gear: str) -> Array:
    """Root stress (t, n, k) of the teeth of all pairs; NaN where there is none."""
    load, columns = result.cycle.load, result.table.columns
    stress = np.full(load.shape, np.nan)
    used = np.flatnonzero((load != 0.0).any(axis=(0, 1)))
    for number, k in enumerate(used, start=1):
        values = columns.get(f"pair{number}_{gear}_root_stress_Pa")
        stress[..., k] = np.nan if values is None else values
    return stress


def draw_path(result: StaticsResult, title: str = "") -> Figure:
    """Pressure, root stress, loads and sliding over the driver's roll angle.

    At MAX_CURVES torques at most, from the lowest to the highest.
    """
    along = pair_along_path(result)
    has_root = bool(np.isfinite([along.driver_root, along.driven_root]).any())
    is_helical = bool(np.isfinite(along.line_load).any())
    load_label = (
        "largest load per\nlength [N/mm],\ndotted at edges"
        if is_helical
        else "load share [%]"
    )
    loads = 1e-3 * along.line_load if is_helical else 100.0 * along.share
    labels = {
        "largest contact pressure\n[MPa], dotted at edges": 1.0,
        "root stress [MPa]": 1.2,
        load_label: 0.8,
        "sliding speed /\npitch-line speed": 0.7,
    }
    if not has_root:
        del labels["root stress [MPa]"]
    heights = tuple(labels.values())
    size = (10.0, 3.0 * sum(heights))
    figure, rows = panels(len(labels), size=size, heights=heights, share=True)
    every = [row[0] for row in rows]
    pressure, *roots, load, sliding = every
    for t, color, label in _torques(result):
        at_load, edge = 1e-6 * along.pressure[t], along.is_edge[t]
        pressure.plot(along.angle, at_load, ":", color=color, lw=1.0)
        smooth = np.where(edge, np.nan, at_load)
        pressure.plot(along.angle, smooth, color=color, label=label)
        driver, driven = 1e-6 * along.driver_root[t], 1e-6 * along.driven_root[t]
        for root in roots:
            root.plot(along.angle, driver, color=color, label=f"driver, {label}")
            root.plot(along.angle, driven, "--", color=color, label=f"driven, {label}")
        if is_helical:
            load.plot(along.angle, loads[t], ":", color=color, lw=1.0)
        on_path = np.where(edge & is_helical, np.nan, loads[t])
        load.plot(along.angle, on_path, color=color, label=label)
    sliding.plot(along.angle, along.sliding, color="black", label="driver on driven")
    for axes, label in zip(every, labels, strict=True):
        axes.set_ylabel(label)
        _mark_path(axes, result, named=axes is pressure)
        axes.legend(**LEGEND_PLACE)
    smooth = np.where(along.is_edge, np.nan, along.pressure)
    if np.isfinite(smooth).any():
        pressure.set_ylim(top=1.3e-6 * float(np.nanmax(smooth)))
    for axes in every[:-1]:
        axes.set_ylim(bottom=0.0)
    sliding.set_xlabel("roll angle of the contact point on the driver [deg]")
    draw_title(figure, "\n".join(filter(None, (title, *_drawn_quantities(result)))))
    return figure


def _drawn_quantities(result: StaticsResult) -> Iterator[str]:
    """Lines of the title on pairs and torques that are left out."""
    count, face = result.cycle.torque.size, result.cycle.face
    if face.base_helix_angle:
        yield (
            "largest over the face width at each place of the path; at its ends A "
            "and E tip corners touch"
        )
    if result.pitches > 1:
        yield "the reference pair of the first base pitch"
    if count > MAX_CURVES:
        yield f"{MAX_CURVES} of {count} torques are drawn"


def _torques(result: StaticsResult) -> Iterator[tuple[int, object, str]]:
    """Indices of torques, rising, with colour and label."""
    from matplotlib import colormaps

    order = np.argsort(result.cycle.torque)
    count = min(MAX_CURVES, order.size)
    chosen = order[np.linspace(0, order.size - 1, count).round().astype(int)]
    colors = colormaps["viridis"](np.linspace(DARKEST, LIGHTEST, count))
    for t, color in zip(chosen, colors, strict=True):
        yield int(t), color, f"{result.cycle.torque[t]:.4g} N m"


def _mark_path(axes: Axes, result: StaticsResult, named: bool) -> None:
    """Vertical lines at the ends of the path, of single contact and the pitch point."""
    pair = result.problem.pair
    start, end = pair.path
    marks = {"A": start, "B": end - 1.0, "C": 0.0, "D": start + 1.0, "E": end}
    is_helical = result.cycle.face.base_helix_angle != 0.0
    if is_helical or pair.contact_ratio >= 2.0:  # there is no single contact
        marks = {"A": start, "C": 0.0, "E": end}
    for name, place in marks.items():
        angle = float(np.degrees(roll_angles(pair, np.array(place))[0]))
        axes.axvline(angle, color="0.6", lw=0.8, ls=":")
        if named:
            above = axes.get_xaxis_transform()
            axes.text(angle, 1.01, name, transform=above, ha="center", fontsize=8)


def draw_harris(result: StaticsResult, title: str = "") -> Figure:
    """Transmission error over the position at each torque, and its peak to peak."""
    from matplotlib import colormaps

    figure, ((curves, peaks),) = panels(1, 2, size=(12.0, 5.0))
    order = np.argsort(result.cycle.torque)
    torque, ste = result.cycle.torque[order], 1e6 * result.cycle.ste[order]
    colors = colormaps["viridis"](np.linspace(DARKEST, LIGHTEST, torque.size))
    labelled = set(np.linspace(0, torque.size - 1, min(12, torque.size)).round())
    position, closed = result.cycle.position, np.append(ste, ste[:, :1], axis=1)
    position = np.append(position, result.pitches)
    for t, color in enumerate(colors):
        label = f"{torque[t]:.4g} N m" if t in labelled else None
        curves.plot(position, closed[t], color=color, lw=1.4, label=label)
    curves.set_xlabel("mesh position [base pitches from the pitch point]")
    curves.set_ylabel("static transmission error [um]")
    curves.legend(**LEGEND_PLACE)
    peaks.plot(torque, np.ptp(ste, axis=1), "o-", color="tab:blue", ms=4)
    peaks.set_xlabel("torque on the driver [N m]")
    peaks.set_ylabel("peak to peak of the static\ntransmission error [um]")
    peaks.set_ylim(bottom=0.0)
    draw_title(figure, title)
    return figure
