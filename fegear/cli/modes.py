"""fegear modes: natural frequencies of a gear set."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer

from fegear.cli.edits import EditedSet
from fegear.cli.groups import grouped
from fegear.cli.lumped_options import (
    LoadCase,
    Translations,
    middle_torque,
    refuse_unused,
)
from fegear.cli.options import AsJson, Elements, refuse_idle, show
from fegear.cli.screen import print_columns, screen

EXAMPLE = "fegear modes liu-idler --translations"


@grouped
def modes_command(
    *,
    subject: EditedSet,
    torque: LoadCase = None,
    translations: Translations = False,
    stiffness: Annotated[
        Literal["given", "fe", "coupled"],
        typer.Option(
            help="Mean mesh stiffness. given: mean_stiffness_N_per_m of the gear set, "
            "by finite elements where it is missing; fe: by finite elements, at the "
            "torque; coupled: of the coupled model about its state under the torque.",
        ),
    ] = "given",
    elements: Elements,
    as_json: AsJson = False,
) -> None:
    """Natural frequencies of a train, and what they strain."""
    gear_set, _ = subject.load()
    from fegear.excitation import Source
    from fegear.modes import summarise_modes

    use_given = stiffness == "given"
    at = None  # N m, where something depends on it
    if use_given and all(mesh.mean_stiffness for mesh in gear_set.meshes):
        reason = f"{gear_set.name} gives all mean stiffnesses, use --stiffness fe"
        refuse_idle(reason, torque=torque)
    else:
        at = middle_torque(gear_set, torque)
    refuse_unused(elements, used=at is not None)
    source = Source(**elements.choices)
    values = summarise_modes(gear_set, at, translations, source, stiffness)
    show(values, as_json, print_modes)


def print_modes(values: dict[str, Any]) -> None:
    console = screen()
    for entry in values["mean_stiffness"]:
        console.print(
            f"mesh {entry['mesh']}: mean stiffness "
            f"{entry['stiffness_N_per_m']:.5g} N/m, {entry['origin']}"
        )
    if values["body_modes"] is not None:
        console.print(
            f"body modes of the gears {values['body_modes']}; those left out "
            f"{values['body_modes_left_out']}"
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
