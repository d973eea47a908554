"""Small changes of the flanks, whose effect on the transmission error is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from fegear.contact.problem import ContactProblem
from fegear.gearset.modifications import LEAD_SIZES, FlankLead, FlankTopography

# Of a depth, in which the gap is linear, and of a length, small beside a slice [m]
DEPTH_STEP, ROLL_STEP = 1e-7, 1e-6
RELIEFS = "tip_relief", "root_relief"
RELIEF_STEPS = {"magnitude": DEPTH_STEP, "start_roll_length": ROLL_STEP}
PROFILE_STEPS = {"crowning": DEPTH_STEP, "slope": DEPTH_STEP}
GAPS_ALONE = (
    "lead_slope",
    "topography_slope",
)  # fields of changes of no place of contact
LEAD_STEPS = dict.fromkeys(LEAD_SIZES, DEPTH_STEP) | {"end_length": ROLL_STEP}


class FlankChange(NamedTuple):
    """A problem with a small change of one flank.

    field, at : where its slope is in a `ContactCycle`, behind torque and position
    step : by which it is changed [m]
    """

    problem: ContactProblem
    field: str
    at: tuple[int, ...]
    step: float


def changed_flanks(problem: ContactProblem) -> Iterator[FlankChange]:
    """Changes of the reliefs, profiles and leads that there are, and sought depths."""
    for gear, flank in enumerate(problem.flanks):
        for end, name in enumerate(RELIEFS):
            relief = getattr(flank, name)
            for i, (other, step) in enumerate(_changes(relief, RELIEF_STEPS)):
                changed = _with_flank(problem, gear, **{name: other})
                yield FlankChange(changed, "relief_slope", (gear, end, i), step)
        for i, (other, step) in enumerate(_changes(flank.profile, PROFILE_STEPS)):
            changed = _with_flank(problem, gear, profile=other)
            yield FlankChange(changed, "profile_slope", (gear, i), step)
        for i, (other, step) in enumerate(
            _changes(flank.lead, _lead_steps(flank.lead))
        ):
            changed = _with_flank(problem, gear, lead=other)
            yield FlankChange(changed, "lead_slope", (gear, i), step)
        if flank.topography is not None and flank.depths_sought:
            for i, other in enumerate(_deeper(flank.topography)):
                changed = _with_flank(problem, gear, topography=other)
                yield FlankChange(changed, "topography_slope", (gear, i), DEPTH_STEP)


def sought_depths(problem: ContactProblem) -> int:
    """Largest number of depths of a topography by which slopes are asked for."""
    return max(
        len(flank.topography.roll_lengths) * len(flank.topography.places)
        if flank.topography is not None and flank.depths_sought
        else 0
        for flank in problem.flanks
    )


def _deeper(topography: FlankTopography) -> Iterator[FlankTopography]:
    """A topography with each of its depths larger by a step."""
    for i, row in enumerate(topography.depths):
        for j, depth in enumerate(row):
            deeper = (*row[:j], depth + DEPTH_STEP, *row[j + 1 :])
            depths = (*topography.depths[:i], deeper, *topography.depths[i + 1 :])
            yield replace(topography, depths=depths)


def _lead_steps(lead: FlankLead | None) -> Mapping[str, float]:
    """Steps of the sizes of a lead; an end relief without length has none."""
    if lead is not None and lead.end_length > 0.0:
        return LEAD_STEPS
    return {name: LEAD_STEPS[name] for name in ("crowning", "slope")}


def _changes(
    modification: Any, steps: Mapping[str, float]
) -> Iterator[tuple[Any, float]]:
    """A modification with one of its sizes changed by a step; none of None."""
    for name, step in steps.items() if modification is not None else ():
        size = getattr(modification, name) + step
        yield replace(modification, **{name: size}), step


def _with_flank(problem: ContactProblem, gear: int, **changes: Any) -> ContactProblem:
    flank = replace(problem.flanks[gear], **changes)
    if gear == 0:
        return replace(problem, driver=flank)
    return replace(problem, driven=flank)
