"""A gear-set file from a REXS model: spur stages, and a line for all that is left out.

Lengths in mm and angles in degrees, as in the gear-set file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from fegear.commands.new.rexs.components import Component, RexsModel
from fegear.commands.new.rexs.geometry import center_line, diameter_at, root_of_tool
from fegear.commands.new.rexs.left_out import parts_left_out, speeds_left_out
from fegear.commands.new.rexs.planetary import PlanetaryStage, planetary_stage
from fegear.commands.new.rexs.stages import (
    MAX_HELIX_DEG,
    RexsGearbox,
    Stage,
    helix_angle,
    is_internal,
    ratios_from_input,
)
from fegear.commands.new.rexs.thickness_series import thinning_of_series
from fegear.files.errors import InputError
from fegear.files.toml import toml_text, toml_value

NO_TORQUE = "torque: none is stated; add [load], or give it to commands"
SHIFT_TOLERANCE = 1e-3  # of profile shifts that a file states twice
SHIFT_ATTRIBUTES = ("addendum_modification_coefficient", "profile_shift_coefficient")
TOOL_KINDS = ("rack_shaped_tool", "cutter_wheel_tool")  # of external, internal gears
SERIES_ATTRIBUTES = (
    "tooth_thickness_deviation_tolerance_series_din_3967_1978",
    "din_3967_deviation_tolerance_series",
)
# of the reference diameter, of a bore that the file does not state
DEFAULT_HUB = 0.6
DEFAULT_RIM_MODULES = 3.0  # between root and outside of an internal gear
MIN_RIM_MODULES = 1.0  # between bore and root, of a bore that is a shaft's diameter


@dataclass(frozen=True)
class RexsGearSet:
    """A gear set as text of its file, and what was made of the REXS file.

    assumed : values that it lacks, and how they were chosen
    left_out : what it has and the gear set has not
    """

    text: str
    assumed: tuple[str, ...]
    left_out: tuple[str, ...]


def _helix_cosine(entry: dict[str, Any]) -> float:
    return math.cos(math.radians(entry.get("helix_angle_deg", 0.0)))


@dataclass(frozen=True)
class _GearSetConversion:
    """A conversion, which notes what it assumes."""

    gearbox: RexsGearbox
    assumed: list[str] = field(default_factory=list)

    def gear(self, gear: Component, name: str) -> dict[str, Any]:
        sources = self._components_of_teeth(gear)
        module = self._agreed_value(sources, "normal_module", "length")
        if module is None:
            raise InputError(f"{gear.label}: attribute normal_module is missing")
        teeth = gear.require_integer("number_of_teeth")
        entry: dict[str, Any] = {"name": name, "teeth": teeth, "module_mm": module}
        entry |= self._helix_values(gear)
        if is_internal(gear):
            entry |= {"teeth": abs(teeth), "internal": True}
        entry |= self._pressure_angle_values(gear, sources)
        entry |= self._shift_values(gear, sources, module)
        entry |= self._tip_values(gear, sources)
        entry |= self._root_values(gear, sources, entry)
        entry["face_width_mm"] = gear.require_quantity("face_width", "length")
        if is_internal(gear):
            entry["rim_radius_mm"] = self._rim_radius(gear, entry)
            thickness = self._thinning_values(gear, sources, entry)
            return entry | thickness | self._material_values(gear)
        entry["hub_diameter_mm"] = self._bore_diameter(gear, entry)
        if self._has_span_measurement(sources):
            thickness = self._span_values(sources)
        else:
            thickness = self._thinning_values(gear, sources, entry)
        return entry | thickness | self._material_values(gear)

    def _helix_values(self, gear: Component) -> dict[str, Any]:
        """Helix and, where its sign says so, hand: right if it is positive."""
        angle = self._helix_angle(gear)
        if not angle:
            return {}
        stages = [s for s in self.gearbox.all_stages if gear in s.gears]
        values: dict[str, Any] = {"helix_angle_deg": abs(angle)}
        signs = [
            math.copysign(1.0, helix_angle(other, stage.component))
            for stage in stages
            for other in stage.gears
            if other is not gear
        ]
        if all(sign * angle < 0.0 for sign in signs):
            values["hand"] = "right" if angle > 0.0 else "left"
        else:
            self.assumed.append(
                f"hand of {gear.label}: opposite to its mate's, whose helix angle has "
                "the same sign"
            )
        return values

    def _helix_angle(self, gear: Component) -> float:
        """Helix angle [deg], 0 of a spur gear."""
        stages = [s.component for s in self.gearbox.all_stages if gear in s.gears]
        angle = helix_angle(gear, stages[0] if stages else None)
        return angle if abs(angle) > MAX_HELIX_DEG else 0.0

    def _components_of_teeth(self, gear: Component) -> list[Component]:
        """Where attributes of teeth are: flanks, or the gear."""
        parts = self.gearbox.parts
        flanks = [
            flank
            for side in ("left", "right")
            for flank in parts("flank", "gear", gear.number, side)
        ]
        return [gear, *flanks]

    def _agreed_value(
        self, sources: list[Component], name: str, quantity: str
    ) -> float | None:
        """A value that all sources agree on."""
        stated = [
            (source, value)
            for source in sources
            if (value := source.quantity(name, quantity)) is not None
        ]
        for source, value in stated[1:]:
            first, other = stated[0]
            if not math.isclose(value, other, rel_tol=1e-9, abs_tol=1e-12):
                raise InputError(
                    f"{source.label}: {name} = {value:g}; must be that of "
                    f"{first.label}, {other:g}: flanks of a gear are alike"
                )
        return stated[0][1] if stated else None

    def _pressure_angle_values(
        self, gear: Component, sources: list[Component]
    ) -> dict[str, float]:
        angle = self._agreed_value(sources, "normal_pressure_angle", "angle")
        if angle is None:
            self.assumed.append(f"pressure angle of {gear.label}: 20 deg, not stated")
            return {}
        return {"pressure_angle_deg": angle}

    def _shift_values(
        self, gear: Component, sources: list[Component], module: float
    ) -> dict[str, float]:
        shifts = {
            name: shift
            for name in SHIFT_ATTRIBUTES
            if (shift := self._agreed_value(sources, name, "ratio")) is not None
        }
        length = self._agreed_value(sources, "addendum_modification", "length")
        if length is not None:
            shifts["addendum_modification"] = length / module
        if shifts:
            values = list(shifts.values())
            if max(values) - min(values) > SHIFT_TOLERANCE:
                stated = " and ".join(f"{n} = {x:g} module" for n, x in shifts.items())
                raise InputError(f"{gear.label}: {stated}; they must be equal")
            return {"profile_shift": values[0]}
        if self._has_span_measurement(sources):
            return {}
        self.assumed.append(f"profile shift of {gear.label}: 0, not stated")
        return {}

    def _tip_values(
        self, gear: Component, sources: list[Component]
    ) -> dict[str, float]:
        tip = self._agreed_value(sources, "tip_diameter", "length")
        if tip is None:
            where = "one module inside" if is_internal(gear) else "above"
            modules = "" if is_internal(gear) else "1 + profile shift modules "
            self.assumed.append(
                f"tip of {gear.label}: {modules}{where} the reference circle, not "
                "stated"
            )
            return {}
        return {"tip_diameter_mm": abs(tip)}

    def _root_values(
        self, gear: Component, sources: list[Component], entry: dict[str, Any]
    ) -> dict[str, float]:
        """Dedendum and tip of the rack, of the tool or by the root circle."""
        module, tool = entry["module_mm"], self._cutting_tool(gear)
        root = self._agreed_value(sources, "root_diameter", "length")
        result: dict[str, float] = {}
        if tool is not None:
            result = root_of_tool(tool, module)
        if "dedendum_mm" not in result and root is not None:
            reference = 0.5 * module * entry["teeth"] / _helix_cosine(entry)
            shift = module * entry.get("profile_shift", 0.0)
            outward = reference - 0.5 * abs(root)
            result["dedendum_mm"] = shift + (-outward if is_internal(gear) else outward)
        if tool is not None and is_internal(gear):
            result["cutter_teeth"] = tool.require_integer("number_of_teeth")
        if "dedendum_mm" not in result:
            kind = TOOL_KINDS[is_internal(gear)]
            self.assumed.append(
                f"dedendum of {gear.label}: 1.25 modules, no {kind} with "
                "addendum_coefficient_reference_profile, and no root_diameter"
            )
        return result

    def _cutting_tool(self, gear: Component) -> Component | None:
        parts = self.gearbox.parts
        tools = [
            *parts("reference", "origin", gear.number, "referenced"),
            *parts("", "workpiece", gear.number, "tool"),
        ]
        kind = TOOL_KINDS[is_internal(gear)]
        return next((tool for tool in tools if tool.kind == kind), None)

    def _bore_diameter(self, gear: Component, entry: dict[str, Any]) -> float:
        """Diameter of the bore: that of the shaft, where it leaves a rim."""
        reference = float(entry["module_mm"] * entry["teeth"]) / _helix_cosine(entry)
        dedendum = entry.get("dedendum_mm", 1.25 * entry["module_mm"])
        shift = entry.get("profile_shift", 0.0) * entry["module_mm"]
        largest = reference + 2.0 * (
            shift - dedendum - MIN_RIM_MODULES * entry["module_mm"]
        )
        diameter = self._shaft_diameter(gear)
        if diameter is not None and 0.0 < diameter <= largest:
            return diameter
        reason = (
            "no shaft_section at the gear"
            if diameter is None
            else f"its shaft_section of {diameter:g} mm leaves no rim below the root"
        )
        self.assumed.append(
            f"bore of {gear.label}: {DEFAULT_HUB:g} of the reference diameter, {reason}"
        )
        return DEFAULT_HUB * reference

    def _rim_radius(self, gear: Component, entry: dict[str, Any]) -> float:
        """Outer radius of an internal gear: its shaft's, where that leaves a rim."""
        module = entry["module_mm"]
        root = 0.5 * module * entry["teeth"] + entry.get("dedendum_mm", 1.25 * module)
        diameter = self._shaft_diameter(gear)
        if diameter is not None and 0.5 * diameter >= root + MIN_RIM_MODULES * module:
            return 0.5 * diameter
        self.assumed.append(
            f"outer radius of {gear.label}: {DEFAULT_RIM_MODULES:g} modules outside "
            "the root, no shaft_section there"
        )
        return float(root + DEFAULT_RIM_MODULES * module)

    def _shaft_diameter(self, gear: Component) -> float | None:
        """Outer diameter of the shaft at the middle of the gear."""
        shaft = self.gearbox.shaft_of(gear)
        middle = gear.quantity("u_coordinate_on_shaft", "length")
        if shaft is None or middle is None:
            return None
        parts = self.gearbox.parts("assembly", "assembly", shaft.number, "part")
        sections = [part for part in parts if part.kind == "shaft_section"]
        diameters = [diameter_at(section, middle) for section in sections]
        return max(filter(None, diameters), default=None)

    def _has_span_measurement(self, sources: list[Component]) -> bool:
        names = "span_measurement", "number_of_teeth_for_span_measurement"
        return all(any(n in s.attributes for s in sources) for n in names)

    def _span_values(self, sources: list[Component]) -> dict[str, Any]:
        span = self._agreed_value(sources, "span_measurement", "length")
        name = "number_of_teeth_for_span_measurement"
        source = next(s for s in sources if name in s.attributes)
        return {"span_mm": span, "span_teeth": source.require_integer(name)}

    def _thinning_values(
        self, gear: Component, sources: list[Component], entry: dict[str, Any]
    ) -> dict[str, Any]:
        """Thinning in the middle of the tolerance, where a series is stated."""
        where = f"tooth thickness of {gear.label}"
        stated = [
            source.attributes[name].value
            for source in sources
            for name in SERIES_ATTRIBUTES
            if name in source.attributes
        ]
        if not stated:
            self.assumed.append(
                f"{where}: without thinning, no span_measurement with "
                f"number_of_teeth_for_span_measurement and no {SERIES_ATTRIBUTES[0]}"
            )
            return {}
        series, cosine = str(stated[0]), _helix_cosine(entry)
        diameter = float(entry["module_mm"] * entry["teeth"]) / cosine
        try:
            least, largest = thinning_of_series(series, diameter)
        except InputError as error:
            self.assumed.append(f"{where}: without thinning, {error}")
            return {}
        self.assumed.append(
            f"{where}: middle of {least:g} to {largest:g} um in the normal section, by "
            f"{series} of DIN 3967"
        )
        # the key is across the axis
        return {"tooth_thinning_um": round(0.5 * (least + largest) / cosine, 1)}

    def _material_values(self, gear: Component) -> dict[str, float]:
        """Elastic values and density, of the gear's material or its shaft's."""
        material = self._referenced_material(gear)
        shaft = self.gearbox.shaft_of(gear)
        if material is None and shaft is not None:
            material = self._referenced_material(shaft)
            if material is not None:
                self.assumed.append(
                    f"material of {gear.label}: {material.label}, that of its shaft"
                )
        if material is None:
            self.assumed.append(f"material of {gear.label}: steel, none is referenced")
            return {}
        return {
            key: material.require_quantity(name, quantity)
            for key, name, quantity in (
                ("young_modulus_GPa", "elastic_modulus", "modulus"),
                ("poisson_ratio", "poisson_ratio", "ratio"),
                ("density_kg_per_m3", "density", "density"),
            )
        }

    def _referenced_material(self, part: Component) -> Component | None:
        parts = self.gearbox.parts("reference", "origin", part.number, "referenced")
        return next((item for item in parts if item.kind == "material"), None)

    def mesh(self, stage: Stage, names: dict[int, str]) -> dict[str, Any]:
        distance = stage.component.require_quantity("center_distance", "length")
        driver, driven = stage.gears
        entry: dict[str, Any] = {
            "driver": names[driver.number],
            "driven": names[driven.number],
            "center_distance_mm": distance,
        }
        line = center_line(stage, distance)
        if line is None:
            self.assumed.append(
                f"direction of {stage.component.label}: in a row, no support_vector of "
                "both gears at the centre distance"
            )
            return entry
        return entry | {"center_line_deg": line}

    def shafts(self, names: dict[int, str]) -> Iterator[dict[str, Any]]:
        """Gears that share a shaft, in order along it."""
        gears = self.gearbox.spur_stages.gears
        for axis in dict.fromkeys(map(self.gearbox.axis_of, gears)):
            gears_of_axis = [
                gear for gear in gears if self.gearbox.axis_of(gear) == axis
            ]
            if len(gears_of_axis) < 2:
                continue
            gears_of_axis.sort(
                key=lambda g: g.quantity("u_coordinate_on_shaft", "length") or 0.0
            )
            yield {"gears": [names[gear.number] for gear in gears_of_axis]}
            label = self.gearbox.model.components[axis].label
            self.assumed.append(
                f"torsion of {label}: rigid between its gears; add "
                "stiffness_Nm_per_rad to the [[shaft]]"
            )

    def load(self, names: dict[int, str]) -> dict[str, Any]:
        spur = self.gearbox.spur_stages
        gear = spur.stages[0].first
        self.assumed.append(f"input: gear {names[gear.number]}, by {spur.rule}")
        torques = self._input_torques()
        if not torques:
            self.assumed.append(NO_TORQUE)
            return {}
        return {"load": {"gear": names[gear.number], "torques_Nm": torques}}

    def _input_torques(self) -> list[float]:
        """Torques of the load cases on the input, of its shaft or another one's."""
        model, spur = self.gearbox.model, self.gearbox.spur_stages
        ratios = ratios_from_input(self.gearbox, spur.stages)
        for axis, ratio in ratios.items():
            cases = [self._torque_on(axis, case) for case in model.load_cases or [{}]]
            torques = list(dict.fromkeys(t / ratio for t in cases if t > 0.0))
            if torques and axis != spur.input_axis:
                label = model.components[axis].label
                self.assumed.append(
                    f"torque on the input: that on {label} over the ratio {ratio:g}"
                )
            if torques:
                return torques
        return []

    def _torque_on(self, axis: int, case: Any) -> float:
        """Magnitude of the torque on a shaft in a load case, 0 where it has none."""
        total = 0.0
        for load in self.gearbox.loads_of(axis):
            stated = case.get(load.number)
            for source in filter(None, (stated, load)):
                torque = source.quantity("torque_around_u_axis", "torque")
                if torque is not None:
                    total += torque
                    break
        return abs(total)

    def planetary(self, stage: PlanetaryStage, names: list[str]) -> dict[str, Any]:
        """Tables of a planetary stage and of its load; names : of its gears."""
        roles = stage.roles(self.assumed)
        keys: dict[str, Any] = dict(zip(("sun", "planet", "ring"), names, strict=True))
        keys |= {"planets": len(stage.planets), **roles}
        keys["center_distance_mm"] = self._center_distance(stage)
        if positions := stage.positions_deg():
            keys["positions_deg"] = positions
        driver = roles["input"]
        torques = [
            sum(self._torque_on(axis, case) for axis in stage.axes[driver])
            for case in self.gearbox.model.load_cases or [{}]
        ]
        tables: dict[str, Any] = {"planetary": [keys]}
        if stated := list(dict.fromkeys(t for t in torques if t > 0.0)):
            gear = keys.get(driver, "carrier")
            return tables | {"load": {"gear": gear, "torques_Nm": stated}}
        self.assumed.append(NO_TORQUE)
        return tables

    def _center_distance(self, stage: PlanetaryStage) -> float:
        """That of all meshes; InputError where they differ."""
        stated = {
            mesh.component.label: mesh.component.require_quantity(
                "center_distance", "length"
            )
            for mesh in stage.stages
        }
        (first, distance), *others = stated.items()
        for label, other in others:
            if not math.isclose(other, distance, rel_tol=1e-9):
                raise InputError(
                    f"{label}: center_distance = {other:g}; must be that of {first}, "
                    f"{distance:g}"
                )
        return distance


def convert_gearbox(model: RexsModel, source: str, name: str) -> RexsGearSet:
    """The spur stages of a model, or its planetary stage, as a gear-set file.

    source : name of the REXS file; name : of the gear set
    """
    gearbox = RexsGearbox(model)
    try:
        _ = gearbox.spur_stages
    except InputError as error:
        if not model.of_kind("planetary_stage"):
            raise
        try:
            return _convert_planetary_stage(gearbox, source, name)
        except InputError as other:
            raise InputError(f"{error}; {other}") from None
    return _convert_spur_stages(gearbox, source, name)


def _convert_planetary_stage(
    gearbox: RexsGearbox, source: str, name: str
) -> RexsGearSet:
    stage, others = planetary_stage(gearbox)
    conversion = _GearSetConversion(gearbox)
    names = [*_gear_names([stage.sun, stage.ring]).values()]
    names.insert(1, stage.planet_name or "planet")
    if len({*names}) < len(names):
        names = ["sun", "planet", "ring"]
    gears = [conversion.gear(g, n) for g, n in zip(stage.gears, names, strict=True)]
    tables = {"gear": gears, **conversion.planetary(stage, names)}
    axis = stage.axes[tables["planetary"][0]["input"]]
    stage_numbers = {mesh.component.number for mesh in stage.stages}
    left_out = (
        *others,
        *(
            f"{mesh.component.label}: beside the planetary stage"
            for mesh in gearbox.all_stages
            if mesh.component.number not in stage_numbers
        ),
        *parts_left_out(gearbox, stage.stages),
        *(line for number in axis for line in speeds_left_out(gearbox, number)),
    )
    labels = {"[[gear]]": [gear.label for gear in stage.gears]}
    labels["[[planetary]]"] = [stage.component.label]
    description = f"Planetary stage of {source}, REXS {gearbox.model.version}"
    return _gear_set(name, description, tables, conversion.assumed, left_out, labels)


def _convert_spur_stages(gearbox: RexsGearbox, source: str, name: str) -> RexsGearSet:
    spur, conversion = gearbox.spur_stages, _GearSetConversion(gearbox)
    names = _gear_names(spur.gears)
    gears = [conversion.gear(gear, names[gear.number]) for gear in spur.gears]
    meshes = [conversion.mesh(stage, names) for stage in spur.stages]
    tables: dict[str, Any] = {"gear": gears, "mesh": meshes}
    if shafts := list(conversion.shafts(names)):
        tables["shaft"] = shafts
    tables |= conversion.load(names)
    left_out = (
        *spur.left_out,
        *parts_left_out(gearbox, spur.stages),
        *speeds_left_out(gearbox, spur.input_axis),
    )
    labels = {
        "[[gear]]": [gear.label for gear in spur.gears],
        "[[mesh]]": [stage.component.label for stage in spur.stages],
    }
    description = f"Stages of {source}, REXS {gearbox.model.version}"
    return _gear_set(name, description, tables, conversion.assumed, left_out, labels)


def _gear_set(
    name: str,
    description: str,
    tables: dict[str, Any],
    assumed: list[str],
    left_out: tuple[str, ...],
    labels: dict[str, list[str]],
) -> RexsGearSet:
    """The file of tables; labels : of the components, by the headings of tables."""
    heading = {"name": name, "description": description, "inferences": assumed}
    text = _text_with_comments(toml_text(heading | tables), assumed, left_out, labels)
    return RexsGearSet(text, tuple(assumed), left_out)


def _gear_names(gears: list[Component]) -> dict[int, str]:
    """A name for each gear, with its id where a name is used twice or missing."""
    labels = [gear.name for gear in gears]
    return {
        gear.number: gear.name
        if gear.name and labels.count(gear.name) == 1
        else f"{gear.name or 'gear'} ({gear.number})"
        for gear in gears
    }


def _inference_lines(assumed: Iterable[str]) -> Iterator[str]:
    """The key `inferences` with an entry on each line."""
    yield "inferences = ["
    yield from (f"    {toml_value(line)}," for line in assumed)
    yield "]"


def _text_with_comments(
    text: str,
    assumed: Iterable[str],
    left_out: tuple[str, ...],
    labels: dict[str, list[str]],
) -> str:
    """The file with what was left out, and the component of each table."""
    components = {heading: iter(names) for heading, names in labels.items()}
    lines = [
        "# From a REXS file; `inferences` lists what was assumed. Left out of it:",
        *(f"# - {line}" for line in left_out or ["nothing"]),
        "# `fegear keys gear-set` explains all keys.",
        "",
    ]
    for line in text.splitlines():
        if line in components:
            lines.append(f"# {next(components[line])}")
        lines += (
            [*_inference_lines(assumed)] if line.startswith("inferences = ") else [line]
        )
    return "\n".join(lines) + "\n"
