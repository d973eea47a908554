"""Where the faults of a gear are in a drawing of its gear set."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fegear.gearset.faults.building import roll_length_below_tip
from fegear.gearset.faults.tooth_faults import Faults
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases, rolling_sense, tooth_axis
from fegear.gearset.placing import Layout
from meshes import SpurGear
from meshes.crack import crack_points
from meshes.profile import Points, flank_points

FLANK_POINTS = 24


@dataclass(frozen=True)
class FaultyTeeth:
    """The teeth of a gear as drawn.

    first : number of tooth 0 from the one at the angle of the gear's `Place`, counted
        clockwise, on an internal gear counter-clockwise
    sense : in which teeth come into contact in that count, 1 or -1
    loaded_left : whether the loaded flank of the first mesh is on the left of a tooth
        that points up
    """

    gear: SpurGear
    faults: Faults
    first: int
    sense: int
    loaded_left: bool

    def turn(self, tooth: int) -> int:
        """Number of a tooth from the one at the angle of the gear's place."""
        return (self.first + self.sense * tooth) % self.gear.teeth

    def flank(self, tooth: int, start: float, end: float) -> Points:
        """Points (n, 2) of the loaded flank in the tooth frame [m].

        start, end : roll lengths, cut off where the tip is broken [m]
        """
        tip = roll_length_below_tip(self.gear, self.faults.broken_height(tooth))
        rolls = np.linspace(min(start, tip), min(end, tip), FLANK_POINTS)
        return self._on_side(flank_points(self.gear, rolls), self.loaded_left)

    def spalls(self) -> Iterator[tuple[int, Points]]:
        """Tooth and flank of each spall."""
        for spall in self.faults.spalls:
            ends = spall.start_roll_length, spall.end_roll_length
            yield spall.tooth, self.flank(spall.tooth, *ends)

    def worn(self) -> Iterator[tuple[int, Points]]:
        """Tooth and flank, as far as the points of its table go, of each worn tooth."""
        for tooth in range(self.gear.teeth):
            profile = self.faults.wear_of(tooth)
            if profile is not None and tooth not in self.faults.missing:
                ends = profile.roll_lengths[0], profile.roll_lengths[-1]
                yield tooth, self.flank(tooth, *ends)

    def cracks(self) -> Iterator[tuple[int, Points]]:
        """Tooth and path of each crack."""
        for crack in self.faults.cracks:
            left = self.loaded_left != crack.crack.left
            path = crack_points(self.gear, crack.crack)
            mirrored = left != crack.crack.left
            yield crack.tooth, path * [-1.0, 1.0] if mirrored else path

    @staticmethod
    def _on_side(points: Points, left: bool) -> Points:
        x, y = points.T
        return np.stack([-np.abs(x) if left else np.abs(x), y], axis=-1)


def faulty_teeth(gear_set: GearSet, placed: Layout, index: int) -> FaultyTeeth:
    """The teeth of a gear, by its index, in a layout of the gear set."""
    gear, place = gear_set.gears[index], placed.places[index]
    teeth = gear.geometry
    numbers = gear_set.meshes_of[index]
    if not numbers:
        return FaultyTeeth(teeth, gear.faults, 0, place.sense * teeth.sign, False)
    number = numbers[0]
    mesh = gear_set.meshes[number]
    drives, sense = mesh.driver == index, rolling_sense(mesh, index, place.sense)
    axis = tooth_axis(mesh, drives, place.sense, placed.directions[number])
    axis += sense * mesh_phases(gear_set)[number].value * teeth.pitch_angle
    first = round((place.tooth_angle - axis) / teeth.pitch_angle)
    return FaultyTeeth(teeth, gear.faults, first, sense, drives == (sense > 0))
