"""Positions of the teeth of two gears in mesh in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lumped.common.array_types import Array


@dataclass(frozen=True)
class View:
    """A rectangle of the world that does not turn with the gears [m]."""

    x: float
    y: float
    half_height: float
    aspect: float

    @property
    def middle(self) -> Array:
        return np.array([self.x, self.y])

    @property
    def half(self) -> Array:
        """Half width and height (2,)."""
        return self.half_height * np.array([self.aspect, 1.0])

    def contains(self, points: Array) -> bool:
        """Whether the box around points (n, 2) reaches into the view."""
        low, high = points.min(axis=0), points.max(axis=0)
        low, high = low - self.middle, high - self.middle
        return bool((low < self.half).all() and (high > -self.half).all())


@dataclass(frozen=True)
class Frame:
    """From a tooth's own frame to the world: x = center + turn @ point.

    turn : (2, 2), a mirror image where the gear's drive flanks are the left ones
    """

    center: Array
    turn: Array

    def places(self, points: Array) -> Array:
        return self.center + points @ self.turn.T

    def vectors(self, vectors: Array) -> Array:
        return vectors @ self.turn.T

    def stresses(self, components: Array) -> Array:
        """Components (n, 3) as (xx, yy, xy)."""
        xx, yy, xy = components.T
        tensor = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)
        turned = np.einsum("ia,nab,jb->nij", self.turn, tensor, self.turn)
        return turned[:, [0, 1, 0], [0, 1, 1]]


def turned(angle: float) -> Array:
    """Rotation counterclockwise (2, 2)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])
