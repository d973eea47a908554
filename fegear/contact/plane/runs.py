"""Runs of the contact kernel for chosen tooth pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pairs import PairTeeth
from fegear.contact.plane.constants import (
    NOMINAL,
    Conditions,
    kernel_constants,
    with_rootward,
)
from fegear.contact.problem import ContactProblem
from fegear.contact.tooth_faults import MISSING_GAP
from lumped.common.array_types import Array, Indices

if TYPE_CHECKING:
    from fegear.contact.plane.kernels.cycle import Constants, Workspace

# of the sine by which a corner's force is turned from its flank's normal: up to there
# what teeth yield toward the root under loads toward it is 1e-4 of their deflection
MAX_TURN_SQUARED = 1e-3


class KernelResult(NamedTuple):
    """Results of the kernel; patches and nodes are those of the last position.

    rates : of no positions where they were not asked for
    """

    teeth: Indices
    rows: np.recarray
    cells: np.recarray
    rates: np.recarray
    patches: np.recarray
    nodes: np.recarray

    def replace_at(self, places: Indices, other: KernelResult) -> None:
        """Take what another result has for some of the positions."""
        self.rows[:, places], self.cells[:, places] = other.rows, other.cells
        if self.rates.size:
            self.rates[:, places] = other.rates


def missing_pairs(problem: ContactProblem, different: PairTeeth) -> NDArray[np.bool_]:
    """Whether pairs lack a tooth of either gear, shaped as the teeth are."""
    faults = problem.driver.faults, problem.driven.faults
    missing = np.zeros(different.driver.shape, bool)
    for of_gear, teeth in zip(faults, different, strict=True):
        if of_gear is not None:
            missing |= of_gear.is_missing(teeth)
    return missing


def solve_pairs(
    problem: ContactProblem,
    teeth: Indices,
    gaps: Array,
    position: Array,
    kind: np.int64,
    targets: Array,
    conditions: Conditions = NOMINAL,
) -> KernelResult:
    """Run the kernel for chosen tooth pairs (k,), whatever its status.

    gaps : (n, k) extra gap of each pair [m]
    kind, targets : cycle.TORQUE per width [N] or cycle.STE [m], (t, n)
    conditions : teeth that differ, centres that move, friction

    Positions at which a corner bears on its mate at an angle that matters are solved
    again with the compliance that only these need.
    """
    constants = kernel_constants(problem, teeth.size, conditions)
    if conditions.friction_reversed:
        constants.mesh.friction = -constants.mesh.friction
    if conditions.teeth is not None:
        gaps = gaps + MISSING_GAP * missing_pairs(problem, conditions.teeth)
    with_rates = conditions.with_rates
    solved = solve_constants(
        constants, teeth, gaps, position, kind, targets, with_rates
    )
    places = turned_positions(solved.cells)
    full = with_rootward(constants, problem) if places.size else None
    if full is None:
        return solved
    if full.lines.size:
        full = full._replace(lines=full.lines[places])
    again = solve_constants(
        full, teeth, gaps[places], position[places], kind, targets[:, places],
        with_rates,
    )  # fmt: skip
    solved.replace_at(places, again)
    if places[-1] == position.size - 1:
        return solved._replace(patches=again.patches, nodes=again.nodes)
    return solved


def turned_positions(cells: np.recarray) -> NDArray[np.intp]:
    """Positions where a corner bears on its mate at an angle that matters.

    cells : (t, n, k) of the kernel
    """
    turned = (cells.load > 0.0) & (cells.turn**2 > MAX_TURN_SQUARED).any(axis=-1)
    return np.flatnonzero(turned.any(axis=(0, 2)))


def solve_constants(
    constants: Constants,
    teeth: Indices,
    gaps: Array,
    position: Array,
    kind: np.int64,
    targets: Array,
    with_rates: bool = False,
) -> KernelResult:
    """Run the kernel once, with gaps, kind and targets as in `solve_pairs`."""
    from fegear.contact.plane.kernels import cycle

    work = workspace(teeth.size, len(constants.grid.logarithm))
    result = empty_result(teeth, targets.shape, work, with_rates)
    # positions may be every other one of an array: kernels are compiled for whole ones
    gaps, position, targets = map(np.ascontiguousarray, (gaps, position, targets))
    places = cycle.Places(teeth, gaps, position)
    rates = result.rates if with_rates else None
    filled = result.rows, result.cells
    cycle.solve_cycle(constants, places, kind, targets, work, filled, rates)
    return result


def empty_result(
    teeth: Indices, shape: tuple[int, ...], work: Workspace, with_rates: bool
) -> KernelResult:
    """Result to be filled, for cases and positions (t, n), with a workspace's patches
    and nodes.
    """
    from fegear.contact.plane.kernels.cycle import CELL, ROW
    from fegear.contact.plane.kernels.relief_rates import RATE

    cases, positions = shape
    rated = cases, positions if with_rates else 0, teeth.size
    return KernelResult(
        teeth,
        np.zeros(shape, ROW).view(np.recarray),
        np.zeros((*shape, teeth.size), CELL).view(np.recarray),
        np.zeros(rated, RATE).view(np.recarray),
        work.patches.view(np.recarray),
        work.nodes.view(np.recarray),
    )


def workspace(pairs: int, size: int) -> Workspace:
    """State of tooth pairs with patches of `size` nodes, for the kernel."""
    from fegear.contact.plane.grid import SUPPORT
    from fegear.contact.plane.kernels.active_set import UNKNOWN
    from fegear.contact.plane.kernels.compliance import PATCH
    from fegear.contact.plane.kernels.cycle import Workspace
    from fegear.contact.plane.kernels.patches import NODE

    count = pairs * size
    return Workspace(
        patches=np.zeros(pairs, PATCH).view(np.recarray),
        nodes=np.zeros((pairs, size), NODE).view(np.recarray),
        active_pairs=np.zeros(pairs, np.int64),
        unknowns=np.zeros(count, UNKNOWN).view(np.recarray),
        C=np.empty((count, count)),
        matrix=np.empty((count, count + 2)),
        block=np.empty((SUPPORT + 1, SUPPORT)),
    )
