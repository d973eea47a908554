"""Values that are read from the curves of a figure's parts."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from lumped.common.array_types import Array
from validation.commands.reproduce.parts import (
    ROUND_OFF,
    Curve,
    PartResult,
    Value,
    first_largest,
)

Results = Mapping[str, PartResult]  # by the name of a part
CLOSE_TOLERANCE = 0.01
LOW = 0.25  # of the height, above the least value: where contours are ellipses


def read_values(results: Results, part: str, name: str) -> tuple[Value, ...]:
    """All values of what a part finds, or what is read from its curves."""
    for pattern, read in (*FILTERS.items(), *READINGS.items()):
        if match := re.fullmatch(pattern, name):
            return tuple(read(results, part, *match.groups()))
    return results[part].values.get(name, ())


def required_names(name: str) -> tuple[str, str]:
    """What a part itself has to find, and the other part that is needed.

    Each is empty where it is not.
    """
    for pattern in FILTERS:
        if match := re.fullmatch(pattern, name):
            return required_names(match["key"])
    for pattern in READINGS:
        if match := re.fullmatch(pattern, name):
            return "", match.groupdict().get("other", "")
    return name, ""


def _count_values(results: Results, part: str, key: str) -> Iterator[float]:
    yield float(len(read_values(results, part, key)))


def _values_between(
    results: Results, part: str, key: str, low: str, high: str
) -> Iterator[Value]:
    for value in read_values(results, part, key):
        if not isinstance(value, tuple) and _is_between(value, low, high):
            yield value


def _is_between(value: Array | float, low: str, high: str) -> Any:
    """Whether values lie in a range, whose ends may be frequencies that were scaled."""
    ends = float(low), float(high)
    margin = ROUND_OFF * max(map(abs, ends))
    return (value >= ends[0] - margin) & (value <= ends[1] + margin)


def _coordinate_of_value(
    results: Results, part: str, key: str, axis: str
) -> Iterator[Value]:
    for value in read_values(results, part, key):
        yield value[int(axis) - 1] if isinstance(value, tuple) else value


def _value_at(results: Results, part: str, mesh: str, *at: str) -> Iterator[float]:
    """The largest of the values at the point nearest to a place."""
    points = _curve_points(results[part], mesh)
    target = [float(value) for value in at]
    if points.size:
        gap = np.linalg.norm(points[:, : len(target)] - target, axis=1)
        yield float(points[gap <= gap.min() * (1.0 + 1e-9), len(target)].max())


def _extreme_of_curve(
    results: Results, part: str, prefix: str, mesh: str, name: str, low: str, high: str
) -> Iterator[float]:
    """The largest or least value between two places of the x axis, or its place."""
    points = _curve_points(results[part], mesh)
    inside = points[_is_between(points[:, 0], low, high)]
    if inside.size:
        y = inside[:, 1]
        chosen = inside[first_largest(y if name == "largest" else -y)]
        yield float(chosen[0 if prefix else 1])


def _growth_between_meshes(
    results: Results, part: str, mesh: str, low: str, high: str, other: str
) -> Iterator[float]:
    """The largest value over that of another part."""
    reading = mesh, "largest", low, high
    for first, second in zip(
        *(_extreme_of_curve(results, name, "", *reading) for name in (part, other)),
        strict=False,
    ):
        yield first / second


def _crest_positions(
    results: Results, part: str, mesh: str, axis: str, at: str
) -> Iterator[float]:
    """Places where a surface has crests along an axis, at the nearest value of the
    other.
    """
    points = _curve_points(results[part], mesh)
    along = int(axis) - 1
    gap = np.abs(points[:, 1 - along] - float(at))
    row = points[gap <= gap.min() + 1e-9]
    row = row[row[:, along].argsort()]
    value = np.concatenate([[-np.inf], row[:, 2], [-np.inf]])
    for number in np.flatnonzero(
        (value[1:-1] > value[:-2]) & (value[1:-1] > value[2:])
    ):
        yield float(row[number, along])


def _share_of_line(
    results: Results, part: str, mesh: str, other: str
) -> Iterator[float]:
    """Part of the points that lie on a stable branch of the other part.

    They do where the nearest one is within CLOSE_TOLERANCE of their largest value.
    """
    marks = _curve_points(results[part], mesh)
    lines = [c for c in results[other].curves if c.style == "line"]
    stretches = [np.array(c.points, float) for c in lines if c.mesh == int(mesh)]
    if not (marks.size and stretches):
        return
    starts = np.concatenate([points[:-1] for points in stretches])
    ends = np.concatenate([points[1:] for points in stretches])
    close = 0
    for x, y in marks:
        with np.errstate(invalid="ignore", divide="ignore"):
            along = (x - starts[:, 0]) / (ends[:, 0] - starts[:, 0])
        inside = (along >= 0.0) & (along <= 1.0)
        branch = starts[inside, 1]
        branch = branch + along[inside] * (ends[inside, 1] - branch)
        close += bool((np.abs(branch - y) <= CLOSE_TOLERANCE * marks[:, 1].max()).any())
    yield close / len(marks)


def _ratio_of_values(
    results: Results, part: str, mesh: str, other: str
) -> Iterator[float]:
    """Largest ratio of the values of two surfaces over the same points."""
    (x, y, first), (x2, y2, second) = (
        _surface_values(results[name], mesh) for name in (part, other)
    )
    if x.shape == x2.shape and np.allclose(x, x2) and np.allclose(y, y2):
        yield float(np.nanmax(first / second))


def _ellipse_axis(results: Results, part: str, mesh: str) -> Iterator[float]:
    """Angle of the long axis of the contours about the least value [deg].

    The square of the RMS is fitted by a second-order form, whose contours are ellipses
    (eq. 2.31); clockwise from the x axis is below 0.
    """
    x, y, values = _surface_values(results[part], mesh)
    least, most = np.nanmin(values), np.nanmax(values)
    near = values <= least + LOW * (most - least)
    x, y, squares = x[near], y[near], values[near] ** 2
    terms = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    (a, b, c, *_), _, rank, _ = np.linalg.lstsq(terms, squares)
    if rank == terms.shape[1]:
        _, axes = np.linalg.eigh([[a, b / 2.0], [b / 2.0, c]])
        yield _half_turn(math.degrees(math.atan2(axes[1, 0], axes[0, 0])))


def _turn_of_axis(
    results: Results, part: str, mesh: str, second: str, other: str
) -> Iterator[float]:
    """Angle of a long axis against another one [deg]."""
    for angle, reference in zip(
        _ellipse_axis(results, part, mesh),
        _ellipse_axis(results, other, second),
        strict=False,
    ):
        yield _half_turn(angle - reference)


def _half_turn(angle: float) -> float:
    """The axis between -90 and 90 deg."""
    return (angle + 90.0) % 180.0 - 90.0


def _curve_points(result: PartResult, mesh: str) -> Array:
    """All points, (n, 2) or (n, 3), of the curves of a mesh."""
    mesh_curves = _curves_of_mesh(result.curves, mesh)
    points = np.array([point for curve in mesh_curves for point in curve.points], float)
    points = points.reshape(-1, points.shape[-1] if points.size else 2)
    return points[~np.isnan(points).any(axis=1)]


def _surface_values(result: PartResult, mesh: str) -> tuple[Array, Array, Array]:
    (surface,) = _curves_of_mesh(result.curves, mesh)
    x, y, values = np.array(surface.points, float).T
    return x, y, values


def _curves_of_mesh(curves: Sequence[Curve], mesh: str) -> list[Curve]:
    return [curve for curve in curves if curve.mesh in (0, int(mesh))]


MESH, NUMBER, OTHER = r"mesh([12])", r"([-\d.]+)", "(?P<other>.+)"
FILTERS: Mapping[str, Callable[..., Iterator[Value]]] = {  # of what else is found
    r"number of (?P<key>.+)": _count_values,
    rf"(?P<key>.+) between {NUMBER}:{NUMBER}": _values_between,
    r"(?P<key>.+_at) over ([12])": _coordinate_of_value,
}
READINGS: Mapping[str, Callable[..., Iterator[Value]]] = {  # of curves
    rf"{MESH}\.value at {NUMBER}": _value_at,
    rf"{MESH}\.value at \({NUMBER}, {NUMBER}\)": _value_at,
    rf"(place of |){MESH}\.(largest|least) in {NUMBER}:{NUMBER}": _extreme_of_curve,
    rf"{MESH}\.growth in {NUMBER}:{NUMBER} from {OTHER}": _growth_between_meshes,
    rf"{MESH}\.crests over ([12]) at {NUMBER}": _crest_positions,
    rf"{MESH}\.share on {OTHER}": _share_of_line,
    rf"{MESH}\.ratio to {OTHER}": _ratio_of_values,
    rf"{MESH}\.axis": _ellipse_axis,
    rf"{MESH}\.turn from {MESH} of {OTHER}": _turn_of_axis,
}
