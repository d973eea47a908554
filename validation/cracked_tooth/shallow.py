"""Cracks that are short beside the fillet: what the stress at its surface adds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from fegear.statics.solving import solve_mesh
from lumped.closed_forms.tooth_crack import BENDING_FIT
from validation.cracked_tooth.drops import TANGENT_ANGLE
from validation.cracked_tooth.healthy import HealthyPair
from validation.oracles.cut_tooth import tangent_point


@dataclass(frozen=True)
class RootStress:
    """Stress where the crack begins, the healthy tooth loaded at the pitch point [Pa].

    elements : largest tension in the fillet, by finite elements
    beam : 6 M / (w b^2) of the section there
    """

    elements: float
    beam: float

    @property
    def concentration(self) -> float:
        return self.elements / self.beam


def root_stress(pair: HealthyPair) -> RootStress:
    """Stress of the driver's tooth; one pair must carry the load at the pitch point."""
    settings = replace(pair.settings, root_stress=True)
    table = solve_mesh(pair.gear_set, pair.mesh, [pair.torque], settings).table
    tooth = pair.teeth[0]
    start, half = tangent_point(tooth.teeth, TANGENT_ANGLE)
    beta = pair.pair.pitch_point / tooth.base_radius - tooth.base_half_angle
    moment = pair.force * (tooth.base_radius - start * math.cos(beta))
    beam = 6.0 * moment / (pair.width * (2.0 * half) ** 2)
    return RootStress(float(table["driver_root_stress_Pa"][0, 0]), beam)


def shallow_crack_compliance(pair: HealthyPair, stress: float, depth: float) -> float:
    """Compliance that a crack adds in a uniform stress at the surface [m/N].

    The energy 2 w K^2 / E that it releases per depth, K = 1.122 stress sqrt(pi a), over
    the square of the force.

    stress : at the surface under the load of the pair [Pa]
    depth : a [m], small beside the fillet
    """
    E, _ = pair.teeth[0].material
    intensity = math.pi * (BENDING_FIT[0] * stress * depth) ** 2
    return pair.width * intensity / (E * pair.force**2)
