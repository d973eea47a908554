"""The result of `fegear shafts`: its page, table and figure."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.commands.shafts.figure import draw_shafts
from fegear.commands.shafts.loads import MeshOnShafts, ShaftUnderLoad, TorsionOfGear
from fegear.files.codes import with_code
from fegear.files.version import package_version
from fegear.studies.page import Columns, Page, RowTable, cell, number, pluralize
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from lumped.common.array_types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SLOPE_TOLERANCE = 5e-10  # of a lead, below which none is made [m]
# largest values of shafts, beyond which they are of no shaft that is built
LIMITS = (
    ("tilt_mrad", 10.0, "tilts by {} mrad; tilts are small below 10 mrad"),
    ("bending_stress_MPa", 2000.0, "bending stress {} MPa; steel bears below 2000 MPa"),
)
SIDES = "before", "after"
NODE_COLUMNS = (
    *("deflection_x_m", "deflection_y_m", "deflection_z_m", "tilt_x_rad", "tilt_y_rad"),
    *("moment_x_Nm", "moment_y_Nm", "bending_stress_Pa", "shear_x_N", "shear_y_N"),
    *("axial_force_N", "torque_Nm"),
)
BEARING_COLUMNS: Columns = {
    "shaft": lambda row: row["shaft"],
    "position\nmm": lambda row: f"{row['position_mm']:g}",
    "force x\nN": cell("force_x_N", 5),
    "force y\nN": cell("force_y_N", 5),
    "force z\nN": cell("force_z_N", 5),
    "radial\nN": cell("radial_force_N", 5),
}
MOMENT_COLUMNS: Columns = {
    "moment x\nN m": cell("moment_x_Nm"),
    "moment y\nN m": cell("moment_y_Nm"),
}
PRESSURE_COLUMN: Columns = {"pressure\nMPa": cell("contact_pressure_MPa", 4)}
BEARING_TITLE = (
    "Forces of bearings on shafts, x to the right and y up seen from the near end, z "
    "toward the far end"
)
SHAFT_COLUMNS: Columns = {
    "shaft": lambda row: row["shaft"],
    "deflection\num": cell("deflection_um"),
    "at\nmm": cell("deflection_at_mm"),
    "tilt\nmrad": cell("tilt_mrad"),
    "bending\nN m": cell("bending_moment_Nm"),
    "bending\nat mm": cell("bending_moment_at_mm"),
    "stress\nMPa": cell("bending_stress_MPa"),
    "stress\nat mm": cell("bending_stress_at_mm"),
}
SHAFT_TITLE = (
    "Largest deflection, tilt, bending moment and bending stress of shafts, without "
    "notches; places from the first end, the near one"
)
MESH_COLUMNS: Columns = {
    "mesh": lambda row: f"{row['number']}",
    "torque on\ndriver N m": lambda row: f"{row['driver_torque_Nm']:g}",
    "K_Hbeta\non shafts": cell("load_distribution_factor", 4),
    "axes\nheld": cell("load_distribution_factor_held", 4),
    "load centre\nmm": cell("load_center_mm", 3),
    "misalign-\nment um": cell("misalignment_um"),
}
MESH_TITLE = (
    "Meshes on shafts that yield, and with axes held; load centre from the middle of "
    "the common width; misalignment: gap at its far end less that at the near end, as "
    "the key misalignment_um"
)
SOURCES = "shaft", "bearings", "torsion"
PARTS = tuple(f"{role}_{source}" for role in ("driver", "driven") for source in SOURCES)
PART_TITLE = (
    "Parts of the misalignment [um], by the shafts that bend, by bearings and by "
    "torsion of the gears"
)


@dataclass(frozen=True, eq=False)
class LoadedShaftsResult(StudyResult):
    """Shafts, bearings and meshes at a torque on the input gear [N m].

    exchanges : how often loads of meshes were exchanged
    torsion : of all gears in mesh on shafts that yield
    """

    study: Any
    gear_set: str
    torque: float
    shafts: tuple[ShaftUnderLoad, ...]
    meshes: tuple[MeshOnShafts, ...]
    exchanges: int
    gear_warnings: tuple[str, ...] = ()
    torsion: tuple[TorsionOfGear, ...] = ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            "gear_set": self.gear_set,
            "torque_Nm": self.torque,
            "resolution": self.study.elements.resolution,
            "bearings": [row for one in self.shafts for row in _bearing_rows(one)],
            "shafts": [_largest_values(shaft) for shaft in self.shafts],
            "meshes": [_mesh_row(mesh) for mesh in self.meshes],
            "torsion": [vars(one) for one in self.torsion],
            "exchanges": self.exchanges,
            "warnings": [*self.gear_warnings, *self._shaft_warnings()],
        }

    @property
    def table(self) -> Table:
        """A row for every node and side of every shaft."""
        rows = [row for shaft in self.shafts for row in _node_rows(shaft)]
        header = {
            "gear set": self.gear_set,
            "fegear version": package_version(),
            "torque on the input gear": f"{self.torque:.12g} N m",
            "torsion of gears": _torsion_line(self.torsion),
            **self.study.gear_set.entries,
        }
        return Table.of_rows(rows, header)

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._draw}

    def _draw(self) -> Figure:
        title = f"{self.gear_set}: shafts at {self.torque:.12g} N m on the input gear"
        return draw_shafts(self.shafts, self.meshes, title)

    def page(self) -> Page:
        values = self.summary
        yield f"{self.gear_set}, {self.torque:.12g} N m on the input gear"
        yield f"torsion of gears over the face width: {_torsion_line(self.torsion)}"
        resist = any(any(shaft.tilt_stiffness) for shaft in self.shafts)
        columns = BEARING_COLUMNS | (MOMENT_COLUMNS if resist else {})
        if any(shaft.pressures for shaft in self.shafts):
            columns |= PRESSURE_COLUMN
        yield RowTable(values["bearings"], columns, BEARING_TITLE)
        yield RowTable(values["shafts"], SHAFT_COLUMNS, SHAFT_TITLE)
        yield RowTable(values["meshes"], MESH_COLUMNS, MESH_TITLE)
        yield RowTable(values["meshes"], self._part_columns(), PART_TITLE)
        yield from map(self._lead_line, self.meshes)
        yield self._balance_line()

    def _part_columns(self) -> Columns:
        twist = any(one.end for one in self.torsion)
        parts = [part for part in PARTS if twist or not part.endswith("torsion")]
        columns: Columns = {"mesh": lambda row: row["mesh"]}
        return columns | {part.replace("_", "\n"): cell(f"{part}_um") for part in parts}

    def _shaft_warnings(self) -> Iterator[str]:
        for values in map(_largest_values, self.shafts):
            for name, most, text in LIMITS:
                if not values[name] <= most:
                    at = text.format(number(values[name]))
                    yield with_code("W69", f"shaft of {values['shaft']}: {at}")

    def _lead_line(self, mesh: MeshOnShafts) -> str:
        if (
            mesh.factor <= mesh.held_factor
            or max(map(abs, mesh.away)) < SLOPE_TOLERANCE
        ):
            return (
                f"mesh {mesh.number}: the load is as even as with axes held, and needs "
                "no lead slope"
            )
        driver, driven = (f"{1e6 * slope:.3g}" for slope in mesh.away)
        return (
            f"mesh {mesh.number}: under the load of aligned axes shafts and bearings "
            f"misalign it by {1e6 * mesh.to_mend:.3g} um; slope_um = {driver} of "
            f"driver_lead or {driven} of driven_lead, in place of leads that there "
            f"are, takes it away; the best lead: {self._relief_command(mesh)}"
        )

    def _relief_command(self, mesh: MeshOnShafts) -> str:
        """Command that seeks a lead for a mesh on its shafts."""
        source = self.study.gear_set
        edits = (part for edit in source.edits for part in ("--set", edit))
        options = {
            "--mesh": f"{mesh.number}",
            "--torque": f"{mesh.torque:.6g}",
            "--lead": "crowning,slope",
            "--objective": "distribution",
        }
        if self.study.elements.plane is not None:
            options["--plane"] = self.study.elements.plane
        pairs = (part for option in options.items() for part in option)
        command = "fegear", "relief", source.name, *edits, "--no-tip", *pairs
        return shlex.join(command)

    def _balance_line(self) -> str:
        of_shafts = ", ".join(f"{one.gears} {one.imbalance:.1e}" for one in self.shafts)
        exchanged = pluralize(self.exchanges, "solution")
        return with_code(
            "E31",
            "balance, sum of the forces on a shaft over the largest of them: "
            f"{of_shafts}; loads of meshes agree after {exchanged} of all of them",
        )


def _torsion_line(torsion: Sequence[TorsionOfGear]) -> str:
    """Which gears twist and from where, and which do not and why."""
    names: dict[str, list[str]] = {}
    for one in torsion:
        toward = f"torque at the {one.end}" if one.end else f"left out, {one.reason}"
        names.setdefault(toward, []).append(one.gear)
    return "; ".join(f"{', '.join(gears)} ({of})" for of, gears in names.items())


def _bearing_rows(shaft: ShaftUnderLoad) -> Iterator[dict[str, Any]]:
    pressures = shaft.pressures or (None,) * len(shaft.bearing_positions)
    for position, reaction, pressure in zip(
        shaft.bearing_positions,
        shaft.solution.reactions.tolist(),
        pressures,
        strict=True,
    ):
        x, y, z, moment_x, moment_y = reaction
        yield {
            "shaft": shaft.gears,
            "position_mm": 1e3 * position,
            "force_x_N": x,
            "force_y_N": y,
            "force_z_N": z,
            "radial_force_N": float(np.hypot(x, y)),
            "moment_x_Nm": moment_x,
            "moment_y_Nm": moment_y,
            "contact_pressure_MPa": None if pressure is None else 1e-6 * pressure,
        }


def _largest_values(shaft: ShaftUnderLoad) -> dict[str, Any]:
    solution = shaft.solution
    deflection, deflected_at = _largest(
        solution, np.hypot(*solution.deflection[:, :2].T)
    )
    moment, moment_at = _largest(
        solution, np.hypot(*np.moveaxis(solution.moment, -1, 0)).max(axis=1)
    )
    stress, stress_at = _largest(solution, shaft.bending_stress.max(axis=1))
    return {
        "number": shaft.number,
        "shaft": shaft.gears,
        "deflection_um": 1e6 * deflection,
        "deflection_at_mm": deflected_at,
        "tilt_mrad": 1e3 * float(np.hypot(*solution.tilt.T).max()),
        "bending_moment_Nm": moment,
        "bending_moment_at_mm": moment_at,
        "bending_stress_MPa": 1e-6 * stress,
        "bending_stress_at_mm": stress_at,
        "force_imbalance": shaft.imbalance,
    }


def _largest(solution: Any, values: Array) -> tuple[float, float]:
    """Largest value of the nodes, and its place [mm]."""
    at = int(np.argmax(values))
    return float(values[at]), 1e3 * float(solution.position[at])


def _mesh_row(mesh: MeshOnShafts) -> dict[str, Any]:
    parts = zip(mesh.by_shafts, mesh.by_bearings, mesh.by_torsion, strict=True)
    in_order = [1e6 * part for gear in parts for part in gear]
    driver, driven = mesh.away
    return {
        "number": mesh.number,
        "mesh": mesh.name,
        "driver_torque_Nm": mesh.torque,
        "load_distribution_factor": mesh.factor,
        "load_distribution_factor_held": mesh.held_factor,
        "load_center_mm": 1e3 * mesh.center,
        "misalignment_um": 1e6 * mesh.misalignment,
        **{f"{part}_um": value for part, value in zip(PARTS, in_order, strict=True)},
        "misalignment_of_aligned_load_um": 1e6 * mesh.to_mend,
        "driver_lead_slope_um": 1e6 * driver,
        "driven_lead_slope_um": 1e6 * driven,
    }


def _node_rows(shaft: ShaftUnderLoad) -> Iterator[dict[str, Any]]:
    solution = shaft.solution
    for node, position in enumerate(solution.position.tolist()):
        for s, side in enumerate(SIDES):
            values = np.concatenate(
                [
                    solution.deflection[node],
                    solution.tilt[node],
                    solution.moment[node, s],
                    shaft.bending_stress[node, s, None],
                    solution.shear[node, s],
                    solution.axial_force[node, s, None],
                    solution.torque[node, s, None],
                ]
            )
            row = {"shaft": shaft.gears, "position_m": position, "side": side}
            yield row | dict(zip(NODE_COLUMNS, (values + 0.0).tolist(), strict=True))
