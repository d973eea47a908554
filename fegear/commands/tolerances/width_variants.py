"""Many pairs of gears that differ a little, whose loads vary over the face width."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fegear.commands.tolerances.variants import (
    VariantContact,
    Variants,
    WidthDeviations,
)
from fegear.contact.problem import ContactFlank, ContactProblem
from fegear.contact.result import band_means
from fegear.contact.solve import solve_cycle
from fegear.contact.width.contact import WidthContact
from fegear.contact.width.lines import pairs_over_width
from fegear.gearset.modifications import FlankLead, FlankProfile
from lumped.common.array_types import Array, Indices
from lumped.common.checks import require_present
from meshes import GearPair


def solve_width_variants(
    problem: ContactProblem,
    face: WidthContact,
    torque: float,
    position: Array,
    variants: Variants,
    report: Callable[[int], None],
) -> VariantContact:
    """Solve the contact of every pair of gears, see `variants.solve_variants`."""
    teeth = pairs_over_width(problem, face, position)
    shape = variants.count, position.size
    ste, no_load = np.empty(shape), np.empty(shape)
    gap, load = np.full((*shape, teeth.size), np.inf), np.zeros((*shape, teeth.size))
    per_width = np.empty((variants.count, face.slices))
    for i in range(variants.count):
        deviating = _deviating(problem, face, teeth, variants, i)
        cycle = solve_cycle(deviating, torque, position)
        ste[i], no_load[i] = cycle.ste[0], cycle.no_load[0]
        # at another centre distance other pairs may reach each other
        _, ours, theirs = np.intersect1d(teeth, cycle.teeth, return_indices=True)
        gap[i][:, ours] = cycle.gap[0][:, theirs]
        load[i][:, ours] = cycle.load[0][:, theirs]
        per_width[i] = cycle.face.per_width[0].mean(axis=0)
        report(i + 1)
    distribution = band_means(per_width) / per_width.mean(axis=1, keepdims=True)
    return VariantContact(ste, no_load, gap, load, distribution)


def _deviating(
    problem: ContactProblem,
    face: WidthContact,
    teeth: Indices,
    variants: Variants,
    i: int,
) -> ContactProblem:
    """The problem of one of the pairs of gears, which may lack backlash."""
    pair = problem.pair
    over_width = require_present(variants.over_width, "over_width")
    distance = pair.center_distance + float(variants.center_distance[i])
    gap = over_width.misalignment[i] * (0.5 + face.places / face.width)
    driver, driven = (
        _with_deviations(flank, variants, over_width, (i, gear))
        for gear, flank in enumerate(problem.flanks)
    )
    errors = np.zeros(pair.driver.teeth)
    # a pair that is ahead came earlier
    errors[-teeth % errors.size] = variants.gap[i]
    return replace(
        problem,
        pair=GearPair(pair.driver, pair.driven, distance, rounding=pair.driver.module),
        driver=replace(driver, pitch_errors=tuple(errors.tolist())),
        driven=driven,
        solver=replace(face, gap=face.gap + gap, back_gap=face.back_gap),
    )


def _with_deviations(
    flank: ContactFlank,
    variants: Variants,
    over_width: WidthDeviations,
    at: tuple[int, int],
) -> ContactFlank:
    """The flank of one gear of a pair; at : indices of pair and gear."""
    profile, lead = flank.profile or FlankProfile(), flank.lead or FlankLead()
    return replace(
        flank,
        profile=replace(
            profile,
            crowning=profile.crowning + float(variants.crowning[at]),
            slope=profile.slope + float(variants.slope[at]),
        ),
        lead=replace(
            lead,
            crowning=lead.crowning + float(over_width.lead_crowning[at]),
            slope=lead.slope + float(over_width.lead_slope[at]),
        ),
    )
