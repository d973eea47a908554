"""Branches of periodic motions of a gear set over speed or another figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from math import isnan
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.boundary import public
from fegear.errors import InputError
from fegear.excitation import GivenTables
from fegear.gearset.model import GearSet
from fegear.headings import heading, title_of
from fegear.lumped_models import (
    LumpedModel,
    body_entries,
    doubts_of_bodies,
    file_header,
    lumped_system,
)
from fegear.output import write_text
from fegear.parameter_maps import TORQUE, VariedSet, digest
from fegear.result import Result
from fegear.speeds import MESH_FREQUENCY
from fegear.store import NOTHING, Checkpoint, Keeping
from fegear.unphysical import doubts_of_meshes
from lumped.branches.bifurcations import BranchPoint
from lumped.branches.figure import draw_branches
from lumped.branches.motions import OverFigure, OverSpeed
from lumped.branches.periodic import BranchFinder, BranchSettings, PeriodicBranch
from lumped.branches.plain import plain_branch, read_branch
from lumped.csv_text import exact, format_csv
from lumped.progress import Progress, silent
from lumped.system import LumpedSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BRANCHES = "branches"  # in a checkpoint
SCHEME = "harmonic balance"
STEPPED = "fixed points of the map over a period"  # of the coupled model
LEGEND = {
    "branch, index": "counted from 1, points in the order of the branch",
    MESH_FREQUENCY: "of the first mesh, in all rows",
    "mesh": "counted from 1",
    "dte_rms_m": "dynamic transmission error without its mean",
    "stable": "1 or 0; 0 in a fold and where the branch stands upright",
    "floquet_max": "modulus of the largest Floquet multiplier",
    "kind": "fold, period doubling, branch point or torus, as shooting locates them "
    "where it can; else empty",
    "period_multiple": "common periods of all meshes after which the motion repeats",
}


@dataclass(frozen=True)
class BranchRow:
    """One mesh at one point; the fields are the columns of the file.

    parameter : the figure that varies, by whose name its column goes; none where that
        is the speed
    """

    branch: int
    index: int
    parameter: float
    mesh_frequency_Hz: float
    mesh: int
    dte_rms_m: float
    dte_peak_m: float
    stable: int
    floquet_max: float
    kind: str
    period_multiple: int


@dataclass(frozen=True, eq=False, repr=False)
class BranchesResult(Result):
    """Branches of a gear set, and the header of their file.

    gear_set : as it is, where a figure of it varies; system : of it
    parameter : `mesh_frequency_Hz`, or the figure that varies instead
    """

    gear_set: GearSet
    system: LumpedSystem
    header: Mapping[str, str]
    branches: tuple[PeriodicBranch, ...]
    parameter: str = MESH_FREQUENCY
    interrupted: bool = False

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write a row for each point and mesh."""
        write_text(path, self.csv())

    def csv(self) -> str:
        """The rows as text."""
        names = [column.name for column in fields(BranchRow)]
        if self.parameter == MESH_FREQUENCY:
            names.remove("parameter")
        rows = ([getattr(row, name) for name in names] for row in self.rows())
        named = [self.parameter if name == "parameter" else name for name in names]
        return format_csv(named, rows, {**self.header, **LEGEND})

    def rows(self) -> Iterator[BranchRow]:
        for number, branch in enumerate(self.branches, start=1):
            for index, point in enumerate(branch.points, start=1):
                for m in range(len(self.system.excitations)):
                    yield BranchRow(
                        branch=number,
                        index=index,
                        parameter=point.place,
                        mesh_frequency_Hz=self._frequency(point),
                        mesh=m + 1,
                        dte_rms_m=float(point.figures["dte_rms"][m]),
                        dte_peak_m=float(point.figures["dte_peak"][m]),
                        stable=int(point.stable),
                        floquet_max=point.largest,
                        kind=point.kind,
                        period_multiple=branch.multiple,
                    )

    def _frequency(self, point: BranchPoint) -> float:
        return point.place if self.parameter == MESH_FREQUENCY else point.frequency

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON; None for what varies."""
        return {
            **heading(self.header, self.parameter),
            "harmonics": None if self._stepped else int(self.header["harmonics"]),
            "natural_frequencies_Hz": self.system.resonances_Hz.tolist(),
            "interrupted": self.interrupted,
            "branches": [
                _plain(branch, self.parameter, self._stepped)
                for branch in self.branches
            ],
            "warnings": list(self._doubts()),
        }

    @property
    def _stepped(self) -> bool:
        return self.system.contacts is not None

    def _doubts(self) -> Iterator[str]:
        """Warn where the model leaves out too much or deflections are not physical."""
        points = [point for branch in self.branches for point in branch.points]
        yield from doubts_of_bodies(self.system, [p.frequency for p in points])
        peaks = np.max([point.figures["dte_peak"] for point in points], axis=0)
        where = ", at its worst point"
        yield from doubts_of_meshes(self.gear_set.meshes, where, peaks, 0.0 * peaks)

    def draw(self) -> Figure:
        label = OverSpeed.label if self.parameter == MESH_FREQUENCY else self.parameter
        return draw_branches(self.branches, label, title_of(self.summary))


@public
def find_branches(
    gear_set: GearSet,
    torque: float,
    limits: tuple[float, float],
    model: LumpedModel,
    settings: BranchSettings | None = None,
    report: Progress = silent,
    keeping: Keeping = NOTHING,
) -> BranchesResult:
    """All branches that a start at rest, sweeps and period doublings lead to.

    torque : on the input gear [N m]
    limits : mesh frequencies of the first mesh [Hz] between which they are followed
    keeping : where branches are kept as they are found
    After KeyboardInterrupt the result holds those that were finished.
    Raises InputError, TrainError where the motion's period is too long, and
    ArithmeticError where no motion is found to begin with.
    """
    low, high = limits
    if not 0.0 < low < high:
        raise InputError(
            f"speeds = {low:g}:{high:g}; the first must be positive and below the last"
        )
    system = lumped_system(gear_set, torque, model, speeds=limits)
    scheme = SCHEME if system.contacts is None else STEPPED
    header = file_header(gear_set, model, system.train.damping_ratio, scheme) | {
        **body_entries(system, limits),
        "model": model.name,
        "torque_Nm": exact(torque),
    }
    finder = BranchFinder(OverSpeed(system), limits, settings or BranchSettings())
    known = header | {"digest of the gear set": digest(gear_set)}
    if isinstance(model.stiffness, GivenTables):
        known |= {"digest of the tables": model.stiffness.digest}
    result = BranchesResult(gear_set, system, header, ())
    return _followed(result, finder, keeping, known, report)


def find_branches_over(
    varied: VariedSet,
    frequency: float,
    settings: BranchSettings | None = None,
    report: Progress = silent,
    keeping: Keeping = NOTHING,
) -> BranchesResult:
    """The same over a figure of a gear set, at one mesh frequency.

    varied : with one axis, of the two limits of the figure
    frequency : of the first mesh [Hz]
    """
    varied, (axis,) = replace(varied, speeds=(frequency,)), varied.axes
    low, high = limits = axis.values[0], axis.values[-1]
    if not low < high:
        raise InputError(f"{axis.name} = {low:g}:{high:g}; the first must be below")
    system = varied.system((low,))
    scheme = SCHEME if system.contacts is None else STEPPED
    header = varied.header(scheme) | {"speed_Hz": exact(frequency)}
    if axis.name != TORQUE:
        header |= {"torque_Nm": exact(varied.load)}
    family = OverFigure(axis.name, lambda v: varied.system((v,)), frequency, limits)
    finder = BranchFinder(family, limits, settings or BranchSettings())
    result = BranchesResult(varied.gear_set, system, header, (), parameter=axis.name)
    known = header | {"over": axis.name} | varied.inputs
    return _followed(result, finder, keeping, known, report)


def _followed(
    result: BranchesResult,
    finder: BranchFinder,
    keeping: Keeping,
    known: dict[str, str],
    report: Progress,
) -> BranchesResult:
    """The result with the branches that are found.

    known : all that determines them, but for the limits and settings of the finder
    """
    low, high = finder.limits

    def watch(number: int, value: float) -> None:
        done = round(100.0 * (value - low) / (high - low))
        report(f"branch {number + 1}, {finder.family.words(value)}", done, 100)

    finder.report, interrupted = watch, True
    checkpoint = keeping.open(known | _numerics(finder))
    try:
        if checkpoint is not None:
            _take_up(finder, checkpoint, keeping)
        finder.find(low)
        interrupted = False
    except KeyboardInterrupt:
        if not finder.found:
            raise
    finally:
        if checkpoint is not None:
            checkpoint.close(keep=interrupted and bool(finder.found))
    header = {**result.header}
    if result.system.contacts is None:
        header["harmonics"] = str(finder.settings.harmonics)
    if finder.settings.steepness is not None:
        header["contact"] = f"closes by tanh, {exact(finder.settings.steepness)} per m"
    if interrupted:
        header["incomplete"] = f"{len(finder.found)} branches before it was interrupted"
    found = tuple(finder.found)
    return replace(result, header=header, branches=found, interrupted=interrupted)


def _numerics(finder: BranchFinder) -> dict[str, str]:
    """Limits and settings, part of what a checkpoint must agree with."""
    limits = {"limits": ":".join(map(repr, finder.limits))}
    return limits | {name: repr(v) for name, v in asdict(finder.settings).items()}


def _take_up(finder: BranchFinder, checkpoint: Checkpoint, keeping: Keeping) -> None:
    """Go on from the branches that are kept, and keep what is found."""
    finder.finished += map(read_branch, checkpoint.finished(BRANCHES))
    finder.keep = lambda branch: checkpoint.add(BRANCHES, plain_branch(branch), {})
    if keeping.resume:
        count = len(finder.finished)
        keeping.tell(f"{checkpoint.path}: branches that are finished: {count}")


def _plain(branch: PeriodicBranch, over: str, stepped: bool) -> dict[str, Any]:
    values = [point.parameter for point in branch.points]
    levels = np.array([point.figures["dte_rms"] for point in branch.points])
    low, high = ("from_Hz", "to_Hz") if over == MESH_FREQUENCY else ("from", "to")
    return {
        "period_multiple": branch.multiple,
        "points": len(branch.points),
        "stable_points": sum(point.stable for point in branch.points),
        low: min(values),
        high: max(values),
        "largest_dte_rms_m": levels.max(axis=0).tolist(),
        "relative_error_of_rms": None if isnan(branch.error) else branch.error,
        "origin": branch.origin,
        "end": branch.reason,
        "closed": branch.closed,
        "bifurcations": [
            _bifurcation(point, over, stepped) for point in branch.bifurcations
        ],
    }


def _bifurcation(point: BranchPoint, over: str, stepped: bool) -> dict[str, Any]:
    rms = point.figures["dte_rms"].tolist()
    name = "frequency_Hz" if over == MESH_FREQUENCY else "value"
    by = STEPPED if stepped else SCHEME
    by = by if isnan(point.located) else "shooting"
    place = {name: point.place, "located_by": by}
    return {"kind": point.kind, **place, "dte_rms_m": rms}
