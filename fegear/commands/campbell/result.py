"""The result of `fegear campbell`: its page, tables and figures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from fegear.commands.campbell.response import MachineResponse, draw_response
from fegear.files.codes import with_code
from fegear.studies.page import Columns, Page, RowTable, cell, number
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table, finite_or_none
from fegear.train.rolling_bearings import LinearisedBearing
from fegear.train.rotors import Motion
from lumped.figures.campbell import CampbellCurves, OrderLine, draw_campbell
from lumped.rotors.whirl import Instability, mode_kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class MeanStiffness:
    """Mean stiffness of a mesh and where it comes from."""

    mesh: int
    stiffness_N_per_m: float
    origin: str


@dataclass(frozen=True, kw_only=True)
class SpinningShaft:
    """A shaft by its gears, and its speed over that of the first mesh's driver."""

    gears: str
    speed_ratio: float


@dataclass(frozen=True, kw_only=True)
class CriticalEntry:
    """A speed at which an order meets a natural frequency."""

    excitation: str
    order: float
    driver_speed_rpm: float
    frequency_Hz: float
    kind: str
    shaft: str
    whirl: float
    damping_ratio: float
    mesh_energy_fraction: float


@dataclass(frozen=True, kw_only=True)
class UnstableSpeeds:
    """Speeds between which vibration grows."""

    kind: Instability
    from_rpm: float
    to_rpm: float
    frequency_Hz: float


MAX_SHOWN = 24  # critical speeds on the screen
BEARING_COLUMNS = (
    *("driver_speed_rpm", "shaft", "position_m"),
    *("force_x_rms_N", "force_y_rms_N", "force_z_rms_N"),
)
MESH_COLUMNS = (
    *("driver_speed_rpm", "mesh", "force_rms_N"),
    *("peak_force_N", "mean_force_N"),
)
HOUSING_COLUMNS = (
    *("driver_speed_rpm", "node", "shaft", "position_m", "acceleration_x_rms_m_per_s2"),
    *("acceleration_y_rms_m_per_s2", "acceleration_z_rms_m_per_s2"),
)
HOUSING_TITLE = "Largest acceleration of the housing's nodes over the speed, RMS"
BEARING_TITLE = (
    "Largest vibration of bearings over the speed, excited by the meshes, RMS, with "
    "the damping ratio of the gear set in all modes"
)
MESH_TITLE = "Largest vibration of the force between teeth over the speed, RMS"


@dataclass(frozen=True, eq=False)
class CampbellResult(StudyResult):
    """Campbell diagram of a gear set.

    torque : on the input gear [N m], None where nothing depends on it
    discretisation : largest relative change of a frequency with twice the elements
    motion : of shafts, along their axes too in space
    is_helical : whether there are helical gears
    response : vibration excited by the meshes, None where their teeth are not solved
    rolling_bearings : linearised at the torque
    has_solved_loads : whether these have the loads of solved teeth, else those of
        torque, pressure and helix angles in the middle of the face width
    housing : its file and what it holds, None where bearings are on ground
    """

    study: Any
    gear_set: str
    torque: float | None
    mean_stiffness: tuple[MeanStiffness, ...]
    shafts: tuple[SpinningShaft, ...]
    curves: CampbellCurves
    orders: tuple[OrderLine, ...]
    critical: tuple[CriticalEntry, ...]
    unstable: tuple[UnstableSpeeds, ...]
    discretisation: float
    motion: Motion
    is_helical: bool
    gear_warnings: tuple[str, ...] = ()
    response: MachineResponse | None = None
    rolling_bearings: tuple[LinearisedBearing, ...] = ()
    has_solved_loads: bool = False
    housing: str | None = None

    @cached_property
    def summary(self) -> dict[str, Any]:
        curves = self.curves
        return {
            "gear_set": self.gear_set,
            "torque_Nm": self.torque,
            "max_rpm": float(curves.rpm[-1]),
            "speeds": int(curves.rpm.size),
            "motion": self.motion,
            "shafts": list(map(asdict, self.shafts)),
            "mean_stiffness": list(map(asdict, self.mean_stiffness)),
            "housing": self.housing,
            "rolling_bearings": list(map(asdict, self.rolling_bearings)),
            "modes": [
                {
                    "at_rest_Hz": finite_or_none(float(curves.frequency_Hz[0, mode])),
                    "at_max_rpm_Hz": finite_or_none(
                        float(curves.frequency_Hz[-1, mode])
                    ),
                    "kind": curves.kind(mode),
                    "axial_fraction": float(curves.axial[0, mode]),
                    "housing_fraction": float(curves.housing[0, mode]),
                    "mesh_energy_fraction": float(curves.mesh_energy[0, mode]),
                }
                for mode in range(curves.count)
            ],
            "critical_speeds": list(map(asdict, self.critical)),
            "instabilities": list(map(asdict, self.unstable)),
            "discretisation_error": finite_or_none(self.discretisation),
            "vibration": self.response and self.response.largest(),
            "warnings": [
                *self.gear_warnings,
                *self._instability_warnings(),
                *self._contact_warnings(),
            ],
        }

    def _instability_warnings(self) -> Iterator[str]:
        for part in self.unstable:
            yield with_code(
                "W43",
                f"vibration grows from {number(part.from_rpm)} to "
                f"{number(part.to_rpm)} rpm, {part.kind}"
                + (
                    f" at {number(part.frequency_Hz)} Hz"
                    if part.kind == "flutter"
                    else ""
                )
                + f", without damping_ratio{self._damped_text()}",
            )
        if self.response is not None and self.response.grows.any():
            rpm = self.response.rpm[self.response.grows]
            yield with_code(
                "W43",
                f"vibration grows at {rpm.size} of {self.response.rpm.size} speeds, "
                f"from {number(float(rpm[0]))} to {number(float(rpm[-1]))} rpm, with "
                f"damping_ratio = {self.response.damping_ratio:g} too; the forces in "
                "vibration there are of no motion that lasts",
            )

    def _damped_text(self) -> str:
        """What is true of the forces in vibration where none of them grows."""
        if self.response is None or self.response.grows.any():
            return ""
        ratio = self.response.damping_ratio
        return (
            f"; with damping_ratio = {ratio:g}, which the forces in vibration have, it "
            "does not"
        )

    def _contact_warnings(self) -> Iterator[str]:
        if self.response is None:
            return
        for mesh, lost in enumerate(self.response.may_lose_contact.T, start=1):
            if lost.any():
                rpm = self.response.rpm[lost]
                yield with_code(
                    "W68",
                    f"mesh {mesh}: the force between teeth may vanish at "
                    f"{int(lost.sum())} of {lost.size} speeds, from "
                    f"{number(float(rpm[0]), 4)} to {number(float(rpm[-1]), 4)} rpm; "
                    "vibration is that of teeth in contact",
                )

    @property
    def _header(self) -> dict[str, str]:
        meshes = {f"mesh {one.mesh}": one.origin for one in self.mean_stiffness}
        shafts = {
            f"shaft {number}": f"{shaft.gears}, {shaft.speed_ratio:.12g} of the speed"
            for number, shaft in enumerate(self.shafts, start=1)
        }
        entries = self.study.gear_set.entries
        names = {"gear set": self.gear_set, "motion": self.motion}
        if self.housing:
            names["housing"] = self.housing
        if self.rolling_bearings:
            names["rolling bearings"] = self._linearised_at
        return {**names, **meshes, **shafts, **entries}

    @property
    def _linearised_at(self) -> str:
        """Loads at which rolling bearings are linearised, in words."""
        loads = (
            "loads of teeth in contact"
            if self.has_solved_loads
            else "forces of teeth in the middle of the face width"
        )
        at = f"{number(self.torque or 0.0)} N m on the input gear"
        return f"linearised at {at}, {loads}"

    @property
    def table(self) -> Table:
        """A row for every speed and mode."""
        names = (
            *("driver_speed_rpm", "mode", "frequency_Hz", "damping_ratio", "kind"),
            *("whirl", "torsion_fraction", "axial_fraction", "mesh_energy_fraction"),
            "housing_fraction",
        )
        return Table(names, self._rows, self._header)

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        curves = self.curves
        for row, rpm in enumerate(curves.rpm.tolist()):
            for mode in range(curves.count):
                at = row, mode
                if not math.isfinite(curves.frequency_Hz[at]):
                    continue
                parts = curves.whirl, curves.torsion, curves.axial, curves.housing
                whirl, torsion, axial, housing = (float(part[at]) for part in parts)
                yield (
                    rpm,
                    mode + 1,
                    float(curves.frequency_Hz[at]),
                    float(curves.damping_ratio[at]),
                    mode_kind(whirl, torsion, axial, housing),
                    whirl,
                    torsion,
                    axial,
                    float(curves.mesh_energy[at]),
                    housing,
                )

    @property
    def more_tables(self) -> dict[str, Table]:
        """A row for every critical speed, and of vibration for every speed and part."""
        names = tuple(CriticalEntry.__annotations__)
        rows = [tuple(asdict(entry).values()) for entry in self.critical]
        tables = {"critical": Table(names, lambda: rows, self._header)}
        if self.response is not None:
            of_bearings, of_meshes = self.response.bearing_rows, self.response.mesh_rows
            tables["bearing_forces"] = Table(BEARING_COLUMNS, of_bearings, self._header)
            tables["mesh_forces"] = Table(MESH_COLUMNS, of_meshes, self._header)
            if self.housing:
                rows_of = self.response.housing_rows
                tables["housing"] = Table(HOUSING_COLUMNS, rows_of, self._header)
        return tables

    @property
    def figures(self) -> dict[str, Draw]:
        drawn: dict[str, Draw] = {"plot": self._draw_diagram}
        if self.response is not None:
            title = f"{self.gear_set}: vibration excited by the meshes"
            drawn["response"] = partial(draw_response, self.response, title)
        return drawn

    def _draw_diagram(self) -> Figure:
        points = [(one.driver_speed_rpm, one.frequency_Hz) for one in self.critical]
        spans = [(part.from_rpm, part.to_rpm) for part in self.unstable]
        title = f"{self.gear_set}: Campbell diagram"
        return draw_campbell(self.curves, self.orders, points, spans, title)

    def page(self) -> Page:
        values = self.summary
        for shaft in self.shafts:
            yield (
                f"shaft of {shaft.gears}: {number(shaft.speed_ratio, 5)} times the "
                "speed of the first driver"
            )
        for entry in self.mean_stiffness:
            yield (
                f"mesh {entry.mesh}: mean stiffness {entry.stiffness_N_per_m:.5g} N/m, "
                f"{entry.origin}"
            )
        if self.housing:
            yield f"housing: {self.housing}; bearings without a node are on ground"
        if self.rolling_bearings:
            title = f"rolling bearings, {self._linearised_at}"
            yield RowTable(values["rolling_bearings"], ROLLING_COLUMNS, title)
        if self.motion == "plane" and self.is_helical:
            yield (
                "the helix of gears and motion along the axes are left out; motion = "
                "space has both where bearings have bearing_kz_N_per_m"
            )
        yield with_code(
            "E25",
            "frequencies change by at most "
            f"{number(100.0 * self.discretisation, 2)} % with twice the elements",
        )
        columns = MODE_COLUMNS if self.motion == "plane" else MODE_COLUMNS_IN_SPACE
        if self.housing:
            columns = {**columns, **HOUSING_COLUMN}
        yield RowTable(values["modes"], columns, f"{self.gear_set}, modes")
        title = f"critical speeds to {number(values['max_rpm'], 4)} rpm"
        if len(self.critical) > MAX_SHOWN:
            title += f", the first {MAX_SHOWN} of {len(self.critical)}"
        if self.critical:
            shown = values["critical_speeds"][:MAX_SHOWN]
            yield RowTable(shown, CRITICAL_COLUMNS, title)
        else:
            yield f"no {title}"
        if not self.unstable and (
            self.response is None or not self.response.grows.any()
        ):
            yield "no vibration grows at any of the speeds"
        if values["vibration"]:
            largest = values["vibration"]
            yield RowTable(largest["bearings"], BEARING_ROWS, BEARING_TITLE)
            yield RowTable(largest["meshes"], MESH_ROWS, MESH_TITLE)
            if largest["housing"]:
                yield RowTable(largest["housing"], HOUSING_ROWS, HOUSING_TITLE)


def _end_text(row: Any) -> str:
    value = row["at_max_rpm_Hz"]
    return "" if value is None else number(value, 5)


MODE_COLUMNS: Columns = {
    "at rest\n[Hz]": cell("at_rest_Hz", 5),
    "at highest\nspeed [Hz]": _end_text,
    "kind": lambda row: row["kind"],
    "energy in\nmeshes [%]": cell("mesh_energy_fraction", 3, 100.0),
}

MODE_COLUMNS_IN_SPACE: Columns = {
    **MODE_COLUMNS,
    "energy along\naxes [%]": cell("axial_fraction", 3, 100.0),
}

HOUSING_COLUMN: Columns = {"energy in\nhousing [%]": cell("housing_fraction", 3, 100.0)}

ROLLING_COLUMNS: Columns = {
    "shaft": lambda row: row["shaft"],
    "at\n[mm]": cell("position_mm", 4),
    "along x\n[N/m]": cell("radial_x_N_per_m", 4),
    "along y\n[N/m]": cell("radial_y_N_per_m", 4),
    "along axis\n[N/m]": cell("axial_N_per_m", 4),
    "about x\n[N m/rad]": cell("tilt_x_Nm_per_rad", 4),
    "about y\n[N m/rad]": cell("tilt_y_Nm_per_rad", 4),
}

CRITICAL_COLUMNS: Columns = {
    "excitation": lambda row: row["excitation"],
    "speed of first\ndriver [rpm]": cell("driver_speed_rpm", 5),
    "frequency\n[Hz]": cell("frequency_Hz", 5),
    "kind": lambda row: row["kind"],
    "shaft": lambda row: row["shaft"],
    "damping\nratio": cell("damping_ratio", 3),
    "energy in\nmeshes [%]": cell("mesh_energy_fraction", 3, 100.0),
}

BEARING_ROWS: Columns = {
    "shaft": lambda row: row["shaft"],
    "at\n[mm]": cell("position_mm", 4),
    "radial\n[N]": cell("radial_force_rms_N", 4),
    "at speed\n[rpm]": cell("radial_force_at_rpm", 5),
    "axial\n[N]": cell("axial_force_rms_N", 4),
    "axial, at\nspeed [rpm]": cell("axial_force_at_rpm", 5),
}

HOUSING_ROWS: Columns = {
    "node": lambda row: str(row["node"]),
    "shaft": lambda row: row["shaft"],
    "acceleration\n[m/s2]": cell("acceleration_rms_m_per_s2", 4),
    "at speed\n[rpm]": cell("acceleration_at_rpm", 5),
}

MESH_ROWS: Columns = {
    "mesh": lambda row: str(row["mesh"]),
    "mean force\n[N]": cell("mean_force_N", 5),
    "vibration\n[N]": cell("force_rms_N", 4),
    "at speed\n[rpm]": cell("force_at_rpm", 5),
}
