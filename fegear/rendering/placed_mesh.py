"""Where the gears of a mesh and their teeth are in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fegear.gearset.model import GearSet, Mesh
from fegear.gearset.phases import tooth_axis
from fegear.gearset.placing import layout
from fegear.rendering.frames import Frame, turned
from lumped.common.array_types import Array

Role = Literal["driver", "driven"]
ROLES: tuple[Role, Role] = ("driver", "driven")


@dataclass(frozen=True, eq=False, kw_only=True)
class PlacedMesh:
    """Two gears in mesh in the plane, as the gear set is drawn by `fegear show`.

    direction : of the centre line, from driver to driven [rad]
    sense : of the driver, 1 turns counter-clockwise, -1 clockwise
    """

    gear_names: tuple[str, str]
    mesh: Mesh
    driver_center: Array
    direction: float
    sense: int

    @property
    def centers(self) -> tuple[Array, Array]:
        along = np.array([math.cos(self.direction), math.sin(self.direction)])
        return (
            self.driver_center,
            self.driver_center + self.mesh.pair.center_distance * along,
        )

    def frame(
        self, role: Role, position: float, tooth: int = 0, back: bool = False
    ) -> Frame:
        """Frame of the sector `tooth` places to the right of the reference pair's
        tooth.

        Right is clockwise, and counterclockwise in the mirror image. Opposite for an
        internal gear, whose teeth point to the centre.

        back : whether the teeth are seen in a mirror, in which their back flanks are
            the right ones; pairs then count the other way, and the driver's tooth
            of the reference pair is the next one
        """
        if back:
            other = self.frame(role, position, (role == "driver") - tooth)
            return Frame(other.center, other.turn @ np.diag([-1.0, 1.0]))
        pair = self.mesh.pair
        index, sense = 0, self.sense
        if role == "driven":
            index, sense = 1, -self.sense * pair.sign
        gear = (pair.driver, pair.driven)[index]
        axis = tooth_axis(self.mesh, role == "driver", sense, self.direction)
        axis += gear.sign * sense * position * gear.pitch_angle
        mirrored = self.sense * pair.driver.sign > 0
        right = tooth * gear.pitch_angle
        to_upright = turned(axis - 0.5 * math.pi)
        mirror = np.diag([-1.0, 1.0]) if mirrored else np.eye(2)
        return Frame(self.centers[index], to_upright @ mirror @ turned(-right))

    def on_path(self, roll_length: float) -> Array:
        """A point of the line of action by the driver's roll length, (2,)."""
        pair = self.mesh.pair
        sense = self.sense * pair.driver.sign
        out = turned(self.direction) @ turned(-sense * pair.operating_pressure_angle)
        point = np.array([pair.driver.base_radius, sense * roll_length])
        return self.driver_center + pair.sign * (out @ point)


def placed_mesh(gear_set: GearSet, mesh: int) -> PlacedMesh:
    """Place mesh number `mesh`, counted from 0, as all pictures do."""
    spec, placed = gear_set.meshes[mesh], layout(gear_set)
    driver, driven = (gear_set.gears[index].name for index in spec.gears)
    place = placed.places[spec.driver]
    return PlacedMesh(
        gear_names=(driver, driven),
        mesh=spec,
        driver_center=np.array([place.x, place.y]),
        direction=placed.directions[mesh],
        sense=place.sense,
    )
