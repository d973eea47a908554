"""Profile relief of least vibration over a band of speeds.

A sweep takes a hundred times as long as a solution of the mesh cycle and its peak has
no derivatives, for jumps move over the speeds. The search starts at designs of least
static transmission error by several objectives, and refines the best of them by the
simplex of Nelder and Mead with a limited number of designs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.common.array_types import Array
from lumped.common.workers import Stopped
from lumped.steady.integration_settings import Settings
from lumped.steady.sweep import DIRECTIONS, sweep

FIRST_STEP = 0.08  # of the simplex, over the range of designs
SIMPLEX_TOL, VALUE_RTOL = 1e-3, 1e-3  # at which the simplex has converged


@dataclass(frozen=True)
class Band:
    """Speeds, and the largest vibration there over torques and directions.

    speeds : mesh frequencies of the first mesh [Hz]
    rms : of the dynamic transmission error of the mesh, without its mean [m]
    """

    speeds: tuple[float, ...]
    rms: tuple[float, ...]

    @property
    def peak(self) -> float:
        """Largest vibration [m], infinite where a motion diverges."""
        return float(np.max(np.nan_to_num(self.rms, nan=np.inf)))


@dataclass(frozen=True)
class VibrationBest:
    """Bands before, of the best static design, and of the best design.

    design : of the last; designs, sweeps : computed; complete : whether to the end
    """

    before: Band
    static: Band
    best: Band
    design: Array
    designs: int
    sweeps: int
    complete: bool


@dataclass(kw_only=True)
class VibrationSearch:
    """Sweeps of gear sets with reliefs, the best of which is kept.

    changed : the gear set of a design;  bounds : limits (n, 2) of designs
    index : of the mesh; torques : on its driver [N m]; speeds : [Hz]
    limit : number of designs; job : by which it reports and is stopped
    """

    changed: Callable[[Array], GearSet]
    bounds: Array
    model: LumpedModel
    index: int
    torques: Sequence[float]
    speeds: tuple[float, ...]
    limit: int
    job: Any
    solved: list[tuple[Array, Band]] = field(default_factory=list)
    sweeps: int = 0

    def band_of(self, gears: GearSet) -> Band:
        """Sweep up and down at every torque; raises Stopped where that was asked."""
        ratio = mesh_torques_at(gears, 1.0)[self.index]
        excitations = self.model.excitations
        rms = np.zeros(len(self.speeds))
        for torque in self.torques:
            self.job.report("designs swept", len(self.solved), self.limit)
            system = lumped_system(gears, torque / ratio, self.model, excitations)
            for direction in DIRECTIONS:
                branch = sweep(
                    system, self.speeds, direction, Settings(), stop=self.job.stop
                )
                if self.job.stop.is_set():
                    raise Stopped
                self.sweeps += 1
                rms = np.fmax(rms, self._on_speeds(branch.responses))
        return Band(self.speeds, tuple(rms.tolist()))

    def _on_speeds(self, responses: Sequence[Any]) -> Array:
        values = dict.fromkeys(self.speeds, np.inf)
        for response in responses:
            value = float(response.dte_rms[self.index])
            values[response.frequency] = value if np.isfinite(value) else np.inf
        return np.array([values[speed] for speed in self.speeds])

    def objective(self, design: Array) -> float:
        band = self.band_of(self.changed(design))
        self.solved.append((design, band))
        return band.peak

    def find(self, gears: GearSet, static: Mapping[str, Array]) -> VibrationBest:
        """Refine the best of static designs, by their objectives, the first first."""
        before = self.band_of(gears)
        designs = list(static.values())[: self.limit]
        self.objective(designs[0])
        complete = True
        try:
            for design in designs[1:]:
                self.objective(design)
            self._refine(min(self.solved, key=lambda one: one[1].peak)[0])
        except (Stopped, KeyboardInterrupt):
            complete = False
        design, best = min(self.solved, key=lambda one: one[1].peak)
        first = self.solved[0][1]
        total = len(self.solved)
        return VibrationBest(before, first, best, design, total, self.sweeps, complete)

    def _refine(self, start: Array) -> None:
        from scipy.optimize import minimize

        evaluations = self.limit - len(self.solved)
        if evaluations < 1:
            return
        low, high = self.bounds.T
        scale = high - low
        unit = min(band.peak for _, band in self.solved)
        center = (start - low) / scale
        steps = np.where(center < 0.5, FIRST_STEP, -FIRST_STEP)
        simplex = np.vstack([center, center + np.diag(steps)])

        def scaled(x: Array) -> float:
            value = self.objective(low + scale * x) / unit
            return value if np.isfinite(value) else 1e6

        minimize(
            scaled,
            center,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * center.size,
            options={
                "maxfev": evaluations,
                "initial_simplex": simplex,
                "xatol": SIMPLEX_TOL,
                "fatol": VALUE_RTOL,
            },
        )
