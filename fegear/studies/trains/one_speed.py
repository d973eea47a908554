"""Base of studies of a train at one speed: settings, problem and start of motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from fegear.files.errors import InputError
from fegear.statics.excitation import ExcitationSource
from fegear.statics.plausibility import motion_warnings
from fegear.studies.problem import Job
from fegear.studies.settings import display_name, setting
from fegear.studies.study import Study
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.model_texts import (
    file_header,
    integration_in_words,
    static_entries,
    truncation_entries,
    truncation_warnings,
)
from fegear.studies.trains.models import (
    ALL_MODELS,
    BEARINGS,
    MOVING,
    SPACE,
    lumped_integration,
    lumped_model,
    tables_setting,
)
from fegear.studies.trains.speeds import FREQUENCY, refuse_both, rpm_setting
from fegear.studies.trains.train_problem import (
    TrainFacts,
    TrainProblem,
    bodies_described,
    system_notes,
)
from fegear.studies.trains.train_study import TrainStudy
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from fegear.train.truncation import truncation_error
from lumped.common.array_types import Array
from lumped.common.checks import require_present
from lumped.common.csv_text import format_exact
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import speeds_between, sweep_to_speed
from lumped.steady.response import Response
from lumped.steady.sweep import Observer, reporting_observer
from lumped.steady.truncation_check import TruncationCheck
from lumped.train.system import LumpedSystem


@dataclass(frozen=True, kw_only=True)
class OneSpeedStudy(TrainStudy, Study):
    """Settings of studies of a lumped train at one speed."""

    speed: float | None = setting(
        None,
        "Mesh frequency of the first mesh [Hz]; this or --rpm. [default: none]",
        FREQUENCY,
    )
    rpm: float | None = rpm_setting("--speed")
    from_speed: float | None = setting(
        None,
        "Mesh frequency [Hz] of a first steady state, from which the motion is "
        "followed to --speed in steps of at most 20 Hz. Where two motions are "
        "possible, this selects one. [default: start at rest]",
        FREQUENCY,
    )
    from_rpm: float | None = rpm_setting("--from-speed")
    torque: float | None = torque_setting()
    has_rolling = True
    model: LumpedModel = lumped_model(ALL_MODELS | MOVING | BEARINGS | SPACE)
    table: tuple[str, ...] = tables_setting()
    integration: Settings = lumped_integration()

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_both(self, "speed", "rpm")
        refuse_both(self, "from_speed", "from_rpm")
        speed, rpm = display_name(self, "speed"), display_name(self, "rpm")
        if self.needs_speed and self.speed is None and self.rpm is None:
            raise InputError(f"{speed} HZ or {rpm} RPM is needed")
        for start, name in (("from_speed", "speed"), ("from_rpm", "rpm")):
            value = getattr(self, start)
            if value is not None and value == getattr(self, name):
                is_given_twice = f"must differ from {display_name(self, name)}"
                raise InputError(f"{start} {value:g}; {is_given_twice}")

    @property
    def needs_speed(self) -> bool:
        """Whether the speed is a setting, and follows from nothing else."""
        return True

    @property
    def frequency(self) -> float:
        """Mesh frequency of the first mesh [Hz]."""
        return require_present(self.speed, "speed")


@dataclass(frozen=True, eq=False)
class OneSpeedProblem(TrainProblem):
    """A train at one torque and speed.

    excitations : source of the meshes' excitations whose solved tables are shared with
        other problems; one of this problem where it is None
    """

    study: OneSpeedStudy
    excitations: ExcitationSource | None = field(default=None, kw_only=True)

    @cached_property
    def system(self) -> LumpedSystem:
        """The train at the torque."""
        arguments = self.gears, self.single_torque, self.model
        return lumped_system(*arguments, self.excitations)

    @property
    def integration(self) -> Settings:
        """Numerical settings of the motion."""
        return self.study.integration

    @property
    def motions(self) -> float:
        study = self.study
        start = study.frequency if study.from_speed is None else study.from_speed
        return float(len(speeds_between(start, study.frequency)))

    def start_state(self, job: Job) -> tuple[Array | None, Observer]:
        """State from which the motion settles, None for rest, and what reports its
        progress; DivergedError without a bound."""
        study, integration = self.study, self.integration
        job.report("stiffness", 0, 1)
        system = self.system
        start = study.frequency if study.from_speed is None else study.from_speed
        observer = reporting_observer(
            job.report, len(speeds_between(start, study.frequency))
        )
        state = sweep_to_speed(system, start, study.frequency, integration, observer)
        return state, observer

    def facts(
        self, torque: float, response: Response, checks: tuple[TruncationCheck, ...]
    ) -> TrainFacts:
        """What the result tells of the train.

        torque : on the input gear [N m]
        """
        study, model, system = self.study, self.model, self.system
        ratio, systems = system.train.damping_ratio, {torque: system}
        bodies = truncation_entries(system, checks)
        method = integration_in_words(self.integration, model.number == "coupled")
        return TrainFacts(
            summary=self.summary_head(ratio)
            | self.friction_entries()
            | static_entries(systems, len(self.gears.meshes))
            | bodies_described(bodies)
            | {"body_modes_error": truncation_error(checks)},
            header={
                **file_header(self.gears, model, ratio, method),
                **bodies,
                "model": model.name,
                "torque_Nm": format_exact(torque),
                "speed_Hz": format_exact(study.frequency),
                **study.gear_set.entries,
            },
            notes=(*self.notes, *system_notes(system)),
            warnings=(
                *self.warnings_at_rest(systems, (study.frequency,)),
                *truncation_warnings(checks),
                *motion_warnings(
                    self.gears,
                    f" at {torque:g} N m",
                    *(response.dte_peak, response.back_side),
                ),
            ),
        )
