"""Power dissipated by sliding friction of teeth, along a motion and in statics."""

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
POSITIONS = 1024  # positions in a base pitch, for means over it


def friction_power(system: LumpedSystem, history: History) -> Array:
    """Power (t, m) that friction dissipates in each mesh [W], 0 without friction.

    It is the product of friction force and sliding speed, including vibration.
    """
    if history.friction is None:
        return np.zeros_like(history.deflection)
    first = system.arrays.first_pair
    return np.add.reduceat(history.friction[:, 2], first[:-1], axis=1)


def driven_power(system: LumpedSystem, mesh: int, frequency: float) -> float:
    """Power that the mesh transmits without friction [W], from its mean force."""
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

    The gears rotate uniformly and their pairs share the load as at rest. The load is
    such that the mean of both torques, each divided by its gear's base radius, is
    constant. The choice of this mean hardly matters, since friction changes both
    torques almost equally.

    teeth : pairs with their deflection by friction
    force : mesh force at rest [N]
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
    for _ in teeth.pairs:  # pairs that are apart are removed each time
        held = np.where(touching, stiffness, 0.0)
        deflection = (force + (held * gap).sum(axis=0)) / held.sum(axis=0)
        touching = touching & (deflection > gap)
    return np.where(touching, stiffness * (deflection - gap), 0.0)
