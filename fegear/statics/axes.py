"""Axes of gears that yield: compliance of shafts and bearings at the gears they carry.

Motions of an axis at the middle of a gear are its displacements along x, y and z and
the slopes of the first two over z, to which forces and moments of a load belong; see
`fegear.contact.width.supports`. Rotations are those that the transmission error counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fegear.contact.width.supports import MOTIONS, AxisSupports, GearSupport
from fegear.files.errors import InputError
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.shaft_rotors import shaft_rotor
from fegear.gearset.yielding import yielding_shafts
from lumped.common.array_types import Array
from lumped.rotors.description import RotorError
from lumped.rotors.statics import ShaftStatics, shaft_statics
from lumped.train.coordinates import line_of_action, rolling_sense

# displacements and slopes from displacements and tilts about x and y: a slope of y is
# the opposite of the tilt about x
SLOPES = np.zeros((MOTIONS, MOTIONS))
SLOPES[:3, :3] = np.eye(3)
SLOPES[3, 4], SLOPES[4, 3] = 1.0, -1.0


@dataclass(frozen=True, eq=False)
class YieldingAxes:
    """Axes of the gears of a set.

    shafts : statics of those that yield, and their gears in order, by the shaft's index
    compliance : (g, 5, g, 5) motions of gears by loads on gears
    frames : (meshes, 5, 5) motions along the push of the driver, along the normal to it
        and along the axis, by those along x, y and z
    """

    shafts: dict[int, tuple[ShaftStatics, tuple[int, ...]]]
    compliance: Array
    frames: Array

    def supports(
        self, gear_set: GearSet, mesh: int, loads: Array | None = None
    ) -> AxisSupports:
        """How the axes of both gears of a mesh yield.

        loads : (meshes, 2, 5) of all meshes on their gears, over the torque on the
            driver of this one [1/m and 1]; none to begin with
        """
        frame = self.frames[mesh]
        moved = self._moved(gear_set, mesh, loads)
        driver, driven = (
            GearSupport(
                compliance=frame @ self.compliance[gear, :, gear] @ frame.T,
                motion=frame @ moved[gear],
            )
            for gear in gear_set.meshes[mesh].gears
        )
        return AxisSupports(driver, driven)

    def _moved(self, gear_set: GearSet, mesh: int, loads: Array | None) -> Array:
        """Motions (g, 5) of all gears by the loads of other meshes, over the torque."""
        on_gears = np.zeros((len(gear_set.gears), MOTIONS))
        for other, spec in enumerate(gear_set.meshes):
            if loads is not None and other != mesh:
                for gear, load in zip(spec.gears, loads[other], strict=True):
                    on_gears[gear] += self.frames[other].T @ load
        return np.einsum("gihj,hj->gi", self.compliance, on_gears)


def yielding_axes(gear_set: GearSet) -> YieldingAxes:
    """Axes of a gear set; InputError where bearings do not hold a shaft."""
    count = len(gear_set.gears)
    compliance = np.zeros((count, MOTIONS, count, MOTIONS))
    shafts = {}
    for index, shaft in yielding_shafts(gear_set):
        if shaft.body is None:
            continue
        try:
            rotor = shaft_rotor(gear_set, shaft, shaft.body)
            statics = shaft_statics(rotor, shaft.body.gear_positions)
        except RotorError as error:
            raise InputError(f"{gear_set.name}: {error}") from None
        size = len(shaft.gears)
        of_tilts = statics.compliance.reshape(size, MOTIONS, size, MOTIONS)
        blocks = np.einsum("ai,gihj,bj->gahb", SLOPES, of_tilts, SLOPES)
        for i, one in enumerate(shaft.gears):
            for j, other in enumerate(shaft.gears):
                compliance[one, :, other] = blocks[i, :, j]
        shafts[index] = statics, shaft.gears
    return YieldingAxes(shafts, compliance, _frames(gear_set))


def _frames(gear_set: GearSet) -> Array:
    train = train_of(gear_set, 0.0)
    frames = np.zeros((len(train.meshes), MOTIONS, MOTIONS))
    for frame, mesh in zip(frames, train.meshes, strict=True):
        push = np.array(line_of_action(train, mesh))
        normal = rolling_sense(train, mesh) * np.array([push[1], -push[0]])
        for first in (0, 3):
            frame[first : first + 2, first : first + 2] = push, normal
        frame[2, 2] = 1.0
    return frames
