"""Values of a run that are compared with printed ones, by the keys of cases."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from validation.study.metrics import FE, FE_FRICTIONLESS
from validation.study.printed_keys import CURVE, CYCLE, NATURAL, STATICS

if TYPE_CHECKING:
    from validation.study.run_files import Run

MATCH_RTOL = (
    1.0 / 3.0
)  # of the frequency: what is further from a printed one is another


def printed_figure(run: Run, key: str, near: float) -> tuple[float, str]:
    """The figure of a key and the file of the run that holds it; NaN if it has none.

    near : of jumps, peaks and natural frequencies the nearest to it counts [Hz], but
        none that is off by more than MATCH_RTOL
    """
    for pattern, (file, figure) in KEYS.items():
        if match := re.fullmatch(pattern, key):
            return figure(run, near, *match.groups()), file
    raise ValueError(f"key = {key}; must be one of {', '.join(KEYS)}")


def nearest(values: Iterable[float], near: float) -> float:
    """The value nearest to a printed one; NaN where none is near."""
    close = (v for v in values if abs(v - near) <= MATCH_RTOL * max(v, near))
    return min(close, key=lambda value: abs(value - near), default=nan)


def _natural(run: Run, near: float) -> float:
    """The finite elements have none."""
    return nearest(() if run.source in (FE, FE_FRICTIONLESS) else run.natural_Hz, near)


def _of_curve(run: Run, near: float, mesh: str, direction: str, kind: str) -> float:
    """Frequency of a peak, or of the last speed before a jump [Hz]."""
    frequencies: list[float] = []
    for curve in run.curves:
        if (curve.mesh, curve.direction) == (int(mesh), direction):
            frequencies += [peak.frequency for peak in curve.peaks if kind == "peak"]
            frequencies += [
                jump.frequency_from for jump in curve.jumps if kind == "jump"
            ]
    return nearest(frequencies, near)


def _of_cycle(run: Run, near: float, mesh: str, number: str, name: str) -> float:
    cycles = [cycle for cycle in run.cycles if cycle.mesh == int(mesh)]
    if int(number) > len(cycles):
        return nan
    cycle = cycles[int(number) - 1]
    peak = float(np.abs(cycle.force).max())
    return cycle.contact_loss if name == "contact_loss" else peak


def _of_statics(run: Run, near: float, mesh: str, name: str) -> float:
    for statics in run.statics:
        if statics.mesh == int(mesh):
            values = {
                "mean_stiffness": statics.mean_stiffness,
                "stiffness_variation": statics.variation,
                "friction_recess": statics.friction_change(0.0, 0.5),
                "friction_approach": statics.friction_change(0.5, 1.0),
            }
            return values[name]
    return nan


KEYS: Mapping[str, tuple[str, Callable[..., float]]] = {
    NATURAL: ("result.json", _natural),
    STATICS: ("statics.csv", _of_statics),
    CURVE: ("sweep.csv", _of_curve),
    CYCLE: ("waves.csv", _of_cycle),
}
