"""The pair laws of a gear set's meshes, from mesh tables that are given."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from fegear.contact.pair_load_curves import PAIR_RANGE_FACTOR, PairLoadCurves
from fegear.contact.solve import back_side_position
from fegear.dynamics.mesh_load_curves import POSITIONS_PER_CYCLE, has_back_side
from fegear.dynamics.sides import MeshLoadCurves
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.given_tables import GivenTables
from lumped.common.array_types import Array
from lumped.train.excitation_tables import column_at_torque
from lumped.train.path_load_curves import OPEN_GAP, PathLoadCurves, path_load_curves
from meshes import GearPair

POSITION_TOL = 1e-9  # base pitches
MAX_POSITIONS = 512  # of a mesh cycle


def all_table_load_curves(
    gear_set: GearSet, torque: float, source: GivenTables, without: Sequence[str]
) -> list[MeshLoadCurves]:
    """Laws of every mesh; raises InputError that names the table.

    torque : on the input gear [N m]; without : parts that the model leaves out
    """
    torques = mesh_torques_at(gear_set, torque)
    longest = max(table.position.size for _, table in source.tables)
    # finer on the same places, but for a table that would fill the memory
    positions = min(longest * -(-POSITIONS_PER_CYCLE // longest), MAX_POSITIONS)
    load_curves = []
    for mesh, (name, table) in enumerate(source.tables):
        try:
            path = path_load_curves(
                table, gear_set.meshes[mesh].pair.driver_arm, without
            )
            largest = float(column_at_torque(table, "ste_m", torques[mesh]).max())
            load_curves.append(
                table_load_curves(gear_set, mesh, path, largest, positions)
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
        back = load_curves_at(path, pair, position, back=True)
    return MeshLoadCurves(
        drive=load_curves_at(path, pair, position),
        back=back,
        backlash=backlash,
        friction=0.0,
    )


def load_curves_at(
    path: PathLoadCurves, pair: GearPair, position: Array, back: bool = False
) -> PairLoadCurves:
    """Load curves at positions (n,) of those along the path; see `pair_load_curves`.

    Teeth are symmetric: back contact is drive contact in a mirror. In corner contact
    loads count as if they acted along the line of action, where the path ends.
    """
    position = back_side_position(pair, position) if back else position
    low, high = (path.position[i] - position for i in (0, -1))
    ahead = np.arange(np.floor(low.min()), np.ceil(high.max()) + 1).astype(np.int64)
    gap = _read(path, path.gap, position[:, None] + ahead, OPEN_GAP)
    selected = gap.min(axis=0) < PAIR_RANGE_FACTOR * path.penetration[-1]
    teeth, path_position = ahead[selected], position[:, None] + ahead[selected]
    roll = pair.pitch_point + pair.base_pitch * path_position
    roll = np.clip(roll, pair.path_start, pair.path_end)
    rolls = np.stack([roll, pair.line_of_action - roll], axis=2)
    gears = pair.driver, pair.driven
    arms = np.array([gear.base_radius for gear in gears])
    tips = np.array([gear.tip_roll_length for gear in gears])
    load = _read(path, path.load, path_position, 0.0)
    no_friction = np.zeros((*path_position.shape, teeth.size))
    return PairLoadCurves(
        pair_offsets=-teeth if back else teeth,
        gap=gap[:, selected],
        moment_arms=np.concatenate([np.broadcast_to(arms, rolls.shape), rolls], axis=2),
        turn=np.zeros(rolls.shape),
        arc=np.maximum(tips**2 - rolls**2, 0.0) / (2.0 * arms),
        sliding_sign=np.sign(pair.pitch_point - roll),
        penetration=path.penetration,
        load=np.repeat(load[:, :, None], 2, axis=2),
        pressure=np.full(load.shape, np.nan),
        normal_compliance=_mutual_compliance(path, teeth, path_position),
        tangential_compliance=no_friction,
    )


def _mutual_compliance(
    path: PathLoadCurves, teeth: NDArray[np.int64], path_position: Array
) -> Array:
    """Compliance (n, k, k) between pairs at places (n, k) of the path [m/N]."""
    normal = np.zeros((*path_position.shape, teeth.size))
    for i, j in np.ndindex(teeth.size, teeth.size):
        values = path.compliance.get(int(teeth[j] - teeth[i]))
        if values is not None:
            normal[:, i, j] = _read(path, values, path_position[:, i], 0.0)
    return normal


def _read(
    path: PathLoadCurves, values: Array, path_position: Array, outside: float
) -> Array:
    """Values (..., j) at places (...) of the path from those (s, j).

    The last holds until the base pitch ends, where another pair takes its first.
    """
    (low, second), high = path.position[:2], path.position[-1]
    inside = PchipInterpolator(path.position, values)(np.clip(path_position, low, high))
    is_outside = (path_position < low - POSITION_TOL) | (
        path_position > high + (second - low) - POSITION_TOL
    )
    return np.where(
        is_outside.reshape(is_outside.shape + (1,) * (values.ndim - 1)), outside, inside
    )
