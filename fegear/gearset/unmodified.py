"""Gear sets without the faults, errors and modifications of others."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from fegear.gearset.faults.checks import without_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS, FaultKind
from fegear.gearset.model import GearSet
from fegear.gearset.modifications import UNMODIFIED
from fegear.gearset.pitch_errors import without_pitch_errors


def has_faults(
    gear_set: GearSet, mesh: int, kinds: Collection[FaultKind] = FAULT_KINDS
) -> bool:
    """Whether a gear of a mesh has faults of some kinds."""
    gears = gear_set.meshes[mesh].gears
    return any(
        kind in kinds for gear in gears for kind in gear_set.gears[gear].faults.kinds
    )


def unmodified(gear_set: GearSet, mesh: int) -> GearSet:
    """The gear set without faults and pitch errors, and a mesh's teeth unrelieved."""
    equal = without_faults(without_pitch_errors(gear_set))
    return without_relief(equal, mesh)


def without_relief(gear_set: GearSet, mesh: int) -> GearSet:
    """The gear set with one mesh's teeth and axes left without gaps between flanks.

    Modifications are left out, of which wear of all teeth alike is one, and so is
    misalignment.
    """
    meshes, gears = list(gear_set.meshes), list(gear_set.gears)
    plain = UNMODIFIED
    meshes[mesh] = replace(
        meshes[mesh], driver_flank=plain, driven_flank=plain, misalignment=0.0
    )
    for index in meshes[mesh].gears:
        faults = gears[index].faults
        if any(wear.tooth is None for wear in faults.worn):
            single = tuple(wear for wear in faults.worn if wear.tooth is not None)
            faults = replace(faults, worn=single)
            gears[index] = replace(gears[index], faults=faults)
    return replace(gear_set, meshes=tuple(meshes), gears=tuple(gears))
