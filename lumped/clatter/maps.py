"""Maps from impact to impact, eq. (7) to (11) of the clattering source."""

from __future__ import annotations

from typing import Literal

import numpy as np

from lumped.clatter.gearbox import RADIAL, TEETH, Group, Harmonics
from lumped.clatter.kernels import maps as kernel
from lumped.clatter.runs import Impacts, State

MapName = Literal["implicit", "fermi"]


def require_mapped(group: Group) -> None:
    """Raises ValueError for a wheel whose impacts are no map of its own."""
    names = [name for _, name in group.plays]
    wheel = group.wheels[0]
    if len(group.wheels) > 1:
        raise ValueError("meshes with another loose wheel; maps are of one wheel alone")
    if wheel.helix_angle != 0.0 or not set(names) <= {TEETH, RADIAL}:
        raise ValueError(
            "has a helix angle or an axial play; maps are of spur teeth alone"
        )
    if not isinstance(group.excitation, Harmonics):
        raise ValueError("is excited by a speed file; maps need harmonics")


def follow_map(
    group: Group, name: MapName, state: State, edge: int, count: int
) -> Impacts:
    """Impacts of teeth after one at an edge that a state has just left.

    The radial play never ends here. Fewer are found where wheels come to rest.
    """
    require_mapped(group)
    box, period = group.box, group.excitation.period
    out = np.zeros((count, 4))
    if name == "implicit":
        found = kernel.follow_implicit(box, state.time, state.v.copy(), edge, out)
    else:
        speed = float(-box.rows[0] @ state.v)
        found = kernel.follow_fermi(box, state.time, speed, out)
    out = out[:found]
    return Impacts(
        out[:, 0] * period,
        np.zeros(found, np.int64),
        out[:, 1].astype(np.int64),
        out[:, 2] / period,
        out[:, 3] / period,
    )
