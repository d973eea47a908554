"""Run time of the lumped models over the number of gears, set-up and sweep apart."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fegear.gearset.model import GearSet
from fegear.gearset.read import make_gear_set
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.progress import Progress
from lumped.steady.sweep import DIRECTIONS, sweep
from lumped.train.system import LumpedSystem
from validation.commands.bench import benchmark as bench

MODELS = {
    "model 1": LumpedModel(number=1),
    "coupled": LumpedModel(number="coupled"),
}
# of chains
MODULE_MM = 2.5
FACE_WIDTH_MM = 20.0
FIRST_TEETH, TEETH_STEP, TEETH_RANGE = 23, 10, 27  # 10 and 27 share no factor
HUB_RATIO = 0.5  # of the pitch radius
CENTER_LINES_DEG = 0.0, 40.0  # of odd and of even meshes
DISTANCE_RATIO = 1.002  # of the sum of pitch radii, for some backlash
TORQUE_NM = 100.0


@dataclass(frozen=True)
class Sizes:
    """gears : of the chains; speeds_Hz : of all meshes"""

    gears: tuple[int, ...] = (2, 3, 4, 6, 8, 12, 16)
    speeds_Hz: tuple[float, ...] = tuple(np.linspace(1000.0, 3000.0, 21).tolist())


FULL = Sizes()
QUICK = Sizes(gears=FULL.gears[:2], speeds_Hz=FULL.speeds_Hz[:2])


@dataclass(frozen=True)
class ChainCost:
    """Processor times of a chain in one thread.

    set-up is from the gear set to the equilibrium at rest, with what bodies' elements
    give on disk; sweep is over all speeds, up and down
    """

    study: str
    gears: int
    coordinates: int
    contacts: int
    setup_s: float
    sweep_s: float
    ms_per_period: float


def measure(report: Progress, sizes: Sizes = FULL) -> bench.Benchmark:
    """Chains of different gears, each of which drives the next."""
    rows, interrupted = bench.collect(_cost_rows(report, sizes), bench.POINTS)
    points = rows[bench.POINTS]
    return bench.Benchmark(
        name="growth",
        title=f"Chains of gears, {2 * len(sizes.speeds_Hz)} speeds: processor time",
        about="Set-up and sweep of chains of different gears by model 1 and by the "
        "coupled model, in one thread; compliances and modes of the bodies on disk.",
        tables=bench.plain(rows),
        panels=[_panel(points)],
        findings=_findings(points),
        interrupted=interrupted,
    )


def _cost_rows(report: Progress, sizes: Sizes) -> Iterator[tuple[str, Any]]:
    for model in MODELS.values():
        _swept_branches(
            _timed_system(sizes.gears[0], model), sizes.speeds_Hz
        )  # compiles what is not compiled yet
    done, total = 0, len(sizes.gears) * len(MODELS)
    for gears in sizes.gears:
        for study, model in MODELS.items():
            report(f"{study}, {gears} gears", done, total)
            yield bench.POINTS, _chain_cost(study, gears, model, sizes.speeds_Hz)
            done += 1


def _chain_cost(
    study: str, gears: int, model: LumpedModel, speeds: Sequence[float]
) -> ChainCost:
    set_up = partial(_timed_system, gears, model)
    system = set_up()  # what is not on disk yet is computed here
    setup_s, _ = _timed_result(set_up)
    sweep_s, periods = _timed_result(partial(_swept_branches, system, speeds))
    return ChainCost(
        study=study,
        gears=gears,
        coordinates=system.angular.size,
        contacts=0 if system.contacts is None else len(system.contacts.mesh_of),
        setup_s=setup_s,
        sweep_s=sweep_s,
        ms_per_period=float(1e3 * sweep_s / periods),
    )


def _timed_system(gears: int, model: LumpedModel) -> LumpedSystem:
    system = lumped_system(chain(gears), TORQUE_NM, model)
    _ = system.static_state
    return system


def _swept_branches(system: LumpedSystem, speeds: Sequence[float]) -> float:
    """Pass all speeds up and down; return the periods that were integrated."""
    branches = [sweep(system, np.array(speeds), direction) for direction in DIRECTIONS]
    return sum(
        response.settling_time * response.frequency + max(response.multiple, 1)
        for branch in branches
        for response in branch.responses
    )


def _timed_result(work: Callable[[], Any]) -> tuple[float, Any]:
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def _panel(points: list[ChainCost]) -> bench.Panel:
    curves = []
    parts = [(s, p) for s in MODELS for p in ("setup", "sweep")]
    for (study, part), marker in zip(parts, bench.MARKERS, strict=False):
        places = [
            (p.gears, getattr(p, f"{part}_s")) for p in points if p.study == study
        ]
        label = f"{study}, {'set-up' if part == 'setup' else part}"
        curves.append(bench.CostCurve(label, marker, places))
    return bench.Panel("gears", "processor time [s]", curves)


def _findings(points: list[ChainCost]) -> list[str]:
    """Order of growth from the middle of the sizes on."""
    findings = []
    for study in MODELS:
        large = [p for p in points if p.study == study and p.gears >= 4]
        if len(large) > 1:
            gears = [p.gears for p in large]
            setup = bench.slope(gears, [p.setup_s for p in large])
            swept = bench.slope(gears, [p.sweep_s for p in large])
            findings.append(
                f"{study}, from 4 gears on: set-up grows with power {setup:.2f} of the "
                f"number of gears, sweep with {swept:.2f}"
            )
    return findings


def chain_teeth(gears: int) -> list[int]:
    """Numbers of teeth of a chain, all different up to 27 gears."""
    return [FIRST_TEETH + TEETH_STEP * k % TEETH_RANGE for k in range(gears)]


def chain(gears: int) -> GearSet:
    """A chain of different gears; phases follow from the directions of its centres."""
    teeth = chain_teeth(gears)
    return make_gear_set(
        {
            "name": f"chain-{gears}",
            "description": f"Chain of {gears} different gears",
            "defaults": {"module_mm": MODULE_MM, "face_width_mm": FACE_WIDTH_MM},
            "gear": [_gear_table(k, z) for k, z in enumerate(teeth)],
            "mesh": [_mesh_table(k, teeth) for k in range(gears - 1)],
            "load": {"gear": _gear_name(0), "torques_Nm": [TORQUE_NM]},
        }
    )


def _gear_name(number: int) -> str:
    return f"gear-{number + 1}"


def _gear_table(number: int, teeth: int) -> dict[str, Any]:
    hub_radius = HUB_RATIO * 0.5 * MODULE_MM * teeth
    return {"name": _gear_name(number), "teeth": teeth, "hub_radius_mm": hub_radius}


def _mesh_table(number: int, teeth: list[int]) -> dict[str, Any]:
    radii = 0.5 * MODULE_MM * (teeth[number] + teeth[number + 1])
    return {
        "driver": _gear_name(number),
        "driven": _gear_name(number + 1),
        "center_distance_mm": math.floor(1e3 * DISTANCE_RATIO * radii) / 1e3,
        "center_line_deg": CENTER_LINES_DEG[number % 2],
    }
