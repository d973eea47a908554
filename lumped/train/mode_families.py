"""Families of modes of a planetary set, by which of its members move.

With equal planets, equally spaced on isotropic bearings, every mode is of one family
(Lin and Parker, 1999): central members, those that are no planets, only rotate, only
translate, or rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from lumped.train.modes import Modes
from lumped.train.train import Train

Family = Literal["rotational", "translational", "planet", "mixed"]
AT_REST = 1e-9  # part of a mode's kinetic energy below which a motion is none
SAME_RTOL = 1e-6  # difference of natural frequencies, relative, that is round-off


def mode_families(train: Train, modes: Modes) -> tuple[Family, ...]:
    """Family of each mode; all are planet modes where a train has no carrier.

    mixed : central members rotate and translate, as with planets that differ
    """
    planets = set(train.carrier.gears if train.carrier else range(len(train.gears)))
    energy = modes.coordinates.mass[:, None] * modes.shapes**2
    sums = {"rotation": np.zeros(len(energy)), "x": np.zeros(len(energy))}
    sums["y"] = sums["x"]
    central = {
        index: kind
        for (body, kind), index in modes.coordinates.indices.items()
        if body not in planets
    }
    for index, kind in central.items():
        sums[kind] += energy[index]
    rotates, translates = sums["rotation"] > AT_REST, sums["x"] > AT_REST
    return tuple(map(_family, rotates.tolist(), translates.tolist()))


def _family(rotates: bool, translates: bool) -> Family:
    if rotates and translates:
        return "mixed"
    if translates:
        return "translational"
    return "rotational" if rotates else "planet"


def multiplicities(frequencies: Sequence[float]) -> tuple[int, ...]:
    """Number of modes with the frequency of each, itself among them."""
    array = np.asarray(frequencies, float)
    near = SAME_RTOL * max(float(array.max(initial=0.0)), 1e-300)
    counts = (np.abs(array[:, None] - array) <= near).sum(axis=1)
    return tuple(int(count) for count in counts)
