"""Edges of flanks, where the contact pressure of an elastic body has no limit.

Tip corners are edges, and so are the ends of spalls and of undercut flanks, the start
of a linear relief and the points of a measured profile that is interpolated linearly:
the flank has a kink or a step there, and the pressure on it grows with the contact
grid's fineness. The start of a parabolic relief and the points of a cubic profile have
none.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fegear.contact.loads import PatchLoad
from fegear.contact.problem import ContactProblem
from fegear.contact.profiles import profile_kinks
from fegear.contact.result import ContactCycle
from fegear.gearset.modifications import FlankProfile, Relief
from lumped.common.array_types import Array
from meshes import SpurGear
from meshes.profile import arc_from_tip, roll_length_at_arc

HERTZ_MARGIN = 1.2  # contact half-widths from an edge within which it is in contact


def edge_arcs(problem: ContactProblem) -> tuple[Array, Array]:
    """Arc lengths (e,) of the edges of driver and driven from their tip corners [m].

    The tip corner itself comes first.
    """
    pair = problem.pair
    starts = pair.path_start, pair.line_of_action - pair.path_end
    driver, driven = (
        np.concatenate(
            [_edges(gear, *flank.reliefs), _profile_edges(gear, flank.profile, start)]
        )
        for gear, flank, start in zip(
            (pair.driver, pair.driven), problem.flanks, starts, strict=True
        )
    )
    return driver, driven


def _edges(gear: SpurGear, *reliefs: Relief | None) -> Array:
    kinks = [
        relief.start_roll_length
        for relief in reliefs
        if relief is not None and relief.magnitude > 0.0 and relief.power <= 1.0
    ]
    if gear.is_undercut:
        kinks.append(gear.form_roll_length)
    return np.append(0.0, arc_from_tip(gear, kinks))


def _profile_edges(gear: SpurGear, profile: FlankProfile | None, start: float) -> Array:
    """Arcs (e,) of kinks; start : roll length where the active profile begins [m]."""
    if profile is None:
        return np.empty(0)
    return arc_from_tip(gear, profile_kinks(profile, start, gear.tip_roll_length))


def _spall_edges(
    problem: ContactProblem, cycle: ContactCycle
) -> Iterator[tuple[int, tuple[NDArray[np.bool_], Array]]]:
    """Gear of each tooth with spalls, the pairs (n, k) that it is in, and the arcs (e,)
    of the edges of its spalls from the tip corner [m].
    """
    # pairs count anew in each base pitch
    number = np.floor(cycle.position).astype(np.int64)[:, None] - cycle.teeth
    pair = problem.pair
    for i, (gear, faults) in enumerate(
        ((pair.driver, problem.driver.faults), (pair.driven, problem.driven.faults))
    ):
        for tooth, spalls in faults.spalls.items() if faults else ():
            ends = [end for spall in spalls for end in (spall.start, spall.end)]
            low, high = sorted((0.0, gear.tip_roll_length))
            arcs = arc_from_tip(gear, np.clip(ends, low, high))
            yield i, (number % gear.teeth == tooth, arcs)


def has_edge(problem: ContactProblem, load: PatchLoad) -> bool:
    """Whether nodes under load, and the free ones beside them, contain an edge."""
    loaded = load.normal > 0.0
    return any(
        bool(
            (
                (edges >= arcs[loaded].min() - load.step)
                & (edges <= arcs[loaded].max() + load.step)
            ).any()
        )
        for edges, arcs in zip(
            edge_arcs(problem), (load.driver_arcs, load.driven_arcs), strict=True
        )
        if loaded.any()
    )


def edge_positions(
    problem: ContactProblem, cycle: ContactCycle, torque: int
) -> NDArray[np.bool_]:
    """Positions (n,) at which the contact of a loaded pair contains an edge.

    torque : index of one of the cycle's torques
    """
    return np.asarray(edge_pairs(problem, cycle, torque).any(axis=1))


def finite_pressures(
    problem: ContactProblem, cycle: ContactCycle, torque: int
) -> Array:
    """Largest pressure of each pair and slice (n, k, m) in plane strain [Pa].

    0 where the contact contains an edge. Along the width pressures are those of Hertz,
    which no kink of a flank changes.

    torque : index of one of the cycle's torques
    """
    has_limit = cycle.face.on_path
    if cycle.face.is_uniform:
        has_limit = has_limit & ~edge_pairs(problem, cycle, torque)[..., None]
    finite = np.where(has_limit, cycle.face.pressure[torque], 0.0)
    return np.asarray(problem.plane_strain_pressure * finite)


def edge_pairs(
    problem: ContactProblem, cycle: ContactCycle, torque: int
) -> NDArray[np.bool_]:
    """Whether the contact of a pair contains an edge (n, k), at one torque.

    The contact is as wide as that of unmodified flanks under the load of the pair; one
    with a kink is narrower, as its gap grows faster.
    """
    load = np.abs(cycle.load[torque]) / problem.face_width
    arc = cycle.arc[torque]
    # arcs of pairs whose flanks do not face each other are anywhere
    s1, s2 = (
        roll_length_at_arc(
            gear, np.clip(gear_arc, 0.0, 0.999 * arc_from_tip(gear, 0.0))
        )
        for gear, gear_arc in zip(
            (problem.pair.driver, problem.pair.driven),
            np.moveaxis(arc, -1, 0),
            strict=True,
        )
    )
    compliance = sum(1.0 / flank.compliance.modulus for flank in problem.flanks)
    # half-width along the flanks, Johnson (1985) eq. (4.43)
    radius = 1.0 / np.maximum(1.0 / s1 + 1.0 / s2, 1e-300)
    half_width = np.sqrt(4.0 / np.pi * load * compliance * radius)
    is_edge = np.zeros(load.shape, np.bool_)
    for i, edges in enumerate(edge_arcs(problem)):
        distance = np.abs(arc[..., i, None] - edges).min(axis=-1)
        is_edge |= distance < HERTZ_MARGIN * half_width
    for i, (of_teeth, edges) in _spall_edges(problem, cycle):
        distance = np.abs(arc[..., i, None] - edges).min(axis=-1)
        is_edge |= of_teeth & (distance < HERTZ_MARGIN * half_width)
    corners = cycle.corner_pairs(torque)
    return np.asarray(corners | (is_edge & (load > 0.0)))
