"""Loose wheels of a gearbox between the edges of their plays."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

from fegear.commands.clatter.gearboxes import NamedGearbox, load_gearbox
from fegear.commands.clatter.result import ClatterResult
from fegear.files.errors import InputError
from fegear.files.output import INTO_PICTURE
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.settings import argument, setting
from fegear.studies.study import PLOT, Study
from lumped.clatter.gearbox import LooseWheel
from lumped.clatter.group_runs import GroupRun, MapKind, run_events, run_map
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import Impacts, State, centred_state, random_state
from lumped.clatter.maps import MapName
from lumped.common.options import Range

MAX_IMPACTS = 20_000_000  # that are kept at a time


@dataclass(frozen=True, kw_only=True)
class Clatter(
    Study,
    command="clatter",
    example="clatter seed-five-speed --seconds 20 -o i.csv --plot motion.png",
):
    """Clattering gearboxes: impacts of loose wheels.

    Between impacts wheels move freely. Impacts in several clearances may coincide, and
    impacts at ever shorter intervals end in contact. The noise level is the sum of
    squared impact speeds over the time.
    """

    resumes = True
    pictures = PLOT | {
        "attractor": "Draw phase and speed of the impacts of the wheel's teeth "
        f"{INTO_PICTURE}."
    }

    gearbox: str = argument(
        "GEARBOX", "Built-in gearbox or path of a TOML file.", reads=True
    )
    seconds: float = setting(10.0, "Simulated time [s].", Range(1e-6, 1e7, "s"))
    impacts: int = setting(
        MAX_IMPACTS,
        "Stop after this many impacts of a wheel and of those that mesh with it.",
        Range(1, MAX_IMPACTS),
    )
    seed: int | None = setting(
        None,
        "Seed of random initial positions. [default: start in the middle of every"
        " clearance]",
        Range(0, 2**32),
    )
    kind: MapKind = setting(
        "event",
        "How impacts are computed: by events of all clearances, or for the teeth "
        "of a spur wheel by the implicit map or the Fermi accelerator.",
        option="--map",
    )
    chaos: bool = setting(
        False,
        "Also compute the largest Lyapunov exponent and the correlation dimension"
        " of the impacts.",
    )
    wheel: str | None = setting(None, "Wheel to draw and to map. [default: the first]")

    def unused_options(self, outputs: Collection[str]) -> Iterator[tuple[str, str]]:
        if self.kind != "event":
            yield from (
                (name, "needs {kind} event") for name in ("resume", "overwrite", "plot")
            )
        elif not {"plot", "attractor"} & set(outputs):
            yield "wheel", "needs {plot}, {attractor} or another {kind}"

    def start_of(self, group: WheelGroup) -> State:
        """State from which a group of wheels starts.

        Parameters
        ----------
        group : WheelGroup
            Wheels whose motions depend on each other.

        Returns
        -------
        State
            Wheels centred in their clearances, or at random by `seed`.
        """
        return (
            centred_state(group)
            if self.seed is None
            else random_state(group, self.seed)
        )

    def prepare(self) -> ClatterProblem:
        return ClatterProblem(self, load_gearbox(self.gearbox))


@dataclass(frozen=True, eq=False)
class ClatterProblem(Problem):
    """Loose wheels of a gearbox."""

    study: Clatter
    named: NamedGearbox

    @property
    def wheel(self) -> LooseWheel:
        """The wheel that is drawn, and mapped."""
        wheels = {wheel.name: wheel for wheel in self.named.gearbox.wheels}
        name = next(iter(wheels)) if self.study.wheel is None else self.study.wheel
        if name not in wheels:
            names = ", ".join(wheels)
            raise InputError(f"wheel = {name}; {self.named.name} has {names}")
        return wheels[name]

    @property
    def inputs(self) -> Mapping[str, str]:
        names = "seconds", "impacts", "seed"
        settings = {name: str(getattr(self.study, name)) for name in names}
        return settings | {"gearbox": self.named.text}

    def tasks(self) -> Iterator[Task]:
        study, box, wheel = self.study, self.named.gearbox, self.wheel
        if study.seconds > box.excitation.lasts * (1.0 + 1e-12):
            raise InputError(
                f"seconds = {study.seconds:g}; the speed file of {self.named.name} "
                f"ends after {box.excitation.lasts:.9g} s"
            )
        if study.kind != "event":
            group = WheelGroup((wheel,), box.excitation)
            yield Task(wheel.name, partial(self._iterate_map, study.kind, group))
            return
        for wheels in box.groups:
            group = WheelGroup(wheels, box.excitation)
            yield Task(wheels[0].name, partial(self._follow_motion, group))

    def _iterate_map(self, name: MapName, group: WheelGroup, job: Job) -> GroupRun:
        study = self.study
        try:
            start = study.start_of(group)
            return run_map(group, name, start, study.seconds, study.impacts)
        except ValueError as error:
            wheel = self.wheel.name
            raise InputError(f"{self.named.name}: wheel {wheel} {error}") from None

    def _follow_motion(self, group: WheelGroup, job: Job) -> GroupRun:
        study, state = self.study, job.state
        now = study.start_of(group) if state is None else State(**state)
        before: list[Impacts] = job.records
        name, period = group.wheels[0].name, group.excitation.period

        def report(count: int) -> None:
            part = max(count / study.impacts, now.time * period / study.seconds)
            job.report(f"wheel {name}", round(1000 * min(part, 1.0)), 1000)

        def passed(part: Impacts, count: int) -> None:
            job.add_record(part, vars(now))
            report(count)

        report(sum(map(len, before)))
        return run_events(group, now, study.seconds, study.impacts, before, passed)

    def gather(self, results: Mapping[str, GroupRun]) -> ClatterResult:
        runs = tuple(results.values())
        return ClatterResult(self.study, self.named, self.wheel, runs)
