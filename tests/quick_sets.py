"""A measure of random gear sets that takes no time, for processes that import it."""

from __future__ import annotations

import os

from fegear.gearset.model import GearSet
from lumped.common.progress import Progress
from validation.commands.validate.random_sets.measuring import (
    COUPLED_UP,
    REFERENCE,
    Measured,
)

SOURCES = REFERENCE, COUPLED_UP


def measure_quickly(
    gear_set: GearSet, number: int, report: Progress, count: int
) -> Measured:
    """Numbers of the gear set; the second one fails. The warning is the process."""
    if number == 1:
        raise ArithmeticError("no static equilibrium")
    teeth = [gear.geometry.teeth for gear in gear_set.gears]
    rms = [[1e-6 / 3.0 * teeth[0] + speed] for speed in range(16)]
    return Measured(
        number=number,
        name=gear_set.name,
        kind="pair",
        teeth=teeth,
        hub_over_root=[0.3] * len(teeth),
        torque_Nm=10.0,
        speeds_Hz=[100.0 * (i + 1) for i in range(16)],
        rms_m=dict.fromkeys(SOURCES, rms),
        multiples=dict.fromkeys(SOURCES, [[1]] * 16),
        ms_per_speed=dict.fromkeys(SOURCES, 1.0),
        body_modes=4,
        left_out=0.03,
        warnings=[str(os.getpid())],
        resonance_Hz=1000.0,
        natural=[],
        natural_fe=[],
    )
