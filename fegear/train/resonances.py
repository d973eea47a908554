"""Natural frequencies of a train, and the speeds around them."""

from __future__ import annotations

import math
from decimal import Decimal

from fegear.files.errors import InputError
from lumped.train.system import LumpedSystem

DEFAULT_SPEEDS = 400  # at most, where none are given
DEFAULT_BAND = 0.5, 1.3  # of resonances


def default_speeds(system: LumpedSystem) -> list[float]:
    """From 0.5 to 1.3 times the resonances that meshes excite, in round steps.

    Those are natural frequencies of modes with a twentieth or more of their strain
    energy in the meshes, for every mesh as frequencies of the first [Hz].
    """
    band = system.speed_band(*DEFAULT_BAND)
    if band is None:
        raise InputError("speeds are missing; no mode strains the meshes enough")
    low, high = band
    step = _round_up((high - low) / DEFAULT_SPEEDS)
    first, last = max(1, math.floor(low / step)), math.ceil(high / step)
    return [float(Decimal(repr(step)) * i) for i in range(first, last + 1)]


def _round_up(value: float) -> float:
    """The next number of 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    factor = next(f for f in (1.0, 2.0, 5.0, 10.0) if f * power >= value * (1 - 1e-9))
    return float(f"{factor * power:.1g}")


def natural_frequencies(system: LumpedSystem) -> list[float]:
    """Natural frequencies of the modes that strain a mesh [Hz]."""
    return [float(f) for f in system.resonances_Hz]
