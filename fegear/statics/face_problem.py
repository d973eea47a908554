"""The contact problem of a mesh whose loads vary over the face width."""

from __future__ import annotations

import math

from fegear.contact.face import FaceContact, slice_places
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.elasticity.cache import cached_flank_compliance, cached_wide_flank
from fegear.elasticity.material import PlaneMaterial, pressure_in_plane
from fegear.files.errors import InputError
from fegear.gearset.leads import width_gap
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import mesh_errors
from fegear.gearset.schema import mesh_label
from fegear.statics.settings import RESOLUTIONS, Resolution, StaticsSettings
from lumped.common.progress import Progress

MAX_SLICES = 1000  # of a mesh, some seconds and 0.3 GB at a position
CORNER_PARTS = 0.3  # parts of tip corners in contact, over the number of slices
PART_MATRICES = 18  # between parts in contact, held at once; measured
BYTES_PER_NUMBER = 8


def face_problem(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    resolution: Resolution,
    report: Progress,
) -> ContactProblem:
    """The contact problem, with the compliance of both gears over their widths.

    Raises InputError for what `require_solvable` refuses.
    """
    _require_known(gear_set, mesh, settings)
    _require_few_slices(gear_set, mesh, resolution)
    spec, size = gear_set.meshes[mesh], resolution.size
    slices = slices_over_width(gear_set, mesh, resolution)
    materials, flanks, wide = [], [], []
    width, middles = gear_set.common_width(mesh), gear_set.width_middles(mesh)
    gap = width_gap(gear_set, mesh, slice_places(width, slices))
    for i, index in enumerate(spec.gears):
        gear, modifications = gear_set.gears[index], spec.flanks[i]
        report(f"compliance of {gear.name}", i, 2)
        constants = gear.young_modulus, gear.poisson_ratio
        material = PlaneMaterial(*constants, "width", gear.face_width)
        materials.append(material)
        wide.append(cached_wide_flank(gear.geometry, material, size))
        section = cached_flank_compliance(gear.geometry, material.section, size)
        flanks.append(
            ContactFlank(
                compliance=section,
                tip_relief=modifications.tip_relief,
                root_relief=modifications.root_relief,
                profile=modifications.profile,
                lead=modifications.lead,
                pitch_errors=mesh_errors(gear_set, mesh)[i],
            )
        )
    report("compliance", 2, 2)
    face = FaceContact(
        driver=wide[0], driven=wide[1], width=width, gap=gap, offsets=middles
    )
    if gear_set.senses[spec.driver] < 0:  # the solver's driver turns counter-clockwise
        face = face.mirrored
    return ContactProblem(
        pair=spec.pair,
        driver=flanks[0],
        driven=flanks[1],
        face_width=width,
        friction=settings.friction,
        corner_contact=settings.corner_contact,
        nodes=resolution.nodes,
        face=face,
        plane_stress_pressure=pressure_in_plane(materials[0], materials[1], "stress"),
        plane_strain_pressure=pressure_in_plane(materials[0], materials[1], "strain"),
    )


def slices_over_width(gear_set: GearSet, mesh: int, resolution: Resolution) -> int:
    """Number of slices; with much overlap as many as a base pitch of it needs."""
    for_overlap = resolution.slices_per_pitch * gear_set.overlap_ratio(mesh)
    return max(resolution.slices, math.ceil(for_overlap))


def require_solvable(gear_set: GearSet, mesh: int, settings: StaticsSettings) -> None:
    """Refuse what is not known of a mesh, and more slices than a machine can hold.

    It takes no time: call it before anything is computed.
    """
    if gear_set.meshes[mesh].varies_over_width:
        _require_known(gear_set, mesh, settings)
        _require_few_slices(gear_set, mesh, RESOLUTIONS[settings.resolution])


def _require_few_slices(gear_set: GearSet, mesh: int, resolution: Resolution) -> None:
    slices = slices_over_width(gear_set, mesh, resolution)
    if slices > MAX_SLICES:
        spec = gear_set.meshes[mesh]
        names = (gear_set.gears[gear].name for gear in spec.gears)
        parts = slices * (spec.pair.contact_ratio + CORNER_PARTS)
        needed_GB = PART_MATRICES * BYTES_PER_NUMBER * parts**2 / 1e9
        raise InputError(
            f"{mesh_label(*names)}: {slices} slices of the face width, of an overlap "
            f"ratio of {gear_set.overlap_ratio(mesh):.6g}; must be at most "
            f"{MAX_SLICES}: a position takes {needed_GB:.3g} GB of memory; a narrower "
            "face width or a coarser resolution needs fewer"
        )


def _require_known(gear_set: GearSet, mesh: int, settings: StaticsSettings) -> None:
    spec = gear_set.meshes[mesh]
    gears = [gear_set.gears[index] for index in spec.gears]
    where = mesh_label(*(gear.name for gear in gears))
    has = "helical gears" if spec.is_helical else "loads that vary over the face width"
    if settings.plane_of(gear_set) != "width":
        raise InputError(
            f"{where}: plane = {settings.plane_of(gear_set)}; must be width, it has "
            f"{has}"
        )
    if settings.body != "held":
        raise InputError(f"{where}: body = {settings.body}; must be held, it has {has}")
    if any(gear.faults.any for gear in gears):
        raise InputError(f"{where}: faults are not known of {has}")
    if any(gear.geometry.sign < 0 for gear in gears):
        raise InputError(f"{where}: internal gears are not known with {has}")
