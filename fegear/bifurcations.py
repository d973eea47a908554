"""Bifurcation diagrams of a gear set: settled motions over speed or another figure."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from hashlib import sha256
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.dynamics.checkpoint import response_values, stored_response
from fegear.errors import InputError, file_error
from fegear.gearset.model import GearSet
from fegear.headings import edits_in_words, heading, title_of
from fegear.lumped_models import (
    doubts_of_bodies,
    integration_in_words,
    require_method,
)
from fegear.output import write_text
from fegear.parameter_maps import TORQUE, VariedSet
from fegear.result import Result
from fegear.speeds import MESH_FREQUENCY
from fegear.store import NOTHING, Checkpoint, Keeping
from fegear.unphysical import doubts_of_meshes
from lumped.attractor_figure import draw_attractors
from lumped.attractor_sweeps import (
    AttractorBranch,
    Stretch,
    SystemAt,
    sweep_attractors,
)
from lumped.attractors import Attractor, SectionSettings
from lumped.branches.motions import OverFigure, OverSpeed
from lumped.checks import require_fields
from lumped.csv_text import exact, format_csv
from lumped.map_figure import axis_label
from lumped.maps import Axis
from lumped.progress import Progress, silent
from lumped.response import Response
from lumped.settings import Settings
from lumped.sweep import BOTH, Direction, reporting
from lumped.workers import run_together

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_VALUES = 10_000
MOST_ROWS = 1_000_000  # of the table, some 100 bytes each
LEGEND = {
    "direction": "of the parameter, up or down",
    "mesh, section": "counted from 1",
    "dte_m, dte_rate_m_per_s": "dynamic transmission error and its rate at the start "
    "of successive common periods of all meshes",
    "motion": "periodic, quasi-periodic, chaotic, or unsettled: it still settles, or "
    "repeats after more periods than were looked for",
    "period_multiple": "common periods of all meshes after which the motion repeats, 0 "
    "where it does not",
    "lyapunov_per_period, lyapunov_spread_per_period": "largest Lyapunov exponent per "
    "period of the first mesh and its standard error, 0 where the motion repeats",
}
ARRAYS = "deflection", "rate"  # of an attractor
COLUMNS = (
    *("direction", "mesh", "section", "dte_m", "dte_rate_m_per_s", "motion"),
    *("period_multiple", "lyapunov_per_period", "lyapunov_spread_per_period"),
)


@dataclass(frozen=True, kw_only=True)
class AttractorSettings:
    """How settled motions are found; directions : of the parameter."""

    integration: Settings = field(default_factory=lambda: Settings(multiples=32))
    sections: SectionSettings = field(default_factory=SectionSettings)
    directions: tuple[Direction, ...] = BOTH

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationsResult(Result):
    """Attractors over a parameter, and the header of their file.

    parameter : `mesh_frequency_Hz`, or the figure that varies instead
    length : values that were asked for
    doubts : where the model leaves out too much
    """

    gear_set: GearSet
    parameter: str
    length: int
    header: Mapping[str, str]
    branches: tuple[AttractorBranch, ...]
    doubts: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        return all(branch.complete for branch in self.branches)

    @property
    def diverged(self) -> bool:
        """Whether a branch ended by a divergence."""
        last = [branch.attractors[-1:] for branch in self.branches]
        return any(each and each[0].kind == "diverged" for each in last)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write a row for each value, mesh and point of its section."""
        write_text(path, self.csv())

    def csv(self) -> str:
        """The rows as text."""
        names = (self.parameter, *COLUMNS)
        return format_csv(names, self.rows(), {**self.header, **LEGEND})

    def rows(self) -> Iterator[list[object]]:
        for branch in self.branches:
            for value, found in zip(branch.values, branch.attractors, strict=True):
                last = found.kind, found.multiple, found.exponent, found.spread
                for (k, m), error in np.ndenumerate(found.deflection):
                    rate = float(found.rate[k, m])
                    point = branch.direction, m + 1, k + 1, float(error), rate
                    yield [value, *point, *last]

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON; None for what varies."""
        return {
            **heading(self.header, self.parameter),
            "values": self.length,
            "branches": [_plain(branch) for branch in self.branches],
            "warnings": [*self.doubts, *self._doubts_of_size()],
        }

    def _doubts_of_size(self) -> Iterator[str]:
        """Where the largest deflections cannot be physical."""
        found = [each.deflection for b in self.branches for each in b.attractors]
        every = np.abs(np.concatenate(found)) if found else np.empty((0, 0))
        if every.size:
            peaks = every.max(axis=0)
            where = ", at its worst section"
            meshes = self.gear_set.meshes
            yield from doubts_of_meshes(meshes, where, peaks, 0.0 * peaks)

    def draw(self) -> Figure:
        over_speed = self.parameter == MESH_FREQUENCY
        label = OverSpeed.label if over_speed else axis_label(self.parameter)
        title = title_of(heading(self.header, self.parameter))
        title = f"{title}\n{edits_in_words(self.header)}".strip()
        return draw_attractors(self.branches, label, title)


def _plain(branch: AttractorBranch) -> dict[str, Any]:
    return {
        "direction": branch.direction,
        "complete": branch.complete,
        "finished_values": len(branch.values),
        "stretches": [_plain_stretch(each) for each in branch.stretches],
    }


def _plain_stretch(stretch: Stretch) -> dict[str, Any]:
    return {
        "first": stretch.first,
        "last": stretch.last,
        "motion": stretch.name,
        "begins_by": stretch.begins,
        "largest_lyapunov_per_period": stretch.exponent,
    }


def find_bifurcations(
    varied: VariedSet,
    axis: Axis,
    frequency: float | None = None,
    settings: AttractorSettings | None = None,
    keeping: Keeping = NOTHING,
    progress: Progress = silent,
) -> BifurcationsResult:
    """Settle at values of a parameter in turn, and look at what the motion is.

    axis : the values; of the mesh frequency of the first mesh, `mesh_frequency_Hz`
        [Hz], or the one axis of `varied`
    frequency : of the first mesh where another figure varies [Hz]
    keeping : of finished values

    After Ctrl-C branches hold the values that were finished and are not complete.
    """
    settings = settings or AttractorSettings()
    require_method(varied.model, settings.integration)
    require_few(axis, len(varied.gear_set.meshes), settings)
    progress("stiffness", 0, 1)
    over_speed = axis.name == MESH_FREQUENCY
    if frequency is None and not over_speed:
        raise InputError(f"over = {axis.name}; needs a mesh frequency")
    varied = replace(varied, speeds=axis.values if frequency is None else (frequency,))
    header = _header(varied, axis, frequency, settings)
    system_at = _systems(varied, axis, frequency)
    system_at(min(axis.values))  # so that limits that cannot be are named at once
    last, _ = system_at(max(axis.values))
    names = [str(direction) for direction in settings.directions]
    checkpoint = keeping.open(_inputs(varied, axis, header))
    if checkpoint is not None and keeping.resume:
        checkpoint.tell_finished(
            names, len(names) * len(axis.values), keeping.tell, "value"
        )
    stop = threading.Event()
    observer = reporting(progress, len(names) * len(axis.values))
    tasks = [
        partial(
            sweep_attractors,
            *(axis.values, system_at, direction),
            *(settings.integration, settings.sections),
            store=stored_branch(checkpoint, direction),
            observer=observer,
            stop=stop,
        )
        for direction in settings.directions
    ]
    done = False
    try:
        branches = run_together(tasks, stop)
        done = all(branch.complete for branch in branches)
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=not done)
    if not done:
        finished = sum(len(branch.values) for branch in branches)
        total = len(branches) * len(axis.values)
        header["incomplete"] = f"{finished} of {total} values"
    return BifurcationsResult(
        *(varied.gear_set, axis.name, len(axis.values), header, tuple(branches)),
        doubts=tuple(doubts_of_bodies(last, varied.speeds)),
    )


def require_few(axis: Axis, meshes: int, settings: AttractorSettings) -> None:
    """Raise InputError for more than a table should hold."""
    count, sections = len(axis.values), settings.sections.sections
    if count > MOST_VALUES:
        raise InputError(f"over = {count} values; allowed are {MOST_VALUES} at most")
    rows = count * sections * meshes * len(settings.directions)
    if rows > MOST_ROWS:
        raise InputError(
            f"sections = {sections}; with {count} values that is a table of up to "
            f"{rows} rows, allowed are {MOST_ROWS}"
        )


def _systems(varied: VariedSet, axis: Axis, frequency: float | None) -> SystemAt:
    """Of values of the parameter; one thread at a time solves finite elements."""
    if axis.name == MESH_FREQUENCY:
        return OverSpeed(varied.system(())).at
    assert frequency is not None
    limits, lock = (min(axis.values), max(axis.values)), threading.Lock()
    family = OverFigure(axis.name, lambda v: varied.system((v,)), frequency, limits)

    def system_at(value: float) -> tuple[Any, float]:
        with lock:
            return family.at(value)

    return system_at


def _header(
    varied: VariedSet, axis: Axis, frequency: float | None, settings: AttractorSettings
) -> dict[str, str]:
    """Entries of the file."""
    header = varied.header(
        integration_in_words(settings.integration, varied.model.number == "coupled")
    )
    if frequency is not None:
        header["speed_Hz"] = exact(frequency)
    if axis.name != TORQUE:
        header["torque_Nm"] = exact(varied.load)
    header["period multiples looked for"] = f"up to {settings.integration.multiples}"
    header["sections"] = f"{settings.sections.sections} where a motion does not repeat"
    return header


def _inputs(varied: VariedSet, axis: Axis, header: Mapping[str, str]) -> dict[str, str]:
    """All that determines the results."""
    figures = repr((varied.gear_set, sorted(varied.fixed.items())))
    return {
        "over": axis.name,
        "values": ", ".join(map(repr, axis.values)),
        **header,
        "figures of the gear set": sha256(figures.encode()).hexdigest(),
    }


def stored_branch(checkpoint: Checkpoint | None, name: str) -> StoredAttractors | None:
    """The branch by its name, None where nothing is kept."""
    return None if checkpoint is None else StoredAttractors(checkpoint, name)


@dataclass(frozen=True, eq=False)
class StoredAttractors:
    """A branch by its name in a checkpoint, as `lumped.attractor_sweeps` keeps it."""

    checkpoint: Checkpoint
    name: str

    def finished(self) -> list[tuple[Response, Attractor]]:
        found = self.checkpoint.finished(self.name)
        arrays = self.checkpoint.state(self.name)
        pairs = []
        for values in found:
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
        try:
            self.checkpoint.add(self.name, values, {"motion": response.state})
        except OSError as error:
            raise file_error(self.checkpoint.path, "written", error) from None


def _stored_attractor(values: dict[str, Any]) -> Attractor:
    shape = -1, values.pop("meshes")
    arrays = {name: np.array(values[name], float).reshape(shape) for name in ARRAYS}
    return Attractor(**{**values, **arrays})
