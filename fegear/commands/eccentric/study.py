"""An eccentric circular wheel and the wheel that it drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.commands.eccentric.elastic_wheel import ElasticWheel
from fegear.commands.eccentric.gearing import ANGLES, Gearing
from fegear.commands.eccentric.gearing_figure import draw_gearing
from fegear.commands.eccentric.gearing_files import (
    DRAWINGS,
    FILMS,
    MESHES,
    write_animation,
    write_drawing,
)
from fegear.commands.eccentric.turn import STEEL, Columns, contact_columns, wheel_meshes
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.output import TABLE_FORMATS, TO_SINGLE_TABLE, TO_TABLE
from fegear.statics.choices import RESOLUTION
from fegear.statics.plausibility import check_warnings, plausibility_warnings
from fegear.studies.columns import meanings
from fegear.studies.page import Page, number
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import display_name, setting
from fegear.studies.study import Study
from fegear.studies.table import Table
from lumped.common.csv_text import format_exact
from lumped.common.options import Range

LENGTH = Range(least=1e-3, most=1e6, unit="mm")
WIDTH = 10.0  # mm
BLOCK = 8  # positions that are solved and kept together
POSITIONS, MIN_POSITIONS = (
    8,
    4,
)  # for each tooth: by default, and below which peaks are missed
LEGEND = {
    "frames": "each wheel's own, the origin in its bearing; both wheels are assembled "
    "with the driven bearing at x = center_distance_mm and the driver turns clockwise",
    "base curves": "of the flanks that drive; those of the other flanks are their "
    "mirror images about the x axis",
}
OF_CONTACT = "transmission_error_um", "contact_torque_ratio"
CONTACT = {"contact": f"Write the contact over the turn {TO_SINGLE_TABLE}."}
FILM = {"animate": ("Film of a turn of the driven wheel, .gif or .mp4.", FILMS)}


@dataclass(frozen=True, kw_only=True)
class Eccentric(
    Study,
    command="eccentric",
    example="eccentric --radius 20 --eccentricity 6 --teeth 40 -o wheels.svg",
):
    """An eccentric circular wheel, and the wheel that it drives.

    The pitch curve and centre distance follow from rolling, and the base curve, which
    determines whether involute teeth are possible, from the pressure angle. With teeth
    both wheels are drawn and meshed, and under a torque their contact is solved over a
    turn.
    """

    resumes = True
    partial = True
    unit = "block"
    checkpoint_beside = "contact"
    output = (
        f"Write the points of the curves {TO_TABLE}, drawings to scale to .svg or .dxf "
        "[mm], meshes to .msh or .vtu [m]."
    )
    endings = (*TABLE_FORMATS, *DRAWINGS, *MESHES)
    more_tables = CONTACT
    more_files = FILM

    radius: float = setting(
        MISSING, "Radius of the driver's pitch circle [mm].", LENGTH
    )
    eccentricity: float = setting(
        MISSING,
        "Distance of the driver's bearing from its centre [mm].",
        Range(0.0, 1e6, "mm"),
    )
    ratio: float = setting(
        1.0,
        "Gear ratio, turns of the driver for one of the driven wheel: a whole number.",
    )
    pressure_angle: float = setting(20.0, "Angle of the line of action [degrees].")
    teeth: int | None = setting(
        None,
        "Number of teeth of the driver. [default: none, pitch and base curves only]",
    )
    addendum: float | None = setting(
        None, "Addendum of the teeth [modules]. [default: 1]"
    )
    dedendum: float | None = setting(
        None, "Dedendum of the teeth [modules]. [default: 1.25]"
    )
    torque: float | None = setting(
        None,
        "Torque on the driver [N\u00a0m], for the contact of steel wheels over a turn "
        "of the driven wheel. [default: none]",
        Range(least=1e-6, below=1e9, unit="N m"),
    )
    face_width: float | None = setting(
        None, "Width of both wheels [mm]. [default: 10]", LENGTH
    )
    positions: int | None = setting(
        None,
        "Number of positions in a turn of the driven wheel. [default: 8 for each "
        "of its teeth]",
        Range(1, 100_000),
    )
    bore: float | None = setting(
        None,
        "Radius of both bores [mm], for meshes and contact. [default: two fifths "
        "of the largest possible]",
        LENGTH,
    )
    resolution: Literal["coarse", "default", "fine"] | None = setting(
        None, f"{RESOLUTION} [default: default]"
    )

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        if self.teeth is None:
            yield from ((name, "needs {teeth}") for name in ("addendum", "dedendum"))
        if self.torque is not None:
            return
        for name in ("face_width", "positions", "contact"):
            yield name, "needs {torque}"
        if Path(outputs.get("output", "")).suffix not in MESHES:
            for name in ("bore", "resolution"):
                yield name, "needs {torque} or an {output} in .msh or .vtu"

    @property
    def gearing(self) -> Gearing:
        """What the wheels are; InputError where there are no such wheels."""
        options = {"addendum": self.addendum, "dedendum": self.dedendum}
        heights = {name: value for name, value in options.items() if value is not None}
        place = self.radius, self.eccentricity, self.ratio
        return Gearing(*place, self.pressure_angle, self.teeth, **heights)

    @property
    def width(self) -> float:
        """Width of both wheels [mm]."""
        return self.face_width or WIDTH

    @property
    def meshing(self) -> tuple[float | None, str]:
        """Bore [mm] and resolution of both wheels' meshes."""
        return self.bore, self.resolution or "default"

    def prepare(self) -> EccentricProblem:
        return EccentricProblem(self, self.gearing)


@dataclass(frozen=True, eq=False)
class EccentricProblem(Problem):
    """Eccentric wheels, and the positions of their contact."""

    study: Eccentric
    gearing: Gearing

    def tasks(self) -> Iterator[Task]:
        study, toothed = self.study, self.gearing.toothed
        if study.torque is None:
            return
        if toothed is None:
            torque, teeth = display_name(study, "torque"), display_name(study, "teeth")
            raise InputError(
                f"{torque} needs {teeth}: pitch curves alone carry no load"
            )
        meshes = wheel_meshes(self.gearing, *study.meshing)
        driver, driven = (ElasticWheel(mesh, STEEL) for mesh in meshes)
        for wheel in (driver, driven):  # before threads use them
            _ = wheel.factor, wheel.boundary
        count = study.positions or POSITIONS * toothed.driven.teeth
        arcs = toothed.driven.curve.length * np.arange(count) / count
        load = study.torque / (1e-3 * study.width)
        for place, block in enumerate(np.split(arcs, np.arange(BLOCK, count, BLOCK))):
            work = partial(contact_columns, toothed, driver, driven, load, block)
            yield Task(f"{place}", partial(_cached, work), size=1)

    def gather(self, results: Mapping[str, Columns | None]) -> EccentricResult:
        blocks: list[Columns] = []
        for block in results.values():
            if block is None:  # after Ctrl-C; positions from the first on are kept
                break
            blocks.append(block)
        columns = {
            name: np.array([v for block in blocks for v in block[name]], float)
            for name in (blocks[0] if blocks else ())
        }
        complete = len(blocks) == len(results)
        return EccentricResult(self.study, self.gearing, columns, complete)


def _cached(work: Callable[[], Columns], job: Job) -> Columns:
    """Compute positions, or read them from the checkpoint."""
    for columns in job.records:
        return columns
    columns = work()
    job.add_record(columns, {})
    return columns


@dataclass(frozen=True, eq=False, repr=False)
class EccentricResult(StudyResult):
    """Eccentric wheels; columns (n,) : of the contact over a turn, none without it."""

    study: Eccentric
    gearing: Gearing
    columns: Mapping[str, NDArray[np.float64]]
    complete: bool = True

    @property
    def empty(self) -> bool:
        return not (self.columns or self.complete)

    @cached_property
    def summary(self) -> dict[str, Any]:
        values = dict(self.gearing.summary)
        if self.columns:
            contact = self._contact(values)
            values |= {"contact": contact, "warnings": contact["warnings"]}
        return values

    def _contact(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Plain values; those of the gearing are given."""
        study, columns = self.study, self.columns
        error, ratio = columns["transmission_error_um"], columns["contact_torque_ratio"]
        off = float(np.abs(ratio / columns["torque_ratio"] - 1.0).max())
        pressure = float(columns["contact_pressure_MPa"].max())
        where = f"contact at {study.torque:g} N m"
        warnings = [
            *self._sparse(values["driven_teeth"]),
            *check_warnings("W09", where, "torque ratios against the kinematics", off),
            *plausibility_warnings(
                where,
                1e-3 * values["module_mm"],
                deflection=1e-6 * float(error.max()),
                pressure=1e6 * pressure,
            ),
        ]
        return {
            "torque_Nm": study.torque,
            "face_width_mm": study.width,
            "positions": int(error.size),
            "complete": self.complete,
            "mean_transmission_error_um": float(error.mean()),
            "peak_to_peak_transmission_error_um": float(np.ptp(error)),
            "largest_deviation_of_torque_ratio": off,
            "largest_contact_pressure_MPa": pressure,
            "warnings": warnings,
        }

    def _sparse(self, teeth: int) -> Iterator[str]:
        """Warnings where there are too few positions for the largest values."""
        positions = self.study.positions
        if positions is not None and positions < MIN_POSITIONS * teeth:
            yield with_code(
                "W20",
                f"positions = {positions} is less than {MIN_POSITIONS} for each of the "
                f"{teeth} teeth: largest values and peak to peak may lie between them",
            )

    @property
    def table(self) -> Table:
        """Points of all curves."""
        gearing = self.gearing
        names = "curve", "index", "x_mm", "y_mm"
        return Table(names, gearing.rows, {**gearing.header, **LEGEND})

    @property
    def more_tables(self) -> dict[str, Table]:
        study = self.study
        settings = {
            "torque_Nm": format_exact(study.torque or 0.0),
            "face_width_mm": format_exact(study.width),
            "resolution": study.meshing[1],
            "plane": STEEL.plane,
        }
        legend = meanings("eccentric", *OF_CONTACT, table="contact")
        corners = {"tip corners": "no contact outside of the path of contact"}
        header = {**self.gearing.header, **settings, **legend, **corners}
        return {"contact": Table.of(self.columns, header)}

    def write(self, path: str | Path) -> None:
        """Write curves, a drawing or meshes by the ending of the path."""
        if Path(path).suffix.lower() in (*DRAWINGS, *MESHES):
            write_drawing(self.gearing, Path(path), *self.study.meshing)
        else:
            super().write(path)

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": partial(draw_gearing, self.gearing, self.columns)}

    @property
    def more_files(self) -> dict[str, Callable[[Path], None]]:
        return {"animate": partial(write_animation, self.gearing)}

    def page(self) -> Page:
        values = self.summary
        yield (
            f"radius {values['radius_mm']:g} mm, eccentricity "
            f"{values['eccentricity_mm']:g} mm, ratio {values['ratio']}, pressure "
            f"angle {values['pressure_angle_deg']:g} degrees"
        )
        yield (
            f"centre distance {values['center_distance_mm']:.9g} mm; Burmester's "
            f"approximation {values['burmester_center_distance_mm']:.9g} mm, with "
            "which the driven curve misses itself by "
            f"{values['burmester_closing_error_deg']:.3g} degrees"
        )
        if values["feasible"]:
            yield "involute teeth are possible on both pitch curves"
        else:
            yield f"not feasible: {values['reason']}"
        angle, most = values["largest_pressure_angle_deg"], ANGLES[1]
        angle_text = f"{number(angle, 4)}" if angle <= most else f"above {most:g}"
        yield (
            f"largest pressure angle {angle_text} degrees with this eccentricity, "
            f"largest eccentricity {number(values['largest_eccentricity_mm'], 5)} mm "
            "with this pressure angle"
        )
        yield (
            f"torque ratio {values['least_torque_ratio']:.4g} to "
            f"{values['largest_torque_ratio']:.4g} over a turn"
        )
        if "module_mm" in values:
            yield (
                f"{values['driver_teeth']} and {values['driven_teeth']} teeth, module "
                f"{values['module_mm']:.6g} mm, contact ratio "
                f"{values['least_contact_ratio']:.3f} to "
                f"{values['largest_contact_ratio']:.3f}"
            )
        if "contact" in values:
            yield from _page_of_contact(values["contact"])


def _page_of_contact(values: Mapping[str, Any]) -> Page:
    swing = values["peak_to_peak_transmission_error_um"]
    yield (
        f"under {values['torque_Nm']:g} N m on {values['face_width_mm']:g} mm: mean "
        f"transmission error {number(values['mean_transmission_error_um'], 4)} um, "
        f"peak to peak {number(swing, 4)} um, contact pressure up to "
        f"{number(values['largest_contact_pressure_MPa'], 4)} MPa, at "
        f"{values['positions']} positions"
    )
    yield with_code(
        "E11",
        "torques of the contact forces keep to the kinematics within "
        f"{values['largest_deviation_of_torque_ratio']:.1e}",
    )
