"""Gears whose centres are off the axes about which they rotate.

The centres move on circles, so that their distance and the direction between them
change over a turn. Involutes stay conjugate: with alpha the pressure angle at the
distance of the moment and psi the angle by which the line of centres is turned toward
the way of the teeth, unmodified flanks touch where the driver is ahead of its uniform
rotation by (rb1 + rb2) (inv(alpha) - inv(alpha0) + psi) of its base circle. Nothing is
neglected but what the shafts and bearings yield.

The base radius of an internal gear is negative, and so is the length of its lines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lumped.common.array_types import Array, Indices
from meshes import GearPair


@dataclass(frozen=True)
class CenterOffset:
    """A gear whose centre is off the axis about which it rotates.

    distance : [m]
    angle : direction of the centre from the axis in its sense of rotation from the
        direction toward its mate, at position 0 of the mesh [rad]
    """

    distance: float
    angle: float


class MovedLines(NamedTuple):
    """Lines of action over positions (n,).

    place : positions that the mesh would have at rest with its pairs where they are
        now [base pitches]
    lines : (n, 2) as in `fegear.contact.plane.kernels.cycle.Constants`, of no size
        where they do not move
    gap : of all pairs [m]
    """

    place: Array
    lines: Array
    gap: Array


Offsets = tuple[CenterOffset | None, CenterOffset | None]  # of driver and driven gear


def moved_lines(
    pair: GearPair,
    offsets: Offsets,
    position: Array,
    pitch: Indices,
    back: bool = False,
) -> MovedLines:
    """Lines of action of a mesh whose centres move.

    position, pitch : base pitches from the pitch point, and whole ones that come to it
    back : of the back flanks, seen in a mirror
    """
    if offsets == (None, None):
        return MovedLines(position, np.empty((0, 2)), np.zeros(position.size))
    rotated = position + pitch  # base pitches
    if back:
        rotated = -rotated - back_lead(pair)
    x, y = np.full(position.size, pair.center_distance), np.zeros(position.size)
    ends = (offsets[0], pair.driver, 0.0, -1.0), (offsets[1], pair.driven, math.pi, 1.0)
    for offset, gear, toward_mate, sign in ends:
        if offset is None:
            continue
        # the driver rotates counter-clockwise, the driven gear clockwise, and an
        # internal gear the other way round
        way = gear.sign * offset.angle + gear.pitch_angle * rotated
        direction = toward_mate - sign * way
        x = x + sign * offset.distance * np.cos(direction)
        y = y + sign * offset.distance * np.sin(direction)
    if back:
        y = -y
    bases = pair.driver.base_radius + pair.driven.base_radius
    angle = np.arccos(abs(bases) / np.hypot(x, y))
    nominal = pair.operating_pressure_angle
    tangent = np.tan(angle)
    turn = tangent - angle - (math.tan(nominal) - nominal) + np.arctan2(y, x)
    lines = np.stack([bases * tangent, pair.driver.base_radius * tangent], axis=1)
    place = position + pair.driven.base_radius * turn / pair.base_pitch
    return MovedLines(place, np.ascontiguousarray(lines), bases * turn)


def back_lead(pair: GearPair) -> float:
    """How far ahead the back flanks are of the drive flanks [base pitches].

    The driven tooth's back flank passes the pitch point a tooth thickness before its
    drive flank does.
    """
    gear = pair.driven
    radius = gear.base_radius / math.cos(pair.operating_pressure_angle)
    return 2.0 * gear.half_angle(radius) / gear.pitch_angle
