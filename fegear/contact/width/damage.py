"""Flanks without material in places, as lines of contact over the face width meet them.

Over the roll length of a flank and the place along its width a line of contact is
straight. Spalls are rectangles there, a broken corner a triangle, a broken tip a strip
and a missing tooth all of the flank. Lines are cut where they cross the edge of one, so
that what is left of them changes steadily with the position.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pairs import PairTeeth
from fegear.contact.problem import ContactProblem
from fegear.contact.tooth_faults import ToothFaults, break_tip
from fegear.contact.width.contact import WidthContact
from lumped.common.array_types import Array, Indices
from meshes import GearPair, SpurGear
from meshes.pairing import undercut_end

DRIVER = 0


class MomentaryLine(NamedTuple):
    """Line of action between the centres of the moment, as in `plane.kernels.cycle`.

    length : sum of the roll lengths of both flanks [m]
    pitch_point : the driver's roll length there [m]
    """

    length: float
    pitch_point: float

    @classmethod
    def of(cls, pair: GearPair) -> MomentaryLine:
        """The line of a pair whose centres are in place."""
        return cls(pair.line_of_action, pair.pitch_point)

    def path_ends(self, pair: GearPair) -> tuple[float, float]:
        """The driver's roll lengths between which whole flanks touch [m]."""
        start = self.length - pair.driven.tip_roll_length
        end = min(pair.driver.tip_roll_length, self.length - undercut_end(pair.driven))
        return max(start, undercut_end(pair.driver)), end

    def of_kernel(self, mesh: np.record) -> np.record:
        """The kernel's record of a mesh with this line."""
        moved = mesh.copy()
        moved.line_of_action, moved.pitch_point = self
        return moved


@dataclass(frozen=True, eq=False)
class PairsAt:
    """Tooth pairs (k,) at one position.

    teeth : (k,) base pitches by which each is ahead
    position : base pitches from the pitch point, of centres in place
    gaps : (k,) extra gaps [m]
    line : of action
    different : teeth that differ from the others, or None
    """

    teeth: Indices
    position: float
    gaps: Array
    line: MomentaryLine
    different: PairTeeth | None = None


@dataclass(frozen=True, eq=False)
class DamagedFlank:
    """The flank of a tooth that differs from the others, in one pair.

    number : of the gear, DRIVER or the driven one
    faults : of the gear; tooth : as from `ToothFaults.different`
    width : of the gear [m]; offset : its middle before that of the common width [m]
    """

    number: int
    gear: SpurGear
    faults: ToothFaults
    tooth: int
    width: float
    offset: float

    @property
    def is_missing(self) -> bool:
        return self.tooth in self.faults.missing

    @property
    def spalls(self) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
        """Roll lengths, and places from the middle of the common width, of both ends of
        spalls [m].
        """
        for spall in self.faults.spalls.get(self.tooth, ()):
            middle, half = spall.place - self.offset, 0.5 * spall.share * self.width
            yield (spall.start, spall.end), (middle - half, middle + half)

    def rolls_of(self, roll: Array, length: float) -> Array:
        """Roll lengths of this flank at roll lengths of the driver [m]."""
        return roll if self.number == DRIVER else length - roll

    @property
    def _corner(self) -> tuple[float, float, float] | None:
        """Roll length of a broken corner at its end of the width, that place, and the
        rise of its edge over the place.
        """
        corner = self.faults.broken_corners.get(self.tooth)
        if corner is None:
            return None
        sign = -1.0 if corner.is_far else 1.0
        rise = sign * (self.gear.tip_roll_length - corner.roll) / corner.length
        return corner.roll, -0.5 * sign * self.width - self.offset, rise

    def corner_rolls(self, place: Array) -> Array:
        """Roll lengths (p,) of the tip corner at places (p,) [m]."""
        whole = self.faults.corners.get(self.tooth, self.gear.tip_roll_length)
        rolls = np.full(place.size, whole)
        if self._corner is not None:
            roll, end, rise = self._corner
            rolls = np.minimum(rolls, roll + rise * (place - end))
        return rolls

    def cuts(self, middle: float, slope: float) -> Iterator[float]:
        """Places at which a line of contact may cross an edge [m].

        middle : its roll length in the middle of the common width, and slope : what it
            loses per length of the axis, on this flank
        """
        for rolls, places in self.spalls:
            yield from places
            for roll in rolls if slope else ():
                place = (middle - roll) / slope
                if places[0] < place < places[1]:
                    yield place
        if self.tooth in self.faults.corners and slope:
            yield (middle - self.faults.corners[self.tooth]) / slope
        if self._corner is not None:
            roll, end, rise = self._corner
            yield end + (self.gear.tip_roll_length - roll) / rise
            if slope + rise:
                yield (middle - roll + rise * end) / (slope + rise)

    def lacks(self, rolls: Array, place: Array) -> NDArray[np.bool_]:
        """Whether the flank is missing at roll lengths and places (p,) [m]."""
        missing = np.full(place.size, self.is_missing)
        touching = np.minimum(rolls, self.corner_rolls(place))
        for (start, end), (low, high) in self.spalls:
            of_width = (place > low) & (place < high)
            missing |= of_width & (touching >= start) & (touching <= end)
        return missing


@dataclass(frozen=True, eq=False)
class DamagedPair:
    """A tooth pair, by its index, with the flanks of it that differ from the others."""

    pair: int
    flanks: tuple[DamagedFlank, ...]

    def cuts(self, middle: float, slope: float, length: float) -> Iterator[float]:
        """Places at which its line of contact may cross an edge [m].

        middle, slope : as in `DamagedFlank.cuts`, of the driver
        length : of the line of action [m]
        """
        for flank in self.flanks:
            if flank.number == DRIVER:
                yield from flank.cuts(middle, slope)
            else:
                yield from flank.cuts(length - middle, -slope)

    def lacks(self, rolls: Array, place: Array, length: float) -> NDArray[np.bool_]:
        """Whether either flank is missing where parts (p,) touch."""
        missing = np.zeros(place.size, bool)
        for flank in self.flanks:
            missing |= flank.lacks(flank.rolls_of(rolls, length), place)
        return missing

    def path_ends(
        self, ends: tuple[float, float], place: Array, length: float
    ) -> tuple[Array, Array]:
        """Driver's roll lengths (p,) between which its flanks touch [m].

        ends : those of whole flanks
        """
        start, end = (np.full(place.size, at) for at in ends)
        for flank in self.flanks:
            corner = flank.rolls_of(flank.corner_rolls(place), length)
            if flank.number == DRIVER:
                end = np.minimum(end, corner)
            else:
                start = np.maximum(start, corner)
        return start, end


def damaged_pairs(
    problem: ContactProblem, face: WidthContact, teeth: PairTeeth | None
) -> tuple[DamagedPair, ...]:
    """Find the pairs in which a tooth differs from the others, perhaps none."""
    if teeth is None:
        return ()
    gears = problem.pair.driver, problem.pair.driven
    pairs = []
    for pair, numbers in enumerate(zip(*teeth, strict=True)):
        flanks = tuple(
            DamagedFlank(
                number, gear, flank.faults, int(tooth), face.widths[number],
                face.offsets[number],
            )
            for number, (gear, flank, tooth) in enumerate(
                zip(gears, problem.flanks, numbers, strict=True)
            )
            if flank.faults is not None and tooth >= 0
        )  # fmt: skip
        if flanks:
            pairs.append(DamagedPair(pair, flanks))
    return tuple(pairs)


def place_parts(
    kernel: tuple[np.record, np.recarray],
    patches: np.recarray,
    parts: tuple[Indices, Array, Array],
    damaged: Sequence[DamagedPair],
    lowest: tuple[float, float],
) -> None:
    """Find the closest point of each part of lines of contact.

    kernel : records of the mesh, and of the flanks of teeth like all others
    patches : (p,) records with their extra gaps
    parts : pair, driver's roll length and place of each (p,)
    lowest : roll lengths of the lowest points of contact of both gears [m]
    """
    from fegear.contact.width.places import place_slices

    mesh, flanks = kernel
    index, rolls, place = parts

    def fill(rows: Indices, of_teeth: Any) -> None:
        chosen = patches[rows]
        place_slices(mesh, of_teeth, chosen, rolls[rows])
        patches[rows] = chosen

    with_others = np.isin(index, [one.pair for one in damaged], invert=True)
    fill(np.flatnonzero(with_others), flanks)
    for one in damaged:
        of_teeth, rows = flanks.copy(), np.flatnonzero(index == one.pair)
        for flank in one.flanks:
            record = of_teeth[flank.number]
            flank.faults.change_flank(record, flank.tooth, lowest[flank.number])
        corners = [flank.corner_rolls(place[rows]) for flank in one.flanks]
        shapes, shape = np.unique(np.array(corners), axis=1, return_inverse=True)
        for number, rolls_of_shape in enumerate(shapes.T):
            for flank, roll in zip(one.flanks, rolls_of_shape, strict=True):
                break_tip(of_teeth[flank.number], float(roll))
            fill(rows[shape.ravel() == number], of_teeth)
