"""What drives a mesh of a gear set: from finite elements, or from key figures."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from fegear.boundary import public
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.printable import printable
from fegear.gearset.faults.checks import require_no_faults, without_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS, FaultKind
from fegear.gearset.model import GearSet
from fegear.gearset.modifications import UNMODIFIED
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import (
    mesh_errors,
    pair_periods,
    tooth_pair_errors,
    without_pitch_errors,
)
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.choices import PLANE, RESOLUTION
from fegear.statics.gap_points import gap_points
from fegear.statics.mesh_table_files import read_mesh_table
from lumped.common.checks import require_fields
from lumped.common.csv_text import format_exact
from lumped.common.options import Range, documented, option
from lumped.train.analytic import StiffnessParameters, analytic_excitation
from lumped.train.excitation import (
    MeshExcitation,
    ReliefStiffness,
    excitation_from_table,
    repeat_table,
    table_pitches,
)
from lumped.train.table import (
    MeshTable,
    TableError,
    pair_names,
    pair_teeth,
)

if TYPE_CHECKING:
    from fegear.statics.mesh_result import StaticsResult
    from fegear.statics.settings import StaticsSettings

Kind = Literal["fe", "rectangular", "trapezoid", "fourier"]
KINDS: tuple[Kind, ...] = ("fe", "rectangular", "trapezoid", "fourier")
STIFFNESS = "stiffness_N_per_m"
MAX_TORQUE_RATIO = 1.5  # over the single torque of a table, or below it
MAX_TABLES = 128  # solved ones that are kept for further use
LONG_POSITIONS = 64  # of a base pitch, at most, where tooth pairs differ
# faults that move flanks apart and leave tooth pairs as stiff as they are
GAP_FAULTS: tuple[FaultKind, ...] = ("worn", "eccentricity")


@documented
@dataclass(frozen=True, kw_only=True)
class StiffnessSource:
    """Source of the mesh stiffness."""

    kind: Kind = option(
        "fe",
        "Mesh stiffness over the mesh cycle. fe: tables solved by finite elements; "
        "rectangular, trapezoid, fourier: built from mean_stiffness_N_per_m, "
        "stiffness_variation and load_share of the gear set; finite elements give what "
        "is missing.",
    )
    ramp: float = option(
        0.1,
        "Length over which the stiffness of {kind} trapezoid rises and falls [base "
        "pitches].",
        Range(0.0, 1.0),
    )
    harmonics: int = option(
        5,
        "Number of harmonics of the mesh frequency that {kind} fourier keeps.",
        Range(1, 1000),
    )
    positions: int = option(
        256,
        "Number of mesh positions per base pitch of a finite-element table.",
        Range(4, 1_000_000),
    )
    resolution: Literal["coarse", "default", "fine"] = option("default", RESOLUTION)
    plane: Literal["stress", "strain"] = option("stress", PLANE)
    corner_contact: bool = option(
        True, "Contact of tip corners before and after the nominal path of contact."
    )
    relief_stiffness: ReliefStiffness = option(
        "own",
        "Stiffness of tooth pairs with relief in model 1. own: that of the relieved "
        "teeth where they carry load at rest; unmodified: that of teeth without "
        "relief, as in the multi-mesh source.",
    )

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def statics(self) -> StaticsSettings:
        """How the finite elements solve a table."""
        from fegear.statics.settings import StaticsSettings

        return StaticsSettings(
            positions=self.positions,
            resolution=self.resolution,
            plane=self.plane,
            corner_contact=self.corner_contact,
            estimate_error=False,
            root_stress=False,
        )

    @property
    def header(self) -> dict[str, str]:
        """Entries of a file's header: what was solved, and how."""
        shape = {
            "fe": "finite elements",
            "trapezoid": f"trapezoid, ramp {format_exact(self.ramp)} base pitches",
            "fourier": f"fourier, {self.harmonics} harmonics",
        }.get(self.kind, self.kind)
        elements: dict[str, str] = {"plane": self.plane}
        elements["resolution"] = self.resolution
        if self.relief_stiffness != "own":
            elements["stiffness of relieved pairs"] = "that of unmodified teeth"
        return {"excitation": shape, **elements}

    def solves_elements(self, gear_set: GearSet) -> bool:
        """Whether finite elements are needed for what the gear set does not give.

        Parameters
        ----------
        gear_set : GearSet
            Gear set whose meshes may give a mean stiffness and its variation.

        Returns
        -------
        bool
            True if a table is solved by finite elements.
        """
        return self.kind == "fe" or any(
            mesh.mean_stiffness is None or mesh.stiffness_variation is None
            for mesh in gear_set.meshes
        )

    def statics_of(self, gear_set: GearSet, mesh: int) -> StaticsSettings:
        """Settings of the statics for a mesh.

        They have fewer positions where the tooth pairs of the mesh differ.

        Parameters
        ----------
        gear_set : GearSet
            Gear set of the mesh.
        mesh : int
            Index of the mesh, from 0.

        Returns
        -------
        StaticsSettings
            Settings for `fegear.solve_mesh`.
        """
        fewer = min(self.positions, LONG_POSITIONS)
        long = pair_periods(gear_set)[mesh] > 1
        return replace(self.statics, positions=fewer) if long else self.statics


class ExcitationSource(Protocol):
    """Excitations of meshes by their index, at a torque on their drivers [N m]."""

    def mesh_excitation(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation: ...


@dataclass(frozen=True)
class GivenTables:
    """Mesh tables read from files, one for each mesh, by the name of the file."""

    tables: tuple[tuple[str, MeshTable], ...]

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def header(self) -> dict[str, str]:
        """Entry of a file's header: the tables."""
        names = ", ".join(Path(name).name for name, _ in self.tables)
        return {"excitation": printable(f"tables {names}")}

    @property
    def statics(self) -> StaticsSettings:
        """Finite elements, in the plane of the tables, for what those do not give."""
        from fegear.statics.settings import StaticsSettings

        strain = all(table.header.get("plane") == "strain" for _, table in self.tables)
        return StaticsSettings(plane="strain" if strain else "stress")

    def mesh_excitation(
        self, gear_set: GearSet, mesh: int, torque: float, model: int
    ) -> MeshExcitation:
        """Excitation of a mesh by its index, at a torque on its driver [N m]."""
        name, table = self.tables[mesh]
        try:
            _require_all_pairs(gear_set, mesh, table)
            return excitation_from_table(table, torque, model)
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None


def table_warnings(
    stiffness: StiffnessSource | GivenTables, gear_set: GearSet, torque: float
) -> Iterator[str]:
    """A line for each mesh table whose torque or friction is not that of the run.

    torque : on the input gear [N m]

    Tables of several torques are interpolated, and refuse torques outside of them.
    """
    if not isinstance(stiffness, GivenTables):
        return
    on_drivers = mesh_torques_at(gear_set, torque)
    for (name, table), on_driver in zip(stiffness.tables, on_drivers, strict=True):
        torques = table.torque_Nm
        low, high = torques[0] / MAX_TORQUE_RATIO, torques[0] * MAX_TORQUE_RATIO
        if torques.size == 1 and not low <= on_driver <= high:
            yield with_code(
                "W10",
                f"{name}: a mesh table of {torques[0]:g} N m alone serves "
                f"{on_driver:.4g} N m on the driver, beyond a factor of "
                f"{MAX_TORQUE_RATIO:g}; stiffness and contact of teeth follow the "
                "torque, a table of several torques is interpolated",
            )
        friction = _friction_of(table)
        if friction:
            yield with_code(
                "W11",
                f"{name}: a mesh table with friction coefficient {friction}, "
                "which its stiffness and transmission error contain already",
            )


def _friction_of(table: MeshTable) -> str:
    """Friction coefficient of the header, empty for none."""
    text = table.header.get("friction coefficient", "")
    try:
        return text if float(text) != 0.0 else ""
    except ValueError:
        return text


@public
def read_mesh_tables(
    paths: Sequence[str | PathLike[str]], gear_set: GearSet
) -> GivenTables:
    """Mesh tables of a gear set from files, one for each mesh in order.

    Parameters
    ----------
    paths : sequence of str or path-like
        Files of mesh tables, as many as the gear set has meshes: CSV, ``.mat``,
        ``.nc``, or HDF5 as ``.h5`` or ``.hdf5``.
    gear_set : GearSet
        Gear set of whose teeth the tables are.

    Returns
    -------
    GivenTables
        Tables, which `LumpedModel` takes as `stiffness`.

    Raises
    ------
    InputError
        If a table is missing, cannot be read, or is of other teeth.
    """
    if len(paths) != len(gear_set.meshes):
        raise InputError(
            f"mesh tables = {len(paths)}; {gear_set.name} has "
            f"{len(gear_set.meshes)} meshes, one for each is needed"
        )
    tables = []
    for mesh, path in enumerate(paths):
        try:
            table = read_mesh_table(str(path))
        except TableError as error:
            raise InputError(str(error)) from None
        _require_own_table(str(path), table, gear_set, mesh)
        tables.append((str(path), table))
    return GivenTables(tuple(tables))


def _require_own_table(
    name: str, table: MeshTable, gear_set: GearSet, mesh: int
) -> None:
    """A table that names its teeth must be of this mesh."""
    pair = gear_set.meshes[mesh].pair
    teeth = f"{pair.driver.teeth} / {pair.driven.teeth}"
    if table.header.get("teeth", teeth) != teeth:
        raise InputError(
            f"{name}: of teeth {table.header['teeth']}, but mesh {mesh + 1} of "
            f"{gear_set.name} has {teeth}"
        )


def _require_all_pairs(gear_set: GearSet, mesh: int, table: MeshTable) -> None:
    """A table describes the teeth as they are, with their pitch errors and faults."""
    covered, faulty = table_pitches(table), has_faults(gear_set, mesh)
    if not (faulty or tooth_pair_errors(gear_set, mesh).size):
        return
    pairs = pair_periods(gear_set)[mesh]
    if covered != pairs:
        cause, keys = "pitch errors", "pitch_errors_um"
        if faulty:
            cause, keys = "faults", "faults"
        raise ValueError(
            f"base pitches = {covered}; tooth pairs of mesh {mesh + 1} repeat after "
            f"{pairs} for their {cause}, a table over all of them is needed, or a "
            f"gear set without {keys}"
        )


def has_faults(
    gear_set: GearSet, mesh: int, kinds: Collection[FaultKind] = FAULT_KINDS
) -> bool:
    """Whether a gear of a mesh has faults of some kinds."""
    gears = gear_set.meshes[mesh].gears
    return any(
        kind in kinds for gear in gears for kind in gear_set.gears[gear].faults.kinds
    )


def _place(gear_set: GearSet, mesh: int) -> tuple[object, ...]:
    """On what it depends in a set which faulty teeth meet, and where centres are."""
    phases = (phase.value for phase in mesh_phases(gear_set))
    return mesh, tuple(phases), tuple(one.direction for one in gear_set.meshes)


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
        place = _place(gear_set, mesh) if has_faults(gear_set, mesh) else None
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


def unmodified(gear_set: GearSet, mesh: int) -> GearSet:
    """The gear set without faults and pitch errors, and a mesh's teeth unrelieved."""
    equal = without_faults(without_pitch_errors(gear_set))
    return without_relief(equal, mesh)


def without_relief(gear_set: GearSet, mesh: int) -> GearSet:
    """The gear set with one mesh's teeth left without profile modification.

    Wear of all teeth alike is one.
    """
    meshes, gears = list(gear_set.meshes), list(gear_set.gears)
    plain = UNMODIFIED
    meshes[mesh] = replace(meshes[mesh], driver_flank=plain, driven_flank=plain)
    for index in meshes[mesh].gears:
        faults = gears[index].faults
        if any(wear.tooth is None for wear in faults.worn):
            single = tuple(wear for wear in faults.worn if wear.tooth is not None)
            faults = replace(faults, worn=single)
            gears[index] = replace(gears[index], faults=faults)
    return replace(gear_set, meshes=tuple(meshes), gears=tuple(gears))
