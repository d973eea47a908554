"""Whether the setting `shafts` of a study at rest changes anything."""

from __future__ import annotations

from fegear.boundary import mesh_index
from fegear.gearset.model import GearSet
from fegear.gearset.yielding import yielding_shafts
from fegear.statics.settings import StaticsSettings
from fegear.studies.settings import SettingsGroup, refusal

NEEDED_KEYS = "lengths_mm, diameters_mm, positions_mm and bearing_positions_mm"


def require_shafts_used(
    elements: StaticsSettings, gear_set: GearSet, mesh: int, group: SettingsGroup
) -> None:
    """Raise InputError for a setting `shafts` that changes nothing.

    Parameters
    ----------
    elements : StaticsSettings
        The settings.
    gear_set : GearSet
        With its shafts.
    mesh : int
        That is solved, counted from 1.
    group : SettingsGroup
        Of the settings in the study.
    """
    if elements.shafts is None:
        return
    if reason := _reason(elements, gear_set, mesh):
        raise refusal(elements, "shafts", f"changes nothing here; {reason}", group)


def _reason(elements: StaticsSettings, gear_set: GearSet, mesh: int) -> str | None:
    """Why shafts do not yield whatever the setting is, None if they do."""
    gears = {gear for _, shaft in yielding_shafts(gear_set) for gear in shaft.gears}
    if not gears:
        return f"no [[shaft]] has {NEEDED_KEYS}"
    if not gears.intersection(gear_set.meshes[mesh_index(gear_set, mesh)].gears):
        return f"no [[shaft]] of a gear of mesh {mesh} has {NEEDED_KEYS}"
    if elements.shafts == "on":
        return None
    plane = elements.plane_of(gear_set)
    if plane != "width":
        return f"plane {plane} has no shafts that yield"
    return "bodies that are free have no shafts" if elements.body == "free" else None
