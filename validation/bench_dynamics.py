"""Run time against error of the finite-element dynamics, and how it grows.

Every run starts at rest and passes the same number of mesh periods, so that errors
are those of one well-defined motion and no branch can be missed. An error is the RMS
of the difference of the dynamic transmission error over the RMS of its vibration.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fegear.dynamics.build import FiniteElements, prepare
from fegear.dynamics.respond import DynamicSettings, Stepper
from fegear.excitation import Excitations
from fegear.gearset.model import GearSet
from lumped.system import LumpedSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Report = Callable[[str, int, int], None]
PERIODS = 8  # of the first mesh, that every run passes
SPEEDS = (0.5, 0.9, 1.5)  # over the leading natural frequency
STEPS = (32, 64, 128, 256, 512)
FINEST_STEPS = 2048
CUTOFFS = (10e3, 15e3, 20e3, 30e3, 50e3, 100e3)
MESHES = (0.25, 0.35, 0.5)
FINEST_MESH = 0.7
COMMON = 128  # steps of a period in all studies but that of the steps
REPEATS = 3
ROWS = (2, 4, 8)  # of gears


@dataclass(frozen=True)
class Point:
    """A study at one setting.

    setting : steps per period, cut-off of the elastic modes [Hz], or refinement of
        the mesh; freedoms : elastic ones of all gears
    us_per_step : largest over the speeds; prepare_s : from the gear set to the stepper
    error_median, error_largest : over speeds and meshes
    """

    study: str
    setting: float
    freedoms: int
    prepare_s: float
    us_per_step: float
    error_median: float
    error_largest: float


@dataclass(frozen=True, eq=False)
class Bench:
    """A gear set at a torque on its input gear [N m], and its Model-1."""

    gear_set: GearSet
    torque: float
    reference: LumpedSystem
    excitations: Excitations

    @property
    def speeds(self) -> list[float]:
        """Frequencies of the first mesh [Hz]."""
        modes = self.reference.modes
        energy = modes.mesh_energy.sum(axis=0)
        leading = float(modes.frequency_Hz[np.flatnonzero(energy > 0.5)[0]])
        return [part * leading for part in SPEEDS]

    def stepper(self, elements: FiniteElements) -> tuple[Stepper, int, float]:
        """A stepper, its elastic freedoms, and the seconds that it took."""
        start = time.perf_counter()
        prepared = prepare(
            self.gear_set,
            self.torque,
            self.reference,
            self.speeds,
            elements,
            DynamicSettings(),
            self.excitations,
        )
        return prepared.stepper, sum(prepared.elastic), time.perf_counter() - start


def run_benchmark(
    bench: Bench, report: Report = lambda what, done, total: None
) -> Iterator[Point]:
    """Points one by one, so that those finished are kept."""
    total = len(STEPS) + len(CUTOFFS) + 1 + len(MESHES) + 1
    done = 0

    def tell(what: str) -> None:
        nonlocal done
        report(what, done, total)
        done += 1

    tell("steps")
    fine, freedoms, seconds = bench.stepper(FiniteElements(fidelity="reduced"))
    expected = [run(fine, f, FINEST_STEPS)[0] for f in bench.speeds]
    for steps in STEPS:
        yield _point("steps", steps, freedoms, seconds, bench, fine, steps, expected)
        tell("steps")
    tell("whole gears")
    elements = FiniteElements(fidelity="full", mesh=FINEST_MESH)
    whole, freedoms, seconds = bench.stepper(elements)
    found = [run(whole, f, COMMON) for f in bench.speeds]
    expected = [waveform for waveform, _ in found]
    slowest = max(us for _, us in found)
    yield Point("mesh", FINEST_MESH, freedoms, seconds, slowest, math.nan, math.nan)
    for mesh in MESHES:
        tell(f"mesh {mesh:g}")
        elements = FiniteElements(fidelity="full", mesh=mesh)
        made = bench.stepper(elements)
        yield _point("mesh", mesh, made[1], made[2], bench, made[0], COMMON, expected)
    tell("quasistatic")
    made = bench.stepper(FiniteElements(fidelity="quasistatic"))
    yield _point("modes", 0.0, made[1], made[2], bench, made[0], COMMON, expected)
    for cutoff in CUTOFFS:
        tell(f"modes below {cutoff / 1e3:g} kHz")
        made = bench.stepper(FiniteElements(fidelity="reduced", cutoff_Hz=cutoff))
        yield _point(
            "modes", cutoff, made[1], made[2], bench, made[0], COMMON, expected
        )


def run(stepper: Stepper, frequency: float, steps: int) -> tuple[Array, float]:
    """(deflection (t, m) from rest on, microseconds per step of the fastest period)."""
    state, parts = stepper.start(), []
    size = 1.0 / (frequency * steps)
    length = stepper.model.reference.train.common_period[0]
    stepper.march(state, frequency, size, 2, steps)  # compiles and factorises
    best = math.inf
    for _ in range(math.ceil(PERIODS / length)):
        start = time.perf_counter()
        state, motion = stepper.march(state, frequency, size, steps * length, steps)
        best = min(best, time.perf_counter() - start)
        parts.append(motion.history.deflection[:-1])
    return np.concatenate(parts), 1e6 * best / (steps * length)


def _point(
    study: str,
    setting: float,
    freedoms: int,
    prepare_s: float,
    bench: Bench,
    stepper: Stepper,
    steps: int,
    expected: Sequence[Array],
) -> Point:
    errors, slowest = [], 0.0
    for frequency, reference in zip(bench.speeds, expected, strict=True):
        found, us = run(stepper, frequency, steps)
        slowest = max(slowest, us)
        errors.append(waveform_error(found, reference))
    every = np.concatenate(errors)
    return Point(
        study=study,
        setting=setting,
        freedoms=freedoms,
        prepare_s=prepare_s,
        us_per_step=slowest,
        error_median=float(np.median(every)),
        error_largest=float(every.max()),
    )


def waveform_error(found: Array, reference: Array) -> Array:
    """Of each mesh (m,), at the times that both (t, m) have."""
    rows = math.gcd(len(found), len(reference))
    one, two = (w[:: len(w) // rows] for w in (found, reference))
    return np.sqrt(((one - two) ** 2).mean(axis=0)) / two.std(axis=0)


@dataclass(frozen=True)
class Growth:
    """Microseconds per step over the gears in a row, and all coordinates."""

    gears: int
    coordinates: int
    us_per_step: float


def growth(row: Bench) -> Growth:
    """Of the bench of a row of gears, in the reduced fidelity."""
    stepper, _, _ = row.stepper(FiniteElements(fidelity="reduced", cutoff_Hz=30e3))
    best = min(run(stepper, row.speeds[-1], COMMON)[1] for _ in range(REPEATS))
    return Growth(len(row.gear_set.gears), stepper.model.size, best)


def row_of_gears(gear_set: GearSet, count: int) -> GearSet:
    """The first mesh's gears in turns, each driving the next."""
    mesh = gear_set.meshes[0]
    kinds = [gear_set.gears[g] for g in (mesh.driver, mesh.driven)]
    gears = [replace(kinds[i % 2], name=f"gear {i + 1}") for i in range(count)]
    turns = mesh, replace(mesh, pair=mesh.pair.swapped, torques=())
    meshes = [
        replace(turns[i % 2], driver=i, driven=i + 1, phase=0.0, center_line=0.0)
        for i in range(count - 1)
    ]
    meshes[1:] = [replace(each, torques=()) for each in meshes[1:]]
    return replace(gear_set, gears=tuple(gears), meshes=tuple(meshes), shafts=())


def observed_order(points: Sequence[Point]) -> float:
    """Of the median error over the steps."""
    own = [p for p in points if p.study == "steps"]
    steps, errors = np.array([(p.setting, p.error_median) for p in own]).T
    return float(-np.polyfit(np.log(steps), np.log(errors), 1)[0])


def draw_points(points: Sequence[Point], title: str) -> Figure:
    """Time per mesh period over the median error, a line for each study."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 5.0), layout="constrained")
    axes = figure.subplots()
    names = {
        "steps": "reduced: steps per period",
        "modes": "reduced: cut-off [kHz], 0 is quasistatic",
        "mesh": "full: refinement of the mesh",
    }
    for (study, name), marker in zip(names.items(), "osD", strict=True):
        own = [p for p in points if p.study == study and p.error_median > 0.0]
        steps = [p.setting if study == "steps" else COMMON for p in own]
        y = [1e-3 * p.us_per_step * n for p, n in zip(own, steps, strict=True)]
        x = [p.error_median for p in own]
        axes.loglog(x, y, f"{marker}-", label=name)
        for point, error, ms in zip(own, x, y, strict=True):
            value = point.setting / (1e3 if study == "modes" else 1.0)
            axes.annotate(
                f"{value:g}",
                (error, ms),
                textcoords="offset points",
                xytext=(4, 4),
                fontsize=7,
            )
    axes.set_xlabel("relative error of the dynamic transmission error, median")
    axes.set_ylabel("time per mesh period [ms]")
    axes.grid(alpha=0.25, which="both")
    axes.legend()
    axes.set_title(title, fontsize=11)
    return figure
