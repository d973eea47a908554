"""What drives a mesh of a gear set: from finite elements, or from key figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset.faults.checks import require_no_faults, without_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS, FaultKind
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import (
    mesh_errors,
    tooth_pair_errors,
    without_pitch_errors,
)
from fegear.gearset.unmodified import has_faults, unmodified, without_relief
from fegear.statics.gap_points import gap_points
from fegear.statics.stiffness_source import StiffnessSource
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.excitation import MeshExcitation
from lumped.train.excitation_tables import excitation_from_table, repeat_table
from lumped.train.table import MeshTable, pair_names, pair_teeth

if TYPE_CHECKING:
    from fegear.statics.mesh_result import StaticsResult
    from fegear.statics.settings import StaticsSettings

STIFFNESS = "stiffness_N_per_m"
MAX_TABLES = 128  # solved ones that are kept for further use
# faults that move flanks apart and leave tooth pairs as stiff as they are
GAP_FAULTS: tuple[FaultKind, ...] = ("worn", "eccentricity")


class ExcitationSource(Protocol):
    """Excitations of meshes by their index, at a torque on their drivers [N m]."""

    def mesh_excitation(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation: ...


@dataclass(frozen=True)
class Excitations:
    """Excitations of gear sets' meshes; the tables used last are solved once each."""

    source: StiffnessSource = field(default_factory=StiffnessSource)
    _results: dict[tuple[object, ...], StaticsResult] = field(default_factory=dict)

    @property
    def statics(self) -> StaticsSettings:
        """How the finite elements solve a table."""
        return self.source.statics

    def mesh_excitation(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        """Excitation of a mesh by its index, at a torque on its driver [N m]."""
        if self.source.kind == "fe":
            return self._from_tables(gear_set, mesh, torque, model)
        return self._from_figures(gear_set, mesh, torque, model)

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
        return self._statics_of(gear_set, mesh, torque).table

    def _statics_of(
        self, gear_set: GearSet, mesh: int, torque: float, positions: int | None = None
    ) -> StaticsResult:
        """Statics of a mesh; positions : of a base pitch, if not as usual."""
        spec = gear_set.meshes[mesh]
        errors = mesh_errors(gear_set, mesh)
        gears = tuple(gear_set.gears[i] for i in (spec.driver, spec.driven))
        flanks = spec.flanks
        settings = self.source.statics_of(gear_set, mesh)
        settings = replace(settings, positions=positions or settings.positions)
        place = _place_of(gear_set, mesh) if has_faults(gear_set, mesh) else None
        key = (spec.pair, gears, flanks, errors, torque, settings.positions, place)
        result = self._results.pop(key, None)
        if result is None:
            result = self._solved(gear_set, mesh, torque, settings)
        self._results[key] = result  # the one used last is the last to be dropped
        while len(self._results) > MAX_TABLES:
            del self._results[next(iter(self._results))]
        return result

    def _solved(
        self, gear_set: GearSet, mesh: int, torque: float, settings: StaticsSettings
    ) -> StaticsResult:
        from fegear.statics.solving import solve_mesh

        if not torque > 0.0:
            raise InputError(
                f"torque = {torque:g} N m on mesh {mesh + 1}; finite-element tables "
                "need a load; rectangular stiffness of a sweep does not"
            )
        return solve_mesh(gear_set, mesh, [torque], settings)

    def _from_tables(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        if model == 1:
            return self._of_pairs(gear_set, mesh, torque)
        table = self.table(gear_set, mesh, torque)
        # pairs that differ share less of the load: the stiffness of Model-3 varies
        plain = (without_relief if model == 3 else unmodified)(gear_set, mesh)
        stiffness = self.table(plain, mesh, torque)
        return excitation_from_table(table, torque, model, stiffness)

    def _of_pairs(self, gear_set: GearSet, mesh: int, torque: float) -> MeshExcitation:
        """Model-1 from tables without pitch errors, with and without relief.

        With pitch errors, a pair that protrudes touches earlier and later than equal
        teeth would, as they do at a torque that presses them on by as much.
        """
        equal = without_pitch_errors(gear_set)
        plain = without_faults(without_relief(equal, mesh), GAP_FAULTS)
        solved = self._statics_of(equal, mesh, torque)
        stiffness = self._repeated(plain, mesh, torque, solved)
        errors = tooth_pair_errors(gear_set, mesh)
        if errors.size:
            arm = gear_set.meshes[mesh].pair.driver_arm
            mean = stiffness[STIFFNESS].mean()
            press = 0.5 * arm * float(mean * np.ptp(errors))
            wide = self._repeated(plain, mesh, torque + press, solved)
            stiffness = _widened(stiffness, wide)
        # unmodified teeth may touch where those with relief carry no load
        table = _with_gaps(solved, pair_teeth(stiffness))
        relieved = any(f.is_modified for f in gear_set.meshes[mesh].flanks)
        relieved |= has_faults(gear_set, mesh, GAP_FAULTS)
        how = self.source.relief_stiffness if relieved else "unmodified"
        return excitation_from_table(table, torque, 1, stiffness, errors, how)

    def _repeated(
        self, plain: GearSet, mesh: int, torque: float, like: StaticsResult
    ) -> MeshTable:
        """Table at the positions of another, whose tooth pairs repeat later."""
        positions = like.table.position.size // like.pitches
        table = self._statics_of(plain, mesh, torque, positions).table
        return repeat_table(table, like.table.position)

    def _from_figures(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        require_no_faults(gear_set, FAULT_KINDS, f"{self.source.kind} stiffness")
        spec = gear_set.meshes[mesh]
        figures = self.figures(gear_set, mesh, torque)
        force = torque / spec.pair.driver_arm
        harmonics = self.source.harmonics if self.source.kind == "fourier" else None
        gap, errors = gap_points(spec), tooth_pair_errors(gear_set, mesh)
        for feature, there in (
            ("a profile modification", gap),
            ("pitch errors", errors),
        ):
            if harmonics and len(there):
                raise InputError(
                    f"mesh {mesh + 1} has {feature}; excitation fourier "
                    "represents the complete mesh and has none"
                )
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
        pair = spec.pair
        try:
            return StiffnessParameters(
                mean=mean,
                variation=variation,
                contact_ratio=pair.contact_ratio,
                approach=-pair.path[0],
                load_share=0.5 if spec.load_share is None else spec.load_share,
                ramp=self.source.ramp if self.source.kind == "trapezoid" else 0.0,
            )
        except ValueError as error:
            raise InputError(f"mesh {mesh + 1}: {error}") from None


def _with_gaps(solved: StaticsResult, teeth: Sequence[int]) -> MeshTable:
    """The table with the gaps of more tooth pairs, which carry no load.

    teeth : base pitches by which they are ahead of the reference pair
    """
    table, cycle = solved.table, solved.cycle
    tabulated = pair_teeth(table)
    more = sorted(set(teeth) & set(cycle.teeth.tolist()) - set(tabulated))
    columns, labels = dict(table.columns), [f"{k:+d}" for k in [*tabulated, *more]]
    none = np.zeros((table.torque_Nm.size, table.position.size))
    for number, k in enumerate(more, start=len(tabulated) + 1):
        gap = cycle.gap[..., cycle.teeth.tolist().index(k)]
        columns |= {
            f"pair{number}_{STIFFNESS}": none,
            f"pair{number}_load_share": none,
            f"pair{number}_gap_m": np.where(np.isfinite(gap), gap, np.nan),
        }
    text = " ".join(f"pair{i}={label}" for i, label in enumerate(labels, start=1))
    header = {
        k: text if k.startswith("pairs ahead") else v for k, v in table.header.items()
    }
    return MeshTable(table.torque_Nm, table.position, columns, header)


def _widened(nominal: MeshTable, wide: MeshTable) -> MeshTable:
    """Extend the loaded range of pairs to a higher torque's.

    The load makes contact stiffer; that is taken out, peak over peak.
    """
    tables = [
        dict(zip(pair_teeth(t), (t[n] for n in pair_names(t, STIFFNESS)), strict=True))
        for t in (nominal, wide)
    ]
    peaks = [
        max(float(stiffness.max()) for stiffness in table.values()) for table in tables
    ]
    columns = dict(wide.columns) | {STIFFNESS: nominal[STIFFNESS]}
    for k, name in zip(pair_teeth(wide), pair_names(wide, STIFFNESS), strict=True):
        nominal_stiffness = tables[0].get(k, np.zeros_like(wide[name]))
        columns[name] = np.maximum(nominal_stiffness, peaks[0] / peaks[1] * wide[name])
    return MeshTable(nominal.torque_Nm, nominal.position, columns, wide.header)


def _place_of(gear_set: GearSet, mesh: int) -> tuple[object, ...]:
    """On what it depends in a set which faulty teeth meet, and where centres are."""
    phases = (phase.value for phase in mesh_phases(gear_set))
    return mesh, tuple(phases), tuple(one.direction for one in gear_set.meshes)
