"""The pair laws of a gear set's meshes, from mesh tables that are given."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.contact.pair_load_curves import PAIR_RANGE_FACTOR, PairLoadCurves
from fegear.contact.pairs import back_side_position
from fegear.dynamics.mesh_load_curves import (
    POSITIONS_PER_CYCLE,
    has_back_side,
    largest_deflection,
)
from fegear.dynamics.sides import MeshLoadCurves
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.given_tables import GivenTables
from lumped.common.array_types import Array
from lumped.train.path_load_curves import OPEN_GAP, PathLoadCurves, path_load_curves
from meshes import GearPair

POSITION_TOL = 1e-9  # base pitches
MAX_POSITIONS = 512  # of a mesh cycle


def all_table_load_curves(
    gear_set: GearSet,
    torque: float,
    source: GivenTables,
    left_out_effects: Sequence[str],
) -> list[MeshLoadCurves]:
    """Laws of every mesh; raises InputError that names the table.

    torque : on the input gear [N m]; left_out_effects : parts that the model leaves out
    """
    torques = mesh_torques_at(gear_set, torque)
    most_table_positions = max(table.position.size for _, table in source.tables)
    # finer on the same places, but for a table that would fill the memory
    positions = min(
        most_table_positions * -(-POSITIONS_PER_CYCLE // most_table_positions),
        MAX_POSITIONS,
    )
    load_curves = []
    for mesh, (name, table) in enumerate(source.tables):
        try:
            path = path_load_curves(
                table, gear_set.meshes[mesh].pair.driver_arm, left_out_effects
            )
            deflection = largest_deflection(table, torques[mesh])
            load_curves.append(
                table_load_curves(gear_set, mesh, path, deflection, positions)
            )
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None
    return load_curves


def table_load_curves(
    gear_set: GearSet,
    mesh: int,
    path: PathLoadCurves,
    static_deflection: float,
    positions: int,
) -> MeshLoadCurves:
    """Laws of a mesh (index from 0) over its cycle from those along its path.

    static_deflection : largest static deflection [m]; positions : of the cycle
    """
    pair, backlash = gear_set.meshes[mesh].pair, gear_set.meshes[mesh].backlash
    phase = mesh_phases(gear_set)[mesh].value
    position = phase + np.arange(positions + 1) / positions
    back = None
    if has_back_side(gear_set, mesh, static_deflection):
        back = load_curves_at(path, pair, position, is_back=True)
    return MeshLoadCurves(
        drive=load_curves_at(path, pair, position),
        back=back,
        backlash=backlash,
        friction=0.0,
    )


def load_curves_at(
    path: PathLoadCurves, pair: GearPair, position: Array, is_back: bool = False
) -> PairLoadCurves:
    """Load curves at positions (n,) of those along the path; see `pair_load_curves`.

    Teeth are symmetric: back contact is drive contact in a mirror. In corner contact
    loads count as if they acted along the line of action, where the path ends.
    """
    position = back_side_position(pair, position) if is_back else position
    least_teeth_ahead, most_teeth_ahead = (path.position[i] - position for i in (0, -1))
    teeth_ahead = np.arange(
        np.floor(least_teeth_ahead.min()), np.ceil(most_teeth_ahead.max()) + 1
    ).astype(np.int64)
    gap = _interpolate_along_path(
        path, path.gap, position[:, None] + teeth_ahead, OPEN_GAP
    )
    reach = PAIR_RANGE_FACTOR * path.penetration[-1]
    is_within_reach = gap.min(axis=0) - gap.min() < reach
    teeth, path_position = (
        teeth_ahead[is_within_reach],
        position[:, None] + teeth_ahead[is_within_reach],
    )
    roll = pair.pitch_point + pair.base_pitch * path_position
    roll = np.clip(roll, pair.path_start, pair.path_end)
    rolls = np.stack([roll, pair.line_of_action - roll], axis=2)
    gears = pair.driver, pair.driven
    base_radii = np.array([gear.base_radius for gear in gears])
    tip_rolls = np.array([gear.tip_roll_length for gear in gears])
    load = _interpolate_along_path(path, path.load, path_position, 0.0)
    no_tangential_compliance = np.zeros((*path_position.shape, teeth.size))
    return PairLoadCurves(
        pair_offsets=-teeth if is_back else teeth,
        gap=gap[:, is_within_reach],
        moment_arms=np.concatenate(
            [np.broadcast_to(base_radii, rolls.shape), rolls], axis=2
        ),
        turn=np.zeros(rolls.shape),
        arc=np.maximum(tip_rolls**2 - rolls**2, 0.0) / (2.0 * base_radii),
        sliding_sign=np.sign(pair.pitch_point - roll),
        penetration=path.penetration,
        load=np.repeat(load[:, :, None], 2, axis=2),
        pressure=np.full(load.shape, np.nan),
        normal_compliance=_mutual_compliance(path, teeth, path_position),
        tangential_compliance=no_tangential_compliance,
    )


def _mutual_compliance(
    path: PathLoadCurves, teeth: NDArray[np.int64], path_position: Array
) -> Array:
    """Compliance (n, k, k) between pairs at places (n, k) of the path [m/N]."""
    normal = np.zeros((*path_position.shape, teeth.size))
    for i, j in np.ndindex(teeth.size, teeth.size):
        values = path.compliance.get(int(teeth[j] - teeth[i]))
        if values is not None:
            normal[:, i, j] = _interpolate_along_path(
                path, values, path_position[:, i], 0.0
            )
    return normal


def _interpolate_along_path(
    path: PathLoadCurves, values: Array, path_position: Array, value_off_path: float
) -> Array:
    """Values (..., j) at places (...) of the path from those (s, j).

    The last holds until the base pitch ends, where another pair takes its first.
    """
    (path_start, second_position), path_end = path.position[:2], path.position[-1]
    values_on_path = PchipInterpolator(path.position, values)(
        np.clip(path_position, path_start, path_end)
    )
    is_off_path = (path_position < path_start - POSITION_TOL) | (
        path_position > path_end + (second_position - path_start) - POSITION_TOL
    )
    return np.where(
        is_off_path.reshape(is_off_path.shape + (1,) * (values.ndim - 1)),
        value_off_path,
        values_on_path,
    )
