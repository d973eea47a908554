"""Normal forces of slices in contact at one position, at a torque or a deflection."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fegear.contact.problem import ContactFailure
from fegear.contact.width.compliance import TINY, FaceCompliance, LineParts
from fegear.contact.width.flank_changes import FlankChange
from fegear.contact.width.lines import LinesOfContact, Touches
from lumped.common.array_types import Array, Indices

SOFT_TEETH = 20.0  # ste over load per length times 1/E1' + 1/E2', of a slice
MAX_STEPS = 60
SIZE_STEP = 1e-6  # of a contact, for the slope by its size
LOAD_RTOL = 1e-10  # change of loads over the largest, at which they are solved
FLOOR = 1e-9  # of a slice's load over the mean, for the size of its contact


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
        both = np.stack([closing, fixed], axis=1)
        try:
            rate, offset = np.linalg.solve(tangent, both).T
        except np.linalg.LinAlgError:
            raise ContactFailure(
                "contact over the face width not solved: axes of the gears yield so "
                "much more than teeth that these are lost in round-off; sections and "
                "bearings of the shafts hardly hold them"
            ) from None
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

    def reach(self, solved: SliceLoads) -> float:
        """Largest gap of a part that may touch [m].

        Teeth give way under load, so that it is the transmission error where axes are
        held; axes that tilt bring parts together elsewhere.
        """
        lines = self.lines
        away = self.compliance.moved_away(lines.parts, self.spread(solved.load))
        if away is None:
            return solved.ste
        closing = np.where(np.isfinite(lines.gap), lines.closing, 1.0)
        may_touch = lines.gap < solved.ste - away / closing
        return float(lines.gap[may_touch].max(initial=solved.ste))

    def rigid_stiffness(self, solved: SliceLoads) -> Array:
        """Stiffness (11, 11) of the teeth in contact against rigid motions of gears.

        Motions are the transmission error and those of both axes, which are held here:
        what they yield is taken out of the compliance.
        """
        touches = np.flatnonzero(solved.load > 0.0)
        parts = self.parts.chosen(touches)
        wrenches = self.compliance.unit_wrenches(parts)
        tangent = solved.tangent - self.compliance.of_supports(wrenches)
        approach = np.column_stack([self.closing[touches], *(-p for p in wrenches)])
        return np.asarray(approach.T @ np.linalg.solve(tangent, approach))

    def axis_loads(self, solved: SliceLoads) -> Array:
        """Loads (2, 5) on the axes of driver and driven gear."""
        touches = np.flatnonzero(solved.load > 0.0)
        wrenches = self.compliance.unit_wrenches(self.parts.chosen(touches))
        return np.stack([solved.load[touches] @ wrench for wrench in wrenches])

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


def touching_slices(
    compliance: FaceCompliance, lines: LinesOfContact, teeth: Indices, limit: float
) -> Slices:
    """Parts that close below a transmission error [m], with their compliance.

    teeth : (k,) base pitches by which each pair is ahead
    """
    index = np.flatnonzero(lines.gap < limit)
    parts = lines.parts.chosen(index)
    smooth = compliance.between(teeth, parts)
    return Slices(compliance, lines, smooth, index, parts)


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
