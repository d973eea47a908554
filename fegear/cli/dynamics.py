"""fegear dynamics: the finite-element gears in motion."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.dynamics_run import Run, history_keeper, root_influences, run_sweeps
from fegear.cli.edits import EditedSet, edit_entries, refuse_idle_edits
from fegear.cli.groups import grouped
from fegear.cli.lumped_options import (
    DirectionChoice,
    Elements,
    LoadCases,
    MaxPeriods,
    Speeds,
    SweepDirection,
    Tolerance,
    Train,
    chosen_torques,
    settings_of,
    speeds_of,
)
from fegear.cli.options import (
    Outputs,
    progress_bar,
    refuse_idle,
    require,
    require_friction,
)
from fegear.cli.screen import complain, say
from fegear.cli.sweep_report import tell_sweep
from fegear.errors import InputError

if TYPE_CHECKING:
    from fegear.dynamics.build import FiniteElements, Prepared
    from fegear.dynamics.respond import DynamicSettings
    from fegear.lumped_system import LumpedModel
    from lumped.sweep import Branch

EXAMPLE = "fegear dynamics liu-idler --torque 100 --speeds 800:4200:20 -o d.csv"


class FidelityChoice(StrEnum):
    auto = "auto"
    full = "full"
    reduced = "reduced"
    quasistatic = "quasistatic"


@dataclass(frozen=True, kw_only=True)
class MovingElements:
    """What moves, and how it is damped."""

    fidelity: Annotated[
        FidelityChoice,
        typer.Option(
            "--fidelity",
            help="What moves. full: all degrees of freedom of the finite elements; "
            "reduced: hubs and elastic modes of the gears; quasistatic: hubs alone, "
            "without elastic inertia; auto: reduced where elastic inertia matters, "
            "else quasistatic.",
        ),
    ] = FidelityChoice.auto
    friction: Annotated[
        float, typer.Option("--friction", help="Coulomb friction coefficient.")
    ] = 0.0
    train: Train
    elastic_damping: Annotated[
        float | None,
        typer.Option(
            "--elastic-damping",
            help="Damping ratio of the first elastic modes of the gears. "
            "[default: 0.01]",
        ),
    ] = None
    cutoff: Annotated[
        float | None,
        typer.Option(
            "--cutoff",
            help="Natural frequency [Hz] up to which elastic modes are considered. "
            "[default: 7 times the highest speed, or more]",
        ),
    ] = None
    elements: Elements

    def __post_init__(self) -> None:
        if self.fidelity == FidelityChoice.quasistatic:
            refuse_idle(
                "--fidelity quasistatic has no elastic modes",
                elastic_damping=self.elastic_damping,
                cutoff=self.cutoff,
            )
        if self.fidelity == FidelityChoice.full:
            reason = "--fidelity full keeps all elastic modes"
            refuse_idle(reason, cutoff=self.cutoff)
        require_friction(self.friction)
        if self.elastic_damping is not None:
            ratio = self.elastic_damping
            ok = 0.0 <= ratio < 1.0
            require(ok, "--elastic-damping", ratio, "allowed 0 to below 1")
        if self.cutoff is not None:
            ok = 0.0 < self.cutoff <= 3e5
            require(ok, "--cutoff", self.cutoff, "allowed above 0 to 3e5 Hz")

    @property
    def finite_elements(self) -> FiniteElements:
        from fegear.dynamics.build import FiniteElements

        ratio = self.elastic_damping
        return FiniteElements(
            fidelity=self.fidelity.value,
            friction=self.friction,
            cutoff_Hz=self.cutoff,
            **({} if ratio is None else {"elastic_damping": ratio}),
        )

    @property
    def reference(self) -> LumpedModel:
        """The lumped model whose modes and tables the gears share."""
        from fegear.excitation import Source
        from fegear.lumped_system import LumpedModel

        return LumpedModel(
            translations=self.train.translations,
            damping_ratio=self.train.damping,
            stiffness=Source(**self.elements.given),
        )


@dataclass(frozen=True, kw_only=True)
class ImplicitIntegration:
    """Time integration of the finite elements."""

    steps: Annotated[
        int,
        typer.Option(
            "--steps", help="Least number of time steps per period of the fastest mesh."
        ),
    ] = 128
    tolerance: Tolerance = 1e-4
    max_periods: MaxPeriods = None

    @property
    def settings(self) -> DynamicSettings:
        from fegear.dynamics.respond import DynamicSettings

        return settings_of(
            DynamicSettings,
            steps=self.steps,
            tolerance=self.tolerance,
            max_periods=self.max_periods,
        )


@dataclass(frozen=True, kw_only=True)
class DynamicsOutputs(Outputs):
    """Where the results and histories go, and whether a run is taken up again."""

    history: Annotated[
        Path | None,
        typer.Option(
            "--history",
            metavar="DIR",
            help="Write a CSV file for each speed into this directory: load and "
            "contact pressure of every tooth pair and motion of the hubs over one "
            "period.",
        ),
    ] = None
    root_stress: Annotated[
        str | None,
        typer.Option(
            "--root-stress",
            metavar="GEAR",
            help="Add the root stress of this gear's teeth to the files of --history.",
        ),
    ] = None
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on with an interrupted run to the same --output.",
        ),
    ] = False

    def __post_init__(self) -> None:
        if self.resume and self.output is None:
            raise InputError("--resume needs the --output of the run to go on with")
        if self.root_stress is not None and self.history is None:
            raise InputError("--root-stress needs --history")


@grouped
def dynamics_command(
    *,
    subject: EditedSet,
    speeds: Speeds = None,
    direction: SweepDirection = DirectionChoice.both,
    torque: LoadCases = None,
    moving: MovingElements,
    integration: ImplicitIntegration,
    model_1: Annotated[
        bool,
        typer.Option(
            "--model-1", help="Run lumped model 1 as well and show both results."
        ),
    ] = False,
    outputs: DynamicsOutputs,
) -> None:
    """Vibration of finite-element gears over speed.

    The CSV columns are those of `fegear sweep`. With --output each finished speed is
    kept in FILE.partial until the file is written; --resume goes on from there.
    """
    outputs.require(subject.set_name)
    gear_set, changes = subject.load(torque=torque, damping=moving.train.damping)
    refuse_idle_edits(changes, translations=moving.train.translations)
    elements, settings = moving.finite_elements, integration.settings
    frequencies = None if speeds is None else speeds_of(speeds)
    torques = chosen_torques(gear_set, torque or [])
    begin = time.perf_counter()
    from fegear.excitation import Excitations
    from fegear.lumped_system import lumped_system, usual_speeds
    from fegear.sweeps import SweepResult, at_torques

    with progress_bar(enabled=not outputs.as_json) as report:
        report("stiffness", 0, 1)
        reference = moving.reference
        excitations = reference.excitations
        assert isinstance(excitations, Excitations)
        systems = [
            lumped_system(gear_set, each, reference, excitations) for each in torques
        ]
        frequencies = frequencies or usual_speeds(systems[0])
        run = Run(gear_set, torques, systems, frequencies, direction.directions)
        report("pair laws and modes", 0, 1)
        prepared = _prepare(run, elements, settings, excitations)
        header = _header(run, reference, settings, elements, prepared)
        header |= edit_entries(changes)
        history, root_stress = outputs.history, outputs.root_stress
        records = f"{history}, root stress of {root_stress}" if history else "none"
        roots = root_influences(gear_set, root_stress, excitations.source.statics)
        keep = history_keeper(run, prepared, settings, header, history, roots)
        branches = run_sweeps(
            *(run, prepared, settings, header, outputs.output, records),
            *(outputs.resume, keep, report),
        )
        beside = _model_1(run, report) if model_1 else []
    if not outputs.as_json:
        _print_choice(torques, prepared)
    if outputs.output is not None and not all(branch.complete for branch in branches):
        complain(f"{outputs.output}.partial is kept, --resume goes on there")
    result = SweepResult(
        gear_set=gear_set,
        model=prepared[0].fidelity,
        header=header,
        frequencies=frequencies,
        found=at_torques(torques, direction.directions, branches),
        beside=at_torques(torques, direction.directions, beside) if model_1 else (),
    )
    tell_sweep(result, outputs, begin)


def _prepare(
    run: Run, elements: FiniteElements, settings: DynamicSettings, excitations: Any
) -> list[Prepared]:
    """A stepper for every torque, all of the same fidelity."""
    from fegear.dynamics.build import prepare

    def prepared(elements: FiniteElements) -> list[Prepared]:
        given = run.frequencies, elements, settings, excitations
        return [
            prepare(run.gear_set, torque, system, *given)
            for torque, system in zip(run.torques, run.systems, strict=True)
        ]

    found = prepared(elements)
    if len({each.fidelity for each in found}) > 1:
        found = prepared(replace(elements, fidelity="reduced"))
    return found


def _header(
    run: Run,
    reference: LumpedModel,
    settings: DynamicSettings,
    elements: FiniteElements,
    prepared: Sequence[Prepared],
) -> dict[str, str]:
    from fegear.lumped_system import cap_in_words, file_header

    ratio = run.systems[0].train.damping_ratio
    words = (
        f"generalised-alpha, {settings.steps} steps per period or more, tolerance "
        f"{settings.tolerance:g}, up to {cap_in_words(settings.max_periods)}"
    )
    header = file_header(run.gear_set, reference, ratio, words)
    kept = "; ".join(" + ".join(map(str, each.elastic)) or "0" for each in prepared)
    return header | {
        "fidelity": prepared[0].fidelity,
        "elastic freedoms": kept,
        "elastic damping ratio": f"{elements.elastic_damping:g}",
        "friction coefficient": f"{elements.friction:g}",
    }


def _model_1(run: Run, report: Callable[[str, int, int], None]) -> list[Branch]:
    from lumped.sweep import sweep_all

    return sweep_all(
        run.systems,
        run.frequencies,
        run.directions,
        report=lambda done, total: report("Model-1", done, total),
    )


def _print_choice(torques: Sequence[float], prepared: Sequence[Prepared]) -> None:
    for torque, each in zip(torques, prepared, strict=True):
        say(f"{torque:g} N m, {each.reason}")
