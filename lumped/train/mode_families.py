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
from lumped.train.rotating_frame import RotatingFrameModes
from lumped.train.train import Train

Family = Literal["rotational", "translational", "planet", "mixed"]
Whirl = Literal["forward", "backward", "none"]
AT_REST = 1e-9  # part of a mode's kinetic energy below which a motion is none
# Difference of the kinetic energies of both senses of rotation, relative to their sum,
# that is no round-off
MIN_WHIRL = 1e-6
SAME_RTOL = 1e-6  # difference of natural frequencies, relative, that is round-off


def mode_families(train: Train, modes: Modes) -> tuple[Family, ...]:
    """Family of each mode; all are planet modes where a train has no carrier.

    mixed : central members rotate and translate, as with planets that differ
    """
    planets = _planets(train)
    energy = modes.coordinates.mass[:, None] * np.abs(modes.shapes) ** 2
    sums = {kind: np.zeros(energy.shape[1]) for kind in ("rotation", "x")}
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


def whirl_senses(train: Train, modes: RotatingFrameModes) -> tuple[Whirl, ...]:
    """Sense in which central members move on their orbits, as seen from the carrier.

    forward : the sense in which the carrier rotates; none : they do not translate, or
        to and fro on a line
    """
    space, shapes = modes.coordinates, modes.shapes
    centers = {
        index: space.indices[body, "y"]
        for (body, kind), index in space.indices.items()
        if kind == "x" and body not in _planets(train)
    }
    x, y = [*centers], [*centers.values()]
    # counter-clockwise, y is a quarter of a period behind x
    moment = -2.0 * space.mass[x] @ (shapes[x].conj() * shapes[y]).imag
    energy = space.mass[x] @ (np.abs(shapes[x]) ** 2 + np.abs(shapes[y]) ** 2)
    names: tuple[Whirl, ...] = ("backward", "none", "forward")
    is_orbit = (np.abs(moment) > MIN_WHIRL * energy) & (energy > AT_REST)
    senses = np.sign(modes.speed * moment) * is_orbit
    return tuple(names[1 + int(sense)] for sense in senses)


def _planets(train: Train) -> set[int]:
    return set(train.carrier.gears if train.carrier else range(len(train.gears)))


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
