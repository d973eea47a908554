"""Work of the loads of tooth pairs over a mesh cycle, from their gaps alone.

While the gears turn by a base pitch P, a pair whose flanks touch along the line of
action keeps its gap g, and T2/T1 is z2/z1. Where a corner or relief changes it, the
load Q of the pair (along the transmission error) does work on it, and

    mean(T2/T1) z1/z2 - 1 = sum of the integrals of Q dg / (F P),

with F the sum of the loads. This holds for any loads and compares the moment arms of
the forces with the gaps. The work itself is not zero: with p = ste - g the deflection
of a pair, the transmission error returns after the cycle, and

    sum of Q dg = - sum of Q dp.

A pair that enters at a soft tip and leaves at a stiff root goes back on another curve
of load over deflection than it came, and the loop has an area. In equal gears the loops
of both halves of the path cancel; in steel on plastic they do not. In reality the tilt
of the flanks by their deflection does this work, which moment arms of undeformed teeth
leave out. A pair passes its loop once in a base pitch and carries F at most, so that
the area is at most F times the largest deflection, and the work at most a part of the
largest deflection over P.
"""

from __future__ import annotations

import numpy as np

from fegear.contact.result import ContactCycle
from lumped.common.array_types import Array


def work_on_gaps(cycle: ContactCycle, base_pitch: float, pitches: int) -> Array:
    """Work of the loads on the gaps over that of the mesh force, at torques (t,).

    pitches : base pitches that the cycle covers in equal steps
    """
    load = arrange_along_path(cycle, cycle.load * cycle.closing, pitches)
    gap = arrange_along_path(cycle, cycle.gap, pitches)
    faces = np.isfinite(gap)
    step = np.diff(np.where(faces, gap, 0.0))
    between = 0.5 * (load[..., 1:] + load[..., :-1])
    work = np.where(faces[..., 1:] & faces[..., :-1], between * step, 0.0)
    return work.sum(axis=(1, 2)) / (cycle.mesh_force[:, 0] * base_pitch * pitches)


def largest_deflection(cycle: ContactCycle) -> Array:
    """Largest deflection of a loaded pair, at torques (t,) [m]."""
    deflection = cycle.ste[..., None] - cycle.gap
    return np.where(cycle.load > 0.0, deflection, 0.0).max(axis=(1, 2))


def arrange_along_path(cycle: ContactCycle, values: Array, pitches: int) -> Array:
    """Values (t, n, k) of pairs at positions as (t, pitches, k n / pitches).

    The pair that is k ahead in one base pitch is k + 1 ahead in the next: a row follows
    one pair from the first position to the last.
    """
    torques, positions, _ = values.shape
    columns = [
        np.roll(
            values[..., i].reshape(torques, pitches, positions // pitches),
            -ahead,
            axis=1,
        )
        for ahead, i in enumerate(np.argsort(cycle.teeth))
    ]
    return np.concatenate(columns, axis=2)
