"""fegear modes: natural frequencies of a gear set."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.edits import EditedSet
from fegear.cli.groups import grouped
from fegear.cli.lumped_options import (
    Elements,
    LoadCase,
    Translations,
    middle_torque,
    refuse_unused,
)
from fegear.cli.options import AsJson, refuse_idle, show
from fegear.cli.screen import print_columns, screen

if TYPE_CHECKING:
    from fegear.excitation import Source
    from fegear.gearset.model import GearSet
    from lumped.modes import Modes

EXAMPLE = "fegear modes liu-idler --translations"
UNSTRAINED = 1e-6  # part of the strain energy in the meshes below which there is none


class StiffnessChoice(StrEnum):
    given = "given"
    fe = "fe"


@grouped
def modes_command(
    *,
    subject: EditedSet,
    torque: LoadCase = None,
    translations: Translations = False,
    stiffness: Annotated[
        StiffnessChoice,
        typer.Option(
            "--stiffness",
            help="Mean mesh stiffness. given: mean_stiffness_N_per_m of the gear set, "
            "by finite elements where it is missing; fe: by finite elements, at the "
            "torque.",
        ),
    ] = StiffnessChoice.given,
    elements: Elements,
    as_json: AsJson = False,
) -> None:
    """Natural frequencies of a train, and what they strain."""
    gear_set, _ = subject.load()
    from fegear.excitation import Source

    use_given = stiffness == StiffnessChoice.given
    at = None  # N m, where something depends on it
    if use_given and all(mesh.mean_stiffness for mesh in gear_set.meshes):
        reason = f"{gear_set.name} gives all mean stiffnesses, use --stiffness fe"
        refuse_idle(reason, torque=torque)
    else:
        at = middle_torque(gear_set, torque)
    refuse_unused(elements, used=at is not None)
    source = Source(**elements.given)
    values = modes_summary(gear_set, at, translations, source, use_given)
    show(values, as_json, print_modes)


def modes_summary(
    gear_set: GearSet,
    torque: float | None,
    translations: bool,
    source: Source,
    use_given: bool = True,
) -> dict[str, Any]:
    """Plain values, ready for JSON.

    torque : on the input gear [N m], None where all mean stiffnesses are given
    """
    from fegear.train import train_of
    from lumped.modes import natural_modes

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
                "kind": kind_of(modes, i),
            }
            for i in range(modes.frequency_Hz.size)
        ],
    }


def mean_stiffnesses(
    gear_set: GearSet, torque: float, source: Source, use_given: bool
) -> list[dict[str, Any]]:
    """Mean stiffness of every mesh and where it comes from."""
    from fegear.excitation import Excitations, unmodified
    from fegear.train import mesh_torques_at

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


def kind_of(modes: Modes, i: int) -> str:
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


def print_modes(values: dict[str, Any]) -> None:
    console = screen()
    for entry in values["mean_stiffness"]:
        console.print(
            f"mesh {entry['mesh']}: mean stiffness "
            f"{entry['stiffness_N_per_m']:.5g} N/m, {entry['origin']}"
        )
    title, torque = values["gear_set"], values["torque_Nm"]
    if torque is not None:
        title += f", {torque:g} N m on the input gear"
    modes = values["modes"]
    columns = {
        f"energy in\nmesh {entry['mesh']} [%]": [
            f"{100.0 * mode['mesh_energy'][m]:.1f}" for mode in modes
        ]
        for m, entry in enumerate(values["mean_stiffness"])
    }
    columns["what moves most"] = [mode["kind"] for mode in modes]
    frequencies = [f"{mode['frequency_Hz']:10.1f}" for mode in modes]
    corner = "natural\nfrequency [Hz]"
    print_columns(console, corner, frequencies, columns, title)
