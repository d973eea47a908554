"""Finite-element dynamics from rest, over the same mesh periods for all steppers.

No branch can be missed, so that differences are those of one well-defined motion.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.stepper import DynamicSettings, ImplicitStepper, TimeSteps
from fegear.gearset.model import GearSet
from fegear.statics.excitation import Excitations
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.array_types import Array
from lumped.train.system import LumpedSystem

COMMON_STEPS = 128  # steps of a period where they are not what is compared
PERIODS = 8  # of the first mesh, that every run passes
SPEEDS = 0.5, 0.9, 1.5  # over the leading natural frequency


@dataclass(frozen=True, eq=False)
class Subject:
    """A gear set at a torque on its input gear [N m], and its Model-1.

    periods : of the first mesh, that every run passes
    parts : speeds over the leading natural frequency
    """

    gear_set: GearSet
    torque: float
    reference: LumpedSystem
    excitations: Excitations
    periods: int = PERIODS
    parts: tuple[float, ...] = SPEEDS

    @property
    def speeds(self) -> list[float]:
        """Frequencies of the first mesh [Hz]."""
        return [part * leading_frequency(self.reference) for part in self.parts]

    def stepper(self, elements: FiniteElements) -> tuple[ImplicitStepper, int, float]:
        """A stepper, its elastic freedoms, and the seconds that it took."""
        start = time.perf_counter()
        inputs = (self.speeds, elements, DynamicSettings(), self.excitations)
        prepared = prepare(self.gear_set, self.torque, self.reference, *inputs)
        return prepared.stepper, sum(prepared.elastic), time.perf_counter() - start

    def runs(self, stepper: ImplicitStepper, steps: int) -> list[tuple[Array, float]]:
        """`run` at every speed."""
        return [run(stepper, f, steps, self.periods) for f in self.speeds]


def subject(
    gear_set: GearSet,
    torque: float,
    excitations: Excitations | None = None,
    periods: int = PERIODS,
    parts: tuple[float, ...] = SPEEDS,
) -> Subject:
    shared_excitations = excitations or Excitations()
    reference = lumped_system(
        gear_set, torque, LumpedModel(number=1), excitations=shared_excitations
    )
    return Subject(gear_set, torque, reference, shared_excitations, periods, parts)


def leading_frequency(system: LumpedSystem) -> float:
    """The lowest natural frequency that strains the meshes most [Hz]."""
    energy = system.modes.mesh_energy.sum(axis=0)
    return float(system.modes.frequency_Hz[np.flatnonzero(energy > 0.5)[0]])


def run(
    stepper: ImplicitStepper, frequency: float, steps: int, periods: int = PERIODS
) -> tuple[Array, float]:
    """(deflection (t, m) from rest on, microseconds per step of the fastest period)."""
    state, parts = stepper.start(), []
    size = 1.0 / (frequency * steps)
    length = stepper.model.reference.train.common_period[0]
    stepper.integrate(
        state, TimeSteps(frequency, size, 2, steps)
    )  # compiles and factorises
    best = math.inf
    for _ in range(math.ceil(periods / length)):
        start = time.perf_counter()
        state, motion = stepper.integrate(
            state, TimeSteps(frequency, size, steps * length, steps)
        )
        best = min(best, time.perf_counter() - start)
        parts.append(motion.deflection[:-1])
    return np.concatenate(parts), 1e6 * best / (steps * length)


def waveform_error(waveform: Array, reference: Array) -> Array:
    """Waveform error of each mesh (m,), at the times that both (t, m) have."""
    rows = math.gcd(len(waveform), len(reference))
    one, two = (w[:: len(w) // rows] for w in (waveform, reference))
    return np.sqrt(((one - two) ** 2).mean(axis=0)) / two.std(axis=0)
