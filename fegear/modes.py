"""Natural frequencies of a gear set's train, and what they strain."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from fegear.excitation import Excitations, Source, unmodified
from fegear.gearset.model import GearSet
from fegear.lumped_models import (
    LumpedModel,
    body_entries,
    doubts_of_bodies,
    lumped_system,
    usual_speeds,
)
from fegear.train import mesh_torques_at, train_of
from lumped.modes import Modes, natural_modes
from lumped.system import LumpedSystem

Stiffness = Literal["given", "fe", "coupled"]
UNSTRAINED = 1e-6  # part of the strain energy in the meshes below which there is none


def summarise_modes(
    gear_set: GearSet,
    torque: float | None,
    translations: bool,
    source: Source,
    stiffness: Stiffness = "given",
) -> dict[str, Any]:
    """Plain values, ready for JSON.

    torque : on the input gear [N m], None where all mean stiffnesses are given
    """
    bodies: dict[str, str] = {}
    doubts: list[str] = []
    if stiffness == "coupled":
        coupled = LumpedModel(
            number="coupled", translations=translations, stiffness=source
        )
        system = lumped_system(gear_set, torque or 0.0, coupled)
        train, modes = system.train, modes_under_load(system)
        speeds = usual_speeds(system)
        bodies = body_entries(system, speeds)
        doubts = list(doubts_of_bodies(system, speeds))
        origin = f"tangent of the coupled model at {torque:g} N m on the input gear"
        origins = [origin] * len(gear_set.meshes)
    else:
        given = stiffness == "given"
        found = mean_stiffnesses(gear_set, torque or 0.0, source, given)
        origins = [origin for _, origin in found]
        train = train_of(gear_set, torque or 0.0, translations)
        modes = natural_modes(train, [value for value, _ in found])
    return {
        "gear_set": gear_set.name,
        "torque_Nm": torque,
        "translations": translations,
        "damping_ratio": train.damping_ratio,
        "mean_stiffness": [
            {"mesh": m, "stiffness_N_per_m": float(value), "origin": origin}
            for m, (value, origin) in enumerate(
                zip(modes.mean_stiffness, origins, strict=True), start=1
            )
        ],
        "modes": [
            {
                "frequency_Hz": float(modes.frequency_Hz[i]),
                "mesh_energy": [float(part) for part in modes.mesh_energy[:, i]],
                "kind": name_mode(modes, i),
            }
            for i in range(modes.frequency_Hz.size)
        ],
        "body_modes": bodies.get("body modes"),
        "body_modes_left_out": bodies.get("body modes left out"),
        "warnings": doubts,
    }


def modes_under_load(system: LumpedSystem) -> Modes:
    """Modes of the coupled model about its loaded state; those that strain a mesh.

    Mean stiffnesses are tangents of the meshes.
    """
    loaded, shapes, modes = system.loaded, system.arrays.shapes, system.modes
    assert loaded is not None
    assert system.contacts is not None
    bodies, hubs = system.contacts.bodies, system.moving.size
    # of bodies that yield as they do at rest
    still = replace(system, contacts=replace(system.contacts, modes=None)).loaded
    assert still is not None
    own = np.einsum("mi,mij,mj->m", shapes, still.meshes, shapes)
    turned = bodies.to_unit @ loaded.shapes
    space = modes.coordinates
    names = [_name_of_body_mode(system, i) for i in range(bodies.count)]
    return Modes(
        # body modes have a mass of 1 and no place in the train
        coordinates=replace(
            space,
            labels=(*space.labels, *names),
            mass=np.append(space.mass, np.ones(bodies.count)),
        ),
        mean_stiffness=own / (shapes**2).sum(axis=1) ** 2,
        frequency_Hz=loaded.frequency_Hz,
        shapes=np.concatenate(
            [modes.shapes[:, system.moving] @ turned[:hubs], turned[hubs:]]
        ),
        mesh_shapes=shapes @ turned[:hubs],
        mesh_energy=loaded.mesh_energy,
    )


def _name_of_body_mode(system: LumpedSystem, i: int) -> tuple[str, str]:
    """Gear, and the number of nodal diameters."""
    assert system.contacts is not None
    bodies = system.contacts.bodies
    gear, n = system.train.gears[int(bodies.gears[i])], int(bodies.nodal_diameters[i])
    diameters = "1 nodal diameter" if n == 1 else f"{n} nodal diameters"
    return gear.name, f"body, {diameters}" if n else "body against its hub"


def mean_stiffnesses(
    gear_set: GearSet, torque: float, source: Source, use_given: bool
) -> list[tuple[float, str]]:
    """Mean stiffness of every mesh [N/m], and where it comes from."""
    excitations, found = Excitations(source), []
    for mesh, driving in enumerate(mesh_torques_at(gear_set, torque)):
        given = gear_set.meshes[mesh].mean_stiffness
        origin = f"finite elements at {driving:g} N m on the driver, without relief"
        if given is not None and use_given:
            value, origin = given, "given by the gear set"
        else:
            table = excitations.table(unmodified(gear_set, mesh), mesh, driving)
            value = float(table["stiffness_N_per_m"].mean())
        found.append((value, origin))
    return found


def name_mode(modes: Modes, i: int) -> str:
    """Rigid rotation, or the coordinate that holds most of the kinetic energy."""
    energy = modes.coordinates.mass * modes.shapes[:, i] ** 2
    gear, direction = modes.coordinates.labels[int(energy.argmax())]
    if modes.frequency_Hz[i] == 0.0:
        return (
            "rigid rotation" if direction == "rotation" else f"free: {gear} {direction}"
        )
    leader = f"{gear} {direction}"
    if modes.mesh_energy[:, i].sum() < UNSTRAINED:
        return f"strains no mesh: {leader}"
    return leader
