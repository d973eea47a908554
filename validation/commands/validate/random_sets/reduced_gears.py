"""Finite-element gears in motion with more elastic modes than `dynamics` would keep."""

from __future__ import annotations

from collections.abc import Sequence

from fegear.dynamics.build import FiniteElements
from fegear.dynamics.cross_mesh import cross_mesh_compliance
from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.gear_elasticity import (
    cached_gear_modes,
    default_cutoff,
    elastic_damping,
)
from fegear.dynamics.mesh_load_curves import all_mesh_load_curves, tables_of_equal_teeth
from fegear.dynamics.model import DynamicModel, dynamic_model
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations
from fegear.statics.settings import StaticsSettings
from lumped.train.system import LumpedSystem


def reduced_gears(
    gear_set: GearSet,
    torque: float,
    reference: LumpedSystem,
    excitations: Excitations,
    elastic: Sequence[ElasticGear],
) -> DynamicModel:
    """Fidelity reduced at a torque on the input gear [N m].

    reference : the lumped system (Model-1) at that torque
    """
    tables = tables_of_equal_teeth(gear_set, torque, excitations)
    statics = excitations.settings.statics
    load_curves = all_mesh_load_curves(gear_set, tables, statics)
    cross_mesh = cross_mesh_compliance(gear_set, load_curves, statics)
    neighbours = None if cross_mesh is None else (cross_mesh, 0.0 * cross_mesh)
    return dynamic_model(gear_set, reference, load_curves, elastic, neighbours)


def elastic_gears(
    gear_set: GearSet, speeds: Sequence[float], statics: StaticsSettings, more: float
) -> list[ElasticGear]:
    """Elastic gears with modes below so many times each gear's usual cut-off.

    speeds : mesh frequencies of the first mesh [Hz]
    """
    ratio, highest, gears = FiniteElements().elastic_damping, max(speeds), []
    for gear in gear_set.gears:
        cutoff_Hz = more * default_cutoff(gear, highest)
        modes = cached_gear_modes(statics.sector(gear), gear.density, cutoff_Hz)
        damping = elastic_damping(gear, ratio)
        gears.append(ElasticGear(modes, gear.face_width, damping))
    return gears
