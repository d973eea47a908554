"""Vibration over parameters of the gear set, by integration and by closed forms."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from fegear.commands.map.study import respond_at, respond_over
from fegear.files.errors import InputError
from fegear.files.speed_ranges import parsed_speeds
from fegear.gearset.edit import require_known_key
from fegear.studies.trains.parametric import OF_TEETH
from lumped.closed_forms import (
    Resonance,
    instability_interval,
    linear_amplitude,
    parametric_system,
    peak_amplitude,
    resonance,
)
from lumped.common.array_types import Array
from lumped.common.progress import Progress
from lumped.common.units import TO_UM
from lumped.common.workers import compute_in_threads
from lumped.steady.integration_settings import Settings
from lumped.steady.maps import Axis, Cell, ParameterMap, run_map
from lumped.steady.sweep import Direction, sweep_all
from lumped.train.system import LumpedSystem
from validation.commands.reproduce.computations.frequency_response import (
    require_finished,
)
from validation.commands.reproduce.parts import (
    Curve,
    Part,
    PartResult,
    Value,
    first_largest,
)
from validation.commands.reproduce.scene import CONTACT_RATIO, DELAY, LEAD, Scene
from validation.study.data_files import STRICT, Number, Speeds, few_speeds

Point = tuple[float, ...]
QUICK_COUNT = 3  # of values over a parameter in a quick part
# Part of the range in a quick part, in which no two values are equal by symmetry
QUICK_PART = 0.7
MIN_VALUES = 3  # speeds of a sweep at which a subharmonic is seen to grow


def _require_key(key: str) -> str:
    if key not in (DELAY, LEAD, CONTACT_RATIO, *OF_TEETH):
        require_known_key(key)
    return key


def _require_order(order: str) -> str:
    try:
        ok = Fraction(order) > 0
    except (ValueError, ZeroDivisionError):
        ok = False
    if not ok:
        raise ValueError("must be a fraction above 0, such as 1/2")
    return order


Mode = Annotated[int, Field(strict=True, ge=1, le=9)]
Order = Annotated[str, AfterValidator(_require_order)]
MeshNumber = Literal[1, 2]


@dataclass(frozen=True, kw_only=True)
class Over:
    """A key of the gear set, friction or friction_bending, delay_rad or lead_rad, or
    contact_ratio by the driver's tip, from one value to another."""

    __pydantic_config__ = STRICT

    key: Annotated[str, AfterValidator(_require_key)]
    low: Number
    high: Number
    count: Annotated[int, Field(strict=True, ge=2, le=1000)]

    def quick(self) -> Self:
        return replace(self, count=min(self.count, QUICK_COUNT))

    @property
    def values(self) -> tuple[float, ...]:
        points = np.linspace(self.low, self.high, self.count)
        return tuple(float(f"{value:.9g}") for value in points)


OneOrTwo = Annotated[tuple[Over, ...], Field(min_length=1, max_length=2)]


def _curve(points: Sequence[Point], values: Array, mesh: int) -> Curve:
    """A line over one parameter, a surface over two."""
    rows = [(*p, float(v)) for p, v in zip(points, values, strict=True)]
    style: Literal["line", "surface"] = "line" if len(rows[0]) == 2 else "surface"
    return Curve(style, tuple(rows), mesh)


def _extremes(
    over: Sequence[Over], points: Sequence[Point], values: Array
) -> Iterator[tuple[str, tuple[Value, ...]]]:
    """The largest and the smallest value and their positions, points on two axes.

    change_along : an axis, at most, over the height of all values
    peaks, valleys : where values are higher or lower than all their neighbours
    """
    if np.isnan(values).all():
        return
    positions = points if len(over) > 1 else [point[0] for point in points]
    grid = values.reshape([axis.count for axis in over])
    height = float(np.nanmax(grid) - np.nanmin(grid))
    for number in range(len(over)):
        change = np.fmax.reduce(grid, number) - np.fmin.reduce(grid, number)
        yield f"change_along{number + 1}", (float(np.nanmax(change)) / height,)
    for name, sign in (("peaks", 1.0), ("valleys", -1.0)):
        peak_indices = np.flatnonzero(_is_local_peak(sign * grid))
        yield name, tuple(positions[int(i)] for i in peak_indices)
    for name, index in (
        ("largest", first_largest(values)),
        ("least", first_largest(-values)),
    ):
        yield name, (float(values[index]),)
        yield f"{name}_at", (positions[index],)


EXTREME_KEYS = r"mesh[12]\.((largest|least)(_at)?|change_along[12]|peaks|valleys)"


def _is_local_peak(grid: Array) -> NDArray[np.bool_]:
    """Points of a grid that are higher than all their neighbours, including diagonal
    ones.
    """
    padded = np.pad(np.nan_to_num(grid, nan=-np.inf), 1, constant_values=-np.inf)
    inner = tuple(slice(1, -1) for _ in grid.shape)
    steps = itertools.product((-1, 0, 1), repeat=grid.ndim)
    neighbours = [
        np.roll(padded, step, axis=tuple(range(grid.ndim)))[inner]
        for step in steps
        if any(step)
    ]
    return np.asarray(padded[inner] > np.max(neighbours, axis=0))


@dataclass(frozen=True, kw_only=True)
class MapPart(Part):
    """The RMS by integration, at a speed from rest or the largest one of sweeps.

    at, band : frequencies in the unit of the figure, one of both is needed
    directions : of the sweeps
    """

    keys: ClassVar = (EXTREME_KEYS,)
    no_command: ClassVar = (
        "fegear map sweeps no speeds, and has one phase for all points"
    )

    kind: Literal["map"] = "map"
    over: OneOrTwo
    at: Annotated[Number, Field(gt=0.0)] | None = None
    band: Speeds = ""
    directions: tuple[Direction, ...] = ("up", "down")

    def __post_init__(self) -> None:
        if (self.at is None) == (not self.band):
            raise ValueError("at or band is needed, not both")

    def quick(self) -> Self:
        over = tuple(over.quick() for over in self.over)
        return replace(self, over=over, band=few_speeds(self.band))

    def evaluation(self, unit: float) -> Callable[[LumpedSystem], Cell]:
        if self.at is not None:
            return partial(respond_at, unit * self.at, Settings())
        speeds = tuple(unit * value for value in parsed_speeds(self.band))
        return partial(respond_over, speeds, Settings(), self.directions, None)

    def command(self, scene: Scene) -> Sequence[str]:
        moves = scene.delay is not None and any("ratio" in o.key for o in self.over)
        scene_keys = DELAY, LEAD, CONTACT_RATIO
        if self.at is None or moves or any(o.key in scene_keys for o in self.over):
            return ()
        axes = [f"{o.key}={o.low:g}:{o.high:g}:{o.count}" for o in self.over]
        over = [word for axis in axes for word in ("--over", axis)]
        speed = ["--at", f"{scene.unit_Hz * self.at:.6g}"]
        waves = scene.harmonics_argv
        teeth = scene.friction_words([o.key for o in self.over])
        return ["map", *scene.argv, *teeth, *waves, *over, *speed]


def parameter_map(part: MapPart, scene: Scene, report: Progress) -> PartResult:
    """Find the largest and the smallest RMS, and their positions."""
    axes = tuple(Axis(over.key, over.values) for over in part.over)
    names = [axis.name for axis in axes]
    points = list(itertools.product(*(axis.values for axis in axes)))
    grid = ParameterMap(axes, len(scene.gear_set.meshes), {})
    solved_map = run_map(
        grid,
        lambda point: scene.changed(dict(zip(names, point, strict=True))).system,
        part.evaluation(scene.unit_Hz),
        partial(compute_in_threads, report=partial(report, "map")),
    )
    values = {
        mesh: TO_UM * solved_map.on_grid("dte_rms_m", mesh - 1).ravel()
        for mesh in scene.meshes
    }
    return _result_of_meshes(part.over, points, values)


def _result_of_meshes(
    over: Sequence[Over], points: Sequence[Point], values: Mapping[int, Array]
) -> PartResult:
    """Curves and extremes of every mesh."""
    curves = [_curve(points, mesh_values, mesh) for mesh, mesh_values in values.items()]
    extremes = {
        f"mesh{mesh}.{name}": value
        for mesh, mesh_values in values.items()
        for name, value in _extremes(over, points, mesh_values)
    }
    return PartResult(tuple(curves), extremes)


@dataclass(frozen=True, kw_only=True)
class TheoryMapPart(Part):
    """The RMS by closed forms, at resonance or at its peak.

    mode : counted from 1; order : of its frequency over that of the first mesh
    """

    keys: ClassVar = (EXTREME_KEYS,)
    no_command: ClassVar = "fegear theory has one point at a time"

    kind: Literal["theory_map"] = "theory_map"
    over: OneOrTwo
    mode: Mode
    order: Order = "1"
    at_peak: bool = False

    def quick(self) -> Self:
        return replace(self, over=tuple(over.quick() for over in self.over))


def theory_map(part: TheoryMapPart, scene: Scene, report: Progress) -> PartResult:
    """Find the largest and the smallest RMS, and their positions."""
    points = list(itertools.product(*(over.values for over in part.over)))
    names = [over.key for over in part.over]
    rows = []
    scene.place_of(part.mode)  # which no change of the gears mends
    for done, point in enumerate(points):
        report("closed forms", done, len(points))
        changed = scene.changed(dict(zip(names, point, strict=True)))
        try:
            resonance_of_mode = resonance_of(changed, part.mode, part.order)
        except InputError:  # there are no such gears, as in a map
            rows.append(np.full(len(scene.meshes), math.nan))
            continue
        rows.append(
            resonance_of_mode.amplitudes(_amplitude(resonance_of_mode, part.at_peak))
        )
    rms = TO_UM * np.array(rows) / math.sqrt(2.0)
    values = {mesh: rms[:, mesh - 1] for mesh in scene.meshes}
    return _result_of_meshes(part.over, points, values)


def resonance_of(scene: Scene, mode: int, order: str) -> Resonance:
    """Resonance of a mode counted from 1."""
    system = parametric_system(scene.system)
    return resonance(system, scene.place_of(mode), Fraction(order))


def _amplitude(near: Resonance, at_peak: bool) -> float:
    """Modal; NaN where there is none that is finite."""
    if near.drive == 0.0:
        return 0.0
    if at_peak:
        largest = peak_amplitude(near)
        return largest if math.isfinite(largest) else math.nan
    try:
        return linear_amplitude(near, near.at)
    except ValueError:
        return math.nan


@dataclass(frozen=True, kw_only=True)
class IndicatorsPart(Part):
    """What drives resonances over one figure: |R3| and |Q3| of the source.

    resonances : (mode, order), mode counted from 1. A subharmonic is shown by |p| in
        its panel, others by 2 |v_jr f| of the mesh that leads the mode.
    """

    keys: ClassVar = (
        r"mode[1-9]\.\d(/\d)?\.(largest|least)(_at)?",
        r"mode[1-9]\.\d(/\d)?\.(limit|unstable_part)",
    )
    no_command: ClassVar = "fegear theory has one point at a time"

    kind: Literal["indicators"] = "indicators"
    over: Over
    resonances: Annotated[tuple[tuple[Mode, Order], ...], Field(min_length=1)]

    def quick(self) -> Self:
        over = self.over
        high = over.low + QUICK_PART * (over.high - over.low)
        return replace(self, over=replace(over, high=high).quick())


def indicators(part: IndicatorsPart, scene: Scene, report: Progress) -> PartResult:
    """Find the extremes of modeN.ORDER. and their positions.

    limit : where |p| passes twice the damping ratio, beyond which motions of half the
        frequency grow; unstable_part : of the range in which they do
    """
    values = part.over.values
    scenes = [scene.changed({part.over.key: value}) for value in values]
    systems = []
    for done, variant in enumerate(scenes):
        report("closed forms", done, len(values))
        systems.append(parametric_system(variant.system))
    curves = []
    quantities: dict[str, tuple[Value, ...]] = {}
    for mode, order in part.resonances:
        mode_index = scenes[0].place_of(mode)
        mode_resonances = [
            resonance(system, mode_index, Fraction(order)) for system in systems
        ]
        is_subharmonic = Fraction(order).denominator == 2
        sizes = np.array(
            [
                _indicator(mode_resonance, is_subharmonic)
                for mode_resonance in mode_resonances
            ]
        )
        panel = (
            "subharmonics, |p|"
            if is_subharmonic
            else "2 |v f| of the leading mesh [um]"
        )
        label = f"mode {mode}, {ORDER_NAMES.get(order, order)}"
        points = tuple(zip(values, sizes.tolist(), strict=True))
        curves.append(Curve("line", points, panel=panel, label=label))
        start = f"mode{mode}.{order}."
        rows = _extremes([part.over], [(value,) for value in values], sizes)
        quantities |= {start + name: value for name, value in rows}
        if is_subharmonic:
            limit = 2.0 * scene.system.train.damping_ratio
            quantities[f"{start}limit"] = _crossings(values, sizes - limit)
            quantities[f"{start}unstable_part"] = (float((sizes > limit).mean()),)
            ends = ((values[0], limit), (values[-1], limit))
            label = "twice the damping ratio"
            curves.append(Curve("dotted", ends, panel=panel, label=label))
    return PartResult(tuple(curves), quantities)


ORDER_NAMES = {"1": "fundamental", "1/2": "subharmonic", "2": "second harmonic"}


def _indicator(near: Resonance, half: bool) -> float:
    if half:
        return abs(near.parametric)
    return TO_UM * float(near.amplitudes(abs(near.drive))[near.energy.argmax()])


def _crossings(x: Sequence[float], y: Array) -> tuple[float, ...]:
    """Places where a curve passes 0, on straight lines between its points."""
    places = np.flatnonzero(y[:-1] * y[1:] < 0.0)
    parts = y[places] / (y[places] - y[places + 1])
    return tuple(
        float(x[i] + part * (x[i + 1] - x[i]))
        for i, part in zip(places.tolist(), parts.tolist(), strict=True)
    )


@dataclass(frozen=True, kw_only=True)
class WidthPart(Part):
    """The largest RMS of a subharmonic over the width of its instability interval.

    Width by closed forms, RMS by a sweep down, each at values of one figure.
    """

    keys: ClassVar = ("off_line|gone",)
    no_command: ClassVar = "fegear theory and sweep have one point at a time"

    kind: Literal["width"] = "width"
    over: Over
    mode: Mode
    order: Order = "1/2"
    mesh: MeshNumber = 1
    band: Speeds

    def quick(self) -> Self:
        return replace(self, over=self.over.quick(), band=few_speeds(self.band))


def width(part: WidthPart, scene: Scene, report: Progress) -> PartResult:
    """Values of the points: how far they are off a straight line, over their height.

    gone : value of the figure at which closed forms give no interval
    """
    unit, values = scene.unit_Hz, part.over.values
    speeds = [unit * value for value in parsed_speeds(part.band)]
    scenes = [scene.changed({part.over.key: value}) for value in values]
    resonances = [resonance_of(variant, part.mode, part.order) for variant in scenes]
    swept = sweep_all(
        [variant.system for variant in scenes], speeds, ["down"], report=report
    )
    require_finished(swept)
    points, margins = [], []
    for resonance_of_mode, branch in zip(resonances, swept, strict=True):
        margins.append(
            abs(resonance_of_mode.parametric) / resonance_of_mode.damping_ratio - 2.0
        )
        ends = instability_interval(resonance_of_mode)
        grown_rms = [
            r.dte_rms[part.mesh - 1]
            for r in branch.responses
            # where there is none, motions that die out slowly keep contact
            if r.multiple != 1 and r.contact_loss.max() > 0.0
        ]
        if ends and len(grown_rms) >= MIN_VALUES:
            points.append(((ends[1] - ends[0]) / unit, TO_UM * float(max(grown_rms))))
    quantities = {"gone": _crossings(values, np.array(margins))}
    if len(points) > 2:
        x, y = np.array(sorted(points)).T
        line = np.polyval(np.polyfit(x, y, 1), x)
        quantities["off_line"] = (float(np.abs(y - line).max() / np.ptp(y)),)
    curve = Curve("circles", tuple(points))
    return PartResult((curve,), quantities)
