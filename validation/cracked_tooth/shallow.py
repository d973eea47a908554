"""Cracks that are short beside the fillet: what the stress at its surface adds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fegear.elasticity.cache import cached_root_influence
from fegear.elasticity.root_stress import FlankLoad
from fegear.elasticity.sector import RIGHT
from lumped.closed_forms.tooth_crack import BENDING_FIT
from meshes.profile import arc_from_tip
from validation.cracked_tooth.drops import TANGENT_ANGLE
from validation.cracked_tooth.healthy import HealthyPair
from validation.oracles.cut_tooth import tangent_point


@dataclass(frozen=True)
class MouthStress:
    """Stress where the crack begins, the healthy tooth loaded at the pitch point [Pa].

    elements : along the fillet there, by finite elements
    beam : 6 M / (w b^2) of the section there
    """

    elements: float
    beam: float

    @property
    def concentration(self) -> float:
        return self.elements / self.beam


def mouth_stress(pair: HealthyPair) -> MouthStress:
    """Stress of the driver's tooth under the whole load of the mesh."""
    tooth = pair.teeth[0]
    start, half = tangent_point(tooth.teeth, TANGENT_ANGLE)
    beta = pair.pair.pitch_point / tooth.base_radius - tooth.base_half_angle
    moment = pair.force * (tooth.base_radius - start * math.cos(beta))
    beam = 6.0 * moment / (pair.width * (2.0 * half) ** 2)
    influence = cached_root_influence(
        tooth.teeth, pair.settings.material(tooth.gear), pair.settings.size
    )
    arc = float(arc_from_tip(tooth.teeth, pair.pair.pitch_point))
    load = FlankLoad(0, RIGHT, np.array(arc), np.array(pair.force / pair.width))
    loaded_fillet, heights = (
        influence.along_fillets([load])[0],
        influence.fillets[0, :, 1],
    )
    order = np.argsort(heights)
    stress = np.interp(start, heights[order], loaded_fillet[order])
    return MouthStress(float(stress), beam)


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
