"""Elastic gears: their modes and their damping."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.elasticity.gear_modes import GearModes

REAL = ("rigidity", "elastic_damping", "coupling", "cosine", "sine")


@dataclass(frozen=True)
class Rayleigh:
    """Damping matrix of a gear's elastic freedoms: mass M + stiffness K."""

    mass: float
    stiffness: float


def mass_damping(ratio: float, frequency: float) -> Rayleigh:
    """Mass-proportional damping with a ratio at a frequency [Hz], and less above it.

    Without a part of the stiffness: that would damp what modes above a cut-off add to
    the static compliance as much as those below.
    """
    return Rayleigh(mass=4.0 * math.pi * ratio * frequency, stiffness=0.0)


@dataclass(frozen=True, eq=False)
class ElasticGear:
    """Elastic modes of a gear, seen from its flanks.

    modes : of the meshed part; width : its face width [m]
    """

    modes: GearModes
    width: float
    damping: Rayleigh

    @property
    def count(self) -> int:
        return self.modes.frequencies_Hz.size


def elastic_body(number: int, gear: ElasticGear | None) -> dict[str, NDArray[Any]]:
    """Arrays over the elastic modes of one gear as in `ModalMatrices`.

    Partners count within the gear.
    """
    if gear is None:
        none: dict[str, NDArray[Any]] = dict.fromkeys(REAL, np.empty(0))
        return none | dict.fromkeys(("gear_of_mode", "partner"), np.empty(0, np.int64))
    modes = gear.modes
    angular = 2.0 * np.pi * modes.frequencies_Hz
    phase_per_tooth = 2.0 * np.pi * modes.nodal_diameters / modes.teeth
    single = (modes.nodal_diameters == 0) | (2 * modes.nodal_diameters == modes.teeth)
    # pairs follow each other, the symmetric mode first
    symmetric = single | (np.cumsum(~single) % 2 == 1)
    step = np.where(single, 0, np.where(symmetric, 1, -1))
    return {
        "rigidity": angular**2,
        "elastic_damping": gear.damping.mass + gear.damping.stiffness * angular**2,
        # modes count clockwise
        "coupling": -math.sqrt(gear.width) * modes.rotation_coupling,
        "gear_of_mode": np.full(angular.size, number),
        "partner": np.arange(angular.size) + step,
        "cosine": np.cos(phase_per_tooth),
        "sine": np.where(single, 0.0, step * np.sin(phase_per_tooth)),
    }
