"""Contact that is uniform over the face width, in patches across the flanks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fegear.gearset.modifications import FlankLead
from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, kw_only=True)
class PlaneContact(ShortRepr):
    """Patches of nodes across the flanks.

    nodes : of the contact patch of each tooth pair
    """

    positions_at_once: ClassVar[int] = 2048

    nodes: int = 25

    def __post_init__(self) -> None:
        if self.nodes < 5:
            raise ValueError(f"nodes = {self.nodes}; must be at least 5")

    @property
    def widths(self) -> tuple[float, float]:
        """None: loads are uniform."""
        return 0.0, 0.0

    @property
    def places(self) -> Array:
        """The middle of the width, that of one slice (1,) [m]."""
        return np.zeros(1)

    def gap_with(self, _leads: tuple[FlankLead | None, ...], place: Array) -> Array:
        """No gap at places (p,) over the width [m]."""
        return np.zeros_like(place)

    @property
    def of_back_flanks(self) -> PlaneContact:
        """Itself: both flanks of a tooth are alike."""
        return self
