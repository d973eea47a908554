"""What the compiled kernels know of loose wheels, by name."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
# whole ones of `ImpactWorkspace`
NUMBERS = "locked", "contact", "side", "leaving", "basis", "edge"
RECORD = 7  # columns of an impact, see `lumped.clatter.kernels.events.run`


class GroupArrays(NamedTuple):
    """Wheels that depend on each other: n coordinates q, p plays; time in periods.

    Between impacts q'' = push - fading q'; of a play low <= s <= high with
    s = ratios e(t) + rows q + own wave. A play whose width varies is two, one for each
    edge, with another edge out of reach.

    push, fading, yielding (n,) : drag and damping over the mass, and 1 over the mass
    rows (p, n), ratios, low, high, restitution (p,)
    own_order, own_cosine, own_sine (p,) : wave of a play's edge, none of order 0
    wall (p,) : the coordinate that a bearing's play is of, -1 of teeth
    turning (p,) : the coordinate of a play, which takes up its round-off
    orders, cosines, sines (h,) : harmonics of e, in whole turns of a period
    pieces (k, 6) : or else where a piece of e begins and its polynomial, degree 0 to 4;
        none with harmonics
    jerk, snap (p,) : largest third and fourth derivative of what moves a play
    near : gaps below are closed
    rest : speed below which contacts do not bounce any more
    max_impacts : impacts at an instant; more are without end
    tolerance : periods, of the time of an event
    longest : step in sustained contact of teeth, for a series to round-off
    """

    drag_acceleration: Array
    damping_rate: Array
    inverse_mass: Array
    rows: Array
    ratios: Array
    low: Array
    high: Array
    restitution: Array
    own_order: Array
    own_cosine: Array
    own_sine: Array
    wall: Numbers
    roundoff_coordinate: Numbers
    orders: Array
    cosines: Array
    sines: Array
    pieces: Array
    jerk: Array
    snap: Array
    near: float
    rest: float
    max_impacts: int
    tolerance: float
    longest: float


class ImpactWorkspace(NamedTuple):
    """Room for what a run computes at each step; see `lumped.clatter.kernels.events`.

    a, j (n,) : second and third derivatives of the coordinates; most_j, most_k (n,) :
        largest third and fourth ones up to the horizon
    locked (n,) : 1 where a bearing holds a coordinate
    s (p, 4) : plays and their derivatives; bounds (p, 2) : largest third, fourth ones
    contact, side (p,) : closed contacts: play and its edge, 1 upper or -1 lower
    leaving (p,) : the edge that a contact without speed leaves, else 0
    edge, met, total, lost (p,) : of plays struck at an instant: edge, largest speed of
        approach, impulse and energy lost; approach (p,) : speeds by contact
    delassus, inverse (p, p), b, z (p,), basis (p,), eliminated (p, p + 1) : of the
        complementarity problem
    lift (n, p), pull (n,) : accelerations by contact forces, and the largest rate of
        their rates by what moves the plays
    e (19,), drives (p, 19), x (19, n) : derivatives of e, of what moves held plays and
        of the coordinates
    """

    a: Array
    j: Array
    max_j: Array
    max_k: Array
    locked: Numbers
    s: Array
    bounds: Array
    contact: Numbers
    side: Numbers
    leaving: Numbers
    edge: Numbers
    approach_speed: Array
    impulse: Array
    dissipated: Array
    approach: Array
    delassus: Array
    inverse: Array
    b: Array
    z: Array
    basis: Numbers
    eliminated: Array
    contact_acceleration: Array
    pull: Array
    e: Array
    drives: Array
    x: Array


def work_for(n: int, p: int, terms: int) -> ImpactWorkspace:
    """Room for n coordinates, p plays and so many terms of a series."""
    shapes = {
        **dict.fromkeys(("a", "j", "max_j", "max_k", "locked", "pull"), (n,)),
        **dict.fromkeys(("contact", "side", "leaving", "b", "z", "basis"), (p,)),
        **dict.fromkeys(
            ("edge", "approach_speed", "impulse", "dissipated", "approach"), (p,)
        ),
        **dict.fromkeys(("delassus", "inverse"), (p, p)),
        "s": (p, 4),
        "bounds": (p, 2),
        "eliminated": (p, p + 1),
        "contact_acceleration": (n, p),
        "e": (terms,),
        "drives": (p, terms),
        "x": (terms, n),
    }
    kinds = {name: np.int64 if name in NUMBERS else np.float64 for name in shapes}
    room: dict[str, Any] = {k: np.zeros(v, kinds[k]) for k, v in shapes.items()}
    return ImpactWorkspace(**room)
