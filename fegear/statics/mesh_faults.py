"""Faults of a gear set's teeth as the contact of one of its meshes meets them.

A crack opens where its root is in tension, below the flank that carries load in the
mesh. At the other root it is in compression: its faces are closed there and the tooth
is as stiff as without it. Spalls and wear are on the flank that carries load in the
gear's first mesh, and on the other flank of an idler's teeth there are none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fegear.contact.offset_centers import CenterOffset
from fegear.contact.profiles import profile_depth
from fegear.contact.tooth_faults import (
    ChangedCompliance,
    FlankCorner,
    FlankSpall,
    ToothFaults,
)
from fegear.elasticity.flank import MAX_TOOTH_OFFSET
from fegear.gearset.faults.building import roll_length_below_tip
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.modifications import FlankProfile
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import is_first_flank, tooth_in_cycles
from fegear.gearset.zones import Zones, zones
from meshes.crack import Crack

SolveComplianceChange = Callable[[Gear, dict[int, Crack]], ChangedCompliance]


class FaultySide(NamedTuple):
    """One gear of a mesh: what differs, by tooth and of all teeth.

    faults : of single teeth, or None
    profile : of all teeth, wear included, or None
    offset : of the centre from the axis, or None
    """

    faults: ToothFaults | None
    profile: FlankProfile | None
    offset: CenterOffset | None


def faulty_sides(
    gear_set: GearSet, mesh: int, solve_change: SolveComplianceChange
) -> tuple[FaultySide, FaultySide]:
    """Faults of driver and driven gear in a mesh.

    solve_change : compliance that cracks add to a gear, by tooth, counted clockwise
    """
    spec = gear_set.meshes[mesh]
    driver, driven = (
        FaultySide(
            _tooth_faults(gear_set, mesh, gear, profile, solve_change),
            _profile_with_wear(gear_set, mesh, gear, profile, None),
            _center_offset(gear_set, mesh, gear),
        )
        for gear, profile in zip(
            spec.gears, (flank.profile for flank in spec.flanks), strict=True
        )
    )
    return driver, driven


def _tooth_faults(
    gear_set: GearSet,
    mesh: int,
    gear: int,
    profile: FlankProfile | None,
    solve_change: SolveComplianceChange,
) -> ToothFaults | None:
    body, is_worn_flank = gear_set.gears[gear], is_first_flank(gear_set, mesh, gear)
    faults, teeth = body.faults.on_flank(is_worn_flank), body.geometry.teeth
    # of each tooth of the file, the one that it is in the cycles of this mesh
    cycles = np.argsort(tooth_in_cycles(gear_set, mesh, gear, np.arange(teeth)))
    tooth_in_mesh = {tooth: int(cycles[tooth]) for tooth in faults.teeth}
    if not tooth_in_mesh:
        return None
    clockwise = -1 if gear_set.meshes[mesh].driver == gear else 1
    # the loaded flank is the right one of the tooth frame
    cracks_in_mesh = {
        tooth_in_mesh[fault.tooth]: fault.crack
        if is_worn_flank
        else fault.crack.mirrored
        for fault in faults.cracks
    }
    cracks = {
        clockwise * tooth % teeth: crack for tooth, crack in cracks_in_mesh.items()
    }
    nearby_offsets = range(-MAX_TOOTH_OFFSET, MAX_TOOTH_OFFSET + 1)
    damaged_teeth = {
        (tooth + offset) % teeth
        for tooth in cracks_in_mesh
        for offset in nearby_offsets
    }
    spalls: dict[int, tuple[FlankSpall, ...]] = {}
    profiles = {}
    for spall in faults.spalls:
        ends = spall.start_roll_length, spall.end_roll_length
        other_spalls = spalls.get(tooth_in_mesh[spall.tooth], ())
        added_spall = FlankSpall(*ends, spall.width_share, spall.place)
        spalls[tooth_in_mesh[spall.tooth]] = (*other_spalls, added_spall)
    for wear in faults.worn:
        worn_profile = _profile_with_wear(gear_set, mesh, gear, profile, wear.tooth)
        if wear.tooth is not None and worn_profile is not None:
            profiles[tooth_in_mesh[wear.tooth]] = worn_profile
    return ToothFaults(
        teeth=teeth,
        change=solve_change(body, cracks) if cracks else None,
        clockwise=clockwise,
        cracked=dict(sorted(cracks_in_mesh.items())),
        damaged=frozenset(damaged_teeth),
        spalls=spalls,
        profiles=profiles,
        corners={
            tooth_in_mesh[tip.tooth]: roll_length_below_tip(body.geometry, tip.height)
            for tip in faults.broken_tips
            if tip.length is None
        },
        broken_corners={
            tooth_in_mesh[tip.tooth]: FlankCorner(
                roll_length_below_tip(body.geometry, tip.height),
                tip.length,
                tip.end == "far",
            )
            for tip in faults.broken_tips
            if tip.length is not None
        },
        missing=frozenset(tooth_in_mesh[tooth] for tooth in faults.missing),
    )


def _profile_with_wear(
    gear_set: GearSet,
    mesh: int,
    gear: int,
    profile: FlankProfile | None,
    tooth: int | None,
) -> FlankProfile | None:
    """Profile of a gear's flanks in a mesh with the wear of a tooth, or of all."""
    wear_profiles = {
        wear.tooth: wear.profile for wear in gear_set.gears[gear].faults.worn
    }
    wear = wear_profiles.get(tooth)
    if wear is None or not is_first_flank(gear_set, mesh, gear):
        return profile
    spec = gear_set.meshes[mesh]
    role = "driver" if spec.driver == gear else "driven"
    return with_wear(profile, wear, zones(spec.pair, role))


def without_wear(gear_set: GearSet, mesh: int) -> GearSet:
    """The gear set without wear of the gears of a mesh."""
    gears = list(gear_set.gears)
    for index in gear_set.meshes[mesh].gears:
        gear = gears[index]
        gears[index] = replace(gear, faults=gear.faults.without(["worn"]))
    return replace(gear_set, gears=tuple(gears))


def with_wear(
    profile: FlankProfile | None, wear: FlankProfile, flank: Zones
) -> FlankProfile:
    """A profile, or none, and wear on top of it."""
    if profile is None:
        return wear
    if not profile.is_measured:
        return replace(wear, crowning=profile.crowning, slope=profile.slope)
    return _sum_of_profiles(profile, wear, flank)


def _sum_of_profiles(
    profile: FlankProfile, wear: FlankProfile, flank: Zones
) -> FlankProfile:
    """Two measured profiles as one, at the points of both."""
    rolls = np.union1d(profile.roll_lengths, wear.roll_lengths)
    ends = flank.start, flank.tip
    deviations = np.zeros(rolls.size)
    for summand in (replace(profile, crowning=0.0, slope=0.0), wear):
        deviations -= profile_depth(summand, rolls, *ends)
    return replace(
        profile,
        roll_lengths=tuple(rolls.tolist()),
        deviations=tuple(deviations.tolist()),
    )


def _center_offset(gear_set: GearSet, mesh: int, gear: int) -> CenterOffset | None:
    """Centre of a gear off its axis, by its direction at position 0 of a mesh."""
    body, sense = gear_set.gears[gear], gear_set.senses[gear]
    distance = body.faults.eccentricity
    if distance == 0.0:
        return None
    first_mesh = gear_set.meshes_of[gear][0]
    angle_from_first_mate = _direction_to_mate(
        gear_set, first_mesh, gear
    ) - _direction_to_mate(gear_set, mesh, gear)
    angle = sense * (body.faults.eccentricity_angle + angle_from_first_mate)
    # the set is at its start when this mesh is as far as its phase past position 0
    angle -= mesh_phases(gear_set)[mesh].value * abs(body.geometry.pitch_angle)
    return CenterOffset(distance, math.remainder(angle, 2.0 * math.pi))


def _direction_to_mate(gear_set: GearSet, mesh: int, gear: int) -> float:
    """Direction from a gear's axis to that of its mate, from x [rad]."""
    spec = gear_set.meshes[mesh]
    return spec.direction + (0.0 if spec.driver == gear else math.pi)
