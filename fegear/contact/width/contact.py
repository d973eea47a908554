"""Contact over the face width: what it adds to a contact problem."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from fegear.contact.width.supports import AxisSupports
from fegear.elasticity.wide_flank import WideFlank
from fegear.gearset.modifications import FlankLead
from lumped.common.array_types import Array
from lumped.common.short_repr import ShortRepr


@dataclass(frozen=True, kw_only=True, eq=False)
class WidthContact(ShortRepr):
    """Contact over the face width in slices of equal length.

    driver, driven : compliance over the width of each gear
    width : common face width [m]
    offsets : middle of the common width from the middle of either gear [m]
    gap, back_gap : (slices,) along the line of action that belongs to neither gear, of
        drive flanks and of back flanks [m]
    supports : axes that yield; none for axes that are held
    far : the far half, where this is the near half of double helical gears
    groove : between both [m]
    """

    positions_at_once: ClassVar[int] = 32

    driver: WideFlank
    driven: WideFlank
    width: float
    gap: Array
    back_gap: Array
    offsets: tuple[float, float] = (0.0, 0.0)
    supports: AxisSupports | None = None
    far: WidthContact | None = None
    groove: float = 0.0

    def __post_init__(self) -> None:
        twist = (
            self.driver.kernel.base_helix_angle + self.driven.kernel.base_helix_angle
        )
        if self.slices < 2:  # one slice is that of uniform loads
            raise ValueError(f"slices = {self.slices}; must be at least 2")
        if abs(twist) > 1e-9:
            raise ValueError("helix angles on the base circles must be opposite")
        for flank, offset in zip(self.flanks, self.offsets, strict=True):
            if 0.5 * self.width + abs(offset) > 0.5 * flank.width * (1.0 + 1e-9):
                raise ValueError(
                    f"width = {self.width} at {offset}; must be within {flank.width}"
                )

    @property
    def flanks(self) -> tuple[WideFlank, WideFlank]:
        return self.driver, self.driven

    @property
    def widths(self) -> tuple[float, float]:
        """Face widths of both gears [m]."""
        return self.driver.width, self.driven.width

    @property
    def slices(self) -> int:
        return len(self.gap)

    @cached_property
    def places(self) -> Array:
        """Middles of the slices (slices,) from the middle of the common width [m]."""
        return slice_places(self.width, self.slices)

    def gap_at(self, place: Array) -> Array:
        """Gap at places (p,) from the middle of the common width [m].

        Linear between the middles of slices, and beyond the outer ones.
        """
        step = self.width / self.slices
        first = np.clip(np.floor((place - self.places[0]) / step), 0, self.slices - 2)
        index = first.astype(np.int64)
        part = (place - self.places[index]) / step
        return np.asarray((1.0 - part) * self.gap[index] + part * self.gap[index + 1])

    def gap_with(self, leads: tuple[FlankLead | None, ...], place: Array) -> Array:
        """Gap at places (p,) with the leads of driver and driven gear [m]."""
        gap = self.gap_at(place)
        for lead, offset, width in zip(leads, self.offsets, self.widths, strict=True):
            if lead is not None:
                gap = gap + lead.depth(place + offset, width)
        return gap

    @property
    def mirrored(self) -> WidthContact:
        """The contact in a mirror that has the axes in it."""
        return replace(
            self,
            driver=self.driver.mirrored,
            driven=self.driven.mirrored,
            far=self.far and self.far.mirrored,
        )

    @property
    def of_back_flanks(self) -> WidthContact:
        """The contact of the other flanks, in that mirror."""
        if self.supports is not None:
            raise ValueError("axes that yield are those of drive flanks")
        return replace(
            self.mirrored,
            gap=self.back_gap,
            back_gap=self.gap,
            far=self.far and self.far.of_back_flanks,
        )

    @property
    def halves(self) -> tuple[WidthContact, ...]:
        """Both halves of double helical gears, else the contact itself."""
        return (self,) if self.far is None else (replace(self, far=None), self.far)


def slice_places(width: float, slices: int) -> Array:
    """Middles of slices (slices,) of a width from its middle [m]."""
    return width * ((np.arange(slices) + 0.5) / slices - 0.5)
