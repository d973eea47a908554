"""Solve the contact over the face width: a normal force for each slice in contact."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fegear.contact.offset_centers import moved_lines
from fegear.contact.pairs import (
    PairTeeth,
    candidate_pairs,
    different_teeth,
    pair_gaps,
)
from fegear.contact.plane.constants import kernel_inputs, lowest_rolls
from fegear.contact.plane.kernels.patches import MIN_ROLL
from fegear.contact.problem import ContactFailure, ContactProblem, MeshPositions
from fegear.contact.result import ContactCycle, FaceLoads, empty_values
from fegear.contact.width.compliance import TINY, FaceCompliance, LineParts
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.damage import (
    DamagedPair,
    MomentaryLine,
    PairsAt,
    damaged_pairs,
    place_parts,
)
from fegear.contact.width.flank_changes import FlankChange, changed_flanks
from fegear.gearset.modifications import LEAD_SIZES
from lumped.common.array_types import Array, Indices
from lumped.common.workers import require_running

SOFT_TEETH = 20.0  # ste over load per length times 1/E1' + 1/E2', of a slice
FIRST_GUESS = 40.0  # ste over load per width times 1/E1' + 1/E2', generous
MAX_STEPS = 60
MIN_PART = 1e-6  # of half a slice that is cut off at an end of the path
PATH_MARGIN = 0.02  # base pitches from the ends of the path, as edges reach
SHORTEST = 1e-30  # line of contact [m] in place of none
SIZE_STEP = 1e-6  # of a contact, for the slope by its size
LOAD_RTOL = 1e-10  # change of loads over the largest, at which they are solved
FLOOR = 1e-9  # of a slice's load over the mean, for the size of its contact
LIMIT_GROWTH = 1.5
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
        one = np.maximum(rolls, least)
        two = np.maximum(line.length - rolls, least)
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
            arm=cosine * arms[0] - friction * arms[2],
            driven_arm=cosine * arms[1] - friction * arms[3],
            on_path=(rolls > start + margin) & (rolls < end - margin),
        )

    def with_leads(self, lines: LinesOfContact, other: FaceSolver) -> LinesOfContact:
        """Lines of contact of this problem, whose leads alone are not those of another.

        lines : of the other problem
        """
        place, closing = lines.parts.place, lines.closing / self.compliance.helix_cosine
        gap = self._gap_at(place) - other._gap_at(place)
        is_there = np.isfinite(lines.gap)
        return replace(lines, gap=lines.gap + gap / np.where(is_there, closing, 1.0))

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
                squared = gear.tip_roll_length**2 - 2.0 * gear.base_radius * arc
                roll_length = np.sqrt(np.maximum(squared, 0.0))
                depth += topography.depth(roll_length, parts.place + offset)
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
        load = np.array([torque / (cosine * pair.driver.base_radius)])
        return float(self.compliance.contact_size(load, line)[0][0])

    def candidates(self, lines: LinesOfContact, teeth: Indices, limit: float) -> Slices:
        """Parts that close below a transmission error [m], with their compliance."""
        index = np.flatnonzero(lines.gap < limit)
        parts = lines.parts.chosen(index)
        smooth = self.compliance.between(teeth, parts)
        return Slices(self.compliance, lines, smooth, index, parts)


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


@dataclass(frozen=True, eq=False)
class Slices:
    """Parts (s,) of lines that may be in contact at one position.

    smooth : their compliance without what is near a force [m/N]
    index : of each among all parts of the lines
    """

    compliance: FaceCompliance
    lines: LinesOfContact
    smooth: Array
    index: Indices
    parts: LineParts

    @cached_property
    def gap(self) -> Array:
        return self.lines.gap[self.index]

    @cached_property
    def closing(self) -> Array:
        return self.lines.closing[self.index]

    @cached_property
    def arm(self) -> Array:
        return self.lines.arm[self.index]

    @cached_property
    def rootward(self) -> Array:
        """Displacement of parts toward the roots under their own line (s, s) [m/N]."""
        return self.compliance.rootward(self.parts)

    def spread(self, values: Array) -> Array:
        """Values (s,) at their places among all parts, others 0."""
        result = np.zeros(self.lines.gap.size)
        result[self.index] = values
        return result

    def solve(
        self, torque: float, size: float, start: Array | None = None
    ) -> SliceLoads:
        """Normal forces at a torque on the driver [N m].

        size : of contacts at the torque, as in `FaceCompliance.near` [m]
        start : (s,) forces to begin with [N], such as those at another torque

        Complementarity with Newton's method: a slice's own contact softens as the
        logarithm of its load. All violated slices are exchanged together, and should
        that cycle, the first of them alone (Murty 1974).
        """
        load = np.zeros(self.gap.size) if start is None else start.copy()
        touches = load > 0.0
        if not touches.any():
            touches = self.gap <= np.sort(self.gap)[: 1 + self.gap.size // 2].max()
            load = np.where(touches, torque / self.arm[touches].sum(), 0.0)
        load *= torque / (self.arm @ load)
        matrix = self.smooth + self.compliance.near(self.parts, size)

        def newton(load: Array, touches: Touches) -> SliceLoads:
            return self._at_torque(matrix, torque, size, load, touches)

        at = f"torque {torque:g} N m"
        solved, touches = self._exchanged(matrix, newton, load, touches, at)
        return self._with_growing_contacts(solved, torque, size, touches)

    def first_guess(self, ste: float) -> Array:
        """Forces (s,) [N] to begin with at a transmission error [m]."""
        softness = self.compliance.softness * math.pi * SOFT_TEETH
        depth = np.maximum(ste - self.gap, 0.0)
        return np.asarray(depth * self.parts.length / softness)

    def press(self, ste: float, size: float, start: Array) -> Array:
        """Normal forces (s,) at a transmission error [N].

        size : of contacts, as in `FaceCompliance.near` [m]
        start : (s,) forces to begin with [N]
        """
        matrix = self.smooth + self.compliance.near(self.parts, size)

        def newton(load: Array, touches: Touches) -> SliceLoads:
            return self._at_ste(matrix, ste, size, load, touches)

        touches = (start > 0.0) & (self.gap < ste)
        if not touches.any():
            touches = self.gap < ste
        at = f"a transmission error of {1e6 * ste:g} um"
        solved, _ = self._exchanged(matrix, newton, start, touches, at)
        return np.maximum(solved.load, 0.0)

    def _exchanged(
        self,
        matrix: Array,
        newton: Callable[[Array, Touches], SliceLoads],
        load: Array,
        touches: Touches,
        at: str,
    ) -> tuple[SliceLoads, Touches]:
        """Loads by steps of Newton's method, and the slices that touch.

        at : torque or transmission error, for the message where there are none
        """
        change = math.inf
        for step in range(MAX_STEPS):
            solved = newton(load, touches)
            change = float(np.abs(solved.load - load).max() / np.abs(solved.load).max())
            load = np.maximum(solved.load, 0.0)
            violated = self._violated(matrix, solved, touches)
            if not violated.any() and change < LOAD_RTOL:
                return solved, touches
            if step > MAX_STEPS // 2 and violated.any():
                first = int(np.flatnonzero(violated)[0])
                violated = np.arange(violated.size) == first
            touches = touches ^ violated
        width_mm = 1e3 * self.compliance.face.width
        raise ContactFailure(
            f"contact over the face width of {width_mm:g} mm not solved at {at}: "
            f"loads change by {change:.2g} of the largest after {MAX_STEPS} steps"
        )

    def _linearised(
        self, matrix: Array, size: float, at: Array, touches: Touches
    ) -> tuple[Array, Array, Array]:
        """Tangent compliance of what touches, and rate and offset of its forces by ste.

        at : forces about which their own contact is linearised [N]
        """
        parts, closing = self.parts.chosen(touches), self.closing[touches]
        approach, slope = self.compliance.own_contact(at, parts, size)
        tangent = matrix[np.ix_(touches, touches)] + np.diag(slope)
        fixed = -closing * self.gap[touches] - (approach - slope * at)
        rate, offset = np.linalg.solve(tangent, np.stack([closing, fixed], axis=1)).T
        return tangent, rate, offset

    def _at_torque(
        self, matrix: Array, torque: float, size: float, load: Array, touches: Touches
    ) -> SliceLoads:
        arm = self.arm[touches]
        at = np.maximum(load[touches], FLOOR * torque / arm.sum())
        tangent, rate, offset = self._linearised(matrix, size, at, touches)
        ste = (torque - arm @ offset) / (arm @ rate)
        return self._loads(matrix, size, touches, float(ste), (tangent, rate, offset))

    def _at_ste(
        self, matrix: Array, ste: float, size: float, load: Array, touches: Touches
    ) -> SliceLoads:
        at = np.maximum(load[touches], FLOOR * max(float(load.max()), TINY))
        linear = self._linearised(matrix, size, at, touches)
        return self._loads(matrix, size, touches, ste, linear)

    def _loads(
        self,
        matrix: Array,
        size: float,
        touches: Touches,
        ste: float,
        linear: tuple[Array, Array, Array],
    ) -> SliceLoads:
        tangent, rate, offset = linear
        loads, rates = np.zeros((2, self.gap.size))
        loads[touches], rates[touches] = ste * rate + offset, rate
        by_ste = float(self.arm[touches] @ rate)
        return SliceLoads(ste, loads, rates, by_ste, size, matrix, tangent)

    def _with_growing_contacts(
        self, solved: SliceLoads, torque: float, size: float, touches: Touches
    ) -> SliceLoads:
        """The slopes with contacts that grow with the root of the torque."""
        parts, load = self.parts.chosen(touches), np.maximum(solved.load[touches], TINY)
        step, both = SIZE_STEP * size, np.ix_(touches, touches)
        near = solved.matrix[both] - self.smooth[both]
        of_own, _ = self.compliance.own_contact(load, parts, size)
        grown_near = self.compliance.near(parts, size + step)
        grown_own, _ = self.compliance.own_contact(load, parts, size + step)
        grown = (grown_near - near) @ solved.load[touches] + grown_own - of_own
        stiffer = grown / step * size / (2.0 * torque)
        by_torque = np.zeros(self.gap.size)
        by_torque[touches] = np.linalg.solve(solved.tangent, stiffer)
        slope = solved.torque_slope / (1.0 + self.arm @ by_torque)
        rate = solved.rate - by_torque * slope
        residual = self._residual(solved, size, touches)
        return replace(solved, rate=rate, torque_slope=float(slope), residual=residual)

    def slopes_of(
        self,
        solved: SliceLoads,
        changed: Sequence[LinesOfContact],
        changes: Sequence[FlankChange],
    ) -> tuple[Array, Array]:
        """Slopes by changes (c,) of the flanks, at the torque.

        Of the transmission error (c,) and of the forces (s, c) [N/m]. The conditions of
        what touches, and the torque, stay as they are:
        tangent dload = closing (dste - dgap) + dclosing (ste - gap) and
        arm^T dload + darm^T load = 0.

        changed : lines of contact of the same parts, of changed flanks
        """
        touches = np.flatnonzero(solved.load > 0.0)
        index, arm = self.index[touches], self.arm[touches]
        closing, deflection = self.closing[touches], solved.ste - self.gap[touches]
        steps = np.array([change.step for change in changes])
        gaps, closings, arms = (
            np.stack([getattr(lines, name)[index] for lines in changed], axis=1)
            for name in ("gap", "closing", "arm")
        )
        opened = closing[:, None] * (gaps - self.gap[touches, None])
        opened -= (closings - closing[:, None]) * deflection[:, None]
        turned = solved.load[touches] @ (arms - arm[:, None])
        every = np.column_stack([closing, opened])
        by_ste, *by_opening = np.linalg.solve(solved.tangent, every).T
        opening = np.array(by_opening)
        ste_slope = (opening @ arm - turned) / (by_ste @ arm)
        forces = np.zeros((self.gap.size, steps.size))
        forces[touches] = np.outer(by_ste, ste_slope) - opening.T
        return ste_slope / steps, forces / steps

    def _residual(self, solved: SliceLoads, size: float, touches: Touches) -> float:
        """Largest gap or overlap of what touches, and overlap of what does not.

        Over the largest deflection, with each part's own contact under its own load.
        """
        approach, _ = self.compliance.own_contact(
            np.maximum(solved.load, TINY), self.parts, size
        )
        yielded = solved.matrix @ solved.load + np.where(touches, approach, 0.0)
        opening = yielded - self.closing * (solved.ste - self.gap)
        violation = np.where(touches, np.abs(opening), np.maximum(-opening, 0.0))
        return float(violation.max() / self._deflection(solved))

    def _deflection(self, solved: SliceLoads) -> float:
        """Largest deflection of a slice [m]; a transmission error may have any sign."""
        return solved.ste - float(self.gap.min())

    def _violated(self, matrix: Array, solved: SliceLoads, touches: Touches) -> Touches:
        """Slices that pull, and open ones that overlap."""
        opening = self.closing * (self.gap - solved.ste) + matrix @ solved.load
        roundoff = 1e-12 * abs(self._deflection(solved))
        return np.asarray(np.where(touches, solved.load < 0.0, opening < -roundoff))


@dataclass(frozen=True, eq=False)
class SliceLoads:
    """Forces of slices (s,) at a torque.

    ste : transmission error [m]
    load : (s,) normal forces [N]; rate : (s,) their slope over ste [N/m]
    torque_slope : of the torque over ste [N]
    size : of contacts, as in `FaceCompliance.near` [m]
    matrix : compliance of slices but for their own contact [m/N]
    tangent : with its slope, of the slices in contact
    residual : of the complementarity problem, relative
    """

    ste: float
    load: Array
    rate: Array
    torque_slope: float
    size: float
    matrix: Array
    tangent: Array
    residual: float = math.nan


def solve_over_width(
    problem: ContactProblem,
    face: WidthContact,
    torques: Array,
    places: MeshPositions,
    with_slopes: bool = False,
) -> ContactCycle:
    """Contact at positive torques (t,) [N m] and positions (n,) of a cycle.

    with_slopes : whether the slopes by changes of the flanks are asked for
    """
    positions, moved, offset_gap = moved_lines(
        problem.pair, problem.offsets, places.position, places.pitch, places.back
    )
    teeth = pairs_over_width(problem, face, positions)
    numbers = teeth - places.pitch[:, None]
    gaps = pair_gaps(problem, numbers, places.back) + offset_gap[:, None]
    different = different_teeth(problem, numbers, places.back)
    solver = FaceSolver(problem, face)
    changes = tuple(changed_flanks(problem)) if with_slopes else ()
    changed_solvers = [FaceSolver(change.problem, face) for change in changes]
    cycle = _empty_cycle(solver, torques, places, teeth, changes)
    softness = sum(1.0 / flank.kernel.modulus for flank in face.flanks)
    order = np.argsort(-torques)
    for n, position in enumerate(positions):
        require_running()
        pairs = PairsAt(
            teeth,
            float(position),
            gaps[n],
            MomentaryLine(*moved[n]) if moved.size else MomentaryLine.of(problem.pair),
            different and PairTeeth(*(of_gear[n] for of_gear in different)),
        )
        lines = solver.lines(pairs)
        lines_of_changes = [
            one.with_leads(lines, solver)
            if change.field == "lead_slope"
            else one.lines(pairs)
            for change, one in zip(changes, changed_solvers, strict=True)
        ]
        no_load = float(lines.gap.min())
        if not math.isfinite(no_load):
            raise ContactFailure(f"no flanks face each other at position {position:g}")
        # from there on, so that round-off is that of the deflection
        lines, *lines_of_changes = (
            replace(one, gap=one.gap - no_load) for one in (lines, *lines_of_changes)
        )
        per_width = torques.max() / problem.pair.driver.base_radius / face.width
        limit = FIRST_GUESS * per_width * softness
        start = None
        slices = solver.candidates(lines, teeth, limit)
        for t in order:
            torque = float(torques[t])
            size = solver.contact_size(torque, lines)
            solved = slices.solve(torque, size, start)
            while solved.ste > limit:
                limit *= LIMIT_GROWTH
                slices = solver.candidates(lines, teeth, limit)
                solved = slices.solve(torque, size)
            start = np.maximum(solved.load, 0.0)
            _store(cycle, (int(t), n), slices, solved, no_load)
            if changes:
                by_change = slices.slopes_of(solved, lines_of_changes, changes)
                _store_slopes(cycle, (int(t), n), slices, changes, by_change)
    return cycle


def pairs_over_width(
    problem: ContactProblem, face: WidthContact, positions: Array
) -> Indices:
    """Pairs that may touch somewhere over the width at some of the positions."""
    half = 0.5 * problem.pair.overlap_ratio(face.width)
    reached = np.array([positions.min() - half, positions.max() + half])
    return candidate_pairs(problem.pair, reached)


def _empty_cycle(
    solver: FaceSolver,
    torques: Array,
    places: MeshPositions,
    teeth: Indices,
    changes: Sequence[FlankChange],
) -> ContactCycle:
    """Cycle to be filled in, with what is known before."""
    pair, face = solver.problem.pair, solver.face
    sizes = {"t": torques.size, "n": places.position.size, "k": teeth.size}
    sizes |= {"m": face.slices, "g": 2, "l": len(LEAD_SIZES), "c": len(changes)}
    sizes["s"] = places.position.size if changes else 0
    twist_lead = pair.driver.base_radius * face.driver.kernel.twist * face.places
    loads = empty_values(
        FaceLoads,
        sizes,
        width=face.width,
        base_helix_angle=face.driver.kernel.base_helix_angle,
        place=face.places,
        teeth=teeth,
        reference_position=places.position[:, None] - twist_lead / pair.base_pitch,
    )
    return empty_values(
        ContactCycle,
        sizes,
        torque=torques,
        position=places.position + places.pitch,
        teeth=teeth,
        base_radius=pair.driver.base_radius,
        face=loads,
    )


def _store(
    cycle: ContactCycle,
    at: tuple[int, int],
    slices: Slices,
    solved: SliceLoads,
    no_load: float,
) -> None:
    """Fill in what was solved at a torque and a position, by their indices."""
    face, lines, n = cycle.face, slices.lines, at[1]
    parts, compliance = lines.parts, slices.compliance
    cosine = compliance.helix_cosine
    count, m = face.load.shape[2:]
    force, rate = slices.spread(solved.load), slices.spread(solved.rate)

    def by_pair(values: Array) -> Array:
        return np.bincount(parts.pair, values, count).astype(float)

    cycle.ste[at], cycle.no_load[at] = no_load + solved.ste, no_load
    cycle.local_stiffness[at] = solved.torque_slope / cycle.base_radius
    cycle.residual[at] = solved.residual
    normal = by_pair(force)
    cycle.load[at], cycle.load_slope[at] = cosine * normal, cosine * by_pair(rate)
    np.minimum.at(cycle.gap[at], parts.pair, no_load + lines.gap)
    carries = normal > 0.0
    # of a pair without load that of the part that closes first
    first = np.zeros(force.size)
    order = np.argsort(-lines.gap, kind="stable")
    last_of_pair = np.zeros(count, np.int64)
    last_of_pair[parts.pair[order]] = order
    first[last_of_pair] = 1.0
    total = np.where(carries, normal, 1.0)[parts.pair]
    weight = np.where(carries[parts.pair], force / total, first)
    for gear in range(2):
        cycle.arc[(*at, slice(None), gear)] = by_pair(weight * parts.arcs[:, gear])
    cycle.closing[at] = by_pair(weight * lines.closing) / cosine
    cycle.driven_torque[at] = force @ lines.driven_arm
    cycle.friction_bending[at] = _friction_bending(slices, solved, carries)
    np.add.at(face.load[at], (parts.pair, lines.slices), force / face.slice_length)
    chosen = np.zeros((count, slices.index.size))
    chosen[slices.parts.pair, np.arange(slices.index.size)] = weight[slices.index]
    others = 1.0 - np.eye(count)
    face.coupling[at] = others * (chosen @ slices.smooth @ chosen.T) / cosine**2
    length = np.zeros((count, m))
    np.add.at(length, (parts.pair, lines.slices), parts.length)
    weighted = parts.length[:, None] * parts.arcs
    np.add.at(face.arc[at], (parts.pair, lines.slices), weighted)
    face.arc[at] /= np.maximum(length, SHORTEST)[..., None]
    pressure = compliance.pressure(force, parts)
    np.maximum.at(face.pressure[at], (parts.pair, lines.slices), pressure)
    cycle.pressure[at] = face.pressure[at].max(axis=1)
    off_path = np.zeros((count, m), bool)
    np.logical_or.at(off_path, (parts.pair, lines.slices), ~lines.on_path)
    face.on_path[n] = ~off_path


def _store_slopes(
    cycle: ContactCycle,
    at: tuple[int, int],
    slices: Slices,
    changes: Sequence[FlankChange],
    by_change: tuple[Array, Array],
) -> None:
    """Fill in slopes of the transmission error and of forces by changes of flanks."""
    ste_slope, forces = by_change
    for change, slope in zip(changes, ste_slope, strict=True):
        getattr(cycle, change.field)[(*at, *change.at)] = slope
    parts, slices_of_parts = slices.parts, slices.lines.slices[slices.index]
    per_length = forces / cycle.face.slice_length
    np.add.at(cycle.face.load_change[at], (parts.pair, slices_of_parts), per_length)


def _friction_bending(slices: Slices, solved: SliceLoads, carries: Touches) -> Array:
    """Deflection of pairs (k,) toward the roots over that along the normal, negated."""
    compliance, load, parts = slices.compliance, solved.load, slices.parts
    approach, _ = compliance.own_contact(np.maximum(load, TINY), parts, solved.size)
    of_line = np.where(parts.is_same_line, solved.matrix, 0.0)
    normal = load * (of_line @ load + approach)
    tangential = load * (slices.rootward @ load)
    toward_root, along_normal = (
        np.bincount(parts.pair, values, carries.size) for values in (tangential, normal)
    )
    safe = np.where(carries, along_normal, 1.0)
    return np.where(carries, -toward_root / safe, np.nan)
