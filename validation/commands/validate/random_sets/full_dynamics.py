"""All elastic freedoms of the gears against their modes, on the smallest random sets.

Both start at rest and pass the same mesh periods with equal steps, so that differences
are those of one motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fegear.dynamics.build import FiniteElements
from fegear.dynamics.stepper import DynamicSettings, ReducedStepper
from fegear.gearset.model import GearSet
from lumped.common.progress import Progress, silent
from validation.commands.validate.random_sets.generator import COUNT, random_gear_set
from validation.commands.validate.random_sets.measuring import (
    MORE,
    highest_resonance,
    speeds_of,
)
from validation.commands.validate.random_sets.reduced_gears import (
    elastic_gears,
    reduced_gears,
)
from validation.study.from_rest import COMMON_STEPS, run, subject, waveform_error

SETS, SPEEDS = 5, 3


@dataclass(frozen=True)
class FullPoint:
    """A set at a speed [Hz], the worst mesh; differences are relative.

    freedoms, modes : elastic ones of all gears
    waveform : RMS of the difference of the deflection over that of its vibration
    rms : difference of the RMS of the vibration
    """

    name: str
    speed_Hz: float
    freedoms: int
    modes: int
    waveform: float
    rms: float


def smallest_sets(count: int = SETS) -> list[int]:
    """Numbers of the sets with the fewest teeth."""
    teeth = [
        sum(gear.geometry.teeth for gear in random_gear_set(number).gears)
        for number in range(COUNT)
    ]
    return sorted(range(COUNT), key=teeth.__getitem__)[:count]


def measure_full(
    gear_set: GearSet,
    report: Progress = silent,
    speeds: Sequence[float] = (),
    count: int = SPEEDS,
) -> list[FullPoint]:
    """At speeds [Hz], by default `count` around the highest mesh resonance."""
    case = subject(gear_set, gear_set.meshes[0].torques[0])
    speeds = speeds or speeds_of(highest_resonance(case.reference), count)
    statics = case.excitations.settings.statics
    elastic = elastic_gears(gear_set, speeds, statics, MORE)
    inputs = gear_set, case.torque, case.reference, case.excitations
    scheme = DynamicSettings().scheme
    reduced = ReducedStepper(reduced_gears(*inputs, elastic), scheme)
    full, n_dofs, _ = case.stepper(FiniteElements(fidelity="full"))
    points = []
    for done, speed in enumerate(speeds):
        report(f"all freedoms, {speed:g} Hz", done, len(speeds))
        (first_rms, _), (two, _) = (
            run(stepper, speed, COMMON_STEPS) for stepper in (full, reduced)
        )
        rms = np.abs(two.std(axis=0) / first_rms.std(axis=0) - 1.0)
        modes = sum(gear.count for gear in elastic)
        worst = float(waveform_error(two, first_rms).max())
        points.append(
            FullPoint(gear_set.name, speed, n_dofs, modes, worst, float(rms.max()))
        )
    return points
