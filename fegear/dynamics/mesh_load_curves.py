"""The pair laws of a gear set's meshes, solved as far as its torque needs them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fegear.contact.pair_load_curves import pair_load_curves
from fegear.dynamics.different_teeth import side_differences
from fegear.dynamics.sides import MeshLoadCurves
from fegear.gearset.faults.checks import with_equal_teeth
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import tooth_pair_errors, without_pitch_errors
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.contact_problem import contact_problem
from fegear.statics.excitation import Excitations
from fegear.statics.settings import StaticsSettings
from lumped.train.excitation_tables import column_at_torque
from lumped.train.table import MeshTable

POSITIONS_PER_CYCLE = 128  # of a mesh cycle at which pair laws are solved
# times the largest static deflection: penetration up to which load curves bend
PENETRATION_FACTOR = 6.0
MAX_BACKLASH_FACTOR = 20.0  # times the same: larger backlash is out of reach


def pitch_point(gear_set: GearSet, mesh: int, positions: int) -> tuple[int, int]:
    """Which pair of a mesh touches at the pitch point, and at which of the positions.

    Counted as pairs are in `PairLoadCurves`, from the phase of the mesh on.
    """
    phase = mesh_phases(gear_set)[mesh].value
    position_index = round(-phase % 1.0 * positions)
    return -round(phase + position_index / positions), position_index


def tables_of_equal_teeth(
    gear_set: GearSet, torque: float, excitations: Excitations
) -> list[MeshTable]:
    """Mesh tables of teeth that are all alike, without pitch errors and other faults.

    Those are offsets of the laws, and laws of their own.

    torque : on the input gear [N m]
    """
    set_of_equal_teeth = with_equal_teeth(without_pitch_errors(gear_set))
    return [
        excitations.table(set_of_equal_teeth, mesh, mesh_torque)
        for mesh, mesh_torque in enumerate(mesh_torques_at(gear_set, torque))
    ]


def all_mesh_load_curves(
    gear_set: GearSet, tables: Sequence[MeshTable], settings: StaticsSettings
) -> list[MeshLoadCurves]:
    """Laws of every mesh, by its table of equal teeth at the torque."""
    return [
        mesh_load_curves(
            gear_set, mesh, largest_deflection(table, table.torque_Nm[0]), settings
        )
        for mesh, table in enumerate(tables)
    ]


def largest_deflection(table: MeshTable, torque: float) -> float:
    """Largest transmission error over a mesh cycle from the least without load [m].

    Gaps that all pairs have in common turn the gears and press nothing.

    torque : on the driver [N m]
    """
    largest = column_at_torque(table, "ste_m", torque).max()
    if "nlte_m" in table.columns:
        largest -= column_at_torque(table, "nlte_m", torque).min()
    return float(largest)


def mesh_load_curves(
    gear_set: GearSet, mesh: int, static_deflection: float, settings: StaticsSettings
) -> MeshLoadCurves:
    """Load curves of a mesh (index from 0).

    static_deflection : largest of equal teeth [m]; pitch errors and wear of single
        teeth press some pairs on by as much again
    """
    problem = contact_problem(gear_set, mesh, settings)
    phase = mesh_phases(gear_set)[mesh].value
    position = phase + np.arange(POSITIONS_PER_CYCLE + 1) / POSITIONS_PER_CYCLE
    static_deflection += float(np.ptp([0.0, *tooth_pair_errors(gear_set, mesh)]))
    static_deflection += _depth_of_wear(gear_set, mesh)
    max_penetration = PENETRATION_FACTOR * static_deflection
    drive = pair_load_curves(problem, position, max_penetration)
    back, back_differences = None, None
    if has_back_side(gear_set, mesh, static_deflection):
        back = pair_load_curves(problem, position, max_penetration, back=True)
        back_differences = side_differences(problem, position, back, back=True)
    return MeshLoadCurves(
        drive=drive,
        back=back,
        backlash=gear_set.meshes[mesh].backlash,
        friction=problem.friction,
        drive_differences=side_differences(problem, position, drive),
        back_differences=back_differences,
    )


def _depth_of_wear(gear_set: GearSet, mesh: int) -> float:
    """Largest depth of wear of single teeth of both gears together [m]."""
    return sum(
        -min(
            (
                min(w.profile.deviations)
                for w in gear.faults.worn
                if w.tooth is not None
            ),
            default=0.0,
        )
        for gear in (gear_set.gears[index] for index in gear_set.meshes[mesh].gears)
    )


def has_back_side(gear_set: GearSet, mesh: int, static_deflection: float) -> bool:
    """Whether back flanks of a mesh (index from 0) are within reach.

    A position error of a planet takes up backlash in both of its meshes, and so does
    the eccentricity of a gear.

    static_deflection : largest of equal teeth [m]
    """
    carrier = gear_set.carrier
    errors = carrier.position_errors if carrier else ()
    reach = MAX_BACKLASH_FACTOR * static_deflection
    reach += 2.0 * float(np.ptp([0.0, *errors]))
    gears = gear_set.meshes[mesh].gears
    reach += 2.0 * sum(gear_set.gears[gear].faults.eccentricity for gear in gears)
    return gear_set.meshes[mesh].backlash < reach
