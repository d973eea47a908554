"""Whether a motion has become periodic, by the rules of the lumped models."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lumped.kernels.settling import judge

Array = NDArray[np.float64]
GRAIN = 1e-11  # of the deflection, that contact solutions leave open in a period


class Settling:
    """Sections of a motion at the start of its periods.

    shapes : (m, n) deflection of each mesh per coordinate
    angular : (n,) by which velocities are divided [rad/s]
    """

    def __init__(
        self, shapes: Array, angular: Array, tolerance: float, multiples: int
    ) -> None:
        self._shapes, self._angular, self._tolerance = shapes, angular, tolerance
        self._sections = np.zeros((2 * multiples + 2, 2, angular.size))
        self._scale = np.empty(shapes.shape[0])
        self._calm = 0
        self.period = 0
        self.multiple = 0
        self.done = False

    def begin(self, place: Array, velocity: Array) -> None:
        self._sections[0] = place, velocity / self._angular

    def add(self, place: Array, velocity: Array, deflection: Array) -> None:
        """After a period with mesh deflections (steps, m)."""
        self.period += 1
        slot = self.period % len(self._sections)
        self._sections[slot] = place, velocity / self._angular
        ends = np.array([deflection.min(axis=0), deflection.max(axis=0)])
        noise = GRAIN * np.abs(ends).max(axis=0)
        self.multiple, self._calm, self.done = judge(
            self._sections,
            self.period,
            self._shapes,
            ends,
            noise,
            self._scale,
            self._tolerance,
            self.multiple,
            self._calm,
        )
