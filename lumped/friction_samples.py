"""Friction of all tooth pairs on the time steps of a train."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lumped.friction import (
    FrictionRows,
    ToothFriction,
    base_pitch,
    side_of,
    sliding_rate,
)
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
    train, shape = excitation.train, samples.stiffness.shape
    slide, arm, bending = np.empty(shape), np.empty(shape), np.empty(shape)
    middle = 0.5 * (times[:-1] + times[1:])
    at = np.stack([times[:-1], middle, times[1:]], axis=1)
    column = 0
    for m, (mesh, rub) in enumerate(zip(excitation.meshes, friction, strict=True)):
        pitch, rate = base_pitch(train, m), float(train.mesh_rates[m])
        # a step stays within a cycle, and ends there too
        place = excitation.positions(m, middle)[:, None] + rate * (at - middle[:, None])
        for pair in mesh.pairs:
            ahead = pair.ahead or 0
            every = np.tile(place, (excitation.rounds, 1))
            slide[..., column] = rub.coefficient * side_of(ahead)
            arm[..., column] = (every + ahead) * pitch
            bending[..., column] = rub.coefficient * rub.bending
            column += 1
    meshes = range(len(friction))
    return FrictionSamples(
        *samples,
        *(slide, arm, bending),
        *rows,
        np.array([sliding_rate(train, m) for m in meshes]),
        np.array([each.sliding == "instantaneous" for each in friction]),
        np.array([each.transition for each in friction]),
    )


def at_frequency(samples: FrictionSamples, frequency: float) -> FrictionSamples:
    """Steps in seconds and sliding speeds at a frequency of the first mesh [Hz]."""
    h, rate = samples.h / frequency, samples.sliding_rate * frequency
    return samples._replace(h=h, sliding_rate=rate)
