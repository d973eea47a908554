"""fegear show: what a gear set holds and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fegear.cli.options import AsJson, SetName, require_outputs
from fegear.cli.screen import ROUND_OFF, print_columns, print_json, screen

if TYPE_CHECKING:
    from fegear.gearset.derived import GearSetFigures, ShaftFigures

EXAMPLE = "fegear show liu-idler --plot idler.png"
# Row header, with its unit, and the figure that it shows.
GEAR_ROWS = {
    "Teeth": "teeth",
    "Module [mm]": "module_mm",
    "Pressure angle [deg]": "pressure_angle_deg",
    "Profile shift [modules]": "profile_shift",
    "Reference radius [mm]": "reference_radius_mm",
    "Base radius [mm]": "base_radius_mm",
    "Tip radius [mm]": "tip_radius_mm",
    "Form radius [mm]": "form_radius_mm",
    "Root radius [mm]": "root_radius_mm",
    "Hub radius [mm]": "hub_radius_mm",
    "Rack tip radius [mm]": "rack_tip_radius_mm",
    "Tip thickness [mm]": "tip_thickness_mm",
    "Face width [mm]": "face_width_mm",
    "Largest pitch error [um]": "largest_pitch_error_um",
    "Inertia [kg m2]": "inertia_kg_m2",
    "Inertia is": "inertia_origin",
    "Mass [kg]": "mass_kg",
    "Mass is": "mass_origin",
    "Bearing kx [N/m]": "bearing_kx_N_per_m",
    "Bearing ky [N/m]": "bearing_ky_N_per_m",
    "Coupling stiffness [N m/rad]": "coupling_stiffness_Nm_per_rad",
    "Young's modulus [GPa]": "young_modulus_GPa",
    "Poisson's ratio": "poisson_ratio",
    "Density [kg/m3]": "density_kg_per_m3",
}
MESH_ROWS = {
    "Centre distance [mm]": "center_distance_mm",
    "Operating pressure angle [deg]": "operating_pressure_angle_deg",
    "Contact ratio": "contact_ratio",
    "Base pitch [mm]": "base_pitch_mm",
    "Normal backlash of the teeth [um]": "normal_backlash_um",
    "Backlash of lumped models [um]": "backlash_um",
    "Path of approach [base pitches]": "approach_pitches",
    "Path of recess [base pitches]": "recess_pitches",
    "Phase [base pitches]": "phase_pitches",
    "Phase is": "phase_origin",
    "Phase by geometry [base pitches]": "geometric_phase_pitches",
    "Centre line [deg]": "center_line_deg",
    "Driver torques [N m]": "driver_torques_Nm",
    "Pitch errors repeat after [base pitches]": "pitch_errors_repeat_pitches",
    "Mean stiffness, given [N/m]": "mean_stiffness_N_per_m",
    "Stiffness variation, peak to peak over mean": "stiffness_variation",
    "Load share at the start of double contact": "load_share",
}
FLANK_ROWS = {
    "Start of contact, radius [mm]": "sap_radius_mm",
    "Form circle, roll angle [deg]": "form_roll_angle_deg",
    "Start of contact, roll angle [deg]": "sap_roll_angle_deg",
    "LPSTC, roll angle [deg]": "lpstc_roll_angle_deg",
    "HPSTC, roll angle [deg]": "hpstc_roll_angle_deg",
    "Tip, roll angle [deg]": "tip_roll_angle_deg",
    "Tip to mate's root [mm]": "tip_root_clearance_mm",
}
RELIEF_ROWS = {
    "{} relief [um]": "magnitude_um",
    "{} relief start, roll angle [deg]": "start_roll_angle_deg",
    "{} relief length [pitch angles]": "length_pitches",
    "{} relief shape": "shape",
}


def show_command(
    set_name: SetName,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot", "-o", help="Draw the gears into this file, .png, .pdf or .svg."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Derived geometry of a gear set, and what was inferred."""
    from fegear.gearset import load_gear_set
    from fegear.gearset.derived import gear_set_figures
    from fegear.gearset.draw import save_gear_set_figure

    require_outputs([], [set_name], plot)
    gear_set = load_gear_set(set_name)
    figures = gear_set_figures(gear_set)
    if plot is not None:
        save_gear_set_figure(gear_set, plot)
    if as_json:
        print_json(asdict(figures))
    else:
        print_figures(figures)


def print_figures(figures: GearSetFigures) -> None:
    """Tables on the screen, a row for each quantity with its unit."""
    console = screen()
    console.print(": ".join(filter(None, (figures.name, figures.description))) + "\n")
    gears, meshes = figures.gears, figures.meshes
    names = [gear.name for gear in gears]
    pairs = [f"{mesh.driver} > {mesh.driven}" for mesh in meshes]
    print_columns(console, "Gear", GEAR_ROWS, columns(names, GEAR_ROWS, gears))
    print_columns(console, "Mesh", MESH_ROWS, columns(pairs, MESH_ROWS, meshes))
    for pair, mesh in zip(pairs, meshes, strict=True):
        sides = [flank.gear for flank in mesh.flanks]
        rows = FLANK_ROWS | relief_rows(mesh.flanks)
        cells = columns(sides, rows, mesh.flanks)
        print_columns(console, f"Flanks of {pair}", rows, cells)
    for shaft in figures.shafts:
        console.print(shaft_line(shaft))
    if figures.damping_ratio is not None:
        console.print(f"Damping ratio: {shown(figures.damping_ratio)}")
    if figures.inferences:
        console.print("Inferred, not printed by the source:")
    for inference in figures.inferences:
        console.print(f"- {inference}")


def shaft_line(shaft: ShaftFigures) -> str:
    """Rigid shaft: a, b; or its stiffness between successive gears."""
    names, stiffness = ", ".join(shaft.gears), shaft.stiffness_Nm_per_rad
    if stiffness is None:
        return f"Rigid shaft: {names}"
    return f"Shaft: {names}, {shown(stiffness)} N m/rad between successive gears"


def relief_rows(flanks: Sequence[object]) -> dict[str, str]:
    """Rows of those reliefs that at least one of the flanks has."""
    return {
        header.format(place.capitalize()): f"{place}_relief.{figure}"
        for place in ("tip", "root")
        if any(getattr(flank, f"{place}_relief") for flank in flanks)
        for header, figure in RELIEF_ROWS.items()
    }


def columns(
    names: Sequence[str], rows: Mapping[str, str], items: Sequence[object]
) -> dict[str, list[str]]:
    """A column of cells for each item by its name."""
    return {
        name: [shown(figure(item, path)) for path in rows.values()]
        for name, item in zip(names, items, strict=True)
    }


def figure(item: object, path: str) -> Any:
    """Attribute by a dotted path; None as soon as a part of it is None."""
    value: Any = item
    for name in path.split("."):
        value = None if value is None else getattr(value, name)
    return value


def shown(value: Any) -> str:
    """Six figures of a number; lists joined, nothing as a dash."""
    if isinstance(value, tuple):
        return ", ".join(map(shown, value)) or "-"
    if isinstance(value, float):
        return "0" if abs(value) < ROUND_OFF else f"{value:.6g}"
    return "-" if value is None else str(value)
