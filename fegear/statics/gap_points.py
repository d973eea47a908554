"""Profile modifications of a mesh as gaps along the nominal path of contact."""

from __future__ import annotations

from fegear.contact.profiles import profile_depth
from fegear.gearset.model import Mesh
from fegear.gearset.modifications import FlankProfile, Relief
from lumped.train.analytic import Points

RELIEFS = (
    "driver_tip_relief",
    "driver_root_relief",
    "driven_tip_relief",
    "driven_root_relief",
)
PROFILES = ("driver_profile", "driven_profile")
MODIFICATIONS = (*RELIEFS, *PROFILES)
CURVE_POINTS = 16  # along a parabolic relief
PROFILE_CURVE_POINTS = 32  # along a profile that is curved


def gap_points(mesh: Mesh) -> Points:
    """Modification of both flanks along the nominal path, corners of a polygon.

    (base pitches from the pitch point, gap [m]); empty without modification.
    """
    if not any(getattr(mesh, name) for name in MODIFICATIONS):
        return ()
    start, end = mesh.pair.path
    marks = {start, end}
    for name in RELIEFS:
        marks |= {x for x in _marks(mesh, name) if start < x < end}
    for name in PROFILES:
        marks |= {x for x in _profile_marks(mesh, name) if start < x < end}
    return [
        (
            x,
            sum(_relief_at(mesh, name, x) for name in RELIEFS)
            + sum(_profile_at(mesh, name, x) for name in PROFILES),
        )
        for x in sorted(marks)
    ]


def _marks(mesh: Mesh, name: str) -> list[float]:
    """Positions at which a relief begins, and points along it if it is curved."""
    relief: Relief | None = getattr(mesh, name)
    if relief is None:
        return []
    begin, end = _position(mesh, name, relief.start_roll_length), _end(mesh, name)
    count = 1 if relief.power == 1.0 else CURVE_POINTS
    return [begin + (end - begin) * i / count for i in range(count)]


def _position(mesh: Mesh, name: str, roll_length: float) -> float:
    """Position at which a flank touches at a roll length."""
    pair = mesh.pair
    if name.startswith("driven"):
        roll_length = pair.line_of_action - roll_length
    return (roll_length - pair.pitch_point) / pair.base_pitch


def _end(mesh: Mesh, name: str) -> float:
    """Position at which a relief has grown to its magnitude."""
    late = name in ("driver_tip_relief", "driven_root_relief")
    start, end = mesh.pair.path
    return end if late else start


def _relief_at(mesh: Mesh, name: str, x: float) -> float:
    relief: Relief | None = getattr(mesh, name)
    if relief is None:
        return 0.0
    begin, end = _position(mesh, name, relief.start_roll_length), _end(mesh, name)
    part = min(max((x - begin) / (end - begin), 0.0), 1.0)
    return relief.magnitude * part**relief.power


def _profile_marks(mesh: Mesh, name: str) -> list[float]:
    """Measured points of a profile, and points along one that is curved."""
    profile: FlankProfile | None = getattr(mesh, name)
    if profile is None:
        return []
    start, end = mesh.pair.path
    is_curved = profile.crowning != 0.0 or profile.interpolation == "cubic"
    count = PROFILE_CURVE_POINTS if is_curved else 0
    marks = [start + (end - start) * i / count for i in range(1, count)]
    return [*marks, *(_position(mesh, name, s) for s in profile.roll_lengths)]


def _profile_at(mesh: Mesh, name: str, x: float) -> float:
    """Depth of a profile where a pair touches nominally [m]."""
    profile: FlankProfile | None = getattr(mesh, name)
    if profile is None:
        return 0.0
    pair = mesh.pair
    s1 = pair.pitch_point + x * pair.base_pitch
    if name.startswith("driver"):
        start, tip, s = pair.path_start, pair.driver.tip_roll_length, s1
    else:
        start, tip = pair.line_of_action - pair.path_end, pair.driven.tip_roll_length
        s = pair.line_of_action - s1
    return float(profile_depth(profile, s, start, tip))
