"""Kernels compiled before they are needed, by small uses of the library."""

from __future__ import annotations

import logging
import multiprocessing
import re
import signal
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import lumped
from fegear.files.errors import InputError
from fegear.studies import load_study
from fegear.studies.page import Page, RowTable
from fegear.studies.problem import Job, Task
from fegear.studies.registry import commands
from fegear.studies.result import StudyResult
from fegear.studies.settings import display_name, setting
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table
from fegear.studies.trains.gear_sets import GearSetRef
from lumped.common.compiled import CACHE_SUFFIX, CompileCount, kernel_cache

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from fegear.train.model_settings import LumpedModel

PAIR, GEARBOX, MACHINE = "liu-pair", "seed-five-speed", "roots-scaled"
SPEED = 1000.0  # Hz, of the first mesh
DECORATED = re.compile(
    r"^@(compiled|not_allocating|compiled_part|shared_part|inlined|allocating)$", re.M
)
SPUR = """
name = "spur"
[excitation]
frequency_Hz = 25
amplitude_mm = 0.15
[[wheel]]
name = "wheel"
base_radius_mm = 40
inertia_kg_m2 = 1e-3
tooth_play_mm = 0.1
tooth_restitution = 0.8
"""
PATIENCE = 0.2  # s between looks at whether the run is to end
COLUMNS = "directory", "functions", "signatures"


def _study(command: str, **settings: Any) -> Any:
    """A study, or None where its command is not there."""
    return load_study(command)(**settings) if command in commands() else None


def _swept(model: LumpedModel, **settings: Any) -> Study | None:
    swept = {"gear_set": PAIR, "torque": [100.0], "speeds": [SPEED]}
    return _study("sweep", **swept, model=model, **settings)


def _damped(model: LumpedModel) -> Study | None:
    over = {"over": "damping_ratio=0.04,0.05", "at": SPEED}
    return _study("bifurcations", gear_set=PAIR, model=model, **over)


def _statics() -> Iterator[Study | None]:
    from fegear.statics.settings import StaticsSettings

    elements = StaticsSettings(resolution="coarse", positions=4)
    yield _study("stiffness", gear_set=PAIR, torque=[100.0], elements=elements)
    at = {"gear_set": PAIR, "torque": [100.0], "starts": 1}
    yield _study("relief", **at, max_relief_um=1.0, elements=elements)


def _rectangular(**settings: Any) -> LumpedModel:
    """A lumped model without finite elements."""
    from fegear.statics.stiffness_source import StiffnessSource
    from fegear.train.model_settings import LumpedModel

    return LumpedModel(stiffness=StiffnessSource(kind="rectangular"), **settings)


def _springs() -> Iterator[Study | None]:
    model = _rectangular()
    yield _swept(model)
    yield _swept(replace(model, friction=0.1, bending=0.0))
    yield _study("branches", gear_set=PAIR, model=model, speeds=(SPEED, SPEED + 10.0))
    yield _damped(model)
    over = {"over": "friction=0:0.1:2", "speeds": "1400:1500:100"}
    yield _study("stability", gear_set=PAIR, model=replace(model, bending=0.4), **over)


def _bearings() -> Iterator[Study | None]:
    model = _rectangular(number=1, translations=True, bearings="rolling")
    edits = ("gear.1.ball_bearing={balls=9,ball_diameter_mm=8,pitch_diameter_mm=39}",)
    gear_set = GearSetRef(name=PAIR, edits=edits)
    at = {"gear_set": gear_set, "torque": [100.0], "speeds": [SPEED]}
    yield _study("sweep", model=model, **at)


def _adaptive() -> Iterator[Study | None]:
    from lumped.steady.integration_settings import Settings

    yield _swept(_rectangular(), integration=Settings(method="dopri5"))


def _coupled() -> Iterator[Study | None]:
    from fegear.statics.stiffness_source import StiffnessSource
    from fegear.train.model_settings import LumpedModel

    coarse = StiffnessSource(resolution="coarse")
    model = LumpedModel(number="coupled", stiffness=coarse)
    yield _swept(model)
    yield _damped(model)


def _elements() -> Iterator[Study | None]:
    from fegear.dynamics.build import FiniteElements
    from fegear.dynamics.stepper import DynamicSettings
    from fegear.statics.stiffness_source import StiffnessSource

    settings = {
        "source": StiffnessSource(resolution="coarse"),
        "integration": DynamicSettings(max_periods=1, windows=1, multiples=1, steps=8),
    }
    for elements in (
        FiniteElements(fidelity="quasistatic"),
        FiniteElements(fidelity="full", mesh=0.1, friction=0.1),
    ):
        at = {"torque": [100.0], "speeds": [SPEED], "direction": "up"}
        yield _study("dynamics", gear_set=PAIR, elements=elements, **at, **settings)


def _rattle() -> Iterator[Study | None]:
    from lumped.rattle.arcs import arcs_of, history_of
    from lumped.rattle.return_map import follow
    from lumped.rattle.sticking import sticking_from, sticking_motions

    one = {"max_liftoffs": 1}
    over = {"over": ("epsilon=0.09:0.1",), "starts": 1, "runs": 2}
    yield _study("rattle noise", machine=MACHINE, starts=2, turns=2)
    yield _study("rattle basin", machine=MACHINE, grid=5)
    yield _study("rattle periodic", machine=MACHINE, **one)
    yield _study("rattle bifurcation", machine=MACHINE, **one, **over)
    yield _study("rattle manifold", machine=MACHINE, length=1.0, preimages=0)
    noise = _study("rattle noise", machine=MACHINE)
    if noise is not None:
        machine = noise.named.machine
        history_of(machine, arcs_of(machine, follow(machine, (0.0, 3.0), 2)))
        sticking_from(machine, (0.3, 0.5))
        sticking_motions(replace(machine, restitution=0.0))
    # last, as what is compiled before a use is reported with it
    yield _study("rattle noise", machine="roots-a-sprung", starts=2, turns=2)


def _clatter() -> Iterator[Study | None]:
    yield _study("clatter", gearbox=GEARBOX, seconds=0.4)
    with TemporaryDirectory() as folder:
        spur = Path(folder) / "spur.toml"
        spur.write_text(SPUR, "utf-8")
        for kind in ("implicit", "fermi"):
            yield _study("clatter", gearbox=str(spur), seconds=1.0, kind=kind)


# by name, the number of uses and what they are; those that take longest come first,
# and what shares kernels is in one list
USES: Mapping[str, tuple[int, Callable[[], Iterator[Study | None]]]] = {
    "coupled": (2, _coupled),
    "springs": (5, _springs),
    "elements": (2, _elements),
    "clatter": (3, _clatter),
    "adaptive": (1, _adaptive),
    "bearings": (1, _bearings),
    "statics": (2, _statics),
    "rattle": (6, _rattle),
}


@dataclass(frozen=True, kw_only=True)
class Warmup(Study, command="warmup", example="warmup"):
    """Compile all kernels on all cores, for later runs.

    Without it each command compiles what it needs when it is first used. Ctrl-C keeps
    what is compiled by then, and the next run goes on from there.
    """

    pictures = NO_PICTURES

    only: tuple[str, ...] = setting(
        (),
        f"Compile these kernels alone: {', '.join(USES)}; may be repeated. "
        "[default: all]",
        metavar="NAME",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.only:
            if name not in USES:
                message = (
                    f"{display_name(self, 'only')} = {name}; allowed {', '.join(USES)}"
                )
                raise InputError(message)

    def tasks(self) -> Iterator[Task]:
        if None in map(kernel_cache, kernel_folders()):
            raise InputError(
                "compiled kernels cannot be kept, no cache directory can be written; "
                "set NUMBA_CACHE_DIR to one that can"
            )
        for name, (count, _) in USES.items():
            if name in self.only or not self.only:
                yield Task(name, partial(_compile, name), size=count)

    def gather(self, results: Mapping[str, set[str]]) -> WarmupResult:
        return WarmupResult(self, len(set[str]().union(*results.values())))


@dataclass(frozen=True, eq=False, repr=False)
class WarmupResult(StudyResult):
    """What was compiled, and what the cache holds.

    compiled : signatures that were not in the cache
    """

    study: Warmup
    compiled: int

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Functions and signatures that each directory of the cache holds."""
        rows = []
        for directory in filter(None, map(kernel_cache, kernel_folders())):
            files = [path.name for path in directory.rglob(f"*{CACHE_SUFFIX}")]
            functions = {name.rsplit(".", 2)[0] for name in files}
            values = str(directory), len(functions), len(files)
            rows.append(dict(zip(COLUMNS, values, strict=True)))
        return rows

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            "kernels": list(self.study.only or USES),
            "compiled_signatures": self.compiled,
            "functions": sum(row["functions"] for row in self.rows),
            "signatures": sum(row["signatures"] for row in self.rows),
            "cache": self.rows,
        }

    @property
    def table(self) -> Table:
        return Table(COLUMNS, lambda: [list(row.values()) for row in self.rows])

    def page(self) -> Page:
        values = self.summary
        yield RowTable(self.rows, {name: partial(_word, name) for name in COLUMNS})
        yield (
            f"compiled {self.compiled} signatures; the cache holds "
            f"{values['signatures']} of {values['functions']} functions"
        )


def _word(name: str, row: Mapping[str, Any]) -> str:
    return str(row[name])


@cache
def kernel_folders() -> tuple[Path, ...]:
    """Folders of the sources that contain compiled functions."""
    roots = (Path(__file__).parents[2], Path(lumped.__file__).parent)
    return tuple(
        sorted(
            {
                path.parent
                for root in roots
                for path in root.rglob("*.py")
                if DECORATED.search(path.read_text("utf-8"))
            }
        )
    )


def _compile(name: str, job: Job) -> set[str]:
    """Use kernels in a process of their own; names of signatures that it compiled."""
    context = multiprocessing.get_context("spawn")  # forks copy locks of threads
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_use, args=(name, there), daemon=True)
    process.start()
    there.close()
    done, compiled = 0, set[str]()
    try:
        while True:
            job.report("kernels", done, USES[name][0])
            if not here.poll(PATIENCE):
                continue
            said = here.recv()
            if isinstance(said, Exception):
                raise said
            done, compiled = done + 1, said
    except EOFError:  # at its end
        process.join()
        if process.exitcode:
            failure = f"kernels {name}: the process that compiles them ended with"
            raise ChildProcessError(f"{failure} {process.exitcode}") from None
        return compiled
    finally:
        process.terminate()
        process.join()


def _use(name: str, said: Connection) -> None:
    """What a process does: after each use it says which signatures it compiled."""
    from fegear.studies.running import run

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it is ended after Ctrl-C
    logging.getLogger("lumped").setLevel(logging.ERROR)
    try:
        with CompileCount() as count:
            for study in USES[name][1]():
                if study is not None:
                    run(study, workers=1)
                said.send(count.names)
    except Exception as error:
        said.send(error)
