"""From a gear set to a dynamic model of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fegear.contact.pair_laws import pair_laws
from fegear.dynamics.far import far_coupling
from fegear.dynamics.model import DynamicModel, ElasticGear, dynamic_model
from fegear.dynamics.sides import MeshLaws
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.modes import GearModes, gear_modes
from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.statics import RESOLUTIONS, StaticsSettings, contact_problem
from lumped.system import LumpedSystem

POSITIONS = 128  # of a mesh cycle at which pair laws are solved
REACH = 6.0  # times the largest static deflection: squeeze up to which laws are curved
BACK = 20.0  # times the same: larger backlash is out of reach


def mesh_laws(
    gear_set: GearSet, mesh: int, static: float, settings: StaticsSettings
) -> MeshLaws:
    """Laws of a mesh (index from 0) whose largest static deflection is `static` [m]."""
    resolution = RESOLUTIONS[settings.resolution]
    problem = replace(
        contact_problem(gear_set, mesh, settings, resolution),
        driver_pitch_errors=(),
        driven_pitch_errors=(),
    )
    phase = mesh_phases(gear_set)[mesh].value
    position = phase + np.arange(POSITIONS + 1) / POSITIONS
    reach, backlash = REACH * static, gear_set.meshes[mesh].backlash
    near = backlash < BACK * static
    return MeshLaws(
        drive=pair_laws(problem, position, reach),
        back=pair_laws(problem, position, reach, back=True) if near else None,
        backlash=backlash,
        friction=problem.friction,
    )


def modes_of(gear_set: GearSet, cutoff_Hz: float) -> list[GearModes]:
    """Elastic modes of every gear; equal gears share theirs."""
    found: dict[tuple[object, ...], GearModes] = {}
    modes = []
    for gear in gear_set.gears:
        material = PlaneMaterial(gear.young_modulus, gear.poisson_ratio, "stress")
        key = (gear.geometry, material, gear.density)
        if key not in found:
            found[key] = gear_modes(gear.geometry, material, gear.density, cutoff_Hz)
        modes.append(found[key])
    return modes


def reduced_model(
    gear_set: GearSet,
    reference: LumpedSystem,
    laws: list[MeshLaws],
    modes: list[GearModes] | None = None,
    elastic_damping: float = 0.01,
) -> DynamicModel:
    """With elastic modes, or without any: quasi-static fidelity."""
    elastic: list[ElasticGear | None] = [None] * len(gear_set.gears)
    if modes is not None:
        elastic = [
            ElasticGear(
                m, gear.face_width, np.full(m.frequencies_Hz.size, elastic_damping)
            )
            for gear, m in zip(gear_set.gears, modes, strict=True)
        ]
    far = far_coupling(gear_set, laws)
    return dynamic_model(gear_set, reference, laws, elastic, far)
