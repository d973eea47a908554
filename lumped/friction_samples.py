"""Friction of all tooth pairs on the time steps of a train."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lumped.friction import FrictionRows, ToothFriction, base_pitch, side_of
from lumped.kernels.arrays import FrictionSamples, Samples
from lumped.train_excitation import TrainExcitation

Array = NDArray[np.float64]


def with_friction(
    samples: Samples,
    times: Array,
    excitation: TrainExcitation,
    friction: Sequence[ToothFriction],
    rows: FrictionRows,
) -> FrictionSamples:
    """Samples and what friction adds to them.

    times : of the grid that they stand on, in periods of the first mesh
    friction : of every mesh; rows : on the modes
    """
    slide, arm = sliding_at(0.5 * (times[:-1] + times[1:]), excitation, friction)
    at = np.stack([times[:-1], 0.5 * (times[:-1] + times[1:]), times[1:]], axis=1)
    slide = np.repeat(slide[:, None], 3, axis=1)
    train, mesh_of = excitation.train, excitation.mesh_of
    growth = [
        float(rate) * base_pitch(train, m) for m, rate in enumerate(train.mesh_rates)
    ]
    arm = arm[:, None] + (at - at[:, 1:2])[..., None] * np.array(growth)[mesh_of]
    rounds = (excitation.rounds, 1, 1)
    return FrictionSamples(
        *samples, np.tile(slide, rounds), np.tile(arm, rounds), *rows
    )


def sliding_at(
    times: Array, excitation: TrainExcitation, friction: Sequence[ToothFriction]
) -> tuple[Array, Array]:
    """Of all pairs (t, p) at times, in periods of the first mesh: coefficient of
    friction, negative in recess, and way ahead of the pitch point [m]."""
    slide, arm = [], []
    for m, mesh in enumerate(excitation.meshes):
        place = excitation.positions(m, times)
        pitch = base_pitch(excitation.train, m)
        for pair in mesh.pairs:
            ahead = pair.ahead or 0
            side = friction[m].coefficient * side_of(ahead)
            slide.append(np.full(times.shape, side))
            arm.append((place + ahead) * pitch)
    return np.stack(slide, axis=-1), np.stack(arm, axis=-1)
