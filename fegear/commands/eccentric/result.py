"""The result of `fegear eccentric`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.commands.eccentric.gearing import ANGLES, Gearing
from fegear.commands.eccentric.gearing_figure import draw_gearing
from fegear.commands.eccentric.gearing_files import (
    DRAWINGS,
    MESHES,
    write_animation,
    write_drawing,
)
from fegear.commands.eccentric.turn import STEEL
from fegear.files.codes import with_code
from fegear.statics.plausibility import check_warnings, plausibility_warnings
from fegear.studies.columns import meanings
from fegear.studies.page import Page, number
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from lumped.common.csv_text import format_exact

LEGEND = {
    "frames": "each wheel's own, the origin in its bearing; both wheels are assembled "
    "with the driven bearing at x = center_distance_mm and the driver turns clockwise",
    "base curves": "of the flanks that drive; those of the other flanks are their "
    "mirror images about the x axis",
}

CONTACT_TABLE_HEADER = "transmission_error_um", "contact_torque_ratio"
MIN_POSITIONS = 4  # for each tooth, below which peaks are missed


@dataclass(frozen=True, eq=False)
class EccentricResult(StudyResult):
    """Eccentric wheels; columns (n,) : of the contact over a turn, none without it."""

    study: Any
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
        off_path = float(np.abs(ratio / columns["torque_ratio"] - 1.0).max())
        pressure = float(columns["contact_pressure_MPa"].max())
        where = f"contact at {study.torque:g} N m"
        warnings = [
            *self._sparse_positions_warning(values["driven_teeth"]),
            *check_warnings(
                "W09", where, "torque ratios against the kinematics", off_path
            ),
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
            "largest_deviation_of_torque_ratio": off_path,
            "largest_contact_pressure_MPa": pressure,
            "warnings": warnings,
        }

    def _sparse_positions_warning(self, teeth: int) -> Iterator[str]:
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
        legend = meanings("eccentric", *CONTACT_TABLE_HEADER, table="contact")
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
