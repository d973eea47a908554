"""Planetary stages of a REXS model: sun, planets, ring and carrier, and which turn."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from functools import cached_property

from fegear.commands.new.rexs.components import Component
from fegear.commands.new.rexs.stages import RexsGearbox, Stage, is_internal, rejection
from fegear.files.errors import InputError

MAX_UNEVEN_DEG = 1e-3  # of planets that are called equally spaced
MIN_PLANETS = 2
COUPLINGS = "coupling", "switchable_coupling"
SEPARATORS = " -_@.,:\u00b00123456789"  # before what differs in the names of planets
EQUAL_OF_PLANETS = (
    *("number_of_teeth", "normal_module", "face_width", "tip_diameter"),
    "root_diameter",
)


@dataclass(frozen=True)
class PlanetaryStage:
    """A stage whose planets mesh with a sun and a ring.

    stages : of the sun with each planet, then of each planet with the ring
    """

    gearbox: RexsGearbox
    component: Component
    sun: Component
    planets: tuple[Component, ...]
    ring: Component
    stages: tuple[Stage, ...]

    @property
    def gears(self) -> tuple[Component, Component, Component]:
        """Sun, a planet and ring."""
        return self.sun, self.planets[0], self.ring

    @property
    def planet_name(self) -> str:
        """Common start of the names of the planets."""
        common, *others = (gear.name for gear in self.planets)
        while not all(name.startswith(common) for name in others):
            common = common[:-1]
        return common.rstrip(SEPARATORS)

    @cached_property
    def axes(self) -> dict[str, list[int]]:
        """Numbers of the shafts of sun, ring and carrier."""
        model, number = self.gearbox.model, self.component.number
        carrier = model.related(
            "planet_carrier_shaft", "planetary_stage", number, "shaft"
        )
        central = {"sun": self.sun, "ring": self.ring}
        axes = {name: [self.gearbox.axis_of(gear)] for name, gear in central.items()}
        return axes | {"carrier": [*carrier]}

    def roles(self, assumed: list[str]) -> dict[str, str]:
        """Which of sun, ring and carrier is the input, the output, and held.

        assumed : gets lines on what the model does not say
        """
        held = [name for name in self.axes if self._is_held(name)]
        if len(held) != 1:
            assumed.append("held: the ring, no coupling of one shaft with the casing")
            held = ["ring"]
        moving = [name for name in self.axes if name not in held]
        by_default = moving[0], "no defines_speed or defines_torque"
        driver, rule = self._input_member(moving) or by_default
        assumed.append(f"input: {driver}, by {rule}")
        (driven,) = (name for name in moving if name != driver)
        return {"input": driver, "output": driven, "held": held[0]}

    def _is_held(self, member: str) -> bool:
        """Whether a coupling joins a shaft of a member with the casing."""
        shafts, parts = self.axes[member], self.gearbox.model.components
        for relation in self.gearbox.model.relations:
            sides = {relation.role("inner_part"), relation.role("outer_part")} - {None}
            joint = relation.role("assembly")
            if relation.kind != "side" or joint is None or not sides & {*shafts}:
                continue
            kinds = {parts[number].kind for number in sides if number is not None}
            if parts[joint].kind in COUPLINGS and "gear_casing" in kinds:
                return True
        return False

    def _input_member(self, members: list[str]) -> tuple[str, str] | None:
        """The input by what a model says of its shafts, and by which attribute."""
        parts = self.gearbox.model.components
        for member in members:
            for axis in self.axes[member]:
                if parts[axis].truth("defines_speed"):
                    return member, f"defines_speed of {parts[axis].label}"
        for member in members:
            for axis in self.axes[member]:
                for load in self.gearbox.loads_of(axis):
                    if load.truth("defines_torque"):
                        return member, f"defines_torque of {load.label}"
        return None

    def positions_deg(self) -> list[float] | None:
        """Angles of the planets from the first; None where they are equally spaced.

        Equal spacing is assumed where planets have no places.
        """
        places = [gear.vector("support_vector") for gear in (self.sun, *self.planets)]
        vectors = [place for place in places if place is not None]
        if len(vectors) < len(places):
            return None
        center = vectors[0]
        angles = [
            math.degrees(math.atan2(place[2] - center[2], place[1] - center[1]))
            for place in vectors[1:]
        ]
        turned = sorted((angle - angles[0]) % 360.0 for angle in angles)
        even = [360.0 * n / len(turned) for n in range(len(turned))]
        apart = max(abs(a - b) for a, b in zip(turned, even, strict=True))
        return None if apart < MAX_UNEVEN_DEG else turned


def planetary_stage(gearbox: RexsGearbox) -> tuple[PlanetaryStage, list[str]]:
    """The planetary stage of a model, and a line for each that is left out.

    Raises InputError where none can be converted, with all reasons.
    """
    reasons: list[str] = []
    converted: list[PlanetaryStage] = []
    for component in gearbox.model.of_kind("planetary_stage"):
        try:
            converted.append(_planetary_stage_of(gearbox, component))
        except InputError as error:
            reasons.append(str(error))
    if not converted:
        raise InputError("; ".join(reasons) or "no planetary_stage")
    beyond = (f"{stage.component.label}: a second one" for stage in converted[1:])
    return converted[0], [*reasons, *beyond]


def _planetary_stage_of(gearbox: RexsGearbox, component: Component) -> PlanetaryStage:
    """InputError where it is no stage of a sun, equal planets and a ring."""
    parts = gearbox.parts("assembly", "assembly", component.number, "part")
    numbers = {part.number for part in parts}
    stages = [s for s in gearbox.all_stages if s.component.number in numbers]
    label = component.label
    with_ring = [stage for stage in stages if any(map(is_internal, stage.gears))]
    for stage in stages:
        if reason := rejection(stage, internal=stage in with_ring, planetary=True):
            raise InputError(f"{label}: {reason}")
    rings = {g.number: g for s in with_ring for g in s.gears if is_internal(g)}
    planets = {g.number: g for s in with_ring for g in s.gears if not is_internal(g)}
    inner = [stage for stage in stages if stage not in with_ring]
    suns = {g.number: g for s in inner for g in s.gears if g.number not in planets}
    if len(rings) != 1 or len(suns) != 1 or len(planets) < MIN_PLANETS:
        raise InputError(
            f"{label}: {len(suns)} sun, {len(planets)} planets and {len(rings)} ring; "
            "one sun, two planets or more and one ring are needed"
        )
    meshes = Counter(g.number for s in stages for g in s.gears if g.number in planets)
    if {*meshes.values()} != {2} or len(stages) != 2 * len(planets):
        raise InputError(f"{label}: a planet does not mesh once with sun and ring")
    _require_equal_planets(label, [*planets.values()])
    (sun,), (ring,) = suns.values(), rings.values()
    members = (*planets.values(),)
    return PlanetaryStage(gearbox, component, sun, members, ring, (*inner, *with_ring))


def _require_equal_planets(label: str, planets: list[Component]) -> None:
    first, *others = planets
    for other in others:
        for name in EQUAL_OF_PLANETS:
            one, two = (gear.attributes.get(name) for gear in (first, other))
            if (one and one.value) != (two and two.value):
                raise InputError(
                    f"{label}: {name} of {first.label} and {other.label} differ; equal "
                    "planets are needed"
                )
