"""Potential energy of the tooth that the rack cuts, healthy or with a root crack.

The outline is that of `meshes`, as the finite elements have it: trochoid and involute.
`validation.oracles.potential_energy` has a circular fillet and no crack.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from fegear.gearset.model import Gear
from lumped.closed_forms.tooth_crack import RootCrack, cracked_compliance
from lumped.closed_forms.tooth_energy import (
    BeamCompliance,
    FlankForce,
    ToothFoundation,
    ToothMaterial,
    ToothOutline,
    beam_compliance,
)
from lumped.common.array_types import Array
from meshes import SpurGear
from meshes.profile import fillet_points, flank_points
from validation.oracles.hertz import Material

POINTS = 400  # of the fillet, and of the flank
TANGENT_ANGLE = math.radians(30.0)  # to the centre line, where ISO 6336-3 measures


@cache
def tooth_outline(teeth: SpurGear) -> ToothOutline:
    """Tooth between the root circle and the tip corner."""
    angles = np.linspace(0.0, teeth.form_normal_angle, POINTS)
    rolls = np.linspace(teeth.form_roll_length, teeth.tip_roll_length, POINTS)
    fillet, flank = fillet_points(teeth, angles), flank_points(teeth, rolls[1:])
    half_thickness, position = np.concatenate([fillet, flank]).T
    return ToothOutline(position, half_thickness)


def contact_position(teeth: SpurGear, roll_length: float) -> float:
    """Position x on the centre line of the flank's point at a roll length [m]."""
    return float(flank_points(teeth, np.array([roll_length]))[0, 1])


def tangent_point(teeth: SpurGear, angle: float = TANGENT_ANGLE) -> tuple[float, float]:
    """Point (x, y) of the fillet whose tangent makes an angle with the centre line [m].

    Where the outline never is as steep as that it begins at the root circle.
    """
    outline = tooth_outline(teeth)
    x, y = outline.position[:POINTS], outline.half_thickness[:POINTS]
    steepness = np.arctan2(-np.diff(y), np.diff(x))
    middles = 0.5 * (x[:-1] + x[1:])
    place = float(np.interp(-angle, -steepness, middles))
    return place, float(outline.thickness_at(place))


@dataclass(frozen=True, eq=False)
class CutTooth:
    """Teeth of a gear under unit load, all with the same crack or without one.

    crack : at the root of the loaded flank, or None
    """

    gear: Gear
    crack: RootCrack | None = None

    @property
    def teeth(self) -> SpurGear:
        return self.gear.geometry

    @property
    def base_radius(self) -> float:
        return self.teeth.base_radius

    @property
    def base_pitch(self) -> float:
        return self.teeth.base_pitch

    @property
    def base_half_angle(self) -> float:
        return self.teeth.base_half_angle

    @property
    def tip_roll_length(self) -> float:
        return self.teeth.tip_roll_length

    @property
    def material(self) -> Material:
        return Material(self.gear.young_modulus, self.gear.poisson_ratio)

    @property
    def outline(self) -> ToothOutline:
        return tooth_outline(self.teeth)

    @property
    def foundation(self) -> ToothFoundation:
        outline, teeth = self.outline, self.teeth
        return ToothFoundation(
            root_radius=teeth.root_radius,
            hub_radius=teeth.hub_radius,
            root_half_angle=math.atan2(outline.half_thickness[0], outline.position[0]),
            young_modulus=self.gear.young_modulus,
        )

    def load(self, roll_length: float) -> FlankForce:
        """Line of action that touches the flank at a roll length [m]."""
        rb = self.base_radius
        return FlankForce(rb, roll_length / rb - self.base_half_angle)

    def beam(self, roll_length: float, face_width: float) -> BeamCompliance:
        """Bending, shear and thrust, scalars [m/N]."""
        end, load = contact_position(self.teeth, roll_length), self.load(roll_length)
        material = ToothMaterial(*self.material)
        if self.crack is None:
            sections = self.outline.sections(end)
            return beam_compliance(sections, load, material, face_width)
        return cracked_compliance(
            self.outline, end, load, self.crack, material, face_width
        )

    def body(self, roll_length: float, face_width: float) -> float:
        """Compliance of the body below the tooth [m/N]."""
        rb, beta = self.load(roll_length)
        height = rb / np.cos(beta)
        return float(self.foundation.compliance(height, beta, face_width))

    def compliance(self, roll_length: ArrayLike, face_width: float) -> Array:
        """Tooth and body, without contact, at roll lengths (n,) [m], (n,) [m/N]."""
        rolls = np.atleast_1d(np.asarray(roll_length, float))
        parts = (
            self.beam(s, face_width).total + self.body(s, face_width) for s in rolls
        )
        return np.fromiter(parts, float, rolls.size)
