"""From the keys over the face width to lead modifications, and what they require."""

from __future__ import annotations

import math

from fegear.files.errors import InputError
from fegear.gearset.model import Gear, GearSet, Mesh
from fegear.gearset.modifications import FlankLead
from fegear.gearset.schema import LeadEntry, MeshEntry, mesh_label
from lumped.common.array_types import Array
from lumped.common.units import MM, UM
from meshes.gear import apart_from, ceiled, floored

MIN_COMMON_WIDTH = 0.1  # over which gears face each other, of the narrower one's width
MAX_OVERLAP_RATIO = 60.0  # beyond, no resolution has few enough slices of the width


def leads_by_key(entry: MeshEntry) -> dict[str, FlankLead | None]:
    """Both lead modifications of a mesh by their keys."""
    leads: dict[str, FlankLead | None] = {}
    for role in ("driver", "driven"):
        key = f"{role}_lead"
        of_gear = getattr(entry, key)
        # the slope between both flanks is a misalignment
        leads[key] = (
            _lead(entry.lead, 0.0)
            if of_gear is None
            else _lead(of_gear, of_gear.slope_um)
        )
    return leads


def misalignment(entry: MeshEntry) -> float:
    """Gap at the far end that belongs to neither gear alone [m]."""
    slope_um = 0.0 if entry.lead is None else entry.lead.slope_um
    return (entry.misalignment_um + slope_um) * UM


def _lead(entry: LeadEntry | None, slope_um: float) -> FlankLead | None:
    if entry is None or not (entry.crowning_um or slope_um or entry.end_relief_um):
        return None
    return FlankLead(
        crowning=entry.crowning_um * UM,
        slope=slope_um * UM,
        end_relief=entry.end_relief_um * UM,
        end_length=(entry.end_relief_length_mm or 0.0) * MM,
    )


def width_gap(gear_set: GearSet, mesh: int, places: Array) -> Array:
    """Gap between the flanks of a mesh over its common width, along the line of action.

    That of the leads of both gears and of misaligned axes.

    places : (n,) from the middle of the common width [m]

    Returns (n,) [m].
    """
    spec, middles = gear_set.meshes[mesh], gear_set.width_middles(mesh)
    gap = misaligned_gap(gear_set, mesh, places)
    for index, flank, middle in zip(spec.gears, spec.flanks, middles, strict=True):
        if flank.lead is not None:
            width = gear_set.gears[index].face_width
            gap = gap + flank.lead.depth(places + middle, width)
    return gap


def misaligned_gap(
    gear_set: GearSet, mesh: int, places: Array, back: bool = False
) -> Array:
    """Gap of misaligned axes (n,) [m], as in `width_gap`.

    On back flanks an axis that gives way along the normal of the drive flanks comes
    nearer by the cosine between both normals.

    back : of back flanks
    """
    spec = gear_set.meshes[mesh]
    angle = 2.0 * spec.pair.operating_pressure_angle
    misalignment = spec.misalignment * (-math.cos(angle) if back else 1.0)
    span = gear_set.common_width(mesh) + gear_set.common_groove(mesh)
    return misalignment * (0.5 + places / span)


def require_uniform_loads(gear_set: GearSet, task: str) -> None:
    """Refuse gears whose loads vary over the face width, for a task without them."""
    for mesh in gear_set.meshes:
        if not mesh.varies_over_width:
            continue
        one, two = (gear_set.gears[gear].name for gear in mesh.gears)
        raise InputError(
            f'gears "{one}" and "{two}" {_variation(mesh)}; allowed for {task} are '
            "spur gears with neither lead modification, topography, misalignment_um "
            "nor offset_mm"
        )


def require_one_helix(gear_set: GearSet, task: str) -> None:
    """Refuse double helical gears, for a task that has one helix of a gear."""
    for gear in gear_set.gears:
        if gear.groove:
            raise InputError(
                f'gear "{gear.name}": hand = "double"; {task} have one helix of a '
                "gear: allowed is a gear set of one half, with half of the torque"
            )


def require_no_width_gap(gear_set: GearSet, mesh: int, task: str) -> None:
    """Refuse gaps that vary over the width, for a task that has one gap of a pair."""
    spec = gear_set.meshes[mesh]
    flanks = spec.flanks
    has_lead = any(flank.varies_over_width for flank in flanks) or spec.misalignment
    has_profile = any(
        (*flank.reliefs, flank.profile) != (None,) * 3 for flank in flanks
    )
    if not has_lead and not (spec.is_helical and has_profile):
        return
    one, two = (gear_set.gears[gear].name for gear in spec.gears)
    cause = "helical teeth with reliefs"
    if has_lead:
        cause = "its lead, topography or misalignment"
    raise InputError(
        f"{mesh_label(one, two)}: {task} has one gap of a tooth pair, and the gap of "
        f"{cause} varies over the face width; allowed is the excitation by finite "
        "elements"
    )


def _variation(mesh: Mesh) -> str:
    """Why loads vary over the face width."""
    if mesh.is_helical:
        return "are helical"
    if mesh.offset:
        return "have an axial offset"
    if mesh.misalignment:
        return "are misaligned"
    if mesh.on_shafts:
        return "are on shafts that yield"
    if not any(flank.varies_over_width for flank in mesh.flanks):
        return "have damage off the middle of the face width"
    has_lead = any(flank.lead is not None for flank in mesh.flanks)
    return f"have a {'lead modification' if has_lead else 'topography'}"


def require_spur(gear_set: GearSet, setting: str) -> None:
    """Refuse a setting of tooth pairs that pass the pitch point at once."""
    for mesh in gear_set.meshes:
        if mesh.is_helical:
            one, two = (gear_set.gears[gear].name for gear in mesh.gears)
            raise InputError(
                f'{setting}; must be 0, gears "{one}" and "{two}" are helical: their '
                "lines of contact slide both ways at once, see the loss factor of "
                "`fegear stiffness`"
            )


def require_faces(gear_set: GearSet) -> None:
    """Require gears to face each other over the width, and leads to fit it."""
    for number, mesh in enumerate(gear_set.meshes):
        gears = [gear_set.gears[index] for index in mesh.gears]
        where = mesh_label(*(gear.name for gear in gears))
        widths = [gear.face_width for gear in gears]
        most = 0.5 * sum(widths) - MIN_COMMON_WIDTH * min(widths)
        if abs(mesh.offset) > most:
            raise InputError(
                f"{where}: offset_mm = {_apart_from(mesh.offset / MM, most / MM)}; "
                f"must be at most {floored(most / MM)} mm, so that a tenth of the "
                "narrower width is in mesh"
            )
        _require_whole_halves(gear_set, number, where)
        _require_engaged(gear_set, number, where)
        _require_narrow(gear_set, number, where)
        misaligned = f"{where}: misalignment_um or lead.slope_um"
        _require_shallow(misaligned, mesh.misalignment, gears[0])
        for role, gear, flank in zip(
            ("driver", "driven"), gears, mesh.flanks, strict=True
        ):
            lead = flank.lead
            if lead is None:
                continue
            half = 0.5 * gear.face_width
            if lead.end_length > half:
                raise InputError(
                    f"{where}: {role}_lead.end_relief_length_mm = "
                    f"{_apart_from(lead.end_length / MM, half / MM)}; must be at most "
                    f"{floored(half / MM)} "
                    f'mm, half the face width of gear "{gear.name}"'
                )
            for key in ("crowning", "slope", "end_relief"):
                depth = getattr(lead, key)
                name = f"{where}: {role}_lead.{key}_um"
                _require_shallow(name, depth, gear, signed=key != "end_relief")


def _require_whole_halves(gear_set: GearSet, number: int, where: str) -> None:
    """Require double helical gears whose halves face each other, unmodified."""
    mesh = gear_set.meshes[number]
    if not gear_set.common_groove(number):
        return
    if mesh.offset:
        raise InputError(
            f"{where}: offset_mm = {mesh.offset / MM:.9g}; must be 0 of double helical "
            "gears, whose halves centre each other"
        )
    gears = [gear_set.gears[index] for index in mesh.gears]
    least = MIN_COMMON_WIDTH * min(gear.helix_width for gear in gears)
    if not gear_set.helix_width(number) >= least:
        wide, narrow = sorted(gears, key=lambda gear: gear.groove, reverse=True)
        raise InputError(
            f'{where}: gap_mm = {wide.groove / MM:.9g} of gear "{wide.name}" leaves '
            f"{max(0.0, gear_set.helix_width(number)) / MM:.6g} mm of each half in "
            f'mesh with gear "{narrow.name}", {narrow.face_width / MM:.9g} mm wide; at '
            f"least {ceiled(least / MM)} mm are needed"
        )
    for role, flank in zip(("driver", "driven gear"), mesh.flanks, strict=True):
        if flank.varies_over_width:
            kind = "a lead modification" if flank.lead is not None else "a topography"
            raise InputError(
                f"{where}: {kind} of the {role}; must not be given of double helical "
                "gears, whose halves would need one each"
            )


def _require_engaged(gear_set: GearSet, mesh: int, where: str) -> None:
    """Require helical teeth that take over from each other by path and overlap."""
    start, end = gear_set.engagement(mesh)
    if end - start >= 1.0:
        return
    transverse = gear_set.meshes[mesh].pair.contact_ratio
    raise InputError(
        f"{where}: total contact ratio {floored(end - start)}, transverse "
        f"{floored(transverse)} and overlap {floored(gear_set.overlap_ratio(mesh))}; "
        "at least 1 is needed for continuous motion, by wider gears, larger tips or a "
        "smaller centre distance"
    )


def _require_narrow(gear_set: GearSet, mesh: int, where: str) -> None:
    """Require a width of contact that can be solved in slices."""
    ratio = gear_set.overlap_ratio(mesh)
    if ratio > MAX_OVERLAP_RATIO:
        most = gear_set.common_width(mesh) / ratio * MAX_OVERLAP_RATIO
        limit = f"{MAX_OVERLAP_RATIO:g}"
        raise InputError(
            f"{where}: overlap ratio {apart_from(ratio, limit)}; must be at most "
            f"{limit}, that of a common face width of "
            f"{floored(most / MM)} mm"
        )


def _apart_from(value: float, limit: float) -> str:
    """A value of either sign told apart from its largest size."""
    return apart_from(value, floored(limit), f"-{floored(limit)}")


def _require_shallow(name: str, depth: float, gear: Gear, signed: bool = True) -> None:
    """Refuse a depth [m] of more than half the module, that of the file.

    signed : whether the key takes negative depths
    """
    limit = 0.5 * gear.geometry.normal_module
    if abs(depth) > limit:
        most = floored(limit / UM)
        raise InputError(
            f"{name} = {_apart_from(depth / UM, limit / UM)}; must be from "
            f"{f'-{most}' if signed else 0} to {most}, half the module"
        )
