"""The result of `fegear wear`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fegear.commands.wear.archard import (
    WearingMesh,
    WornFlanks,
    position_error,
    step_error,
)
from fegear.commands.wear.figure import draw_wear
from fegear.contact.path import contact_diameters
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.output import write_text
from fegear.files.toml import toml_text
from fegear.gearset.read import relative_tables
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from lumped.common.array_types import Array
from lumped.common.units import UM

MAX_STEP_ERROR = 0.05  # of the largest depth

MAX_SHIFT = 0.05  # base pitches

GEARS: Columns = {
    "gear": lambda row: row["gear"],
    "revolutions": lambda row: f"{row['revolutions']:.6g}",
    "largest depth\nof wear [um]": cell("largest_depth_um"),
    "at roll angle\n[deg]": cell("at_roll_angle_deg", 5),
    "largest depth in a\nrevolution [1e-6 um]": cell("largest_per_turn_um", 4, 1e6),
    "worn volume\n[mm3]": cell("worn_volume_mm3"),
}

CHANGES: Columns = {
    "flanks": lambda row: row["flanks"],
    "mean k\n1e8 N/m": cell("mean_stiffness_N_per_m", 5, 1e-8),
    "k p-p/\nmean k": cell("peak_to_peak_over_mean"),
    "STE\nmean um": cell("ste_mean_um"),
    "STE\np-p um": cell("ste_peak_to_peak_um"),
    "load\nkN/m": cell("largest_line_load_N_per_m", 4, 1e-3),
    "tip corners,\n% of sliding": cell("corner_sliding_percent", 3),
}


@dataclass(frozen=True, eq=False)
class FlankWearResult(StudyResult):
    """Depth of wear of both flanks, and what it changes in their mesh.

    names : of driver and driven gear
    worn : at the beginning and at the end
    coarser : the same in about half as many steps
    tables : of the gear set with its wear, as in a file, or None
    """

    losses: ClassVar[Columns] = GEARS
    changes: ClassVar[Columns] = CHANGES
    error_text: ClassVar[str] = (
        "depth of wear, estimated error: by steps {steps:.1e} of the largest, by "
        "positions {positions:.1e} of the mean; worn volume against sliding work "
        "{volume_balance:.1e}; loads at most {shift_pitches:.1e} base pitches from "
        "those of flanks without wear"
    )

    study: Any
    gear_set: str
    names: tuple[str, ...]
    mesh: WearingMesh
    worn: WornFlanks
    coarser: WornFlanks
    gear_warnings: tuple[str, ...]
    tables: dict[str, Any] | None

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, worn = self.study, self.worn
        return {
            "gear_set": self.gear_set,
            "mesh": study.mesh,
            "teeth": [gear.teeth for gear in self._gear_geometries],
            "torque_Nm": self.mesh.torque,
            "cycles": study.cycles,
            "wear_coefficient_m2_per_N": study.wear_coefficient,
            "steps": worn.steps,
            "largest_step_um": worn.largest_step / UM,
            "gears": [self._gear_values(row) for row in range(2)],
            "contact": [
                {"flanks": "before", **worn.first.key_figures},
                {"flanks": "worn", **worn.last.key_figures},
            ],
            "errors": self._errors,
            "warnings": [*self.gear_warnings, *self._warnings()],
        }

    @property
    def _gear_geometries(self) -> tuple[Any, Any]:
        return self.mesh.pair.driver, self.mesh.pair.driven

    def _gear_values(self, row: int) -> dict[str, Any]:
        mesh, depth = self.mesh, self.worn.depth[row]
        deepest_point = int(depth.argmax()) // (depth.size // len(depth))
        area = float(mesh.worn_areas(self.worn.lost)[row])
        width, teeth = mesh.contact.face_width, self._gear_geometries[row].teeth
        per_turn = mesh.depth_per_passage(self.worn.first)[row]
        position = mesh.points.position
        return {
            "gear": self.names[row],
            "revolutions": self.study.cycles * float(mesh.passages[row, 0]),
            "largest_depth_um": float(depth.max()) / UM,
            "at_roll_angle_deg": float(
                np.degrees(mesh.roll_angles[row, deepest_point])
            ),
            "at_diameter_mm": 1e3
            * float(contact_diameters(mesh.pair, position)[row][deepest_point]),
            "largest_per_turn_um": float(per_turn.max()) / UM,
            "worn_volume_mm3": 1e9 * area * width * teeth,
        }

    @cached_property
    def _errors(self) -> dict[str, float]:
        """Estimated errors and balance of the depth, relative."""
        mesh, worn = self.mesh, self.worn
        volume = mesh.coefficient * worn.sliding_work
        areas = (mesh.worn_areas(worn.lost) / mesh.passages[:, 0]).tolist()
        position = mesh.points.position
        return {
            "steps": step_error(worn, self.coarser),
            "positions": position_error(position, [*worn.lost]),
            "volume_balance": max(abs(area / volume - 1.0) for area in areas),
            "shift_pitches": max(worn.first.shift, worn.last.shift),
        }

    def _warnings(self) -> Iterator[str]:
        error = self._errors["steps"]
        if not error <= MAX_STEP_ERROR:
            yield with_code(
                "W51",
                f"depth of wear, estimated error by its {self.worn.steps} steps "
                f"{100.0 * error:.2g} % of the largest; smaller --depth-step-um or "
                "more --steps are needed",
            )
        shift = self._errors["shift_pitches"]
        if not shift <= MAX_SHIFT:
            yield with_code(
                "W51",
                f"worn flanks carry the load up to {shift:.2g} base pitches from the "
                "points of flanks without wear, which is where the depth is taken off",
            )

    @property
    def table(self) -> Table:
        """A row for each point of the flanks of driver and driven gear."""
        header = {
            "gear set": self.gear_set,
            "mesh": f"{self.study.mesh} ({self.names[0]} drives {self.names[1]})",
            "torque on the driver [Nm]": f"{self.mesh.torque:.12g}",
            "revolutions of the driver": f"{self.study.cycles:.12g}",
            "wear coefficient [m2/N]": f"{self.study.wear_coefficient:.12g}",
            "steps": f"{self.worn.steps}",
            **self.study.gear_set.entries,
        }
        columns_of_both = [self._columns(row) for row in range(2)]
        columns = {
            name: np.concatenate([c[name] for c in columns_of_both])
            for name in columns_of_both[0]
        }
        return Table.of(columns, header)

    def _columns(self, row: int) -> dict[str, Array]:
        """Columns of a gear, by increasing roll angle."""
        mesh, first, last = self.mesh, self.worn.first, self.worn.last
        position = mesh.points.position
        columns: dict[str, Any] = {
            "gear": np.full(position.size, self.names[row]),
            "roll_angle_deg": np.degrees(mesh.roll_angles[row]),
            "diameter_m": contact_diameters(mesh.pair, position)[row],
            "position": position,
            "wear_depth_m": self.worn.depth[row],
            "wear_of_first_turn_m": mesh.depth_per_passage(first)[row],
            "wear_of_last_turn_m": mesh.depth_per_passage(last)[row],
            "specific_sliding": mesh.specific_sliding[row],
            "first_line_load_N_per_m": first.line_load,
            "last_line_load_N_per_m": last.line_load,
        }
        order = np.argsort(mesh.roll_angles[row])
        return {name: values[order] for name, values in columns.items()}

    @property
    def more_files(self) -> Mapping[str, Callable[[Path], None]]:
        return {"gears": self.write_gears}

    def write_gears(self, path: str | Path) -> None:
        """Write the gear-set file with the worn flanks.

        Parameters
        ----------
        path : str or path-like
            TOML file.

        Raises
        ------
        InputError
            If the gear set has no name or the file has no place for the wear.
        """
        if self.tables is None:
            raise InputError(
                f"{self.gear_set}: no file; needs a gear set by its name and flanks "
                "that carry load in the first mesh of both gears"
            )
        write_text(path, toml_text(relative_tables(self.tables, Path(path))))

    @property
    def figures(self) -> Mapping[str, Draw]:
        draw = partial(draw_wear, self.mesh, self.worn, self.names, self._title)
        return {"plot": draw}

    @property
    def _title(self) -> str:
        return (
            f"{self.gear_set}, mesh {self.study.mesh}, {self.mesh.torque:g} N m, "
            f"{self.study.cycles:g} revolutions of {self.names[0]}, "
            f"k = {self.study.wear_coefficient:g} m2/N"
        )

    def page(self) -> Page:
        values = self.summary
        yield (
            "{gear_set} mesh {mesh} at {torque_Nm:g} N m on the driver, {cycles:g} "
            "revolutions, k = {wear_coefficient_m2_per_N:g} m2/N: {steps} steps of at "
            "most {largest_step_um:.4g} um"
        ).format_map(values)
        yield RowTable(values["gears"], self.losses, "Wear", ("gear",))
        yield RowTable(values["contact"], self.changes, "Mesh", ("flanks",))
        yield with_code("E30", self.error_text.format_map(values["errors"]))
