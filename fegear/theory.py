"""Resonances of a gear set by closed forms: what to expect before anything is swept."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.boundary import public
from fegear.errors import InputError
from fegear.excitation import ExcitationSource
from fegear.gearset.model import GearSet
from fegear.lumped_models import LumpedModel, file_header, lumped_system
from fegear.output import write_text
from fegear.result import Result
from fegear.unphysical import doubts_of_meshes
from lumped.closed_forms import (
    ParametricSystem,
    Prediction,
    optimal_relief,
    parametric_system,
    phase_extremes,
    predictions,
)
from lumped.closed_forms.parametric import LEAST_DAMPING
from lumped.csv_text import exact, format_csv
from lumped.excitation import MeshExcitation
from lumped.system import LumpedSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NESTED = "excited_by", "meshes", "limits"  # lists in the summary of a resonance
POSITIONS = 1024  # of a base pitch, for the extremes of the stiffness


@dataclass(frozen=True, eq=False, repr=False)
class Theory(Result):
    """Predictions for a gear set, frequencies of the first mesh [Hz].

    parametric : its lumped system as the closed forms take it
    header : entries of the file
    """

    gear_set: GearSet
    header: Mapping[str, str]
    system: LumpedSystem
    parametric: ParametricSystem
    found: tuple[Prediction, ...]

    @property
    def summary(self) -> dict[str, Any]:
        """Plain values, ready for JSON; None where there is no such thing."""
        header = self.header
        return {
            "gear_set": header["gear set"],
            "model": header["model"],
            "excitation": header["excitation"],
            "damping_ratio": float(header["damping ratio"]),
            "torque_Nm": float(header["torque_Nm"]),
            "meshes": [self._mesh(m) for m in range(len(self.system.excitations))],
            "resonances": [self._resonance(each) for each in self.found],
            "warnings": list(self._doubts()),
        }

    def _doubts(self) -> Iterator[str]:
        """Where mean deflections cannot be physical."""
        rest = np.abs(self.parametric.deflection)
        meshes = self.gear_set.meshes
        yield from doubts_of_meshes(meshes, ", at rest", rest, 0.0 * rest)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write a row for every resonance and mesh; a cell without a value is empty."""
        write_text(path, self.csv())

    def csv(self) -> str:
        """The rows as text."""
        rows = [
            {k: v for k, v in each.items() if k not in NESTED}
            | mesh
            | {"limits": "; ".join(each["limits"])}
            for each in self.summary["resonances"]
            for mesh in each["meshes"]
        ]
        cells = ([math.nan if v is None else v for v in row.values()] for row in rows)
        return format_csv(rows[0] if rows else (), cells, self.header)

    def draw(self) -> Figure:
        """Frequency response by the closed forms, a panel for each mesh."""
        from fegear.theory_figure import draw_theory

        return draw_theory(self)

    def _mesh(self, mesh: int) -> dict[str, Any]:
        known = self.parametric
        first = 2.0 * abs(known.stiffness_harmonics[mesh, 0])
        return {
            "mesh": mesh + 1,
            "mean_stiffness_N_per_m": float(known.stiffness[mesh]),
            "first_harmonic_over_mean": float(first),
            "mean_deflection_m": float(known.deflection[mesh]),
            "optimal_tip_relief_m": self._optimal_relief(mesh),
        }

    def _optimal_relief(self, mesh: int) -> float | None:
        """None where eq. 2.28 has no pairs, or not one and two, that take turns."""
        lowest, highest = _stiffness_range(self.system.excitations[mesh])
        ratio = self.gear_set.meshes[mesh].pair.contact_ratio
        # rounding apart, it takes two pairs to be stiffer, and at most twice as stiff
        if not (1.0 < ratio < 2.0 and lowest * (1.0 + 1e-9) < highest <= 2.0 * lowest):
            return None
        force = float(self.parametric.stiffness[mesh] * self.parametric.elastic[mesh])
        return optimal_relief(force, lowest, highest)

    def _resonance(self, prediction: Prediction) -> dict[str, Any]:
        near, top = prediction.resonance, prediction.top
        low, high = prediction.unstable or (None, None)
        meshes = range(near.shapes.size)
        return {
            "resonance": _in_words(prediction.kinds),
            "excited_by": [
                {"mesh": mesh + 1, "as": kind}
                for mesh, kind in prediction.kinds.items()
            ],
            "mesh_frequency_Hz": near.at,
            "natural_frequency_Hz": near.frequency,
            "peak_frequency_Hz": None if top is None else top.frequency,
            "unstable_from_Hz": low,
            "unstable_to_Hz": high,
            "damping_ratio_without_instability": prediction.critical_damping,
            "meshes": [self._on_mesh(prediction, mesh) for mesh in meshes],
            "limits": list(prediction.limits),
        }

    def _on_mesh(self, prediction: Prediction, mesh: int) -> dict[str, Any]:
        near, top = prediction.resonance, prediction.top
        rms = angle = None
        if top is not None:
            rms = float(near.amplitudes(top.amplitude)[mesh]) / math.sqrt(2.0)
            angle = float(top.separation[mesh])
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
        """The phase of a mesh at which meshes drive least, and how much of now that is.

        None for the first mesh, to which phases are counted, and where it drives alone,
        not at all, or by second-order products that turn in other ways.
        """
        nothing = {"phase_of_least_drive": None, "least_drive_over_drive": None}
        kind, near = prediction.kinds.get(mesh), prediction.resonance
        if mesh == 0 or kind not in ("fundamental", "subharmonic"):
            return nothing
        by_mesh = near.driven_by if kind == "fundamental" else near.parametric_by
        own, now = abs(by_mesh[mesh]), abs(by_mesh.sum())
        if not (own > 0.0 and now > 0.0 and np.count_nonzero(by_mesh) > 1):
            return nothing
        extremes = phase_extremes(by_mesh, mesh, 1)
        phase = self.system.train.meshes[mesh].phase - extremes.at_least
        return {
            "phase_of_least_drive": phase % 1.0,
            "least_drive_over_drive": extremes.least / now,
        }


@public
def predict_resonances(
    gear_set: GearSet,
    torque: float,
    model: LumpedModel | None = None,
    excitations: ExcitationSource | None = None,
) -> Theory:
    """Resonances, lost contact, instabilities and best relief by closed forms.

    First-order multiple scales about the mean mesh stiffness, `lumped.closed_forms`;
    every prediction says where its assumptions are left.

    torque : on the input gear [N m]; it must load the drive flanks of all meshes
    model : 1, 2 or 3; excitations : in place of the model's own
    Raises InputError where the closed forms cannot be: no load, no damping, nothing
    that varies, teeth that differ.
    """
    model = model or LumpedModel()
    if model.number == "coupled":
        raise InputError("model = coupled; closed forms are those of models 1, 2 and 3")
    system = lumped_system(gear_set, torque, model, excitations)
    ratio = system.train.damping_ratio
    if not LEAST_DAMPING <= ratio < 1.0:
        raise InputError(
            f"damping_ratio = {ratio:g}; closed forms need one from {LEAST_DAMPING:g} "
            "to below 1"
        )
    if not (system.static_deflection > 0.0).all():
        raise InputError(
            f"torque = {torque:g}; closed forms need one that loads the drive flanks "
            "of all meshes"
        )
    try:
        parametric = parametric_system(system)
    except ValueError as error:
        raise InputError(f"{gear_set.name}: {error}") from None
    found = predictions(parametric)
    if not found:
        raise InputError(
            f"{gear_set.name}: neither stiffness nor transmission error of a mesh "
            "varies, nothing resonates"
        )
    order = f"closed forms, {parametric.stiffness_harmonics.shape[1]} harmonics"
    header = file_header(gear_set, model, ratio, order) | {
        "model": model.name,
        "torque_Nm": exact(torque),
    }
    return Theory(gear_set, header, system, parametric, found)


def _in_words(kinds: Mapping[int, str]) -> str:
    """`fundamental of meshes 1 and 2`."""
    unique = dict.fromkeys(kinds.values())
    return ", ".join(f"{kind} of {_meshes(kinds, kind)}" for kind in unique)


def _meshes(kinds: Mapping[int, str], kind: str) -> str:
    numbers = [str(mesh + 1) for mesh, each in kinds.items() if each == kind]
    return ("mesh " if len(numbers) == 1 else "meshes ") + " and ".join(numbers)


def _stiffness_range(excitation: MeshExcitation) -> tuple[float, float]:
    """Lowest and highest stiffness of the mesh over its cycle [N/m]."""
    x = (np.arange(POSITIONS) + 0.5) / POSITIONS
    total = np.sum([pair.stiffness(x) for pair in excitation.pairs], axis=0)
    return float(total.min()), float(total.max())
