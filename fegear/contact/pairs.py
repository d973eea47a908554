"""Which tooth pairs may touch, the gaps and teeth that differ, and the back flanks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fegear.contact.offset_centers import back_lead
from fegear.contact.problem import CORNER_RANGE, ContactProblem
from lumped.common.array_types import Array, Indices
from lumped.train.pitch_errors import pair_gaps as tooth_pair_gaps
from meshes import GearPair


class PairTeeth(NamedTuple):
    """Teeth (k,) of driver and driven gear in k pairs, -1 for those like all others."""

    driver: Indices
    driven: Indices


def candidate_pairs(problem: ContactProblem, position: Array) -> Indices:
    """Pairs that may touch at some position, the reference pair first."""
    start, end = problem.pair.path
    reach = problem.corner_range or CORNER_RANGE
    low = math.ceil(start - reach - float(position.max()))
    high = math.floor(end + reach - float(position.min()))
    return np.array(sorted(range(low, high + 1), key=lambda k: (abs(k), k)), np.int64)


def pair_gaps(problem: ContactProblem, teeth: Indices, back: bool = False) -> Array:
    """Extra gaps of pairs (of any shape) from the pitch errors of their teeth [m].

    back : of back flanks, where a pair that is ahead is behind in the mirror
    """
    # a pair ahead (k > 0) came into contact earlier
    number = teeth if back else -teeth
    errors = problem.driver.pitch_errors, problem.driven.pitch_errors
    return tooth_pair_gaps(*errors, number, back)


def different_teeth(
    problem: ContactProblem, teeth: Indices, back: bool = False
) -> PairTeeth | None:
    """Teeth of pairs (of any shape) that differ from the others; None if none do.

    back : of back flanks, as in `pair_gaps`
    """
    faults = problem.driver.faults, problem.driven.faults
    if faults == (None, None):
        return None
    number = teeth if back else -teeth
    numbers = (number - 1 if back else number), number
    return PairTeeth(
        *(
            np.full(number.shape, -1) if f is None else f.different(n)
            for f, n in zip(faults, numbers, strict=True)
        )
    )


def back_side_position(pair: GearPair, position: ArrayLike) -> Array:
    """Position of the back flanks' cycle while the drive side is at `position`.

    Both gears are symmetric about their teeth, so back contact is drive contact
    in a mirror, where motion runs the other way. The driven tooth's back flank
    passes the pitch point a tooth thickness before its drive flank does.
    """
    return -(np.asarray(position, float) + back_lead(pair))


def with_back_flanks(problem: ContactProblem) -> ContactProblem:
    """The problem with the faults, leads, helix and gap that back flanks have."""
    driver, driven = (
        replace(
            flank,
            faults=flank.faults and flank.faults.on_back_flanks,
            lead=flank.lead and flank.lead.of_back_flanks,
            topography=None,  # one of drive flanks
        )
        for flank in problem.flanks
    )
    solver = problem.solver.of_back_flanks
    return replace(problem, driver=driver, driven=driven, solver=solver)
