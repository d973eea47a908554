"""Branches of periodic motions of a gear set over the mesh frequency."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.errors import InputError
from fegear.gearset.model import GearSet
from fegear.lumped_system import LumpedModel, file_header, lumped_system
from fegear.output import write_text
from lumped.branches.bifurcations import BranchPoint
from lumped.branches.figure import draw_branches
from lumped.branches.motions import OverSpeed
from lumped.branches.periodic import BranchFinder, BranchSettings, PeriodicBranch
from lumped.csv_text import format_csv
from lumped.system import LumpedSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fegear.statics import Progress

LEGEND = {
    "branch, index": "counted from 1, points in the order of the branch",
    "mesh_frequency_Hz": "of the first mesh, in all rows",
    "mesh": "counted from 1",
    "dte_rms_m": "dynamic transmission error without its mean",
    "stable": "1 or 0",
    "floquet_max": "modulus of the largest Floquet multiplier",
    "kind": "fold, period doubling, branch point or torus; else empty",
    "period_multiple": "common periods of all meshes after which the motion repeats",
}


@dataclass(frozen=True)
class BranchRow:
    """One mesh at one point; the fields are the columns of the file."""

    branch: int
    index: int
    mesh_frequency_Hz: float
    mesh: int
    dte_rms_m: float
    dte_peak_m: float
    stable: int
    floquet_max: float
    kind: str
    period_multiple: int


@dataclass(frozen=True, eq=False)
class BranchesResult:
    """Branches of a gear set, and the header of their file."""

    system: LumpedSystem
    header: Mapping[str, str]
    branches: tuple[PeriodicBranch, ...]
    interrupted: bool = False

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write a row for each point and mesh."""
        write_text(path, self.csv())

    def csv(self) -> str:
        """The rows as text."""
        names = [column.name for column in fields(BranchRow)]
        rows = ([getattr(row, name) for name in names] for row in self.rows())
        return format_csv(names, rows, {**self.header, **LEGEND})

    def rows(self) -> Iterator[BranchRow]:
        for number, branch in enumerate(self.branches, start=1):
            for index, point in enumerate(branch.points, start=1):
                for m in range(len(self.system.excitations)):
                    yield BranchRow(
                        branch=number,
                        index=index,
                        mesh_frequency_Hz=point.frequency,
                        mesh=m + 1,
                        dte_rms_m=float(point.figures["dte_rms"][m]),
                        dte_peak_m=float(point.figures["dte_peak"][m]),
                        stable=int(point.stable),
                        floquet_max=point.largest,
                        kind=point.kind,
                        period_multiple=branch.multiple,
                    )

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            "gear_set": self.header["gear set"],
            "model": self.header["model"],
            "excitation": self.header["excitation"],
            "torque_Nm": float(self.header["torque_Nm"]),
            "damping_ratio": float(self.header["damping ratio"]),
            "harmonics": int(self.header["harmonics"]),
            "natural_frequencies_Hz": self.system.resonances_Hz.tolist(),
            "interrupted": self.interrupted,
            "branches": [_plain(branch) for branch in self.branches],
        }

    def draw(self) -> Figure:
        header = self.header
        title = (
            f"{header['gear set']} at {header['torque_Nm']} N m, model "
            f"{header['model']}, {header['excitation']}, damping ratio "
            f"{header['damping ratio']}, {header['harmonics']} harmonics"
        )
        return draw_branches(self.system, self.branches, title)


def find_branches(
    gear_set: GearSet,
    torque: float,
    limits: tuple[float, float],
    model: LumpedModel,
    settings: BranchSettings | None = None,
    report: Progress = lambda what, done, total: None,
) -> BranchesResult:
    """All branches that a start at rest, sweeps and period doublings lead to.

    torque : on the input gear [N m]
    limits : mesh frequencies of the first mesh [Hz] between which they are followed
    After KeyboardInterrupt the result holds those that were finished.
    Raises InputError, TrainError where the motion's period is too long, and
    ArithmeticError where no motion is found to begin with.
    """
    settings = settings or BranchSettings()
    low, high = limits
    if not 0.0 < low < high:
        raise InputError(
            f"speeds = {low:g}:{high:g}; the first must be positive and below the last"
        )
    system = lumped_system(gear_set, torque, model)

    def watch(number: int, frequency: float) -> None:
        done = round(100.0 * (frequency - low) / (high - low))
        report(f"branch {number + 1}, {frequency:.0f} Hz", done, 100)

    finder = BranchFinder(OverSpeed(system), limits, settings, watch)
    try:
        finder.from_rest(low)
        finder.doublings()
        finder.from_sweeps()
        finder.doublings()
        interrupted = False
    except KeyboardInterrupt:
        if not finder.found:
            raise
        interrupted = True
    words = f"harmonic balance, {settings.harmonics} harmonics of the first mesh"
    ratio = system.train.damping_ratio
    header = file_header(gear_set, model, ratio, words) | {
        "model": model.name,
        "torque_Nm": f"{torque:g}",
        "harmonics": str(settings.harmonics),
    }
    if interrupted:
        header["incomplete"] = f"{len(finder.found)} branches before it was interrupted"
    return BranchesResult(system, header, tuple(finder.found), interrupted)


def _plain(branch: PeriodicBranch) -> dict[str, Any]:
    frequencies = [point.frequency for point in branch.points]
    levels = np.array([point.figures["dte_rms"] for point in branch.points])
    return {
        "period_multiple": branch.multiple,
        "points": len(branch.points),
        "stable_points": sum(point.stable for point in branch.points),
        "from_Hz": min(frequencies),
        "to_Hz": max(frequencies),
        "largest_dte_rms_m": levels.max(axis=0).tolist(),
        "origin": branch.origin,
        "end": branch.reason,
        "closed": branch.closed,
        "bifurcations": [_bifurcation(point) for point in branch.bifurcations],
    }


def _bifurcation(point: BranchPoint) -> dict[str, Any]:
    rms = point.figures["dte_rms"].tolist()
    return {"kind": point.kind, "frequency_Hz": point.frequency, "dte_rms_m": rms}
