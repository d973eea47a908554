"""What the statics of one mesh read of a gear set."""

from __future__ import annotations

from dataclasses import replace

from fegear.gearset.faults.tooth_faults import NO_FAULTS
from fegear.gearset.model import Gear, GearSet, Mesh
from fegear.gearset.modifications import UNMODIFIED


def statics_inputs(gear_set: GearSet, mesh: int) -> GearSet:
    """The gear set without what the statics of a mesh do not read.

    Bodies are held, so that inertias and bearings change nothing; nor do torques and
    backlashes, or modifications of other meshes, and where teeth are alike it does not
    count which of them meet. What is solved for this gear set is solved for all that
    differ in nothing else.
    """
    gears_in_mesh = gear_set.meshes[mesh].gears
    teeth_differ = any(
        gear_set.gears[index].faults.any or any(gear_set.gears[index].pitch_errors)
        for index in gears_in_mesh
    )
    return replace(
        gear_set,
        description="",
        gears=tuple(
            _held(gear, is_in_mesh=index in gears_in_mesh)
            for index, gear in enumerate(gear_set.gears)
        ),
        meshes=tuple(
            _unloaded(other, is_solved=index == mesh, is_placed=teeth_differ)
            for index, other in enumerate(gear_set.meshes)
        ),
        shafts=tuple(
            replace(shaft, stiffness=None, body=None) for shaft in gear_set.shafts
        ),
        damping_ratio=None,
        inferences=(),
        carrier=None,
    )


def _held(gear: Gear, is_in_mesh: bool) -> Gear:
    held = replace(
        gear,
        thickness_origin="",
        inertia=None,
        mass=None,
        bearing_stiffness=None,
        rolling_bearing=None,
        coupling_stiffness=0.0,
    )
    return held if is_in_mesh else replace(held, faults=NO_FAULTS, pitch_errors=())


def _unloaded(mesh: Mesh, is_solved: bool, is_placed: bool) -> Mesh:
    unloaded = replace(
        mesh,
        backlash=0.0,
        torques=(),
        mean_stiffness=None,
        stiffness_variation=None,
        load_share=None,
    )
    if not is_placed:
        unloaded = replace(unloaded, phase=None, center_line=None)
    if is_solved:
        return unloaded
    offset = unloaded.offset if is_placed else 0.0
    return replace(
        unloaded,
        driver_flank=UNMODIFIED,
        driven_flank=UNMODIFIED,
        misalignment=0.0,
        offset=offset,
    )
