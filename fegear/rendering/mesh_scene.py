"""Where the gears of a picture are, and what is in view."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fegear.contact.problem import ContactProblem
from fegear.files.errors import InputError
from fegear.gearset.model import Mesh
from fegear.gearset.phases import tooth_axis
from fegear.rendering.frames import Frame, View, turned
from fegear.rendering.sector_field import LoadableGear
from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr

Role = Literal["driver", "driven"]
Zoom = Literal["contact", "tooth", "gear", "set"]


@dataclass(frozen=True, eq=False)
class MeshScene(ShortRepr):
    """One mesh of a gear set, ready for any torque and position."""

    name: str
    gear_names: tuple[str, str]
    mesh: Mesh
    problem: ContactProblem
    bodies: tuple[LoadableGear, LoadableGear]
    driver_center: Array
    direction: float
    sense: int

    @property
    def module(self) -> float:
        return self.mesh.pair.driver.module

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
        gear = self.bodies[index].sector.gear
        axis = tooth_axis(self.mesh, role == "driver", sense, self.direction)
        axis += gear.sign * sense * position * gear.pitch_angle
        mirrored = self.sense * pair.driver.sign > 0
        right = tooth * gear.pitch_angle
        to_upright = turned(axis - 0.5 * math.pi)
        mirror = np.diag([-1.0, 1.0]) if mirrored else np.eye(2)
        return Frame(self.centers[index], to_upright @ mirror @ turned(-right))

    def view(self, zoom: Zoom, aspect: float) -> View:
        """What is to be seen; it does not depend on position or load."""
        pair, module = self.mesh.pair, self.mesh.pair.driver.module
        if zoom == "set":
            raise InputError("zoom = set; must be contact, tooth or gear, for one mesh")
        if zoom == "gear":
            return view_of_gears(zip(self.centers, self.bodies, strict=True), aspect)
        ends = np.array([self._on_path(pair.path_start), self._on_path(pair.path_end)])
        x, y = ends.mean(axis=0)
        width, height = 0.5 * np.abs(ends[1] - ends[0]) + 0.6 * module
        half = max(height, width / aspect)
        return View(x, y, half * (1.0 if zoom == "contact" else 2.0), aspect)

    def _on_path(self, roll_length: float) -> Array:
        """A point of the line of action by the driver's roll length, (2,)."""
        pair = self.mesh.pair
        sense = self.sense * pair.driver.sign
        out = turned(self.direction) @ turned(-sense * pair.operating_pressure_angle)
        point = np.array([pair.driver.base_radius, sense * roll_length])
        return self.driver_center + pair.sign * (out @ point)


def view_of_gears(gears: Iterable[tuple[Array, LoadableGear]], aspect: float) -> View:
    """The view of whole gears, each by its centre (2,) [m] and its body."""
    placed = [(center, body.sector.gear.outer_radius) for center, body in gears]
    low = np.min([center - radius for center, radius in placed], axis=0)
    high = np.max([center + radius for center, radius in placed], axis=0)
    x, y = 0.5 * (low + high)
    width, height = 0.5 * (high - low)
    return View(x, y, 1.03 * max(height, width / aspect), aspect)


@dataclass(frozen=True)
class RelativePose:
    """Position of the gears relative to each other.

    position : base pitches from the pitch point
    ste : the driver's rotation times its base radius, driven gear held [m]
    back : whether loads are on the back flanks, and seen in the mirror
    """

    position: float
    ste: float
    back: bool = False
