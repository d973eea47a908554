"""Mesh tables of files as the source of a train's excitation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from fegear.boundary import public
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.printable import printable
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import pair_periods, tooth_pair_errors
from fegear.gearset.planes import Plane
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.unmodified import has_faults
from fegear.gearset.yielding import SHAFTS, YIELD
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.mesh_table_files import read_mesh_table
from lumped.common.checks import require_fields
from lumped.common.short_repr import ShortRepr
from lumped.train.excitation import MeshExcitation
from lumped.train.excitation_tables import excitation_from_table, table_pitches
from lumped.train.table import MeshTable, TableError

if TYPE_CHECKING:
    from fegear.statics.settings import StaticsSettings

MAX_TORQUE_RATIO = 1.5  # over the single torque of a table, or below it


@dataclass(frozen=True)
class GivenTables(ShortRepr):
    """Mesh tables read from files, one for each mesh, by the name of the file."""

    tables: tuple[tuple[str, MeshTable], ...]

    def __post_init__(self) -> None:
        require_fields(self)

    def header_of(self, gear_set: GearSet) -> dict[str, str]:
        """Entry of a file's header: the tables."""
        names = ", ".join(Path(name).name for name, _ in self.tables)
        return {"excitation": printable(f"tables {names}")}

    @property
    def statics(self) -> StaticsSettings:
        """Finite elements, in the plane of the tables, for what those do not give."""
        from fegear.statics.settings import StaticsSettings

        planes = {table.header.get("plane") for _, table in self.tables}
        for plane in get_args(Plane):
            if planes == {plane}:
                return StaticsSettings(plane=plane, shafts="off")
        return StaticsSettings(shafts="off")

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


def given_table_warnings(
    stiffness: ExcitationSettings | GivenTables, gear_set: GearSet, torque: float
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
        if SHAFTS in table.header:
            yield with_code(
                "W67",
                f"{name}: a mesh table with {SHAFTS} that {YIELD}, for gears that only "
                "rotate; those that also move in their plane have them twice",
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
        Tables, which `LumpedModel` takes as `excitation`.

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
