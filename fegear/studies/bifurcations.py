"""Bifurcation diagrams of a gear set: settled motions over speed or a parameter."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fegear.files.errors import InputError
from fegear.files.speeds import MESH_FREQUENCY
from fegear.files.stored import Records, response_values, stored_response
from fegear.statics.plausibility import mesh_warnings
from fegear.studies.axes import axis_setting
from fegear.studies.headings import edits_in_words, title_of
from fegear.studies.page import Columns, Page, RowTable, cell, pluralize
from fegear.studies.study import (
    Draw,
    Job,
    Range,
    Setting,
    SettingsGroup,
    Study,
    StudyResult,
    Task,
    display_name,
    group,
    refusal,
    setting,
)
from fegear.studies.table import Table
from fegear.studies.trains import (
    COUPLED,
    FREQUENCY,
    lumped_integration,
    lumped_model,
    torque_setting,
    train_warnings,
)
from fegear.studies.varied import TORQUE, ParametricStudy
from fegear.train.lumped_models import (
    LumpedModel,
    body_modes_warnings,
    integration_in_words,
    require_method,
)
from lumped.attractors.attractor_sweeps import (
    AttractorBranch,
    AttractorInterval,
    SystemAt,
    sweep_attractors,
)
from lumped.attractors.attractors import Attractor, SectionSettings
from lumped.branches.motions import ParameterFamily, SpeedFamily
from lumped.common.csv_text import exact
from lumped.figures.attractors import draw_attractors
from lumped.figures.maps import axis_label
from lumped.steady.maps import Axis
from lumped.steady.response import Response
from lumped.steady.settings import Settings
from lumped.steady.sweep import BOTH, Direction, reporting
from lumped.train.system import LumpedSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_VALUES = 10_000
MAX_ROWS = 1_000_000  # of the table, some 100 bytes each
LEGEND = {
    "direction": "of the parameter, up or down",
    "mesh, section": "counted from 1",
    "dte_m, dte_rate_m_per_s": "dynamic transmission error and its rate at the start "
    "of successive common periods of all meshes",
    "motion": "periodic, quasi-periodic, chaotic, or not converged: a transient, or "
    "periodic after more periods than were searched",
    "period_multiple": "common periods of all meshes after which the motion repeats, 0 "
    "where it does not",
    "lyapunov_per_period, lyapunov_stderr_per_period": "largest Lyapunov exponent per "
    "period of the first mesh and its standard error, 0 where the motion repeats",
}
ARRAYS = "deflection", "rate"  # of an attractor
COLUMNS = (
    *("direction", "mesh", "section", "dte_m", "dte_rate_m_per_s", "motion"),
    *("period_multiple", "lyapunov_per_period", "lyapunov_stderr_per_period"),
)


SECTIONS = SettingsGroup(
    kind=SectionSettings,
    exposed={
        "sections": Setting(
            text="Points of the Poincaré section of an aperiodic motion, one in "
            "each common period of all meshes."
        )
    },
)


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
        "Parameter: mesh_frequency_Hz of the first mesh, a key of the gear set, "
        "torque_Nm or damping_ratio, with N values from A to B, or values with "
        "commas."
    )
    at: float | None = setting(
        None,
        "Mesh frequency of the first mesh [Hz], where another parameter varies.",
        FREQUENCY,
        metavar="HZ",
    )
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
    model: LumpedModel = lumped_model(COUPLED)
    integration: Settings = lumped_integration()

    def __post_init__(self) -> None:
        super().__post_init__()
        over, axis = display_name(self, "over"), self.over
        if not self.over_speed:
            if self.at is None:
                needed = f"needs a mesh frequency, {display_name(self, 'at')} HZ"
                raise InputError(f"{over} {axis.name}; {needed}")
        elif self.at is not None:
            why = f"{over} {MESH_FREQUENCY} replaces it, leave it out"
            raise refusal(self, "at", why)
        for value in axis.values if self.over_speed else ():
            if value not in FREQUENCY:
                where = f"{over} {MESH_FREQUENCY} = {value:g}"
                raise InputError(f"{where}; allowed {FREQUENCY}")

    @property
    def over_speed(self) -> bool:
        """Whether the speed varies."""
        return self.over.name == MESH_FREQUENCY

    @property
    def axes(self) -> tuple[Axis, ...]:
        return () if self.over_speed else (self.over,)

    @property
    def at_speeds(self) -> tuple[float, ...]:
        return self.over.values if self.at is None else (self.at,)

    @property
    def directions(self) -> tuple[Direction, ...]:
        return BOTH if self.direction == "both" else (self.direction,)

    @property
    def settling(self) -> Settings:
        return replace(self.integration, multiples=self.period_multiple)

    @cached_property
    def system_at(self) -> SystemAt:
        """Return the system at a value; one thread at a time solves finite elements."""
        if self.at is None:
            return SpeedFamily(self.system(())).at
        values, lock = self.over.values, threading.Lock()
        limits = min(values), max(values)
        family = ParameterFamily(
            self.over.name, lambda v: self.system((v,)), self.at, limits
        )

        def system_at(value: float) -> tuple[LumpedSystem, float]:
            with lock:
                return family.at(value)

        return system_at

    def tasks(self) -> Iterator[Task]:
        self._require_few()
        require_method(self.resolved_model, self.integration)
        for value in (min(self.over.values), max(self.over.values)):
            self.system_at(value)  # so that limits that cannot be are named at once
        for direction in self.directions:
            work = partial(self._swept, direction)
            yield Task(direction, work, len(self.over.values))

    def _require_few(self) -> None:
        """Raise InputError for more than a table should hold."""
        count, sections = len(self.over.values), self.sections.sections
        if count > MAX_VALUES:
            raise InputError(f"over = {count} values; allowed are {MAX_VALUES} at most")
        rows = count * sections * len(self.gears.meshes) * len(self.directions)
        if rows > MAX_ROWS:
            raise InputError(
                f"sections = {sections}; with {count} values that is a table of up to "
                f"{rows} rows, allowed are {MAX_ROWS}"
            )

    def _swept(self, direction: Direction, job: Job) -> AttractorBranch:
        return sweep_attractors(
            *(self.over.values, self.system_at, direction),
            *(self.settling, self.sections),
            store=StoredAttractors(job),
            observer=reporting(job.report, len(self.over.values)),
            stop=job.stop,
        )

    def gather(
        self, results: Mapping[str, AttractorBranch | None]
    ) -> BifurcationsResult:
        branches = [
            results[direction] or AttractorBranch(direction, (), (), complete=False)
            for direction in self.directions
        ]
        return BifurcationsResult(self, tuple(branches))


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationsResult(StudyResult):
    """Attractors over a parameter."""

    study: Bifurcations
    branches: tuple[AttractorBranch, ...]

    @property
    def complete(self) -> bool:
        return all(branch.complete for branch in self.branches)

    @property
    def empty(self) -> bool:
        return not any(branch.values for branch in self.branches)

    @property
    def failure(self) -> str:
        """Message with the values at which motions diverged."""
        name = self.study.over.name
        return "; ".join(
            f"the motion diverged at {name} = {b.values[-1]:.12g}, {b.direction}"
            for b in self.branches
            if b.attractors and b.attractors[-1].kind == "diverged"
        )

    @property
    def table(self) -> Table:
        """A row for each value, mesh and point of its section."""
        names = (self.study.over.name, *COLUMNS)
        return Table(names, self._rows, {**self._header, **LEGEND})

    @property
    def _header(self) -> dict[str, str]:
        study, values = self.study, len(self.study.over.values)
        coupled = study.resolved_model.number == "coupled"
        header = study.header(integration_in_words(study.settling, coupled))
        if study.at is not None:
            header["speed_Hz"] = exact(study.at)
        if TORQUE not in study.names:
            header["torque_Nm"] = exact(study.load)
        header["largest period multiple searched"] = f"up to {study.period_multiple}"
        sections = f"{study.sections.sections} where a motion does not repeat"
        header["sections"] = sections
        if not self.complete:
            finished = sum(len(branch.values) for branch in self.branches)
            total = len(self.branches) * values
            header["incomplete"] = f"{finished} of {total} values"
        return header | study.gear_set.entries

    def _rows(self) -> Iterator[list[object]]:
        for branch in self.branches:
            for value, attractor in zip(branch.values, branch.attractors, strict=True):
                last = (
                    attractor.kind,
                    attractor.multiple,
                    attractor.exponent,
                    attractor.stderr,
                )
                for (k, m), error in np.ndenumerate(attractor.deflection):
                    rate = float(attractor.rate[k, m])
                    point = branch.direction, m + 1, k + 1, float(error), rate
                    yield [value, *point, *last]

    @property
    def _heading(self) -> dict[str, Any]:
        return self.study.summary_header(self.study.over.name, self.study.at)

    @cached_property
    def summary(self) -> dict[str, Any]:
        study = self.study
        last, _ = study.system_at(max(study.over.values))
        return {
            **self._heading,
            "values": len(study.over.values),
            "branches": [_branch_values(branch) for branch in self.branches],
            "warnings": [
                *train_warnings(study, study.at_load),
                *body_modes_warnings(last, study.at_speeds),
                *self._size_warnings(),
            ],
        }

    def _size_warnings(self) -> Iterator[str]:
        """Warnings where the largest deflections cannot be physical."""
        deflections = [
            attractor.deflection for b in self.branches for attractor in b.attractors
        ]
        every = np.abs(np.concatenate(deflections)) if deflections else np.empty((0, 0))
        if every.size:
            peaks = every.max(axis=0)
            where = ", at its worst section"
            meshes = self.study.gears.meshes
            yield from mesh_warnings(meshes, where, peaks, 0.0 * peaks)

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._diagram}

    def _diagram(self) -> Figure:
        study = self.study
        label = SpeedFamily.label if study.over_speed else axis_label(study.over.name)
        changes = edits_in_words(study.gear_set.entries)
        title = f"{title_of(self._heading)}\n{changes}".strip()
        return draw_attractors(self.branches, label, title)

    def page(self) -> Page:
        values = self.summary
        yield from self.study.limits
        yield title_of(values)
        for branch in values["branches"]:
            done = pluralize(branch["finished_values"], "value")
            trend = "rising" if branch["direction"] == "up" else "falling"
            title = f"{values['over']}, {done}, {trend}"
            columns = ("motion", "begins by")
            yield RowTable(branch["stretches"], STRETCH, title, columns)
            if not branch["complete"]:
                yield f"ended after {done} of {values['values']}"


STRETCH: Columns = {
    "from": lambda row: f"{row['first']:.6g}",
    "to": lambda row: f"{row['last']:.6g}",
    "motion": lambda row: str(row["motion"]),
    "largest exponent\n[1/period]": cell("largest_lyapunov_per_period", 3),
    "begins by": lambda row: str(row["begins_by"]),
}


def _branch_values(branch: AttractorBranch) -> dict[str, Any]:
    return {
        "direction": branch.direction,
        "complete": branch.complete,
        "finished_values": len(branch.values),
        "stretches": [_plain_stretch(interval) for interval in branch.intervals],
    }


def _plain_stretch(stretch: AttractorInterval) -> dict[str, Any]:
    return {
        "first": stretch.first,
        "last": stretch.last,
        "motion": stretch.name,
        "begins_by": stretch.transition,
        "largest_lyapunov_per_period": stretch.exponent,
    }


@dataclass(frozen=True, eq=False)
class StoredAttractors:
    """A branch among the records of a task, as `sweep_attractors` keeps it."""

    records: Records

    def finished(self) -> list[tuple[Response, Attractor]]:
        arrays, pairs = self.records.state, []
        for values in self.records.records:
            attractor = _stored_attractor(values.pop("attractor"))
            pairs.append((stored_response(values), attractor))
        if pairs and arrays is not None:
            response, attractor = pairs[-1]
            pairs[-1] = replace(response, state=arrays["motion"]), attractor
        return pairs

    def add(self, response: Response, attractor: Attractor) -> None:
        values = response_values(response)
        values["attractor"] = asdict(attractor) | {
            name: getattr(attractor, name).tolist() for name in ARRAYS
        }
        values["attractor"]["meshes"] = response.dte_rms.size
        self.records.add_record(values, {"motion": response.state})


def _stored_attractor(values: dict[str, Any]) -> Attractor:
    shape = -1, values.pop("meshes")
    arrays = {name: np.array(values[name], float).reshape(shape) for name in ARRAYS}
    return Attractor(**{**values, **arrays})
