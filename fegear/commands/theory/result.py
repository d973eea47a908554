"""The result of `fegear theory`: its page, tables and figures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fegear.commands.theory.figure import draw_theory
from fegear.files.codes import with_code
from fegear.studies.page import Cell, Columns, Page, RowTable, cell
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.headings import first_frequencies
from fegear.studies.trains.train_problem import TrainFacts
from fegear.train.resonances import natural_frequencies
from lumped.closed_forms import ParametricSystem, Prediction, phase_extremes
from lumped.common.csv_text import format_exact
from lumped.train.system import LumpedSystem

NESTED_KEYS = "excited_by", "meshes", "limits"  # lists in the summary of a resonance

OPTIMAL_RELIEF = (
    "of each tip, driver's and driven gear's, linear from the highest point of "
    "single-tooth contact (HPSTC), on teeth without other relief"
)


@dataclass(frozen=True, eq=False)
class TheoryResult(StudyResult):
    """Predictions for a gear set, frequencies of the first mesh [Hz].

    torque : on the input gear [N m]
    parametric : the lumped system as the closed forms take it
    optimal_reliefs : best tip relief of each mesh [m], None where it is not known
    other_reliefs : of each mesh, those to which it does not apply, in words
    natural_Hz : natural frequencies of modes that strain a mesh [Hz]
    natural : which these are, in words
    """

    study: Any
    facts: TrainFacts
    torque: float
    system: LumpedSystem
    parametric: ParametricSystem
    predictions: tuple[Prediction, ...]
    optimal_reliefs: tuple[float | None, ...]
    other_reliefs: tuple[tuple[str, ...], ...]
    natural_Hz: tuple[float, ...]
    natural: str

    @cached_property
    def summary(self) -> dict[str, Any]:
        """None where there is no such thing."""
        return {
            **self.facts.summary,
            "natural_frequencies": self.natural,
            "natural_frequencies_Hz": list(self.natural_Hz),
            "meshes": [
                self._mesh_values(m) for m in range(len(self.system.excitations))
            ],
            "resonances": [
                self._resonance_values(prediction) for prediction in self.predictions
            ],
            "warnings": list(self.facts.warnings),
        }

    @property
    def table(self) -> Table:
        """A row for every resonance and mesh; a cell without a value is empty."""
        rows = [
            {k: v for k, v in resonance.items() if k not in NESTED_KEYS}
            | mesh
            | {"limits": "; ".join(resonance["limits"])}
            for resonance in self.summary["resonances"]
            for mesh in resonance["meshes"]
        ]
        cells = [[math.nan if v is None else v for v in row.values()] for row in rows]
        table = Table(tuple(rows[0]), lambda: cells, self._header)
        return self.facts.with_driver_speed(table)

    @property
    def _header(self) -> dict[str, str]:
        edits = self.study.gear_set.entries
        return {**self.facts.header, **self._relief_entries, **edits}

    @property
    def _relief_entries(self) -> dict[str, str]:
        """Best relief of each mesh that has one, and what it is."""
        best = [
            f"mesh {row['mesh']} {format_exact(row['optimal_tip_relief_m'])} m"
            for row in self.summary["meshes"]
            if row["optimal_tip_relief_m"] is not None
        ]
        if not best:
            return {}
        return {"best tip relief": f"{', '.join(best)}; {OPTIMAL_RELIEF}"}

    @property
    def figures(self) -> dict[str, Draw]:
        """Frequency response by the closed forms, a panel for each mesh."""
        values, meshes = self.summary, self.parametric.stiffness.size
        title = (
            f"{values['gear_set']} by closed forms, {values['torque_Nm']:g} N m, model "
            f"{values['model']}, {values['excitation']}, damping ratio "
            f"{values['damping_ratio']:g}"
        )
        return {"plot": lambda: draw_theory(self.predictions, meshes, title)}

    def _mesh_values(self, mesh: int) -> dict[str, Any]:
        parametric = self.parametric
        first = 2.0 * abs(parametric.stiffness_harmonics[mesh, 0])
        return {
            "mesh": mesh + 1,
            "mean_stiffness_N_per_m": float(parametric.stiffness[mesh]),
            "first_harmonic_over_mean": float(first),
            "mean_deflection_m": float(parametric.deflection[mesh]),
            "optimal_tip_relief_m": self.optimal_reliefs[mesh],
            "optimal_tip_relief_is": OPTIMAL_RELIEF,
            "other_reliefs": list(self.other_reliefs[mesh]),
        }

    def _resonance_values(self, prediction: Prediction) -> dict[str, Any]:
        resonance, peak = prediction.resonance, prediction.top
        low, high = prediction.unstable or (None, None)
        meshes = range(resonance.shapes.size)
        return {
            "resonance": _excitation_in_words(prediction.kinds),
            "excited_by": [
                {"mesh": mesh + 1, "as": kind}
                for mesh, kind in prediction.kinds.items()
            ],
            "mesh_frequency_Hz": resonance.at,
            "natural_frequency_Hz": resonance.frequency,
            "peak_frequency_Hz": None if peak is None else peak.frequency,
            "unstable_from_Hz": low,
            "unstable_to_Hz": high,
            "damping_ratio_without_instability": prediction.critical_damping,
            "meshes": [self._values_on_mesh(prediction, mesh) for mesh in meshes],
            "limits": list(prediction.limits),
        }

    def _values_on_mesh(self, prediction: Prediction, mesh: int) -> dict[str, Any]:
        resonance, peak = prediction.resonance, prediction.top
        rms = angle = None
        if peak is not None:
            rms = float(resonance.amplitudes(peak.amplitude)[mesh]) / math.sqrt(2.0)
            angle = float(peak.separation[mesh])
        begin, end = prediction.transitions[mesh] or (None, None)
        return {
            "mesh": mesh + 1,
            "dte_rms_m": rms,
            "separation_angle_rad": angle,
            "contact_lost_from_Hz": begin,
            "contact_lost_to_Hz": end,
            **self._least_drive(prediction, mesh),
        }

    def _least_drive(self, prediction: Prediction, mesh: int) -> dict[str, Any]:
        """Phase of a mesh at which meshes drive least, and that drive over the present.

        None for the first mesh (phase reference), one that drives alone or not at all,
        or by second-order products with other phases.
        """
        no_values = {"phase_of_least_drive": None, "least_drive_over_drive": None}
        kind, resonance = prediction.kinds.get(mesh), prediction.resonance
        if mesh == 0 or kind not in ("fundamental", "subharmonic"):
            return no_values
        by_mesh = (
            resonance.driven_by if kind == "fundamental" else resonance.parametric_by
        )
        amplitude, present_drive = abs(by_mesh[mesh]), abs(by_mesh.sum())
        if not (
            amplitude > 0.0 and present_drive > 0.0 and np.count_nonzero(by_mesh) > 1
        ):
            return no_values
        extremes = phase_extremes(by_mesh, mesh, 1)
        phase = self.system.train.meshes[mesh].phase - extremes.at_least
        return {
            "phase_of_least_drive": phase % 1.0,
            "least_drive_over_drive": extremes.least / present_drive,
        }

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield (
            f"{values['gear_set']} by closed forms, {values['torque_Nm']:g} N m, model "
            f"{values['model']}, {values['excitation']}, damping ratio "
            f"{values['damping_ratio']:g}; mesh frequencies are those of the first "
            "mesh\n"
            f"natural frequencies {self.natural} that strain a mesh [Hz]: "
            f"{first_frequencies(self.natural_Hz)}"
        )
        if self.natural_Hz != tuple(natural_frequencies(self.system)):
            averages = first_frequencies(natural_frequencies(self.system))
            yield (
                f"closed forms are about the averages of model {values['model']} "
                f"[Hz]: {averages}"
            )
        yield RowTable(values["meshes"], MESH_COLUMNS, "Meshes", text_columns=())
        if any(row["optimal_tip_relief_m"] is not None for row in values["meshes"]):
            yield f"best tip relief: {OPTIMAL_RELIEF}"
            for row in values["meshes"]:
                for line in row["other_reliefs"]:
                    yield f"not so in the gear set, mesh {row['mesh']}: {line}"
        rows = list(_page_rows(values["resonances"]))
        direct_rows = [row for row in rows if "subharmonic" not in row["resonance"]]
        subharmonic_rows = [row for row in rows if "subharmonic" in row["resonance"]]
        phase_rows = [row for row in rows if row["phase_of_least_drive"] is not None]
        for columns, chosen_rows, title in (
            (PEAK_COLUMNS, direct_rows, "Peaks"),
            (SUBHARMONIC_COLUMNS, subharmonic_rows, "Subharmonics"),
            (PHASE_COLUMNS, phase_rows, "Mesh phases of least excitation"),
        ):
            if chosen_rows:
                yield RowTable(chosen_rows, columns, title)
        for resonance in values["resonances"]:
            for limit in resonance["limits"]:
                yield with_code(
                    "E19",
                    f"range left, {resonance['resonance']} at "
                    f"{resonance['mesh_frequency_Hz']:.6g} Hz: {limit}",
                )


def _excitation_in_words(kinds: Mapping[int, str]) -> str:
    """`fundamental of meshes 1 and 2`."""
    unique = dict.fromkeys(kinds.values())
    return ", ".join(f"{kind} of {_numbers_in_words(kinds, kind)}" for kind in unique)


def _numbers_in_words(kinds: Mapping[int, str], kind: str) -> str:
    numbers = [str(mesh + 1) for mesh, mesh_kind in kinds.items() if mesh_kind == kind]
    return ("mesh " if len(numbers) == 1 else "meshes ") + " and ".join(numbers)


def _page_rows(resonances: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """One for every resonance and mesh; the first one of each names the resonance."""
    for resonance in resonances:
        kinds = [entry["as"] for entry in resonance["excited_by"]]
        meshes = [str(entry["mesh"]) for entry in resonance["excited_by"]]
        resonance_cells = {"kind": "\n".join(kinds), "exciting": "\n".join(meshes)}
        if len(set(kinds)) == 1:
            resonance_cells = {"kind": kinds[0], "exciting": ", ".join(meshes)}
        resonance_cells["at"] = f"{resonance['mesh_frequency_Hz']:.5g}"
        for mesh in resonance["meshes"]:
            yield resonance | mesh | resonance_cells
            resonance_cells = dict.fromkeys(resonance_cells, "")


def _range_cell(low: str, high: str) -> Cell:
    return lambda row: "-" if row[low] is None else f"{row[low]:.4g} - {row[high]:.4g}"


MESH_COLUMNS: Columns = {
    "mesh": lambda row: str(row["mesh"]),
    "mean stiffness\n[N/m]": cell("mean_stiffness_N_per_m", 5),
    "first harmonic\nover mean": cell("first_harmonic_over_mean", 3),
    "mean deflection\n[um]": cell("mean_deflection_m", 4, 1e6),
    "best relief of\neach tip [um]": cell("optimal_tip_relief_m", 4, 1e6, none="-"),
}

RESONANCE_COLUMNS: Columns = {
    "resonance": lambda row: str(row["kind"]),
    "excited\nby mesh": lambda row: str(row["exciting"]),
    "at\n[Hz]": lambda row: str(row["at"]),
    "mesh": lambda row: str(row["mesh"]),
}

PHASE_COLUMNS: Columns = {
    "resonance": lambda row: str(row["resonance"]).partition(" of ")[0],
    "at\n[Hz]": lambda row: f"{row['mesh_frequency_Hz']:.5g}",
    "mesh": lambda row: str(row["mesh"]),
    "phase\n[base pitches]": cell("phase_of_least_drive", 3, none="-"),
    "excitation\nover now": cell("least_drive_over_drive", 3, none="-"),
}

PEAK_COLUMNS: Columns = RESONANCE_COLUMNS | {
    "peak\nat [Hz]": cell("peak_frequency_Hz", none="-"),
    "RMS of\nDTE [um]": cell("dte_rms_m", 4, 1e6, none="-"),
    "angle\n[rad]": cell("separation_angle_rad", 3, none="-"),
    "contact lost\n[Hz]": _range_cell("contact_lost_from_Hz", "contact_lost_to_Hz"),
}

SUBHARMONIC_COLUMNS: Columns = RESONANCE_COLUMNS | {
    "unstable\n[Hz]": _range_cell("unstable_from_Hz", "unstable_to_Hz"),
    "contact lost\n[Hz]": _range_cell("contact_lost_from_Hz", "contact_lost_to_Hz"),
    "gone from\ndamping": cell("damping_ratio_without_instability", 3, none="-"),
}
