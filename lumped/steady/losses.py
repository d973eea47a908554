"""Power that sliding friction of teeth takes away: along a motion, and in statics."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lumped.steady.response import History
from lumped.train.excitation import MeshExcitation
from lumped.train.friction import ToothFriction, base_pitch, torque_shares
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

Array = NDArray[np.float64]
POSITIONS = 1024  # of a base pitch, for means over it


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


def nominal_efficiency(
    train: Train,
    mesh: int,
    teeth: MeshExcitation,
    friction: ToothFriction,
    force: float,
) -> float:
    """Mean torque on the driven gear over that on the driver and the ratio of teeth.

    Of gears that turn evenly, whose pairs share the load as at rest. The load is such
    that the mean of both torques, each over its gear's base radius, is constant: which
    mean it is hardly counts, for friction changes both nearly alike.

    teeth : pairs as friction bends them; force : of the mesh at rest [N]
    """
    x = (np.arange(POSITIONS) + 0.5) / POSITIONS
    ahead = [pair.ahead or 0 for pair in teeth.pairs]
    gears: tuple[Literal["driver", "driven"], ...] = "driver", "driven"
    shares = [
        torque_shares(train, mesh, friction.coefficient, ahead, x, gear)
        for gear in gears
    ]
    means = []
    for pitch in range(teeth.period):
        loads = shared_loads(teeth, force, x, pitch)
        torques = np.array([(loads * share).sum(axis=0) for share in shares])
        means.append((torques / torques.sum(axis=0)).mean(axis=1))
    driver, driven = np.mean(means, axis=0)
    return float(driven / driver)


def shared_loads(teeth: MeshExcitation, force: float, x: Array, pitch: int) -> Array:
    """Loads of the pairs (p, n) at rest under a mesh force [N], at positions x (n,)."""
    stiffness = np.array([pair.stiffness(x, pitch=pitch) for pair in teeth.pairs])
    gap = np.array([pair.gap(x, pitch=pitch) for pair in teeth.pairs])
    touching = stiffness > 0.0
    for _ in teeth.pairs:  # each time those that stand apart come off
        held = np.where(touching, stiffness, 0.0)
        deflection = (force + (held * gap).sum(axis=0)) / held.sum(axis=0)
        touching = touching & (deflection > gap)
    return np.where(touching, stiffness * (deflection - gap), 0.0)
