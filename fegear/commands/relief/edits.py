"""The reliefs and leads of a design as rows, and as keys of a gear-set file."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from fegear.commands.relief.objective import ReliefObjective
from fegear.commands.relief.relief_problem import LeadRange, ReliefProblem, ReliefRange
from fegear.commands.relief.topography_range import TopographyRange
from fegear.commands.relief.vibration import VibrationBest
from fegear.gearset.modifications import FlankLead, FlankModifications, ReliefShape
from lumped.common.array_types import Array
from lumped.common.units import MM, UM


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


class DesignRows(NamedTuple):
    """Sought reliefs and leads with rounded sizes, and what 1 um more would change.

    topography : keys of it in a gear-set file, None without
    """

    reliefs: list[dict[str, Any]]
    leads: list[dict[str, Any]]
    topography: dict[str, Any] | None


def design_rows(
    problem: ReliefProblem, design: Array, objective: ReliefObjective | None
) -> DesignRows:
    """The rows of a design of single reliefs.

    objective : whose changes are asked for
    """
    count = len(problem.ranges)
    design = rounded(problem, design)
    change = _changes_by_one_um(problem, design, objective).tolist()
    reliefs = [
        {
            "relief": f"{entry.place}_relief",
            "magnitude_um": float(design[i]),
            "length_pitches": float(design[count + i]),
            **_start_values(problem, entry, float(design[count + i])),
            "objective_per_um": change[i],
        }
        for i, entry in enumerate(problem.ranges)
    ]
    leads, i = [], 2 * count
    for lead, sizes in problem.lead_sizes(design):
        leads.append(
            {
                "lead": f"{lead.role}_lead.{lead.name}",
                "size_um": sizes[lead.name],
                "length_mm": sizes.get("end_length"),
                "objective_per_um": change[i],
            }
        )
        i += len(sizes)
    topography = None
    if problem.topography:
        topography = problem.topography.table(problem.topography_depths(design))
    return DesignRows(reliefs, leads, topography)


def rounded(problem: ReliefProblem, design: Array) -> Array:
    """A design as it is written: to 0.01 um, 0.0001 base pitches and 0.01 mm."""
    magnitudes, lengths, of_leads = problem.parts(design)
    return np.concatenate([magnitudes.round(2), lengths.round(4), of_leads.round(2)])


def _changes_by_one_um(
    problem: ReliefProblem, design: Array, objective: ReliefObjective | None
) -> Array:
    """Change of the objective by 1 um more of each depth (x,), 0 of all others.

    It has a kink at the best design, and so no derivative.
    """
    change = np.zeros(design.size)
    if objective is None:
        return change
    at_best = objective.of(problem.values(design))
    for i in problem.depths:
        more = design.copy()
        more[i] += 1.0
        change[i] = objective.of(problem.values(more)) - at_best
    return change / objective.unit


def sought_leads(
    flanks: tuple[FlankModifications, FlankModifications],
    leads: tuple[LeadRange, ...],
    rows: list[dict[str, Any]],
) -> tuple[FlankLead, FlankLead]:
    """Leads of driver and driven gear, with those that were sought replaced."""
    sizes = {row["lead"]: row for row in rows}
    result = []
    for role, flank in zip(("driver", "driven"), flanks, strict=True):
        lead = flank.lead or FlankLead()
        for entry in leads:
            if entry.role != role:
                continue
            row = sizes.get(f"{role}_lead.{entry.name}", {"size_um": 0.0})
            lead = replace(lead, **{entry.name: UM * row["size_um"]})
            if entry.name == "end_relief":
                lead = replace(lead, end_length=MM * (row.get("length_mm") or 0.0))
        result.append(lead)
    return result[0], result[1]


def lead_edits(
    mesh: int, leads: tuple[FlankLead, FlankLead], misalignment: float
) -> dict[str, Any]:
    """Keys of the gear set that give leads to both gears, in place of all others.

    mesh : its number, from 1; misalignment : gap that belongs to neither [m]
    """
    edits: dict[str, Any] = {
        f"mesh.{mesh}.misalignment_um": round(misalignment / UM, 9)
    }
    for key in ("crowning_um", "slope_um", "end_relief_um"):
        edits[f"mesh.{mesh}.lead.{key}"] = 0
    for role, lead in zip(("driver", "driven"), leads, strict=True):
        prefix = f"mesh.{mesh}.{role}_lead"
        edits[f"{prefix}.crowning_um"] = round(lead.crowning / UM, 6)
        edits[f"{prefix}.slope_um"] = round(lead.slope / UM, 6)
        edits[f"{prefix}.end_relief_um"] = round(lead.end_relief / UM, 6)
        if lead.end_relief:
            edits[f"{prefix}.end_relief_length_mm"] = round(lead.end_length / MM, 6)
    return edits


def topography_edits(
    mesh: int, topography: TopographyRange, table: dict[str, Any] | None
) -> dict[str, Any]:
    """Key of the gear set that gives a topography to its gear, or takes it away.

    mesh : its number, from 1
    """
    return {f"mesh.{mesh}.{topography.key}": table or {}}


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


def left_out_features(sought: ReliefProblem, rows: DesignRows) -> list[str]:
    """Modifications that were sought and that no row shows."""
    names = {row["lead"] for row in rows.leads}
    leads = [f"{lead.role}_lead.{lead.name}" for lead in sought.leads]
    places = [entry.place for entry in sought.ranges]
    topography = sought.topography
    return [
        *left_out_reliefs(places, rows.reliefs),
        *(name for name in leads if name not in names),
        *([topography.key] if topography and not rows.topography else []),
    ]


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
