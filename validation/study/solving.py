"""A task's statics and motion, by finite elements or by a lumped model."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fegear.dynamics.build import prepare
from fegear.dynamics.checkpoint import StoredBranch
from fegear.dynamics.stepper import DynamicSettings, ImplicitStepper, steps_per_cycle
from fegear.files.memory import MemoryLevel, memory_level
from fegear.files.store import Checkpoint, Records
from fegear.statics.excitation import Excitations
from fegear.studies.trains.model_texts import static_warnings, truncation_warnings
from fegear.studies.trains.responses import sweep_warnings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.progress import Progress
from lumped.steady.integration_settings import Settings
from lumped.steady.motion import speeds_between
from lumped.steady.response import Response, Status
from lumped.steady.steady_state import Stepper, steady_state
from lumped.steady.steppers import stepper_of, steps_per_period, warm_up
from lumped.steady.sweep import Branch, Direction, Observer, sweep_branch
from lumped.steady.truncation_check import check_truncation
from lumped.train.system import LumpedSystem
from validation.study.cases import SingleSpeed
from validation.study.cycle_metrics import ForceCycle, force_cycle
from validation.study.metrics import CYCLE_POINTS, Statics
from validation.study.statics_runs import mesh_statics
from validation.study.tasks import RunSpec


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What a run took on one core.

    prepare_s : from the gear set to the stepper, tables included where they are new
    march_s : of timed_speeds, which count the way to single speeds, and leave out what
        an earlier run had finished where one was taken up again
    speeds, steps : of the sweeps; steps until the motion had settled
    memory_MB : largest resident memory of the process, all that it had loaded before
        included; NaN where the system does not report it
    memory_above_start_MB : the same without what was resident when the run began. The
        first run of a process loads and compiles what later ones find there; of runs
        that share tables the first makes them
    """

    prepare_s: float
    march_s: float = 0.0
    timed_speeds: int = 0
    speeds: int = 0
    steps: int = 0
    memory_MB: float = math.nan
    memory_above_start_MB: float = math.nan

    @property
    def per_speed_s(self) -> float:
        return self.march_s / self.timed_speeds if self.timed_speeds else math.nan


@dataclass(frozen=True, eq=False)
class RunResult:
    """Result of a run, with the lumped system whose modes it is counted in."""

    system: LumpedSystem
    statics: Sequence[Statics]
    branches: Sequence[Branch]
    cycles: Sequence[ForceCycle]
    cost: Cost
    warnings: tuple[str, ...] = ()


@dataclass
class SpeedCount:
    """Reports how many speeds are done, and at which one the motion settles.

    stored : speeds that a checkpoint holds, which are passed without integrating
    """

    report: Progress
    label: str
    total: int
    stored: int
    done: int = 0
    running: float = math.nan

    @property
    def integrated(self) -> int:
        return self.done - self.stored

    def speed_done(self) -> None:
        self.done += 1
        self.report(self.label, self.done, self.total)

    def callback(self, frequency: float, period: int) -> None:
        if frequency != self.running:
            self.running = frequency
            self.report(f"{self.label}, {frequency:g} Hz", self.done, self.total)


@dataclass(frozen=True, eq=False)
class Integrator:
    """What integrates a task's motion.

    checkpoint : where finished speeds are found and kept, None if nowhere
    """

    stepper: Stepper
    settings: Any
    checkpoint: Checkpoint | None

    def progress(
        self, report: Progress, label: str, total: int, branches: Sequence[str]
    ) -> SpeedCount:
        """Progress over so many speeds in branches, by their names in the
        checkpoint.
        """
        if self.checkpoint is None:
            return SpeedCount(report, label, total, 0)
        stored_count = sum(len(self.checkpoint.finished(name)) for name in branches)
        return SpeedCount(report, label, total, stored_count)

    def sweep(
        self,
        speeds: Sequence[float],
        direction: Direction,
        name: str,
        progress: SpeedCount,
    ) -> Branch:
        """Sweep through speeds [Hz]; name : of the branch in the checkpoint."""
        has_checkpoint = (
            self.checkpoint is not None
        )  # only those of finite elements are
        stored = (
            StoredBranch(Records(self.checkpoint, name)) if has_checkpoint else None
        )
        return sweep_branch(
            *(self.stepper, speeds, direction, self.settings),
            store=stored,
            observer=Observer(progress.speed_done, progress.callback),
        )

    def steps_to_settle(self, response: Response) -> int:
        """Steps until the motion had settled, 0 where that is not known."""
        frequency, stepper = response.frequency, self.stepper
        periods = response.settling_time * frequency
        if not math.isfinite(periods):
            return 0
        if isinstance(stepper, ImplicitStepper):
            cycle_steps = steps_per_cycle(stepper.model, frequency, self.settings)
            return round(periods * cycle_steps)
        system = stepper.system
        steps = steps_per_period(system, frequency, self.settings)
        grid = system.samples(steps)[0]
        return round(periods * (grid.size / system.common_period[0]))


def solve_task(
    spec: RunSpec,
    checkpoint: Checkpoint | None,
    excitations: Excitations,
    report: Progress,
) -> RunResult:
    """Run a task: statics, then sweeps and single speeds.

    checkpoint : where finished speeds are found and kept; None for a lumped model,
        which takes less than a second
    """
    level, begin = memory_level(), time.perf_counter()
    report(f"{_run_name(spec)}: statics", 0, 1)
    system = lumped_system(spec.gear_set, spec.torque, _lumped_model(spec), excitations)
    statics = [
        mesh_statics(spec, excitations, m, system)
        for m in range(len(system.excitations))
    ]
    if not spec.speeds:
        cost = Cost(prepare_s=time.perf_counter() - begin)
        return RunResult(system, statics, (), (), _with_memory(cost, level))
    report(f"{_run_name(spec)}: preparation", 0, 1)
    integrator = Integrator(*_stepper(spec, system, excitations), checkpoint)
    ready = time.perf_counter()
    branches, cycles, integrated = _integrate(spec, integrator, report)
    end = time.perf_counter()
    responses = [response for branch in branches for response in branch.responses]
    cost = Cost(
        prepare_s=ready - begin,
        march_s=end - ready,
        timed_speeds=integrated,
        speeds=len(responses),
        steps=sum(map(integrator.steps_to_settle, responses)),
    )
    swept = [(spec.torque, branch) for branch in branches]
    warnings = [*sweep_warnings(spec.gear_set, swept), *_warnings(spec, system, swept)]
    cost = _with_memory(cost, level)
    return RunResult(system, statics, branches, cycles, cost, tuple(warnings))


def _warnings(
    spec: RunSpec, system: LumpedSystem, swept: Sequence[tuple[float, Branch]]
) -> Iterator[str]:
    """Warn of a lumped model at rest, and of body modes that it leaves out."""
    if spec.model is None:
        return
    yield from static_warnings({spec.torque: system})
    for _, branch in swept[:1]:
        checks = check_truncation(system, branch.responses, Settings())
        yield from truncation_warnings(checks)


def _with_memory(cost: Cost, level: MemoryLevel) -> Cost:
    peak = level.peak_MB
    above = peak - level.resident_MB
    return replace(cost, memory_MB=peak, memory_above_start_MB=above)


def _lumped_model(spec: RunSpec) -> LumpedModel:
    """Lumped model of the task; Model-1 for finite elements."""
    return LumpedModel(
        number=1 if spec.model is None else spec.model.number,
        without=() if spec.model is None else spec.model.without,
        translations=spec.case.translations,
        bearings="linear",
        damping_ratio=spec.case.damping_ratio,
        friction=0.0 if spec.model is None else spec.friction,
        bending=None if spec.model is None else spec.model.bending,
    )


def _run_name(spec: RunSpec) -> str:
    return f"{spec.source} {spec.torque:g} N m"


def _stepper(
    spec: RunSpec, system: LumpedSystem, excitations: Excitations
) -> tuple[Stepper, Any]:
    """The stepper and its settings, with its kernels compiled, to be timed alone."""
    stepper: Stepper
    settings: Settings | DynamicSettings
    if spec.model is None:
        settings = DynamicSettings()
        model = (system, spec.speeds, spec.elements, settings, excitations)
        stepper = prepare(spec.gear_set, spec.torque, *model).stepper
    else:
        settings = Settings()
        stepper = stepper_of(system, settings)
    warm_up(stepper, spec.speeds[0], settings)
    return stepper, settings


def _integrate(
    spec: RunSpec, integrator: Integrator, report: Progress
) -> tuple[list[Branch], list[ForceCycle], int]:
    """Sweeps, forces at single speeds, and speeds that no checkpoint held."""
    case = spec.case
    total = len(case.directions) * len(case.speeds)
    progress = integrator.progress(report, _run_name(spec), total, case.directions)
    branches = [
        integrator.sweep(case.speeds, direction, direction, progress)
        for direction in case.directions
        if case.speeds
    ]
    cycles, integrated = [], progress.integrated
    for number, single in enumerate(spec.single_speeds, start=1):
        name, stage = f"wave-{number}", f"{_run_name(spec)}, wave {number}"
        progress = integrator.progress(report, stage, len(approach(single)), [name])
        cycles += _cycles_at(single, integrator, name, progress)
        integrated += progress.integrated
    return branches, cycles, integrated


def _cycles_at(
    single: SingleSpeed, integrator: Integrator, name: str, progress: SpeedCount
) -> list[ForceCycle]:
    """Force over a cycle of each mesh, after the way to its single speed.

    The checkpoint keeps the speeds on the way, and not the last: its motion is needed
    whole, and is integrated again from where the one before has settled. NaN for a
    motion that diverged.
    """
    *approach_speeds, last = approach(single)
    direction: Direction = (
        "up" if not approach_speeds or approach_speeds[0] <= last else "down"
    )
    branch = integrator.sweep(approach_speeds, direction, name, progress)
    system, label = branch.system, single.label
    if branch.complete:
        state = branch.responses[-1].state if approach_speeds else None
        previous_frequency = approach_speeds[-1] if approach_speeds else None
        response, motion = steady_state(
            integrator.stepper,
            last,
            integrator.settings,
            state,
            previous_frequency,
            progress.callback,
        )
        progress.speed_done()
        if response.status != Status.DIVERGED:
            return [
                ForceCycle(
                    label=label,
                    mesh=m + 1,
                    force=force_cycle(motion, m, 1.0 / (last * float(rate))),
                    contact_loss=float(response.contact_loss[m]),
                    period_multiple=int(response.period_multiple[m]),
                )
                for m, rate in enumerate(system.train.mesh_rates)
            ]
    nothing = np.full(CYCLE_POINTS, np.nan)
    meshes = range(1, len(system.excitations) + 1)
    return [ForceCycle(label, mesh, nothing, math.nan, 0) for mesh in meshes]


def approach(single: SingleSpeed) -> list[float]:
    """Speeds on the way to a single one, which is the last [Hz]."""
    start = single.from_speed_Hz or single.speed_Hz
    return speeds_between(start, single.speed_Hz, single.step_Hz)
