"""What drives a mesh of a gear set: from finite elements, or from key figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from fegear.contact.problem import OpenContact
from fegear.files.errors import InputError
from fegear.gearset.faults.checks import require_no_faults, without_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS, FaultKind
from fegear.gearset.leads import require_no_width_gap
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import (
    missing_pair_gaps,
    tooth_pair_errors,
    without_pitch_errors,
)
from fegear.gearset.unmodified import has_faults, unmodified, without_relief
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.gap_points import gap_points
from fegear.statics.inputs import statics_inputs
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.excitation import MeshExcitation, with_more_gaps
from lumped.train.excitation_tables import excitation_from_table, repeat_table
from lumped.train.table import MeshTable, pair_names, pair_teeth

if TYPE_CHECKING:
    from fegear.statics.mesh_result import StaticsResult
    from fegear.statics.settings import StaticsSettings

STIFFNESS = "stiffness_N_per_m"
MAX_TABLES = 128  # solved ones that are kept for further use
# faults that move flanks apart and leave tooth pairs as stiff as they are
GAP_FAULTS: tuple[FaultKind, ...] = ("worn", "eccentricity")
MISSING: tuple[FaultKind, ...] = ("missing",)


class ExcitationSource(Protocol):
    """Excitations of meshes by their index, at a torque on their drivers [N m]."""

    def mesh_excitation(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation: ...


@dataclass(frozen=True)
class Excitations:
    """Excitations of gear sets' meshes; the tables used last are solved once each."""

    settings: ExcitationSettings = field(default_factory=ExcitationSettings)
    _results: dict[tuple[object, ...], StaticsResult] = field(default_factory=dict)

    @property
    def statics(self) -> StaticsSettings:
        """How the finite elements solve a table."""
        return self.settings.statics

    def mesh_excitation(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        """Excitation of a mesh by its index, at a torque on its driver [N m]."""
        if self.settings.kind == "fe":
            return self._excitation_from_tables(gear_set, mesh, torque, model)
        return self._excitation_from_figures(gear_set, mesh, torque, model)

    def require_mesh(self, gear_set: GearSet, mesh: int) -> None:
        """Raise InputError for a mesh that has no excitation, before it is solved."""
        from fegear.statics.contact_problem import require_solvable

        solved_set = gear_set
        if self.settings.kind != "fe":
            self._require_figures(gear_set, mesh)
            solved_set = unmodified(gear_set, mesh)
        if self.settings.solves_elements(gear_set):
            settings = self.settings.statics_of(solved_set)
            require_solvable(solved_set, mesh, settings)

    def _require_figures(self, gear_set: GearSet, mesh: int) -> None:
        """Refuse what a stiffness from key figures does not have."""
        task = f"{self.settings.kind} stiffness"
        require_no_faults(gear_set, FAULT_KINDS, task)
        require_no_width_gap(gear_set, mesh, task)
        if self.settings.kind != "fourier":
            return
        for feature, entries in (
            ("a profile modification", gap_points(gear_set.meshes[mesh])),
            ("pitch errors", tooth_pair_errors(gear_set, mesh)),
        ):
            if len(entries):
                raise InputError(
                    f"mesh {mesh + 1} has {feature}; excitation fourier "
                    "represents the complete mesh and has none"
                )

    def mean_stiffness(self, gear_set: GearSet, mesh: int, torque: float) -> float:
        """The gear set's own figure [N/m], or the mean of the unmodified teeth."""
        stiffness = gear_set.meshes[mesh].mean_stiffness
        if stiffness is not None:
            return stiffness
        table = self.table(unmodified(gear_set, mesh), mesh, torque)
        return float(table["stiffness_N_per_m"].mean())

    def table(self, gear_set: GearSet, mesh: int, torque: float) -> MeshTable:
        """The mesh table at one torque on the driver [N m].

        With pitch errors or faults it continues until the tooth pairs repeat.
        """
        return self._statics_result(gear_set, mesh, torque).table

    def _statics_result(
        self, gear_set: GearSet, mesh: int, torque: float, positions: int | None = None
    ) -> StaticsResult:
        """Statics of a mesh; positions : of a base pitch, if not as usual."""
        settings = self.settings.statics_of(gear_set)
        settings = replace(settings, positions=positions or settings.positions)
        # what is not in the key is not in what is solved
        inputs = statics_inputs(gear_set, mesh)
        key = (inputs, mesh, torque, settings)
        result = self._results.pop(key, None)
        if result is None:
            result = self._solve_statics(inputs, mesh, torque, settings)
        self._results[key] = result  # the one used last is the last to be dropped
        while len(self._results) > MAX_TABLES:
            del self._results[next(iter(self._results))]
        return result

    def _solve_statics(
        self, gear_set: GearSet, mesh: int, torque: float, settings: StaticsSettings
    ) -> StaticsResult:
        from fegear.statics.solving import mesh_statics

        if not torque > 0.0:
            raise InputError(
                f"torque = {torque:g} N m on mesh {mesh + 1}; finite-element tables "
                "need a load; rectangular stiffness of a sweep does not"
            )
        return mesh_statics(gear_set, mesh, [torque], settings)

    def _excitation_from_tables(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        if model == 1:
            try:
                return self._excitation_of_pairs(gear_set, mesh, torque)
            except OpenContact:
                return self._excitation_with_gaps(gear_set, mesh, torque)
        table = self.table(gear_set, mesh, torque)
        # pairs that differ share less of the load: the stiffness of Model-3 varies
        plain_set = (without_relief if model == 3 else unmodified)(gear_set, mesh)
        stiffness = self.table(plain_set, mesh, torque)
        return excitation_from_table(table, torque, model, stiffness)

    def _excitation_of_pairs(
        self, gear_set: GearSet, mesh: int, torque: float
    ) -> MeshExcitation:
        """Model-1 from tables without pitch errors, with and without relief.

        With pitch errors, a pair that protrudes touches earlier and later than equal
        teeth would, as they do at a torque that presses them on by as much.
        """
        set_without_errors = without_pitch_errors(gear_set)
        plain_set = without_faults(without_relief(set_without_errors, mesh), GAP_FAULTS)
        statics_result = self._statics_result(set_without_errors, mesh, torque)
        stiffness = self._repeated_table(plain_set, mesh, torque, statics_result)
        errors = tooth_pair_errors(gear_set, mesh)
        if errors.size:
            arm = gear_set.meshes[mesh].pair.driver_arm
            mean_stiffness = stiffness[STIFFNESS].mean()
            pressing_torque = 0.5 * arm * float(mean_stiffness * np.ptp(errors))
            stiffness_at_more_torque = self._repeated_table(
                plain_set, mesh, torque + pressing_torque, statics_result
            )
            stiffness = _widen_loaded_range(stiffness, stiffness_at_more_torque)
        # unmodified teeth may touch where those with relief carry no load
        table = _with_gaps(statics_result, pair_teeth(stiffness))
        is_relieved = any(f.is_modified for f in gear_set.meshes[mesh].flanks)
        is_relieved |= has_faults(gear_set, mesh, GAP_FAULTS)
        relief_stiffness = (
            self.settings.relief_stiffness if is_relieved else "unmodified"
        )
        return excitation_from_table(
            table, torque, 1, stiffness, errors, relief_stiffness
        )

    def _excitation_with_gaps(
        self, gear_set: GearSet, mesh: int, torque: float
    ) -> MeshExcitation:
        """Model-1 of gears that fly where no teeth touch, without their corners there.

        Gears without missing teeth, of which those pairs are wide open.
        """
        whole_set = without_faults(gear_set, MISSING)
        excitation = self._excitation_of_pairs(whole_set, mesh, torque)
        gaps = missing_pair_gaps(gear_set, mesh)
        pairs = (
            replace(pair, gap=with_more_gaps(pair.gap, pair.ahead or 0, gaps))
            for pair in excitation.pairs
        )
        return replace(excitation, pairs=tuple(pairs))

    def _repeated_table(
        self,
        plain_set: GearSet,
        mesh: int,
        torque: float,
        repeated_result: StaticsResult,
    ) -> MeshTable:
        """Table at the positions of another, whose tooth pairs repeat later."""
        positions = repeated_result.table.position.size // repeated_result.pitches
        table = self._statics_result(plain_set, mesh, torque, positions).table
        return repeat_table(table, repeated_result.table.position)

    def _excitation_from_figures(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        self._require_figures(gear_set, mesh)
        spec = gear_set.meshes[mesh]
        figures = self.figures(gear_set, mesh, torque)
        force = torque / spec.pair.driver_arm
        harmonics = self.settings.harmonics if self.settings.kind == "fourier" else None
        gap, errors = gap_points(spec), tooth_pair_errors(gear_set, mesh)
        return analytic_excitation(figures, model, gap, force, harmonics, errors)

    def figures(
        self, gear_set: GearSet, mesh: int, torque: float
    ) -> StiffnessParameters:
        """Key figures of a mesh, given or from the table of the unmodified teeth."""
        spec = gear_set.meshes[mesh]
        mean = self.mean_stiffness(gear_set, mesh, torque)
        variation = spec.stiffness_variation
        if variation is None:
            table = self.table(unmodified(gear_set, mesh), mesh, torque)
            variation = float(
                np.ptp(table["stiffness_N_per_m"]) / table["stiffness_N_per_m"].mean()
            )
        start, end = gear_set.engagement(mesh)
        try:
            return StiffnessParameters(
                mean=mean,
                variation=variation,
                contact_ratio=end - start,
                approach=-start,
                load_share=0.5 if spec.load_share is None else spec.load_share,
                ramp=self.settings.ramp if self.settings.kind == "trapezoid" else 0.0,
            )
        except ValueError as error:
            raise InputError(f"mesh {mesh + 1}: {error}") from None


def _with_gaps(statics_result: StaticsResult, teeth: Sequence[int]) -> MeshTable:
    """The table with the gaps of more tooth pairs, which carry no load.

    teeth : base pitches by which they are ahead of the reference pair
    """
    table, cycle = statics_result.table, statics_result.cycle
    tabulated_teeth = pair_teeth(table)
    added_teeth = sorted(set(teeth) & set(cycle.teeth.tolist()) - set(tabulated_teeth))
    columns, labels = (
        dict(table.columns),
        [f"{k:+d}" for k in [*tabulated_teeth, *added_teeth]],
    )
    zeros = np.zeros((table.torque_Nm.size, table.position.size))
    for number, k in enumerate(added_teeth, start=len(tabulated_teeth) + 1):
        gap = cycle.gap[..., cycle.teeth.tolist().index(k)]
        columns |= {
            f"pair{number}_{STIFFNESS}": zeros,
            f"pair{number}_load_share": zeros,
            f"pair{number}_gap_m": np.where(np.isfinite(gap), gap, np.nan),
        }
    pair_labels = " ".join(
        f"pair{i}={label}" for i, label in enumerate(labels, start=1)
    )
    header = {
        k: pair_labels if k.startswith("pairs ahead") else v
        for k, v in table.header.items()
    }
    return MeshTable(table.torque_Nm, table.position, columns, header)


def _widen_loaded_range(nominal_table: MeshTable, wider_table: MeshTable) -> MeshTable:
    """Extend the loaded range of pairs to a higher torque's.

    The load makes contact stiffer; that is taken out, peak over peak.
    """
    pair_stiffnesses = [
        dict(zip(pair_teeth(t), (t[n] for n in pair_names(t, STIFFNESS)), strict=True))
        for t in (nominal_table, wider_table)
    ]
    peaks = [
        max(float(stiffness.max()) for stiffness in table.values())
        for table in pair_stiffnesses
    ]
    columns = dict(wider_table.columns) | {STIFFNESS: nominal_table[STIFFNESS]}
    for k, name in zip(
        pair_teeth(wider_table), pair_names(wider_table, STIFFNESS), strict=True
    ):
        nominal_stiffness = pair_stiffnesses[0].get(k, np.zeros_like(wider_table[name]))
        columns[name] = np.maximum(
            nominal_stiffness, peaks[0] / peaks[1] * wider_table[name]
        )
    return MeshTable(
        nominal_table.torque_Nm, nominal_table.position, columns, wider_table.header
    )
