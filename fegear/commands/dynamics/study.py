"""Vibration of a gear set's finite elements over speed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

from fegear.dynamics.build import FiniteElements, StepperChoice, prepare
from fegear.dynamics.checkpoint import StoredBranch
from fegear.dynamics.history import format_history, history_name, history_table
from fegear.dynamics.stepper import DynamicSettings, FeHistory, steps_per_cycle
from fegear.elasticity.cache import cached_root_influence
from fegear.elasticity.root_stress import RootInfluence
from fegear.files.errors import InputError
from fegear.files.output import make_directory, write_text
from fegear.gearset.leads import require_uniform_loads
from fegear.gearset.model import GearSet
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.speeds import cycles_per_turn
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import nearer_plane
from fegear.studies.page import Page
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.settings import (
    Setting,
    SettingsGroup,
    display_name,
    expose,
    group,
    setting,
    setting_of,
)
from fegear.studies.study import Study
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import chosen_torques, torques_setting
from fegear.studies.trains.model_texts import (
    cap_in_words,
    file_header,
    natural_in_words,
    torque_entry,
)
from fegear.studies.trains.models import SETTLING
from fegear.studies.trains.responses import ResponsesResult, sweep_warnings
from fegear.studies.trains.speeds import with_frequencies
from fegear.studies.trains.swept_speeds import SweptSpeeds, unbegun_branch
from fegear.studies.trains.train_problem import (
    TrainFacts,
    fault_entries,
    fault_notes,
    refuse_edits,
)
from fegear.train.loaded_modes import system_of_modes
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel, TorqueOf
from fegear.train.resonances import default_speeds, natural_frequencies
from fegear.train.rotating_frame import frame_warnings, left_out_warnings
from lumped.common.csv_text import format_exact
from lumped.steady.sweep import (
    Branch,
    Direction,
    reporting_observer,
    sweep,
    sweep_branch,
)
from lumped.train.system import LumpedSystem

DERIVED_SETTINGS = "elastic freedoms"  # of a header, from the gear set and the speeds


def _settings_without_effect(elements: FiniteElements) -> Iterator[tuple[str, str]]:
    if elements.fidelity == "quasistatic":
        for name in ("elastic_damping", "cutoff_Hz"):
            yield name, "{fidelity} quasistatic has no elastic modes"
    if elements.fidelity == "full":
        yield "cutoff_Hz", "{fidelity} full keeps all elastic modes"


ELEMENTS = SettingsGroup(
    kind=FiniteElements,
    unused_options=_settings_without_effect,
    exposed=expose(
        *("fidelity", "friction", "elastic_damping", "cutoff_Hz"),
        cutoff_Hz=Setting(option="--cutoff"),
    ),
)
INTEGRATION = SettingsGroup(kind=DynamicSettings, exposed=expose(*SETTLING, "steps"))


@dataclass(frozen=True, kw_only=True)
class Dynamics(
    SweptSpeeds,
    Study,
    command="dynamics",
    example="dynamics liu-idler --torque 100 --speeds 800:4200:20 -o d.csv",
):
    """Vibration of finite-element gears over speed.

    The CSV columns are those of `fegear sweep`. With --output each finished speed is
    stored in FILE.partial until the file is written; --resume continues from there.
    """

    resumes = True
    partial = True

    gear_set: GearSetRef
    torque: tuple[float, ...] = torques_setting()
    elements: FiniteElements = group(ELEMENTS)
    torque_of: TorqueOf = setting_of(LumpedModel, "torque_of")
    damping_ratio: float | None = setting_of(LumpedModel, "damping_ratio")
    translations: bool = setting_of(
        LumpedModel, "translations", option="--translations"
    )
    excitation: ExcitationSettings = group(
        SettingsGroup(kind=ExcitationSettings, exposed=expose("plane", "resolution"))
    )
    integration: DynamicSettings = group(INTEGRATION)
    model_1: bool = setting(
        False, "Also run lumped model 1 and show both results.", option="--model-1"
    )
    history: str | None = setting(
        None,
        "Write a CSV file for each speed into this directory: load and contact "
        "pressure of every tooth pair and motion of the hubs over one period.",
        metavar="DIR",
    )
    root_stress: str | None = setting(
        None,
        "Add the root stress of this gear's teeth to the files of --history.",
        metavar="GEAR",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.root_stress is not None and self.history is None:
            names = display_name(self, "root_stress"), display_name(self, "history")
            raise InputError(f"{names[0]} needs {names[1]}")
        if self.torque_of == "input" and not self.elements.friction:
            friction_name = display_name(self, "friction")
            raise InputError(f"torque_of = input; needs {friction_name} above 0")

    @property
    def reference(self) -> LumpedModel:
        """The lumped model 1, whose modes and tables the finite elements share."""
        return LumpedModel(
            number=1,
            translations=self.translations,
            bearings="linear",
            damping_ratio=self.damping_ratio,
            excitation=self.excitation,
        )

    def prepare(self) -> DynamicsProblem:
        settings = {"torque": self.torque, "damping_ratio": self.damping_ratio}
        refuse_edits(self, settings, self.translations)
        require_uniform_loads(self.gear_set.loaded, "motions by finite elements")
        study = with_frequencies(self, {"speeds": self.rpm})
        return DynamicsProblem(study, self.gear_set.loaded)


@dataclass(frozen=True, eq=False)
class DynamicsProblem(Problem):
    """Gears as finite elements, and the lumped model 1 of the same train."""

    study: Dynamics
    gears: GearSet

    @cached_property
    def excitations(self) -> Excitations:
        return Excitations(self.study.excitation)

    @cached_property
    def systems(self) -> dict[float, LumpedSystem]:
        """The lumped model 1 at each torque on the input gear [N m]."""
        arguments = self.study.reference, self.excitations
        return {
            torque: lumped_system(self.gears, torque, *arguments)
            for torque in chosen_torques(self.gears, self.study.torque)
        }

    @cached_property
    def frequencies(self) -> list[float]:
        """Mesh frequencies of the first mesh [Hz]."""
        system = next(iter(self.systems.values()))
        return list(self.study.speeds) or default_speeds(system)

    @cached_property
    def natural_system(self) -> LumpedSystem:
        """The system whose natural frequencies are shown, at the first torque."""
        torque = next(iter(self.systems))
        return system_of_modes(self.gears, torque, self.study.reference)[0]

    def under_friction(self, torque: float) -> LumpedSystem:
        """The lumped model 1 under the torques that the finite elements have."""
        study, system = self.study, self.systems[torque]
        if study.torque_of == "nominal":
            return system
        friction, of = study.elements.friction, study.torque_of
        model = replace(study.reference, friction=friction, torque_of=of)
        friction_system = lumped_system(self.gears, torque, model, self.excitations)
        return replace(
            system, train=friction_system.train, losses=friction_system.losses
        )

    @cached_property
    def prepared(self) -> dict[float, StepperChoice]:
        """A stepper for every torque, all of the same fidelity."""
        elements = self.study.elements
        choices = self._stepper_choices(elements)
        if len({choice.fidelity for choice in choices.values()}) > 1:
            choices = self._stepper_choices(replace(elements, fidelity="reduced"))
        return choices

    def _stepper_choices(self, elements: FiniteElements) -> dict[float, StepperChoice]:
        integration = self.study.integration
        arguments = self.frequencies, elements, integration, self.excitations
        return {
            torque: prepare(self.gears, torque, self.under_friction(torque), *arguments)
            for torque in self.systems
        }

    @property
    def _planes_of_bodies(self) -> dict[str, str]:
        """Plane states of elastic bodies, where tables are of teeth of their width."""
        if self.study.excitation.statics.plane_of(self.gears) != "width":
            return {}
        planes = (f"{g.name} plane {nearer_plane(g)}" for g in self.gears.gears)
        return {"elastic bodies": ", ".join(planes)}

    @cached_property
    def header(self) -> dict[str, str]:
        """Entries of every file."""
        study, choices = self.study, list(self.prepared.values())
        steps = study.integration
        method = (
            f"generalised-alpha, {steps.steps} steps per period or more, tolerance "
            f"{format_exact(steps.tolerance)}, up to {cap_in_words(steps.max_periods)}"
        )
        mode_counts = "; ".join(
            " + ".join(map(str, choice.elastic)) or "0" for choice in choices
        )
        return {
            **file_header(self.gears, study.reference, self._damping_in_words, method),
            **self._planes_of_bodies,
            "fidelity": choices[0].fidelity,
            DERIVED_SETTINGS: mode_counts,
            "elastic damping ratio": format_exact(study.elements.elastic_damping),
            "friction coefficient": format_exact(study.elements.friction),
            **torque_entry(study.torque_of),
            **study.gear_set.entries,
        }

    @property
    def _damping_in_words(self) -> float:
        return next(iter(self.systems.values())).train.damping_ratio

    @property
    def inputs(self) -> Mapping[str, str]:
        # what is derived comes last, so that a message names what was asked for
        return {**super().inputs, DERIVED_SETTINGS: self.header[DERIVED_SETTINGS]}

    def tasks(self) -> Iterator[Task]:
        roots = self._root_influences()
        size = len(self.frequencies)
        study = self.study
        if study.history is not None:
            make_directory(Path(study.history))
        for torque in self.systems:
            for direction in study.directions:
                work = partial(self._sweep_speeds, torque, direction, roots)
                yield Task(f"{torque!r}-{direction}", work, size)
        if study.model_1:
            for torque, system in self.systems.items():
                for direction in study.directions:
                    work = partial(self._sweep_model_1, system, direction)
                    yield Task(f"model 1 {torque!r}-{direction}", work, size)

    def _sweep_speeds(
        self,
        torque: float,
        direction: Direction,
        roots: dict[int, RootInfluence],
        job: Job,
    ) -> Branch:
        return sweep_branch(
            self.prepared[torque].stepper,
            self.frequencies,
            direction,
            self.study.integration,
            store=StoredBranch(job),
            store_motion=partial(self._write_time_history, torque, direction, roots),
            observer=reporting_observer(job.report, len(self.frequencies)),
            stop=job.stop,
        )

    def _sweep_model_1(
        self, system: LumpedSystem, direction: Direction, job: Job
    ) -> Branch:
        observer = reporting_observer(job.report, len(self.frequencies))
        arguments = system, self.frequencies, direction
        return sweep(*arguments, observer=observer, stop=job.stop)

    def _write_time_history(
        self,
        torque: float,
        direction: Direction,
        roots: dict[int, RootInfluence],
        frequency: float,
        motion: FeHistory,
    ) -> None:
        """Write the motion of a speed as a file of the directory, if there is one."""
        directory = self.study.history
        if directory is None:
            return
        model = self.prepared[torque].stepper.model
        entries = self.header | {
            "torque_Nm": format_exact(torque),
            "direction": direction,
            "mesh_frequency_Hz": format_exact(frequency),
        }
        steps = steps_per_cycle(model, frequency, self.study.integration)
        text = format_history(history_table(model, motion, steps, entries, roots))
        write_text(Path(directory) / history_name(torque, direction, frequency), text)

    def _root_influences(self) -> dict[int, RootInfluence]:
        gear_name = self.study.root_stress
        if gear_name is None:
            return {}
        names = [gear.name for gear in self.gears.gears]
        if gear_name not in names:
            raise InputError(
                f"root_stress = {gear_name}; allowed are {', '.join(names)}"
            )
        place, statics = names.index(gear_name), self.study.excitation.statics
        gear = self.gears.gears[place]
        arguments = gear.geometry, statics.material(gear), statics.size
        return {place: cached_root_influence(*arguments)}

    def _frame_warnings(self) -> Iterator[str]:
        """Lines on what is left out of the rotation of a carrier."""
        system = next(iter(self.systems.values()))
        yield from frame_warnings(system.train)
        subject = "finite elements in motion leave"
        yield from left_out_warnings(system, self.frequencies, subject)

    def gather(self, results: Mapping[str, Branch | None]) -> DynamicsResult:
        def branches(prefix: str) -> list[tuple[float, Branch]]:
            return [
                (
                    torque,
                    results[f"{prefix}{torque!r}-{direction}"]
                    or unbegun_branch(system, direction),
                )
                for torque, system in self.systems.items()
                for direction in study.directions
            ]

        study, friction = self.study, self.study.elements.friction
        by_elements = branches("")
        model_1_branches = branches("model 1 ") if study.model_1 else []
        return DynamicsResult(
            study=study,
            facts=TrainFacts(
                summary={
                    "gear_set": self.gears.name,
                    "model": self.header["fidelity"],
                    "excitation": self.header["excitation"],
                    "damping_ratio": self._damping_in_words,
                    "friction_coefficient": friction,
                    "sliding": None,
                    "torque_of": study.torque_of if friction else None,
                    "translations": study.translations,
                    "body_modes": None,
                    "body_modes_left_out": None,
                    **fault_entries(self.gears),
                },
                header=self.header,
                cycles_per_turn=cycles_per_turn(self.gears),
                notes=tuple(fault_notes(self.gears)),
                warnings=(
                    *motion_warnings(self.gears),
                    *self._frame_warnings(),
                    *sweep_warnings(self.gears, (*by_elements, *model_1_branches)),
                ),
            ),
            frequencies=self.frequencies,
            natural_Hz=tuple(natural_frequencies(self.natural_system)),
            natural=natural_in_words(self.natural_system, next(iter(self.systems))),
            branches=by_elements,
            beside=model_1_branches,
            reasons=tuple(
                (torque, choice.reason) for torque, choice in self.prepared.items()
            ),
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class DynamicsResult(ResponsesResult):
    """Branches of the finite elements.

    reasons : for the fidelity at each torque [N m], sentences that begin with it
    """

    reasons: tuple[tuple[float, str], ...] = ()

    def page(self) -> Page:
        for torque, reason in self.reasons:
            yield f"{torque:g} N m, {reason}"
        yield from super().page()
