"""Bifurcation diagrams of a gear set: settled motions over speed or a parameter."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np

from fegear.commands.bifurcations.result import BifurcationsResult
from fegear.files.errors import InputError
from fegear.files.records import Records
from fegear.files.speed_ranges import MESH_FREQUENCY
from fegear.gearset.speeds import cycles_per_turn, mesh_frequency
from fegear.statics.plausibility import motion_warnings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import (
    SettingsGroup,
    display_name,
    expose,
    group,
    refusal,
    setting,
)
from fegear.studies.study import Study
from fegear.studies.trains.axes import axis_setting
from fegear.studies.trains.driver_speed import DRIVER_SPEED
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.model_texts import body_modes_warnings, integration_in_words
from fegear.studies.trains.models import ALL_MODELS, lumped_integration, lumped_model
from fegear.studies.trains.parametric import TORQUE, ParametricProblem, ParametricStudy
from fegear.studies.trains.speeds import (
    FREQUENCY,
    RPM,
    refuse_both,
    rpm_setting,
    with_frequencies,
)
from fegear.train.model_settings import LumpedModel
from lumped.attractors.attractor_sweeps import (
    AttractorBranch,
    SystemAt,
    sweep_attractors,
)
from lumped.attractors.attractors import Attractor, SectionSettings
from lumped.branches.motions import ParameterFamily, SpeedFamily
from lumped.common.csv_text import format_exact
from lumped.common.options import Range
from lumped.steady.integration_settings import Settings
from lumped.steady.maps import Axis
from lumped.steady.response import Response
from lumped.steady.sweep import DIRECTIONS, Direction, reporting_observer
from lumped.train.system import LumpedSystem

MAX_VALUES = 10_000
MAX_ROWS = 1_000_000  # of the table, some 100 bytes each


# by name, what a speed as a parameter may be
SPEEDS = {MESH_FREQUENCY: FREQUENCY, DRIVER_SPEED: RPM}
SECTIONS = SettingsGroup(kind=SectionSettings, exposed=expose("sections"))


@dataclass(frozen=True, kw_only=True)
class Bifurcations(
    ParametricStudy,
    Study,
    command="bifurcations",
    example="bifurcations liu-idler --over mesh_frequency_Hz=900:1700:161",
):
    """Period doublings and chaos over speed or a parameter.

    Poincaré sections and the largest Lyapunov exponent. With --output each finished
    value is stored in FILE.partial until the file is written; --resume continues from
    there.
    """

    resumes = True
    partial = True
    unit = "value"

    over: Axis = axis_setting(
        "Parameter: mesh_frequency_Hz of the first mesh, driver_speed_rpm of its "
        "driver, a key of the gear set, torque_Nm or damping_ratio, with N values "
        "from A to B, or values with commas."
    )
    at: float | None = setting(
        None,
        "Mesh frequency of the first mesh [Hz], where another parameter varies.",
        FREQUENCY,
        metavar="HZ",
    )
    rpm: float | None = rpm_setting("--at")
    direction: Literal["up", "down", "both"] = setting(
        "both",
        "Whether the values rise, fall, or both in parallel; each motion starts "
        "from the steady state of the one before.",
    )
    sections: SectionSettings = group(SECTIONS)
    period_multiple: int = setting(
        32,
        "Largest number of common periods of all meshes after which a motion "
        "counts as periodic.",
        Range(1, 64),
    )
    torque: float | None = torque_setting()
    model: LumpedModel = lumped_model(ALL_MODELS)
    integration: Settings = lumped_integration()

    def __post_init__(self) -> None:
        super().__post_init__()
        over, axis = display_name(self, "over"), self.over
        refuse_both(self, "at", "rpm")
        fixed = next((n for n in ("at", "rpm") if getattr(self, n) is not None), "")
        if not self.over_speed:
            if not fixed:
                speed_needed = f"needs a mesh frequency, {display_name(self, 'at')} HZ"
                raise InputError(f"{over} {axis.name}; {speed_needed}")
        elif fixed:
            why = f"{over} {axis.name} replaces it, leave it out"
            raise refusal(self, fixed, why)
        for value in axis.values if self.over_speed else ():
            if value not in SPEEDS[axis.name]:
                where = f"{over} {axis.name} = {value:g}"
                raise InputError(f"{where}; must be {SPEEDS[axis.name]}")

    @property
    def over_speed(self) -> bool:
        """Whether the speed varies."""
        return self.over.name in SPEEDS

    @property
    def axes(self) -> tuple[Axis, ...]:
        return () if self.over_speed else (self.over,)

    @property
    def fixed_mesh_frequencies(self) -> tuple[float, ...]:
        return self.over.values if self.at is None else (self.at,)

    @property
    def directions(self) -> tuple[Direction, ...]:
        """The directions of the parameter, in order."""
        return DIRECTIONS if self.direction == "both" else (self.direction,)

    @property
    def settling(self) -> Settings:
        """Settings of the integration, with the largest period multiple to look for."""
        return replace(self.integration, multiples=self.period_multiple)

    def prepare(self) -> BifurcationsProblem:
        return BifurcationsProblem.of(
            with_frequencies(self._over_frequency(), {"at": self.rpm})
        )

    def _over_frequency(self) -> Bifurcations:
        """The study with mesh frequencies [Hz] in place of speeds of rotation."""
        if self.over.name != DRIVER_SPEED:
            return self
        cycles = cycles_per_turn(self.gear_set.loaded)
        frequencies = (mesh_frequency(cycles, rpm) for rpm in self.over.values)
        return replace(self, over=Axis(MESH_FREQUENCY, tuple(frequencies)))


@dataclass(frozen=True, eq=False)
class BifurcationsProblem(ParametricProblem):
    """A train at each value of what varies."""

    study: Bifurcations

    @cached_property
    def system_at(self) -> SystemAt:
        """Return the system at a value; one thread at a time solves finite elements."""
        over, at, lock = self.study.over, self.study.at, threading.Lock()
        if at is None:
            return SpeedFamily(self.system(())).at
        limits = min(over.values), max(over.values)
        family = ParameterFamily(over.name, lambda v: self.system((v,)), at, limits)

        def system_at(value: float) -> tuple[LumpedSystem, float]:
            with lock:
                return family.at(value)

        return system_at

    @property
    def motions(self) -> float:
        # besides settling, sections and exponents
        return 4.0 * len(self.study.over.values) * len(self.study.directions)

    @property
    def set_ups(self) -> int:
        return 1 if self.study.over_speed else len(self.study.over.values)

    def tasks(self) -> Iterator[Task]:
        study, values = self.study, self.study.over.values
        self._require_storable_size()
        for value in (min(values), max(values)):
            self.system_at(value)  # so that limits that cannot be are named at once
        for direction in study.directions:
            work = partial(self._follow_attractors, direction)
            yield Task(direction, work, len(values))

    def _require_storable_size(self) -> None:
        """Raise InputError for more than a table should hold."""
        study = self.study
        count, sections = len(study.over.values), study.sections.sections
        if count > MAX_VALUES:
            raise InputError(f"over = {count} values; allowed are {MAX_VALUES} at most")
        rows = count * sections * len(self.gears.meshes) * len(study.directions)
        if rows > MAX_ROWS:
            raise InputError(
                f"sections = {sections}; with {count} values that is a table of up to "
                f"{rows} rows, allowed are {MAX_ROWS}"
            )

    def _follow_attractors(self, direction: Direction, job: Job) -> AttractorBranch:
        study, values = self.study, self.study.over.values
        return sweep_attractors(
            *(values, self.system_at, direction),
            *(study.settling, study.sections),
            store=StoredAttractors(job),
            observer=reporting_observer(job.report, len(values)),
            stop=job.stop,
        )

    def gather(
        self, results: Mapping[str, AttractorBranch | None]
    ) -> BifurcationsResult:
        branches = [
            results[direction] or AttractorBranch(direction, (), (), complete=False)
            for direction in self.study.directions
        ]
        header, warnings = self._header(branches), self._warnings(branches)
        study = self.study
        facts = self.facts(study.over.name, header, study.at, warnings)
        return BifurcationsResult(study, facts, tuple(branches))

    def _header(self, branches: Sequence[AttractorBranch]) -> dict[str, str]:
        study, coupled = self.study, self.model.number == "coupled"
        header = self.header(integration_in_words(study.settling, coupled))
        if study.at is not None:
            header["speed_Hz"] = format_exact(study.at)
        if TORQUE not in study.axis_names:
            header["torque_Nm"] = format_exact(self.reference_torque)
        header["largest period multiple searched"] = f"up to {study.period_multiple}"
        sections = f"{study.sections.sections} where a motion does not repeat"
        header["sections"] = sections
        if not all(branch.complete for branch in branches):
            finished = sum(len(branch.values) for branch in branches)
            total = len(branches) * len(study.over.values)
            header["incomplete"] = f"{finished} of {total} values"
        return header

    def _warnings(self, branches: Sequence[AttractorBranch]) -> Iterator[str]:
        """Warn where body modes matter or the largest deflections are not physical."""
        last_deflections, _ = self.system_at(max(self.study.over.values))
        yield from body_modes_warnings(
            last_deflections, self.study.fixed_mesh_frequencies
        )
        deflections = [
            attractor.deflection
            for branch in branches
            for attractor in branch.attractors
        ]
        if deflections and np.concatenate(deflections).size:
            peaks = np.abs(np.concatenate(deflections)).max(axis=0)
            where = ", at its worst section"
            yield from motion_warnings(self.gears, where, peaks, 0.0 * peaks)


@dataclass(frozen=True, eq=False)
class StoredAttractors:
    """A branch among the records of a task, as `sweep_attractors` keeps it."""

    records: Records

    def finished(self) -> list[tuple[Response, Attractor]]:
        pairs, arrays = self.records.records, self.records.state
        if pairs and arrays is not None:
            response, attractor = pairs[-1]
            pairs[-1] = replace(response, state=arrays["motion"]), attractor
        return pairs

    def add(self, response: Response, attractor: Attractor) -> None:
        record = replace(response, state=None), attractor
        self.records.add_record(record, {"motion": response.state})
