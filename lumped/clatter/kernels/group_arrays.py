"""Records of loose wheels for the compiled kernels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from lumped.common.array_types import Array, Indices

# of `ImpactWorkspace`
INTEGER_FIELDS = "locked", "contact", "side", "leaving", "basis", "edge"
# Columns of an impact, see `lumped.clatter.kernels.events.run_events`
RECORD_COLUMNS = 7


class GroupArrays(NamedTuple):
    """Wheels that depend on each other: n coordinates q, p plays; time in periods.

    Between impacts q'' = drag_acceleration - damping_rate q'; for a play,
    low <= s <= high with s = ratios e(t) + rows q + own wave. A play whose width
    varies counts as two, one for each edge, with the other edge out of reach.

    drag_acceleration, damping_rate, inverse_mass (n,) : drag and damping over the mass,
        and 1 over the mass
    rows (p, n), ratios, low, high, restitution (p,)
    own_order, own_cosine, own_sine (p,) : wave of a play's edge, none of order 0
    wall (p,) : coordinate of a bearing's play, -1 for teeth
    roundoff_coordinate (p,) : coordinate of a play, which takes up its round-off
    orders, cosines, sines (h,) : harmonics of e, in whole turns of a period
    pieces (k, 6) : start of each piece of e and its polynomial, degree 0 to 4; empty
        with harmonics
    jerk, snap (p,) : largest third and fourth derivative of what moves a play
    closed_gap : gap below which contacts are closed
    resting_speed : speed below which contacts no longer bounce
    max_impacts : number of impacts at an instant after which none bounces
    tolerance : periods, of the time of an event
    max_held_step : step in sustained contact of teeth, for a series to round-off
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
    wall: Indices
    roundoff_coordinate: Indices
    orders: Array
    cosines: Array
    sines: Array
    pieces: Array
    jerk: Array
    snap: Array
    closed_gap: float
    resting_speed: float
    max_impacts: int
    tolerance: float
    max_held_step: float


class ImpactWorkspace(NamedTuple):
    """Workspace of a run; see `lumped.clatter.kernels.events`.

    a, j (n,) : second and third derivatives of the coordinates; max_j, max_k (n,) :
        largest third and fourth ones up to the horizon
    locked (n,) : 1 where a bearing holds a coordinate
    s (p, 4) : plays and their derivatives; bounds (p, 2) : largest third, fourth ones
    contact, side (p,) : closed contacts: play and its edge, 1 upper or -1 lower
    leaving (p,) : the edge that a contact without speed leaves, else 0
    edge, approach_speed, impulse, dissipated (p,) : of plays struck at an instant:
        edge, largest speed of approach, impulse and energy
    approach (p,) : speeds by contact
    delassus, inverse (p, p), b, z (p,), basis (p,), eliminated (p, p + 1) : of the
        complementarity problem
    contact_acceleration (n, p), pull (n,) : accelerations by contact forces, and the
        largest rate of their rates by the excitation
    e (19,), drives (p, 19), x (19, n) : derivatives of e, of what moves held plays and
        of the coordinates
    """

    a: Array
    j: Array
    max_j: Array
    max_k: Array
    locked: Indices
    s: Array
    bounds: Array
    contact: Indices
    side: Indices
    leaving: Indices
    edge: Indices
    approach_speed: Array
    impulse: Array
    dissipated: Array
    approach: Array
    delassus: Array
    inverse: Array
    b: Array
    z: Array
    basis: Indices
    eliminated: Array
    contact_acceleration: Array
    pull: Array
    e: Array
    drives: Array
    x: Array


def new_workspace(n: int, p: int, terms: int) -> ImpactWorkspace:
    """Allocate for n coordinates, p plays and a number of terms of a series."""
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
    kinds = {
        name: np.int64 if name in INTEGER_FIELDS else np.float64 for name in shapes
    }
    arrays: dict[str, Any] = {k: np.zeros(v, kinds[k]) for k, v in shapes.items()}
    return ImpactWorkspace(**arrays)
