"""Profile modifications of a mesh as gaps along the nominal path of contact."""

from __future__ import annotations

from fegear.contact.profiles import profile_depth
from fegear.gearset.model import Mesh
from fegear.gearset.modifications import FlankProfile, Relief
from lumped.train.analytic import Points

CURVE_POINTS = 16  # along a parabolic relief
PROFILE_CURVE_POINTS = 32  # along a profile that is curved
DRIVER, DRIVEN = 0, 1


def gap_points(mesh: Mesh) -> Points:
    """Modification of both flanks along the nominal path, corners of a polygon.

    (base pitches from the pitch point, gap [m]); empty without modification.
    """
    if not any(flank.is_modified for flank in mesh.flanks):
        return ()
    start, end = mesh.pair.path
    # at the end of the path are the driver's tip and the driven gear's root
    reliefs = [
        (relief, side, end if (side == DRIVER) == is_tip else start)
        for side, flank in enumerate(mesh.flanks)
        for relief, is_tip in zip(flank.reliefs, (True, False), strict=True)
        if relief is not None
    ]
    profiles = [
        (flank.profile, side)
        for side, flank in enumerate(mesh.flanks)
        if flank.profile is not None
    ]
    marks = {start, end}
    for relief in reliefs:
        marks |= {x for x in _marks(mesh, *relief) if start < x < end}
    for profile in profiles:
        marks |= {x for x in _profile_marks(mesh, *profile) if start < x < end}
    return [
        (
            x,
            sum(_relief_at(mesh, *relief, x) for relief in reliefs)
            + sum(_profile_at(mesh, *profile, x) for profile in profiles),
        )
        for x in sorted(marks)
    ]


def _marks(mesh: Mesh, relief: Relief, side: int, end: float) -> list[float]:
    """Positions at which a relief begins, and points along it if it is curved.

    end : position at which it has grown to its magnitude
    """
    begin = _position(mesh, side, relief.start_roll_length)
    count = 1 if relief.power == 1.0 else CURVE_POINTS
    return [begin + (end - begin) * i / count for i in range(count)]


def _position(mesh: Mesh, side: int, roll_length: float) -> float:
    """Position at which a flank touches at a roll length."""
    pair = mesh.pair
    if side == DRIVEN:
        roll_length = pair.line_of_action - roll_length
    return (roll_length - pair.pitch_point) / pair.base_pitch


def _relief_at(mesh: Mesh, relief: Relief, side: int, end: float, x: float) -> float:
    begin = _position(mesh, side, relief.start_roll_length)
    part = min(max((x - begin) / (end - begin), 0.0), 1.0)
    return relief.magnitude * part**relief.power


def _profile_marks(mesh: Mesh, profile: FlankProfile, side: int) -> list[float]:
    """Measured points of a profile, and points along one that is curved."""
    start, end = mesh.pair.path
    is_curved = profile.crowning != 0.0 or profile.interpolation == "cubic"
    count = PROFILE_CURVE_POINTS if is_curved else 0
    marks = [start + (end - start) * i / count for i in range(1, count)]
    return [*marks, *(_position(mesh, side, s) for s in profile.roll_lengths)]


def _profile_at(mesh: Mesh, profile: FlankProfile, side: int, x: float) -> float:
    """Depth of a profile where a pair touches nominally [m]."""
    pair = mesh.pair
    s1 = pair.pitch_point + x * pair.base_pitch
    if side == DRIVER:
        start, tip, s = pair.path_start, pair.driver.tip_roll_length, s1
    else:
        start, tip = pair.line_of_action - pair.path_end, pair.driven.tip_roll_length
        s = pair.line_of_action - s1
    return float(profile_depth(profile, s, start, tip))
