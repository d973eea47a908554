"""Trains as studies solve them: gear set, model and load that settings ask for."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Self

from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.pitch_errors import pair_periods
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.given_tables import given_table_warnings, read_mesh_tables
from fegear.studies.problem import Problem
from fegear.studies.settings import (
    display_name,
    group_of,
    options_of,
    refuse_non_default,
)
from fegear.studies.table import Table
from fegear.studies.trains.driver_speed import with_driver_speed
from fegear.studies.trains.headings import title_of
from fegear.studies.trains.loads import chosen_torque
from fegear.studies.trains.model_texts import left_out_line, static_warnings
from fegear.studies.trains.models import EXCITATION
from fegear.studies.trains.train_study import TrainStudy
from fegear.train.model_settings import LumpedModel, has_rolling_bearings, resolve_model
from fegear.train.requirements import require_method, require_model
from fegear.train.rotating_frame import frame_warnings, left_out_warnings
from lumped.bearings.kinematics import ball_pass_over_shaft
from lumped.common.checks import require_present
from lumped.common.short_repr import ShortRepr
from lumped.steady.integration_settings import Settings
from lumped.train.bodies import TrainError
from lumped.train.rolling_supports import bearing_loads
from lumped.train.system import LumpedSystem

MODIFICATION_KEY = re.compile(r"_relief|[._]profile(\.|$)")
# Processor time of the coupled model [s], of a set-up by mesh and of a settled motion
# whose meshes repeat within so many periods, on a processor of 2021
SET_UP_S, MOTION_S, MOTION_PERIODS = 1.3, 0.07, 16
# beyond which a command says so before it starts, one without motions
LONG_DURATION_S, LONG_SET_UP_S = 60.0, 10.0
# Longer motion of bodies with many modes, which only the set-up finds; of trains with
# two shafts or more some have them
MORE_BODY_MODES = 10.0
STIFFNESS_KEYS = "mean_stiffness_N_per_m", "stiffness_variation", "load_share"
TRANSLATION_KEYS = {
    *("mass_kg", "bearing_kx_N_per_m", "bearing_ky_N_per_m"),
    *("ball_bearing", "roller_bearing"),
}
SETTING_OF_KEY = {
    "load.torques_Nm": "torque",
    "dynamics.damping_ratio": "damping_ratio",
}


@dataclass(frozen=True, eq=False)
class TrainFacts(ShortRepr):
    """What a result tells of its train.

    summary : first entries of the summary, None for what varies
    header : entries of files
    cycles_per_turn : mesh cycles per turn of the driver, None where they vary
    notes : lines of the page, such as what the model leaves out
    warnings : of the train and of what was computed
    """

    summary: Mapping[str, Any]
    header: Mapping[str, str]
    cycles_per_turn: float | None = None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def with_driver_speed(self, table: Table) -> Table:
        """A table of these gears with the driver's speed beside mesh frequencies."""
        return with_driver_speed(table, self.cycles_per_turn)

    @property
    def title(self) -> str:
        """Heading of pages and pictures."""
        return title_of(self.summary)


def _rounded_time(seconds: float) -> str:
    return f"{seconds / 60.0:.0f} min" if seconds >= 60.0 else f"{seconds:.0f} s"


@dataclass(frozen=True, eq=False)
class TrainProblem(Problem):
    """The train of a study.

    gears : gear set in which nothing is changed that the study does not read
    model : with mesh tables where they are given, its number chosen where it was auto
    reason : why the model was chosen, empty where it was given
    """

    study: Any
    gears: GearSet = field(kw_only=True)
    model: LumpedModel = field(kw_only=True)
    reason: str = field(kw_only=True)

    @classmethod
    def of(cls, study: TrainStudy) -> Self:
        """The problem of a study; InputError for what its gears do not take."""
        gears = edited_gears(study)
        integration = getattr(study, "integration", None)
        method = integration.method if isinstance(integration, Settings) else "rk4"
        model = _with_given_tables(study, gears)
        if not study.has_rolling and has_rolling_bearings(model, gears):
            model = replace(model, bearings="linear")
        model_1_reason = study.reason_for_model_1
        model, reason = resolve_model(model, gears, method, model_1_reason)
        problem = cls(study, gears=gears, model=model, reason=reason)
        for varied in problem.varied_models:
            require_model(gears, varied, varied.excitations)
            require_method(method, varied, gears)
        return problem

    @property
    def varied_models(self) -> tuple[LumpedModel, ...]:
        """Models that show what any point of the study would be refused for."""
        return (self.model,)

    @property
    def single_torque(self) -> float:
        """Torque on the input gear [N m]: as asked, or the middle load case."""
        return chosen_torque(self.gears, self.study.torque)

    @property
    def motions(self) -> float:
        """How many settled motions are computed, about."""
        return 1.0

    @property
    def set_ups(self) -> int:
        """How many trains are set up."""
        return 1

    @property
    def announcements(self) -> Iterator[str]:
        yield from super().announcements
        yield from self.duration()

    def duration(self, runs: int = 1, pitches: int = 1) -> Iterator[str]:
        """A line where the coupled model takes minutes.

        runs : as long as this one; pitches : after which teeth repeat at least
        """
        with suppress(InputError, TrainError):  # the tasks refuse it
            yield from self._duration_texts(runs, pitches)

    def _duration_texts(self, runs: int, pitches: int) -> Iterator[str]:
        if self.model.number != "coupled":
            return
        train = train_of(self.gears, 0.0, self.model.translations)
        periods = train.common_period[0] * max(*pair_periods(self.gears), pitches)
        periods_to_repeat = periods > MOTION_PERIODS
        motion = MOTION_S * max(1.0, periods / MOTION_PERIODS)
        set_up = SET_UP_S * len(self.gears.meshes)
        motions, set_ups = runs * self.motions, runs * self.set_ups
        least = motions * motion + set_ups * set_up
        most = least + (MORE_BODY_MODES - 1.0) * motions * motion * periods_to_repeat
        if most < (LONG_DURATION_S if motions else LONG_SET_UP_S):
            return
        task = f"{motions:.3g} motions"
        if periods_to_repeat:
            task += f" that repeat after {periods} periods of the first mesh"
        if not motions:
            meshes = len(self.gears.meshes)
            task = f"load curves of {meshes} meshes, solved {set_ups} times,"
        option = display_name(self.study, "number")
        times = " to ".join(dict.fromkeys(map(_rounded_time, (least, most))))
        yield (
            f"coupled model: {task} take about {times} of processor time; {option} 1 "
            "takes a tenth or less"
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Why the model was chosen, what it leaves out, and when faults come round."""
        lines = self.reason, left_out_line(self.model), *fault_notes(self.gears)
        return tuple(filter(None, lines))

    def summary_head(self, damping_ratio: float | None) -> dict[str, Any]:
        """First entries of a summary."""
        return {
            "gear_set": self.gears.name,
            "model": self.model.name,
            "model_reason": self.reason or None,
            "excitation": self.model.excitation.header_of(self.gears)["excitation"],
            "damping_ratio": damping_ratio,
            **fault_entries(self.gears),
        }

    def friction_entries(self) -> dict[str, Any]:
        """Summary entries on tooth friction; None without it."""
        model = self.model
        return {
            "friction_coefficient": model.friction,
            "sliding": model.sliding if model.friction else None,
            "torque_of": model.torque_of if model.friction else None,
            "translations": model.translations,
            "motion": model.motion,
        }

    def warnings_at_rest(
        self, systems: Mapping[float, LumpedSystem], speeds: Sequence[float] = ()
    ) -> Iterator[str]:
        """Warnings of the train at rest, and of the mesh tables that it is made from.

        systems : by torque on the input gear [N m]
        speeds : mesh frequencies [Hz], empty where they are not known
        """
        yield from motion_warnings(self.gears, self.model.motion == "space")
        for system in [*systems.values()][:1]:
            yield from frame_warnings(system.train)
            yield from left_out_warnings(system, speeds)
        for torque in systems:
            yield from given_table_warnings(self.model.excitation, self.gears, torque)
        yield from static_warnings(systems)


def fault_entries(gears: GearSet) -> dict[str, Any]:
    """Summary entry of gears with faults: base pitches until each mesh repeats."""
    if not any(gear.faults.any for gear in gears.gears):
        return {}
    return {"faults_repeat_pitches": list(pair_periods(gears))}


def fault_notes(gears: GearSet) -> Iterator[str]:
    """A line on how long faulty teeth take until they meet again."""
    periods = fault_entries(gears).get("faults_repeat_pitches", [])
    if periods:
        repeats = ", ".join(f"{n} of mesh {m}" for m, n in enumerate(periods, start=1))
        line = f"faulty teeth: tooth pairs repeat after base pitches: {repeats}"
        yield with_code("E29", line)


def system_notes(system: LumpedSystem) -> Iterator[str]:
    """Lines on shafts that are reduced, and on rolling bearings."""
    if system.space is not None:
        yield reduction_note(system)
        for number, place in enumerate(system.space.middles.tolist(), start=1):
            yield (
                f"mesh {number}: transmission error and moment are those at the mean "
                f"center of stiffness, {1e3 * place:+.3g} mm along the axis from the "
                "middle of the face width in contact"
            )
    yield from _bearing_notes(system)


def reduction_note(system: LumpedSystem) -> str:
    """What reduced shafts do to natural frequencies."""
    space = require_present(system.space, "motion in space")
    return with_code(
        "E32",
        f"shafts: {space.count} of {space.matrices.size} coordinates; natural "
        f"frequencies with a twentieth of their energy in teeth, "
        f"{space.strained_Hz.min():.4g} to {space.strained_Hz.max():.4g} Hz, change by "
        f"{100.0 * system.reduction_error:.2g} % at most",
    )


def _bearing_notes(system: LumpedSystem) -> Iterator[str]:
    """A line on each rolling bearing whose rolling elements carry the gear."""
    rolling = system.rolling
    if rolling is None:
        return
    loads = bearing_loads(system.train)
    for gear, bearing, rate in zip(
        rolling.gears, rolling.bearings, rolling.rates, strict=True
    ):
        part = system.train.gears[gear]
        along, across = part.bearing_stiffness or (math.nan, math.nan)
        passes = ball_pass_over_shaft(bearing) * abs(rate) / (2.0 * math.pi)
        yield with_code(
            "E24",
            f"{part.name} on {bearing.elements} {bearing.noun}s under "
            f"{math.hypot(*loads[gear]):.4g} N: {along:.4g} N/m along the load, "
            f"{across:.4g} N/m across; ball pass at {passes:.6g} of the mesh frequency",
        )


def edited_gears(study: TrainStudy) -> GearSet:
    """The gear set of a study; InputError for a change that it does not read."""
    model, source = study.model, study.model.excitation
    settings = {
        "torque": getattr(study, "torque", None),
        "damping_ratio": model.damping_ratio,
    }
    figures = (
        isinstance(source, ExcitationSettings)
        and source.kind != "fe"
        and not study.table
    )
    refuse_edits(study, settings, model.translations, figures, bool(study.table))
    return study.gear_set.loaded


def _with_given_tables(study: TrainStudy, gears: GearSet) -> LumpedModel:
    source = study.model.excitation
    if study.table:
        reason = f"{display_name(study, 'table')} replaces it, leave it out"
        if isinstance(source, ExcitationSettings):
            refuse_non_default(source, [*EXCITATION.exposed], reason, EXCITATION)
        try:
            return replace(study.model, excitation=read_mesh_tables(study.table, gears))
        except InputError as error:
            raise InputError(f"{display_name(study, 'table')}: {error}") from None
    if isinstance(source, ExcitationSettings) and not source.solves_elements(gears):
        reason = "the gear set gives all stiffness parameters, nothing is solved"
        refuse_non_default(source, ("plane", "resolution"), reason, EXCITATION)
    return study.model


def refuse_edits(
    study: Any,
    settings: Mapping[str, Any],
    translations: bool,
    figures: bool = False,
    tables: bool = False,
) -> None:
    """Refuse changes of the gear set that are fixed by a setting, or not read.

    settings : of the study, those that are stronger than keys, by name
    translations : whether gears move on their bearings
    figures : whether key figures of the mesh stiffness are read
    tables : whether mesh tables are given
    """
    options = options_of(group_of(study))
    for key in study.gear_set.overrides:
        name, replaced = key.rpartition(".")[2], SETTING_OF_KEY.get(key, "")
        reason = ""
        if settings.get(replaced) not in (None, ()):
            reason = f"{display_name(study, replaced)} replaces it"
        elif name in STIFFNESS_KEYS and not figures:
            reason = "finite elements or a table take its place, leave it out"
            if "kind" in options:
                reason += f" or choose another {display_name(study, 'kind')}"
        elif _is_of_translations(key) and not translations:
            reason = "changes nothing here"
            if "translations" in options:
                reason = (
                    f"changes nothing without {display_name(study, 'translations')}"
                )
        elif tables and MODIFICATION_KEY.search(key):
            reason = f"{display_name(study, 'table')} has the teeth with their relief"
        if reason:
            raise study.gear_set.rejection(key, reason)


def _is_of_translations(key: str) -> bool:
    """Whether a key is read where gears move; bearings of shafts are others."""
    table, *rest = key.split(".")
    return table != "shaft" and not TRANSLATION_KEYS.isdisjoint((table, *rest))


def bodies_described(entries: Mapping[str, str]) -> dict[str, str | None]:
    """Summary entries on body modes, from `body_entries`."""
    names = "body modes", "body modes left out"
    return {name.replace(" ", "_"): entries.get(name) for name in names}
