"""Frequency responses of a gear set by lumped models, and their tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.boundary import public, require_frequencies
from fegear.errors import InputError
from fegear.gearset.model import GearSet
from fegear.headings import friction_of, sliding_of, torque_of
from fegear.lumped_models import (
    LumpedModel,
    body_entries,
    doubts_of_bodies,
    file_header,
    integration_in_words,
    lumped_system,
    natural_frequencies,
    require_method,
    usual_speeds,
)
from fegear.output import write_text
from fegear.result import Result, frame
from fegear.train import input_torques
from fegear.unphysical import doubts_of_meshes
from lumped.checks import require_fields
from lumped.jumps import find_jumps, find_peaks, largest_responses, opposites
from lumped.settings import Settings
from lumped.sweep import Branch, Direction, sweep_all
from lumped.sweep_table import SweepTable, format_sweep, sweep_table

if TYPE_CHECKING:
    from pandas import DataFrame

Progress = Callable[[str, int, int], None]  # (what, done, of how many)
Branches = Sequence[tuple[float, Branch]]  # torque on the input gear [N m], branch
BOTH: tuple[Direction, ...] = ("up", "down")
UNITS = {
    "frequency": "frequency_Hz",
    "frequency_from": "frequency_from_Hz",
    "frequency_to": "frequency_to_Hz",
    "dte_rms": "dte_rms_m",
    "dte_mean": "dte_mean_m",
    "dte_peak": "dte_peak_m",
    "dte_rms_from": "dte_rms_from_m",
    "dte_rms_to": "dte_rms_to_m",
    "force_peak": "force_peak_N",
    "contact_loss": "contact_loss_fraction",
    "back_side": "back_side_fraction",
}


@dataclass(frozen=True, kw_only=True)
class SweepSettings:
    """How a gear set is swept over speed; directions : of the speed, in this order."""

    model: LumpedModel = field(default_factory=LumpedModel)
    integration: Settings = field(default_factory=Settings)
    directions: tuple[Direction, ...] = BOTH

    def __post_init__(self) -> None:
        require_fields(self)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SweepResult(Result):
    """Branches of responses, by lumped models or finite elements.

    model : its name in files and on the screen
    frequencies : asked for, of the first mesh [Hz]
    found : a branch for every torque and direction, in this order
    beside : branches of Model-1, to be shown with those found
    """

    gear_set: GearSet
    model: str
    header: dict[str, str]
    frequencies: Sequence[float]
    found: Branches
    beside: Branches = ()

    @property
    def table(self) -> SweepTable:
        """A row for every speed and mesh, units in the names of the columns."""
        return sweep_table(self.found, self.model, self.header | _gaps(self))

    @property
    def natural(self) -> str:
        """Which natural frequencies are shown."""
        if self.found[0][1].system.contacts is not None:
            return "about the loaded state"
        if self.model in ("1", "2", "3"):
            return "about the mean mesh stiffness"
        return "of model 1"  # beside finite elements

    @property
    def summary(self) -> dict[str, Any]:
        """Peaks, jumps and doubts, plain values ready for JSON."""
        return summarise(self)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table with its header."""
        write_text(path, format_sweep(self.table))

    def to_frame(self) -> DataFrame:
        """The table as a pandas frame; pandas is not installed with this package."""
        return frame([asdict(row) for row in self.table.rows])


@public
def sweep_speeds(
    gear_set: GearSet,
    torques: Sequence[float] = (),
    frequencies: Sequence[float] = (),
    settings: SweepSettings | None = None,
    progress: Progress = lambda what, done, total: None,
) -> SweepResult:
    """Pass through mesh frequencies [Hz], each from where the one before settled.

    torques : on the input gear [N m]; the gear set's load cases if there are none
    frequencies : of the first mesh [Hz]; around the resonances if there are none

    After Ctrl-C branches hold the speeds that were finished and are not complete.
    """
    settings = settings or SweepSettings()
    require_method(settings.model, settings.integration)
    require_frequencies("frequencies", frequencies)
    torques = required_torques(gear_set, torques)
    progress("stiffness", 0, 1)
    excitations = settings.model.excitations
    systems = [
        lumped_system(gear_set, torque, settings.model, excitations, frequencies)
        for torque in torques
    ]
    frequencies = list(frequencies) or usual_speeds(systems[0])
    branches = sweep_all(
        *(systems, frequencies, settings.directions, settings.integration),
        progress,
    )
    words = integration_in_words(
        settings.integration, settings.model.number == "coupled"
    )
    ratio = systems[0].train.damping_ratio
    bodies = body_entries(systems[0], frequencies)
    return SweepResult(
        gear_set=gear_set,
        model=settings.model.name,
        header=file_header(gear_set, settings.model, ratio, words) | bodies,
        frequencies=frequencies,
        found=at_torques(torques, settings.directions, branches),
    )


def required_torques(gear_set: GearSet, given: Sequence[float]) -> tuple[float, ...]:
    """Torques on the input gear [N m]: given, or the gear set's load cases."""
    torques = tuple(given) or input_torques(gear_set)
    if not torques:
        raise InputError(f"torques are missing; {gear_set.name} has no load case")
    return torques


def at_torques(
    torques: Sequence[float], directions: Sequence[Direction], branches: list[Branch]
) -> Branches:
    """Branches with their torques; all directions of a torque follow each other."""
    each = [torque for torque in torques for _ in directions]
    return list(zip(each, branches, strict=True))


def summarise(result: SweepResult) -> dict[str, Any]:
    """Plain values, ready for JSON."""
    header = result.header
    values: dict[str, Any] = {
        "gear_set": header["gear set"],
        "model": result.model,
        "excitation": header["excitation"],
        "damping_ratio": float(header["damping ratio"]),
        "friction_coefficient": friction_of(header),
        "sliding": sliding_of(header),
        "torque_of": torque_of(header),
        "translations": header["translations"] == "yes",
        "body_modes": header.get("body modes"),
        "body_modes_left_out": header.get("body modes left out"),
        "speeds": len(result.frequencies),
        "first_speed_Hz": min(result.frequencies),
        "last_speed_Hz": max(result.frequencies),
        "natural_frequencies": result.natural,
        "natural_frequencies_Hz": natural_frequencies(result.found[0][1].system),
        "branches": _summarise_branches(result.found),
    }
    if result.beside:
        values["model_1_branches"] = _summarise_branches(result.beside)
    found = (*result.found, *result.beside)
    doubts = doubts_of_sweep(result.gear_set, found, result.frequencies)
    return values | {"warnings": list(doubts)}


def _summarise_branches(found: Branches) -> list[dict[str, Any]]:
    others = opposites([branch for _, branch in found])
    return [
        _summarise_branch(torque, branch, other)
        for (torque, branch), other in zip(found, others, strict=True)
    ]


def _summarise_branch(
    torque: float, branch: Branch, other: Branch | None
) -> dict[str, Any]:
    statuses = [str(response.status) for response in branch.responses]

    def named(thing: Any) -> dict[str, Any]:
        return {UNITS.get(name, name): value for name, value in asdict(thing).items()}

    return {
        "torque_Nm": torque,
        "direction": branch.direction,
        "complete": branch.complete,
        "finished_speeds": len(statuses) - statuses.count("diverged"),
        "aperiodic_speeds": statuses.count("aperiodic"),
        "largest": [named(each) for each in largest_responses(branch)],
        "peaks": [named(peak) for peak in find_peaks(branch)],
        "jumps": [named(jump) for jump in find_jumps(branch, other)],
    }


def _gaps(result: SweepResult) -> dict[str, str]:
    """An entry of the header where an end before the end left speeds out."""
    total = len(result.found) * len(result.frequencies)
    done = sum(len(branch.responses) for _, branch in result.found)
    return {"incomplete": f"{done} of {total} speeds"} if done < total else {}


def doubts_of_sweep(
    gear_set: GearSet, found: Branches, speeds: Sequence[float]
) -> Iterator[str]:
    """Where a model leaves out too much, or values cannot be physical.

    speeds : mesh frequencies of the first mesh that were asked for [Hz]
    """
    for system in dict.fromkeys(branch.system for _, branch in found):
        yield from doubts_of_bodies(system, speeds)
    for torque in dict.fromkeys(torque for torque, _ in found):
        responses = [
            response
            for at, branch in found
            for response in branch.responses
            if at == torque and response.status != "diverged"
        ]
        if responses:
            peaks, backs = (
                np.max([getattr(r, name) for r in responses], axis=0)
                for name in ("dte_peak", "back_side")
            )
            where = f" at {torque:g} N m"
            yield from doubts_of_meshes(gear_set.meshes, where, peaks, backs)


def edits_in_words(header: Mapping[str, str]) -> str:
    """`KEY = VALUE, ...` of the entries in a header, for a title."""
    changes = (item for item in header.items() if item[0].startswith("set "))
    return ", ".join(f"{key[4:]} = {value}" for key, value in changes)
