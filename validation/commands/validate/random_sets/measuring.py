"""A random gear set by the finite elements and by lumped models, with what each costs.

The reference is fidelity reduced with elastic modes up to twice each gear's usual
cut-off, the speed rising. Its distance from the same with the usual cut-off shows how
far the reference itself can be trusted.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.elastic import ElasticGear
from fegear.dynamics.model import DynamicModel
from fegear.dynamics.stepper import DynamicSettings, ReducedStepper
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations
from fegear.studies.trains.model_texts import body_modes_warnings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from fegear.train.truncation import truncation_bound
from lumped.common.checks import require_present
from lumped.common.progress import Progress, silent
from lumped.steady.integration_settings import Settings, SteadySettings
from lumped.steady.steady_state import Stepper
from lumped.steady.steppers import stepper_of, warm_up
from lumped.steady.sweep import Branch, Direction, sweep_branch
from lumped.train.system import LumpedSystem
from validation.commands.validate.random_sets.generator import kind_of
from validation.commands.validate.random_sets.reduced_gears import (
    elastic_gears,
    reduced_gears,
)
from validation.oracles.loaded_modes import loaded_modes

Rows = list[list[float]]
SPEEDS = 16
SPAN = 0.25, 1.3  # of speeds, over the highest mesh resonance of Model-1
FASTEST_HZ = 8000.0
MORE = 2.0  # times the usual cut-offs: of the reference
REFERENCE, REDUCED, MODEL_1 = "reference", "reduced", "model-1"
WITHOUT, COUPLED_UP = "without-modes", "coupled"
COUPLED_DOWN, REFERENCE_DOWN = "coupled-down", "reference-down"
NATURAL = 1.5  # over the same: natural frequencies up to there are compared,
PARTNERS = 1.1  # over that: up to there they may have their partners
SAME_MODE = 0.01  # of the frequency, of one gear and number of nodal diameters


@dataclass(frozen=True)
class Measured:
    """What a set gave, as plain values.

    number : of the set, from 0; hub_over_root : of each gear
    torque_Nm : on the input gear; speeds_Hz : of the first mesh
    rms_m : by source (speeds, meshes) RMS of the dynamic transmission error, NaN where
        a sweep ended before; multiples : period multiples, 0 of what does not repeat
    ms_per_speed : by source, of processor time
    body_modes : of the coupled model; left_out : bound on what it leaves out, relative
    warnings : of its left-out body modes
    resonance_Hz : the highest mesh resonance of Model-1
    natural, natural_fe : (frequency [Hz], mesh energy) about the loaded state
    """

    number: int
    name: str
    kind: str
    teeth: list[int]
    hub_over_root: list[float]
    torque_Nm: float
    speeds_Hz: list[float]
    rms_m: dict[str, Rows]
    multiples: dict[str, list[list[int]]]
    ms_per_speed: dict[str, float]
    body_modes: int
    left_out: float
    warnings: list[str]
    resonance_Hz: float
    natural: Rows
    natural_fe: Rows


class SweepSpec(NamedTuple):
    """What is swept, in a direction of the speed."""

    stepper: Stepper
    settings: SteadySettings
    direction: Direction = "up"


def measure(
    gear_set: GearSet,
    number: int,
    report: Progress = silent,
    count: int = SPEEDS,
) -> Measured:
    """At so many speeds, all on one core."""
    report("tables", 0, 1)
    torque, excitations = gear_set.meshes[0].torques[0], Excitations()
    plain = lumped_system(
        gear_set, torque, LumpedModel(number=1), excitations=excitations
    )
    resonance = highest_resonance(plain)
    speeds = speeds_of(resonance, count)
    coupled, without = (
        lumped_system(gear_set, torque, model, excitations)
        for model in (
            LumpedModel(number="coupled"),
            LumpedModel(number="coupled", without=("modes",)),
        )
    )
    report("elastic modes", 0, 1)
    statics, fe = excitations.settings.statics, []
    for more in (MORE, 1.0):
        elastic = elastic_gears(gear_set, speeds, statics, more)
        fe_model = reduced_gears(gear_set, torque, plain, excitations, elastic)
        fe.append((fe_model, elastic))
    lumped = {MODEL_1: plain, WITHOUT: without, COUPLED_UP: coupled}
    names = REFERENCE, REDUCED
    sources = {
        name: fe_source(model) for name, (model, _) in zip(names, fe, strict=True)
    }
    sources |= {name: lumped_source(system) for name, system in lumped.items()}
    for down, up in ((COUPLED_DOWN, COUPLED_UP), (REFERENCE_DOWN, REFERENCE)):
        sources[down] = sources[up]._replace(direction="down")
    columns = sweep_sources(sources, speeds, report)
    natural, natural_fe = natural_frequencies(coupled, *fe[0], resonance)
    return Measured(
        number=number,
        name=gear_set.name,
        kind=kind_of(number),
        teeth=[gear.geometry.teeth for gear in gear_set.gears],
        hub_over_root=[
            gear.geometry.hub_radius / gear.geometry.root_radius
            for gear in gear_set.gears
        ],
        torque_Nm=torque,
        speeds_Hz=speeds,
        **columns,
        body_modes=kept_count(coupled),
        left_out=truncation_bound(coupled, speeds) or math.nan,
        warnings=list(body_modes_warnings(coupled, speeds)),
        resonance_Hz=resonance,
        natural=natural,
        natural_fe=natural_fe,
    )


def highest_resonance(system: LumpedSystem) -> float:
    """Highest frequency of the modes that strain a mesh [Hz]."""
    return float(system.modes.mesh_resonances_Hz.max())


def speeds_of(resonance: float, count: int = SPEEDS) -> list[float]:
    """Equal steps around the highest mesh resonance, in whole Hz."""
    last = min(SPAN[1] * resonance, FASTEST_HZ)
    first = min(SPAN[0] * resonance, 0.5 * last)
    return [float(round(speed)) for speed in np.linspace(first, last, count)]


def kept_count(system: LumpedSystem) -> int:
    """Body modes that the coupled model has as coordinates."""
    return require_present(system.contacts, "coupled model").body_modes.count


def fe_source(model: DynamicModel) -> SweepSpec:
    settings = DynamicSettings()
    return SweepSpec(ReducedStepper(model, settings.scheme), settings)


def lumped_source(system: LumpedSystem) -> SweepSpec:
    settings = Settings()
    return SweepSpec(stepper_of(system, settings), settings)


def sweep_sources(
    sources: Mapping[str, SweepSpec], speeds: Sequence[float], report: Progress
) -> dict[str, Any]:
    """The fields `rms_m`, `multiples` and `ms_per_speed` of `Measured`."""
    columns: dict[str, Any] = {"rms_m": {}, "multiples": {}, "ms_per_speed": {}}
    for done, (name, source) in enumerate(sources.items()):
        report(f"sweep of {name}", done, len(sources))
        warm_up(source.stepper, speeds[0], source.settings)
        start = time.process_time()
        branch = sweep_branch(source.stepper, speeds, source.direction, source.settings)
        seconds = time.process_time() - start
        columns["rms_m"][name] = by_speed(branch, speeds, "dte_rms", math.nan)
        columns["multiples"][name] = by_speed(branch, speeds, "period_multiple", 0)
        columns["ms_per_speed"][name] = 1e3 * seconds / max(len(branch.responses), 1)
    return columns


def by_speed(
    branch: Branch, speeds: Sequence[float], name: str, missing: float
) -> Rows:
    """A column (speeds, meshes) of a branch, in the order of the speeds."""
    rows = {
        response.frequency: getattr(response, name).tolist()
        for response in branch.responses
    }
    nothing = [missing] * len(branch.system.excitations)
    return [rows.get(speed, nothing) for speed in speeds]


def natural_frequencies(
    coupled: LumpedSystem,
    model: DynamicModel,
    elastic: Sequence[ElasticGear],
    resonance: float,
) -> tuple[Rows, Rows]:
    """Natural frequencies of the coupled model and of the finite elements, about their
    loaded states.

    Both average the same modes over the mesh cycle, those that the coupled model has
    and those that are as low as what is compared.
    """
    highest = PARTNERS * NATURAL * resonance
    loaded = require_present(coupled.loaded, "coupled model")
    low = np.sqrt(model.modal.rigidity) < 2.0 * np.pi * highest
    averaged = low | kept_modes(coupled, model, elastic)
    fe_modes = loaded_modes(model, averaged, highest)
    rows = np.stack([loaded.frequency_Hz, loaded.mesh_energy.sum(axis=0)], axis=1)
    rows = rows[(rows[:, 0] > 0.0) & (rows[:, 0] < highest)]
    pairs = np.stack([fe_modes.frequency_Hz, fe_modes.mesh_energy], axis=1)
    return rows.tolist(), pairs.tolist()


def kept_modes(
    coupled: LumpedSystem, model: DynamicModel, elastic: Sequence[ElasticGear]
) -> NDArray[np.bool_]:
    """Which elastic modes (e,) of the finite elements the coupled model has as well."""
    bodies, mode_mask = (
        require_present(coupled.contacts, "coupled model").body_modes,
        np.zeros(model.modal.rigidity.size, bool),
    )
    diameters = np.concatenate(
        [elastic_gear.modes.nodal_diameters for elastic_gear in elastic]
    )
    angular = np.sqrt(model.modal.rigidity)
    for gear, n, mode_angular in zip(
        bodies.gears, bodies.nodal_diameters, bodies.angular, strict=True
    ):
        same = (model.modal.gear_of_mode == gear) & (diameters == n)
        mode_mask |= same & (np.abs(angular - mode_angular) < SAME_MODE * mode_angular)
    return mode_mask
