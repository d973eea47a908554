"""Where the gears of a picture are, and what is in view."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fegear.contact.problem import ContactProblem
from fegear.files.errors import InputError
from fegear.rendering.frames import View
from fegear.rendering.placed_mesh import PlacedMesh
from fegear.rendering.sector_field import LoadableGear
from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr

Zoom = Literal["contact", "tooth", "gear", "set"]


@dataclass(frozen=True, eq=False, kw_only=True)
class MeshScene(PlacedMesh, ShortRepr):
    """One mesh of a gear set, ready for any torque and position."""

    name: str
    problem: ContactProblem
    bodies: tuple[LoadableGear, LoadableGear]

    @property
    def module(self) -> float:
        return self.mesh.pair.driver.module

    def view(self, zoom: Zoom, aspect: float) -> View:
        """What is to be seen; it does not depend on position or load."""
        pair, module = self.mesh.pair, self.mesh.pair.driver.module
        if zoom == "set":
            raise InputError("zoom = set; must be contact, tooth or gear, for one mesh")
        if zoom == "gear":
            return view_of_gears(zip(self.centers, self.bodies, strict=True), aspect)
        ends = np.array([self.on_path(pair.path_start), self.on_path(pair.path_end)])
        x, y = ends.mean(axis=0)
        width, height = 0.5 * np.abs(ends[1] - ends[0]) + 0.6 * module
        half = max(height, width / aspect)
        return View(x, y, half * (1.0 if zoom == "contact" else 2.0), aspect)


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
