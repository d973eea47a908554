"""Maps from impact to impact, eq. (7) to (11) of the clattering source."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from lumped.clatter.gearbox import RADIAL, TEETH, Harmonics
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import Impacts, State
from lumped.clatter.kernels import impact_maps as kernel
from lumped.common.array_types import Array

NEIGHBOUR_DISTANCE = 1e-7  # distance at which a neighbour is held, in periods and plays
TRANSIENT_IMPACTS = 100  # impacts before an exponent is measured
MapName = Literal["implicit", "fermi"]


def require_mapped(group: WheelGroup) -> None:
    """Raise ValueError for a wheel whose impacts do not form a map of their own."""
    names = [name for _, name in group.plays]
    wheel = group.wheels[0]
    if len(group.wheels) > 1:
        raise ValueError("meshes with another loose wheel; maps are of one wheel alone")
    if wheel.helix_angle != 0.0 or not set(names) <= {TEETH, RADIAL}:
        raise ValueError(
            "has a helix angle or an axial play; maps are of spur teeth alone"
        )
    if wheel.variation is not None:
        raise ValueError("has a play of teeth that varies; maps need a constant one")
    if not isinstance(group.excitation, Harmonics):
        raise ValueError("is excited by a speed file; maps need harmonics")


def follow_map(
    group: WheelGroup, name: MapName, state: State, edge: int, count: int
) -> Impacts:
    """Compute impacts of teeth after one at an edge that a state has just left.

    The state is advanced to the last impact, without the positions of the wheels. The
    radial play is unlimited here. There are fewer impacts if wheels come to rest.
    """
    require_mapped(group)
    rows = _advance(group, name, state, edge, count)
    bounce, period = group.box.restitution[0], group.excitation.period
    time, side, speed, impulse = rows.T
    return Impacts(
        time * period,
        np.zeros(len(rows), np.int64),
        side.astype(np.int64),
        speed / period,
        impulse / period,
        0.5 * (1.0 - bounce) * speed * impulse / period**2,
    )


def map_exponent(
    group: WheelGroup, name: MapName, state: State, edge: int, count: int
) -> float:
    """Largest Lyapunov exponent of a map per impact, over a number of impacts.

    A neighbour is held close in times and speeds after each impact, as in
    `lumped.clatter.chaos.lyapunov_exponent`. The exponent is NaN if wheels come to
    rest. No exponent per time exists, since flights of the Fermi accelerator have no
    mean duration.
    """
    require_mapped(group)
    scale = np.abs(group.box.rows[0]) / (group.box.high[0] - group.box.low[0])
    reference, other = state.copy(), state.copy()
    other.clock[1] += NEIGHBOUR_DISTANCE
    total = 0.0
    for number in range(-TRANSIENT_IMPACTS, count):
        other.clock[0] -= reference.clock[0]  # so that round-off of times stays small
        reference.clock[0] = 0.0
        rows = _advance(group, name, reference, edge, 1)
        if not len(rows) or not len(_advance(group, name, other, edge, 1)):
            return math.nan
        edge, velocity_shift = int(rows[0, 1]), other.v - reference.v
        time_shift = other.time - reference.time
        separation = math.hypot(
            time_shift, float(np.linalg.norm(scale * velocity_shift))
        )
        if separation == 0.0:
            return -math.inf
        if number >= 0:
            total += math.log(separation / NEIGHBOUR_DISTANCE)
        other = reference.copy()
        other.clock[1] += time_shift * NEIGHBOUR_DISTANCE / separation
        other.v += velocity_shift * NEIGHBOUR_DISTANCE / separation
    return total / count


def _advance(
    group: WheelGroup, name: MapName, state: State, edge: int, count: int
) -> Array:
    """Rows of the kernels for the impacts that exist; the state is advanced."""
    follow = kernel.follow_implicit if name == "implicit" else kernel.follow_fermi
    out = np.zeros((count, 4))
    rows: Array = out[: follow(group.box, state.clock[1], state.v, edge, out)]
    rows[:, 0] += state.clock[0]
    if len(rows):
        state.clock[1], state.clock[0] = math.modf(rows[-1, 0])
    return rows
