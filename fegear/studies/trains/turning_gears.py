"""Gears of a set by their turns: orders of meshes, and teeth at the pitch point."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from fegear.gearset.model import GearSet
from fegear.gearset.phases import mesh_phases
from fegear.gearset.pitch_errors import tooth_in_cycles
from lumped.signals.added_deflections import GearContacts
from lumped.signals.faulty_tooth import Engagement
from lumped.signals.sampling import TurningGear
from lumped.signals.sensors import dte_name
from lumped.train.train import Train


def meshing_gears(gears: GearSet) -> list[int]:
    """Indices of the gears that are in a mesh, rising."""
    return sorted({gear for mesh in gears.meshes for gear in mesh.gears})


def turning_gear(gears: GearSet, train: Train, index: int) -> TurningGear:
    """A gear of a set by its turns.

    train : of the set; index : of the gear, which is in a mesh
    """
    rates = train.mesh_rates
    mesh = next(m for m, wheel in enumerate(gears.meshes) if index in wheel.gears)
    teeth = gears.gears[index].geometry.teeth
    # a multiple that is no whole order is not in an average
    orders = {(teeth * rate / rates[mesh]).numerator for rate in rates}
    return TurningGear(
        index=index,
        name=gears.gears[index].name,
        teeth=teeth,
        mesh=mesh,
        rate=rates[mesh],
        phase=train.meshes[mesh].phase,
        orders=tuple(sorted(orders)),
    )


def tooth_at_pitch_point(
    gears: GearSet, turning: TurningGear, points: int
) -> NDArray[np.int64]:
    """The gear's tooth (p,) nearest to its first mesh's pitch point, from 1.

    points : in a turn of the gear
    """
    position = turning.phase + turning.teeth * np.arange(points) / points
    cycle = np.floor(position + 0.5).astype(np.int64)
    return 1 + tooth_in_cycles(gears, turning.mesh, turning.index, cycle)


def engagements_of(
    gears: GearSet, turning: TurningGear, names: Iterable[str]
) -> dict[str, tuple[Engagement, ...]]:
    """Contact of the gear's teeth over a turn, by signals that tell of one tooth.

    Of planetary sets these are the transmission errors of the gear's meshes: teeth of
    sun and ring have their turn in each of them, those of a planet in both of its two.
    Of others all signals are, of the gear's first mesh.

    names : of the signals
    """
    if gears.carrier is None:
        first = (engagement_of(gears, turning, turning.mesh),)
        return dict.fromkeys(names, first)
    meshes = gears.meshes_of[turning.index]
    contacts = tuple(engagement_of(gears, turning, mesh) for mesh in meshes)
    is_planet = turning.index in gears.carrier.planets
    by_mesh = {
        # the mesh itself first
        dte_name(mesh): (contacts[n], *contacts[n + 1 :], *contacts[:n])
        if is_planet
        else (contacts[n],)
        for n, mesh in enumerate(meshes)
    }
    return {name: by_mesh[name] for name in names if name in by_mesh}


def engagement_of(gears: GearSet, turning: TurningGear, mesh: int) -> Engagement:
    """Contact of the gear's teeth in one of its meshes, over a turn.

    mesh : its index, from 0
    """
    start, end = gears.engagement(mesh)
    pitches = np.arange(turning.teeth)
    first = turning.phase
    if mesh != turning.mesh:
        first = mesh_phases(gears)[mesh].value
    return Engagement(
        first=first,
        start=start,
        end=end,
        drives=gears.meshes[mesh].driver == turning.index,
        teeth=1 + tooth_in_cycles(gears, mesh, turning.index, pitches),
        overlap=gears.overlap_ratio(mesh),
    )


def contacts_of(gears: GearSet, turning: TurningGear) -> GearContacts:
    """Contact of the gear's teeth over a turn, in all its meshes."""
    meshes = gears.meshes_of[turning.index]
    return GearContacts(turning, {m: engagement_of(gears, turning, m) for m in meshes})
