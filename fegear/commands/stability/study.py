"""Parametric instability of a gear set with tooth friction."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal

from fegear.commands.stability.result import StabilityResult
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.studies.problem import Job, Task
from fegear.studies.settings import display_name, refusal, setting
from fegear.studies.study import Study
from fegear.studies.trains.axes import axis_setting
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.models import SLIDING, SPRINGS, lumped_model, tables_setting
from fegear.studies.trains.parametric import (
    OF_TEETH,
    TORQUE,
    ParametricProblem,
    ParametricStudy,
)
from fegear.studies.trains.speeds import (
    refuse_both,
    rpms_setting,
    speeds_setting,
    with_frequencies,
)
from fegear.train.model_settings import LumpedModel
from lumped.common.csv_text import format_exact
from lumped.common.options import Range
from lumped.stability.intervals import StabilityScan, scan_stability
from lumped.stability.periodic_system import PeriodicSystem, periodic_system
from lumped.steady.maps import Axis

MAX_CELLS = 4_000_000


@dataclass(frozen=True, kw_only=True)
class Stability(
    ParametricStudy,
    Study,
    command="stability",
    example="stability liu-pair --over friction=0:0.2:21 --speeds 500:6000:25",
):
    """Parametric instability of a train with tooth friction.

    Floquet multipliers over speed and one parameter while teeth stay in contact. The
    edges of unstable intervals are traced, including those of intervals that are
    narrower than the steps of speed. With --output each value is stored in FILE.partial
    until the file is written; --resume continues from there.
    """

    resumes = True
    partial = True
    unit = "value"

    over: Axis = axis_setting(
        "Parameter: friction (coefficient), friction_bending (ratio), a key of "
        "the gear set, torque_Nm or damping_ratio, with N values from A to B, or "
        "values with commas."
    )
    speeds: tuple[float, ...] = speeds_setting(
        (),
        "Mesh frequencies of the first mesh [Hz] of the chart; this or --rpm. "
        "[default: none]",
        allowed=Range(0.1, 1e6, "Hz"),
    )
    rpm: tuple[float, ...] = rpms_setting("--speeds")
    method: Literal["peano-baker", "exponential"] = setting(
        "peano-baker",
        "Method for Floquet multipliers. peano-baker: the series of the state "
        "transition; exponential: exponentials of the mean stiffness on parts of "
        "the cycle. `bench stability` compares both with integration.",
    )
    torque: float | None = torque_setting()
    model: LumpedModel = lumped_model(SPRINGS | SLIDING, 1)
    table: tuple[str, ...] = tables_setting()

    def __post_init__(self) -> None:
        super().__post_init__()
        over, rising = display_name(self, "over"), self.rising
        if self.over.name not in OF_TEETH and self.table:
            raise refusal(self, "table", f"{over} varies what tables hold")
        if self.model.number != 1:
            raise self.rejection("number", "allowed is 1, of tooth pairs")
        refuse_both(self, "speeds", "rpm")
        if not (self.speeds or self.rpm):
            speeds, rpm = display_name(self, "speeds"), display_name(self, "rpm")
            raise InputError(f"{speeds} A:B:STEP or {rpm} A:B:STEP is needed")
        if len(rising) < 2:
            raise InputError("speeds = 1 speed; two or more are needed")
        if len(rising) * len(self.over.values) > MAX_CELLS:
            raise InputError(
                f"over = {len(self.over.values)} values at {len(rising)} speeds; "
                f"allowed are {MAX_CELLS} cells"
            )

    @property
    def axes(self) -> tuple[Axis, ...]:
        return (self.over,)

    @property
    def rising(self) -> tuple[float, ...]:
        """Speeds in rising order, each once [Hz]; those in rpm until they are known."""
        return tuple(sorted(set(self.speeds or self.rpm)))

    def prepare(self) -> StabilityProblem:
        return StabilityProblem.of(with_frequencies(self, {"speeds": self.rpm}))


@dataclass(frozen=True, eq=False)
class StabilityProblem(ParametricProblem):
    """A train at each value of what varies."""

    study: Stability

    @cached_property
    def natural_Hz(self) -> list[float]:
        """Modes that strain a mesh, without friction, at the first value."""
        system = self._system_at(self.study.over.values[0])
        natural: list[float] = system.frequency_Hz.tolist()
        return natural

    @cached_property
    def _lock(self) -> threading.Lock:
        """One thread at a time solves finite elements."""
        return threading.Lock()

    def tasks(self) -> Iterator[Task]:
        _ = self.natural_Hz  # what cannot be computed is refused at once
        for value in self.study.over.values:
            yield Task(repr(value), partial(self._scan_speeds, value), size=1)

    def _scan_speeds(self, value: float, job: Job) -> StabilityScan:
        for column in job.records:
            return column
        with self._lock:
            system = self._system_at(value)
        try:
            column = scan_stability(system, self.study.rising, self.study.method)
        except ArithmeticError as error:
            raise InputError(f"{self.gears.name}: {error}") from None
        job.add_record(column, {})
        return column

    def _system_at(self, value: float) -> PeriodicSystem:
        try:
            return periodic_system(self.system((value,)))
        except InputError:
            raise
        except ValueError as error:
            raise InputError(f"{self.gears.name}: {error}") from None

    def gather(self, results: Mapping[str, StabilityScan | None]) -> StabilityResult:
        columns: list[StabilityScan] = []
        for column in results.values():
            if column is None:
                break
            columns.append(column)
        header = self.header("none")
        del header["integration"]
        study, name = self.study, self.study.over.name
        if TORQUE not in study.axis_names:
            header["torque_Nm"] = format_exact(self.reference_torque)
        header["method"] = study.method
        if len(columns) < len(study.over.values):
            header["incomplete"] = f"{len(columns)} of {len(study.over.values)} values"
        facts = self.facts(name, header, warnings=_warnings(name, columns))
        return StabilityResult(study, facts, tuple(columns), tuple(self.natural_Hz))


def _warnings(name: str, columns: Sequence[StabilityScan]) -> Iterator[str]:
    """Warn of what varies and changes nothing, to the bit."""
    others = columns[1:]
    if others and all((other.largest == columns[0].largest).all() for other in others):
        yield with_code("W16", f"{name} does not change the multipliers")
