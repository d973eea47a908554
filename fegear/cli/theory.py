"""fegear theory: resonances of a gear set by closed forms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from fegear.cli.edits import EditedSet, edit_entries
from fegear.cli.groups import grouped
from fegear.cli.lumped_options import LoadCase, TabledOptions, middle_torque
from fegear.cli.options import Outputs, named_options
from fegear.cli.screen import Cells, cell, filled_table, number, screen

EXAMPLE = "fegear theory liu-idler --torque 100 --excitation rectangular -o theory.csv"

Cell = Callable[[dict[str, Any]], str]


@grouped
def theory_command(
    *,
    subject: EditedSet,
    torque: LoadCase = None,
    model: TabledOptions,
    outputs: Outputs,
) -> None:
    """Resonances of a lumped train by closed forms.

    Where meshes resonate and lose contact, how high peaks are, which damping ends a
    subharmonic and which tip relief is best, by multiple scales; nothing is integrated.
    """
    outputs.require(subject.set_name, *(model.table or ()))
    gear_set, changes = model.load(subject, torque)
    at = middle_torque(gear_set, torque)
    from fegear.theory import predict_resonances

    with named_options("torque"):
        found = predict_resonances(gear_set, at, model.lumped_model(gear_set))
    found = replace(found, header={**found.header, **edit_entries(changes)})
    outputs.write(found.csv)
    outputs.draw(found.draw)
    outputs.show(found.summary, print_theory)


def print_theory(values: dict[str, Any]) -> None:
    console = screen()
    console.print(
        f"{values['gear_set']} by closed forms, {values['torque_Nm']:g} N m, model "
        f"{values['model']}, {values['excitation']}, damping ratio "
        f"{values['damping_ratio']:g}; mesh frequencies are those of the first mesh"
    )
    console.print(filled_table(MESH, values["meshes"], "Meshes"))
    rows = list(_rows(values["resonances"]))
    direct = [row for row in rows if "subharmonic" not in row["resonance"]]
    grown = [row for row in rows if "subharmonic" in row["resonance"]]
    phased = [row for row in rows if row["phase_of_least_drive"] is not None]
    for columns, chosen, title in (
        (PEAK, direct, "Peaks"),
        (SUBHARMONIC, grown, "Subharmonics"),
        (PHASE, phased, "Mesh phases of least excitation"),
    ):
        if chosen:
            console.print(filled_table(columns, chosen, title, WORDS))
    for each in values["resonances"]:
        for limit in each["limits"]:
            console.print(
                f"range left, {each['resonance']} at {each['mesh_frequency_Hz']:.6g} "
                f"Hz: {limit}"
            )


def _rows(resonances: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """One for every resonance and mesh; the first one of each names the resonance."""
    for each in resonances:
        kinds = [entry["as"] for entry in each["excited_by"]]
        meshes = [str(entry["mesh"]) for entry in each["excited_by"]]
        named = {"kind": "\n".join(kinds), "exciting": "\n".join(meshes)}
        if len(set(kinds)) == 1:
            named = {"kind": kinds[0], "exciting": ", ".join(meshes)}
        named["at"] = f"{each['mesh_frequency_Hz']:.5g}"
        for mesh in each["meshes"]:
            yield each | mesh | named
            named = dict.fromkeys(named, "")


def _optional(key: str, factor: float = 1.0, figures: int = 4) -> Cell:
    """A dash where there is no such thing."""
    return lambda row: "-" if row[key] is None else number(factor * row[key], figures)


def _span(low: str, high: str) -> Cell:
    return lambda row: "-" if row[low] is None else f"{row[low]:.4g} - {row[high]:.4g}"


WORDS = ("resonance",)  # columns of text
MESH: Cells = {
    "mesh": lambda row: str(row["mesh"]),
    "mean stiffness\n[N/m]": cell("mean_stiffness_N_per_m"),
    "first harmonic\nover mean": cell("first_harmonic_over_mean", figures=3),
    "mean deflection\n[um]": cell("mean_deflection_m", 1e6, 4),
    "best tip\nrelief [um]": _optional("optimal_tip_relief_m", 1e6),
}
PLACE: Cells = {
    "resonance": lambda row: str(row["kind"]),
    "excited\nby mesh": lambda row: str(row["exciting"]),
    "at\n[Hz]": lambda row: str(row["at"]),
    "mesh": lambda row: str(row["mesh"]),
}
PHASE: Cells = {
    "resonance": lambda row: str(row["resonance"]).partition(" of ")[0],
    "at\n[Hz]": lambda row: f"{row['mesh_frequency_Hz']:.5g}",
    "mesh": lambda row: str(row["mesh"]),
    "phase\n[base pitches]": _optional("phase_of_least_drive", figures=3),
    "excitation\nover now": _optional("least_drive_over_drive", figures=3),
}
PEAK: Cells = PLACE | {
    "peak\nat [Hz]": _optional("peak_frequency_Hz"),
    "RMS of\nDTE [um]": _optional("dte_rms_m", 1e6),
    "angle\n[rad]": _optional("separation_angle_rad", figures=3),
    "contact lost\n[Hz]": _span("contact_lost_from_Hz", "contact_lost_to_Hz"),
}
SUBHARMONIC: Cells = PLACE | {
    "unstable\n[Hz]": _span("unstable_from_Hz", "unstable_to_Hz"),
    "contact lost\n[Hz]": _span("contact_lost_from_Hz", "contact_lost_to_Hz"),
    "gone from\ndamping": _optional("damping_ratio_without_instability", figures=3),
}
