"""fegear stiffness: the mesh-stiffness table of a gear pair."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from fegear.cli.groups import grouped, option
from fegear.cli.options import (
    Elements,
    Friction,
    Mesh,
    Outputs,
    SetName,
    chosen,
    driver_torques,
    require_mesh,
)
from fegear.cli.screen import Cells, cell, filled_table, screen
from fegear.studies.study import Range

if TYPE_CHECKING:
    from fegear.statics import StaticsSettings

EXAMPLE = "fegear stiffness liu-idler --mesh 2 -o mesh2.csv --plot mesh2.png"


@dataclass(frozen=True, kw_only=True)
class StaticsOptions:
    """How the finite elements solve a table."""

    positions: int = option(
        "Number of mesh positions per base pitch.",
        default=64,
        allowed=Range(least=1, most=1_000_000),
    )
    friction: Friction = None
    elements: Elements
    body: Literal["held", "free"] = option(
        "What the bodies of the gears are held by. held: their hubs; free: nothing but "
        "their inertia, the compliance of gears that vibrate.",
        default="held",
    )
    corner_contact: bool = option(
        "Contact of tip corners before and after the nominal path of contact.",
        "--corner-contact/--no-corner-contact",
        default=True,
    )

    @property
    def settings(self) -> StaticsSettings:
        from fegear.statics import StaticsSettings

        return StaticsSettings(
            positions=self.positions,
            corner_contact=self.corner_contact,
            body=self.body,
            **chosen(friction=self.friction),
            **self.elements.choices,
        )


@grouped
def stiffness_command(
    *,
    set_name: SetName = "liu-pair",
    mesh: Mesh = 1,
    torque: Annotated[
        list[float] | None,
        typer.Option(
            help="Torque on the driving gear of the mesh [N\u00a0m]; may be repeated. "
            "[default: all load cases of the gear set]",
        ),
    ] = None,
    statics: StaticsOptions,
    outputs: Outputs,
) -> None:
    """Mesh stiffness, transmission error and load sharing."""
    from fegear.gearset import load_gear_set

    outputs.require(set_name)
    gear_set = load_gear_set(set_name)
    require_mesh(gear_set, mesh)
    torques = driver_torques(gear_set, mesh, torque or [])
    from fegear.plots import draw_table
    from fegear.statics import solve_mesh
    from lumped.table import format_table

    with outputs.progress() as report:
        result = solve_mesh(gear_set, mesh - 1, torques, statics.settings, report)
    outputs.write(lambda: format_table(result.table))
    outputs.draw(lambda: draw_table(result))
    outputs.show(result.summary, print_summary)


def print_summary(values: dict[str, Any]) -> None:
    """The summary as tables on the screen."""
    console = screen()
    console.print(
        f"{values['gear_set']} mesh {values['mesh']}, teeth "
        f"{values['teeth']}, face width {values['face_width_mm']:g} mm, plane "
        f"{values['plane']}, resolution {values['resolution']}, friction "
        f"{values['friction_coefficient']:g}, corner contact "
        f"{values['corner_contact']}"
    )
    console.print(f"contact ratio {values['contact_ratio']:.4f}")
    if values["base_pitches"] > 1:
        console.print(
            f"with pitch errors, tooth pairs repeat after {values['base_pitches']} "
            "base pitches: all of them are in the table"
        )
    console.print(filled_table(TORQUE_COLUMNS, values["torques"]))
    for line in _evidence_lines(values["evidence"]):
        console.print(line)
    stages = ", ".join(f"{name} {s:.3f} s" for name, s in values["seconds"].items())
    peak = values["peak_memory_MB"]
    memory = f"; peak memory {peak:.0f} MB" if isfinite(peak) else ""
    console.print(f"time: {stages}{memory}")


TORQUE_COLUMNS: Cells = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "mean k\n1e8 N/m": cell("mean_stiffness_N_per_m", 1e-8),
    "k p-p/\nmean k": cell("peak_to_peak_over_mean", figures=4),
    "local k\n1e8 N/m": cell("mean_local_stiffness_N_per_m", 1e-8),
    "STE\nmean um": cell("ste_mean_um", figures=4),
    "STE\np-p um": cell("ste_peak_to_peak_um", figures=4),
    "NLTE\np-p um": cell("nlte_peak_to_peak_um", figures=4),
    "p pitch\nMPa": cell("pressure_at_pitch_point_MPa", figures=4),
    "friction\nbending": cell("friction_bending_ratio_mean", figures=3),
}


def _evidence_lines(values: dict[str, float | None]) -> list[str]:
    lines = []
    if values["discretisation_ste_mean"] is not None:
        corner = values["discretisation_ste_corner"]
        lines.append(
            "discretisation, STE against a coarser mesh and contact grid: mean "
            f"{values['discretisation_ste_mean']:.1e}, on the path "
            f"{values['discretisation_ste_path']:.1e}, corner contact "
            + (f"{corner:.1e}" if corner is not None else "none")
        )
    lines.append(
        f"balance: complementarity {values['complementarity_residual']:.1e}, "
        f"T2/T1 against z2/z1 {values['torque_balance']:.1e} (tilted normals of "
        f"corner contact, relief and friction), its mean {values['work_balance']:.1e}, "
        f"reciprocity {values['reciprocity']:.1e}"
    )
    return lines
