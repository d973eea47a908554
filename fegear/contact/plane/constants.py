"""The constants of a contact problem as records and arrays of the kernel."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fegear.contact.pairs import PairTeeth
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactFailure, ContactProblem
from fegear.gearset.faults.tooth_faults import MAX_SPALLS
from fegear.gearset.modifications import Relief
from lumped.common.array_types import Array
from meshes import SpurGear

if TYPE_CHECKING:
    from fegear.contact.plane.kernels.cycle import Constants

NO_RELIEF = (0.0, 0.0, 1.0, 1.0)
NO_SPALLS = [(0.0, 0.0, 0.0)] * MAX_SPALLS


class Conditions(NamedTuple):
    """Under which pairs are solved, by default of equal teeth on centres at rest.

    teeth : that differ, of pairs (k,), or None
    lines : (n, 2) as in `fegear.contact.plane.kernels.cycle.Constants`
    friction_reversed : friction acts against the nominal sliding direction
    with_rates : whether rates by reliefs and profiles are asked for
    """

    teeth: PairTeeth | None = None
    lines: Array = np.empty((0, 2))
    friction_reversed: bool = False
    with_rates: bool = False


NOMINAL = Conditions()


def kernel_constants(
    problem: ContactProblem,
    pairs: int,
    conditions: Conditions = NOMINAL,
) -> Constants:
    """Constants of some number of tooth pairs."""
    from fegear.contact.plane.grid import contact_grid
    from fegear.contact.plane.kernels.cycle import Constants

    mesh, flanks, tables = kernel_inputs(problem)
    flanks_of_pairs = np.tile(flanks, (pairs, 1)).view(np.recarray)
    n_flank_points = tables.shape[3]
    changes = np.zeros((2, 2, 0, n_flank_points, n_flank_points))
    faults = problem.driver.faults, problem.driven.faults
    for gear, teeth in enumerate(conditions.teeth or ()):
        gear_faults = faults[gear]
        if gear_faults is None:
            continue
        for k, tooth in enumerate(teeth.tolist()):
            gear_faults.change_flank(
                flanks_of_pairs[k, gear], tooth, lowest_rolls(problem)[gear]
            )
        change = gear_faults.changes(teeth.tolist())
        if change is not None:
            if changes.size == 0:
                changes = np.zeros(
                    (2, 2, pairs * pairs, n_flank_points, n_flank_points)
                )
            changes[gear] = change.reshape(changes[gear].shape)
    grid = contact_grid(patch_nodes(problem))
    return Constants(mesh, flanks_of_pairs, tables, changes, conditions.lines, grid)


def patch_nodes(problem: ContactProblem) -> int:
    """Nodes of the contact patch of each tooth pair.

    Raises ContactFailure where loads vary over the face width.
    """
    if not isinstance(problem.solver, PlaneContact):
        raise ContactFailure("loads that vary over the face width have no patches")
    return problem.solver.nodes


def with_rootward(constants: Constants, problem: ContactProblem) -> Constants | None:
    """The constants with the third kind of tables in `compliance`.

    None where the flanks are not those of held gears, which alone have it.
    """
    from fegear.elasticity.cache import cached_rootward_compliance

    origins = [flank.compliance.origin for flank in problem.flanks]
    rootward_tables = [
        [cached_rootward_compliance(o)] for o in origins if o is not None
    ]
    if len(rootward_tables) < 2:
        return None
    return constants._replace(
        tables=np.concatenate([constants.tables, rootward_tables], 1)
    )


def kernel_inputs(problem: ContactProblem) -> tuple[np.record, np.recarray, Array]:
    """The kernel's records of the mesh and its two flanks, and the tables."""
    from fegear.contact.plane.kernels.flanks import FLANK, MESH
    from fegear.contact.profiles import profile_record

    pair = problem.pair
    mesh = np.recarray(1, MESH)
    mesh[0] = (
        pair.line_of_action,
        pair.pitch_point,
        pair.base_pitch,
        problem.friction,
        problem.corner_range,
    )
    gears = (pair.driver, pair.driven)
    lowest_roll_lengths = lowest_rolls(problem)
    flanks = np.zeros(2, FLANK).view(np.recarray)
    for i, (gear, flank) in enumerate(zip(gears, problem.flanks, strict=True)):
        c, (tip, root) = flank.compliance, flank.reliefs
        flanks[i] = (
            gear.base_radius,
            gear.tip_roll_length,
            0.0,
            gear.tip_roll_length,
            _half_thickness(gear, pair.operating_pressure_angle),
            c.flank_length,
            c.grading,
            c.modulus,
            c.poisson,
            1.0 if c.split else 0.0,
            gear.form_roll_length if gear.is_undercut else 0.0,
            _relief_record(tip, gear.tip_roll_length),
            _relief_record(root, lowest_roll_lengths[i]),
            profile_record(flank.profile, lowest_roll_lengths[i], gear.tip_roll_length),
            NO_SPALLS,
        )
    tables = np.array(
        [
            [flank.compliance.normal, flank.compliance.tangential]
            for flank in problem.flanks
        ]
    )
    return mesh[0], flanks, tables


def _half_thickness(gear: SpurGear, pressure_angle: float) -> float:
    """Half of a tooth's thickness on its operating pitch circle [m]."""
    radius = abs(gear.base_radius) / math.cos(pressure_angle)
    return abs(radius * gear.half_angle(radius))


def lowest_rolls(problem: ContactProblem) -> tuple[float, float]:
    """Roll lengths of the lowest points of contact of driver and driven gear [m]."""
    pair = problem.pair
    return pair.path_start, pair.line_of_action - pair.path_end


def _relief_record(relief: Relief | None, end: float) -> tuple[float, ...]:
    if relief is None:
        return NO_RELIEF
    power = relief.power
    return relief.magnitude, relief.start_roll_length, end, power
