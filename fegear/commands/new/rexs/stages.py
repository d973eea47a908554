"""Stages of a REXS model: which are of spur gears, and which gear drives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from fegear.commands.new.rexs.components import Component, RexsModel
from fegear.files.errors import InputError

HELIX = ("helix_angle_reference_diameter", "helix_angle")
MAX_HELIX_DEG = 1e-6  # of a gear that is called spur


@dataclass(frozen=True)
class Stage:
    """Two gears in mesh; first drives once the power path is known."""

    component: Component
    first: Component
    second: Component

    @property
    def gears(self) -> tuple[Component, Component]:
        return self.first, self.second

    def reversed(self) -> Stage:
        return replace(self, first=self.second, second=self.first)


@dataclass(frozen=True)
class SpurStages:
    """Spur stages that power reaches from the input, driver first.

    input_axis : see `RexsGearbox.axis_of`; rule : how the input was chosen
    left_out : a line for each stage that is not among them
    """

    stages: tuple[Stage, ...]
    input_axis: int
    rule: str
    left_out: tuple[str, ...]

    @property
    def gears(self) -> list[Component]:
        """The gears, once each, in the order of the stages."""
        return list({g.number: g for s in self.stages for g in s.gears}.values())


@dataclass(frozen=True)
class RexsGearbox:
    """A REXS model, and what its relations say about gears, shafts and flanks."""

    model: RexsModel

    def parts(self, kind: str, role: str, number: int, other: str) -> list[Component]:
        """Components that are related to one, see `RexsModel.related`."""
        numbers = self.model.related(kind, role, number, other)
        return [self.model.components[n] for n in numbers]

    def shaft_of(self, gear: Component) -> Component | None:
        owners = self.parts("assembly", "part", gear.number, "assembly")
        return next((item for item in owners if item.kind == "shaft"), None)

    def axis_of(self, gear: Component) -> int:
        """Number of the shaft of a gear, or of the gear where it has none."""
        return (self.shaft_of(gear) or gear).number

    def loads_of(self, shaft: int) -> list[Component]:
        parts = self.parts("assembly", "assembly", shaft, "part")
        return [item for item in parts if item.kind == "external_load"]

    @cached_property
    def spur_stages(self) -> SpurStages:
        """InputError where there is none, with the reason of each stage."""
        stages = self.all_stages
        reasons = self._rejections(stages)
        spur = [s for s in stages if s.component.number not in reasons]
        if not spur:
            raise InputError(
                f"no stage of external gears: {'; '.join(reasons.values())}"
            )
        axis, rule = self._input_axis(spur)
        reached = self._stages_from_driver(spur, axis)
        numbers = {stage.component.number for stage in reached}
        beyond = [
            f"{stage.component.label}: not connected with the input by spur stages"
            for stage in spur
            if stage.component.number not in numbers
        ]
        return SpurStages(tuple(reached), axis, rule, (*reasons.values(), *beyond))

    @cached_property
    def all_stages(self) -> list[Stage]:
        """All pairs of gears that the model has, of any kind."""
        stages = []
        for relation in self.model.relations:
            if relation.kind != "stage":
                continue
            numbers = [relation.role(role) for role in ("stage", "gear_1", "gear_2")]
            if None in numbers:
                raise InputError(
                    f"relation {relation.number} of type stage: needs the roles stage, "
                    "gear_1 and gear_2"
                )
            stage, *gears = (self.model.components[n] for n in numbers if n is not None)
            if gears[0] is gears[1]:
                raise InputError(f"{stage.label}: gear_1 and gear_2 are the same")
            stages.append(Stage(stage, *gears))
        if not stages:
            raise InputError("no stage: a relation of type stage is needed")
        if len({stage.component.number for stage in stages}) < len(stages):
            raise InputError("a stage is in two relations of type stage")
        return stages

    def _rejections(self, stages: Iterable[Stage]) -> dict[int, str]:
        """Why stages are left out, by number."""
        reasons = {
            stage.component.number: reason
            for stage in stages
            if (reason := rejection(stage))
        }
        planets = {
            gear.number
            for stage in stages
            if any(is_internal(gear) for gear in stage.gears)
            for gear in stage.gears
        }
        for stage in stages:
            planet = next((g for g in stage.gears if g.number in planets), None)
            if planet and stage.component.number not in reasons:
                reasons[stage.component.number] = (
                    f"{stage.component.label}: {planet.label} also meshes with an "
                    "internal gear"
                )
        return reasons

    def _input_axis(self, stages: list[Stage]) -> tuple[int, str]:
        """Axis of the input, and how it was found."""
        axes = list(dict.fromkeys(self.axis_of(g) for s in stages for g in s.gears))
        shafts = [axis for axis in axes if self.model.components[axis].kind == "shaft"]
        drivers = [gear for stage in stages if (gear := self._flagged_driver(stage))]
        driven = {
            self.axis_of(gear)
            for stage in stages
            if (driver := self._flagged_driver(stage))
            for gear in stage.gears
            if gear is not driver
        }
        for gear in drivers:
            if self.axis_of(gear) not in driven:
                return self.axis_of(gear), f"is_driving_gear of {gear.label}"
        for axis in shafts:
            shaft = self.model.components[axis]
            if shaft.truth("defines_speed"):
                return axis, f"defines_speed of {shaft.label}"
        for axis in shafts:
            for load in self.loads_of(axis):
                if load.truth("defines_torque"):
                    return axis, f"defines_torque of {load.label}"
        return self.axis_of(stages[0].first), f"gear_1 of {stages[0].component.label}"

    def _flagged_driver(self, stage: Stage) -> Component | None:
        """The gear whose stage data call it the driving one."""
        for gear in stage.gears:
            for relation in self.model.relations:
                data = relation.role("stage_gear_data")
                if (
                    relation.role("stage") == stage.component.number
                    and relation.role("gear") == gear.number
                    and data is not None
                    and self.model.components[data].truth("is_driving_gear")
                ):
                    return gear
        return None

    def _stages_from_driver(self, stages: list[Stage], axis: int) -> list[Stage]:
        """Stages that are connected with an axis, each away from it, nearest first."""
        reached, order, waiting = {axis}, [], list(stages)
        while waiting:
            step = next(
                (s for s in waiting if self._stages_at_reached(s, reached)), None
            )
            if step is None:
                break
            waiting.remove(step)
            away = step if self.axis_of(step.first) in reached else step.reversed()
            reached |= {self.axis_of(gear) for gear in step.gears}
            order.append(away)
        return order

    def _stages_at_reached(self, stage: Stage, reached: set[int]) -> bool:
        return any(self.axis_of(gear) in reached for gear in stage.gears)


def is_internal(gear: Component) -> bool:
    if gear.kind == "ring_gear":
        return True
    return (gear.quantity("number_of_teeth", "ratio") or 0.0) < 0.0


def rejection(stage: Stage, internal: bool = False, planetary: bool = False) -> str:
    """Why a stage is left out, or nothing.

    internal : whether an internal gear is allowed
    planetary : whether it is part of a planetary set, which is of spur gears
    """
    label = stage.component.label
    if stage.component.kind != "cylindrical_stage":
        return f"{label}: not a cylindrical_stage"
    for gear in stage.gears:
        if is_internal(gear) and not internal:
            return f"{label}: {gear.label} is an internal gear"
        if gear.kind not in ("cylindrical_gear", "ring_gear"):
            return f"{label}: {gear.label} is not a cylindrical_gear"
    return _helix_rejection(stage, planetary)


def _helix_rejection(stage: Stage, planetary: bool) -> str:
    """Why helices do not fit, or nothing; planetary : as of `rejection`."""
    label, angles = stage.component.label, [0.0]
    for part in (*stage.gears, stage.component):
        for name in HELIX:
            angle = part.quantity(name, "angle")
            if angle is None:
                continue
            if planetary and abs(angle) > MAX_HELIX_DEG:
                return (
                    f"{label}: {name} of {part.label} is {angle:g} deg; only spur "
                    "gears, 0 deg"
                )
            angles.append(abs(angle))
    most = max(angles)
    for gear in stage.gears:
        angle = helix_angle(gear, stage.component)
        if abs(abs(angle) - most) > MAX_HELIX_DEG:
            return (
                f"{label}: helix angle of {gear.label} is {angle:g} deg; must be "
                f"{most:g}"
            )
    return ""


def helix_angle(gear: Component, stage: Component | None = None) -> float:
    """Helix angle of a gear [deg], right-handed positive; that of its stage if none."""
    for part in (gear, stage):
        for name in HELIX if part is not None else ():
            angle = part.quantity(name, "angle") if part is not None else None
            if angle is not None:
                return angle
    return 0.0


def ratios_from_input(
    gearbox: RexsGearbox, stages: Iterable[Stage]
) -> Mapping[int, float]:
    """Torque on each axis per torque on the input, by the numbers of teeth."""
    spur = gearbox.spur_stages
    ratios = {spur.input_axis: 1.0}
    for stage in stages:
        teeth = [gear.require_integer("number_of_teeth") for gear in stage.gears]
        driver, driven = map(gearbox.axis_of, stage.gears)
        if teeth[0] and driver in ratios:
            ratios.setdefault(driven, ratios[driver] * teeth[1] / teeth[0])
    return ratios
