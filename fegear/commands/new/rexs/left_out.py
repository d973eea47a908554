"""What a REXS model has and its gear set has not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from fegear.commands.new.rexs.components import Component
from fegear.commands.new.rexs.stages import RexsGearbox, Stage

READ_KINDS = (
    *("gear_unit", "shaft", "shaft_section", "external_load", "material"),
    *("cylindrical_stage", "cylindrical_gear", "rack_shaped_tool"),
    *("stage_gear_data", "cylindrical_stage_gear_data"),
    *("flank_geometry", "cylindrical_gear_flank"),
)
PLANETARY_KINDS = (
    "planetary_stage",
    "planet_carrier",
    "ring_gear",
    "cutter_wheel_tool",
)
READ_ATTRIBUTES = (
    *("number_of_teeth", "normal_module", "normal_pressure_angle", "face_width"),
    *("addendum_modification_coefficient", "profile_shift_coefficient"),
    *("addendum_modification", "tip_diameter", "root_diameter", "center_distance"),
    *("helix_angle", "helix_angle_reference_diameter", "u_coordinate_on_shaft"),
    *("span_measurement", "number_of_teeth_for_span_measurement", "support_vector"),
)
# what says nothing beyond the places of gears
SILENT_ATTRIBUTES = (
    *("u_axis_vector", "w_axis_vector", "reference_component_for_position", "name"),
)
LISTED_NAMES = 6  # in one line


def parts_left_out(gearbox: RexsGearbox, stages: Iterable[Stage]) -> Iterator[str]:
    """A line for each type of component, and each type's attributes, not read.

    stages : of the gear set
    """
    kinds: dict[str, list[Component]] = {}
    for component in gearbox.model.components.values():
        kinds.setdefault(component.kind, []).append(component)
    for kind, parts in sorted(kinds.items()):
        if kind not in (*READ_KINDS, *PLANETARY_KINDS):
            yield f"{len(parts)} {kind}: {_listed_names(part.label for part in parts)}"
    read = list(stages)
    gears = {gear.number: gear for stage in read for gear in stage.gears}
    used = [*gears.values(), *_other_parts(gearbox, read, gears.values())]
    unread: dict[str, dict[str, None]] = {}
    for part in used:
        for name in part.attributes.keys() - {*READ_ATTRIBUTES, *SILENT_ATTRIBUTES}:
            unread.setdefault(part.kind, {})[name] = None
    for kind, names in sorted(unread.items()):
        yield f"attributes of {kind}: {_listed_names(sorted(names))}"


def _other_parts(
    gearbox: RexsGearbox, stages: Iterable[Stage], gears: Iterable[Component]
) -> Iterator[Component]:
    """Stages and flanks that are read, besides gears."""
    for stage in stages:
        yield stage.component
    for gear in gears:
        for side in ("left", "right"):
            yield from gearbox.parts("flank", "gear", gear.number, side)


def speeds_left_out(gearbox: RexsGearbox, axis: int) -> Iterator[str]:
    """A line on rotational speeds, which commands take and gear sets have not.

    axis : of the input
    """
    cases = [case.get(axis) for case in gearbox.model.load_cases]
    parts = [*filter(None, cases), gearbox.model.components[axis]]
    stated = (part.quantity("rotational_speed", "speed") for part in parts)
    speeds = dict.fromkeys(abs(speed) for speed in stated if speed)
    if speeds:
        text = ", ".join(f"{speed:g}" for speed in speeds)
        yield f"rotational_speed of the input: {text} rpm, an option of commands"


def _listed_names(items: Iterable[str]) -> str:
    names = list(items)
    more = len(names) - LISTED_NAMES
    return ", ".join(names[:LISTED_NAMES]) + (f" and {more} more" if more > 0 else "")
