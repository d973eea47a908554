"""Vibration of a gear set's lumped train over speed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial

from fegear.files.output import INTO_PICTURE, TO_SINGLE_TABLE
from fegear.gearset.speeds import cycles_per_turn
from fegear.studies.columns import meanings
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw
from fegear.studies.study import PLOT, Study
from fegear.studies.table import Table
from fegear.studies.trains.loads import chosen_torques, torques_setting
from fegear.studies.trains.model_texts import (
    file_header,
    integration_in_words,
    natural_in_words,
    static_entries,
    truncation_entries,
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
from fegear.studies.trains.responses import ResponsesResult, sweep_warnings
from fegear.studies.trains.speeds import with_frequencies
from fegear.studies.trains.swept_speeds import SweptSpeeds, unbegun_branch
from fegear.studies.trains.train_problem import (
    TrainFacts,
    TrainProblem,
    bodies_described,
    system_notes,
)
from fegear.studies.trains.train_study import TrainStudy
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from fegear.train.resonances import DEFAULT_SPEEDS, default_speeds, natural_frequencies
from fegear.train.truncation import truncation_error
from lumped.common.workers import Stopped
from lumped.figures.waterfall import (
    COLUMNS,
    SpectraOverSpeed,
    draw_waterfall,
    spectra_over_speed,
    spectra_rows,
)
from lumped.steady.integration_settings import Settings
from lumped.steady.sweep import Branch, Direction, reporting_observer, sweep
from lumped.steady.truncation_check import check_truncation
from lumped.train.system import LumpedSystem

TABLE_HELP = {
    "spectra": "Write the lines of the spectra of all motions, as amplitudes of the "
    f"dynamic transmission error [m], {TO_SINGLE_TABLE}."
}
SPECTRA_LEGEND = "mesh_frequency_Hz", "order", "amplitude_m"  # of the spectra


@dataclass(frozen=True, kw_only=True)
class Sweep(
    SweptSpeeds,
    TrainStudy,
    Study,
    command="sweep",
    example="sweep liu-idler --speeds 800:4200:20 -o s.csv --plot s.png",
):
    """Vibration of a lumped train over speed.

    Resonances, jumps and loss of contact, with the speed rising and falling. Every
    speed starts from the steady-state motion of the one before.
    """

    partial = True
    more_tables = TABLE_HELP
    pictures = PLOT | {
        "waterfall": f"Draw the spectra over speed {INTO_PICTURE}: "
        "a Campbell diagram, and harmonics of the mesh frequency."
    }

    torque: tuple[float, ...] = torques_setting()
    has_rolling = True
    model: LumpedModel = lumped_model(ALL_MODELS | MOVING | BEARINGS | SPACE)
    table: tuple[str, ...] = tables_setting()
    integration: Settings = lumped_integration()

    def prepare(self) -> SweepProblem:
        return SweepProblem.of(with_frequencies(self, {"speeds": self.rpm}))


@dataclass(frozen=True, eq=False)
class SweepProblem(TrainProblem):
    """A train at each torque, and the speeds at which it is solved."""

    study: Sweep

    @cached_property
    def systems(self) -> dict[float, LumpedSystem]:
        """The train by its torque on the input gear [N m]."""
        sweep_arguments = self.model, self.model.excitations
        return {
            torque: lumped_system(self.gears, torque, *sweep_arguments)
            for torque in chosen_torques(self.gears, self.study.torque)
        }

    @cached_property
    def frequencies(self) -> Sequence[float]:
        """Mesh frequencies of the first mesh [Hz]."""
        return self.study.speeds or default_speeds(next(iter(self.systems.values())))

    @property
    def motions(self) -> float:
        speeds = len(self.study.speeds) or DEFAULT_SPEEDS
        return float(speeds * len(self.study.directions) * self.set_ups)

    @property
    def set_ups(self) -> int:
        return len(chosen_torques(self.gears, self.study.torque))

    def tasks(self) -> Iterator[Task]:
        for torque, system in self.systems.items():
            for direction in self.study.directions:
                sweep_work = partial(self._sweep_speeds, system, direction)
                speed_count = len(self.frequencies)
                yield Task(f"{torque!r} {direction}", sweep_work, speed_count)

    def _sweep_speeds(
        self, system: LumpedSystem, direction: Direction, job: Job
    ) -> Branch:
        settings = self.study.integration
        observer = reporting_observer(job.report, len(self.frequencies))
        sweep_arguments = self.frequencies, direction, settings
        branch = sweep(system, *sweep_arguments, observer=observer, stop=job.stop)
        if direction != self.study.directions[0]:
            return branch
        with suppress(Stopped):  # the speeds are finished without it
            callback = observer.callback
            truncation_checks = check_truncation(
                system, branch.responses, settings, callback
            )
            return replace(branch, checks=truncation_checks)
        return branch

    def gather(self, results: Mapping[str, Branch | None]) -> SweepResult:
        study, model = self.study, self.model
        system = next(iter(self.systems.values()))
        ratio = system.train.damping_ratio
        integration_text = integration_in_words(
            study.integration, model.number == "coupled"
        )
        truncation_checks = [
            check for branch in results.values() if branch for check in branch.checks
        ]
        entries = truncation_entries(system, truncation_checks)
        branches = [
            (
                torque,
                results[f"{torque!r} {direction}"]
                or unbegun_branch(loaded_system, direction),
            )
            for torque, loaded_system in self.systems.items()
            for direction in study.directions
        ]
        facts = TrainFacts(
            summary=self.summary_head(ratio)
            | self.friction_entries()
            | bodies_described(entries)
            | {"body_modes_error": truncation_error(truncation_checks)}
            | static_entries(self.systems, len(self.gears.meshes)),
            header=file_header(self.gears, model, ratio, integration_text)
            | entries
            | study.gear_set.entries,
            cycles_per_turn=cycles_per_turn(self.gears),
            notes=(*self.notes, *system_notes(system)),
            warnings=(
                *self.warnings_at_rest(self.systems, self.frequencies),
                *sweep_warnings(self.gears, branches),
            ),
        )
        return SweepResult(
            study=study,
            facts=facts,
            frequencies=self.frequencies,
            natural_Hz=tuple(natural_frequencies(system)),
            natural=natural_in_words(system, next(iter(self.systems))),
            branches=branches,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class SweepResult(ResponsesResult):
    """Branches of a lumped model, and spectra of their motions."""

    @cached_property
    def spectra(self) -> Sequence[SpectraOverSpeed]:
        """Lines of the motions of each branch."""
        settings = self.study.integration
        branch_spectra = [
            spectra_over_speed(*torque_and_branch, settings)
            for torque_and_branch in self.branches
        ]
        return [spectra for spectra in branch_spectra if spectra.lines]

    @property
    def more_tables(self) -> dict[str, Table]:
        rows = partial(spectra_rows, self.spectra)
        legend = meanings("sweep", *SPECTRA_LEGEND, table="spectra")
        table = Table(COLUMNS, rows, {**self.facts.header, **legend})
        return {"spectra": self.facts.with_driver_speed(table)}

    @property
    def figures(self) -> dict[str, Draw]:
        waterfall = partial(draw_waterfall, title=self.title)
        return super().figures | {"waterfall": lambda: waterfall(self.spectra)}
