"""fegear stiffness: the mesh-stiffness table of a gear pair."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.options import (
    AsJson,
    Mesh,
    Output,
    PairName,
    Plane,
    PlaneChoice,
    Plot,
    Resolution,
    ResolutionChoice,
    driver_torques,
    progress_bar,
    require,
    require_friction,
    require_mesh,
    require_outputs,
)
from fegear.cli.screen import number, print_json, ruled_table, screen, warn

if TYPE_CHECKING:
    from fegear.statics import StaticsResult

EXAMPLE = "fegear stiffness liu-idler --mesh 2 -o mesh2.csv --plot mesh2.png"
POSITIONS_LIMIT = 1_000_000


def stiffness_command(
    set_name: PairName = "liu-pair",
    mesh: Mesh = 1,
    torque: Annotated[
        list[float] | None,
        typer.Option(
            "--torque",
            help="Torque on the driving gear of the mesh [N\u00a0m]; may be repeated. "
            "[default: all load cases of the gear set]",
        ),
    ] = None,
    positions: Annotated[
        int,
        typer.Option("--positions", help="Number of mesh positions per base pitch."),
    ] = 64,
    friction: Annotated[
        float, typer.Option("--friction", help="Coulomb friction coefficient.")
    ] = 0.0,
    plane: Plane = PlaneChoice.stress,
    resolution: Resolution = ResolutionChoice.default,
    corner_contact: Annotated[
        bool,
        typer.Option(
            "--corner-contact/--no-corner-contact",
            help="Contact of tip corners before and after the nominal path of contact.",
        ),
    ] = True,
    output: Output = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Mesh stiffness, transmission error and load sharing."""
    from fegear.gearset import load_gear_set

    require_outputs([output], [set_name], plot)
    gear_set = load_gear_set(set_name)
    require_mesh(gear_set, mesh)
    torques = driver_torques(gear_set, mesh, torque or [])
    require_friction(friction)
    limit = f"allowed 1 to {POSITIONS_LIMIT}"
    require(1 <= positions <= POSITIONS_LIMIT, "--positions", positions, limit)
    from fegear.statics import StaticsSettings, solve_mesh

    settings = StaticsSettings(
        positions=positions,
        friction=friction,
        plane=plane.value,
        resolution=resolution.value,
        corner_contact=corner_contact,
    )
    with progress_bar(enabled=not as_json) as report:
        result = solve_mesh(gear_set, mesh - 1, torques, settings, report)
    from fegear.summary import summary

    _write(result, output, plot)
    values = summary(result)
    if as_json:
        print_json(values)
    else:
        print_summary(values)
    warn(values["warnings"])


def _write(result: StaticsResult, output: Path | None, plot: Path | None) -> None:
    from fegear.output import write_text, write_whole
    from lumped.table import format_table

    if output is not None:
        write_text(output, format_table(result.table))
    if plot is not None:
        from fegear.plots import draw_table, save_figure

        write_whole(plot, lambda path: save_figure(draw_table(result), path))


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
    console.print(_torque_table(values["torques"]))
    for line in _evidence_lines(values["evidence"]):
        console.print(line)
    stages = ", ".join(f"{name} {s:.3f} s" for name, s in values["seconds"].items())
    peak = values["peak_memory_MB"]
    memory = f"; peak memory {peak:.0f} MB" if isfinite(peak) else ""
    console.print(f"time: {stages}{memory}")


def _torque_table(torques: list[dict[str, float]]) -> Any:
    columns = {
        "mean k\n1e8 N/m": ("mean_stiffness_N_per_m", 1e-8, 5),
        "k p-p/\nmean k": ("peak_to_peak_over_mean", 1.0, 4),
        "local k\n1e8 N/m": ("mean_local_stiffness_N_per_m", 1e-8, 5),
        "STE\nmean um": ("ste_mean_um", 1.0, 4),
        "STE\np-p um": ("ste_peak_to_peak_um", 1.0, 4),
        "NLTE\np-p um": ("nlte_peak_to_peak_um", 1.0, 4),
        "p pitch\nMPa": ("pressure_at_pitch_point_MPa", 1.0, 4),
        "friction\nbending": ("friction_bending_ratio_mean", 1.0, 3),
    }
    table = ruled_table("torque\nN m", *columns, words=())
    for row in torques:
        table.add_row(
            f"{row['torque_Nm']:g}",
            *(number(scale * row[key], n) for key, scale, n in columns.values()),
        )
    return table


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
        f"corner contact and friction), reciprocity {values['reciprocity']:.1e}"
    )
    return lines
