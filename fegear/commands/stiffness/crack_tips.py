"""Stress intensities at the cracks of two gears in mesh, over all mesh positions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.contact.path import path_positions, sliding_sign
from fegear.contact.problem import ContactProblem
from fegear.contact.result import ContactCycle
from fegear.contact.tooth_faults import ToothFaults
from fegear.elasticity.cache import cached_crack_influence
from fegear.elasticity.crack_influence import CrackInfluence
from fegear.elasticity.root_stress import FlankLoad
from fegear.elasticity.sector import RIGHT
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import tooth_in_cycles
from fegear.statics.mesh_result import StaticsResult
from fegear.statics.settings import StaticsSettings
from lumped.common.array_types import Array


@dataclass(frozen=True)
class CrackIntensities:
    """Tip of a crack over torques (t,) and positions (n,) of a mesh.

    Attributes
    ----------
    gear : str
        Name of the gear.
    tooth : int
        Number of the cracked tooth, from 1 as in the gear-set file.
    stress_intensity : (t, n, 2) array
        K_I and K_II [Pa m^0.5].
    energy_release_rate, error : (t, n) array
        Energy per area of crack [J/m2], and its estimated discretisation error.
    """

    gear: str
    tooth: int
    stress_intensity: Array
    energy_release_rate: Array
    error: Array


def crack_tips(
    gear_set: GearSet, solved: StaticsResult, settings: StaticsSettings
) -> tuple[CrackIntensities, ...]:
    """Tips of all cracks that open in a mesh.

    Parameters
    ----------
    gear_set : GearSet
        Gear set of which the mesh was solved.
    solved : StaticsResult
        Contact of the mesh.
    settings : StaticsSettings
        How it was solved.

    Returns
    -------
    tuple of CrackIntensities
        Cracks of the driver, then of the driven gear, by their teeth.
    """
    problem, cycle = solved.problem, solved.cycle
    tips = []
    for side, gear in enumerate(gear_set.meshes[solved.mesh - 1].gears):
        faults = problem.flanks[side].faults
        if faults is None or not faults.cracked:
            continue
        body = gear_set.gears[gear]
        cracks = faults.clockwise_cracks
        for number in faults.cracked:
            influence = cached_crack_influence(
                body.geometry,
                settings.material(body),
                settings.size,
                cracks,
                faults.clockwise_tooth(number),
            )
            intensity, rate, error = _over_positions(
                problem, cycle, side, (faults, number, influence)
            )
            tooth = tooth_in_cycles(gear_set, solved.mesh - 1, gear, np.array([number]))
            tips.append(
                CrackIntensities(body.name, int(tooth[0]) + 1, intensity, rate, error)
            )
    return tuple(tips)


def _over_positions(
    problem: ContactProblem,
    cycle: ContactCycle,
    side: int,
    crack: tuple[ToothFaults, int, CrackInfluence],
) -> tuple[Array, Array, Array]:
    """Intensities (t, n, 2), energy release rate and its error (t, n) of one crack."""
    influence = crack[2]
    shape = cycle.ste.shape
    intensity = np.zeros((*shape, 2))
    rate, error = np.zeros(shape), np.zeros(shape)
    for rows, loads in _loads_by_pitch(problem, cycle, side, crack):
        intensity[:, rows] = influence.stress_intensity(loads)[..., 0, :]
        rate[:, rows] = influence.energy_release_rate(loads)[..., 0]
        error[:, rows] = influence.energy_release_rate_error(loads)[..., 0]
    return intensity, rate, error


def _loads_by_pitch(
    problem: ContactProblem,
    cycle: ContactCycle,
    side: int,
    crack: tuple[ToothFaults, int, CrackInfluence],
) -> Iterator[tuple[NDArray[np.int64], list[FlankLoad]]]:
    """Positions of each base pitch, and loads of its pairs by teeth from the crack."""
    faults, number, _ = crack
    normal = cycle.load / problem.face_width
    rootward = problem.friction * sliding_sign(path_positions(cycle)) * normal
    # pairs count anew in each base pitch
    pitch = np.floor(cycle.position).astype(np.int64)
    for here in np.unique(pitch):
        rows = np.flatnonzero(pitch == here)
        apart = faults.clockwise * (here - cycle.teeth - number)
        yield (
            rows,
            [
                FlankLoad(
                    int(tooth),
                    RIGHT,
                    cycle.arc[:, rows, k, side],
                    normal[:, rows, k],
                    rootward[:, rows, k],
                )
                for k, tooth in enumerate(apart)
            ],
        )
