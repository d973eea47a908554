"""Vibration of a gear set's lumped train over a grid of its parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from fegear.commands.map.result import MapResult
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.speed_ranges import written_speeds
from fegear.gearset.model import GearSet
from fegear.statics.plausibility import motion_warnings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import display_name, setting
from fegear.studies.study import Study
from fegear.studies.trains.axes import axes_setting
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.model_texts import integration_in_words
from fegear.studies.trains.models import (
    ALL_MODELS,
    BEARINGS,
    MOVING,
    lumped_integration,
    lumped_model,
)
from fegear.studies.trains.parametric import (
    TORQUE,
    ParametricProblem,
    ParametricStudy,
    digest,
)
from fegear.studies.trains.speeds import (
    FREQUENCY,
    rpms_setting,
    speeds_setting,
    with_frequencies,
)
from fegear.train.model_settings import LumpedModel
from lumped.attractors.attractor_sweeps import sweep_attractors
from lumped.attractors.attractors import Attractor, find_attractor
from lumped.branches.motions import SpeedFamily
from lumped.common.csv_text import format_exact
from lumped.common.workers import NeverStop, Stop, Stopped
from lumped.steady.integration_settings import Settings
from lumped.steady.maps import Axis, Cell, ParameterMap, cell_of, run_map
from lumped.steady.respond import respond_confirmed
from lumped.steady.response import Response
from lumped.steady.sweep import DIRECTIONS, Direction, sweep
from lumped.train.system import LumpedSystem


@dataclass(frozen=True, kw_only=True)
class Map(
    ParametricStudy,
    Study,
    command="map",
    example="map liu-idler --over mesh.2.phase=0:1:41 --at 1605 --plot map.png",
):
    """Vibration of a lumped train over a grid of parameters.

    With --output points are stored in FILE.partial until the file is written; --resume
    continues from there.
    """

    resumes = True
    distributes = True
    keeps_impossible = True
    unit = "point"

    over: tuple[Axis, ...] = axes_setting(
        "Axis of the map: a key of the gear set, torque_Nm, damping_ratio, friction "
        "(coefficient) or friction_bending (ratio), and N values from A to B, or "
        "values with commas. Give it twice for two axes."
    )
    at: float | None = setting(
        None,
        "Mesh frequency of the first mesh [Hz] at which each point runs from rest"
        " to its steady state; this or --band.",
        FREQUENCY,
        metavar="HZ",
    )
    band: tuple[float, ...] = speeds_setting(
        (),
        "Mesh frequencies of the first mesh [Hz] of a sweep up and down at each "
        "point, for its largest response; this or --at.",
    )
    rpm: tuple[float, ...] = rpms_setting("--at if it is one, or of --band")
    exponents: bool = setting(
        False,
        "Also the largest Lyapunov exponent of the motion, positive where it is "
        "chaotic; over a band the largest of all its speeds.",
    )
    torque: float | None = torque_setting()
    has_rolling = True
    model: LumpedModel = lumped_model(ALL_MODELS | MOVING | BEARINGS)
    integration: Settings = lumped_integration()

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.over:
            raise InputError("over = 0; one or two are allowed")
        speeds = [self.at is not None, bool(self.band), bool(self.rpm)]
        if speeds.count(True) != 1:
            at, band, rpm = (display_name(self, name) for name in ("at", "band", "rpm"))
            raise InputError(
                f"{at} HZ, {band} A:B:STEP or {rpm} A:B:STEP is needed, one of them"
            )

    @property
    def axes(self) -> tuple[Axis, ...]:
        return self.over

    @property
    def fixed_mesh_frequencies(self) -> tuple[float, ...]:
        return self.band if self.at is None else (self.at,)

    @property
    def response(self) -> str:
        """What each point is asked for, in words."""
        if self.at is not None:
            return f"at {format_exact(self.at)} Hz of the first mesh, from rest"
        speeds = written_speeds(self.band)
        return f"largest over {speeds} Hz of the first mesh, up and down"

    def prepare(self) -> MapProblem:
        single = self.rpm[0] if len(self.rpm) == 1 else None
        speeds = {"band": self.rpm} if single is None else {"at": single}
        return MapProblem.of(with_frequencies(self, speeds))


@dataclass(frozen=True, eq=False)
class MapProblem(ParametricProblem):
    """The points of a map."""

    study: Map

    @property
    def motions(self) -> float:
        return float(self.set_ups * (2 * len(self.study.band) or 1))

    @property
    def set_ups(self) -> int:
        return math.prod(len(axis.values) for axis in self.study.axes)

    def tasks(self) -> Iterator[Task]:
        yield Task("points", self._compute_map)

    def _compute_map(self, job: Job) -> MapResult:
        compute = partial(job.compute, "points")
        evaluate = self._evaluation(job.stop_event)
        empty = ParameterMap(
            self.study.axes,
            len(self.gears.meshes),
            self._header,
            with_exponents=self.study.exponents,
        )
        parameter_map = run_map(empty, self.system, evaluate, compute)
        reasons = {cell.status for cell in parameter_map.cells.values()}
        if all(reason.startswith("impossible") for reason in reasons):
            raise InputError(f"no point of the map is possible: {min(reasons)[12:]}")
        study, warnings = self.study, _map_warnings(parameter_map, self.gears)
        facts = self.facts("", {}, speed=study.at, warnings=warnings)
        return MapResult(study, facts, parameter_map)

    def _evaluation(self, stop: Stop) -> Any:
        study = self.study
        if study.at is not None:
            respond_single = exponent_at if study.exponents else respond_at
            return partial(respond_single, study.at, study.integration)
        respond_band = exponent_over if study.exponents else respond_over
        return partial(respond_band, study.band, study.integration, DIRECTIONS, stop)

    @cached_property
    def _header(self) -> dict[str, str]:
        study, coupled = self.study, self.model.number == "coupled"
        header = self.header(integration_in_words(study.integration, coupled))
        if TORQUE not in study.axis_names:
            header["torque on the input gear [N m]"] = format_exact(
                self.reference_torque
            )
        return header | {
            **study.gear_set.entries,
            "digest of the gear set": digest(self.gears),
            "response": study.response,
        }


def respond_at(frequency: float, settings: Settings, system: LumpedSystem) -> Cell:
    """The response at a frequency of the first mesh [Hz], from rest."""
    return cell_of([respond_confirmed(system, frequency, settings)[0]])


def respond_over(
    frequencies: tuple[float, ...],
    settings: Settings,
    directions: tuple[Direction, ...],
    stop: Stop | None,
    system: LumpedSystem,
) -> Cell:
    """The largest response of sweeps [Hz]; raises Stopped where they were stopped."""
    stop = stop or NeverStop()
    branches = [
        sweep(system, frequencies, direction, settings, stop=stop)
        for direction in directions
    ]
    if stop.is_set():
        raise Stopped
    return cell_of([r for branch in branches for r in branch.responses])


def exponent_at(frequency: float, settings: Settings, system: LumpedSystem) -> Cell:
    """Return the cell of `respond_at` with the largest Lyapunov exponent."""
    response, _, steps = respond_confirmed(system, frequency, settings)
    return cell_of([response], [find_attractor(system, response, steps).exponent])


def exponent_over(
    frequencies: tuple[float, ...],
    settings: Settings,
    directions: tuple[Direction, ...],
    stop: Stop | None,
    system: LumpedSystem,
) -> Cell:
    """Return the cell of `respond_over` with the largest exponent of all speeds."""
    system_at, results = SpeedFamily(system).at, CollectedAttractors()
    for direction in directions:
        sweep_attractors(
            frequencies, system_at, direction, settings, store=results, stop=stop
        )
    if stop is not None and stop.is_set():
        raise Stopped
    exponents = [attractor.exponent for attractor in results.attractors]
    return cell_of(results.responses, exponents)


@dataclass
class CollectedAttractors:
    """Responses and attractors of sweeps, as `sweep_attractors` finishes them."""

    responses: list[Response] = field(default_factory=list)
    attractors: list[Attractor] = field(default_factory=list)

    def finished(self) -> list[tuple[Response, Attractor]]:
        """Return none: every sweep begins anew."""
        return []

    def add(self, response: Response, attractor: Attractor) -> None:
        self.responses.append(replace(response, state=None))
        self.attractors.append(attractor)


def _map_warnings(parameter_map: ParameterMap, gear_set: GearSet) -> Iterator[str]:
    """What changes nothing, and where the largest values cannot be physical."""
    for place, axis in enumerate(parameter_map.axes):
        if len(axis.values) > 1 and _has_no_effect(parameter_map, place):
            yield with_code("W16", f"{axis.name} does not change the response")
    peaks, backs = (
        [
            float(np.fmax.reduce(parameter_map.on_grid(name, m), axis=None))
            for m in range(parameter_map.meshes)
        ]
        for name in ("dte_peak_m", "back_side_fraction")
    )
    where = ", at its worst point"
    yield from motion_warnings(gear_set, where, peaks, backs)


def _has_no_effect(parameter_map: ParameterMap, place: int) -> bool:
    """Whether all vibrations along an axis are the same, to the bit."""
    if len(parameter_map.cells) < len(parameter_map.points):
        return False
    sizes = [parameter_map.on_grid("dte_rms_m", m) for m in range(parameter_map.meshes)]
    return all(
        np.array_equal(rms, np.take(rms, [0], place).repeat(rms.shape[place], place))
        for rms in sizes
    )
