"""From a gear set to the mesh-stiffness table of one of its meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.boundary import public, require_mesh
from fegear.contact.pair_load_curves import pair_coupling
from fegear.contact.path import (
    contact_diameters,
    loss_factor,
    on_path,
    path_positions,
    roll_angles,
    sliding_over_pitch_speed,
)
from fegear.contact.problem import ContactCycle, ContactProblem, corner_positions
from fegear.contact.solve import solve_cycle
from fegear.contact.tooth_faults import ChangedCompliance
from fegear.contact.virtual_work import largest_deflection, work_on_gaps
from fegear.elasticity.cache import (
    cached_compliance_change,
    cached_flank_compliance,
    cached_root_influence,
)
from fegear.elasticity.flank import FlankCompliance
from fegear.elasticity.material import (
    Plane,
    PlaneMaterial,
    pressure_in_plane,
)
from fegear.elasticity.sector import CyclicSector, cyclic_sector
from fegear.files.errors import InputError
from fegear.files.output import write_text
from fegear.files.timing import recorded_stages, stage
from fegear.files.version import package_version
from fegear.gearset.inertia import inertia_of, require_inertia_of_bodies
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.pitch_errors import mesh_errors, pair_periods
from fegear.result import Result, frame
from fegear.statics.choices import PLANE, RESOLUTION
from fegear.statics.harmonics import Harmonic, mesh_harmonics
from fegear.statics.mesh_faults import faulty_sides
from fegear.statics.root_stress import RootStresses, relative_change, root_stresses
from lumped.common.checks import require_between, require_fields
from lumped.common.csv_text import format_exact
from lumped.common.options import Range, documented, option
from lumped.common.progress import Progress, silent
from lumped.train.table import MeshTable, format_table, pair_compliance_name
from meshes import GearPair, MeshSize
from meshes.crack import Crack

if TYPE_CHECKING:
    from pandas import DataFrame

Array = NDArray[np.float64]
POSITIONS_PER_CHUNK = 2048  # positions solved between two reports of progress
MAX_ROWS = 1_000_000  # of a table


@dataclass(frozen=True)
class Resolution:
    """Mesh of a sector and nodes of a contact patch."""

    size: MeshSize
    nodes: int

    def coarsened(self) -> Resolution:
        """The companion that the discretisation estimate compares with."""
        return Resolution(self.size.refined(0.7), max(9, round(0.7 * self.nodes)))


Fineness = Literal["coarse", "default", "fine"]
RESOLUTIONS: dict[Fineness, Resolution] = {
    "coarse": Resolution(MeshSize().refined(0.7), 17),
    "default": Resolution(MeshSize(), 25),
    "fine": Resolution(MeshSize().refined(1.7), 49),
}


CORNERS = {True: "on", False: "off"}
BODIES = {
    "held": "held at the hub",
    "free": "free to accelerate, transmission errors of mean rotations",
}


@documented
@dataclass(frozen=True, kw_only=True)
class StaticsSettings:
    """How a mesh table is computed by finite elements."""

    positions: int = option(
        64, "Number of mesh positions per base pitch.", Range(1, MAX_ROWS)
    )
    friction: float = option(
        0.0, "Coulomb friction coefficient.", Range(0.0, below=0.5)
    )
    plane: Plane = option("stress", PLANE)
    resolution: Fineness = option("default", RESOLUTION)
    corner_contact: bool = option(
        True, "Contact of tip corners before and after the nominal path of contact."
    )
    body: Literal["held", "free"] = option(
        "held",
        "Support of the gear bodies. held: at their hubs; free: by their inertia "
        "alone, which gives the compliance of gears that vibrate.",
    )
    estimate_error: bool = option(
        True, "Whether the discretisation error is estimated on a coarser mesh."
    )
    root_stress: bool = option(
        True, "Whether the root stress of both gears is computed."
    )

    def __post_init__(self) -> None:
        require_fields(self)

    @property
    def size(self) -> MeshSize:
        """Size of the sector mesh, for everything that is solved on it."""
        return RESOLUTIONS[self.resolution].size

    def material(self, gear: Gear) -> PlaneMaterial:
        """Material of a gear in the plane of the settings.

        Parameters
        ----------
        gear : fegear.gearset.model.Gear
            Gear whose Young's modulus and Poisson's ratio are taken.

        Returns
        -------
        PlaneMaterial
            Elastic constants in plane stress or plane strain.
        """
        return PlaneMaterial(gear.young_modulus, gear.poisson_ratio, self.plane)

    def sector(self, gear: Gear, refinement: float = 1.0) -> CyclicSector:
        """What all finite elements of a gear are made from.

        Parameters
        ----------
        gear : fegear.gearset.model.Gear
            Gear that is meshed.
        refinement : float, optional
            Factor on the fineness of the mesh, finer above 1.

        Returns
        -------
        CyclicSector
            Mesh, stiffness and flanks of one tooth sector.
        """
        size = self.size if refinement == 1.0 else self.size.refined(refinement)
        return cyclic_sector(gear.geometry, self.material(gear), size)


ERROR_FACTOR = 3.5  # estimated error over the change against a coarser resolution
ROOT_ERROR_FACTOR = 2.0  # the same of the root stress


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated relative discretisation error of the transmission error at one torque.

    Attributes
    ----------
    mean : float
        Error of its mean, from the mean of the changes' amounts, whose signs may
        cancel.
    path : float
        Largest error on the nominal path.
    corner : float
        Largest error where a tip corner is in contact, from the largest change of all
        positions, as those are few; NaN where there is none.
    root_stress : float
        Largest error of the root stress of either gear over its peak; NaN where that is
        not computed.

    Notes
    -----
    An error is ERROR_FACTOR times the change against a coarser resolution. With sizes
    in the ratio 0.7, errors of order p are ``0.7^p / (1 - 0.7^p)`` times the change: as
    large at order 2, 2.3 times at order 1, and 3.5 times at order 0.7. On 100 random
    pairs (half with relief) at three torques each, against a mesh 2.4 times as fine as
    the default, the error was at most 2.5 times the change at resolution default and
    3.0 times at coarse, both in corner contact; 1.4 and 2.4 times in the mean. On 20 of
    the pairs it was at most 1.3 times the change at resolution fine.

    The error of the root stress is ROOT_ERROR_FACTOR times its change. On 8 random
    pairs at two torques each, against a mesh 2.4 times as fine as the default, it was
    at most 1.6 times the change, and 0.9 % of the peak.
    """

    mean: float
    path: float
    corner: float
    root_stress: float = math.nan

    @property
    def change_of_mean(self) -> float:
        """Mean change of the transmission error against the coarser resolution."""
        return self.mean / ERROR_FACTOR


@dataclass(frozen=True, repr=False)
class StaticsResult(Result):
    """A mesh table with its evidence.

    Attributes
    ----------
    table : MeshTable
        Columns over torques (t,) on the driver [N m] and positions (n,) [base pitches].
    cycle : ContactCycle
        Loads, gaps and pressures of all tooth pairs, of which the table is made.
    problem : ContactProblem
        Contact problem that was solved, with the compliances of both flanks.
    errors : tuple of ErrorEstimate
        Estimated discretisation error at each torque; empty where it is not estimated.
    seconds : dict of str to float
        Computing time of each stage [s].
    mesh : int
        Index of the mesh, from 0.
    name : str
        Number of the mesh and the names of its gears.
    pitches : int
        Number of base pitches that the table covers, until the tooth pairs repeat.
    """

    table: MeshTable
    cycle: ContactCycle
    problem: ContactProblem
    errors: tuple[ErrorEstimate, ...]
    seconds: dict[str, float]
    mesh: int
    name: str
    pitches: int = 1

    @property
    def error(self) -> ErrorEstimate | None:
        """The largest errors of all torques; None where they are not estimated."""
        return largest_errors(self.errors)

    @property
    def teeth(self) -> str:
        """Numbers of teeth of driver and driven gear."""
        return _teeth(self.problem.pair)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write the table with its header.

        Parameters
        ----------
        path : str or path-like
            CSV file.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        write_text(path, format_table(self.table))

    def to_frame(self) -> DataFrame:
        """The table as a pandas frame; pandas is not installed with this package.

        Returns
        -------
        pandas.DataFrame
            A row for each torque and position, with the columns of `MeshTable.flat`.

        Raises
        ------
        ImportError
            If pandas is missing.
        """
        return frame(self.table.flat)

    def harmonics(
        self, column: str = "ste_m", count: int = 5
    ) -> tuple[tuple[Harmonic, ...], ...]:
        """Harmonics of the mesh frequency in a column of the table.

        Parameters
        ----------
        column : str, optional
            Name of the column, the static transmission error by default.
        count : int, optional
            Number of harmonics; those that the positions do not resolve are left out.

        Returns
        -------
        tuple of tuple of Harmonic
            At each torque the harmonics in rising order, from 1.

        Raises
        ------
        TableError
            If there is no such column.
        """
        return tuple(
            mesh_harmonics(values, count, self.pitches) for values in self.table[column]
        )

    @property
    def loss_factors(self) -> Array:
        """Loss factor H_V of the load sharing at each torque (t,), dimensionless.

        Friction loss over friction coefficient and transmitted power, see
        `fegear.contact.path`.
        """
        pair, cycle = self.problem.pair, self.cycle
        gears = pair.driver, pair.driven
        teeth = tuple(gear.sign * gear.teeth for gear in gears)
        return loss_factor(teeth, path_positions(cycle), cycle.load_share)

    @property
    def reciprocity_error(self) -> float:
        """Largest relative difference of deflections where loads change places."""
        flanks = self.problem.driver, self.problem.driven
        return max(flank.reciprocity_error for flank in flanks)

    @property
    def torque_balance(self) -> float:
        """Largest deviation of T2/T1 from z2/z1, relative."""
        return float(np.abs(self._torque_deviation).max())

    @property
    def work_balance(self) -> float:
        """Deviation of the mean of T2/T1 over the cycle from z2/z1, relative.

        Work that comes in goes out again, but for friction, too few positions and that
        by which deflected flanks tilt, see `fegear.contact.virtual_work`.
        """
        return float(np.abs(self._torque_deviation.mean(axis=1)).max())

    @property
    def virtual_work(self) -> float:
        """Deviation of the mean of T2/T1 from what the gaps give, relative.

        Zero but for friction and too few positions, whatever deflects.
        """
        deviation = self._torque_deviation.mean(axis=1)
        return float(np.abs(deviation - self._gap_work).max())

    @property
    def gap_work(self) -> float:
        """Largest work of the loads on the gaps of the pairs, relative."""
        return float(np.abs(self._gap_work).max())

    @property
    def _gap_work(self) -> Array:
        """Work on the gaps at each torque, see `fegear.contact.virtual_work`."""
        return work_on_gaps(self.cycle, self.problem.pair.base_pitch, self.pitches)

    @property
    def deflection_over_pitch(self) -> float:
        """Largest deflection of a tooth pair over the base pitch.

        An upper bound of `gap_work`, see `fegear.contact.virtual_work`.
        """
        largest = float(largest_deflection(self.cycle).max())
        return largest / self.problem.pair.base_pitch

    @property
    def _torque_deviation(self) -> Array:
        pair = self.problem.pair
        expected = self.cycle.torque[:, None] * pair.driven.teeth / pair.driver.teeth
        return self.cycle.driven_torque / expected - 1.0


@public
def solve_mesh(
    gear_set: GearSet,
    mesh: int = 0,
    torques_on_driver: Sequence[float] = (),
    settings: StaticsSettings | None = None,
    progress: Progress | None = None,
) -> StaticsResult:
    """Mesh table of one mesh at torques on its driver [N m].

    Indices count from 0: mesh 0 is the first one, mesh 1 of commands.

    With pitch errors the table continues until the tooth pairs repeat.

    Parameters
    ----------
    gear_set : GearSet
        Gear set of the mesh.
    mesh : int, optional
        Index of the mesh, from 0.
    torques_on_driver : sequence of float, optional
        Torques on the driver [N m], which differ from each other; the load cases of the
        gear set unless given.
    settings : StaticsSettings, optional
        How the table is computed.
    progress : callable, optional
        Function of (stage, done, total), called during the computation.

    Returns
    -------
    StaticsResult
        Table with its estimated errors.

    Raises
    ------
    InputError
        If there is no such mesh, no torque is known or one is given twice, or the table
        is too long.
    ValueError
        If a torque is not from 0 to below 1e9 N m or an argument is not of its type.

    Examples
    --------
    >>> import fegear
    >>> gears = fegear.load_gear_set("liu-pair", {"mesh.1.tip_relief.magnitude_um": 10})
    >>> table = fegear.solve_mesh(gears, torques_on_driver=[100.0])
    >>> print(f"{table.table['stiffness_N_per_m'].mean():.2e} N/m")
    2.46e+08 N/m
    """
    settings = settings or StaticsSettings()
    report = progress or (silent)
    require_mesh(gear_set, mesh)
    torque = _loads(torques_on_driver, gear_set.meshes[mesh].torques)
    pitches = pair_periods(gear_set)[mesh]
    _require_rows(gear_set, mesh, pitches, settings.positions * torque.size)
    with recorded_stages() as seconds:
        problem = contact_problem(gear_set, mesh, settings, report)
        places = _places(settings.positions, pitches)
        cycle = _solve_in_chunks(problem, torque, places, report)
        stresses = _root_stresses(gear_set, mesh, settings, problem, cycle)
        errors: tuple[ErrorEstimate, ...] = ()
        if settings.estimate_error:
            errors = _estimate(gear_set, mesh, settings, cycle, stresses, report)
    columns = table_columns(problem, cycle, stresses)
    header = table_header(gear_set, mesh, settings, cycle, errors)
    if pitches > 1:
        name = "faults" if _has_faults(gear_set, mesh) else "pitch errors"
        header[name] = (
            f"tooth pairs repeat after {pitches} base pitches; pairs count anew in each"
        )
    else:
        columns |= pair_compliances(problem, cycle)
    table = MeshTable(cycle.torque, cycle.position, columns, header)
    name = _name(gear_set, mesh)
    return StaticsResult(
        table, cycle, problem, errors, dict(seconds), mesh, name, pitches
    )


def _has_faults(gear_set: GearSet, mesh: int) -> bool:
    gears = gear_set.meshes[mesh].gears
    return any(gear_set.gears[gear].faults.any for gear in gears)


def _loads(torques: Sequence[float], cases: Sequence[float]) -> Array:
    """Torques on the driver [N m], by default the gear set's load cases."""
    name = "torques_on_driver"
    for torque in torques:
        require_between(name, torque, 0, 1e9, below=True)
    if len(set(torques)) < len(torques):
        listed = ", ".join(f"{torque:.12g}" for torque in torques)
        raise InputError(f"{name} = {listed}; must differ from each other")
    loads = np.array(torques if len(torques) else cases, float)
    if loads.size == 0:
        raise InputError(f"{name} must be given: the gear set has no load")
    return loads


def _name(gear_set: GearSet, mesh: int) -> str:
    spec = gear_set.meshes[mesh]
    driver, driven = gear_set.gears[spec.driver], gear_set.gears[spec.driven]
    return f"{mesh + 1} ({driver.name} drives {driven.name})"


def _teeth(pair: GearPair) -> str:
    return f"{pair.driver.teeth} / {pair.driven.teeth}"


def _require_rows(
    gear_set: GearSet, mesh: int, pitches: int, rows_per_pitch: int
) -> None:
    if pitches > 1 and pitches * rows_per_pitch > MAX_ROWS:
        raise InputError(
            f"{gear_set.name}: tooth pairs of mesh {mesh + 1} repeat after {pitches} "
            f"base pitches for their pitch errors: {pitches * rows_per_pitch} rows of "
            f"a table, allowed are {MAX_ROWS}; fewer positions or torques, or errors "
            "that repeat sooner"
        )


def _places(positions: int, pitches: int) -> tuple[Array, NDArray[np.int64]]:
    """Positions in their base pitch, and the base pitch of each."""
    position = np.tile(np.arange(positions) / positions, pitches)
    return position, np.repeat(np.arange(pitches), positions)


def contact_problem(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    report: Progress = silent,
    resolution: Resolution | None = None,
) -> ContactProblem:
    """The mesh's contact problem with both flank compliances at hand.

    resolution : instead of that of the settings
    """
    resolution = resolution or RESOLUTIONS[settings.resolution]
    spec = gear_set.meshes[mesh]
    flanks: list[FlankCompliance] = []
    materials: list[PlaneMaterial] = []
    for i, gear in enumerate(gear_set.gears[g] for g in (spec.driver, spec.driven)):
        report(f"compliance of {gear.name}", i, 2)
        material = settings.material(gear)
        materials.append(material)
        flank = cached_flank_compliance(gear.geometry, material, resolution.size)
        if settings.body == "free":
            from fegear.elasticity.inertia_relief import in_mean_axes, inertia_relief

            require_inertia_of_bodies(gear_set, "bodies that are held count no inertia")
            sector = cyclic_sector(gear.geometry, material, resolution.size)
            relief = inertia_relief(sector, gear.density)
            widths = gear_set.common_width(mesh), gear.face_width
            flank = in_mean_axes(flank, relief, widths, inertia_of(gear))
        flanks.append(flank)
    report("compliance", 2, 2)
    errors = mesh_errors(gear_set, mesh)
    change = partial(_compliance_change, settings, resolution.size)
    driver, driven = faulty_sides(gear_set, mesh, change)
    return ContactProblem(
        pair=spec.pair,
        driver=flanks[0],
        driven=flanks[1],
        face_width=gear_set.common_width(mesh),
        driver_tip_relief=spec.driver_tip_relief,
        driver_root_relief=spec.driver_root_relief,
        driven_tip_relief=spec.driven_tip_relief,
        driven_root_relief=spec.driven_root_relief,
        driver_profile=driver.profile,
        driven_profile=driven.profile,
        friction=settings.friction,
        corner_contact=settings.corner_contact,
        nodes=resolution.nodes,
        driver_pitch_errors=errors[0],
        driven_pitch_errors=errors[1],
        driver_faults=driver.faults,
        driven_faults=driven.faults,
        driver_offset=driver.offset,
        driven_offset=driven.offset,
        plane_stress_pressure=pressure_in_plane(materials[0], materials[1], "stress"),
        plane_strain_pressure=pressure_in_plane(materials[0], materials[1], "strain"),
    )


def _compliance_change(
    settings: StaticsSettings, size: MeshSize, gear: Gear, cracks: dict[int, Crack]
) -> ChangedCompliance:
    """What cracks add to the compliance of a gear, by tooth, counted clockwise."""
    if settings.body == "free":
        raise InputError(
            f'gear "{gear.name}": cracks; not known of bodies that are free to '
            "accelerate, body = free"
        )
    material = settings.material(gear)
    return cached_compliance_change(gear.geometry, material, size, cracks)


def _solve_in_chunks(
    problem: ContactProblem,
    torque: Array,
    places: tuple[Array, NDArray[np.int64]],
    report: Progress,
) -> ContactCycle:
    """Solve in pieces short enough for Ctrl-C and a progress bar."""
    count = places[0].size
    chunks = [
        slice(i, i + POSITIONS_PER_CHUNK) for i in range(0, count, POSITIONS_PER_CHUNK)
    ]
    cycles = []
    for i, chunk in enumerate(chunks):
        report("contact", i, len(chunks))
        with stage("solving"):
            position, pitch = (array[chunk] for array in places)
            cycles.append(solve_cycle(problem, torque, position, pitch))
    report("contact", len(chunks), len(chunks))
    return cycles[0] if len(cycles) == 1 else _joined(cycles)


def _joined(cycles: list[ContactCycle]) -> ContactCycle:
    """Cycles over consecutive positions as one; pairs are matched by tooth."""
    teeth = sorted({int(k) for c in cycles for k in c.teeth}, key=lambda k: (abs(k), k))
    empty = {
        "load": 0.0,
        "load_slope": 0.0,
        "pressure": 0.0,
        "gap": np.inf,
        "friction_bending": np.nan,
    }
    empty |= {"arc": 0.0, "turn": 0.0, "closing": 1.0}

    def by_pair(cycle: ContactCycle, name: str) -> Array:
        values = getattr(cycle, name)
        out = np.full((*values.shape[:2], len(teeth), *values.shape[3:]), empty[name])
        out[:, :, [teeth.index(k) for k in cycle.teeth]] = values
        return out

    rows = (
        *("ste", "no_load", "local_stiffness", "relief_slope"),
        *("profile_slope", "driven_torque", "residual"),
    )
    joined: dict[str, Any] = {
        n: np.concatenate([getattr(c, n) for c in cycles], axis=1) for n in rows
    }
    for name in empty:
        joined[name] = np.concatenate([by_pair(c, name) for c in cycles], axis=1)
    position = np.concatenate([c.position for c in cycles])
    return replace(cycles[0], position=position, teeth=np.array(teeth), **joined)


def _root_stresses(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    problem: ContactProblem,
    cycle: ContactCycle,
    size: MeshSize | None = None,
) -> RootStresses | None:
    """Root stress of both gears, None where it is not asked for.

    size : instead of that of the settings
    """
    if not settings.root_stress:
        return None
    spec = gear_set.meshes[mesh]
    gears = (gear_set.gears[index] for index in (spec.driver, spec.driven))
    influences = [
        cached_root_influence(g.geometry, settings.material(g), size or settings.size)
        for g in gears
    ]
    return root_stresses(problem, cycle, influences)


def _estimate(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    cycle: ContactCycle,
    stresses: RootStresses | None,
    report: Progress,
) -> tuple[ErrorEstimate, ...]:
    """Compare every torque with the coarsened resolution."""
    coarser = RESOLUTIONS[settings.resolution].coarsened()
    problem = contact_problem(gear_set, mesh, settings, report, coarser)
    pitch = np.floor(cycle.position[:POSITIONS_PER_CHUNK]).astype(np.int64)
    with stage("solving"):
        position = cycle.position[:POSITIONS_PER_CHUNK] - pitch
        coarse = solve_cycle(problem, cycle.torque, position, pitch)
    others = _root_stresses(gear_set, mesh, settings, problem, coarse, coarser.size)
    root_change = np.full(cycle.torque.size, math.nan)
    if stresses is not None and others is not None:
        root_change = relative_change(stresses, others)
    ste = cycle.ste[:, : position.size]
    change = np.abs(coarse.ste - ste)
    return tuple(
        error_estimate(
            change[t] / np.abs(ste[t]),
            float(change[t].mean() / np.abs(ste[t].mean())),
            corner_positions(problem, cycle, t)[: position.size],
            float(root_change[t]),
        )
        for t in range(len(cycle.torque))
    )


def error_estimate(
    change: Array,
    mean_change: float,
    is_corner: NDArray[np.bool_],
    root_change: float = math.nan,
) -> ErrorEstimate:
    """Estimate from relative changes (n,) against a coarser resolution.

    mean_change : mean of the changes' amounts over the mean transmission error
    is_corner : (n,) positions with a tip corner in contact
    root_change : largest change of the root stress over its peak
    """
    largest = float(change.max()) if is_corner.any() else math.nan
    return ErrorEstimate(
        mean=ERROR_FACTOR * mean_change,
        path=ERROR_FACTOR * float(change[~is_corner].max(initial=0.0)),
        corner=ERROR_FACTOR * largest,
        root_stress=ROOT_ERROR_FACTOR * root_change,
    )


def largest_errors(errors: Sequence[ErrorEstimate]) -> ErrorEstimate | None:
    """The largest of each error; None where there are no estimates."""
    if not errors:
        return None
    corners = [error.corner for error in errors if math.isfinite(error.corner)]
    roots = [e.root_stress for e in errors if math.isfinite(e.root_stress)]
    return ErrorEstimate(
        mean=max(error.mean for error in errors),
        path=max(error.path for error in errors),
        corner=max(corners, default=math.nan),
        root_stress=max(roots, default=math.nan),
    )


def table_columns(
    problem: ContactProblem,
    cycle: ContactCycle,
    stresses: RootStresses | None = None,
) -> dict[str, Array]:
    """Columns of a contact cycle; pairs that never carry load are left out.

    Contact pressures are those of plane strain.
    """
    share, pair = cycle.load_share, problem.pair
    pressure = problem.plane_strain_pressure * cycle.pressure
    bending = np.nansum(share * cycle.friction_bending, axis=2)
    columns = {
        "n_pairs": (cycle.load != 0.0).sum(axis=2).astype(float),
        "stiffness_N_per_m": cycle.stiffness,
        "local_stiffness_N_per_m": cycle.local_stiffness,
        "ste_m": cycle.ste,
        "nlte_m": cycle.no_load,
        "max_pressure_Pa": pressure.max(axis=2),
        "friction_bending_ratio": bending,
        "driven_torque_Nm": cycle.driven_torque,
        **_path_columns(pair, cycle),
    }
    if stresses is not None:
        largest = stresses.largest
        columns["driver_root_stress_Pa"], columns["driven_root_stress_Pa"] = largest
    angle, sliding = _pair_kinematics(pair, cycle)
    for number, k in enumerate(_used_pairs(cycle), start=1):
        gap = np.where(np.isfinite(cycle.gap[..., k]), cycle.gap[..., k], np.nan)
        columns |= {
            f"pair{number}_stiffness_N_per_m": cycle.pair_stiffness[..., k],
            f"pair{number}_load_share": share[..., k],
            f"pair{number}_gap_m": gap,
            f"pair{number}_max_pressure_Pa": pressure[..., k],
            f"pair{number}_friction_bending_ratio": cycle.friction_bending[..., k],
            f"pair{number}_driver_roll_angle_deg": angle[..., k],
            f"pair{number}_sliding_over_pitch_speed": sliding[..., k],
        }
        if stresses is not None:
            columns |= {
                f"pair{number}_driver_root_stress_Pa": stresses.driver[..., k],
                f"pair{number}_driven_root_stress_Pa": stresses.driven[..., k],
            }
    return columns


def _path_columns(pair: GearPair, cycle: ContactCycle) -> dict[str, Array]:
    """Columns of the reference pair's point on the path, empty beyond its ends."""
    reference = cycle.position - np.floor(cycle.position)
    place = np.where(on_path(pair, reference), reference, np.nan)
    angles, diameters = roll_angles(pair, place), contact_diameters(pair, place)
    columns = {
        "path_length_m": pair.base_pitch * place,
        "driver_roll_angle_deg": np.degrees(angles[0]),
        "driven_roll_angle_deg": np.degrees(angles[1]),
        "driver_diameter_m": diameters[0],
        "driven_diameter_m": diameters[1],
        "sliding_over_pitch_speed": sliding_over_pitch_speed(pair, place),
    }
    return {name: np.tile(v, (cycle.torque.size, 1)) for name, v in columns.items()}


def _pair_kinematics(pair: GearPair, cycle: ContactCycle) -> tuple[Array, Array]:
    """Driver's roll angle [deg] and sliding of each pair (t, n, k), as of the path."""
    every = path_positions(cycle)
    place = np.where(on_path(pair, every), every, np.nan)
    angle = np.degrees(roll_angles(pair, place)[0])
    sliding = sliding_over_pitch_speed(pair, place)
    shape = cycle.load.shape
    return np.broadcast_to(angle, shape), np.broadcast_to(sliding, shape)


def pair_compliances(problem: ContactProblem, cycle: ContactCycle) -> dict[str, Array]:
    """Columns of the transmission error of either pair per load of the other.

    Empty where one of them faces no flank.
    """
    used = _used_pairs(cycle)
    arc, turn = (
        a[:, :, used].reshape(-1, used.size, 2) for a in (cycle.arc, cycle.turn)
    )
    normal, _ = pair_coupling(problem, cycle.teeth[used], arc, turn)
    compliance = normal.reshape(*cycle.ste.shape, used.size, used.size)
    facing = np.isfinite(cycle.gap[..., used])
    closing = np.where(facing, cycle.closing[..., used], np.nan)
    return {
        pair_compliance_name(i, j): compliance[..., i, j]
        / (closing[..., i] * closing[..., j])
        for i, j in combinations(range(used.size), 2)
    }


def _used_pairs(cycle: ContactCycle) -> NDArray[np.intp]:
    return np.flatnonzero((cycle.load != 0.0).any(axis=(0, 1)))


def table_header(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    cycle: ContactCycle,
    errors: tuple[ErrorEstimate, ...],
) -> dict[str, str]:
    spec = gear_set.meshes[mesh]
    used = enumerate(_used_pairs(cycle), start=1)
    pairs = " ".join(f"pair{i}={cycle.teeth[k]:+d}" for i, k in used)
    header = {
        "format": "fegear mesh table 1",
        "fegear version": package_version(),
        "gear set": gear_set.name,
        "mesh": _name(gear_set, mesh),
        "teeth": _teeth(spec.pair),
        "contact ratio": f"{spec.pair.contact_ratio:.6g}",
        "base pitch [mm]": format_exact(1e3 * spec.pair.base_pitch),
        "plane": settings.plane,
        "resolution": settings.resolution,
        "friction coefficient": format_exact(settings.friction),
        "corner contact": CORNERS[settings.corner_contact],
        "body": BODIES[settings.body],
        "pairs ahead of the reference pair [base pitches]": pairs,
        "position": "base pitches past the pitch point of the reference pair",
        "units": "in column names; torque is on the driver; transmission errors are "
        "driver rotation times base radius, driven gear held; compliance of two pairs "
        "is the transmission error of either per load of the other",
        "pressure": "plane strain, as below a narrow contact; with a tip corner or a "
        "kink, such as the start of a linear relief, in contact it has no limit and "
        "follows the contact grid",
        "largest complementarity residual": f"{cycle.residual.max():.3g}",
    }
    error = largest_errors(errors)
    if error is not None:
        parts = {"mean": error.mean, "path": error.path, "corner": error.corner}
        header["estimated discretisation error of ste_m"] = ", ".join(
            f"{name} {part:.2g}" for name, part in parts.items() if part == part
        ) + (", the largest of all torques" if len(errors) > 1 else "")
        if error.root_stress == error.root_stress:
            header["discretisation error of root stress"] = (
                f"estimated as {error.root_stress:.2g} of the peak"
            )
    return header
