"""REXS files written from gear sets, for tests."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import count
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from fegear.gearset.model import Gear, GearSet, Mesh


def attribute(name: str, value: Any, unit: str = "none") -> dict[str, Any]:
    return {"id": name, "unit": unit, "value": value}


def base_tangent(gear: Gear, teeth: int) -> float:
    """Base tangent length [mm] over teeth, from the arc thickness."""
    geometry = gear.geometry
    alpha = geometry.pressure_angle
    involute = math.tan(alpha) - alpha
    radius = 0.5 * geometry.module * geometry.teeth
    angle = (geometry.tooth_thickness / radius) + 2.0 * involute
    pitch = 2.0 * math.pi / geometry.teeth
    return 1e3 * radius * math.cos(alpha) * (angle + (teeth - 1) * pitch)


class RexsWriter:
    """A gear set as the tree of a REXS file, with its gears on shafts."""

    def __init__(self, gear_set: GearSet, version: str = "1.4") -> None:
        self.gear_set, self.version = gear_set, version
        self.components: list[dict[str, Any]] = []
        self.relations: list[dict[str, Any]] = []
        self._numbers = count(1)

    def tree(self) -> dict[str, Any]:
        unit = self._component("gear_unit", "unit")
        gears = [self._gear(gear) for gear in self.gear_set.gears]
        for axis in self._axes():
            self._shaft(unit, axis, gears)
        for mesh in self.gear_set.meshes:
            self._stage(mesh, gears)
        return {
            "version": self.version,
            "applicationId": "test",
            "applicationVersion": "1",
            "date": "2024-01-01T00:00:00+00:00",
            "relations": self.relations,
            "components": self.components,
            "load_spectrum": {"id": 1, "load_cases": list(self._load_cases())},
        }

    def _component(self, kind: str, name: str, *attributes: dict[str, Any]) -> int:
        number = next(self._numbers)
        self.components.append(
            {"id": number, "type": kind, "name": name, "attributes": [*attributes]}
        )
        return number

    def _relate(self, kind: str, **roles: int) -> None:
        refs = [{"id": number, "role": role} for role, number in roles.items()]
        self.relations.append(
            {"id": len(self.relations) + 1, "type": kind, "refs": refs}
        )

    def _gear(self, gear: Gear) -> int:
        geometry, body = gear.geometry, gear
        span = max(2, round(geometry.teeth / 9))
        number = self._component(
            "cylindrical_gear",
            gear.name,
            attribute("number_of_teeth", geometry.teeth),
            attribute("normal_module", 1e3 * geometry.module, "mm"),
            attribute("helix_angle_reference_diameter", 0.0, "deg"),
            attribute("face_width", 1e3 * gear.face_width, "mm"),
            attribute("tip_diameter", 2e3 * geometry.tip_radius, "mm"),
            attribute("u_coordinate_on_shaft", 50.0, "mm"),
            attribute("span_measurement", base_tangent(gear, span), "mm"),
            attribute("number_of_teeth_for_span_measurement", span),
        )
        angle = math.degrees(geometry.pressure_angle)
        flank = (
            attribute("normal_pressure_angle", angle, "deg"),
            attribute("addendum_modification_coefficient", geometry.profile_shift),
        )
        left, right = (
            self._component("cylindrical_gear_flank", side, *flank)
            for side in ("left", "right")
        )
        self._relate("flank", gear=number, left=left, right=right)
        tool = self._component(
            "rack_shaped_tool",
            "tool",
            attribute("addendum_reference_profile", 1e3 * geometry.dedendum, "mm"),
            attribute("tip_radius", 1e3 * geometry.rack_tip_radius, "mm"),
        )
        self._relate("ordered_reference", origin=number, referenced=tool)
        material = self._component(
            "material",
            "material",
            attribute("elastic_modulus", 1e-6 * body.young_modulus, "N / mm^2"),
            attribute("poisson_ratio", body.poisson_ratio),
            attribute("density", 1e-3 * body.density, "kg / dm^3"),
        )
        self._relate("reference", origin=number, referenced=material)
        return number

    def _axes(self) -> list[tuple[int, ...]]:
        indices = range(len(self.gear_set.gears))
        return list(
            dict.fromkeys(tuple(sorted(self.gear_set.axis(i))) for i in indices)
        )

    def _shaft(self, unit: int, axis: tuple[int, ...], gears: list[int]) -> None:
        shaft = self._component("shaft", f"shaft of {axis[0]}")
        self._relate("assembly", assembly=unit, part=shaft)
        for place, index in enumerate(axis):
            number = gears[index]
            self._relate("assembly", assembly=shaft, part=number)
            middle = 50.0 + 100.0 * place
            self._set(number, "u_coordinate_on_shaft", middle)
            diameter = 2e3 * self.gear_set.gears[index].geometry.hub_radius
            section = self._component(
                "shaft_section",
                "section",
                attribute("u_coordinate_on_shaft", middle - 49.0, "mm"),
                attribute("length", 98.0, "mm"),
                attribute("outer_diameter_begin", diameter, "mm"),
                attribute("outer_diameter_end", diameter, "mm"),
            )
            self._relate("assembly", assembly=shaft, part=section)
        if self.gear_set.meshes[0].driver in axis:
            self._set(shaft, "defines_speed", "true")
            self.load = self._component(
                "external_load", "load", attribute("transmits_torque", "true")
            )
            self._relate("assembly", assembly=shaft, part=self.load)

    def _set(self, number: int, name: str, value: Any) -> None:
        entry = next(c for c in self.components if c["id"] == number)
        unit = "mm" if isinstance(value, float) else "none"
        entry["attributes"] = [
            *(item for item in entry["attributes"] if item["id"] != name),
            attribute(name, value, unit),
        ]

    def _stage(self, mesh: Mesh, gears: list[int]) -> None:
        distance = 1e3 * mesh.pair.center_distance
        stage = self._component(
            "cylindrical_stage", "stage", attribute("center_distance", distance, "mm")
        )
        self._relate(
            "stage", stage=stage, gear_1=gears[mesh.driver], gear_2=gears[mesh.driven]
        )

    def _load_cases(self) -> Iterator[dict[str, Any]]:
        for number, torque in enumerate(self.gear_set.meshes[0].torques, start=1):
            load = {
                "id": self.load,
                "type": "external_load",
                "name": "load",
                "attributes": [attribute("torque_around_u_axis", torque, "N m")],
            }
            yield {"id": number, "components": [load]}


def as_xml(tree: dict[str, Any]) -> str:
    """XML text of a tree."""
    head = " ".join(
        f"{key}={quoteattr(str(value))}"
        for key, value in tree.items()
        if not isinstance(value, list | dict)
    )
    relations = "".join(
        f'<relation id="{r["id"]}" type="{r["type"]}">'
        + "".join(f'<ref id="{ref["id"]}" role="{ref["role"]}"/>' for ref in r["refs"])
        + "</relation>"
        for r in tree["relations"]
    )
    cases = "".join(
        f'<load_case id="{case["id"]}">'
        + "".join(map(_xml, case["components"]))
        + "</load_case>"
        for case in tree["load_spectrum"]["load_cases"]
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model {head}>'
        f"<relations>{relations}</relations>"
        f"<components>{''.join(map(_xml, tree['components']))}</components>"
        f'<load_spectrum id="1">{cases}</load_spectrum></model>\n'
    )


def _xml(component: dict[str, Any]) -> str:
    attributes = "".join(
        f'<attribute id="{item["id"]}" unit={quoteattr(item["unit"])}>'
        f"{_xml_value(item['value'])}</attribute>"
        for item in component["attributes"]
    )
    return (
        f'<component id="{component["id"]}" name={quoteattr(component["name"])} '
        f'type="{component["type"]}">{attributes}</component>\n'
    )


def _xml_value(value: Any) -> str:
    if isinstance(value, list):
        return f"<array>{''.join(f'<c>{entry!r}</c>' for entry in value)}</array>"
    return escape(value if isinstance(value, str) else repr(value))


def as_json(tree: dict[str, Any]) -> str:
    """JSON text of a tree; values have their type as a key."""

    def typed(component: dict[str, Any]) -> dict[str, Any]:
        attributes = [
            {"id": a["id"], "unit": a["unit"], _json_type(a["value"]): a["value"]}
            for a in component["attributes"]
        ]
        return {**component, "attributes": attributes}

    cases = [
        {**case, "components": [typed(c) for c in case["components"]]}
        for case in tree["load_spectrum"]["load_cases"]
    ]
    model = {
        **tree,
        "components": [typed(c) for c in tree["components"]],
        "load_spectrum": {"id": 1, "load_cases": cases},
    }
    return json.dumps({"model": model})


def _json_type(value: Any) -> str:
    names = {int: "integer", float: "floating_point", list: "floating_point_array"}
    return names.get(type(value), "string")


class RexsParts:
    """Components and relations of a REXS file, added one by one."""

    def __init__(self) -> None:
        self.components: list[dict[str, Any]] = []
        self.relations: list[dict[str, Any]] = []
        self.planets: list[int] = []

    def component(self, kind: str, name: str, *attributes: dict[str, Any]) -> int:
        number = len(self.components) + 1
        self.components.append(
            {"id": number, "type": kind, "name": name, "attributes": [*attributes]}
        )
        return number

    def relate(self, kind: str, **roles: int) -> None:
        refs = [{"id": number, "role": role} for role, number in roles.items()]
        number = len(self.relations) + 1
        self.relations.append({"id": number, "type": kind, "refs": refs})

    def shaft(self, name: str, diameter: float, *attributes: dict[str, Any]) -> int:
        """A shaft of one section, outside which gears are."""
        shaft = self.component("shaft", name, *attributes)
        section = self.component(
            "shaft_section",
            name,
            attribute("u_coordinate_on_shaft", 0.0, "mm"),
            attribute("length", 50.0, "mm"),
            attribute("outer_diameter_begin", diameter, "mm"),
        )
        self.relate("assembly", assembly=shaft, part=section)
        return shaft

    def gear(
        self,
        name: str,
        teeth: int,
        place: tuple[float, float],
        shaft: int,
        kind: str = "cylindrical_gear",
    ) -> int:
        """A spur gear of module 4 mm on a shaft; place : across the axis [mm]."""
        gear = self.component(
            kind,
            name,
            attribute("number_of_teeth", teeth),
            attribute("normal_module", 4.0, "mm"),
            attribute("helix_angle_reference_diameter", 0.0, "deg"),
            attribute("face_width", 50.0, "mm"),
            attribute("u_coordinate_on_shaft", 25.0, "mm"),
            attribute("support_vector", [125.0, *place], "mm"),
        )
        self.relate("assembly", assembly=shaft, part=gear)
        return gear

    def change(self, name: str, key: str, value: Any) -> None:
        """Another value of an attribute of components of a name."""
        for component in self.components:
            for entry in component["attributes"]:
                if (component["name"], entry["id"]) == (name, key):
                    entry["value"] = value

    def tree(self) -> dict[str, Any]:
        return {
            "version": "1.4",
            "applicationId": "test",
            "applicationVersion": "1",
            "date": "2024-01-01T00:00:00+00:00",
            "relations": self.relations,
            "components": self.components,
            "load_spectrum": {"id": 1, "load_cases": []},
        }
