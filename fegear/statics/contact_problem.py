"""The contact problem of a mesh: both flanks with their compliance, and the solver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from fegear.contact.plane.contact import PlaneContact
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.tooth_faults import ChangedCompliance
from fegear.contact.width.contact import WidthContact, slice_places
from fegear.elasticity.cache import (
    cached_compliance_change,
    cached_flank_compliance,
    cached_wide_flank,
    cached_wide_root,
)
from fegear.elasticity.flank import FlankCompliance
from fegear.elasticity.material import PlaneMaterial, pressure_in_plane
from fegear.elasticity.sector import cyclic_sector
from fegear.elasticity.wide_flank import WideFlank
from fegear.files.errors import InputError
from fegear.gearset.inertia import inertia_of, require_inertia_of_bodies
from fegear.gearset.leads import misaligned_gap
from fegear.gearset.model import Gear, GearSet
from fegear.gearset.phases import rolling_senses
from fegear.gearset.pitch_errors import mesh_errors
from fegear.gearset.schema import mesh_label
from fegear.statics.axes import yielding_axes
from fegear.statics.mesh_faults import faulty_sides
from fegear.statics.settings import RESOLUTIONS, Resolution, StaticsSettings
from lumped.common.progress import Progress, silent
from meshes import MeshSize
from meshes.crack import Crack

MAX_SLICES = 1000  # of a mesh, some seconds and 0.3 GB at a position
CORNER_PARTS = 0.3  # parts of tip corners in contact, over the number of slices
PART_MATRICES = 18  # between parts in contact, held at once; measured
BYTES_PER_NUMBER = 8


def contact_problem(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    report: Progress = silent,
    resolution: Resolution | None = None,
) -> ContactProblem:
    """The mesh's contact problem with both flank compliances at hand.

    resolution : instead of that of the settings

    Raises InputError for what `require_solvable` refuses.
    """
    resolution = resolution or RESOLUTIONS[settings.resolution]
    require_solvable(gear_set, mesh, settings, resolution)
    spec, width = gear_set.meshes[mesh], gear_set.common_width(mesh)
    elasticity_of = _along_width if spec.varies_over_width else _in_plane
    materials, compliances, solver = elasticity_of(
        gear_set, mesh, settings, resolution, report
    )
    report("compliance", 2, 2)
    solve_compliance_change = partial(_compliance_change, settings, resolution.size)
    sides = faulty_sides(gear_set, mesh, solve_compliance_change)
    errors = mesh_errors(gear_set, mesh)
    driver, driven = (
        ContactFlank(
            compliance=compliances[i],
            tip_relief=spec.flanks[i].tip_relief,
            root_relief=spec.flanks[i].root_relief,
            profile=side.profile,
            lead=spec.flanks[i].lead,
            topography=spec.flanks[i].topography,
            pitch_errors=errors[i],
            faults=side.faults,
            offset=side.offset,
        )
        for i, side in enumerate(sides)
    )
    return ContactProblem(
        pair=spec.pair,
        driver=driver,
        driven=driven,
        face_width=width,
        friction=settings.friction,
        corner_contact=settings.corner_contact,
        solver=solver,
        plane_stress_pressure=pressure_in_plane(materials[0], materials[1], "stress"),
        plane_strain_pressure=pressure_in_plane(materials[0], materials[1], "strain"),
    )


class _Elasticity(NamedTuple):
    """Materials and compliances of driver and driven gear, and where loads vary."""

    materials: list[PlaneMaterial]
    compliances: list[FlankCompliance]
    solver: PlaneContact | WidthContact


def _in_plane(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    resolution: Resolution,
    report: Progress,
) -> _Elasticity:
    """Elasticity of sections whose loads are uniform over the width."""
    width, size = gear_set.common_width(mesh), resolution.size
    materials, compliances = [], []
    for i, index in enumerate(gear_set.meshes[mesh].gears):
        gear = gear_set.gears[index]
        report(f"compliance of {gear.name}", i, 2)
        material = settings.material(gear, width)
        compliance = cached_flank_compliance(gear.geometry, material, size)
        if settings.body == "free":
            from fegear.elasticity.inertia_relief import in_mean_axes, inertia_relief

            require_inertia_of_bodies(gear_set, "bodies that are held count no inertia")
            sector = cyclic_sector(gear.geometry, material, size)
            relief = inertia_relief(sector, gear.density)
            widths = width, gear.face_width
            compliance = in_mean_axes(compliance, relief, widths, inertia_of(gear))
        materials.append(material)
        compliances.append(compliance)
    return _Elasticity(materials, compliances, PlaneContact(nodes=resolution.nodes))


def _along_width(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    resolution: Resolution,
    report: Progress,
) -> _Elasticity:
    """Elasticity of teeth of their width, and of their sections."""
    spec, size = gear_set.meshes[mesh], resolution.size
    materials, compliances, wide = [], [], []
    for i, index in enumerate(spec.gears):
        gear = gear_set.gears[index]
        report(f"compliance of {gear.name}", i, 2)
        material = settings.material(gear)
        if settings.root_stress:  # one solution serves both
            cached_wide_root(gear.geometry, material, size)
        wide.append(cached_wide_flank(gear.geometry, material, size))
        section = cached_flank_compliance(gear.geometry, material.section, size)
        materials.append(material)
        compliances.append(section)
    if gear_set.common_groove(mesh):
        far = [flank.mirrored for flank in wide]
        solver = replace(
            _along_helix(gear_set, mesh, resolution, wide, side=-1),
            far=_along_helix(gear_set, mesh, resolution, far, side=1),
            groove=gear_set.common_groove(mesh),
        )
    else:
        solver = _along_helix(gear_set, mesh, resolution, wide)
    # the solver's driver turns counter-clockwise
    if rolling_senses(gear_set)[spec.driver] < 0:
        solver = solver.mirrored
    if spec.on_shafts:
        supports = yielding_axes(gear_set).supports(gear_set, mesh)
        solver = replace(solver, supports=supports)
    return _Elasticity(materials, compliances, solver)


def _along_helix(
    gear_set: GearSet,
    mesh: int,
    resolution: Resolution,
    wide: Sequence[WideFlank],
    side: int = 0,
) -> WidthContact:
    """Slices along one helix.

    wide : compliance of driver and driven gear along it
    side : -1 for the near half of double helical gears, 1 for the far one, else 0
    """
    spec, width = gear_set.meshes[mesh], gear_set.helix_width(mesh)
    gears = [gear_set.gears[index] for index in spec.gears]
    middle = 0.5 * side * (gear_set.common_groove(mesh) + width)
    places = slice_places(width, slices_over_width(gear_set, mesh, resolution))
    driver, driven = (
        of_common + middle - 0.5 * side * (gear.groove + gear.helix_width)
        for of_common, gear in zip(gear_set.width_middles(mesh), gears, strict=True)
    )
    return WidthContact(
        driver=wide[0],
        driven=wide[1],
        width=width,
        gap=misaligned_gap(gear_set, mesh, places + middle),
        back_gap=misaligned_gap(gear_set, mesh, places + middle, back=True),
        offsets=(driver, driven),
    )


def _compliance_change(
    settings: StaticsSettings, size: MeshSize, gear: Gear, cracks: dict[int, Crack]
) -> ChangedCompliance:
    """What cracks add to the compliance of a gear, by tooth, counted clockwise."""
    if settings.body == "free":
        raise InputError(
            f'gear "{gear.name}": cracks; not known of bodies that are free to '
            "accelerate, body = free"
        )
    material = settings.material(gear)
    return cached_compliance_change(gear.geometry, material, size, cracks)


def slices_over_width(gear_set: GearSet, mesh: int, resolution: Resolution) -> int:
    """Number of slices; with much overlap as many as a base pitch of it needs."""
    for_overlap = resolution.slices_per_pitch * gear_set.overlap_ratio(mesh)
    return max(resolution.slices, math.ceil(for_overlap))


def require_solvable(
    gear_set: GearSet,
    mesh: int,
    settings: StaticsSettings,
    resolution: Resolution | None = None,
) -> None:
    """Refuse what is not known of a mesh, and more slices than a machine can hold.

    It takes no time: call it before anything is computed.

    resolution : instead of that of the settings
    """
    if gear_set.meshes[mesh].varies_over_width:
        _require_known(gear_set, mesh, settings)
        resolution = resolution or RESOLUTIONS[settings.resolution]
        _require_few_slices(gear_set, mesh, resolution)


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
    for gear in gears:
        if gear.faults.cracks:
            raise InputError(
                f'{where}: gear "{gear.name}": cracks are not known with {has}: what '
                "they add to the compliance is that of a section, over all of the "
                "width"
            )
        if gear.groove and gear.faults.any:
            raise InputError(
                f'{where}: gear "{gear.name}": faults are not known of double helical '
                "gears, whose halves would have them both"
            )
