"""Forces of teeth at the load cases, their sums on axes, and reactions of bearings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from fegear.gearset.axial_forces import axial_force_text
from fegear.gearset.helix import hand_of_gear
from fegear.gearset.model import GearSet
from fegear.gearset.shaft_reactions import ShaftReactions, shaft_reactions
from fegear.gearset.tooth_forces import (
    AxisForce,
    ForceOnGear,
    axis_forces,
    tooth_forces,
)

TITLE = (
    "Forces on gears at the load cases, at the operating pitch circle, without "
    "friction (seen from the near end, directions from x counter-clockwise; the driver "
    "of the first mesh turns counter-clockwise):"
)
REACTIONS_TITLE = (
    "Forces of bearings on shafts, without weight and with pure torques at their ends:"
)
NOT_DETERMINED = (
    "statics needs two bearings at different positions, without tilt stiffness and "
    "not rolling ones, see `fegear shafts`"
)
ROUND_OFF_RTOL = 1e-9  # of a sum of forces that cancel


def force_figures(gear_set: GearSet) -> dict[str, Any]:
    """Figures of the forces by name; lists are at successive load cases."""
    forces = tooth_forces(gear_set)
    axes = axis_forces(gear_set, forces)
    reactions = shaft_reactions(gear_set, forces)
    return {
        "tooth_forces": [_tooth_figures(gear_set, force) for force in forces],
        "axis_forces": [_axis_figures(gear_set, force) for force in axes],
        "shaft_reactions": [_reaction_figures(gear_set, row) for row in reactions],
    }


def _tooth_figures(gear_set: GearSet, force: ForceOnGear) -> dict[str, Any]:
    gear = gear_set.gears[force.gear]
    return {
        "mesh": force.mesh + 1,
        "gear": gear.name,
        "role": force.role,
        "hand": hand_of_gear(gear),
        "internal": gear.geometry.sign < 0,
        "driver_torques_Nm": list(gear_set.meshes[force.mesh].torques),
        "tangential_forces_N": list(force.tangential),
        "tangential_direction_deg": math.degrees(force.tangential_direction),
        "radial_forces_N": list(force.radial),
        "radial_direction_deg": math.degrees(force.radial_direction),
        "axial_forces_N": list(force.axial),
    }


def _axis_figures(gear_set: GearSet, force: AxisForce) -> dict[str, Any]:
    x, y, axial = (list(column) for column in zip(*force.vectors, strict=True))
    return {
        "gears": [gear_set.gears[index].name for index in force.gears],
        "forces_x_N": x,
        "forces_y_N": y,
        "axial_forces_N": axial,
        "tilting_moments_x_Nm": [moment[0] for moment in force.moments],
        "tilting_moments_y_Nm": [moment[1] for moment in force.moments],
    }


def _reaction_figures(gear_set: GearSet, row: ShaftReactions) -> dict[str, Any]:
    shaft = gear_set.shafts[row.shaft]
    bearings = [
        {
            "position_mm": 1e3 * position,
            "forces_x_N": row.radial[:, number, 0].tolist(),
            "forces_y_N": row.radial[:, number, 1].tolist(),
        }
        for number, position in enumerate(row.positions)
    ]
    return {
        "gears": [gear_set.gears[index].name for index in shaft.gears],
        "bearings": bearings,
        "axial_forces_N": row.axial.tolist(),
    }


def force_lines(figures: dict[str, Any], planets: Sequence[str] = ()) -> Iterator[str]:
    """The forces as lines of text, nothing where there is no load.

    planets : names of planets that are equal, of which the first one is listed
    """
    others = set(planets[1:])
    rows, axes = figures["tooth_forces"], figures["axis_forces"]
    if rows:
        yield TITLE
    of_others = {row["mesh"] for row in rows if row["gear"] in others}
    yield from (tooth_line(row) for row in rows if row["mesh"] not in of_others)
    largest = max((max(row["tangential_forces_N"]) for row in rows), default=0.0)
    yield from (
        axis_line(row, largest) for row in axes if row["gears"][0] not in others
    )
    yield from _reaction_lines(figures)


def _reaction_lines(figures: dict[str, Any]) -> Iterator[str]:
    """Reactions of bearings, and the shafts whose statics does not determine them."""
    loaded = {row["gear"] for row in figures["tooth_forces"]}
    determined = {tuple(row["gears"]): row for row in figures["shaft_reactions"]}
    bodies = [
        tuple(shaft["gears"])
        for shaft in figures["shafts"]
        if "length_mm" in shaft and loaded.intersection(shaft["gears"])
    ]
    if bodies:
        yield REACTIONS_TITLE
    for gears in bodies:
        if gears in determined:
            yield reaction_line(determined[gears])
        else:
            yield f"- {', '.join(gears)}: {NOT_DETERMINED}"


def tooth_line(row: dict[str, Any]) -> str:
    """Forces on a gear in a mesh with their directions in words."""
    kinds = {None: "", "double": " (double helical)"}
    kind = kinds.get(row["hand"], f" ({row['hand']}-handed)")
    motion = "against" if row["role"] == "driver" else "in the sense of"
    inward = "away from" if row["internal"] else "toward"
    tangential, radial = (
        f"{side} {_listed(row[f'{side}_forces_N'])} N"
        for side in ("tangential", "radial")
    )
    text = (
        f"- {row['gear']}{kind}, {row['role']} of mesh {row['mesh']}: {tangential}, "
        f"{motion} its rotation, toward {row['tangential_direction_deg']:.5g} deg; "
        f"{radial}, {inward} its axis, toward {row['radial_direction_deg']:.5g} deg"
    )
    return text + (f"; axial {_axial_text(row)}" if row["hand"] else "")


def axis_line(row: dict[str, Any], largest: float) -> str:
    """The sum of forces on an axis; largest : of the forces that it is of [N]."""
    gears = row["gears"]
    name = "sum of all its meshes" if len(gears) == 1 else "sum on their axis"
    force = _plane_text(row, ROUND_OFF_RTOL * largest)
    pushed = max(map(abs, row["axial_forces_N"])) > ROUND_OFF_RTOL * largest
    axial = f"; axial {_axial_text(row)}" if pushed else ""
    return f"- {', '.join(gears)}, {name}: {force}{axial}{_tilt_text(row, largest)}"


def _tilt_text(row: dict[str, Any], largest: float) -> str:
    """The moment about the middle of a gear's width, nothing where there is none."""
    x, y = row["tilting_moments_x_Nm"], row["tilting_moments_y_Nm"]
    sizes = [math.hypot(*parts) for parts in zip(x, y, strict=True)]
    if not max(sizes, default=0.0) > ROUND_OFF_RTOL * largest:  # over a metre's arm
        return ""
    direction = _direction(x[-1], y[-1])
    return f"; tilts its far end toward {direction:.5g} deg with {_listed(sizes)} N m"


def reaction_line(row: dict[str, Any]) -> str:
    """Forces of both bearings on a shaft."""
    bearings = "; ".join(
        f"bearing at {bearing['position_mm']:.6g} mm, {_plane_text(bearing)}"
        f", along x {_listed(bearing['forces_x_N'])} N"
        f", along y {_listed(bearing['forces_y_N'])} N"
        for bearing in row["bearings"]
    )
    axial = ""
    if any(row["axial_forces_N"]):
        axial = f"; axial, of the locating bearing, {_axial_text(row)}"
    return f"- {', '.join(row['gears'])}: {bearings}{axial}"


def _plane_text(row: dict[str, Any], round_off: float = 0.0) -> str:
    """Size and direction across the axis, which is the same at all torques."""
    x, y = row["forces_x_N"], row["forces_y_N"]
    sizes = [math.hypot(*parts) for parts in zip(x, y, strict=True)]
    if not max(sizes) > round_off:
        return "0 N"
    return f"{_listed(sizes)} N toward {_direction(x[-1], y[-1]):.5g} deg"


def _direction(x: float, y: float) -> float:
    """Direction from x [deg], from 0 to below 360."""
    return round(math.degrees(math.atan2(y, x)), 9) % 360.0


def _axial_text(row: dict[str, Any]) -> str:
    return "; ".join(map(axial_force_text, row["axial_forces_N"]))


def _listed(forces: Sequence[float]) -> str:
    return ", ".join(f"{force:.5g}" for force in forces)
