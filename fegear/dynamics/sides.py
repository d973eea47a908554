"""Which teeth and flanks the contacts of a gear set touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pair_load_curves import PairLoadCurves
from fegear.dynamics.different_teeth import DifferentTeeth
from fegear.elasticity.sector import LEFT, RIGHT
from fegear.gearset.model import GearSet
from fegear.gearset.phases import first_teeth, rolling_senses
from fegear.gearset.pitch_errors import mesh_errors
from lumped.common.array_types import Array
from lumped.train.pitch_errors import pair_gaps

DRIVE, BACK = 1, -1


@dataclass(frozen=True, eq=False)
class MeshLoadCurves:
    """Pair laws of both sides of a mesh over its cycle.

    backlash : [m]; friction : Coulomb coefficient
    back : None where the backlash is out of reach
    drive_differences, back_differences : of teeth that differ, None without
    """

    drive: PairLoadCurves
    back: PairLoadCurves | None
    backlash: float
    friction: float
    drive_differences: DifferentTeeth | None = None
    back_differences: DifferentTeeth | None = None


@dataclass(frozen=True, eq=False)
class ContactSide:
    """The contacts on one side of a mesh.

    flank_sign : DRIVE or BACK
    differences : of teeth that differ, None without
    """

    gear_set: GearSet
    mesh: int
    flank_sign: int
    load_curves: PairLoadCurves
    backlash: float
    differences: DifferentTeeth | None = None

    @property
    def sense(self) -> int:
        """1 where the driver pushes the driven gear counter-clockwise of itself.

        Opposite for an internal driver, see `fegear.gearset.phases`.
        """
        return self.flank_sign * rolling_senses(self.gear_set)[self.gears[0]]

    @property
    def gears(self) -> tuple[int, int]:
        mesh = self.gear_set.meshes[self.mesh]
        return mesh.driver, mesh.driven

    @property
    def flank(self) -> int:
        """RIGHT or LEFT, the same on both gears: seen with the tooth pointing up."""
        return RIGHT if self.sense < 0 else LEFT

    @property
    def _first(self) -> Mapping[tuple[int, int], int]:
        return first_teeth(self.gear_set)

    def teeth(self, gear: int) -> NDArray[np.int64]:
        """Each contact's tooth of a gear, clockwise from the gear's first tooth.

        Counter-clockwise on an internal gear.
        """
        # the driven tooth's other flank meets the next tooth of the driver
        teeth_ahead = 1 if self.flank_sign == BACK and gear == self.gears[0] else 0
        sense = rolling_senses(self.gear_set)[gear]
        return self._first[self.mesh, gear] - sense * (
            self.load_curves.pair_offsets + teeth_ahead
        )

    def errors(self, cycles: NDArray[np.int64]) -> Array:
        """Gaps (k, n) of the contacts in cycles (n,) of the mesh, by pitch errors [m].

        The contacts count anew in each cycle.
        """
        pair = cycles - self.load_curves.pair_offsets[:, None]
        errors = mesh_errors(self.gear_set, self.mesh)
        return pair_gaps(*errors, pair, self.flank_sign == BACK)

    def arcs(self, gear: int) -> Array:
        """Places of the contacts on a gear's flanks from the tip corner (p, k) [m]."""
        return self.load_curves.arc[..., self.gears.index(gear)]


def contact_sides(
    gear_set: GearSet, load_curves: Sequence[MeshLoadCurves]
) -> list[ContactSide]:
    """Mesh by mesh, the drive side before the back; contacts are in this order."""
    sides = []
    for m, curves in enumerate(load_curves):
        differences = curves.drive_differences
        sides.append(ContactSide(gear_set, m, DRIVE, curves.drive, 0.0, differences))
        if curves.back is not None:
            back = curves.back, curves.backlash, curves.back_differences
            sides.append(ContactSide(gear_set, m, BACK, *back))
    return sides
