"""Many pairs of gears that differ a little: their contact over the same mesh cycle.

The compliance of the flanks is that of one contact problem. What differs are gaps:
crowning and slope of the profiles, pitch errors of the tooth pairs, and the centre
distance, which moves the line of action. An involute stays conjugate at another
centre distance, so that unmodified flanks transmit without error there, but pairs
begin and end contact elsewhere, and teeth touch at other heights.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.contact.pairs import candidate_pairs
from fegear.contact.plane.constants import (
    kernel_constants,
    patch_nodes,
    with_rootward,
)
from fegear.contact.plane.contact import PlaneContact
from fegear.contact.plane.runs import (
    solve_constants,
    turned_positions,
    workspace,
)
from fegear.contact.plane.solve import kernel_torques
from fegear.contact.problem import ContactFailure, ContactFlank, ContactProblem
from fegear.contact.width.contact import WidthContact
from fegear.gearset.modifications import FlankLead, FlankProfile
from lumped.common.array_types import Array
from meshes import GearPair


@dataclass(frozen=True)
class WidthDeviations:
    """Deviations of s pairs of gears over the face width, lengths in metres.

    lead_crowning, lead_slope : (s, 2) that come to the leads of driver and driven gear
    misalignment : (s,) gap that the axes open at the far end
    """

    lead_crowning: Array
    lead_slope: Array
    misalignment: Array


@dataclass(frozen=True)
class Variants:
    """Deviations of s pairs of gears from a contact problem, lengths in metres.

    crowning, slope : (s, 2) that come to the profiles of driver and driven gear
    gap : (s, k) extra gap of each tooth pair of `candidate_pairs`
    center_distance : (s,) its increase
    over_width : where loads vary over the face width
    """

    crowning: Array
    slope: Array
    gap: Array
    center_distance: Array
    over_width: WidthDeviations | None = None

    @property
    def count(self) -> int:
        return int(self.center_distance.size)


@dataclass(frozen=True)
class VariantContact:
    """Contact of s pairs of gears at a torque and n positions.

    ste, no_load : (s, n) transmission error under load and without [m]
    gap : (s, n, k) transmission error that closes each tooth pair [m]; infinite where
        its flanks do not face each other
    load : (s, n, k) normal force of each tooth pair [N]
    distribution : (s, b) mean load over the cycle on bands of the width, over that on
        all of it, of which the largest is K_Hbeta; of no bands where loads are uniform
    """

    ste: Array
    no_load: Array
    gap: Array
    load: Array
    distribution: Array


def with_profiles(problem: ContactProblem) -> ContactProblem:
    """The problem with profiles, and over the width leads, on both flanks.

    They are of no size where it has none.
    """
    return replace(
        problem,
        driver=_with_profile(problem.driver, problem.solver),
        driven=_with_profile(problem.driven, problem.solver),
    )


def _with_profile(
    flank: ContactFlank, solver: PlaneContact | WidthContact
) -> ContactFlank:
    lead = flank.lead
    if isinstance(solver, WidthContact):
        lead = lead or FlankLead()
    return replace(flank, profile=flank.profile or FlankProfile(), lead=lead)


def solve_variants(
    problem: ContactProblem,
    torque: float,
    position: Array,
    variants: Variants,
    report: Callable[[int], None] = lambda done: None,
) -> VariantContact:
    """Solve the contact of every pair of gears at a torque on the driver [N m].

    position : (n,) base pitches from the pitch point of the reference pair
    report : called with the number of pairs of gears that are solved

    Raises ContactFailure where no solution was found.
    """
    from fegear.contact.plane.kernels import cycle
    from fegear.contact.plane.kernels.flanks import NO_FLANK_GAP

    teeth = candidate_pairs(problem, position)
    shape = variants.count, position.size
    rows = np.zeros(shape, cycle.ROW).view(np.recarray)
    cells = np.zeros((1, position.size, teeth.size), cycle.CELL).view(np.recarray)
    gap, load = np.empty((*shape, teeth.size)), np.empty((*shape, teeth.size))
    target = kernel_torques(problem, np.array([torque]), position.size)
    constants = kernel_constants(with_profiles(problem), teeth.size)
    flanks: Any = constants.flanks
    work = workspace(teeth.size, patch_nodes(problem))
    nominal = flanks.profile.copy()
    for i in range(variants.count):
        flanks.profile.crowning[:] = nominal.crowning + variants.crowning[i]
        flanks.profile.slope[:] = nominal.slope + variants.slope[i]
        _move_centers(constants.mesh, problem, variants.center_distance[i])
        gaps = np.tile(variants.gap[i], (position.size, 1))
        cells[:] = np.zeros((), cycle.CELL)
        where = cycle.Places(teeth, gaps, position)
        results = rows[i : i + 1], cells
        cycle.solve_cycle(constants, where, cycle.TORQUE, target, work, results, None)
        places = turned_positions(cells)
        full = with_rootward(constants, problem) if places.size else None
        if full is not None:
            part = gaps[places], position[places], cycle.TORQUE, target[:, places]
            again = solve_constants(full, teeth, *part)
            rows[i, places], cells[0, places] = again.rows[0], again.cells[0]
        gap[i], load[i] = cells.gap[0], cells.load[0] * problem.face_width
        report(i + 1)
    _require_solved(rows.status)
    gap[gap >= NO_FLANK_GAP] = np.inf
    no_bands = np.empty((variants.count, 0))
    return VariantContact(rows.ste, rows.no_load, gap, load, no_bands)


def _move_centers(mesh: Any, problem: ContactProblem, increase: float) -> None:
    """Line of action and pitch point of the gears at another centre distance."""
    mesh.line_of_action, mesh.pitch_point = line_of_action(problem.pair, increase)


def line_of_action(pair: GearPair, increase: float) -> tuple[float, float]:
    """Its length, and the driver's roll length at the pitch point.

    At a centre distance that is larger by an amount [m], to the bits of `GearPair`.
    """
    bases = abs(pair.driver.base_radius + pair.driven.base_radius)
    distance = pair.center_distance + increase
    angle = math.acos(bases / distance)
    length = pair.sign * distance * math.sin(angle)
    return length, pair.driver.base_radius * math.tan(angle)


def _require_solved(status: NDArray[np.int64]) -> None:
    failed = np.argwhere(status != 0)
    if len(failed):
        raise ContactFailure(
            f"contact of pair of gears {failed[0][0] + 1} not solved at position number"
            f" {failed[0][1] + 1}: status {status[tuple(failed[0])]}"
        )
