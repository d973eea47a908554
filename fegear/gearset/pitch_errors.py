"""Pitch errors of the gears as the meshes meet them.

An error is material missing on the flank that carries load in the first mesh of its
gear: the tooth is set back and opens a gap. It is displaced as a whole, so that
its other flank is as much too far ahead: an idler's teeth, driven on one flank and
driving with the other, have an error of the other sign in the mesh they drive.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.phases import first_teeth, rolling_senses
from lumped.common.array_types import Array
from lumped.train.pitch_errors import pair_errors

Errors = tuple[float, ...]

OPEN_GAP = 1e-2  # [m] beyond any deflection
MISSING_GAP = 1.0  # [m] beyond any flight of gears of which teeth are missing


def mesh_errors(gear_set: GearSet, number: int) -> tuple[Errors, Errors]:
    """Errors of driver and driven gear [m], empty for a gear without any.

    Of the flanks that carry load in the mesh, the tooth of the reference pair first,
    then those that come into contact after it.
    """
    gears = gear_set.meshes[number].gears
    driver, driven = (_errors_in_mesh(gear_set, number, gear) for gear in gears)
    return driver, driven


def _errors_in_mesh(gear_set: GearSet, number: int, gear: int) -> Errors:
    errors = gear_set.gears[gear].pitch_errors
    if not any(errors):
        return ()
    sign = 1.0 if is_first_flank(gear_set, number, gear) else -1.0
    teeth = tooth_in_cycles(gear_set, number, gear, np.arange(len(errors)))
    return tuple(sign * errors[tooth] for tooth in teeth)


def is_first_flank(gear_set: GearSet, mesh: int, gear: int) -> bool:
    """Whether a gear's flank in a mesh is the one of its first mesh."""
    first_mesh = gear_set.meshes[gear_set.meshes_of[gear][0]]
    return (gear_set.meshes[mesh].driver == gear) == (first_mesh.driver == gear)


def tooth_in_cycles(
    gear_set: GearSet, number: int, gear: int, cycles: NDArray[np.int64]
) -> NDArray[np.int64]:
    """A gear's tooth, from 0, in a mesh's reference pair in the cycles of that mesh.

    Teeth count as in the list of errors: the tooth in the reference pair of the gear's
    first mesh at the start, then those that follow it into contact.
    """
    begin = rolling_senses(gear_set)[gear] * first_teeth(gear_set)[number, gear]
    return np.asarray((begin + cycles) % gear_set.gears[gear].geometry.teeth)


def tooth_pair_errors(gear_set: GearSet, number: int) -> Array:
    """Gaps of a mesh's tooth pairs (n,) [m] until they repeat; empty without errors."""
    return pair_errors(*mesh_errors(gear_set, number))


def missing_pair_gaps(gear_set: GearSet, number: int) -> Array:
    """Gaps of a mesh's tooth pairs (n,) [m] until they repeat, by missing teeth alone.

    Wide open where a tooth of the pair is missing, else 0.
    """
    gaps: list[Errors] = []
    for gear in gear_set.meshes[number].gears:
        missing = gear_set.gears[gear].faults.missing
        cycles = np.arange(gear_set.gears[gear].geometry.teeth)
        teeth = tooth_in_cycles(gear_set, number, gear, cycles)
        gaps.append(tuple(MISSING_GAP if tooth in missing else 0.0 for tooth in teeth))
    return pair_errors(*gaps)


def require_room(gear_set: GearSet) -> None:
    """Raise InputError where one tooth's error jams the neighbouring pairs.

    A tooth ahead of its place lifts the flanks of its neighbours apart, until their
    back flanks touch.
    """
    for number, mesh in enumerate(gear_set.meshes):
        errors = tooth_pair_errors(gear_set, number)
        step = float(np.abs(errors - np.roll(errors, 1)).max(initial=0.0))
        if step > mesh.backlash:
            names = [gear_set.gears[gear].name for gear in mesh.gears]
            raise InputError(
                f'mesh "{names[0]}"-"{names[1]}": pitch_errors_um of tooth pairs in a '
                f"row differ by {1e6 * step:.5g} um; backlash {1e6 * mesh.backlash:.5g}"
                " um, teeth would jam, it must not be less; set backlash_um or "
                "tooth_thinning_um"
            )


@lru_cache(maxsize=16)
def pair_periods(gear_set: GearSet) -> tuple[int, ...]:
    """Base pitches of each mesh after which its tooth pairs repeat."""
    return tuple(
        math.lcm(
            max(1, tooth_pair_errors(gear_set, number).size),
            *(_turn_of_faults(gear_set, number, gear) for gear in mesh.gears),
        )
        for number, mesh in enumerate(gear_set.meshes)
    )


def _turn_of_faults(gear_set: GearSet, number: int, gear: int) -> int:
    """Base pitches after which faults of a gear repeat on its flanks in a mesh."""
    body = gear_set.gears[gear]
    faults = body.faults.on_flank(is_first_flank(gear_set, number, gear))
    return body.geometry.teeth if faults.teeth or faults.eccentricity else 1


def without_pitch_errors(gear_set: GearSet) -> GearSet:
    """The gear set with teeth that are all equal."""
    gears = (replace(gear, pitch_errors=()) for gear in gear_set.gears)
    return replace(gear_set, gears=tuple(gears))
