"""A motion as a table over time, and as CSV text.

The file has a header of comment lines, `# key: value`, one line of column names with
units, and a row per time. Numbers are written in the shortest form that reads back to
the same bits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.contact_history import (
    ContactHistory,
    contact_histories,
    cycle_position,
)
from fegear.dynamics.model import DynamicModel
from fegear.dynamics.sides import DRIVE
from fegear.dynamics.stepper import FeHistory
from fegear.elasticity.root_stress import RootInfluence
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods, tooth_in_cycles
from lumped.common.csv_text import format_csv
from lumped.steady.sweep import Direction

Column = NDArray[Any]
ROWS_PER_BLOCK = 8192  # times at which root stresses are computed at once
LEGEND = {
    "time_s": "from the start of a common period of all meshes",
    "position": "base pitches since the start of the mesh's cycle, 0 to 1",
    "dte_m, force_N": "positive where the drive flanks are pressed together",
    "pair": "numbered by base pitches ahead of the reference pair",
    "back": "the same, in contact with the other flanks",
    "pressure_Pa": "largest of the pair, in plane strain; at a sharp tip corner it has "
    "no limit and is that of the contact nodes",
    "rotation_rad": "counter-clockwise, in addition to the nominal rotation",
}
TOOTH_LEGEND = {
    "tooth": "of the reference pair, counted from 1 as in pitch_errors_um",
}
ROOT_LEGEND = {
    "root_stress_Pa": "largest tension along the fillets of the pair's tooth, static "
    "under the loads of the instant",
}


@dataclass(frozen=True, eq=False)
class HistoryTable:
    """Columns (t,) by name, units in the names; header is free text by key."""

    columns: Mapping[str, Column]
    header: Mapping[str, str]


def history_table(
    model: DynamicModel,
    motion: FeHistory,
    steps: int,
    header: Mapping[str, str] | None = None,
    roots: Mapping[int, RootInfluence] | None = None,
) -> HistoryTable:
    """The recorded motion, its header followed by the legend.

    steps : of a cycle of the first mesh
    roots : of the gears whose root stress is wanted, by index
    """
    contacts = contact_histories(model, motion, steps)
    gear_set = model.sides[0].gear_set
    names = gear_words(gear_set)
    columns: dict[str, Column] = {"time_s": motion.time}
    for mesh, rate in enumerate(model.kinematics.rate):
        own_contacts = [contact for contact in contacts if contact.side.mesh == mesh]
        position = cycle_position(float(rate), motion.time.size, steps)
        columns |= _mesh_columns(motion, mesh, position, own_contacts)
        if pair_periods(gear_set)[mesh] > 1:
            columns |= _tooth_columns(gear_set, mesh, position)
    for gear, name in enumerate(names):
        columns |= _gear_motion_columns(model, motion, gear, name)
    for gear, influence in (roots or {}).items():
        own_contacts = [contact for contact in contacts if gear in contact.side.gears]
        columns |= _root_stress_columns(gear, names[gear], influence, own_contacts)
    teeth_differ = max(pair_periods(gear_set)) > 1
    legend = (
        LEGEND | (TOOTH_LEGEND if teeth_differ else {}) | (ROOT_LEGEND if roots else {})
    )
    return HistoryTable(columns, dict(header or {}) | legend)


def _mesh_columns(
    motion: FeHistory, mesh: int, position: Column, contacts: Sequence[ContactHistory]
) -> dict[str, Column]:
    loaded = np.array([contact.load > 0.0 for contact in contacts])
    columns = {
        f"mesh{mesh + 1}_position": position,
        f"mesh{mesh + 1}_dte_m": motion.deflection[:, mesh],
        f"mesh{mesh + 1}_force_N": motion.force[:, mesh],
        f"mesh{mesh + 1}_engaged_pairs": loaded.sum(axis=0),
    }
    for contact in contacts:
        columns[f"{contact.name}_load_N"] = contact.load
        columns[f"{contact.name}_pressure_Pa"] = contact.pressure
    return columns


def _tooth_columns(gear_set: GearSet, mesh: int, position: Column) -> dict[str, Column]:
    """Teeth of the reference pair where they are not all equal."""
    is_new_cycle = np.diff(position, prepend=position[0]) < 0.0
    cycle = np.cumsum(is_new_cycle, dtype=np.int64)
    return {
        f"mesh{mesh + 1}_{role}_tooth": tooth_in_cycles(gear_set, mesh, gear, cycle) + 1
        for role, gear in (
            ("driver", gear_set.meshes[mesh].driver),
            ("driven", gear_set.meshes[mesh].driven),
        )
    }


def _gear_motion_columns(
    model: DynamicModel, motion: FeHistory, gear: int, name: str
) -> dict[str, Column]:
    """Rotation, and translation where the gear has bearings."""
    hub, modes = motion.hub[:, 0], model.reference.modes
    columns = {f"{name}_rotation_rad": hub @ model.modal.rotation[gear]}
    for axis in "xy":
        index = modes.coordinates.indices.get((gear, axis))
        if index is not None:
            columns[f"{name}_{axis}_m"] = hub @ modes.shapes[index]
    return columns


def _root_stress_columns(
    gear: int, name: str, influence: RootInfluence, contacts: Sequence[ContactHistory]
) -> dict[str, Column]:
    """Root stresses of the gear's tooth in every pair of its meshes, under all
    contacts.
    """
    columns = {}
    for contact in contacts:
        if contact.side.flank_sign != DRIVE:
            continue
        tooth = contact.tooth(gear)
        stress_blocks = [
            influence.stress(
                [other.flank_load(gear, tooth, rows) for other in contacts]
            )
            for rows in _row_blocks(contact.load.size)
        ]
        mesh, pair = contact.side.mesh + 1, contact.pair_offset
        columns[f"{name}_mesh{mesh}_tooth{pair}_root_stress_Pa"] = np.concatenate(
            stress_blocks
        )
    return columns


def _row_blocks(count: int) -> Iterator[slice]:
    for start in range(0, count, ROWS_PER_BLOCK):
        yield slice(start, start + ROWS_PER_BLOCK)


def gear_words(gear_set: GearSet) -> list[str]:
    """Names of the gears as words, numbered if any two come out the same."""
    labels = [re.sub(r"[^\w-]+", "_", gear.name) for gear in gear_set.gears]
    if len(set(labels)) == len(labels):
        return labels
    return [f"{label}_{number}" for number, label in enumerate(labels, start=1)]


def format_history(table: HistoryTable) -> str:
    """The table as CSV text."""
    rows = zip(*(column.tolist() for column in table.columns.values()), strict=True)
    return format_csv(table.columns, rows, table.header)


def history_name(torque: float, direction: Direction, frequency: float) -> str:
    """File name of a torque [N m] and a frequency of the first mesh [Hz].

    Names sort like their numbers while these are whole, below 1000 N m and 10 kHz.
    """
    for name, value in (("torque", torque), ("frequency", frequency)):
        if not (value >= 0.0 and math.isfinite(value)):
            raise ValueError(f"{name} = {value}; must be finite and 0 or more")
    torque_text, frequency_text = (
        _padded_decimal(torque, 3),
        _padded_decimal(frequency, 4),
    )
    return f"{torque_text}Nm_{direction}_{frequency_text}Hz.csv"


def _padded_decimal(value: float, digits: int) -> str:
    """Decimals without an exponent, at least so many digits before the point."""
    text = np.format_float_positional(value, precision=6, trim="-")
    integer_digits, point, decimals = text.partition(".")
    return integer_digits.zfill(digits) + point + decimals
