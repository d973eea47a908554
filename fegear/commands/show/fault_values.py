"""Faults of gears as figures in the units of a gear-set file, and as lines of text."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from fegear.gearset.faults.tooth_faults import Faults, Spall, ToothCrack
from fegear.gearset.model import Gear
from lumped.common.units import TO_UM

Figures = dict[str, Any]


def fault_figures(gear: Gear) -> dict[str, Any]:
    """The faults of a gear by their keys; teeth count from 1."""
    faults, base = gear.faults, gear.geometry.base_radius
    return {
        "cracks": [_crack_figures(crack) for crack in faults.cracks],
        "spalls": [_spall_figures(spall, base) for spall in faults.spalls],
        "broken_tips": [
            {
                "tooth": tip.tooth + 1,
                "height_mm": 1e3 * tip.height,
                "length_mm": None if tip.length is None else 1e3 * tip.length,
                "end": tip.end if tip.is_corner else None,
            }
            for tip in faults.broken_tips
        ],
        "missing_teeth": [tooth + 1 for tooth in faults.missing],
        "worn_teeth": list(_wear_figures(faults, base)),
        "eccentricity_um": TO_UM * faults.eccentricity,
        "eccentricity_angle_deg": math.degrees(faults.eccentricity_angle),
    }


def _crack_figures(fault: ToothCrack) -> Figures:
    crack = fault.crack
    direction = crack.direction
    return {
        "tooth": fault.tooth + 1,
        "depth_mm": 1e3 * crack.depth,
        "tangent_angle_deg": math.degrees(crack.tangent_angle),
        "direction_deg": None if direction is None else math.degrees(direction),
        "root": "back" if crack.left else "loaded",
    }


def _spall_figures(spall: Spall, base_radius: float) -> Figures:
    rolls = spall.start_roll_length, spall.end_roll_length
    start, end = sorted(math.degrees(roll / base_radius) for roll in rolls)
    return {
        "tooth": spall.tooth + 1,
        "start_roll_angle_deg": start,
        "end_roll_angle_deg": end,
        "width_share": spall.width_share,
        "place_mm": 1e3 * spall.place,
    }


def _wear_figures(faults: Faults, base_radius: float) -> Iterator[Figures]:
    for wear in faults.worn:
        profile = wear.profile
        points = sorted(
            (math.degrees(roll / base_radius), abs(TO_UM * deviation))
            for roll, deviation in zip(
                profile.roll_lengths, profile.deviations, strict=True
            )
        )
        yield {
            "tooth": None if wear.tooth is None else wear.tooth + 1,
            "roll_angle_deg": [angle for angle, _ in points],
            "depth_um": [depth for _, depth in points],
            "interpolation": profile.interpolation,
        }


def fault_lines(gear: Gear) -> Iterator[str]:
    """A line of text for each fault of a gear."""
    figures = fault_figures(gear)
    for crack in figures["cracks"]:
        direction = crack["direction_deg"]
        path = "normal to the fillet"
        if direction is not None:
            path = f"at {direction:.6g} deg to the tooth's axis"
        yield _fault_line(
            gear,
            crack["tooth"],
            f"crack of {crack['depth_mm']:.6g} mm at the {crack['root']} root, from "
            f"the {crack['tangent_angle_deg']:.6g} deg tangent {path}",
        )
    for spall in figures["spalls"]:
        yield _fault_line(
            gear,
            spall["tooth"],
            f"spall from {spall['start_roll_angle_deg']:.6g} to "
            f"{spall['end_roll_angle_deg']:.6g} deg of roll angle over "
            f"{100 * spall['width_share']:.4g} % of the face width"
            + _place_of(spall["place_mm"]),
        )
    for tip in figures["broken_tips"]:
        text = f"{tip['height_mm']:.6g} mm of the tip broken off"
        if tip["end"] is not None:
            text = (
                f"corner of {tip['height_mm']:.6g} mm height broken off over "
                f"{tip['length_mm']:.6g} mm at the {tip['end']} end"
            )
        yield _fault_line(gear, tip["tooth"], text)
    for tooth in figures["missing_teeth"]:
        yield _fault_line(gear, tooth, "missing")
    for wear in figures["worn_teeth"]:
        depth = f"worn by up to {max(wear['depth_um']):.6g} um"
        yield _fault_line(gear, wear["tooth"], depth)
    if gear.faults.eccentricity:
        yield (
            f"{gear.name}: centre of the teeth {figures['eccentricity_um']:.6g} um off "
            f"the axis, at {figures['eccentricity_angle_deg']:.6g} deg from the "
            "direction to the mate"
        )


def _place_of(place_mm: float) -> str:
    if not place_mm:
        return ""
    end = "far" if place_mm > 0.0 else "near"
    return f", {abs(place_mm):.6g} mm from its middle toward the {end} end"


def _fault_line(gear: Gear, tooth: int | None, text: str) -> str:
    which = "teeth without wear of their own" if tooth is None else f"tooth {tooth}"
    if tooth is None and len(gear.faults.worn) == 1:
        which = "all teeth"
    return f"{gear.name}, {which}: {text}"
