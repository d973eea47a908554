"""Friction of all tooth pairs on the time steps of a train."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lumped.common.array_types import Array
from lumped.kernels.arrays import ExcitationSamples, FrictionSamples
from lumped.train.friction import (
    FrictionRows,
    ToothFriction,
    base_pitch,
    sliding_rate,
    sliding_sign,
)
from lumped.train.train_excitation import TrainExcitation
from lumped.train.waves import Wave, constant_wave, linear_wave


def with_friction(
    samples: ExcitationSamples,
    times: Array,
    excitation: TrainExcitation,
    friction: Sequence[ToothFriction],
    rows: FrictionRows,
) -> FrictionSamples:
    """Samples with the contributions of friction.

    times : times of the grid of the samples, in periods of the first mesh
    friction : friction of every mesh
    rows : friction rows on the modes
    """
    train = excitation.train
    sliding: list[Wave] = []
    arm: list[Wave] = []
    bending: list[Wave] = []
    for m, (mesh, rub) in enumerate(zip(excitation.meshes, friction, strict=True)):
        mu, pitch = rub.coefficient, base_pitch(train, m)
        for pair in mesh.pairs:
            ahead = pair.ahead or 0
            sliding.append(constant_wave(mu * sliding_sign(ahead)))
            arm.append(linear_wave(ahead * pitch, pitch))
            bending.append(rub.bending_of(ahead).scaled(mu))
    meshes = range(len(friction))
    return FrictionSamples(
        *samples,
        excitation.sample_steps(sliding, times),
        excitation.sample_steps(arm, times),
        excitation.sample_steps(bending, times),
        *rows,
        np.array([sliding_rate(train, m) for m in meshes]),
        np.array(
            [tooth_friction.sliding == "instantaneous" for tooth_friction in friction]
        ),
        np.array([tooth_friction.transition for tooth_friction in friction]),
    )


def scale_to_frequency(samples: FrictionSamples, frequency: float) -> FrictionSamples:
    """Steps in seconds and sliding speeds at a frequency of the first mesh [Hz]."""
    h, rate = samples.h / frequency, samples.sliding_rate * frequency
    return samples._replace(h=h, sliding_rate=rate)
