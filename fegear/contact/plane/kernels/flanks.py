"""Where two flanks are and how far apart: the kernel's geometry.

Lengths in metres per gear in its own terms: roll length s = sqrt(r^2 - rb^2) and
arc length l along the flank from the tip corner, dl = -s ds / rb. Base radius and roll
lengths of an internal gear are negative, see `meshes.internal`. Kernels take
records and plain arrays: they compile several times faster than named tuples.
"""

from __future__ import annotations

import math

import numpy as np

from lumped.common.compiled import compiled_part

NO_FLANK_GAP = 1.0  # gap [m] where there is no opposite flank
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
SCAN_STEPS, SCAN_STEPS_PER_KNOT = 128, 2  # of a flank with a measured profile
KINK = 1e-6  # of a flank's length, on either side of a point where its slope may jump

# Material removed between two roll lengths, `magnitude` at the end.
RELIEF = np.dtype(
    [("magnitude", "f8"), ("start", "f8"), ("end", "f8"), ("power", "f8")], align=True
)
MAX_KNOTS = 1000  # of a measured profile
MAX_SPALLS = 8  # of a flank, as in `fegear.gearset.faults.tooth_faults`
# Deviations over the active profile from `middle` - `half_range` to its tip: crowning
# and slope, and measured depths at `count` roll lengths with their slopes. Between
# knots the depth is linear where `is_linear` is set, else cubic.
PROFILE = np.dtype(
    [
        ("is_there", "?"),
        ("is_linear", "?"),
        ("count", "i8"),
        ("middle", "f8"),
        ("half_range", "f8"),
        ("crowning", "f8"),
        ("slope", "f8"),
        ("roll", "f8", (MAX_KNOTS,)),
        ("depth", "f8", (MAX_KNOTS,)),
        ("knot_slope", "f8", (MAX_KNOTS,)),
    ],
    align=True,
)
# Spall of a flank between two roll lengths, where `share` of the face width is missing;
# 0 where there is none, in spalls those after the last.
SPALL = np.dtype([("start", "f8"), ("end", "f8"), ("share", "f8")], align=True)
# One flank; length and grading as in FlankCompliance. The tip corner is at the arc
# tip_arc and the roll length corner_roll, 0 and tip_roll unless it is broken off.
# half_thickness is half that of the tooth on its operating pitch circle. has_half_plane
# is 1 where the half-plane kernel is to be added to the flank's table, else 0.
# undercut_roll is the roll length at which an undercut cuts the flank off, 0 where none
# does.
FLANK = np.dtype(
    [
        ("base_radius", "f8"),
        ("tip_roll", "f8"),
        ("tip_arc", "f8"),
        ("corner_roll", "f8"),
        ("half_thickness", "f8"),
        ("length", "f8"),
        ("grading", "f8"),
        ("modulus", "f8"),
        ("poisson", "f8"),
        ("has_half_plane", "f8"),
        ("undercut_roll", "f8"),
        ("tip_relief", RELIEF),
        ("root_relief", RELIEF),
        ("profile", PROFILE),
        ("spalls", SPALL, (MAX_SPALLS,)),
    ],
    align=True,
)
# The line of action: s1 + s2 = line_of_action, s1 = pitch_point at the pitch point.
# Corners may touch within corner_range off the path [base pitches], none at 0.
MESH = np.dtype(
    [
        ("line_of_action", "f8"),
        ("pitch_point", "f8"),
        ("base_pitch", "f8"),
        ("friction", "f8"),
        ("corner_range", "f8"),
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
def relief_slope(relief, s):
    """Return the slope of the depth over the roll length."""
    length = relief.end - relief.start
    fraction = (s - relief.start) / length
    if relief.magnitude == 0.0 or fraction <= 0.0:
        return 0.0
    return relief.magnitude * relief.power * fraction ** (relief.power - 1.0) / length


@compiled_part
def relief_derivatives(relief, s):
    """Return the derivatives of the depth with respect to magnitude and start."""
    length = relief.end - relief.start
    fraction = (s - relief.start) / length
    if relief.magnitude == 0.0 or fraction <= 0.0:
        return 0.0, 0.0
    steepness = relief.power * fraction ** (relief.power - 1.0) / length
    return fraction**relief.power, relief.magnitude * steepness * (fraction - 1.0)


@compiled_part
def relief_slope_derivatives(relief, s):
    """Return those of the slope over the roll length, by magnitude and start."""
    length = relief.end - relief.start
    fraction = (s - relief.start) / length
    if relief.magnitude == 0.0 or fraction <= 0.0:
        return 0.0, 0.0
    power = relief.power
    by_magnitude = power * fraction ** (power - 1.0) / length
    factor = relief.magnitude * by_magnitude / length
    bend = 0.0 if power == 1.0 else (power - 1.0) * (1.0 - 1.0 / fraction)
    return by_magnitude, factor * (1.0 + bend)


@compiled_part
def profile_depth(profile, s):
    """Depth of the deviations, negative where there is excess of material."""
    fraction = (s - profile.middle) / profile.half_range
    depth = profile.crowning * fraction**2 - 0.5 * profile.slope * (1.0 + fraction)
    last = profile.count - 1
    if last < 0:
        return depth
    if s <= profile.roll[0]:
        return depth + profile.depth[0]
    if s >= profile.roll[last]:
        return depth + profile.depth[last]
    i = knot_before(profile, s)
    step = profile.roll[i + 1] - profile.roll[i]
    t, rise = (s - profile.roll[i]) / step, profile.depth[i + 1] - profile.depth[i]
    depth += profile.depth[i] + rise * t
    if profile.is_linear:
        return depth
    # Hermite: what the slopes at both ends exceed that of the chord
    before = profile.knot_slope[i] * step - rise
    after = profile.knot_slope[i + 1] * step - rise
    return depth + t * (1.0 - t) * (before * (1.0 - t) - after * t)


@compiled_part
def profile_derivatives(profile, s):
    """Return the derivatives of the depth with respect to crowning and slope."""
    fraction = (s - profile.middle) / profile.half_range
    return fraction**2, -0.5 * (1.0 + fraction)


@compiled_part
def profile_slope(profile, s):
    """Return the slope of `profile_depth` over the roll length."""
    fraction = (s - profile.middle) / profile.half_range
    slope = (2.0 * profile.crowning * fraction - 0.5 * profile.slope) / (
        profile.half_range
    )
    last = profile.count - 1
    if last < 0 or s <= profile.roll[0] or s >= profile.roll[last]:
        return slope
    i = knot_before(profile, s)
    step = profile.roll[i + 1] - profile.roll[i]
    t, rise = (s - profile.roll[i]) / step, profile.depth[i + 1] - profile.depth[i]
    slope += rise / step
    if profile.is_linear:
        return slope
    before = profile.knot_slope[i] * step - rise
    after = profile.knot_slope[i + 1] * step - rise
    bend = before * (1.0 - t) * (1.0 - 3.0 * t) - after * t * (2.0 - 3.0 * t)
    return slope + bend / step


@compiled_part
def knot_before(profile, s):
    """Index of the last knot but one, or of one before it, that s is not below."""
    low, high = 0, profile.count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if profile.roll[middle] <= s:
            low = middle
        else:
            high = middle
    return low


@compiled_part
def is_relieved(flank):
    has_relief = flank.tip_relief.magnitude > 0.0 or flank.root_relief.magnitude > 0.0
    return has_relief or flank.profile.is_there


@compiled_part
def modification(flank, s):
    """Material removed from the flank at roll length s [m]."""
    depth = relief_depth(flank.tip_relief, s) + relief_depth(flank.root_relief, s)
    if flank.profile.is_there:
        depth += profile_depth(flank.profile, s)
    return depth


@compiled_part
def modification_slope(flank, s):
    """Return the slope of `modification` over the roll length."""
    slope = relief_slope(flank.tip_relief, s) + relief_slope(flank.root_relief, s)
    if flank.profile.is_there:
        slope += profile_slope(flank.profile, s)
    return slope


@compiled_part
def arc_of_roll(flank, s):
    return 0.5 * (flank.tip_roll**2 - s**2) / flank.base_radius


@compiled_part
def roll_of_arc(flank, arc):
    squared = flank.tip_roll**2 - 2.0 * flank.base_radius * arc
    return math.copysign(math.sqrt(max(0.0, squared)), flank.base_radius)


@compiled_part
def base_tangent_angle(flank, crossing, s):
    """Angle [rad] from the line of action to the base tangent through flank point s.

    crossing : roll length at which the unmodified flank crosses the line of action
    """
    return (s - crossing + modification(flank, s)) / flank.base_radius


@compiled_part
def separation(master, slave, line, crossings, s):
    """(gap, slave's roll length, tangent angle) at the master's flank point s.

    crossings : roll lengths at which unmodified flanks of master and slave cross the
        line of action; their sum is `line` where those touch

    A point lies on exactly one involute of the slave's base circle, and parallel
    involutes are rb * angle apart, so the way of the slave's base circle until it
    meets the point is exact. Where material is removed, a flank is at every radius an
    involute turned back by as much. The tangent angle [rad] is that of the slave's base
    tangent through the point from the line of action.
    """
    turn = base_tangent_angle(master, crossings[0], s)
    c, sn = math.cos(turn), math.sin(turn)
    # frame: master's point of tangency at the origin, line of action along x
    x = c * s - sn * master.base_radius
    y = sn * s + c * master.base_radius - master.base_radius
    dx, dy = x - line, y - slave.base_radius
    squared = dx * dx + dy * dy - slave.base_radius**2
    if squared <= 0.0:
        return NO_FLANK_GAP, 0.0, 0.0
    s_slave = math.copysign(math.sqrt(squared), slave.base_radius)
    # turn that carries (-s_slave, -rb) onto the point
    cross = -s_slave * dy + slave.base_radius * dx
    dot = -s_slave * dx - slave.base_radius * dy
    mate_tangent_angle = math.atan2(cross, dot)
    gap = s_slave - crossings[1] - slave.base_radius * mate_tangent_angle
    return gap + modification(slave, s_slave), s_slave, mate_tangent_angle


@compiled_part
def normal_angle(flank, s):
    """Angle [rad] of the flank's normal from the base tangent through its point s."""
    slope = modification_slope(flank, s)
    sign = math.copysign(1.0, flank.base_radius)
    return math.atan2(sign * slope * flank.base_radius, sign * (1.0 + slope) * s)


@compiled_part
def common_normal(master, slave, line, crossings, arc):
    """Angle [rad] of the normal at the closest point from the line of action.

    Both flanks have it, but for a tip corner, the edge of an undercut or a kink, such
    as the start of a linear relief: the normal is that of the flank that turns less
    there.
    """
    step = KINK * master.length
    near_roll = roll_of_arc(master, max(master.tip_arc, arc - step))
    far_roll = roll_of_arc(master, arc + step)
    master_near, mate_near = normals(master, slave, line, crossings, near_roll)
    master_far, mate_far = normals(master, slave, line, crossings, far_roll)
    is_edge = master.undercut_roll > 0.0 and arc >= master.length
    is_corner = arc == master.tip_arc or is_edge
    if is_corner or abs(mate_near - mate_far) < abs(master_near - master_far):
        return 0.5 * (mate_near + mate_far)
    return 0.5 * (master_near + master_far)


@compiled_part
def normals(master, slave, line, crossings, s):
    """Angles [rad] of the normals of master and slave from the line of action."""
    _, s_slave, mate_tangent_angle = separation(master, slave, line, crossings, s)
    angle = base_tangent_angle(master, crossings[0], s) + normal_angle(master, s)
    return angle, mate_tangent_angle + normal_angle(slave, s_slave)


@compiled_part
def closest_arc(master, slave, line, crossings, arc, search_radius, arc_tol):
    """Arc of the master where the gap is least, sought near `arc` first.

    search_radius, arc_tol : of the arc [m]

    Gaps are convex in the arc for reliefs that grow toward the flank's ends, so the
    search continues with twice the radius where it ends at the radius. Measured
    profiles have several valleys, and the whole flank is searched.
    """
    knots, tip = master.profile.count + slave.profile.count, master.tip_arc
    if knots > 0:
        low, high = deepest_valley(master, slave, line, crossings, knots)
        best_arc = least_gap_arc(master, slave, line, crossings, low, high, arc_tol)
        return tip if best_arc < tip + arc_tol else best_arc
    while True:
        low, high = max(tip, arc - search_radius), arc + search_radius
        best_arc = least_gap_arc(master, slave, line, crossings, low, high, arc_tol)
        is_inside = low == tip or best_arc > low + arc_tol
        if (is_inside and best_arc < high - arc_tol) or search_radius >= master.length:
            return tip if best_arc < tip + arc_tol else best_arc
        search_radius *= 2.0


@compiled_part
def deepest_valley(master, slave, line, crossings, knots):
    """Arcs of the master on both sides of the least gap on a grid of its flank.

    The grid is uniform in the roll length and finer than measured points.
    """
    steps = SCAN_STEPS + SCAN_STEPS_PER_KNOT * knots
    root = roll_of_arc(master, master.length)
    tip = master.corner_roll
    step, best, least = (tip - root) / steps, 0, NO_FLANK_GAP
    for i in range(steps + 1):
        s = tip - i * step
        gap = separation(master, slave, line, crossings, s)[0]
        if gap < least:
            best, least = i, gap
    near, far = tip - (best - 1) * step, tip - (best + 1) * step
    if master.base_radius > 0.0:
        far = max(0.0, far)  # to the base circle, which internal teeth do not reach
    return max(master.tip_arc, arc_of_roll(master, near)), arc_of_roll(master, far)


@compiled_part
def least_gap_arc(master, slave, line, crossings, low, high, arc_tol):
    """Arc between two arcs where a convex gap is least, by golden section."""
    one, two = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    gap_one = separation(master, slave, line, crossings, roll_of_arc(master, one))[0]
    gap_two = separation(master, slave, line, crossings, roll_of_arc(master, two))[0]
    while high - low > arc_tol:
        if gap_one < gap_two:
            high, two, gap_two = two, one, gap_one
            one = high - GOLDEN * (high - low)
            s = roll_of_arc(master, one)
            gap_one = separation(master, slave, line, crossings, s)[0]
        else:
            low, one, gap_one = one, two, gap_two
            two = low + GOLDEN * (high - low)
            s = roll_of_arc(master, two)
            gap_two = separation(master, slave, line, crossings, s)[0]
    return 0.5 * (low + high)
