"""From a gear set to the mesh-stiffness table of one of its meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fegear.boundary import mesh_index, public, require_torque
from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle, joined_cycles, joined_torques
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.elasticity.cache import cached_root_influence, cached_wide_root
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.wide_root import WideRoot
from fegear.files.errors import InputError
from fegear.files.timing import recorded_stages, stage
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods
from fegear.statics.contact_problem import contact_problem, require_solvable
from fegear.statics.machine import problems_at_torques, with_supports_of
from fegear.statics.mesh_result import ErrorEstimate, StaticsResult, error_estimate
from fegear.statics.mesh_table import (
    mesh_name,
    pair_compliances,
    table_columns,
    table_header,
)
from fegear.statics.root_stress import (
    RootStresses,
    relative_change,
    root_stresses,
    root_stresses_over_width,
)
from fegear.statics.settings import MAX_ROWS, RESOLUTIONS, StaticsSettings
from lumped.common.array_types import Array
from lumped.common.checks import plain_numbers
from lumped.common.progress import Progress, silent
from lumped.train.table import MeshTable
from meshes import MeshSize, SpurGear

MAX_COMPARED = 2048  # positions that are solved again, coarser


@public
def solve_mesh(
    gear_set: GearSet,
    mesh: int = 1,
    torques_on_driver: float | Sequence[float] = (),
    settings: StaticsSettings | None = None,
    progress: Progress | None = None,
) -> StaticsResult:
    """Mesh table of one mesh at torques on its driver [N m].

    With pitch errors the table continues until the tooth pairs repeat.

    Parameters
    ----------
    gear_set : GearSet
        Gear set of the mesh.
    mesh : int, optional
        Number of the mesh, counted from 1 as in files and commands.
    torques_on_driver : float or sequence of float, optional
        Torque on the driver [N m], or several that differ from each other; the load
        cases of the gear set unless given.
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
        If there is no such mesh, no torque is known, one is given twice or is not from
        1e-6 to below 1e9 N m, or the table is too long.
    ValueError
        If an argument is not of its type.

    Examples
    --------
    >>> import fegear
    >>> gears = fegear.load_gear_set("liu-pair", {"mesh.1.tip_relief.magnitude_um": 10})
    >>> table = fegear.solve_mesh(gears, torques_on_driver=[100.0])
    >>> print(f"{table.table['stiffness_N_per_m'].mean():.2e} N/m")
    2.46e+08 N/m
    """
    index = mesh_index(gear_set, mesh)
    torques = _torques_to_solve(torques_on_driver, gear_set.meshes[index].torques)
    settings = settings or StaticsSettings()
    on_shafts = settings.on_shafts(gear_set)
    return mesh_statics(on_shafts, index, torques, settings, progress)


def mesh_statics(
    gear_set: GearSet,
    mesh: int,
    torques: Sequence[float] | Array,
    settings: StaticsSettings | None = None,
    progress: Progress | None = None,
) -> StaticsResult:
    """Mesh table of a mesh, by its index from 0, at torques on its driver [N m]."""
    settings = settings or StaticsSettings()
    require_solvable(gear_set, mesh, settings)
    report = progress or silent
    driver_torques = np.array(torques, float)
    pitches = pair_periods(gear_set)[mesh]
    _require_table_size(
        gear_set, mesh, pitches, settings.positions * driver_torques.size
    )
    with recorded_stages() as seconds:
        problems = problems_at_torques(gear_set, mesh, settings, driver_torques, report)
        problem = problems[0]
        positions_and_pitches = _positions_and_pitches(settings.positions, pitches)
        cycle = _solve_problems(problems, driver_torques, positions_and_pitches, report)
        stresses = _root_stresses(gear_set, mesh, settings, problem, cycle)
        errors: tuple[ErrorEstimate, ...] = ()
        if settings.estimate_error:
            errors = _estimate_errors(
                gear_set, mesh, settings, problems, cycle, stresses, report
            )
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
    name = mesh_name(gear_set, mesh)
    return StaticsResult(
        table, cycle, problem, errors, dict(seconds), mesh + 1, name, pitches, stresses
    )


def _has_faults(gear_set: GearSet, mesh: int) -> bool:
    gears = gear_set.meshes[mesh].gears
    return any(gear_set.gears[gear].faults.any for gear in gears)


def _torques_to_solve(
    chosen: float | Sequence[float], load_cases: Sequence[float]
) -> Sequence[float]:
    """Torques on the driver [N m], by default the gear set's load cases."""
    name = "torques_on_driver"
    chosen = plain_numbers(chosen)
    torques = (chosen,) if isinstance(chosen, int | float) else tuple(chosen)
    for torque in torques:
        require_torque(name, torque, "the driver")
    if len(set(torques)) < len(torques):
        listed = ", ".join(f"{torque:.12g}" for torque in torques)
        raise InputError(f"{name} = {listed}; must differ from each other")
    if not torques and not load_cases:
        raise InputError(f"{name} must be given: the gear set has no load")
    return torques or load_cases


def _require_table_size(
    gear_set: GearSet, mesh: int, pitches: int, rows_per_pitch: int
) -> None:
    if pitches > 1 and pitches * rows_per_pitch > MAX_ROWS:
        raise InputError(
            f"{gear_set.name}: tooth pairs of mesh {mesh + 1} repeat after {pitches} "
            f"base pitches for their pitch errors: {pitches * rows_per_pitch} rows of "
            f"a table, allowed are {MAX_ROWS}; fewer positions or torques, or errors "
            "that repeat sooner"
        )


def _positions_and_pitches(
    positions: int, pitches: int
) -> tuple[Array, NDArray[np.int64]]:
    """Positions in their base pitch, and the base pitch of each."""
    position = np.tile(np.arange(positions) / positions, pitches)
    return position, np.repeat(np.arange(pitches), positions)


def _solve_problems(
    problems: Sequence[ContactProblem],
    torques: Array,
    positions_and_pitches: tuple[Array, NDArray[np.int64]],
    report: Progress,
) -> ContactCycle:
    """Solve one problem at all torques, or one for each."""
    solved = [
        _solve_in_chunks(problem, of_problem, positions_and_pitches, report)
        for problem, of_problem in zip(
            problems, np.split(torques, len(problems)), strict=True
        )
    ]
    return solved[0] if len(solved) == 1 else joined_torques(solved)


def _solve_in_chunks(
    problem: ContactProblem,
    torque: Array,
    positions_and_pitches: tuple[Array, NDArray[np.int64]],
    report: Progress,
) -> ContactCycle:
    """Solve in pieces short enough for Ctrl-C and a progress bar."""
    n_positions = positions_and_pitches[0].size
    size = problem.solver.positions_at_once
    chunks = [slice(i, i + size) for i in range(0, n_positions, size)]
    cycles = []
    for i, chunk in enumerate(chunks):
        report("contact", i, len(chunks))
        with stage("solving"):
            position, pitch = (array[chunk] for array in positions_and_pitches)
            cycles.append(solve_cycle(problem, torque, position, pitch))
    report("contact", len(chunks), len(chunks))
    return cycles[0] if len(cycles) == 1 else joined_cycles(cycles)


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
    if isinstance(problem.solver, WidthContact):
        roots = wide_roots(gear_set, mesh, settings, size)
        return root_stresses_over_width(problem, problem.solver, cycle, roots)
    influences = [
        cached_root_influence(*sector)
        for sector in _sectors(gear_set, mesh, settings, size)
    ]
    return root_stresses(problem, cycle, influences)


def wide_roots(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    size: MeshSize | None = None,
) -> tuple[WideRoot, ...]:
    """Root stress over the width under loads on driver and driven gear.

    size : instead of that of the settings
    """
    sectors = _sectors(gear_set, mesh, settings, size)
    return tuple(cached_wide_root(*sector) for sector in sectors)


def _sectors(
    gear_set: GearSet, mesh: int, settings: StaticsSettings, size: MeshSize | None
) -> list[tuple[SpurGear, PlaneMaterial, MeshSize]]:
    """Geometry, material and mesh size of driver and driven gear."""
    gears = [gear_set.gears[index] for index in gear_set.meshes[mesh].gears]
    return [(g.geometry, settings.material(g), size or settings.size) for g in gears]


def _estimate_errors(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    problems: Sequence[ContactProblem],
    cycle: ContactCycle,
    stresses: RootStresses | None,
    report: Progress,
) -> tuple[ErrorEstimate, ...]:
    """Compare every torque with the coarsened resolution.

    problems : that were solved, one for all torques or one for each
    """
    coarser_resolution = RESOLUTIONS[settings.resolution].coarsened()
    problem = contact_problem(gear_set, mesh, settings, report, coarser_resolution)
    coarser = [with_supports_of(problem, finer) for finer in problems]
    pitch = np.floor(cycle.position[:MAX_COMPARED]).astype(np.int64)
    with stage("solving"):
        position = cycle.position[:MAX_COMPARED] - pitch
        coarse_cycle = _solve_problems(coarser, cycle.torque, (position, pitch), silent)
    coarse_stresses = _root_stresses(
        gear_set, mesh, settings, problem, coarse_cycle, coarser_resolution.size
    )
    root_change = np.full(cycle.torque.size, math.nan)
    if stresses is not None and coarse_stresses is not None:
        root_change = relative_change(stresses, coarse_stresses)
    distribution_change = slice_change = np.full(cycle.torque.size, math.nan)
    if not cycle.face.is_uniform:
        distribution_change, slice_change = (
            np.abs(getattr(coarse_cycle.face, name) / getattr(cycle.face, name) - 1.0)
            for name in ("distribution_factor", "slice_factor")
        )
    ste = cycle.ste[:, : position.size]
    deflection = np.abs(ste - cycle.no_load[:, : position.size])
    change = coarse_cycle.ste - ste
    with np.errstate(divide="ignore", invalid="ignore"):
        peak_to_peak_change = np.ptp(change, axis=1) / np.ptp(ste, axis=1)
    return tuple(
        error_estimate(
            np.abs(change[t]) / deflection[t],
            float(np.abs(change[t]).mean() / deflection[t].mean()),
            cycle.corner_positions(t)[: position.size],
            float(root_change[t]),
            float(peak_to_peak_change[t]),
            float(distribution_change[t]),
            float(slice_change[t]),
        )
        for t in range(len(cycle.torque))
    )
