"""Power dissipated by sliding friction of teeth, along a motion and in statics."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from lumped.common.array_types import Array
from lumped.kernels.arrays import FrictionSamples
from lumped.steady.response import History
from lumped.train.excitation import MeshExcitation
from lumped.train.friction import ToothFriction, base_pitch, torque_shares
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

POSITIONS = 1024  # positions in a base pitch, for means over it


def friction_power(system: LumpedSystem, history: History) -> Array:
    """Power (t, m) that friction dissipates in each mesh [W], 0 without friction.

    It is the product of friction force and sliding speed, including vibration.
    """
    if history.friction is None:
        return np.zeros_like(history.deflection)
    first = system.arrays.first_pair
    return np.add.reduceat(history.friction[:, 2], first[:-1], axis=1)


def transmitted_power(
    system: LumpedSystem, history: History, frequency: float, samples: FrictionSamples
) -> Array:
    """Power (2, t, m) that each mesh takes from its driver and gives to its driven
    gear, at their nominal speeds and with friction [W].

    With the normal force N of a pair and its friction f, which acts at the arms
    r1 tan(alpha) + x and r2 tan(alpha) - x about the centres, x ahead of the pitch
    point (-x on the back side), the torques over the base radii are
    N + f (tan(alpha) + x / r1) and N + f (tan(alpha) - x / r2). Their difference is
    the friction times the nominal sliding speed, over the speed along the line of
    action.

    samples : of the grid of the history, whose common periods repeat them
    """
    train, first = system.train, system.arrays.first_pair
    if history.friction is None:
        normal = friction = np.zeros((history.time.size, first[-1]))
    else:
        normal, sliding, power = history.friction.swapaxes(0, 1)
        moving = sliding != 0.0
        friction = np.divide(power, sliding, out=np.zeros_like(power), where=moving)
    arm = samples.arm[np.arange(history.time.size) % samples.h.size, 0]
    arm = np.where(normal < 0.0, -arm, arm)
    powers = np.zeros((2, history.time.size, len(train.meshes)))
    for m, mesh in enumerate(train.meshes):
        pairs = slice(first[m], first[m + 1])
        speed = frequency * float(train.mesh_rates[m]) * base_pitch(train, m)
        slope = math.tan(mesh.pressure_angle)
        for out, gear, side in ((0, mesh.driver, 1.0), (1, mesh.driven, -1.0)):
            lever = slope + side * arm[:, pairs] / train.gears[gear].base_radius
            load = normal[:, pairs] + friction[:, pairs] * lever
            powers[out, :, m] = speed * load.sum(axis=1)
    return powers


def efficiency(driver: float, driven: float, lost: float) -> float:
    """Output power over input power of a mesh, NaN where friction takes all of it.

    The input is the output and what friction takes, vibration included. Where the
    power flows back, the driver is the output.

    driver, driven : mean power taken from the driver and given to the driven gear,
        at nominal speeds [W]
    lost : mean power of friction [W]
    """
    output = driven if driven > 0.0 else -driver
    return output / (output + lost) if output > 0.0 else math.nan


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
        contact_stiffness = np.where(touching, stiffness, 0.0)
        deflection = (
            force + (contact_stiffness * gap).sum(axis=0)
        ) / contact_stiffness.sum(axis=0)
        touching = touching & (deflection > gap)
    return np.where(touching, stiffness * (deflection - gap), 0.0)
