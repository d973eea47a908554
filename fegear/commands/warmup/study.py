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

    from fegear.statics.settings import StaticsSettings
    from fegear.train.model_settings import LumpedModel

PAIR, GEARBOX, MACHINE = "liu-pair", "seed-five-speed", "roots-scaled"
ON_SHAFTS = "turbo-pair"
SPEED = 1000.0  # Hz, of the first mesh
COMPILED_DECORATOR = re.compile(
    r"^@(compiled|not_allocating|compiled_part|shared_part|inlined|allocating)$", re.M
)
SPUR_GEARBOX_TEXT = """
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
POLL_S = 0.2  # s between looks at whether the run is to end
COLUMNS = "directory", "functions", "signatures"


def _study_or_none(command: str, **settings: Any) -> Any:
    """A study, or None where its command is not there."""
    return load_study(command)(**settings) if command in commands() else None


def _sweep_study(model: LumpedModel, **settings: Any) -> Study | None:
    common_settings = {"gear_set": PAIR, "torque": [100.0], "speeds": [SPEED]}
    return _study_or_none("sweep", **common_settings, model=model, **settings)


def _bifurcations_over_damping(model: LumpedModel) -> Study | None:
    axis_settings = {"over": "damping_ratio=0.04,0.05", "at": SPEED}
    return _study_or_none("bifurcations", gear_set=PAIR, model=model, **axis_settings)


def _statics_studies() -> Iterator[Study | None]:
    from fegear.statics.settings import StaticsSettings

    elements = StaticsSettings(resolution="coarse", positions=4)
    _place_a_slice(elements)
    yield _study_or_none("stiffness", gear_set=PAIR, torque=[100.0], elements=elements)
    settings = {"gear_set": PAIR, "torque": [100.0], "starts": 1}
    yield _study_or_none("relief", **settings, max_relief_um=1.0, elements=elements)


def _place_a_slice(elements: StaticsSettings) -> None:
    """Use what contact over the face width needs, without its finite elements."""
    import numpy as np

    from fegear.contact.plane.constants import kernel_inputs
    from fegear.contact.plane.kernels.compliance import PATCH
    from fegear.contact.width.places import place_slices
    from fegear.gearset import load_gear_set
    from fegear.statics.contact_problem import contact_problem

    problem = contact_problem(load_gear_set(PAIR), 0, elements)
    mesh, flanks, _ = kernel_inputs(problem)
    patches = np.zeros(1, PATCH).view(np.recarray)
    place_slices(mesh, flanks, patches, np.array([problem.pair.pitch_point]))


def _model_of_rectangular_waves(**settings: Any) -> LumpedModel:
    """A lumped model without finite elements."""
    from fegear.statics.excitation_settings import ExcitationSettings
    from fegear.train.model_settings import LumpedModel

    return LumpedModel(excitation=ExcitationSettings(kind="rectangular"), **settings)


def _lumped_studies() -> Iterator[Study | None]:
    model = _model_of_rectangular_waves()
    yield _sweep_study(model)
    yield _sweep_study(replace(model, friction=0.1, bending=0.0))
    yield _study_or_none(
        "branches", gear_set=PAIR, model=model, speeds=(SPEED, SPEED + 10.0)
    )
    yield _bifurcations_over_damping(model)
    axis_settings = {"over": "friction=0:0.1:2", "speeds": "1400:1500:100"}
    yield _study_or_none(
        "stability", gear_set=PAIR, model=replace(model, bending=0.4), **axis_settings
    )


def _bearing_studies() -> Iterator[Study | None]:
    model = _model_of_rectangular_waves(number=1, translations=True, bearings="rolling")
    edits = ("gear.1.ball_bearing={balls=9,ball_diameter_mm=8,pitch_diameter_mm=39}",)
    gear_set = GearSetRef(name=PAIR, edits=edits)
    settings = {"gear_set": gear_set, "torque": [100.0], "speeds": [SPEED]}
    yield _study_or_none("sweep", model=model, **settings)


def _space_studies() -> Iterator[Study | None]:
    from fegear.statics.excitation_settings import ExcitationSettings
    from fegear.train.model_settings import LumpedModel

    coarse_mesh = ExcitationSettings(resolution="coarse", plane="width", positions=4)
    model = LumpedModel(number=1, motion="space", excitation=coarse_mesh)
    settings = {"gear_set": ON_SHAFTS, "torque": [100.0], "speeds": [SPEED]}
    yield _study_or_none("sweep", model=model, **settings)


def _adaptive_studies() -> Iterator[Study | None]:
    from lumped.steady.integration_settings import Settings

    yield _sweep_study(
        _model_of_rectangular_waves(), integration=Settings(method="dopri5")
    )


def _coupled_studies() -> Iterator[Study | None]:
    from fegear.statics.excitation_settings import ExcitationSettings
    from fegear.train.model_settings import LumpedModel

    coarse_mesh = ExcitationSettings(resolution="coarse")
    model = LumpedModel(number="coupled", excitation=coarse_mesh)
    yield _sweep_study(model)
    yield _bifurcations_over_damping(model)


def _finite_element_studies() -> Iterator[Study | None]:
    from fegear.dynamics.build import FiniteElements
    from fegear.dynamics.stepper import DynamicSettings
    from fegear.statics.excitation_settings import ExcitationSettings

    settings = {
        "excitation": ExcitationSettings(resolution="coarse"),
        "integration": DynamicSettings(max_periods=1, windows=1, multiples=1, steps=8),
    }
    for elements in (
        FiniteElements(fidelity="quasistatic"),
        FiniteElements(fidelity="full", mesh=0.1, friction=0.1),
    ):
        sweep_settings = {"torque": [100.0], "speeds": [SPEED], "direction": "up"}
        yield _study_or_none(
            "dynamics", gear_set=PAIR, elements=elements, **sweep_settings, **settings
        )


def _rattle_studies() -> Iterator[Study | None]:
    from lumped.rattle.arcs import arcs_of, history_of
    from lumped.rattle.return_map import follow
    from lumped.rattle.sticking import sticking_from, sticking_motions

    one_liftoff = {"max_liftoffs": 1}
    axis_settings = {"over": ("epsilon=0.09:0.1",), "starts": 1, "runs": 2}
    yield _study_or_none("rattle noise", machine=MACHINE, starts=2, turns=2)
    yield _study_or_none("rattle basin", machine=MACHINE, grid=5)
    yield _study_or_none("rattle periodic", machine=MACHINE, **one_liftoff)
    yield _study_or_none(
        "rattle bifurcation", machine=MACHINE, **one_liftoff, **axis_settings
    )
    yield _study_or_none("rattle manifold", machine=MACHINE, length=1.0, preimages=0)
    noise = _study_or_none("rattle noise", machine=MACHINE)
    if noise is not None:
        machine = noise.named.machine
        history_of(machine, arcs_of(machine, follow(machine, (0.0, 3.0), 2)))
        sticking_from(machine, (0.3, 0.5))
        sticking_motions(replace(machine, restitution=0.0))
    # last, as what is compiled before a use is reported with it
    yield _study_or_none("rattle noise", machine="roots-a-sprung", starts=2, turns=2)


def _clatter_studies() -> Iterator[Study | None]:
    yield _study_or_none("clatter", gearbox=GEARBOX, seconds=0.4)
    with TemporaryDirectory() as folder:
        gearbox_file = Path(folder) / "spur.toml"
        gearbox_file.write_text(SPUR_GEARBOX_TEXT, "utf-8")
        for kind in ("implicit", "fermi"):
            yield _study_or_none(
                "clatter", gearbox=str(gearbox_file), seconds=1.0, kind=kind
            )


# by name, the number of uses and what they are; those that take longest come first,
# and what shares kernels is in one list
USES: Mapping[str, tuple[int, Callable[[], Iterator[Study | None]]]] = {
    "coupled": (2, _coupled_studies),
    "springs": (5, _lumped_studies),
    "elements": (2, _finite_element_studies),
    "clatter": (3, _clatter_studies),
    "adaptive": (1, _adaptive_studies),
    "bearings": (1, _bearing_studies),
    "space": (1, _space_studies),
    "statics": (2, _statics_studies),
    "rattle": (6, _rattle_studies),
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
                only = display_name(self, "only")
                raise InputError(f"{only} = {name}; allowed are {', '.join(USES)}")

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


@dataclass(frozen=True, eq=False)
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
        return Table.of_rows(self.rows, names=COLUMNS)

    def page(self) -> Page:
        values = self.summary
        yield RowTable(
            self.rows, {name: partial(_shown_value, name) for name in COLUMNS}
        )
        yield (
            f"compiled {self.compiled} signatures; the cache holds "
            f"{values['signatures']}, of {values['functions']} functions"
        )


def _shown_value(name: str, row: Mapping[str, Any]) -> str:
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
                if COMPILED_DECORATOR.search(path.read_text("utf-8"))
            }
        )
    )


def _compile(name: str, job: Job) -> set[str]:
    """Use kernels in a process of their own; names of signatures that it compiled."""
    context = multiprocessing.get_context("spawn")  # forks copy locks of threads
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_run_use, args=(name, sender), daemon=True)
    process.start()
    sender.close()
    finished_uses, compiled_names = 0, set[str]()
    try:
        while True:
            job.report("kernels", finished_uses, USES[name][0])
            if not receiver.poll(POLL_S):
                continue
            reply = receiver.recv()
            if isinstance(reply, Exception):
                raise reply
            finished_uses, compiled_names = finished_uses + 1, reply
    except EOFError:  # at its end
        process.join()
        if process.exitcode:
            failure = f"kernels {name}: the process that compiles them ended with"
            raise ChildProcessError(f"{failure} {process.exitcode}") from None
        return compiled_names
    finally:
        process.terminate()
        process.join()


def _run_use(name: str, reply_pipe: Connection) -> None:
    """What a process does: after each use it says which signatures it compiled."""
    from fegear.studies.running import run

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it is ended after Ctrl-C
    logging.getLogger("lumped").setLevel(logging.ERROR)
    try:
        with CompileCount() as count:
            for study in USES[name][1]():
                if study is not None:
                    run(study, workers=1)
                reply_pipe.send(count.names)
    except Exception as error:
        reply_pipe.send(error)
