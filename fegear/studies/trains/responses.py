"""Frequency responses of a gear set, by lumped models and by finite elements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.files.codes import with_code
from fegear.gearset.model import GearSet
from fegear.statics.plausibility import motion_warnings
from fegear.studies.page import Columns, Page, RowTable, cell, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.headings import (
    edits_in_words,
    first_frequencies,
    friction_of_summary,
)
from fegear.studies.trains.model_texts import static_line, truncation_warnings
from fegear.studies.trains.train_problem import TrainFacts
from lumped.figures.sweeps import ResponseCurve, draw_sweep
from lumped.steady.jumps import (
    find_jumps,
    find_peaks,
    largest_responses,
    opposite_branches,
)
from lumped.steady.motion import DivergedError
from lumped.steady.sweep import Branch
from lumped.steady.sweep_table import COLUMNS, sweep_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Branches = Sequence[tuple[float, Branch]]  # torque on the input gear [N m], branch
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


@dataclass(frozen=True, eq=False, kw_only=True)
class ResponsesResult(StudyResult):
    """Branches of responses over speed.

    facts : head of the summary, header, notes and warnings: the train and its model
    frequencies : asked for, of the first mesh [Hz]
    natural_Hz : natural frequencies of modes that strain a mesh, at the first torque
    natural : which these are, in words
    branches : a branch for every torque and direction, in this order
    beside : branches of Model-1, to be shown with those found
    """

    study: Any
    facts: TrainFacts
    frequencies: Sequence[float]
    natural_Hz: tuple[float, ...]
    natural: str
    branches: Branches
    beside: Branches = ()

    @property
    def model(self) -> str:
        """What files and pictures call the model."""
        return str(self.facts.summary["model"])

    @property
    def complete(self) -> bool:
        is_complete = all(branch.complete for _, branch in self.branches)
        return is_complete and not any(branch.interrupted for _, branch in self.beside)

    @property
    def empty(self) -> bool:
        return not any(branch.responses for _, branch in self.branches)

    @property
    def failure(self) -> str:
        """Message with the first motion that diverged."""
        last = [branch.responses[-1] for _, branch in self.branches if branch.responses]
        diverged = [response for response in last if response.status == "diverged"]
        if not diverged:
            return ""
        return str(DivergedError(diverged[0].frequency, diverged[0].settling_time))

    @property
    def table(self) -> Table:
        """A row for every speed and mesh."""
        rows = sweep_table(
            self.branches,
            self.model,
            {**self.facts.header, **self._unfinished_counts()},
        )
        table = Table(
            COLUMNS,
            lambda: ([getattr(row, name) for name in COLUMNS] for row in rows.rows),
            rows.header,
        )
        return self.facts.with_driver_speed(table)

    def _unfinished_counts(self) -> dict[str, str]:
        """An entry of the header where an end before the end left speeds out."""
        total = len(self.branches) * len(self.frequencies)
        done = sum(len(branch.responses) for _, branch in self.branches)
        return {"incomplete": f"{done} of {total} speeds"} if done < total else {}

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Peaks, jumps and warnings."""
        values: dict[str, Any] = {
            **self.facts.summary,
            "speeds": len(self.frequencies),
            "first_speed_Hz": min(self.frequencies),
            "last_speed_Hz": max(self.frequencies),
            "natural_frequencies": self.natural,
            "natural_frequencies_Hz": list(self.natural_Hz),
            "branches": _summarise_branches(self.branches),
        }
        if self.beside:
            values["model_1_branches"] = _summarise_branches(self.beside)
        return values | {"warnings": list(self.facts.warnings)}

    @property
    def title(self) -> str:
        """The gear set, the model and what was changed."""
        facts, edits = self.facts.summary, edits_in_words(self.facts.header)
        return (
            f"{facts['gear_set']}, model {self.model}, {facts['excitation']}, "
            f"damping ratio {facts['damping_ratio']:g}"
            f"{friction_of_summary({**facts, 'torque_of': None})}\n{edits}"
        ).strip()

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._response}

    def _response(self) -> Figure:
        name = self.model if self.beside else ""
        curves = [
            ResponseCurve(torque, branch, name) for torque, branch in self.branches
        ]
        curves += [
            ResponseCurve(torque, branch, "Model-1") for torque, branch in self.beside
        ]
        label = f"natural frequency {self.natural}"
        return draw_sweep(curves, self.title, label, self.natural_Hz)

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        lines = first_frequencies(values["natural_frequencies_Hz"])
        first, last = values["first_speed_Hz"], values["last_speed_Hz"]
        span = f"{first:g} Hz" if first == last else f"{first:g} to {last:g} Hz"
        yield (
            f"{values['gear_set']}, model {values['model']}, {values['excitation']}, "
            f"damping ratio {values['damping_ratio']:g}"
            f"{friction_of_summary(values)}\n"
            f"natural frequencies {values['natural_frequencies']} that strain a mesh "
            f"[Hz]: {lines}\n"
            f"{pluralize(values['speeds'], 'speed')}, {span} of the first mesh"
        )
        if values.get("body_modes") is not None:
            yield with_code(
                "E04",
                f"body modes of the gears {values['body_modes']}; those left out: "
                f"{values['body_modes_left_out']}",
            )
        if values.get("static") and (line := static_line(values)):
            yield line
        yield from _page_of_branches(values["branches"], values["speeds"])
        if "model_1_branches" in values:
            yield "Model 1 for comparison"
            yield from _page_of_branches(values["model_1_branches"], values["speeds"])


def _summarise_branches(branches: Branches) -> list[dict[str, Any]]:
    others = opposite_branches([branch for _, branch in branches])
    return [
        _summarise_branch(torque, branch, other)
        for (torque, branch), other in zip(branches, others, strict=True)
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
        "largest": [named(response) for response in largest_responses(branch)],
        "peaks": [named(peak) for peak in find_peaks(branch)],
        "jumps": [named(jump) for jump in find_jumps(branch, other)],
    }


def sweep_warnings(gear_set: GearSet, branches: Branches) -> Iterator[str]:
    """Warnings where a model leaves out too much, or values cannot be physical."""
    for _, branch in branches:
        yield from truncation_warnings(branch.checks)
    for torque in dict.fromkeys(torque for torque, _ in branches):
        responses = [
            response
            for at, branch in branches
            for response in branch.responses
            if at == torque and response.status != "diverged"
        ]
        if responses:
            peaks, backs = (
                np.max([getattr(r, name) for r in responses], axis=0)
                for name in ("dte_peak", "back_side")
            )
            where = f" at {torque:g} N m"
            yield from motion_warnings(gear_set, where, peaks, backs)


def _page_of_branches(branches: list[dict[str, Any]], speeds: int) -> Page:
    title: str | None = "Peaks"
    kind = "peaks"
    if not any(branch["peaks"] for branch in branches):
        kind, title = "largest", "Largest vibration" if speeds > 1 else None
    responses = [branch | entry for branch in branches for entry in branch[kind]]
    touches_back = any(row["back_side_fraction"] > 0.0 for row in responses)
    columns = RESPONSE | BACK_CONTACT_COLUMN if touches_back else RESPONSE
    yield RowTable(responses, columns, title, WORDS)
    jumps = [branch | jump for branch in branches for jump in branch["jumps"]]
    if jumps:
        yield RowTable(jumps, JUMP, "Jumps", WORDS)
    elif speeds > 1 and any(branch["finished_speeds"] > 1 for branch in branches):
        yield "no jumps"
    for branch in branches:
        name = f"{branch['torque_Nm']:g} N m {branch['direction']}"
        done = branch["finished_speeds"]
        if branch["aperiodic_speeds"]:
            yield (
                f"{name}: the motion did not repeat at {branch['aperiodic_speeds']} "
                f"of {pluralize(done, 'speed')}"
            )
        if not branch["complete"]:
            yield f"{name}: ended after {done} of {pluralize(speeds, 'speed')}"


WORDS = ("direction",)  # columns of text
PLACE: Columns = {
    "torque\n[N m]": lambda row: f"{row['torque_Nm']:g}",
    "direction": lambda row: str(row["direction"]),
    "mesh": lambda row: str(row["mesh"]),
}
RESPONSE: Columns = PLACE | {
    "at\n[Hz]": lambda row: f"{row['frequency_Hz']:.6g}",
    "RMS of\nDTE [um]": cell("dte_rms_m", 4, 1e6),
    "peak\nforce [N]": cell("force_peak_N"),
    "contact\nlost [%]": lambda row: f"{100.0 * row['contact_loss_fraction']:.1f}",
}
BACK_CONTACT_COLUMN: Columns = {
    "back\nside [%]": lambda row: f"{100.0 * row['back_side_fraction']:.1f}",
}
JUMP: Columns = PLACE | {
    "from\n[Hz]": lambda row: f"{row['frequency_from_Hz']:.6g}",
    "to\n[Hz]": lambda row: f"{row['frequency_to_Hz']:.6g}",
    "RMS of DTE\nfrom [um]": cell("dte_rms_from_m", 4, 1e6),
    "to\n[um]": cell("dte_rms_to_m", 4, 1e6),
}
