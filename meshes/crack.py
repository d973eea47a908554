"""Cracks at the root of a tooth: their path through the tooth, and what is refused.

A crack begins on a fillet, where the tangent of the fillet makes a stated angle with
the tooth's centre line, and follows a straight or a given path into the body. Points
are in the tooth frame of `meshes.profile`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True, kw_only=True)
class Crack:
    """Crack at the root of a tooth, open at a fillet.

    Parameters
    ----------
    depth : float
        Length along its path from the fillet to the tip [m].
    tangent_angle : float
        The crack begins where the tangent of the fillet makes this angle with the
        tooth's centre line [rad].
    direction : float, optional
        Angle between a straight path, from the fillet on, and the centre line toward
        the hub [rad]: 0 runs down along the tooth, pi/2 straight across. By default the
        path follows the inward normal of the fillet.
    left : bool
        Whether the crack begins at the left fillet, seen with the tooth pointing up,
        instead of the right one.
    path : tuple of (float, float), optional
        Further points (x, y) of a given path in the tooth frame [m], which the crack
        follows as far as its depth; excludes `direction`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its limits.
    """

    depth: float
    tangent_angle: float = math.radians(30.0)
    direction: float | None = None
    left: bool = False
    path: tuple[tuple[float, float], ...] | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.depth < math.inf:
            raise ValueError(f"depth = {1e3 * self.depth:g} mm; must be positive")
        angle = math.degrees(self.tangent_angle)
        if not 0.0 < angle < 90.0:
            raise ValueError(f"tangent_angle = {angle:g} deg; allowed above 0, below 90")
        if self.direction is not None:
            if self.path is not None:
                raise ValueError("direction: only without path, which has its own")
            angle = math.degrees(self.direction)
            if not 0.0 <= angle <= 180.0:
                raise ValueError(f"direction = {angle:g} deg; allowed 0 to 180")
        if self.path is not None:
            if not self.path:
                raise ValueError("path: at least one point is needed")
            if not all(map(math.isfinite, sum(self.path, ()))):
                raise ValueError("path: its coordinates must be finite")

    @property
    def mirrored(self) -> Crack:
        """The same crack at the other fillet, mirrored at the tooth's centre line."""
        path = self.path and tuple((-x, y) for x, y in self.path)
        return replace(self, left=not self.left, path=path)
