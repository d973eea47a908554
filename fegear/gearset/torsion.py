"""Bodies of gears that twist over the face width: where torque enters, and how rigid.

Torque passes along the body of a gear between its teeth and one end of its face width:
that toward the other gear in mesh on the shaft, or toward the end of the shaft that
`driven_from` names. The body is solid from the bore of the shaft to the root circle,
as the gear and the shaft in it are of one piece or shrunk together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fegear.files.errors import InputError
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.shaft_bodies import ShaftBody, ShaftEnd
from fegear.gearset.yielding import yielding_shafts
from lumped.common.array_types import Array

# why the torsion of a body is left out
UNKNOWN_END = "without driven_from"
INTERNAL = "internal"
SEVERAL_MESHES = "in several meshes"
UNKNOWN_WAY = "on a shaft whose torque has no known way"


@dataclass(frozen=True)
class TorqueEnd:
    """End of a gear's face width where the torque of its teeth enters or leaves.

    gear : by index
    body, position : the shaft, and the middle of the gear on it [m]
    end : toward which end of the shaft; None where torsion of the gear is left out
    reason : why it is, else empty
    """

    gear: int
    body: ShaftBody
    position: float
    end: ShaftEnd | None
    reason: str = ""


def torque_ends(gear_set: GearSet) -> Iterator[TorqueEnd]:
    """Ends at all gears in mesh on shafts that yield."""
    for _, shaft in yielding_shafts(gear_set):
        if shaft.body is None:
            continue
        in_mesh = {
            gear: position
            for gear, position in zip(
                shaft.gears, shaft.body.gear_positions, strict=True
            )
            if meshes_of(gear_set, gear)
        }
        for gear, position in in_mesh.items():
            others = [place for other, place in in_mesh.items() if other != gear]
            end, reason = _end(gear_set, gear, (position, others), shaft.body)
            yield TorqueEnd(gear, shaft.body, position, end, "" if end else reason)


def _end(
    gear_set: GearSet,
    gear: int,
    places: tuple[float, list[float]],
    body: ShaftBody,
) -> tuple[ShaftEnd | None, str]:
    """Where torque enters, and why torsion is left out where it is.

    places : of the gear and of others in mesh on its shaft [m]
    """
    place, others = places
    if gear_set.gears[gear].geometry.sign < 0:
        return None, INTERNAL
    if meshes_of(gear_set, gear) > 1:
        return None, SEVERAL_MESHES
    if not others:
        return body.driven_from, UNKNOWN_END
    if len(others) > 1 or others[0] == place:
        return None, UNKNOWN_WAY
    return ("start" if others[0] < place else "end"), ""


def meshes_of(gear_set: GearSet, gear: int) -> int:
    """Number of meshes of a gear."""
    return sum(gear in mesh.gears for mesh in gear_set.meshes)


def require_outside_torque(gear_set: GearSet) -> None:
    """Refuse driven_from on shafts that take no torque from outside."""
    for number, shaft in enumerate(gear_set.shafts, 1):
        if shaft.body is None or shaft.body.driven_from is None:
            continue
        meshes = sum(meshes_of(gear_set, gear) for gear in shaft.gears)
        if meshes != 1:
            raise InputError(
                f'shaft {number}: driven_from = "{shaft.body.driven_from}"; its gears '
                f"are in {meshes} meshes, and torque from outside is that of a shaft "
                "with one mesh: leave it out"
            )


def torsional_flexibility(gear_set: GearSet, gear: int) -> tuple[Array, Array] | None:
    """Places over the face width, and twist per torque to where the torque enters.

    Returns places (n,) from the middle of the face width [m] and twist (n,)
    [1/(N m)], linear between them; or None where torsion of the gear is left out.
    """
    for one in torque_ends(gear_set):
        if one.gear == gear and one.end is not None:
            spec = gear_set.gears[gear]
            places = _parts(one, 0.5 * spec.face_width)
            middles = one.position + 0.5 * (places[1:] + places[:-1])
            twist = np.diff(places) / torsional_rigidity(spec, one.body, middles)
            from_start = np.concatenate([[0.0], np.cumsum(twist)])
            if one.end == "start":
                return places, from_start
            return places, from_start[-1] - from_start
    return None


def _parts(at: TorqueEnd, half_width: float) -> Array:
    """Ends (n,) of parts of the face width with one section of the shaft [m]."""
    steps = np.cumsum(at.body.lengths)[:-1] - at.position
    inside = steps[np.abs(steps) < half_width]
    return np.array([-half_width, *inside, half_width])


def torsional_rigidity(gear: Gear, body: ShaftBody, positions: Array) -> Array:
    """G J (n,) of a gear and the shaft in it at positions along the shaft [N m2].

    Outer sections go on beyond the ends of the shaft.
    """
    section = np.searchsorted(np.cumsum(body.lengths)[:-1], positions)
    diameter, bore = np.array(body.diameters)[section], np.array(body.bores)[section]
    of_gear, of_shaft = (
        0.5 * one.young_modulus / (1.0 + one.poisson_ratio) for one in (gear, body)
    )
    ring = np.maximum((2.0 * gear.geometry.root_radius) ** 4 - diameter**4, 0.0)
    core = diameter**4 - bore**4
    return np.asarray(math.pi / 32.0 * (of_gear * ring + of_shaft * core))
