"""Natural frequencies of a gear set's train, and what they strain."""

from __future__ import annotations

from typing import Any

import numpy as np

from fegear.excitation import Excitations, Source, unmodified
from fegear.gearset.model import GearSet
from fegear.lumped_system import LumpedModel, lumped_system
from fegear.train import mesh_torques_at, train_of
from lumped.modes import Modes, natural_modes

UNSTRAINED = 1e-6  # part of the strain energy in the meshes below which there is none


def summarise_modes(
    gear_set: GearSet,
    torque: float | None,
    translations: bool,
    source: Source,
    use_given: bool = True,
) -> dict[str, Any]:
    """Plain values, ready for JSON.

    torque : on the input gear [N m], None where all mean stiffnesses are given
    """
    stiffness = mean_stiffnesses(gear_set, torque or 0.0, source, use_given)
    train = train_of(gear_set, torque or 0.0, translations)
    modes = natural_modes(train, [entry["stiffness_N_per_m"] for entry in stiffness])
    return {
        "gear_set": gear_set.name,
        "torque_Nm": torque,
        "translations": translations,
        "damping_ratio": train.damping_ratio,
        "mean_stiffness": stiffness,
        "modes": [
            {
                "frequency_Hz": float(modes.frequency_Hz[i]),
                "mesh_energy": [float(part) for part in modes.mesh_energy[:, i]],
                "kind": name_mode(modes, i),
            }
            for i in range(modes.frequency_Hz.size)
        ],
    }


def summarise_loaded_modes(
    gear_set: GearSet, torque: float, translations: bool, source: Source
) -> dict[str, Any]:
    """Of the coupled model about its loaded state at a torque [N m], as plain values.

    Mean stiffnesses are tangents of the meshes.
    """
    model = LumpedModel(number="coupled", translations=translations, stiffness=source)
    system = lumped_system(gear_set, torque, model)
    loaded, shapes = system.loaded, system.arrays.shapes
    assert loaded is not None
    own = np.einsum("mi,mij,mj->m", shapes, loaded.meshes, shapes)
    stiffness = own / (shapes**2).sum(axis=1) ** 2
    moved = system.modes.shapes[:, system.moving] @ loaded.shapes
    origin = f"tangent of the coupled model at {torque:g} N m on the input gear"
    kinetic = system.modes.coordinates.mass[:, None] * moved**2
    labels = system.modes.coordinates.labels
    return {
        "gear_set": gear_set.name,
        "torque_Nm": torque,
        "translations": translations,
        "damping_ratio": system.train.damping_ratio,
        "mean_stiffness": [
            {"mesh": m + 1, "stiffness_N_per_m": float(value), "origin": origin}
            for m, value in enumerate(stiffness)
        ],
        "modes": [
            {
                "frequency_Hz": float(frequency),
                "mesh_energy": [float(part) for part in loaded.mesh_energy[:, i]],
                "kind": " ".join(labels[int(kinetic[:, i].argmax())]),
            }
            for i, frequency in enumerate(loaded.frequency_Hz)
        ],
    }


def mean_stiffnesses(
    gear_set: GearSet, torque: float, source: Source, use_given: bool
) -> list[dict[str, Any]]:
    """Mean stiffness of every mesh and where it comes from."""
    excitations, found = Excitations(source), []
    for mesh, driving in enumerate(mesh_torques_at(gear_set, torque)):
        given = gear_set.meshes[mesh].mean_stiffness
        origin = f"finite elements at {driving:g} N m on the driver, without relief"
        if given is not None and use_given:
            value, origin = given, "given by the gear set"
        else:
            table = excitations.table(unmodified(gear_set, mesh), mesh, driving)
            value = float(table["stiffness_N_per_m"].mean())
        found.append({"mesh": mesh + 1, "stiffness_N_per_m": value, "origin": origin})
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
