"""Small spur and helical pairs whose contact is in slices of the face width.

One of the gears may be internal.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from conftest import make_gear, make_helical

from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.width.contact import WidthContact, slice_places
from fegear.elasticity.cache import cached_flank_compliance
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.root_stress import root_influence
from fegear.elasticity.sector import cyclic_sector
from fegear.elasticity.wide_flank import (
    wide_flank,
    width_and_root_modes,
    width_modes,
)
from fegear.elasticity.wide_root import WideRoot
from meshes import GearPair, MeshSize
from meshes.helical import HelicalInternalGear
from meshes.internal import InternalGear

STEEL = PlaneMaterial(206e9, 0.3, "strain")
COARSE = MeshSize().refined(0.5)
WIDTH, TORQUE = 20e-3, 100.0
DEGREE, MESH = 4, MeshSize().refined(0.25)  # coarse
TEETH, HUBS = (25, 36), (15e-3, 20e-3)
RING_TEETH = 61


@cache
def gears(helix_angle_deg, with_ring=False):
    if with_ring:
        return gears(helix_angle_deg)[0], ring_of(gears(helix_angle_deg)[0])
    if helix_angle_deg == 0.0:
        return tuple(map(make_gear, TEETH, HUBS))
    return tuple(
        make_helical(z, hub, sign * helix_angle_deg)
        for z, hub, sign in zip(TEETH, HUBS, (1, -1), strict=True)
    )


def ring_of(pinion):
    """An internal gear that a pinion fits into."""
    module = pinion.module
    sizes = {
        "teeth": RING_TEETH,
        "module": module,
        "pressure_angle": pinion.pressure_angle,
        "profile_shift": 0.0,
        "tip_radius": (-0.5 * RING_TEETH + 0.7) * module,
        "dedendum": 1.2 * module,
        "rack_tip_radius": 0.2 * module,
        "hub_radius": (-0.5 * RING_TEETH - 4.0) * module,
        "cutter_teeth": 25,
    }
    if not pinion.twist:
        return InternalGear(**sizes)
    angle = math.atan(pinion.twist * pinion.reference_radius)
    return HelicalInternalGear(**sizes, helix_angle=-angle)


@cache
def wide_flanks(helix_angle_deg, with_ring=False):
    material = replace(STEEL, plane="width", width=WIDTH)
    return tuple(
        wide_flank(
            gear,
            cached_flank_compliance(gear, STEEL, COARSE),
            width_modes(gear, material, DEGREE, MESH),
            WIDTH,
        )
        for gear in gears(helix_angle_deg, with_ring)
    )


@cache
def wide_roots(helix_angle_deg):
    material = replace(STEEL, plane="width", width=WIDTH)
    return tuple(
        WideRoot(
            root_influence(cyclic_sector(gear, STEEL, COARSE)),
            width_and_root_modes(gear, material, DEGREE, MESH)[1],
            WIDTH,
        )
        for gear in gears(helix_angle_deg)
    )


def problem(
    helix_angle_deg=0.0, gap=None, slices=16, width=WIDTH, ring=None, **changes
):
    """ring : "driven" or "driver" for a pair with an internal gear."""
    turned = slice(None, None, -1 if ring == "driver" else 1)
    pair = gears(helix_angle_deg, ring is not None)[turned]
    distance = abs(sum(gear.reference_radius for gear in pair))
    flanks = [
        ContactFlank(compliance=cached_flank_compliance(gear, STEEL, COARSE))
        for gear in pair
    ]
    wide = wide_flanks(helix_angle_deg, ring is not None)[turned]
    gap = np.zeros(slices) if gap is None else gap(slice_places(width, slices))
    face = WidthContact(
        driver=wide[0], driven=wide[1], width=width, gap=gap, back_gap=gap
    )
    return ContactProblem(
        pair=GearPair(*pair, distance),
        driver=flanks[0],
        driven=flanks[1],
        face_width=width,
        solver=face,
        **changes,
    )


def slope(depth):
    return lambda z: depth * (0.5 + z / WIDTH)
