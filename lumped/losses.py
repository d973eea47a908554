"""Power that sliding friction of teeth takes away along a motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lumped.friction import base_pitch
from lumped.response import History
from lumped.system import LumpedSystem

Array = NDArray[np.float64]


def friction_power(system: LumpedSystem, history: History) -> Array:
    """That friction takes from each mesh (t, m) [W], 0 without friction.

    Of the friction forces times the sliding speeds, vibration included.
    """
    if history.friction is None:
        return np.zeros_like(history.deflection)
    first = system.arrays.first_pair
    return np.add.reduceat(history.friction[:, 2], first[:-1], axis=1)


def driven_power(system: LumpedSystem, mesh: int, frequency: float) -> float:
    """That the mesh carries without friction [W], by its mean force."""
    along = frequency * float(system.train.mesh_rates[mesh])
    force = system.arrays.mean_stiffness[mesh] * system.static_deflection[mesh]
    return float(abs(force) * along * base_pitch(system.train, mesh))
