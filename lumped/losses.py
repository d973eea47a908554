"""Power that sliding friction of teeth takes away along a motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lumped.friction import base_pitch
from lumped.kernels.arrays import FrictionSamples
from lumped.response import History
from lumped.settings import Settings
from lumped.steppers import steps_per_period
from lumped.system import LumpedSystem

Array = NDArray[np.float64]


def friction_power(
    system: LumpedSystem, frequency: float, settings: Settings, history: History
) -> Array:
    """Of each mesh (t, m) [W], at a frequency of the first mesh [Hz].

    mu N times the nominal speed of sliding, which is the speed along the line of action
    over both base radii times the way from the pitch point. None without friction.
    """
    if not system.rubs:
        return np.zeros_like(history.deflection)
    samples = system.samples(steps_per_period(system, frequency, settings))
    assert isinstance(samples, FrictionSamples)
    rows = np.arange(history.time.size) % samples.h.size
    first = system.arrays.first_pair
    mesh_of = np.repeat(np.arange(first.size - 1), np.diff(first))
    elastic = history.deflection[:, mesh_of] - samples.gap[rows, 0]
    force = samples.stiffness[rows, 0] * np.maximum(elastic, 0.0)
    meshes = range(first.size - 1)
    rates = np.array([sliding_rate(system, m, frequency) for m in meshes])
    way = np.abs(samples.slide[rows, 0] * samples.arm[rows, 0])
    return np.add.reduceat(force * way * rates[mesh_of], first[:-1], axis=1)


def sliding_rate(system: LumpedSystem, mesh: int, frequency: float) -> float:
    """Sliding speed per way from the pitch point [1/s]: sum of both gears' speeds."""
    train = system.train
    along = frequency * float(train.mesh_rates[mesh]) * base_pitch(train, mesh)
    spec = train.meshes[mesh]
    radii = (train.gears[g].base_radius for g in (spec.driver, spec.driven))
    return along * sum(1.0 / radius for radius in radii)


def driven_power(system: LumpedSystem, mesh: int, frequency: float) -> float:
    """That the mesh carries without friction [W], by its mean force."""
    along = frequency * float(system.train.mesh_rates[mesh])
    force = system.arrays.mean_stiffness[mesh] * system.static_deflection[mesh]
    return float(abs(force) * along * base_pitch(system.train, mesh))
