"""The reliefs of a design as rows, and as keys of a gear-set file."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fegear.commands.relief.best_relief import ReliefProblem, ReliefRange
from fegear.commands.relief.objective import ReliefObjective, peak_to_peak
from fegear.commands.relief.vibration import VibrationBest
from fegear.gearset.modifications import ReliefShape
from lumped.common.array_types import Array
from lumped.common.units import UM


def vibration_entries(best: VibrationBest | None) -> dict[str, Any] | None:
    if best is None:
        return None
    bands = {"before": best.before, "static": best.static, "after": best.best}
    return {
        "speeds_Hz": list(best.before.speeds),
        **{f"{name}_um": _micrometres(band.rms) for name, band in bands.items()},
        **{f"peak_{name}_um": band.peak / UM for name, band in bands.items()},
        "designs": best.designs,
        "sweeps": best.sweeps,
    }


def _micrometres(values: tuple[float, ...]) -> list[float]:
    return [value / UM for value in values]


def relief_rows(
    problem: ReliefProblem, design: Array, objective: ReliefObjective | None
) -> list[dict[str, Any]]:
    """Sought reliefs with rounded sizes, and what a micrometre more would change.

    objective : that changes
    """
    count = len(problem.ranges)
    design = np.concatenate([design[:count].round(2), design[count:].round(4)])
    change = np.zeros(count)
    if objective is not None:  # which has a kink at the best design: no derivative
        larger = [design + unit for unit in np.eye(2 * count)[:count]]
        values = [objective.of(problem.ste(one)[0]) for one in (design, *larger)]
        change = (np.array(values[1:]) - values[0]) / UM
    return [
        {
            "relief": f"{entry.place}_relief",
            "magnitude_um": float(design[i]),
            "length_pitches": float(design[count + i]),
            **_start_values(problem, entry, float(design[count + i])),
            "objective_per_um": float(change[i]),
        }
        for i, entry in enumerate(problem.ranges)
    ]


def _start_values(
    problem: ReliefProblem, entry: ReliefRange, length: float
) -> dict[str, Any]:
    """Where a relief begins, and whether one pair alone bears the load there.

    length : [base pitches]
    """
    flank, pitch = entry.flank, problem.contact.pair.base_pitch
    start = entry.start(length, pitch)
    inside = start < flank.high if entry.is_tip else start > flank.low
    inside &= not flank.gear.twist  # helical pairs carry with others somewhere
    return {
        "start_diameter_mm": 2e3 * math.hypot(flank.gear.base_radius, start),
        "length_mm": 1e3 * length * pitch,
        "in_single_contact": bool(inside and flank.low < flank.high),
    }


def left_out_reliefs(places: list[str], reliefs: list[dict[str, Any]]) -> list[str]:
    """Reliefs at places that are not among those of the result."""
    names = {relief["relief"] for relief in reliefs}
    return [name for place in places if (name := f"{place}_relief") not in names]


def relief_edits(
    mesh: int, places: list[str], reliefs: list[dict[str, Any]], shape: ReliefShape
) -> dict[str, Any]:
    """Keys of the gear set that give the reliefs, in place of all others at places.

    mesh : its number, from 1
    """
    edits: dict[str, Any] = {}
    for place in places:
        both = place.partition("_")[2]
        edits[f"mesh.{mesh}.{both}_relief.magnitude_um"] = 0
    for name in left_out_reliefs(places, reliefs):
        edits[f"mesh.{mesh}.{name}.magnitude_um"] = 0
    for relief in reliefs:
        key = f"mesh.{mesh}.{relief['relief']}"
        edits[f"{key}.magnitude_um"] = relief["magnitude_um"]
        if relief["magnitude_um"]:
            edits[f"{key}.length_pitches"] = relief["length_pitches"]
            edits[f"{key}.shape"] = shape
    return edits


def peak_rows(torques: Any, before: Any, after: Any) -> list[dict[str, float]]:
    ranges = zip(torques, peak_to_peak(before), peak_to_peak(after), strict=True)
    return [
        {
            "torque_Nm": float(torque),
            "before_um": float(one) / UM,
            "after_um": float(two) / UM,
        }
        for torque, one, two in ranges
    ]
