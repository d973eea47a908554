"""Elastic modes and damping of the gears of a finite-element model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from fegear.dynamics.elastic import ElasticGear, Rayleigh, mass_damping
from fegear.elasticity.gear_modes import GearModes, gear_modes
from fegear.gearset.model import Gear, GearSet
from fegear.statics.settings import StaticsSettings

CUTOFF_FACTOR = 7.0  # of the highest mesh frequency, whose modes are looked at
# times the rate of shear waves along the tip circle: lower modes are looked at
SHEAR_WAVE_FACTOR = 3.0
cached_gear_modes = lru_cache(maxsize=16)(gear_modes)  # equal gears, and all torques


def elastic_modes_of_gears(
    gear_set: GearSet,
    highest: float,
    settings: StaticsSettings,
    cutoff_Hz: float | None = None,
) -> list[GearModes]:
    """Elastic modes of every gear that may matter.

    highest : mesh frequency of the first mesh [Hz]
    """
    return [
        cached_gear_modes(
            settings.sector(gear),
            gear.density,
            cutoff_Hz or default_cutoff(gear, highest),
        )
        for gear in gear_set.gears
    ]


def default_cutoff(gear: Gear, highest: float) -> float:
    """Modes below it [Hz] may matter at mesh frequencies up to `highest`."""
    return max(CUTOFF_FACTOR * highest, SHEAR_WAVE_FACTOR * round_trips(gear))


def round_trips(gear: Gear) -> float:
    """Round trips per second of a shear wave around the tip circle."""
    shear = gear.young_modulus / (2.0 * (1.0 + gear.poisson_ratio))
    circumference = 2.0 * math.pi * abs(gear.geometry.tip_radius)
    return math.sqrt(shear / gear.density) / circumference


def elastic_damping(gear: Gear, ratio: float) -> Rayleigh:
    """Rayleigh damping of a gear's elastic degrees of freedom, with the ratio at its
    first modes.
    """
    return mass_damping(ratio, round_trips(gear))


def truncate_modes(modes: GearModes, cutoff_Hz: float) -> GearModes:
    """The modes below a lower cut-off."""
    retained = modes.frequencies_Hz < cutoff_Hz
    return replace(
        modes,
        cutoff_Hz=min(cutoff_Hz, modes.cutoff_Hz),
        frequencies_Hz=modes.frequencies_Hz[retained],
        nodal_diameters=modes.nodal_diameters[retained],
        normal=modes.normal[retained],
        tangential=modes.tangential[retained],
        rotation_coupling=modes.rotation_coupling[retained],
        translation_coupling=modes.translation_coupling[retained],
    )


def elastic_gears(
    gear_set: GearSet, modes: Sequence[GearModes], damping: float
) -> list[ElasticGear]:
    return [
        ElasticGear(mode_set, gear.toothed_width, elastic_damping(gear, damping))
        for gear, mode_set in zip(gear_set.gears, modes, strict=True)
    ]
