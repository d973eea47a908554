"""The column of the driver's speed of rotation, beside each mesh frequency."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from fegear.files.speed_ranges import MESH_FREQUENCY
from fegear.gearset.speeds import driver_rpm
from fegear.studies.columns import shared_meaning
from fegear.studies.table import Table

DRIVER_SPEED = "driver_speed_rpm"


def with_driver_speed(table: Table, cycles: float | None) -> Table:
    """A table with the driver's speed beside the frequency of the first mesh.

    cycles : of the first mesh per turn of the driver, in a planetary set of its input;
        the table stays as it is if None, and where it has no mesh frequency
    """
    if cycles is None or MESH_FREQUENCY not in table.names:
        return table
    place = list(table.names).index(MESH_FREQUENCY) + 1

    def rows() -> Iterator[Sequence[Any]]:
        for row in table.rows():
            cells = list(row)
            yield [*cells[:place], driver_rpm(cycles, cells[place - 1]), *cells[place:]]

    names = *table.names[:place], DRIVER_SPEED, *table.names[place:]
    header = {
        **table.header,
        DRIVER_SPEED: shared_meaning("response", DRIVER_SPEED),
    }
    return replace(table, names=names, rows=rows, header=header)
