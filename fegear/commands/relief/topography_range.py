"""A topography whose depths are sought at points of a flank."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fegear.contact.problem import ContactProblem
from fegear.contact.width.contact import WidthContact
from fegear.gearset.modifications import FlankTopography
from fegear.gearset.topographies import topography_keys
from fegear.gearset.zones import zones
from lumped.common.array_types import Array
from lumped.common.units import MM, UM

START_PART = 0.3  # of the largest depth, in patterns from which searches start
# of angles [deg] and places [mm], and of depths [um], as they are written
POINT_DECIMALS, DEPTH_DECIMALS = 6, 2


@dataclass(frozen=True)
class TopographyRange:
    """Depths over profile and width of one gear that are sought.

    role : of the gear
    roll_angles_deg, places_mm : (k,) and (l,) of points, from root to tip and from the
        near to the far end of the common width
    base_radius : of the gear [m]
    largest : depth that is allowed [um]
    """

    role: str
    roll_angles_deg: tuple[float, ...]
    places_mm: tuple[float, ...]
    base_radius: float
    largest: float

    @property
    def key(self) -> str:
        return f"{self.role}_topography"

    @property
    def size(self) -> int:
        return len(self.roll_angles_deg) * len(self.places_mm)

    @property
    def limits(self) -> list[tuple[float, float]]:
        """Limits of all depths [um], those of one roll angle after another."""
        return [(0.0, self.largest)] * self.size

    def grid(self, depths_um: Array) -> Array:
        """Depths (k, l) of those of a design (k l,)."""
        return depths_um.reshape(len(self.roll_angles_deg), len(self.places_mm))

    def of(self, depths_um: Array) -> FlankTopography:
        """The topography of depths of a design."""
        rolls = self.base_radius * np.radians(self.roll_angles_deg)
        depths = UM * self.grid(depths_um)
        return FlankTopography(
            roll_lengths=tuple(rolls.tolist()),
            places=tuple(MM * place for place in self.places_mm),
            depths=tuple(map(tuple, depths.tolist())),
        )

    def start(self, pattern: int) -> Array:
        """Depths (k l,) of one of some patterns, from 0 to START_PART of the largest.

        A crowning over profile and width, reliefs of tip and of one end, and twists in
        either direction.
        """
        across = np.linspace(-1.0, 1.0, len(self.roll_angles_deg))[:, None]
        along = np.linspace(-1.0, 1.0, len(self.places_mm))
        patterns = (
            0.5 * (across**2 + along**2),
            0.5 * (1.0 + across * along),
            0.5 * (1.0 - across * along),
            0.5 * (1.0 + across + 0.0 * along),
            0.5 * (1.0 + along + 0.0 * across),
        )
        return np.asarray(START_PART * patterns[pattern % len(patterns)].ravel())

    def table(self, depths_um: Array) -> dict[str, Any]:
        """Keys of the gear-set file for depths, moved so that the least is 0."""
        depths = np.asarray((depths_um - depths_um.min()).round(DEPTH_DECIMALS))
        return topography_keys(self.of(depths), self.base_radius, POINT_DECIMALS)


def topography_range(
    contact: ContactProblem,
    face: WidthContact,
    role: str,
    points: tuple[int, int],
    largest: float,
) -> TopographyRange:
    """The range of the "driver" or the "driven" gear.

    points : over the active profile and over the common face width
    largest : depth [m]
    """
    flank = zones(contact.pair, role)
    offset = face.offsets[0 if role == "driver" else 1]
    start, tip = (flank.roll_angle_deg(roll) for roll in (flank.start, flank.tip))
    angles = np.linspace(start, tip, points[0]).round(POINT_DECIMALS)
    half = 0.5 * face.width
    places = np.linspace(offset - half, offset + half, points[1]) / MM
    return TopographyRange(
        role=role,
        roll_angles_deg=tuple(angles.tolist()),
        places_mm=tuple(places.round(POINT_DECIMALS).tolist()),
        base_radius=flank.gear.base_radius,
        largest=largest / UM,
    )
