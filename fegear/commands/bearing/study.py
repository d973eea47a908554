"""Load on the rolling elements of a bearing, its stiffness, ball-pass frequencies."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fegear.commands.bearing.figure import draw_bearing
from fegear.commands.bearing.file import NamedBearing, bearing_of
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.gearset.axial_forces import axial_force_text, shaft_axial_force
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.read import load_tables
from fegear.studies.page import Page
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import display_name, refusal, setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import chosen_torque, torque_setting
from fegear.studies.trains.train_problem import refuse_edits
from lumped.bearings.kinematics import (
    ball_pass_over_shaft,
    cage_over_shaft,
    element_spin_over_shaft,
    inner_ball_pass_over_shaft,
)
from lumped.bearings.load_integral import max_element_load
from lumped.bearings.rolling import RollingBearing
from lumped.bearings.statics import MIN_LOAD, load_distribution, mean_support
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.common.options import Range
from lumped.train.rolling_supports import bearing_loads

LOADS = 25  # of the table of stiffness over load
LOAD_DECADES = 1.0  # of these loads, to both sides of the load


@dataclass(frozen=True, kw_only=True)
class BearingLoad(
    Study,
    command="bearing",
    example="bearing pair.toml --gear pinion --load 1000 --plot bearing.png",
):
    """Load on a bearing's balls or rollers, and its stiffness.

    Ball and roller bearings under a radial load, with clearance: that of a gear, or the
    one of a bearing file, which has a table `ball_bearing` or `roller_bearing` alone.
    """

    more_tables = {  # noqa: RUF012  declared as in the base class
        "over_load": "Write stiffness and largest load on an element over the load to "
        "this CSV file."
    }

    gear_set: GearSetRef
    gear_name: str = setting(
        "",
        "Name of the gear. [default: the first one with a rolling bearing]",
        option="--gear",
    )
    load: float | None = setting(
        None,
        "Radial load [N]. [default: that of the torque on the gear set]",
        Range(MIN_LOAD, 1e9),
    )
    torque: float | None = torque_setting()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.load is not None and self.torque is not None:
            raise refusal(self, "torque", "{load} replaces it, leave it out")

    @property
    def alone(self) -> NamedBearing | None:
        """The bearing of a bearing file, None where there is a gear set."""
        reference = self.gear_set
        if reference.preloaded is not None:
            return None
        return bearing_of(
            load_tables(reference.name, {}), reference.overrides, reference.name
        )

    @property
    def announcements(self) -> Iterable[str]:
        return () if self.alone else super().announcements

    @property
    def gears(self) -> GearSet:
        """The gear set with its edits."""
        refuse_edits(self, {"torque": self.torque}, translations=True)
        return self.gear_set.healthy("loads of bearings")

    @property
    def index(self) -> int:
        """Index of the gear; InputError where it has no rolling bearing."""
        gears = self.gears.gears
        with_bearing = [i for i, gear in enumerate(gears) if gear.rolling_bearing]
        names = [gears[i].name for i in with_bearing]
        if not names:
            raise InputError(
                f"{self.gears.name}: no gear has a ball_bearing or roller_bearing"
            )
        if not self.gear_name:
            return with_bearing[0]
        if self.gear_name not in names:
            shown = display_name(self, "gear_name")
            raise InputError(
                f"{shown} = {self.gear_name}; allowed are those with a ball_bearing or "
                f"roller_bearing: {', '.join(names)}"
            )
        return with_bearing[names.index(self.gear_name)]

    def tasks(self) -> Iterator[Task]:
        yield Task("bearing", self._solve_alone if self.alone else self._solve)

    def _solve_alone(self, job: Job) -> BearingLoadResult:
        name, bearing = require_present(self.alone, "bearing")
        for unused in ("gear_name", "torque"):
            if getattr(self, unused):
                raise refusal(self, unused, f"{name} has no gears, leave it out")
        if self.load is None:
            shown = display_name(self, "load")
            raise InputError(f"{shown} is missing; a bearing without gears needs it")
        return solve_bearing(self, {"bearing": name}, bearing, self.load, 0.0, ())

    def _solve(self, job: Job) -> BearingLoadResult:
        gears, index = self.gears, self.index
        bearing = require_present(gears.gears[index].rolling_bearing, "bearing")
        direction, load = 0.0, self.load
        if load is None:
            torque = chosen_torque(gears, self.torque)
            along_x, along_y = bearing_loads(train_of(gears, torque, True))[index]
            load = math.hypot(along_x, along_y)
            direction = math.atan2(along_y, along_x)
        names_of_bearing = {"gear_set": gears.name, "gear": gears.gears[index].name}
        warnings = tuple(self._thrust_warnings(gears, index))
        return solve_bearing(self, names_of_bearing, bearing, load, direction, warnings)

    def _thrust_warnings(self, gears: GearSet, index: int) -> Iterator[str]:
        """A line where the gears of a shaft are pushed along their axis."""
        if not any(gears.gears[gear].geometry.twist for gear in gears.axis(index)):
            return
        name = gears.gears[index].name
        text = f"{name} has helical teeth, or its shaft has"
        if self.load is None:
            force = shaft_axial_force(gears, index, chosen_torque(gears, self.torque))
            text = f"axial force on the shaft of {name}: {axial_force_text(force)}"
        yield with_code("W60", f"{text}; rolling elements carry the radial load alone")


def solve_bearing(
    study: BearingLoad,
    names_of_bearing: dict[str, str],
    bearing: RollingBearing,
    load: float,
    direction: float,
    warnings: tuple[str, ...],
) -> BearingLoadResult:
    """Load distribution with an element under the load, and figures over the load.

    names_of_bearing : what the bearing is of, or its name, for the summary; the last
        names it
    load : radial [N]; direction : of it, counter-clockwise from x [rad]
    warnings : of what the load leaves out
    """
    name = [*names_of_bearing.values()][-1]
    force = load * math.cos(direction), load * math.sin(direction)
    state = load_distribution(bearing, force, cage_angle=direction)
    loads = load * np.logspace(-LOAD_DECADES, LOAD_DECADES, LOADS)
    supports = [mean_support(bearing, value) for value in loads.tolist()]
    support = mean_support(bearing, load)
    pressures = bearing.pressures(support.max_load)
    summary = {
        **names_of_bearing,
        "kind": f"{bearing.noun} bearing",
        f"{bearing.noun}s": bearing.elements,
        "load_N": load,
        "load_direction_deg": math.degrees(direction),
        "contact_stiffness_N_per_m_n": bearing.coefficient,
        "exponent": bearing.exponent,
        "max_element_load_N": support.max_load,
        "max_element_load_by_integral_N": max_element_load(bearing, load),
        "loaded_elements": int((state.loads > 0.0).sum()),
        "max_pressure_MPa": 1e-6 * max(pressures),
        "displacement_um": 1e6 * support.displacement,
        "stiffness_N_per_m": support.along,
        "transverse_stiffness_N_per_m": support.across,
        "stiffness_variation": support.variation,
        "cage_over_shaft": cage_over_shaft(bearing),
        "ball_pass_frequency_over_shaft": ball_pass_over_shaft(bearing),
        "inner_ball_pass_frequency_over_shaft": inner_ball_pass_over_shaft(bearing),
        "element_spin_over_shaft": element_spin_over_shaft(bearing),
        "warnings": [*warnings, *_pressure_warnings(name, bearing, max(pressures))],
    }
    return BearingLoadResult(
        study=study,
        summary=summary,
        distribution={
            "element": np.arange(1.0, bearing.elements + 1.0),
            "angle_deg": np.degrees(np.mod(state.angles, 2.0 * math.pi)),
            "approach_um": 1e6 * state.approaches,
            "load_N": state.loads,
        },
        over_load={
            "load_N": loads,
            "displacement_um": 1e6
            * np.array([support.displacement for support in supports]),
            "stiffness_N_per_m": np.array([support.along for support in supports]),
            "transverse_stiffness_N_per_m": np.array(
                [support.across for support in supports]
            ),
            "stiffness_variation": np.array(
                [support.variation for support in supports]
            ),
            "max_element_load_N": np.array([support.max_load for support in supports]),
        },
    )


def _pressure_warnings(
    name: str, bearing: RollingBearing, pressure: float
) -> Iterator[str]:
    if bearing.contact_stiffness is None and pressure > bearing.max_pressure:
        yield with_code(
            "W33",
            f"bearing of {name}: contact pressure {1e-6 * pressure:.0f} MPa, above "
            f"{1e-6 * bearing.max_pressure:.0f} MPa of a static load rating",
        )


@dataclass(frozen=True, eq=False)
class BearingLoadResult(StudyResult):
    """A bearing under a radial load.

    distribution : columns of the rolling elements, one of them under the load
    over_load : columns over the load
    """

    study: BearingLoad
    summary: dict[str, Any]
    distribution: dict[str, Array]
    over_load: dict[str, Array]

    @cached_property
    def header(self) -> dict[str, str]:
        """Entries above the tables."""
        names = "gear_set", "gear", "bearing", "kind", "load_N"
        shown = [name for name in names if name in self.summary]
        return {
            name.replace("gear_set", "gear set"): str(self.summary[name])
            for name in shown
        }

    @property
    def _title_name(self) -> str:
        """Name of the bearing alone, or of its gear."""
        name: str = self.summary.get("bearing") or self.summary["gear"]
        return name

    @property
    def table(self) -> Table:
        """A row for each rolling element."""
        header = {**self.header, **self.study.gear_set.entries}
        return Table.of(self.distribution, header)

    @property
    def more_tables(self) -> dict[str, Table]:
        """Stiffness over the load."""
        header = {**self.header, **self.study.gear_set.entries}
        return {"over_load": Table.of(self.over_load, header)}

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._draw}

    def _draw(self) -> Any:
        values = self.summary
        title = f"{self._title_name}: {values['kind']} under {values['load_N']:.5g} N"
        return draw_bearing(self.distribution, self.over_load, values["load_N"], title)

    def page(self) -> Page:
        v = self.summary
        set_text = f" of {v['gear_set']}" if "gear_set" in v else ""
        yield (
            f"{self._title_name}{set_text}: {v['kind']} under {v['load_N']:.5g} N, "
            f"{v['contact_stiffness_N_per_m_n']:.4g} N/m^n with n = {v['exponent']:.4g}"
        )
        yield (
            f"largest load on an element {v['max_element_load_N']:.5g} N (by load "
            f"integral {v['max_element_load_by_integral_N']:.5g} N), "
            f"{v['max_pressure_MPa']:.0f} MPa; {v['loaded_elements']} loaded"
        )
        yield (
            f"displacement {v['displacement_um']:.4g} um; stiffness "
            f"{v['stiffness_N_per_m']:.4g} N/m along the load, "
            f"{v['transverse_stiffness_N_per_m']:.4g} N/m across; it varies by "
            f"{100.0 * v['stiffness_variation']:.3g} % as elements pass"
        )
        yield (
            "over the rotation of the shaft: cage "
            f"{v['cage_over_shaft']:.5g}, ball pass {_ball_pass_text(v)}, "
            f"spin {v['element_spin_over_shaft']:.5g}"
        )


def _ball_pass_text(values: dict[str, Any]) -> str:
    outer = values["ball_pass_frequency_over_shaft"]
    inner = values["inner_ball_pass_frequency_over_shaft"]
    return f"{outer:.6g} of the outer race, {inner:.6g} of the inner race"
