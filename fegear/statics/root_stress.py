"""Root stress of both gears over a mesh cycle, from the loads of the contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fegear.contact.path import path_positions, sliding_sign
from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle
from fegear.elasticity.root_stress import FlankLoad, RootInfluence
from fegear.elasticity.sector import RIGHT
from fegear.files.timing import stage
from lumped.common.array_types import Array

if TYPE_CHECKING:
    from collections.abc import Iterator

POSITIONS_PER_BLOCK = 4096  # whose stress along the fillets is held at a time
DRIVER, DRIVEN = 0, 1


class RootStresses(NamedTuple):
    """Largest tension along the fillets of the teeth in each pair (t, n, k) [Pa].

    NaN of cracked teeth, whose stress at the crack has no limit.
    """

    driver: Array
    driven: Array

    @property
    def largest(self) -> tuple[Array, Array]:
        """Largest of teeth without crack of driver and driven gear (t, n) [Pa]."""
        return np.nanmax(self.driver, axis=2), np.nanmax(self.driven, axis=2)


def root_stresses(
    problem: ContactProblem,
    cycle: ContactCycle,
    influences: Sequence[RootInfluence],
) -> RootStresses:
    """Tension of all teeth that are in a pair, under the loads of all pairs.

    influences : of driver and driven gear, whose hubs are held

    A load acts at its centre on each flank, over the common face width.
    """
    with stage("root stress"):
        driver, driven = (
            _tensions(problem, cycle, gear, influences[gear])
            for gear in (DRIVER, DRIVEN)
        )
    return RootStresses(driver, driven)


def _tensions(
    problem: ContactProblem, cycle: ContactCycle, gear: int, influence: RootInfluence
) -> Array:
    """Tension (t, n, k) of the teeth of one gear."""
    # a pair ahead is clockwise on the driver and the other way on the driven gear
    teeth = cycle.teeth if gear == DRIVER else -cycle.teeth
    normal = cycle.load / problem.face_width
    rootward = problem.friction * sliding_sign(path_positions(cycle)) * normal
    tensions = np.empty_like(normal)
    for rows in _blocks(cycle.position.size):
        loads = [
            FlankLoad(
                int(tooth),
                RIGHT,
                cycle.arc[:, rows, k, gear],
                normal[:, rows, k],
                rootward[:, rows, k],
            )
            for k, tooth in enumerate(teeth)
        ]
        for k, tooth in enumerate(teeth):
            seen = [load._replace(tooth=load.tooth - int(tooth)) for load in loads]
            tensions[:, rows, k] = influence.stress(seen)
    faults = problem.flanks[gear].faults
    if faults is not None:
        # pairs count anew in each base pitch
        pitch = np.floor(cycle.position).astype(np.int64)
        tensions[:, faults.is_cracked(pitch[:, None] - cycle.teeth)] = np.nan
    return tensions


def _blocks(count: int) -> Iterator[slice]:
    for start in range(0, count, POSITIONS_PER_BLOCK):
        yield slice(start, start + POSITIONS_PER_BLOCK)


def relative_change(stresses: RootStresses, others: RootStresses) -> Array:
    """Largest change over the cycle of both gears' root stress over its peak (t,).

    others : at the same torques and at the first of the positions
    """
    changes = []
    for one, other in zip(stresses.largest, others.largest, strict=True):
        change = np.abs(other - one[:, : other.shape[1]]).max(axis=1)
        changes.append(change / one.max(axis=1))
    return np.maximum(*changes)
