"""What a gear set holds and what follows from it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fegear.commands.show.derived import gear_set_figures
from fegear.commands.show.fault_values import fault_lines
from fegear.commands.show.force_values import force_lines
from fegear.commands.show.gear_set_figure import gear_set_figure, outlines
from fegear.files.dxf import write_dxf
from fegear.files.keys import UNITS
from fegear.files.output import INTO_PICTURE, PICTURES, path_of
from fegear.gearset.model import GearSet
from fegear.studies.page import ROUND_OFF, ColumnTable, Page, pluralize
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.trains.gear_sets import DEFAULT_PAIR, GearSetRef

# Ends of names and what they mean on the screen, longer ones first.
LABELS = {
    "_roll_angle_deg": ", roll angle [deg]",
    **{f"_{end}": f" [{unit}]" for end, unit in UNITS.items()},
    "_origin": " is",
}
# Figures whose names do not say it all.
HEADERS = {
    "profile_shift": "Profile shift [modules]",
    "tooth_thickness_mm": "Tooth thickness on the reference circle [mm]",
    "tooth_thinning_um": "Tooth thinning [um]",
    "span_teeth": "Base tangent length over teeth",
    "span_mm": "Base tangent length [mm]",
    "pin_diameter_mm": "Diameter of pins, or balls of helical teeth [mm]",
    "pin_dimension_mm": "Dimension over two of them [mm]",
    "young_modulus_GPa": "Young's modulus [GPa]",
    "poisson_ratio": "Poisson's ratio",
    "center_distance_mm": "Centre distance [mm]",
    "profile_shift_sum": "Sum of profile shifts [modules]",
    "fitting_profile_shift_sum": "Sum that fits this distance [modules]",
    "fitting_center_distance_mm": "Distance that fits these shifts [mm]",
    "center_line_deg": "Centre line [deg]",
    "normal_backlash_um": "Normal backlash of the teeth [um]",
    "backlash_um": "Backlash of lumped models [um]",
    "misalignment_um": "Misalignment, gap at the far end [um]",
    "normal_width_gap_near_um": "Normal gap of both flanks, near end [um]",
    "normal_width_gap_middle_um": "Normal gap of both flanks, middle [um]",
    "normal_width_gap_far_um": "Normal gap of both flanks, far end [um]",
    "normal_tip_thickness_mm": "Normal tip thickness [mm]",
    "approach_pitches": "Path of approach [base pitches]",
    "recess_pitches": "Path of recess [base pitches]",
    "geometric_phase_pitches": "Phase by geometry [base pitches]",
    "pitch_errors_repeat_pitches": "Pitch errors repeat after [base pitches]",
    "mean_stiffness_N_per_m": "Mean stiffness, given [N/m]",
    "stiffness_variation": "Stiffness variation, peak to peak over mean",
    "load_share": "Load share at the start of double contact",
    "sap_radius_mm": "Start of contact, radius [mm]",
    "form_roll_angle_deg": "Form circle, roll angle [deg]",
    "sap_roll_angle_deg": "Start of contact, roll angle [deg]",
    "lpstc_roll_angle_deg": "LPSTC, roll angle [deg]",
    "hpstc_roll_angle_deg": "HPSTC, roll angle [deg]",
    "tip_root_clearance_mm": "Tip to mate's root [mm]",
    "mesh_cycles_per_turn": "Mesh cycles per turn of the input",
    "center_radius_mm": "Circle of the planets' axes, radius [mm]",
    "positions_deg": "Positions of the planets [deg]",
    "position_errors_um": "Position errors of the planets [um]",
    "input_torques_Nm": "Torques on the input [N m]",
    "speed_over_input": "Speed over that of the input",
    "speed_against_carrier_over_input": "Speed against the carrier over the input's",
    "torque_over_input": "Torque from outside over that on the input",
    "power_over_input": "Power from outside over that of the input",
    "rolling_power_over_input": "Power rolling through the meshes over the input's",
    "loss_per_friction": "Power lost over the input's, per coefficient of friction",
    "phase_deg": "Phases of the planets [deg]",
    "torque_sum": "Sum of the planets' torques, drives rotation",
    "force_sum": "Sum of the planets' forces, drives translation",
    "own_force_outside_sums": "Each planet's own force outside both sums, drives "
    "planets",
    "drives": "Drives, the largest first",
    "magnitude_um": "[um]",
    "length_pitches": "length [pitch angles]",
}
# Section of a helical gear in which lengths and angles are those of the table.
NORMAL, TRANSVERSE = "normal", "transverse"
SECTION_OF_FIGURE = {
    **dict.fromkeys(
        ("module_mm", "pressure_angle_deg", "profile_shift", "rack_tip_radius_mm"),
        NORMAL,
    ),
    "span_mm": NORMAL,
    **dict.fromkeys(("profile_shift_sum", "fitting_profile_shift_sum"), NORMAL),
    **dict.fromkeys(
        ("tooth_thinning_um", "tip_thickness_mm", "tooth_thickness_mm"), TRANSVERSE
    ),
    **dict.fromkeys(
        ("operating_pressure_angle_deg", "contact_ratio", "base_pitch_mm"), TRANSVERSE
    ),
    **dict.fromkeys(("backlash_um", "misalignment_um"), TRANSVERSE),
    **dict.fromkeys(("approach_pitches", "recess_pitches"), TRANSVERSE),
    **dict.fromkeys(("magnitude_um", "crowning_um", "slope_um"), TRANSVERSE),
    **dict.fromkeys(("end_relief_um", "length_pitches"), TRANSVERSE),
    **dict.fromkeys(("least_deviation_um", "largest_deviation_um"), TRANSVERSE),
}
# Names of columns, and what is in another table.
HIDDEN_OF_GEARS = {"name", "form_roll_angle_deg", "tip_roll_angle_deg"}
HIDDEN_OF_MESHES = {"driver", "driven", "ratio", "flanks"}
DRAWING_ENDING = ".dxf"
# What alone differs between meshes of equal planets
PLACEMENT_KEYS = {
    "driver",
    "driven",
    "center_line_deg",
    "phase_pitches",
    "phase_origin",
}
PLACEMENT_KEYS |= {"geometric_phase_pitches"}
HIDDEN_OF_FLANKS = {"gear", "role"}


@dataclass(frozen=True, kw_only=True)
class DerivedGeometry(Study, command="show", example="show liu-idler --plot idler.png"):
    """Geometry and forces of a gear set, and what was inferred."""

    pictures = NO_PICTURES
    output = (
        f"Draw the gears {INTO_PICTURE}, or write outlines of their teeth and bores "
        f"[mm] to a {DRAWING_ENDING} file."
    )
    output_names = "--plot", "-o"
    endings = (*PICTURES, DRAWING_ENDING)

    gear_set: GearSetRef = DEFAULT_PAIR

    def tasks(self) -> Iterator[Task]:
        yield Task("figures", self._describe_gear_set)

    def _describe_gear_set(self, job: Job) -> DerivedGeometryResult:
        return DerivedGeometryResult(self, self.gear_set.loaded)


@dataclass(frozen=True, eq=False)
class DerivedGeometryResult(StudyResult):
    """Figures of the gear set; its picture is the file that is written."""

    study: DerivedGeometry
    gears: GearSet

    dots_per_inch = 150

    @cached_property
    def summary(self) -> dict[str, Any]:
        return gear_set_figures(self.gears)

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": lambda: gear_set_figure(self.gears)}

    def write(self, path: str | Path) -> None:
        """Draw the gears, or write their outlines as ``.dxf``."""
        target = path_of(path)
        if target.suffix.lower() == DRAWING_ENDING:
            write_dxf(target, outlines(self.gears))
        else:
            self.draw(target)

    def page(self) -> Page:
        """A row for each quantity with its unit."""
        values = self.summary
        gears, meshes = values["gears"], values["meshes"]
        yield ": ".join(filter(None, (values["name"], values["description"]))) + "\n"
        if values["planetary"]:
            yield from _planetary_page(values)
            gears, meshes = _without_equal_planets(gears, meshes)
        names = [gear["name"] for gear in gears]
        helical = any(mesh.is_helical for mesh in self.gears.meshes)
        yield _figures_table("Gear", names, gears, HIDDEN_OF_GEARS, helical)
        pairs = [f"{mesh['driver']} > {mesh['driven']}" for mesh in meshes]
        yield _figures_table("Mesh", pairs, meshes, HIDDEN_OF_MESHES, helical)
        for pair, mesh in zip(pairs, meshes, strict=True):
            title, flanks = f"Flanks of {pair}", mesh["flanks"]
            sides = [flank["gear"] for flank in flanks]
            yield _figures_table(title, sides, flanks, HIDDEN_OF_FLANKS, helical)
        faults = [line for gear in self.gears.gears for line in fault_lines(gear)]
        if faults:
            yield "Faults:"
        yield from (f"- {line}" for line in faults)
        yield from (shaft_line(**shaft) for shaft in values["shafts"])
        if values["housing"]:
            yield f"Housing: {values['housing']}"
        yield from force_lines(values, self._planet_names)
        if values["damping_ratio"] is not None:
            yield f"Damping ratio: {shown_value(values['damping_ratio'])}"
        if values["inferences"]:
            yield "Inferred:"
        yield from (f"- {inference}" for inference in values["inferences"])

    @property
    def _planet_names(self) -> list[str]:
        carrier, gears = self.gears.carrier, self.gears.gears
        return [] if carrier is None else [gears[n].name for n in carrier.planets]


def _planetary_page(values: dict[str, Any]) -> Page:
    """Motion and power of the members, harmonics, phases and the carrier."""
    figures = values["planetary"]
    lists = "members", "harmonics"
    alone = {key: value for key, value in figures.items() if key not in lists}
    yield _figures_table("Planetary set", ["value"], [alone], set())
    members, harmonics = figures["members"], figures["harmonics"]
    yield _figures_table(
        "Member", [row["member"] for row in members], members, {"member"}
    )
    names = [str(row["harmonic"]) for row in harmonics]
    yield _figures_table("Harmonic of the mesh", names, harmonics, {"harmonic"})
    meshes = values["meshes"]
    pairs = [f"{mesh['driver']} > {mesh['driven']}" for mesh in meshes]
    phases = [shown_value(mesh["phase_pitches"]) for mesh in meshes]
    lines = [shown_value(mesh["center_line_deg"]) for mesh in meshes]
    columns = {header("phase_pitches"): phases, header("center_line_deg"): lines}
    yield ColumnTable(pairs, columns, "Mesh")


def _without_equal_planets(
    gears: list[dict[str, Any]], meshes: list[dict[str, Any]]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Gears and meshes that differ from those before by more than name and place."""
    return _distinct_items(gears, {"name"}), _distinct_items(meshes, PLACEMENT_KEYS)


def _distinct_items(
    items: list[dict[str, Any]], apart: set[str]
) -> list[dict[str, Any]]:
    seen: list[dict[str, Any]] = []
    different = []
    for item in items:
        figures = {key: value for key, value in item.items() if key not in apart}
        figures["flanks"] = [
            {key: value for key, value in flank.items() if key != "gear"}
            for flank in item.get("flanks", [])
        ]
        if figures not in seen:
            seen.append(figures)
            different.append(item)
    return different


def shaft_line(
    gears: Sequence[str],
    stiffness_Nm_per_rad: float | None,
    length_mm: float | None = None,
    mass_kg: float | None = None,
    bearings: int = 0,
    bearing_kz_N_per_m: Sequence[float] = (),
    rolling_bearings: Sequence[dict[str, Any]] = (),
    driven_from: str | None = None,
) -> str:
    """Rigid shaft: a, b; or its stiffness between successive gears; and its body."""
    line = f"Rigid shaft: {', '.join(gears)}"
    if stiffness_Nm_per_rad is not None:
        stiffness = shown_value(stiffness_Nm_per_rad)
        line = (
            f"Shaft: {', '.join(gears)}, {stiffness} N m/rad between successive gears"
        )
    elif len(gears) == 1:
        line = f"Shaft: {gears[0]}"
    if length_mm is None or mass_kg is None:
        return line
    body = f"{shown_value(length_mm)} mm long, {shown_value(mass_kg)} kg"
    line = f"{line}; {body}, {pluralize(bearings, 'bearing')}"
    if rolling_bearings:
        line = f"{line}: {', '.join(map(_rolling_text, rolling_bearings))}"
    elif bearing_kz_N_per_m:
        axial = shown_value(list(bearing_kz_N_per_m))
        line = f"{line} with {axial} N/m along the axis"
    if driven_from is not None:
        line = f"{line}; torque from outside at its {driven_from}"
    return line


def _rolling_text(bearing: dict[str, Any]) -> str:
    """9 balls at -25 deg, or 12 rollers."""
    if "rollers" in bearing:
        return pluralize(bearing["rollers"], "roller")
    angle = shown_value(bearing["free_contact_angle_deg"])
    return f"{pluralize(bearing['balls'], 'ball')} at {angle} deg"


def _figures_table(
    corner: str,
    names: Sequence[str],
    items: Sequence[dict[str, Any]],
    hidden: set[str],
    helical: bool = False,
) -> ColumnTable:
    """A column for each item, a row for each figure that any of them has.

    helical : whether labels name the section
    """
    flat_items = [flattened(item) for item in items]
    all_keys = dict.fromkeys(key for figures in flat_items for key in figures)
    keys = [key for key in all_keys if key not in hidden]
    cells = ([shown_value(figures.get(key)) for key in keys] for figures in flat_items)
    columns = dict(zip(names, cells, strict=True))
    return ColumnTable([header(key, helical) for key in keys], columns, corner)


def flattened(figures: dict[str, Any]) -> dict[str, Any]:
    """Reliefs as `tip_relief.shape` and so on, other modifications alike; without those
    that are not there, and without faults, which have lines of their own."""
    flat: dict[str, Any] = {}
    for key, value in figures.items():
        if key == "faults":
            continue
        if isinstance(value, dict):
            flat |= {f"{key}.{name}": inner for name, inner in value.items()}
        elif not key.endswith(("_relief", "profile", "lead", "topography")):
            flat[key] = value
    return flat


def header(key: str, helical: bool = False) -> str:
    """`base_radius_mm` as `Base radius [mm]`.

    helical : whether the section of lengths and angles is named
    """
    place, _, name = key.rpartition(".")
    end = next((end for end in LABELS if name.endswith(end)), "")
    label = name.removesuffix(end).replace("_", " ") + LABELS.get(end, "")
    text = f"{place.replace('_', ' ')} {HEADERS.get(name, label)}".strip()
    if helical and (section := section_of(name)):
        quantity, bracket, unit = text.partition(" [")
        text = f"{quantity}, {section}{bracket}{unit}"
    return text[0].upper() + text[1:]


def section_of(name: str) -> str:
    """Section of a helical gear that a figure is of, nothing where it has none."""
    if name.endswith("_roll_angle_deg"):
        return TRANSVERSE
    return SECTION_OF_FIGURE.get(name, "")


def shown_value(value: Any) -> str:
    """Six figures of a number; lists joined, nothing as a dash."""
    if isinstance(value, list):
        return ", ".join(map(shown_value, value)) or "-"
    if isinstance(value, float):
        return "0" if abs(value) < ROUND_OFF else f"{value:.6g}"
    return "-" if value is None else str(value)
