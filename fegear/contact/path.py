"""Where tooth pairs touch along the path of contact, and how they slide there.

Positions on the path are nominal: those of rigid flanks without relief. They are
measured in base pitches from the pitch point, positive past it: the mesh position
plus the number of base pitches by which a pair is ahead of the reference pair.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fegear.contact.result import ContactCycle
from fegear.contact.virtual_work import arrange_along_path
from fegear.gearset.loss_factor import sliding_per_base_pitch
from lumped.common.array_types import Array
from meshes import GearPair

PATH_TOL = 1e-9  # base pitches beyond its ends that belong to the path
PITCH_POINT_TOL = 1e-12  # base pitches around the pitch point where nothing slides


def path_positions(cycle: ContactCycle) -> Array:
    """Positions (n, k) of all pairs on the path, also beyond its ends [base pitches].

    Pairs count anew in each base pitch.
    """
    position = cycle.position - np.floor(cycle.position)
    return np.asarray(position[:, None] + cycle.teeth)


def face_along_path(cycle: ContactCycle, values: Array, places: Array) -> Array:
    """Values (n, k, m) over the face width at places (p,) of the path, (p, m).

    Linear between positions, in each slice by itself; where tooth pairs differ, the
    largest of all.

    places : [base pitches]
    """
    pitches = math.floor(cycle.position[-1]) + 1

    def along(of_pairs: Array) -> Array:
        """Arrange by slice, base pitch and position from a pair's first to its last."""
        return arrange_along_path(cycle, of_pairs.transpose(2, 0, 1), pitches)

    rows = zip(along(cycle.face.path_position), along(values), strict=True)
    slices = [
        np.max([np.interp(places, *one) for one in zip(*row, strict=True)], axis=0)
        for row in rows
    ]
    return np.stack(slices, axis=1)


def on_path(pair: GearPair, position: Array) -> NDArray[np.bool_]:
    """Whether positions [base pitches] are on the path of contact."""
    start, end = pair.path
    return (position >= start - PATH_TOL) & (position <= end + PATH_TOL)


def roll_angles(pair: GearPair, position: Array) -> tuple[Array, Array]:
    """Roll angles of the contact point on driver and driven gear [rad].

    A roll angle is measured from where the involute begins on the base circle.
    """
    s1 = pair.pitch_point + pair.base_pitch * position
    s2 = pair.line_of_action - s1
    return s1 / pair.driver.base_radius, s2 / pair.driven.base_radius


def contact_diameters(pair: GearPair, position: Array) -> tuple[Array, Array]:
    """Diameters of the contact point on driver and driven gear [m]."""
    gears = pair.driver, pair.driven
    angles = roll_angles(pair, position)
    one, two = (
        2.0 * abs(gear.base_radius) * np.hypot(1.0, angle)
        for gear, angle in zip(gears, angles, strict=True)
    )
    return one, two


def sliding_over_pitch_speed(pair: GearPair, position: Array) -> Array:
    """Sliding speed of the driver's flank on the driven one over the pitch-line speed.

    Negative before the pitch point and positive past it.
    """
    radius = pair.driver.base_radius / math.cos(pair.operating_pressure_angle)
    driven_radius = radius * pair.driven.base_radius / pair.driver.base_radius
    return position * pair.base_pitch * (1.0 / radius + 1.0 / driven_radius)


def sliding_sign(position: Array) -> Array:
    """Whether friction acts toward both roots, 1, or toward both tips, -1."""
    moving = np.abs(position) > PITCH_POINT_TOL
    return np.where(moving, -np.sign(position), 0.0)


def loss_factor(teeth: Sequence[int], position: Array, share: ArrayLike) -> Array:
    """Loss factor H_V: friction loss over friction coefficient and transmitted power.

    teeth : of driver and driven gear, negative of an internal one
    position : (n, k) of the pairs on the path [base pitches], at equal steps
    share : (..., n, k) part of the mesh force that each pair carries

    Friction changes the mesh force itself, which is left out: the loss is that of a
    small coefficient.
    """
    carried = (np.asarray(share) * np.abs(position)).sum(axis=-1)
    return np.asarray(sliding_per_base_pitch(teeth) * carried.mean(axis=-1))
