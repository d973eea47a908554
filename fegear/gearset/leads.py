"""From the keys over the face width to lead modifications, and what they require."""

from __future__ import annotations

from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.modifications import FlankLead
from fegear.gearset.schema import LeadEntry, MeshEntry, mesh_label
from lumped.common.units import MM, UM
from meshes.gear import floored

MIN_COMMON_WIDTH = 0.1  # over which gears face each other, of the narrower one's width


def leads_by_key(entry: MeshEntry) -> dict[str, FlankLead | None]:
    """Both lead modifications of a mesh by their keys."""
    leads: dict[str, FlankLead | None] = {}
    for role in ("driver", "driven"):
        key = f"{role}_lead"
        leads[key] = _lead(getattr(entry, key) or entry.lead)
    return leads


def _lead(entry: LeadEntry | None) -> FlankLead | None:
    if entry is None or not (
        entry.crowning_um or entry.slope_um or entry.end_relief_um
    ):
        return None
    return FlankLead(
        crowning=entry.crowning_um * UM,
        slope=entry.slope_um * UM,
        end_relief=entry.end_relief_um * UM,
        end_length=(entry.end_relief_length_mm or 0.0) * MM,
    )


def require_uniform_loads(gear_set: GearSet, task: str) -> None:
    """Refuse gears whose loads vary over the face width, for a task without them."""
    for mesh in gear_set.meshes:
        if not mesh.varies_over_width:
            continue
        one, two = (gear_set.gears[gear].name for gear in mesh.gears)
        has = "are helical" if mesh.is_helical else "have a lead modification"
        if mesh.offset and not mesh.is_helical:
            has = "have an axial offset"
        raise InputError(
            f'gears "{one}" and "{two}" {has}; allowed for {task} are spur gears with '
            "neither lead modification nor offset_mm"
        )


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
    for mesh in gear_set.meshes:
        gears = [gear_set.gears[index] for index in mesh.gears]
        where = mesh_label(*(gear.name for gear in gears))
        widths = [gear.face_width for gear in gears]
        most = 0.5 * sum(widths) - MIN_COMMON_WIDTH * min(widths)
        if abs(mesh.offset) > most:
            raise InputError(
                f"{where}: offset_mm = {mesh.offset / MM:g}; must be at most "
                f"{floored(most / MM)} mm, so that a tenth of the narrower width is in "
                "mesh"
            )
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
                    f"{lead.end_length / MM:g}; must be at most {floored(half / MM)} "
                    f'mm, half the face width of gear "{gear.name}"'
                )
            limit = 0.5 * gear.geometry.module
            for key in ("crowning", "slope", "end_relief"):
                depth = getattr(lead, key)
                if abs(depth) > limit:
                    raise InputError(
                        f"{where}: {role}_lead.{key}_um = {depth / UM:g}; must be "
                        f"from -{floored(limit / UM)} to {floored(limit / UM)}, half "
                        "the module"
                    )
