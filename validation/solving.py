"""A task's statics and motion, by finite elements or by a lumped model."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fegear.dynamics.build import Prepared, prepare
from fegear.dynamics.checkpoint import StoredBranch
from fegear.dynamics.stepper import DynamicSettings, ImplicitStepper, steps_per_cycle
from fegear.excitation import Excitations
from fegear.lumped_system import LumpedModel, lumped_system
from fegear.memory import memory_level
from fegear.store import Checkpoint
from lumped.motion import APPROACH_STEP, DivergedError, arrive
from lumped.respond import respond_with_history
from lumped.response import History, Response, Status
from lumped.settings import Settings
from lumped.steady_state import steady_state
from lumped.steppers import steps_per_period
from lumped.sweep import Branch, Direction, Observer, sweep_all, sweep_branch
from lumped.system import LumpedSystem
from validation.cases import SingleSpeed
from validation.deflection import mesh_statics
from validation.metrics import CYCLE_POINTS, ForceCycle, Statics, force_cycle
from validation.tasks import Task

Report = Callable[[str, int, int], None]  # (what, speeds done, of how many)


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What a run took on one core.

    prepare_s : from the gear set to the stepper, tables included where they are new
    march_s : of timed_speeds, which count the way to single speeds, and leave out what
        an earlier run had finished where one was taken up again
    speeds, steps : of the sweeps; steps until the motion had settled
    memory_MB : largest resident memory of the process, all that it had loaded before
        included; NaN where the system does not tell
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
    """What a task gave, with the lumped system whose modes it is counted in."""

    system: LumpedSystem
    statics: Sequence[Statics]
    branches: Sequence[Branch]
    cycles: Sequence[ForceCycle]
    cost: Cost


@dataclass(frozen=True, eq=False)
class Motions:
    """Sweeps, and mesh forces over a cycle at single speeds.

    integrated : speeds that no checkpoint held
    per_cycle : steps of a cycle of the first mesh, by its frequency [Hz]
    """

    branches: Sequence[Branch] = ()
    cycles: Sequence[ForceCycle] = ()
    integrated: int = 0
    per_cycle: Callable[[float], float] = lambda frequency: math.nan


@dataclass
class Progress:
    """Tells how many speeds are done, and at which one the motion settles.

    found : speeds that a checkpoint holds, which are passed without integrating
    """

    report: Report
    what: str
    total: int
    found: int
    done: int = 0
    running: float = math.nan

    @property
    def integrated(self) -> int:
        return self.done - self.found

    def passed(self) -> None:
        self.done += 1
        self.report(self.what, self.done, self.total)

    def watch(self, frequency: float, period: int) -> None:
        if frequency != self.running:
            self.running = frequency
            self.report(f"{self.what}, {frequency:g} Hz", self.done, self.total)


def solve_task(
    task: Task, checkpoint: Checkpoint | None, excitations: Excitations, report: Report
) -> RunResult:
    """All that a task asks for.

    checkpoint : where the finite elements' finished speeds are found and kept; None for
        a lumped model. Raises KeyboardInterrupt rather than leave speeds out.
    """
    level, begin = memory_level(), time.perf_counter()
    report(f"{_name(task)}: statics", 0, 1)
    system = lumped_system(task.gear_set, task.torque, _model(task), excitations)
    statics = [
        mesh_statics(task, excitations, m, each)
        for m, each in enumerate(system.excitations)
    ]
    move = _ready(task, system, excitations, checkpoint, report)
    ready = time.perf_counter()
    motions = move(report)
    end = time.perf_counter()
    peak = level.peak_MB
    cost = Cost(
        prepare_s=ready - begin,
        march_s=end - ready if task.speeds else 0.0,
        timed_speeds=motions.integrated,
        speeds=sum(len(branch.responses) for branch in motions.branches),
        steps=_steps(motions),
        memory_MB=peak,
        memory_above_start_MB=peak - level.resident_MB,
    )
    return RunResult(system, statics, motions.branches, motions.cycles, cost)


def _model(task: Task) -> LumpedModel:
    """That of the task, or the one whose modes the finite elements are counted in."""
    return LumpedModel(
        number=1 if task.model is None else task.model.number,
        translations=task.case.translations,
        damping_ratio=task.case.damping_ratio,
    )


def _name(task: Task) -> str:
    return f"{task.source} {task.torque:g} N m"


def _ready(
    task: Task,
    system: LumpedSystem,
    excitations: Excitations,
    checkpoint: Checkpoint | None,
    report: Report,
) -> Callable[[Report], Motions]:
    """What marches, with its kernels compiled, so that it is timed alone."""
    if not task.speeds:
        return lambda report: Motions()
    report(f"{_name(task)}: preparation", 0, 1)
    if checkpoint is not None:
        prepared = _prepared(task, system, excitations)
        return partial(_integrate_fe, task, prepared.stepper, checkpoint)
    warm_up = Settings(max_periods=1, multiples=1, windows=1)
    respond_with_history(system, task.speeds[0], warm_up)
    return partial(_integrate_lumped, task, system)


def _prepared(
    task: Task, reference: LumpedSystem, excitations: Excitations
) -> Prepared:
    """The stepper, with its kernels compiled."""
    settings = DynamicSettings()
    given = (reference, task.speeds, task.elements, settings, excitations)
    prepared = prepare(task.gear_set, task.torque, *given)
    warm_up = replace(settings, max_periods=1, multiples=1, windows=1)
    steady_state(prepared.stepper, task.speeds[0], warm_up)
    return prepared


def _steps(motions: Motions) -> int:
    """Steps in which the motions of the sweeps settled."""
    periods = (
        (response.settling_time * response.frequency, response.frequency)
        for branch in motions.branches
        for response in branch.responses
    )
    return sum(round(n * motions.per_cycle(f)) for n, f in periods if math.isfinite(n))


def _integrate_fe(
    task: Task, stepper: ImplicitStepper, checkpoint: Checkpoint, report: Report
) -> Motions:
    case, settings = task.case, DynamicSettings()
    found = sum(len(checkpoint.finished(direction)) for direction in case.directions)
    total = len(case.directions) * len(case.speeds)
    progress = Progress(report, _name(task), total, found)
    branches = [
        sweep_branch(
            *(stepper, case.speeds, direction, settings),
            store=StoredBranch(checkpoint, direction),
            observer=Observer(progress.passed, progress.watch),
        )
        for direction in case.directions
        if case.speeds
    ]
    cycles, integrated = [], progress.integrated
    for number, single in enumerate(task.single_speeds, start=1):
        name, total = f"wave-{number}", len(approach(single))
        what = f"{_name(task)}, wave {number}"
        progress = Progress(report, what, total, len(checkpoint.finished(name)))
        cycles += _fe_cycles(single, stepper, checkpoint, name, progress)
        integrated += progress.integrated
    per_cycle = partial(steps_per_cycle, stepper.model, settings=settings)
    return Motions(branches, cycles, integrated, per_cycle)


def _fe_cycles(
    single: SingleSpeed,
    stepper: ImplicitStepper,
    checkpoint: Checkpoint,
    name: str,
    progress: Progress,
) -> list[ForceCycle]:
    """Force over a cycle of each mesh, after the way to its single speed.

    The checkpoint keeps the speeds on the way, and not the last: its motion is needed
    whole, and is integrated again from where the one before has settled.
    """
    settings, system = DynamicSettings(), stepper.model.reference
    *way, last = approach(single)
    direction: Direction = "up" if not way or way[0] <= last else "down"
    branch = sweep_branch(
        *(stepper, way, direction, settings),
        store=StoredBranch(checkpoint, name),
        observer=Observer(progress.passed, progress.watch),
    )
    if not branch.complete:
        return _no_cycles(single, system)
    state, before = None, None
    if way:
        state, before = branch.responses[-1].state, way[-1]
    response, motion = steady_state(
        stepper, last, settings, state, before, progress.watch
    )
    progress.passed()
    if response.status == Status.DIVERGED:
        return _no_cycles(single, system)
    return _force_cycles(single, system, response, motion)


def approach(single: SingleSpeed) -> list[float]:
    """Speeds on the way to a single one, which is the last [Hz]."""
    if single.from_speed_Hz is None:
        return [single.speed_Hz]
    start, end = single.from_speed_Hz, single.speed_Hz
    count = math.ceil(abs(end - start) / APPROACH_STEP - 1e-9)
    return [float(f) for f in np.linspace(start, end, count + 1)]


def _no_cycles(single: SingleSpeed, system: LumpedSystem) -> list[ForceCycle]:
    """NaN for a motion that diverged."""
    nothing = np.full(CYCLE_POINTS, np.nan)
    meshes = range(1, len(system.excitations) + 1)
    return [ForceCycle(single.label, mesh, nothing, math.nan, 0) for mesh in meshes]


def _force_cycles(
    single: SingleSpeed, system: LumpedSystem, response: Response, history: History
) -> list[ForceCycle]:
    cycles = []
    for m, rate in enumerate(system.train.mesh_rates):
        period = 1.0 / (response.frequency * float(rate))
        force = force_cycle(history, m, period)
        lost, repeats = response.contact_loss[m], response.period_multiple[m]
        made = ForceCycle(single.label, m + 1, force, float(lost), int(repeats))
        cycles.append(made)
    return cycles


def _integrate_lumped(task: Task, system: LumpedSystem, report: Report) -> Motions:
    """Nothing is kept in between, it takes less than a second."""
    settings = Settings()
    branches = sweep_all(
        *([system], task.case.speeds, task.case.directions, settings),
        partial(report, _name(task)),
        workers=1,
    )
    if not all(branch.complete or _diverged(branch) for branch in branches):
        raise KeyboardInterrupt  # that `sweep_all` has turned into short branches
    cycles = [
        each for single in task.single_speeds for each in _lumped_cycles(system, single)
    ]
    integrated = sum(len(branch.responses) for branch in branches)
    integrated += sum(len(approach(single)) for single in task.single_speeds)
    per_cycle = partial(_steps_per_cycle, system, settings=settings)
    return Motions(branches, cycles, integrated, per_cycle)


def _diverged(branch: Branch) -> bool:
    return bool(branch.responses) and branch.responses[-1].status == Status.DIVERGED


def _steps_per_cycle(
    system: LumpedSystem, frequency: float, settings: Settings
) -> float:
    grid = system.samples(steps_per_period(system, frequency, settings))[0]
    return grid.size / system.common_period[0]


def _lumped_cycles(system: LumpedSystem, single: SingleSpeed) -> list[ForceCycle]:
    start = single.speed_Hz if single.from_speed_Hz is None else single.from_speed_Hz
    try:
        state = arrive(system, start, single.speed_Hz)
    except DivergedError:
        return _no_cycles(single, system)
    response, history = respond_with_history(system, single.speed_Hz, state=state)
    if response.status == Status.DIVERGED:
        return _no_cycles(single, system)
    return _force_cycles(single, system, response, history)
