"""Whether the machine's memory holds all freedoms of the gears."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from fegear.dynamics.sides import MeshLoadCurves, contact_sides
from fegear.elasticity.cyclic_gear import CyclicGear
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet

STEP_SIZES = 5  # whose operators are held at a time: kept, in use and in the making
N_FIELDS = 24  # of all freedoms: states, their copies, and what a step makes of them
BYTES_PER_NUMBER = 8  # bytes
GROUP = Path("/sys/fs/cgroup")  # of a container, which may have less than its host


def full_bytes(
    gear_set: GearSet,
    load_curves: Sequence[MeshLoadCurves],
    cyclic_gears: Sequence[CyclicGear],
) -> float:
    """Most that fidelity full needs, fields above all."""
    sides = contact_sides(gear_set, load_curves)
    n_load_directions = 2 if load_curves[0].friction > 0.0 else 1
    total = 0.0
    for number, cyclic_gear in enumerate(cyclic_gears):
        flanks = len({side.flank for side in sides if number in side.gears})
        field = BYTES_PER_NUMBER * cyclic_gear.unknowns * cyclic_gear.teeth
        cut = cyclic_gear.unknowns - cyclic_gear.n_interior
        loads = flanks * n_load_directions * len(cyclic_gear.flanks[0].arcs)
        condensed = BYTES_PER_NUMBER * loads * (cyclic_gear.unknowns + cut)
        ring = 2 * BYTES_PER_NUMBER * (cyclic_gear.teeth // 2 + 1) * cut**2
        total += STEP_SIZES * (condensed + ring) + N_FIELDS * field
    return total


def available_bytes() -> float:
    """Memory that a computation can still get, in a container what its limit leaves."""
    import psutil  # type: ignore[import-untyped]

    available = float(psutil.virtual_memory().available)
    with suppress(OSError, ValueError):  # ValueError: "max", no limit
        limit, used = (
            float((GROUP / name).read_text())
            for name in ("memory.max", "memory.current")
        )
        available = min(available, limit - used)
    return available


def require_memory(gear_set: GearSet, needed: float) -> None:
    """Raise InputError where fidelity full needs more bytes than there are."""
    available = available_bytes()
    if not needed <= available:
        raise InputError(
            f"{gear_set.name}: fidelity full needs {math.ceil(needed / 1e7) / 100:g} "
            "GB of memory for all freedoms of the gears, "
            f"{max(0, math.floor(available / 1e7)) / 100:g} GB are available; fidelity "
            "reduced or a coarser resolution needs less"
        )
