"""Lines of contact over the face width, in parts of slices, before they are loaded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pairs import candidate_pairs
from fegear.contact.plane.constants import kernel_inputs, lowest_rolls
from fegear.contact.plane.kernels.patches import MIN_ROLL
from fegear.contact.problem import ContactProblem
from fegear.contact.width.compliance import FaceCompliance, LineParts
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.damage import (
    DamagedPair,
    PairsAt,
    damaged_pairs,
    place_parts,
)
from fegear.contact.width.supports import roll_lengths
from lumped.common.array_types import Array, Indices
from meshes import SpurGear

MIN_PART = 1e-6  # of half a slice that is cut off at an end of the path
PATH_MARGIN = 0.02  # base pitches from the ends of the path, as edges reach
Touches = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class LinesOfContact:
    """Parts (p,) of the lines of contact of all pairs at one position.

    A slice of the width has one part, or two where its line leaves the path.

    parts : their places and shapes
    slices : slice of the width that each is of
    gap : transmission error that closes them [m], infinite where no flank is opposite
    closing : normal approach per transmission error
    arm, driven_arm : torque per normal force about driver and driven centre [m]
    on_path : whether flanks touch there, away from the ends of the path
    """

    parts: LineParts
    slices: Indices
    gap: Array
    closing: Array
    arm: Array
    driven_arm: Array
    on_path: Touches


@dataclass(frozen=True, eq=False)
class FaceSolver:
    """Contact over the face width of a problem, at one position after another."""

    problem: ContactProblem
    face: WidthContact

    @cached_property
    def compliance(self) -> FaceCompliance:
        pair = self.problem.pair
        return FaceCompliance(self.face, (pair.driver, pair.driven))

    @cached_property
    def _kernel(self) -> tuple[np.record, np.recarray]:
        return kernel_inputs(self.problem)[:2]

    def rolls(self, pairs: PairsAt) -> tuple[Array, float]:
        """The driver's roll lengths (k,) of pairs in the middle of the width [m].

        And what they lose per length of the axis: the teeth turn with the helix, and
        the path is passed sooner or later.
        """
        pair = self.problem.pair
        way = pair.base_pitch * (pairs.position + pairs.teeth)
        middle = np.asarray(pairs.line.pitch_point + way, float)
        return middle, pair.driver.base_radius * self.face.driver.kernel.twist

    def lines(self, pairs: PairsAt) -> LinesOfContact:
        """Parts of the lines of pairs (k,) at a position."""
        from fegear.contact.plane.kernels.compliance import PATCH
        from fegear.contact.plane.kernels.flanks import NO_FLANK_GAP

        pair, line = self.problem.pair, pairs.line
        middle, slope = self.rolls(pairs)
        ends = line.path_ends(pair)
        damaged = damaged_pairs(self.problem, self.face, pairs.different)
        cuts = _cuts((middle, slope), line.length, ends, damaged)
        index, slices, low, high = self._parts_of_slices(middle.size, cuts)
        place = 0.5 * (low + high)
        rolls = middle[index] - slope * place
        patches = np.zeros(rolls.size, PATCH).view(np.recarray)
        patches.extra_gap = pairs.gaps[index] + self._gap_at(place)
        mesh, flanks = self._kernel
        kernel, lowest = (line.of_kernel(mesh), flanks), lowest_rolls(self.problem)
        place_parts(kernel, patches, (index, rolls, place), damaged, lowest)
        friction = self.problem.friction * patches.sliding_sign
        arms, is_driver = patches.moment_arms.T, (patches.master == 0)[:, None]
        nearer = np.stack([patches.arc, patches.mate_arc], axis=1)
        cosine = self.compliance.helix_cosine
        least = MIN_ROLL * abs(line.length)
        one = _curvature_radius(pair.driver, rolls, least)
        two = _curvature_radius(pair.driven, line.length - rolls, least)
        parts = LineParts(
            pair=index,
            place=place,
            length=(high - low) / cosine,
            arcs=np.where(is_driver, nearer, nearer[:, ::-1]),
            radius=one * two / (one + two) / cosine,
            angle=np.abs(patches.tilt[:, 1]),
        )
        is_there = patches.closing_ste < NO_FLANK_GAP
        start, end = (np.full(rolls.size, at) for at in ends)
        for teeth in damaged:
            rows = np.flatnonzero(index == teeth.pair)
            at = rolls[rows], place[rows]
            is_there[rows] &= ~teeth.lacks(*at, line.length)
            start[rows], end[rows] = teeth.path_ends(ends, place[rows], line.length)
        closing = np.where(is_there, arms[0] / pair.driver.base_radius, 1.0)
        gap = patches.closing_ste + self._depth_at(parts) / closing
        margin = PATH_MARGIN * pair.base_pitch
        return LinesOfContact(
            parts=parts,
            slices=slices,
            gap=np.where(is_there, gap, np.inf),
            closing=cosine * arms[0] / pair.driver.base_radius,
            arm=pair.driver.sign * (cosine * arms[0] - friction * arms[2]),
            driven_arm=pair.driven.sign * (cosine * arms[1] - friction * arms[3]),
            on_path=(rolls > start + margin) & (rolls < end - margin),
        )

    def with_gaps(self, lines: LinesOfContact, other: FaceSolver) -> LinesOfContact:
        """Lines of contact of this problem, whose gaps alone are not those of another.

        By other leads or topographies.

        lines : of the other problem
        """
        place, closing = lines.parts.place, lines.closing / self.compliance.helix_cosine
        gap = self._gap_at(place) - other._gap_at(place)
        if self.problem.topographies != other.problem.topographies:
            gap += self._depth_at(lines.parts) - other._depth_at(lines.parts)
        is_there = np.isfinite(lines.gap)
        return replace(lines, gap=lines.gap + gap / np.where(is_there, closing, 1.0))

    @property
    def is_moved_by_torque(self) -> bool:
        """Whether loads elsewhere move the axes, in proportion to the torque."""
        supports = self.face.supports
        return supports is not None and supports.are_moved

    def moved(
        self, lines: Sequence[LinesOfContact], torque: float
    ) -> tuple[list[LinesOfContact], float]:
        """Lines with gaps as loads elsewhere leave them, counted from the least one.

        lines : of the same parts, the least gap is that of the first
        torque : on the driver [N m]

        Returns the lines, and the least gap [m].
        """
        changed = list(lines)
        if self.is_moved_by_torque:
            changed = [self._loaded_elsewhere(one, torque) for one in lines]
        first = float(changed[0].gap.min())
        return [replace(one, gap=one.gap - first) for one in changed], first

    def _loaded_elsewhere(self, lines: LinesOfContact, torque: float) -> LinesOfContact:
        closing = np.where(np.isfinite(lines.gap), lines.closing, 1.0)
        gap = torque * self.compliance.support_gap(lines.parts) / closing
        return replace(lines, gap=lines.gap + gap)

    def _gap_at(self, place: Array) -> Array:
        """Gap of misaligned axes and leads (p,) along the line of action [m].

        place : (p,) from the middle of the common width [m]
        """
        return self.face.gap_with(self.problem.leads, place)

    def _depth_at(self, parts: LineParts) -> Array:
        """Depth of both topographies (p,) where parts touch [m]."""
        depth, pair = np.zeros(parts.place.size), self.problem.pair
        of_gears = zip(
            (pair.driver, pair.driven),
            self.problem.topographies,
            self.face.offsets,
            parts.arcs.T,
            strict=True,
        )
        for gear, topography, offset, arc in of_gears:
            if topography is not None:
                rolls = roll_lengths(gear, arc)
                depth += topography.depth(rolls, parts.place + offset)
        return depth

    def _parts_of_slices(
        self, pairs: int, cuts: Sequence[Array]
    ) -> tuple[Indices, Indices, Array, Array]:
        """Pair, slice and ends [m] of the parts of all slices of pairs (k,).

        cuts : places (k,) at which lines are cut [m], NaN for none
        """
        face = self.face
        half = 0.5 * face.width / face.slices
        low = np.broadcast_to(face.places - half, (pairs, face.slices)).ravel()
        high = low + 2.0 * half
        index = np.repeat(np.arange(pairs), face.slices)
        slices = np.tile(np.arange(face.slices), pairs)
        for of_pairs in cuts:
            cut = of_pairs[index]
            margin = MIN_PART * half
            inside = np.flatnonzero((cut > low + margin) & (cut < high - margin))
            index = np.concatenate([index, index[inside]])
            slices = np.concatenate([slices, slices[inside]])
            low = np.concatenate([low, cut[inside]])
            high = np.concatenate([high, high[inside]])
            high[inside] = cut[inside]
        return index, slices, low, high

    def contact_size(self, torque: float, lines: LinesOfContact) -> float:
        """x of contacts in `FaceCompliance` at a torque on the driver [m].

        That at the pitch point under the mean load of all lines on the path: what
        larger loads change is in a part's own share.
        """
        pair, cosine = self.problem.pair, self.compliance.helix_cosine
        carries = lines.on_path & np.isfinite(lines.gap)
        length = float(lines.parts.length[carries].sum())
        one, two = pair.pitch_point, pair.line_of_action - pair.pitch_point
        line = LineParts(
            pair=np.zeros(1, np.int64),
            place=np.zeros(1),
            length=np.array([length or self.face.width / cosine]),
            arcs=np.zeros((1, 2)),
            radius=np.array([one * two / (one + two) / cosine]),
            angle=np.zeros(1),
        )
        load = np.array([torque / (cosine * pair.driver_arm)])
        return float(self.compliance.contact_size(load, line)[0][0])


def _cuts(
    lines: tuple[Array, float],
    length: float,
    ends: tuple[float, float],
    damaged: Sequence[DamagedPair],
) -> list[Array]:
    """Places (k,) at which lines of pairs (k,) leave the path or cross edges [m].

    Cut there, the parts with material grow steadily with the position.

    lines : roll lengths (k,) and slope, as of `FaceSolver.rolls`
    length : of the line of action [m]
    ends : driver's roll lengths of the ends of the path [m]
    """
    middle, slope = lines
    cuts = [(middle - end) / slope for end in ends if slope]
    for one in damaged:
        for place in one.cuts(float(middle[one.pair]), slope, length):
            of_pairs = np.full(middle.size, math.nan)
            of_pairs[one.pair] = place
            cuts.append(of_pairs)
    return cuts


def pairs_over_width(
    problem: ContactProblem, face: WidthContact, positions: Array
) -> Indices:
    """Pairs that may touch somewhere over the width at some of the positions."""
    half = 0.5 * problem.pair.overlap_ratio(face.width)
    reached = np.array([positions.min() - half, positions.max() + half])
    return candidate_pairs(problem, reached)


def _curvature_radius(gear: SpurGear, rolls: Array, least: float) -> Array:
    """Radii of curvature at roll lengths, from the least one; negative if concave."""
    return rolls if gear.sign < 0 else np.maximum(rolls, least)
