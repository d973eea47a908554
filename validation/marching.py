"""A task's statics and motion, by finite elements or by a lumped model."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.build import Prepared, prepare
from fegear.dynamics.journal import Journal, open_journal
from fegear.dynamics.respond import DynamicSettings, Motion, steps_per_cycle
from fegear.dynamics.respond import respond as fe_respond
from fegear.dynamics.sweep import sweep_branch
from fegear.errors import InputError
from fegear.excitation import Excitations, Source
from fegear.statics import solve_mesh
from fegear.train import mesh_torques_at, train_of
from lumped.excitation import MeshExcitation
from lumped.motion import APPROACH_STEP, DivergedError, arrive
from lumped.response import (
    History,
    Response,
    Status,
    respond_with_history,
    steps_per_period,
)
from lumped.settings import Settings
from lumped.sweep import Branch, Direction, sweep_all
from lumped.system import LumpedSystem
from lumped.table import MeshTable
from lumped.train import TrainError
from validation.cases import Wave
from validation.metrics import WAVE_POINTS, ForceWave, Statics, force_cycle
from validation.tasks import FE, Task

Array = NDArray[np.float64]
Report = Callable[[str, int, int], None]  # (what, speeds done, of how many)
BISECTIONS = 80  # of a static deflection: to the last bit


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What a run took on one core.

    prepare_s : from the gear set to what is marched, tables included where they are new
    march_s : of timed_speeds, which count the approaches of waves, and leave out what
        an earlier run had finished where one was taken up again
    speeds, steps : of the sweeps; steps until the motion had settled
    """

    prepare_s: float
    march_s: float = 0.0
    timed_speeds: int = 0
    speeds: int = 0
    steps: int = 0

    @property
    def per_speed_s(self) -> float:
        return self.march_s / self.timed_speeds if self.timed_speeds else math.nan


@dataclass(frozen=True, eq=False)
class Marched:
    """What motion gave, with the system whose modes it is counted in."""

    system: LumpedSystem
    statics: Sequence[Statics]
    branches: Sequence[Branch]
    waves: Sequence[ForceWave]
    cost: Cost


def march(
    task: Task, journal: Path, excitations: Excitations, report: Report
) -> Marched:
    """All that a task asks for.

    journal : directory of the finite elements' finished speeds, taken up again if it
        is there. Raises KeyboardInterrupt rather than leave speeds out.
    """
    begin = time.perf_counter()
    report(f"{task.source} {task.torque:g} N m: statics", 0, 1)
    number = 1 if task.model is None else task.model.number
    system = lumped_system(task, excitations, number)
    statics = [
        _statics(task, excitations, m, each)
        for m, each in enumerate(system.excitations)
    ]
    if not task.speeds:
        seconds = time.perf_counter() - begin
        return Marched(system, statics, [], [], Cost(prepare_s=seconds))
    if task.model is None:
        prepared = _prepared(task, system, excitations)
        prepare_s = time.perf_counter() - begin
        with _journal(task, journal) as kept_speeds:
            branches, kept = _fe_branches(task, prepared, kept_speeds, report)
            waves = [each for wave in task.waves for each in _fe_wave(prepared, wave)]
        march_s = time.perf_counter() - begin - prepare_s
        steps = _fe_steps(prepared, branches)
    else:
        _warm_up(system, task.speeds[0])
        prepare_s = time.perf_counter() - begin
        branches, kept = _lumped_branches(task, system, report), 0
        waves = [each for wave in task.waves for each in _lumped_wave(system, wave)]
        march_s = time.perf_counter() - begin - prepare_s
        steps = _lumped_steps(system, branches)
    speeds = sum(len(branch.responses) for branch in branches)
    cost = Cost(
        prepare_s=prepare_s,
        march_s=march_s,
        timed_speeds=speeds - kept + sum(len(approach(wave)) for wave in task.waves),
        speeds=speeds,
        steps=steps,
    )
    return Marched(system, statics, branches, waves, cost)


def lumped_system(task: Task, excitations: Excitations, number: int) -> LumpedSystem:
    """The lumped model of that number at the task's torque."""
    gear_set, case = task.gear_set, task.case
    train = train_of(gear_set, task.torque, case.translations, case.damping_ratio)
    on_meshes = mesh_torques_at(gear_set, task.torque)
    driven = tuple(
        excitations.of(gear_set, mesh, torque, number)
        for mesh, torque in enumerate(on_meshes)
    )
    try:
        return LumpedSystem(train, driven)
    except TrainError as error:
        raise InputError(f"{gear_set.name}: {error}") from None


def _prepared(
    task: Task, reference: LumpedSystem, excitations: Excitations
) -> Prepared:
    """The stepper, with its kernels compiled."""
    settings = DynamicSettings()
    given = (reference, task.speeds, task.elements, settings, excitations)
    prepared = prepare(task.gear_set, task.torque, *given)
    hurried = replace(settings, max_periods=1, multiples=1)
    fe_respond(prepared.stepper, task.speeds[0], hurried)
    return prepared


def _warm_up(system: LumpedSystem, speed: float) -> None:
    """Compile the kernels, so that the march is timed alone."""
    respond_with_history(system, speed, Settings(max_periods=1, multiples=1))


def _fe_steps(prepared: Prepared, branches: Sequence[Branch]) -> int:
    model, settings = prepared.stepper.model, DynamicSettings()
    return sum(
        _marched_steps(r, steps_per_cycle(model, r.frequency, settings))
        for branch in branches
        for r in branch.responses
    )


def _lumped_steps(system: LumpedSystem, branches: Sequence[Branch]) -> int:
    settings = Settings()
    common = sum(
        _marched_steps(r, _grid(system, r.frequency, settings))
        for branch in branches
        for r in branch.responses
    )
    return common // system.train.common_period[0]


def _marched_steps(response: Response, per_period: int) -> int:
    periods = response.settling_time * response.frequency
    return round(periods * per_period) if math.isfinite(periods) else 0


@contextmanager
def _journal(task: Task, place: Path) -> Iterator[Journal]:
    """The journal of a task, which stays if what it is for does not come to an end."""
    journal = open_journal(place, task.inputs, resume=True)
    complete = False
    try:
        yield journal
        complete = True
    finally:
        journal.close(keep=not complete)


def _fe_branches(
    task: Task, prepared: Prepared, journal: Journal, report: Report
) -> tuple[list[Branch], int]:
    """Branches, and how many of their speeds an earlier run had finished."""
    case, settings = task.case, DynamicSettings()
    if not case.speeds:
        return [], 0
    kept = sum(len(journal.finished(direction)) for direction in case.directions)
    total, done = len(case.directions) * len(case.speeds), 0

    def passed() -> None:
        nonlocal done
        done += 1
        report(f"{FE} {task.torque:g} N m", done, total)

    branches = [
        sweep_branch(
            *(prepared.stepper, case.speeds, direction, settings),
            journal=journal,
            name=direction,
            passed=passed,
        )
        for direction in case.directions
    ]
    return branches, kept


def _fe_wave(prepared: Prepared, wave: Wave) -> Iterator[ForceWave]:
    """Force over a cycle of each mesh, after the approach that the wave asks for."""
    motions: dict[float, Motion] = {}
    speeds = approach(wave)
    direction: Direction = "up" if speeds[-1] >= speeds[0] else "down"
    branch = sweep_branch(
        *(prepared.stepper, speeds, direction, DynamicSettings()),
        keep=motions.__setitem__,
    )
    last = branch.responses[-1]
    if last.status == Status.DIVERGED:
        yield from _no_waves(wave, branch.system)
    else:
        history = motions[last.frequency].history
        yield from _force_waves(wave, branch.system, last, history)


def approach(wave: Wave) -> list[float]:
    """Speeds on the way to the one of the wave, which is the last [Hz]."""
    if wave.from_speed_Hz is None:
        return [wave.speed_Hz]
    start, end = wave.from_speed_Hz, wave.speed_Hz
    count = math.ceil(abs(end - start) / APPROACH_STEP - 1e-9)
    return [float(f) for f in np.linspace(start, end, count + 1)]


def _no_waves(wave: Wave, system: LumpedSystem) -> Iterator[ForceWave]:
    """NaN for a motion that diverged."""
    for m in range(len(system.excitations)):
        yield ForceWave(wave.label, m + 1, np.full(WAVE_POINTS, np.nan), math.nan)


def _force_waves(
    wave: Wave, system: LumpedSystem, response: Response, history: History
) -> Iterator[ForceWave]:
    for m, rate in enumerate(system.train.mesh_rates):
        period = 1.0 / (response.frequency * float(rate))
        force = force_cycle(history, m, period)
        yield ForceWave(wave.label, m + 1, force, float(response.contact_loss[m]))


def _lumped_branches(task: Task, system: LumpedSystem, report: Report) -> list[Branch]:
    """Nothing is kept in between, it takes less than a second."""
    branches = sweep_all(
        *([system], task.case.speeds, task.case.directions, Settings()),
        partial(report, f"{task.source} {task.torque:g} N m"),
        workers=1,
    )
    if not all(branch.complete or _diverged(branch) for branch in branches):
        raise KeyboardInterrupt  # that `sweep_all` has turned into short branches
    return branches


def _diverged(branch: Branch) -> bool:
    return bool(branch.responses) and branch.responses[-1].status == Status.DIVERGED


def _grid(system: LumpedSystem, frequency: float, settings: Settings) -> int:
    """Steps of a common period."""
    return system.samples(steps_per_period(system, frequency, settings))[0].size


def _lumped_wave(system: LumpedSystem, wave: Wave) -> Iterator[ForceWave]:
    start = wave.speed_Hz if wave.from_speed_Hz is None else wave.from_speed_Hz
    try:
        state = arrive(system, start, wave.speed_Hz)
    except DivergedError:
        return _no_waves(wave, system)
    response, history = respond_with_history(system, wave.speed_Hz, state=state)
    if response.status == Status.DIVERGED:
        return _no_waves(wave, system)
    return _force_waves(wave, system, response, history)


def _statics(
    task: Task, excitations: Excitations, mesh: int, excitation: MeshExcitation
) -> Statics:
    """Static deflection of a mesh (from 0) under the task's torque."""
    gear_set = task.gear_set
    torque = mesh_torques_at(gear_set, task.torque)[mesh]
    force = torque / gear_set.meshes[mesh].pair.driver.base_radius
    if task.model is None:
        free = excitations.table(gear_set, mesh, torque)
        table = _table_with_friction(task, mesh, torque, free)
        return Statics(
            mesh + 1,
            force,
            table.position,
            table["ste_m"][0],
            table["ste_m"][0] - free["ste_m"][0],
            free["n_pairs"][0] == 1,
        )
    position = np.arange(WAVE_POINTS) / WAVE_POINTS
    deflection = static_deflection(excitation, force, position)
    still, none = np.zeros_like(position), np.zeros(position.size, bool)
    return Statics(mesh + 1, force, position, deflection, still, none)


def _table_with_friction(
    task: Task, mesh: int, torque: float, free: MeshTable
) -> MeshTable:
    if task.case.friction == 0.0:
        return free
    settings = replace(Source().statics, friction=task.case.friction)
    return solve_mesh(task.gear_set, mesh, [torque], settings).table


def static_deflection(
    excitation: MeshExcitation, force: float, position: Array
) -> Array:
    """Deflection [m] at mesh positions (n,) under a force [N], by bisection.

    It solves sum of k (deflection - gap) over the pairs in contact = force.
    """
    k, gap = (
        np.array([getattr(pair, name)(position) for pair in excitation.pairs])
        for name in ("stiffness", "gap")
    )
    gap = np.where(k > 0.0, gap, np.inf)
    low = gap.min(axis=0)
    high = low + force / np.where(gap == low, k, 0.0).max(axis=0)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        carried = np.where(k > 0.0, k * np.maximum(middle - gap, 0.0), 0.0).sum(axis=0)
        low, high = (
            np.where(carried < force, middle, low),
            np.where(carried < force, high, middle),
        )
    return high
