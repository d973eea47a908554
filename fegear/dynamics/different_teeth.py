"""Contacts of teeth that differ from the others, and of gears off their axes.

Load curves are those of a pair alone with its own two teeth. What is left of a fault
elsewhere is left out: a crack hardly changes how its neighbours yield under their own
loads, and changes by some per cent how they yield under the load of its tooth. A centre
off its axis is a gap of all pairs of a mesh that varies over the turn; how far it moves
the points of contact and the ends of the path is of higher order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fegear.contact.offset_centers import moved_lines
from fegear.contact.pair_load_curves import (
    PairLoadCurves,
    ToothLoadCurves,
    tooth_load_curves,
)
from fegear.contact.pairs import back_side_position, different_teeth, with_back_flanks
from fegear.contact.problem import ContactProblem
from fegear.contact.tooth_faults import ToothFaults
from lumped.common.array_types import Array, Indices

# Change of a tooth's compliance, over the largest one of its gear, below which the
# tooth counts as whole: that beside a crack is 0.5 %
MIN_CHANGE = 0.02


@dataclass(frozen=True, eq=False)
class DifferentTeeth:
    """What differs on one side of a mesh in its cycles.

    curves : of pairs of each two teeth that differ
    number : (k, n) of these from 1 for each contact, 0 for teeth like the others
    gap : (m, p) by which centres off their axes open all pairs in m cycles [m]
    """

    curves: tuple[ToothLoadCurves, ...]
    number: Indices
    gap: Array

    @property
    def cycles(self) -> int:
        """Cycles of the mesh after which all of it repeats."""
        return math.lcm(self.number.shape[1], len(self.gap))


def side_differences(
    problem: ContactProblem,
    position: Array,
    alike_curves: PairLoadCurves,
    back: bool = False,
) -> DifferentTeeth | None:
    """What differs on a side of a mesh; None where teeth are alike and centred.

    position : (n,) of the drive side over a cycle
    alike_curves : of the other teeth
    """
    if back:
        problem = with_back_flanks(problem)
    gap = _gap_of_offset_centers(problem, position, back)
    number, teeth = _number_tooth_pairs(problem, alike_curves.pair_offsets, back)
    if not (teeth or gap.any()):
        return None
    curves = (
        tooth_load_curves(problem, position, alike_curves, tooth_pair, back)
        for tooth_pair in teeth
    )
    return DifferentTeeth(tuple(curves), number, gap)


def _gap_of_offset_centers(
    problem: ContactProblem, position: Array, back: bool
) -> Array:
    """Gap (m, p) in the m cycles after which it repeats [m]."""
    pair = problem.pair
    offsets = problem.offsets
    turns = [
        gear.teeth
        for gear, offset in zip((pair.driver, pair.driven), offsets, strict=True)
        if offset is not None
    ]
    cycles = np.arange(math.lcm(*turns))
    side_position = back_side_position(pair, position) if back else position
    pitch_numbers = np.repeat(-cycles if back else cycles, position.size)
    lines = moved_lines(
        problem.pair,
        problem.offsets,
        np.tile(side_position, cycles.size),
        pitch_numbers,
        back,
    )
    return lines.gap.reshape(cycles.size, -1)


def _number_tooth_pairs(
    problem: ContactProblem, pair_offsets: Indices, back: bool
) -> tuple[Indices, list[tuple[int, int]]]:
    """Numbers (k, n) of the pairs' teeth in the cycles, and the teeth by number."""
    faults = problem.driver.faults, problem.driven.faults
    cycles = np.arange(math.lcm(*(f.teeth for f in faults if f is not None)))
    pair = cycles - pair_offsets[:, None]
    different = different_teeth(problem, pair if back else -pair, back)
    if different is None:
        return np.zeros((pair_offsets.size, 1), np.int64), []
    unchanged_teeth = [_hardly_changed_teeth(gear_faults) for gear_faults in faults]
    teeth = np.stack(
        [
            np.where(np.isin(tooth, unchanged), -1, tooth)
            for tooth, unchanged in zip(different, unchanged_teeth, strict=True)
        ],
        axis=-1,
    )
    distinct_pairs, number = np.unique(
        teeth.reshape(-1, 2), axis=0, return_inverse=True
    )
    number = number.reshape(pair.shape)
    # teeth like the others come first, where there are any
    alike_pair = (-1, -1)
    tooth_pairs = [(int(driver), int(driven)) for driver, driven in distinct_pairs]
    if tooth_pairs[0] != alike_pair:
        tooth_pairs, number = [alike_pair, *tooth_pairs], number + 1
    return number, tooth_pairs[1:]


def _hardly_changed_teeth(faults: ToothFaults | None) -> list[int]:
    """Teeth that only a crack of another one changes, by little."""
    if faults is None or faults.change is None:
        return []
    largest_changes = {}
    for tooth in faults.damaged:
        index = faults.clockwise_tooth(tooth)
        largest_changes[tooth] = float(
            np.abs(faults.change.block(index, index)[0]).max()
        )
    least_change = MIN_CHANGE * max(largest_changes.values(), default=0.0)
    return [
        tooth
        for tooth in largest_changes
        if largest_changes[tooth] < least_change
        and tooth not in faults.with_other_flanks
    ]
