"""fegear stiffness: the mesh-stiffness table of a gear pair."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.options import (
    PlaneChoice,
    ResolutionChoice,
    checked_torques,
    progress_bar,
    require,
)
from fegear.cli.screen import print_json, ruled_table, screen

if TYPE_CHECKING:
    from fegear.statics import StaticsResult

EPILOG = "Example: fegear stiffness liu-idler --mesh 2 -o mesh2.csv --plot mesh2.png"
POSITIONS_LIMIT = 1_000_000


def stiffness_command(
    set_name: Annotated[
        str, typer.Argument(metavar="[SET]", help="Built-in gear set or path of one.")
    ] = "liu-pair",
    mesh: Annotated[int, typer.Option(help="Which mesh, counted from 1.")] = 1,
    torque: Annotated[
        list[float] | None,
        typer.Option(help="Torque on the driving gear [N m]; may be repeated."),
    ] = None,
    positions: Annotated[int, typer.Option(help="Positions per base pitch.")] = 64,
    friction: Annotated[float, typer.Option(help="Coulomb coefficient.")] = 0.0,
    plane: Annotated[
        PlaneChoice, typer.Option(help="Plane hypothesis.")
    ] = PlaneChoice.stress,
    resolution: Annotated[
        ResolutionChoice, typer.Option(help="Of mesh and contact.")
    ] = ResolutionChoice.default,
    corner_contact: Annotated[
        bool,
        typer.Option(
            "--corner-contact/--no-corner-contact",
            help="Tip corners touch before and after the nominal path.",
        ),
    ] = True,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the table, CSV.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the table, PNG.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the summary as JSON.")
    ] = False,
) -> None:
    """Stiffness, transmission error and load sharing over a mesh cycle."""
    from fegear.errors import InputError
    from fegear.gearset import load_gear_set
    from fegear.output import require_writable

    for path in (output, plot):
        if path is not None:
            require_writable(path)
    gear_set = load_gear_set(set_name)
    torques = checked_torques(torque or [])
    require(0.0 <= friction < 0.5, "--friction", friction, "allowed 0 to below 0.5")
    limit = f"allowed 1 to {POSITIONS_LIMIT}"
    require(1 <= positions <= POSITIONS_LIMIT, "--positions", positions, limit)
    count = len(gear_set.meshes)
    require(1 <= mesh <= count, "--mesh", mesh, f"{gear_set.name} has {count}")
    if not torques and not gear_set.meshes[mesh - 1].torques:
        raise InputError(
            f"--torque is missing; {gear_set.name} names no load for mesh {mesh}"
        )
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
    _write(result, output, plot)
    _print_summary(result, as_json)


def _write(result: StaticsResult, output: Path | None, plot: Path | None) -> None:
    from fegear.output import write_text, write_whole
    from lumped.table import format_table

    if output is not None:
        text = format_table(result.table)
        write_text(output, text)
    if plot is not None:
        from fegear.plots import draw_table, save_figure

        write_whole(plot, lambda path: save_figure(draw_table(result), path))


def _print_summary(result: StaticsResult, as_json: bool) -> None:
    from fegear.summary import summary

    if as_json:
        print_json(summary(result))
    else:
        print_summary(summary(result))


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
    console.print(_torque_table(values["torques"]))
    for line in _evidence_lines(values["evidence"]):
        console.print(line)
    stages = ", ".join(f"{name} {s:.3f} s" for name, s in values["seconds"].items())
    peak = values["peak_memory_MB"]
    memory = f"; peak memory {peak:.0f} MB" if isfinite(peak) else ""
    console.print(f"time: {stages}{memory}")


def _torque_table(torques: list[dict[str, float]]) -> Any:
    columns = {
        "torque\nN m": ("torque_Nm", 1.0, "{:.4g}"),
        "mean k\n1e8 N/m": ("mean_stiffness_N_per_m", 1e-8, "{:.4f}"),
        "k p-p/\nmean k": ("peak_to_peak_over_mean", 1.0, "{:.4f}"),
        "local k\n1e8 N/m": ("mean_local_stiffness_N_per_m", 1e-8, "{:.4f}"),
        "STE\nmean um": ("ste_mean_um", 1.0, "{:.3f}"),
        "STE\np-p um": ("ste_peak_to_peak_um", 1.0, "{:.3f}"),
        "NLTE\np-p um": ("nlte_peak_to_peak_um", 1.0, "{:.3f}"),
        "p pitch\nMPa": ("pressure_at_pitch_point_MPa", 1.0, "{:.0f}"),
        "friction\nbending": ("friction_bending_ratio_mean", 1.0, "{:.3f}"),
    }
    table = ruled_table(*columns, text=0)
    for row in torques:
        table.add_row(
            *(form.format(scale * row[key]) for key, scale, form in columns.values())
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


stiffness_command.__doc__ = f"{stiffness_command.__doc__}\n\n{EPILOG}"
