"""Signals and indicators of the runs of a set, and what is warned of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fegear.files.codes import with_code
from fegear.studies.page import pluralize
from lumped.common.array_types import Array
from lumped.common.workers import Arrays
from lumped.signals.averages import residual_of
from lumped.signals.sampling import Sampling

INDICATORS = ("rms", "residual_rms", "residual_peak", "residual_kurtosis", "tooth")


@dataclass(frozen=True, eq=False)
class FaultRuns:
    """Signals of r runs and what their averages tell; NaN where a run has none.

    names : of the c signals, with their units
    statuses : of the runs, periodic where they have signals
    sampling : of the run with the speed and the gears of the reference
    indicators : (r, c) by name, see `INDICATORS`
    named_tooth : (r,) by all signals of a run, from 1; NaN where none can be named
    average : (r, c, p) over the turns of the gear
    values : (r, c, t) samples, or None where they are left out
    """

    names: tuple[str, ...]
    statuses: tuple[str, ...]
    sampling: Sampling
    indicators: Mapping[str, Array]
    named_tooth: Array
    average: Array
    values: Array | None

    @classmethod
    def of(cls, runs: Sequence[Arrays], sampling: Sampling) -> FaultRuns:
        """The runs of arrays of `evaluate_run`; runs with other signals have none."""
        finished = [run for run in runs if "names" in run]
        first = finished[0] if finished else None
        labels = b"" if first is None else first["names"].tobytes()
        names = tuple(labels.decode().split("\n")) if labels else ()
        statuses = []
        for run in runs:
            status = run["status"].tobytes().decode()
            if "names" in run and run["names"].tobytes() != labels:
                status = "impossible: the gear set has other signals"
            statuses.append(status)

        def collected(name: str) -> Array:
            shape = () if first is None else first[name].shape
            stacked = np.full((len(runs), *shape), np.nan)
            for row, run, status in zip(stacked, runs, statuses, strict=True):
                if name in run and not status.startswith("impossible"):
                    row[...] = run[name]
            return stacked

        has_values = first is not None and "values" in first
        return cls(
            names,
            tuple(statuses),
            sampling,
            {name: collected(name) for name in INDICATORS},
            collected("named_tooth").reshape(len(runs), -1)[:, 0],
            collected("average"),
            collected("values") if has_values else None,
        )

    @property
    def settled(self) -> NDArray[np.bool_]:
        """Whether each run has signals: its motion repeats."""
        return np.array([status == "periodic" for status in self.statuses])

    @property
    def residual(self) -> Array:
        """Averages (r, c, p) without mean and orders of meshes."""
        points = np.moveaxis(self.average, -1, 0)
        flat = points.reshape(len(points), -1)
        residual = residual_of(flat, self.sampling.gear.orders).reshape(points.shape)
        return np.moveaxis(residual, 0, -1)


def run_warnings(runs: FaultRuns) -> Iterator[str]:
    """A line on runs without signals."""
    lost = [status for status in runs.statuses if status != "periodic"]
    if lost:
        kinds = sorted({status.partition(":")[0] for status in lost})
        counts = ", ".join(
            f"{sum(s.startswith(kind) for s in lost)} {kind}" for kind in kinds
        )
        reason = next((text for text in lost if ":" in text), "").partition(": ")[2]
        first = f"; the first, {reason}" if reason else ""
        yield with_code(
            "W48",
            f"{len(lost)} of {pluralize(len(runs.statuses), 'run')} have no signals: "
            f"{counts}{first}",
        )
