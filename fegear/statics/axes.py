"""Axes of gears that yield: compliance of shafts and bearings at the gears they carry.

Motions of an axis at the middle of a gear are its displacements along x, y and z and
the slopes of the first two over z, to which forces and moments of a load belong; see
`fegear.contact.width.supports`. Rotations are those that the transmission error counts.

Shafts on rolling bearings are not linear. They are held until loads are known, and
linearised at these: their gears move by q = offset + C p under loads p.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fegear.contact.width.supports import MOTIONS, AxisSupports, GearSupport
from fegear.contact.width.torsion import BodyTorsion
from fegear.files.errors import InputError
from fegear.gearset.axial_forces import axial_force_on_driver
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.shaft_rotors import rolling_supports, shaft_rotor
from fegear.gearset.torsion import torsional_flexibility
from fegear.gearset.yielding import too_soft_along_axis, yielding_shafts
from lumped.common.array_types import Array
from lumped.rotors.description import Rotor, RotorError
from lumped.rotors.rolling_statics import (
    RollingSupport,
    require_thrust_taken,
    rolling_shaft_statics,
)
from lumped.rotors.statics import ShaftLoad, ShaftStatics, shaft_statics
from lumped.train.coordinates import line_of_action, rolling_sense

# displacements and slopes from displacements and tilts about x and y: a slope of y is
# the opposite of the tilt about x
SLOPES = np.zeros((MOTIONS, MOTIONS))
SLOPES[:3, :3] = np.eye(3)
SLOPES[3, 4], SLOPES[4, 3] = 1.0, -1.0


@dataclass(frozen=True, eq=False)
class RollingShaft:
    """Shaft on rolling bearings.

    gears : in order
    places : of the middles of its gears [m]
    """

    rotor: Rotor
    supports: tuple[RollingSupport, ...]
    gears: tuple[int, ...]
    places: tuple[float, ...]

    def statics_under(self, loads: Array) -> ShaftStatics:
        """The shaft linearised at loads (g, 5) on all gears of the set."""
        on_gears = loads[list(self.gears)] @ SLOPES
        shaft_loads = [
            ShaftLoad(position=place, force=(x, y, z), moment=(*moment, 0.0))
            for place, (x, y, z, *moment) in zip(
                self.places, on_gears.tolist(), strict=True
            )
        ]
        return rolling_shaft_statics(self.rotor, self.supports, shaft_loads)


@dataclass(frozen=True, eq=False)
class YieldingAxes:
    """Axes of the gears of a set.

    shafts : statics of those that yield, and their gears in order, by the shaft's index
    compliance : (g, 5, g, 5) motions of gears by loads on gears
    frames : (meshes, 5, 5) motions along the push of the driver, along the normal to it
        and along the axis, by those along x, y and z
    offset : (g, 5) motions of gears without loads
    rolling : shafts on rolling bearings, by index; `shafts` has them under loads only
    """

    shafts: dict[int, tuple[ShaftStatics, tuple[int, ...]]]
    compliance: Array
    frames: Array
    offset: Array
    rolling: dict[int, RollingShaft] = field(default_factory=dict)

    def motions(self, loads: Array) -> Array:
        """Motions (g, 5) of all gears by loads (g, 5) on them."""
        return self.offset + np.einsum("gihj,hj->gi", self.compliance, loads)

    def under(self, gear_set: GearSet, loads: Array) -> YieldingAxes:
        """The axes with shafts on rolling bearings linearised at loads.

        Raises InputError where bearings do not hold a shaft.

        loads : (meshes, 2, 5) of all meshes on their gears; shafts without any stay
        """
        on_gears, axes = self.on_gears(gear_set, loads), self
        for index, shaft in self.rolling.items():
            if not on_gears[list(shaft.gears)].any():
                continue
            try:
                statics = shaft.statics_under(on_gears)
            except RotorError as error:
                raise InputError(f"{gear_set.name}: {error}") from None
            axes = axes.with_shaft(index, statics, shaft.gears)
        return axes

    def with_shaft(
        self, index: int, statics: ShaftStatics, gears: tuple[int, ...]
    ) -> YieldingAxes:
        """The axes with the statics of one more shaft."""
        size = len(gears)
        of_tilts = statics.compliance.reshape(size, MOTIONS, size, MOTIONS)
        compliance, offset = self.compliance.copy(), self.offset.copy()
        blocks = np.einsum("ai,gihj,bj->gahb", SLOPES, of_tilts, SLOPES)
        for i, one in enumerate(gears):
            for j, other in enumerate(gears):
                compliance[one, :, other] = blocks[i, :, j]
        offset[list(gears)] = statics.offset.reshape(size, MOTIONS) @ SLOPES.T
        return replace(
            self,
            shafts={**self.shafts, index: (statics, gears)},
            compliance=compliance,
            offset=offset,
        )

    def supports(
        self,
        gear_set: GearSet,
        mesh: int,
        loads: Array | None = None,
        torque: float = 1.0,
    ) -> AxisSupports:
        """How the axes of both gears of a mesh yield.

        loads : (meshes, 2, 5) of all meshes on their gears [N and N m]; none to begin
            with
        torque : on the driver of this one [N m]
        """
        frame = self.frames[mesh]
        moved = self._moved(gear_set, mesh, loads) / torque
        driver, driven = (
            GearSupport(
                compliance=frame @ self.compliance[gear, :, gear] @ frame.T,
                motion=frame @ moved[gear],
                torsion=body_torsion(gear_set, gear),
            )
            for gear in gear_set.meshes[mesh].gears
        )
        return AxisSupports(driver, driven)

    def _moved(self, gear_set: GearSet, mesh: int, loads: Array | None) -> Array:
        """Motions (g, 5) of all gears by the loads of other meshes."""
        if loads is None:
            return np.zeros_like(self.offset)
        of_others = loads.copy()
        of_others[mesh] = 0.0
        return self.motions(self.on_gears(gear_set, of_others))

    def on_gears(self, gear_set: GearSet, loads: Array) -> Array:
        """Sum of the loads (g, 5) on every gear, along x, y and z."""
        total = np.zeros((len(gear_set.gears), MOTIONS))
        for frame, spec, pair in zip(self.frames, gear_set.meshes, loads, strict=True):
            for gear, load in zip(spec.gears, pair, strict=True):
                total[gear] += frame.T @ load
        return total


def yielding_axes(gear_set: GearSet) -> YieldingAxes:
    """Axes of a gear set; InputError where bearings do not hold a shaft.

    Shafts on rolling bearings are held, see `YieldingAxes.under`.
    """
    count = len(gear_set.gears)
    axes = YieldingAxes(
        shafts={},
        compliance=np.zeros((count, MOTIONS, count, MOTIONS)),
        frames=_frames(gear_set),
        offset=np.zeros((count, MOTIONS)),
        rolling=rolling_shafts(gear_set),
    )
    for index, shaft in yielding_shafts(gear_set):
        if shaft.body is None or index in axes.rolling:
            continue
        try:
            rotor = shaft_rotor(gear_set, shaft, shaft.body)
            statics = shaft_statics(rotor, shaft.body.gear_positions)
        except RotorError as error:
            raise InputError(f"{gear_set.name}: {error}") from None
        axes = axes.with_shaft(index, statics, shaft.gears)
    return axes


def body_torsion(gear_set: GearSet, gear: int) -> BodyTorsion | None:
    """Torsion of a gear over its face width, None where it is left out."""
    flexibility = torsional_flexibility(gear_set, gear)
    return None if flexibility is None else BodyTorsion(*flexibility)


def require_thrust_on_bearings(gear_set: GearSet, torques: Sequence[float]) -> None:
    """Raise InputError for a thrust that bearings of a shaft do not take.

    No rolling bearing has its sense, or linear ones yield too much, see
    `fegear.gearset.yielding.too_soft_along_axis`.

    torques : on the drivers of all meshes [N m]
    """
    rolling = rolling_shafts(gear_set)
    for index, shaft in yielding_shafts(gear_set):
        axial = _axial_forces(gear_set, shaft.gears, torques)
        if index not in rolling:
            if refusal := too_soft_along_axis(gear_set, index, math.fsum(axial)):
                raise InputError(refusal)
            continue
        try:
            supports = rolling[index].supports
            require_thrust_taken(rolling[index].rotor.name, supports, axial)
        except RotorError as error:
            raise InputError(f"{gear_set.name}: {error}") from None


def _axial_forces(
    gear_set: GearSet, gears: Sequence[int], torques: Sequence[float]
) -> list[float]:
    """Mean axial forces on gears of a shaft in all their meshes [N]."""
    return [
        sign * axial_force_on_driver(gear_set, mesh, torque)
        for mesh, torque in enumerate(torques)
        for gear, sign in zip(gear_set.meshes[mesh].gears, (1.0, -1.0), strict=True)
        if gear in gears
    ]


def rolling_shafts(gear_set: GearSet) -> dict[int, RollingShaft]:
    """Shafts on rolling bearings by index; InputError for one that is no beam."""
    shafts = {}
    for index, shaft in yielding_shafts(gear_set):
        if shaft.body is None or not shaft.body.mounted_bearings:
            continue
        try:
            rotor = shaft_rotor(gear_set, shaft, shaft.body)
        except RotorError as error:
            raise InputError(f"{gear_set.name}: {error}") from None
        shafts[index] = RollingShaft(
            rotor=rotor,
            supports=rolling_supports(shaft.body),
            gears=tuple(shaft.gears),
            places=shaft.body.gear_positions,
        )
    return shafts


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
