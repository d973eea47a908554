"""fegear dynamics: the finite-element gears in motion."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from fegear.cli.edits import EditedSet, edit_entries, refuse_idle_edits
from fegear.cli.groups import grouped, option
from fegear.cli.lumped_options import (
    GivenTorque,
    LoadCases,
    Settling,
    SweptSpeeds,
    Train,
    chosen_torques,
)
from fegear.cli.options import (
    RATIO,
    Elements,
    Friction,
    ResumedOutputs,
    chosen,
    named_options,
    refuse_idle,
)
from fegear.cli.screen import complain, say
from fegear.cli.sweep_report import show_sweep
from fegear.errors import InputError
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.dynamic_sweeps import DynamicsSettings
    from fegear.dynamics.stepper import DynamicSettings

EXAMPLE = "fegear dynamics liu-idler --torque 100 --speeds 800:4200:20 -o d.csv"


@dataclass(frozen=True, kw_only=True)
class MovingElements:
    """What moves, and how it is damped."""

    fidelity: Literal["auto", "full", "reduced", "quasistatic"] = option(
        "What moves. full: all degrees of freedom of the finite elements; reduced: "
        "hubs and elastic modes of the gears; quasistatic: hubs alone, without "
        "elastic inertia; auto: reduced where elastic inertia matters, else "
        "quasistatic.",
        default="auto",
    )
    friction: Friction = None
    torque_of: GivenTorque = None
    train: Train
    elastic_damping: float | None = option(
        "Damping ratio of the first elastic modes of the gears. [default: 0.01]",
        allowed=RATIO,
    )
    cutoff: float | None = option(
        "Natural frequency [Hz] up to which elastic modes are considered. [default: 7 "
        "times the highest speed, or more]",
        allowed=Range(above=0.0, most=3e5, unit="Hz"),
    )
    elements: Elements

    def __post_init__(self) -> None:
        if not self.friction:
            refuse_idle("needs --friction above 0", torque_of=self.torque_of)
        if self.fidelity == "quasistatic":
            refuse_idle(
                "--fidelity quasistatic has no elastic modes",
                elastic_damping=self.elastic_damping,
                cutoff=self.cutoff,
            )
        if self.fidelity == "full":
            reason = "--fidelity full keeps all elastic modes"
            refuse_idle(reason, cutoff=self.cutoff)

    @property
    def settings(self) -> DynamicsSettings:
        from fegear.dynamic_sweeps import DynamicsSettings
        from fegear.dynamics.build import FiniteElements
        from fegear.excitation import Source

        elements = FiniteElements(
            fidelity=self.fidelity,
            cutoff_Hz=self.cutoff,
            **chosen(friction=self.friction, elastic_damping=self.elastic_damping),
        )
        return DynamicsSettings(
            elements=elements,
            translations=self.train.translations,
            damping_ratio=self.train.damping,
            source=Source(**self.elements.choices),
            torque_of=self.torque_of or "nominal",
        )


@dataclass(frozen=True, kw_only=True)
class ImplicitIntegration(Settling):
    """Time integration of the finite elements."""

    steps: int = option(
        "Least number of time steps per period of the fastest mesh.",
        default=128,
    )

    @property
    def settings(self) -> DynamicSettings:
        from fegear.dynamics.stepper import DynamicSettings

        return self.settings_of(DynamicSettings, steps=self.steps)


@dataclass(frozen=True, kw_only=True)
class DynamicsOutputs(ResumedOutputs):
    """Where the results and histories go, and whether a run is taken up again."""

    history: Path | None = option(
        "Write a CSV file for each speed into this directory: load and contact "
        "pressure of every tooth pair and motion of the hubs over one period.",
        metavar="DIR",
    )
    root_stress: str | None = option(
        "Add the root stress of this gear's teeth to the files of --history.",
        metavar="GEAR",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.root_stress is not None and self.history is None:
            raise InputError("--root-stress needs --history")


@grouped
def dynamics_command(
    *,
    subject: EditedSet,
    swept: SweptSpeeds,
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
    settings = replace(
        moving.settings,
        integration=integration.settings,
        directions=swept.directions,
        model_1=model_1,
    )
    torques = chosen_torques(gear_set, torque or [])
    begin = time.perf_counter()
    from fegear.dynamic_sweeps import Records, sweep_elements

    output = outputs.output
    records = Records(
        checkpoint=outputs.checkpoint,
        resume=outputs.resume,
        histories=outputs.history,
        root_stress=outputs.root_stress,
        entries=edit_entries(changes),
        tell=complain,
    )
    with outputs.progress() as report, named_options("root_stress"):
        result = sweep_elements(
            gear_set, torques, swept.frequencies, settings, records, report
        )
    if not outputs.as_json:
        for at, reason in result.reasons:
            say(f"{at:g} N m, {reason}")
    if output is not None and not all(branch.complete for _, branch in result.found):
        complain(f"{output}.partial is kept, --resume goes on there")
    show_sweep(result, outputs, begin)
