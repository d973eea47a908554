"""Where two flanks are and how far apart: the kernel's geometry.

Lengths in metres per gear in its own terms: roll length s = sqrt(r^2 - rb^2) and
arc length l along the flank from the tip corner, dl = -s ds / rb. Kernels take
records and plain arrays: they compile several times faster than named tuples.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.compiled import compiled_part

FAR = 1.0  # gap [m] where there is no opposite flank

# Material removed between two roll lengths, `magnitude` at the end.
RELIEF = np.dtype(
    [("magnitude", "f8"), ("start", "f8"), ("end", "f8"), ("power", "f8")], align=True
)
# One gear; length and grading as in FlankCompliance. half_plane is 1 where the
# half-plane kernel is to be added to the flank's table, else 0.
FLANK = np.dtype(
    [
        ("base_radius", "f8"),
        ("tip_roll", "f8"),
        ("length", "f8"),
        ("grading", "f8"),
        ("modulus", "f8"),
        ("poisson", "f8"),
        ("half_plane", "f8"),
        ("tip_relief", RELIEF),
        ("root_relief", RELIEF),
    ],
    align=True,
)
# The line of action: s1 + s2 = line, s1 = pitch at the pitch point.
MESH = np.dtype(
    [
        ("line", "f8"),
        ("pitch", "f8"),
        ("base_pitch", "f8"),
        ("friction", "f8"),
        ("corner", "?"),
    ],
    align=True,
)


@compiled_part
def relief_depth(relief, s):
    fraction = (s - relief.start) / (relief.end - relief.start)
    if relief.magnitude == 0.0 or fraction <= 0.0:
        return 0.0
    return relief.magnitude * fraction**relief.power


@compiled_part
def modification(flank, s):
    """Material removed from the flank at roll length s [m]."""
    return relief_depth(flank.tip_relief, s) + relief_depth(flank.root_relief, s)


@compiled_part
def arc_of_roll(flank, s):
    return 0.5 * (flank.tip_roll**2 - s**2) / flank.base_radius


@compiled_part
def roll_of_arc(flank, arc):
    return math.sqrt(max(0.0, flank.tip_roll**2 - 2.0 * flank.base_radius * arc))


@compiled_part
def separation(master, slave, line, s_nominal, s):
    """(gap, slave's roll length, lean) seen from the master's flank point s.

    The flanks would touch at s_nominal of the master if both were long enough.
    A point lies on exactly one involute of the slave's base circle, and parallel
    involutes are rb * angle apart, so the distance normal to the slave's flank is
    exact. lean [rad] is the turn of that normal from the line of action.
    """
    turn = (s - s_nominal) / master.base_radius
    c, sn = math.cos(turn), math.sin(turn)
    # frame: master's point of tangency at the origin, line of action along x
    x = c * s - sn * master.base_radius
    y = sn * s + c * master.base_radius - master.base_radius
    dx, dy = x - line, y - slave.base_radius
    squared = dx * dx + dy * dy - slave.base_radius**2
    if squared <= 0.0:
        return FAR, 0.0, 0.0
    s_slave = math.sqrt(squared)
    # turn that carries (-s_slave, -rb) onto the point
    cross = -s_slave * dy + slave.base_radius * dx
    dot = -s_slave * dx - slave.base_radius * dy
    lean = math.atan2(cross, dot)
    gap = -(line - s_slave - s_nominal) - slave.base_radius * lean
    gap += modification(master, s) + modification(slave, s_slave)
    return gap, s_slave, lean


@compiled_part
def closest_arc(master, slave, line, s_nominal, arc, reach):
    """Arc of the master where the gap is least, sought within reach of `arc` first.

    Gaps are convex in the arc for reliefs that grow toward the flank's ends, so the
    search goes on with twice the reach where it ends at the reach.
    """
    while True:
        low, high = max(0.0, arc - reach), arc + reach
        found = least_gap_arc(master, slave, line, s_nominal, low, high)
        margin = 1e-6 * reach
        is_inside = low == 0.0 or found > low + margin
        if (is_inside and found < high - margin) or reach >= master.length:
            return found
        reach *= 2.0


@compiled_part
def least_gap_arc(master, slave, line, s_nominal, low, high):
    """Arc between two arcs where a convex gap is least."""
    for _ in range(60):
        one = low + (high - low) / 3.0
        two = high - (high - low) / 3.0
        gap_one = separation(master, slave, line, s_nominal, roll_of_arc(master, one))
        gap_two = separation(master, slave, line, s_nominal, roll_of_arc(master, two))
        if gap_one[0] < gap_two[0]:
            high = two
        else:
            low = one
    return 0.5 * (low + high)
