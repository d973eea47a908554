"""A crack in the root fillet of a tooth."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Crack:
    """Straight crack from a point of the root fillet, over the whole face width.

    depth : length of the path from the surface [m]
    tangent_angle : angle between the tooth's axis and the tangent of the fillet where
        the crack starts [rad]
    direction : angle of the path from the tooth's axis, which points to the centre of
        the gear at 0 and across the tooth at pi/2 [rad]; None for the normal of the
        surface
    left : whether it starts in the left fillet of the tooth frame (`meshes.profile`)
    """

    depth: float
    tangent_angle: float
    direction: float | None = None
    left: bool = False
