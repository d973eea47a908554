"""Gear sets in motion, built once each, and a march that keeps whole states."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

import hypothesis
import numpy as np
import pytest
from conftest import SMALL_HUBS

from fegear.dynamics.cross_mesh import cross_mesh_compliance
from fegear.dynamics.full import FullStepper, full_model
from fegear.dynamics.gear_elasticity import elastic_damping
from fegear.dynamics.kernels.step_arrays import Clock
from fegear.dynamics.mesh_load_curves import mesh_load_curves
from fegear.dynamics.model import DynamicModel, ElasticGear, dynamic_model
from fegear.dynamics.scheme import generalized_alpha
from fegear.dynamics.sides import MeshLoadCurves
from fegear.dynamics.stepper import MotionState, ReducedStepper, TimeSteps, empty_record
from fegear.elasticity.cyclic_gear import cyclic_gear
from fegear.elasticity.gear_modes import gear_modes
from fegear.elasticity.material import PlaneMaterial
from fegear.elasticity.sector import CyclicSector
from fegear.gearset import load_gear_set
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import StaticsSettings
from lumped import LumpedSystem
from meshes import MeshSize

# first calls import and compile
hypothesis.settings.register_profile("dynamics", deadline=None)
hypothesis.settings.load_profile("dynamics")

LAW_TORQUE = 100.0  # N m on the input gear, for which tables and laws are made
CUTOFF = 30e3  # Hz
Arrays = tuple[np.ndarray, ...]
COARSE = MeshSize().refined(0.25)
LIGHT = 0.01  # damping ratio of elastic modes


@cache
def elastic_gear(
    gear: Gear, cutoff: float | None, damping: float
) -> ElasticGear | None:
    if cutoff is None:
        return None
    material = StaticsSettings().material(gear)
    modes = gear_modes(CyclicSector(gear.geometry, material), gear.density, cutoff)
    return ElasticGear(modes, gear.face_width, elastic_damping(gear, damping))


@dataclass(frozen=True, eq=False)
class Case:
    """A gear set under torque with its pair laws, ready to be given modes."""

    gear_set: GearSet
    reference: LumpedSystem
    laws: list[MeshLoadCurves]
    settings: StaticsSettings

    @cached_property
    def beside(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Compliance between contacts of different meshes, for all its models."""
        far = cross_mesh_compliance(self.gear_set, self.laws, self.settings)
        return None if far is None else (far, np.zeros_like(far))

    def model(self, cutoff: float | None = None, damping: float = 0.01) -> DynamicModel:
        """With elastic modes below a cut-off [Hz], or quasi-static without."""
        elastic = [elastic_gear(gear, cutoff, damping) for gear in self.gear_set.gears]
        return dynamic_model(
            self.gear_set, self.reference, self.laws, elastic, self.beside
        )

    def stepper(
        self, cutoff: float | None = None, damping: float = 0.01, remaining: float = 0.9
    ) -> ReducedStepper:
        return ReducedStepper(self.model(cutoff, damping), generalized_alpha(remaining))


Errors = tuple[tuple[float, ...], ...]


def edited(
    gear_set: GearSet, held: float | None, backlash: float | None, errors: Errors = ()
) -> GearSet:
    """With the last gear held [N m/rad], other backlash and pitch errors [m]."""
    if errors:
        pairs = zip(gear_set.gears, errors, strict=True)
        gears = tuple(
            replace(gear, pitch_errors=gear_errors) for gear, gear_errors in pairs
        )
        gear_set = replace(gear_set, gears=gears)
    if held is not None:
        last = replace(gear_set.gears[-1], coupling_stiffness=held)
        gear_set = replace(gear_set, gears=(*gear_set.gears[:-1], last))
    if backlash is not None:
        meshes = tuple(replace(m, backlash=backlash) for m in gear_set.meshes)
        gear_set = replace(gear_set, meshes=meshes)
    return gear_set


@pytest.fixture(scope="session")
def case_of(compliance_cache) -> Callable[..., Case]:
    """Cases by what they differ in from the plain pair at 100 N m.

    edits : pairs of names and values; relief : [um] at all tips
    held : stiffness that holds the last gear [N m/rad]; backlash : [m]
    errors : pitch errors of every gear [m]
    """
    tables = cache(
        lambda level: Excitations(ExcitationSettings(resolution=level, positions=64))
    )

    @cache
    def make(
        name: str = "liu-pair",
        torque: float = LAW_TORQUE,
        *,
        relief: float = 0.0,
        edits: tuple[tuple[str, Any], ...] = (),
        held: float | None = None,
        backlash: float | None = None,
        damping: float | None = None,
        friction: float = 0.0,
        resolution: str = "default",
        errors: Errors = (),
    ) -> Case:
        names = (SMALL_HUBS if name == "liu-pair" else {}) | dict(edits)
        if relief:
            names |= {"mesh.1.tip_relief.magnitude_um": relief}
        gear_set = edited(load_gear_set(name, names), held, backlash, errors)
        excitations = tables(resolution)
        on_meshes = mesh_torques_at(gear_set, LAW_TORQUE)
        numbers = range(len(on_meshes))
        mesh_excitations = [
            excitations.mesh_excitation(gear_set, m, on_meshes[m], 1) for m in numbers
        ]
        statics = StaticsSettings(friction=friction, resolution=resolution)
        laws = []
        for m in numbers:
            equal = without_pitch_errors(gear_set)
            ste = excitations.table(equal, m, on_meshes[m])["ste_m"]
            laws.append(mesh_load_curves(gear_set, m, float(ste.max()), statics))
        train = train_of(gear_set, torque, damping_ratio=damping)
        return Case(
            gear_set, LumpedSystem(train, tuple(mesh_excitations)), laws, statics
        )

    return make


@dataclass(frozen=True, eq=False)
class Track:
    """Whole states over t points: motion (t, 4, n) and contact (t, 3, c)."""

    motion: np.ndarray
    contact: np.ndarray
    deflection: np.ndarray

    @property
    def end(self) -> MotionState:
        return MotionState(self.motion[-1].copy(), self.contact[-1].copy())


@pytest.fixture(scope="session")
def track() -> Callable[..., Track]:
    """March step by step and keep every state: (stepper, state, steps)."""

    def march(stepper: ReducedStepper, state: MotionState, steps: TimeSteps) -> Track:
        from fegear.dynamics.kernels import reduced as kernel

        model, step_matrices = stepper.model, stepper.step(steps.size)
        motion, contact = state.motion.copy(), state.contact.copy()
        record = empty_record(model, 1)
        motions, contactes, deflections = [motion.copy()], [contact.copy()], []
        for n in range(steps.count):
            number = steps.start + (n if steps.frequency else 0)
            speed = 2.0 * np.pi * steps.frequency
            clock = Clock(speed, steps.cycle, number, np.inf)
            status, _ = kernel.integrate(
                model.arrays, step_matrices, clock, motion, contact, record
            )
            assert status == kernel.FINISHED
            motions.append(motion.copy())
            contactes.append(contact.copy())
            deflections.append(record.mesh[:, 0].copy())
        deflection = np.array([deflections[0][0], *(d[1] for d in deflections)])
        return Track(np.array(motions), np.array(contactes), deflection)

    return march


@pytest.fixture(scope="session")
def rest() -> Callable[[DynamicModel], MotionState]:
    """Nothing moves, nothing is loaded."""
    return lambda model: MotionState(
        np.zeros((4, model.size)), np.zeros((3, model.contact_count))
    )


def sector_of(gear):
    material = PlaneMaterial(gear.young_modulus, gear.poisson_ratio, "stress")
    return CyclicSector(gear.geometry, material, COARSE)


@pytest.fixture(scope="session")
def full_of(case_of):
    """All freedoms of coarse finite elements; arguments as for `case_of`."""

    def make(**options):
        case = case_of(**options)
        gears = case.gear_set.gears
        wholes = [cyclic_gear(sector_of(gear), gear.density) for gear in gears]
        damping = [elastic_damping(gear, LIGHT) for gear in gears]
        far = None if case.beside is None else case.beside[0]
        hubs, fields = full_model(
            case.gear_set, case.reference, case.laws, wholes, damping, far
        )
        return FullStepper(hubs, generalized_alpha(0.9), fields)

    return make
