"""Tooth stiffness by the potential-energy method on the tooth that the rack cuts.

The conventions are those of `GearElementTVMS` and `Mesh` of ROSS (after Ma et al.,
2014), so that their values can be computed anew from the outline of `meshes`. They
differ from `validation.oracles.potential_energy` in four points:

- the fillet is the trochoid of the rack tip, not a circle of 0.38 module;
- the body formula of Sainsot et al. has the height of the point of contact for u, not
  that at which the line of action crosses the centre line of the tooth;
- its half tooth angle at the root is a formula that gives less than the outline has;
- contact begins at the lowest point of the driver's involute that the rack cuts, and
  pressure angles of both gears change in proportion to their rotation. The line of
  action has tangents of pressure angles in proportion to it.
"""

from __future__ import annotations

import math

import numpy as np

from fegear.gearset.model import Gear
from lumped.closed_forms.tooth_energy import (
    FlankForce,
    ToothFoundation,
    ToothMaterial,
    beam_compliance,
)
from meshes import SpurGear
from validation.oracles.cut_tooth import contact_position, tooth_outline
from validation.oracles.hertz import Material, linear_compliance


def tooth_compliance(gear: Gear, pressure_angle: float, width: float) -> float:
    """Compliance of a tooth and its body, loaded at a pressure angle [m/N]."""
    teeth = gear.geometry
    roll_length = teeth.base_radius * math.tan(pressure_angle)
    load = FlankForce(
        teeth.base_radius, math.tan(pressure_angle) - teeth.base_half_angle
    )
    height = contact_position(teeth, roll_length)
    material = ToothMaterial(gear.young_modulus, gear.poisson_ratio)
    sections = tooth_outline(teeth).sections(height)
    body = ToothFoundation(
        root_radius=teeth.root_radius,
        hub_radius=teeth.hub_radius,
        root_half_angle=root_half_angle(teeth),
        young_modulus=gear.young_modulus,
    )
    beam = beam_compliance(sections, load, material, width).total
    return float(beam + body.compliance(height, load.angle, width))


def root_half_angle(teeth: SpurGear) -> float:
    """The formula of ROSS for half the tooth angle at the root circle [rad]."""
    alpha = teeth.pressure_angle
    rho = teeth.rack_tip_radius / teeth.module
    angle = 0.5 * math.pi + 2.0 * math.tan(alpha) * (1.0 - rho)
    return (angle + 2.0 * rho / math.cos(alpha)) / teeth.teeth


def pair_stiffness(gears: tuple[Gear, Gear], advance: float, width: float) -> float:
    """Stiffness of one pair whose driver has advanced from the start of contact [N/m].

    advance : of the pressure angle of the driver [rad]
    """
    driver, driven = (gear.geometry for gear in gears)
    angles = (
        math.atan(driver.form_roll_length / driver.base_radius) + advance,
        _tip_angle(driven) - driver.teeth / driven.teeth * advance,
    )
    contact = linear_compliance(*(_material(gear) for gear in gears)) / width
    teeth = (
        tooth_compliance(gear, angle, width)
        for gear, angle in zip(gears, angles, strict=True)
    )
    return 1.0 / (contact + sum(teeth))


def mesh_stiffness(
    gears: tuple[Gear, Gear], contact_ratio: float, position: float, width: float
) -> float:
    """Stiffness of all pairs, 0 to below 1 pitch after the start [N/m]."""
    driver = gears[0].geometry
    start = math.atan(driver.form_roll_length / driver.base_radius)
    pitch = (_tip_angle(driver) - start) / contact_ratio
    stiffness = pair_stiffness(gears, position * pitch, width)
    if position <= contact_ratio - 1.0:
        stiffness += pair_stiffness(gears, (position + 1.0) * pitch, width)
    return stiffness


def mean_stiffness(
    gears: tuple[Gear, Gear], contact_ratio: float, width: float
) -> float:
    """Mean over the pitch, of double and single contact apart [N/m]."""
    double = contact_ratio - 1.0
    nodes, weights = np.polynomial.legendre.leggauss(12)
    total = 0.0
    for low, high in ((0.0, double), (double, 1.0)):
        places = low + 0.5 * (high - low) * (1.0 + nodes)
        inside = 0.5 * (high - low) * weights
        values = [mesh_stiffness(gears, contact_ratio, p, width) for p in places]
        total += float(inside @ np.array(values))
    return total


def _tip_angle(teeth: SpurGear) -> float:
    return math.acos(teeth.base_radius / teeth.tip_radius)


def _material(gear: Gear) -> Material:
    return Material(gear.young_modulus, gear.poisson_ratio)
