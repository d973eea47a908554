"""Wear of both flanks of a mesh over many revolutions, by Archard's law."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from fegear.commands.wear.archard import (
    DEPTH_STEP_SHARE,
    MIN_STEPS,
    LoadedFlanks,
    StepPlan,
    WearingMesh,
    WornFlanks,
    path_points,
    position_error,
    step_error,
    wear_off,
)
from fegear.commands.wear.figure import draw_wear
from fegear.contact.path import contact_diameters
from fegear.contact.profiles import profile_depth
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.output import write_text
from fegear.files.toml import toml_text
from fegear.gearset.faults.checks import require_no_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import mesh_errors
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.read import load_tables, relative_tables
from fegear.gearset.zones import zones
from fegear.statics.mesh_faults import is_first_flank, without_wear
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import contact_problem
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import SettingsGroup, expose, group, setting
from fegear.studies.study import PLOT, Study
from fegear.studies.table import Table
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_index,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torque
from fegear.studies.trains.train_problem import refuse_edits
from lumped.common.array_types import Array
from lumped.common.options import Range

MICRO = 1e-6
ROUNDED = 9  # decimals of angles [deg] and depths [um] in a file
MIN_POSITIONS = 8
MAX_STEP_ERROR = 0.05  # of the largest depth
MAX_SHIFT = 0.05  # base pitches
ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose("positions", "friction", "plane", "resolution", "corner_contact"),
)
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


@dataclass(frozen=True, kw_only=True)
class FlankWear(
    Study,
    command="wear",
    example="wear liu-pair --cycles 1e8 -o w.csv --plot w.png --gears worn.toml",
):
    """Wear of both flanks of a mesh by Archard's law.

    Depth over the flanks after many revolutions: the wear coefficient times pressure
    times length of sliding, as each tooth of either gear passes. Worn flanks share the
    load differently, so that the depth grows in steps, each with the contact of the
    flanks that the step before has left.
    """

    pictures = PLOT
    more_files = {  # noqa: RUF012
        "gears": (
            "Write the gear set with its worn flanks, as worn_teeth of both gears, to "
            "this TOML file.",
            (".toml",),
        )
    }

    gear_set: GearSetRef = DEFAULT_PAIR
    mesh: int = mesh_setting()
    torque: float | None = setting(
        None,
        "Torque on the driving gear of the mesh [N\u00a0m]. [default: middle load case "
        "of the gear set]",
    )
    cycles: float = setting(
        1e6,
        "Number of revolutions of the mesh's driving gear [turns].",
        Range(above=0.0, below=1e15),
    )
    wear_coefficient: float = setting(
        1e-18,
        "Coefficient k of Archard's law: depth of wear over pressure and length of "
        "sliding [m2/N].",
        Range(above=0.0, below=1e-6),
    )
    depth_step_um: float | None = setting(
        None,
        "Largest depth of wear in a step [um]. [default: 5 % of the mean deflection of "
        "the teeth]",
        Range(above=0.0, below=1e4),
        option="--depth-step-um",
    )
    steps: int | None = setting(
        None,
        "Number of equal steps, instead of steps of bounded depth. [default: steps of "
        "bounded depth]",
        Range(MIN_STEPS, 10_000),
    )
    elements: StaticsSettings = group(ELEMENTS)

    def __post_init__(self) -> None:
        super().__post_init__()
        positions = self.elements.positions
        if positions < MIN_POSITIONS:
            raise InputError(
                f"positions = {positions}; allowed {MIN_POSITIONS} or more, between "
                "which depths are interpolated"
            )

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        if self.steps is not None and self.depth_step_um is not None:
            yield "depth_step_um", "{steps} takes its place"
        if "gears" in outputs:
            index = mesh_index(self.gears, self.mesh)
            for gear in self.gears.meshes[index].gears:
                if not is_first_flank(self.gears, index, gear):
                    yield "gears", self._other_flank(gear)

    def _other_flank(self, gear: int) -> str:
        name = self.gears.gears[gear].name.replace("{", "{{").replace("}", "}}")
        return (
            f'worn_teeth of gear "{name}" are the flanks that its first mesh loads, '
            f"mesh {self.mesh} wears the others"
        )

    @property
    def gears(self) -> GearSet:
        """The gear set; InputError with what this study leaves out."""
        refuse_edits(self, {"torque": self.torque}, translations=False)
        gears = self.gear_set.loaded
        if gears.carrier is not None:
            raise InputError(
                f"{gears.name}: planetary sets; wear is that of gears on fixed axes"
            )
        require_no_faults(gears, set(FAULT_KINDS) - {"worn"}, "wear")
        return gears

    def prepare(self) -> WearProblem:
        gears = self.gears
        index = mesh_index(gears, self.mesh)
        torque = chosen_torque(gears, self.torque, self.mesh)
        _require_equal_teeth(gears, index)
        pair = gears.meshes[index].pair
        points = path_points(pair, self.elements.positions)
        return WearProblem(self, gears, index, torque, points)


def _require_equal_teeth(gears: GearSet, index: int) -> None:
    """Require a mesh whose teeth are all alike."""
    for gear in (gears.gears[number] for number in gears.meshes[index].gears):
        for tooth in gear.faults.teeth:
            raise InputError(
                f'gear "{gear.name}": worn_teeth of tooth {tooth + 1}; wear is that of '
                "teeth which are all alike"
            )
    for number, errors in zip(
        gears.meshes[index].gears, mesh_errors(gears, index), strict=True
    ):
        if any(errors):
            raise InputError(
                f'gear "{gears.gears[number].name}": pitch_errors_um; wear is that of '
                "teeth which are all alike"
            )


@dataclass(frozen=True, eq=False)
class WearProblem(Problem):
    """A mesh at a torque on its driver [N m]; index : of the mesh, from 0."""

    study: FlankWear
    gears: GearSet
    index: int
    torque: float
    points: Any

    def tasks(self) -> Iterator[Task]:
        yield Task("wear", self._worn)

    def _worn(self, job: Job) -> FlankWearResult:
        study, gears = self.study, self.gears
        bare = without_wear(gears, self.index)
        contact = contact_problem(bare, self.index, study.elements, job.report)
        mesh = WearingMesh(contact, self.torque, study.wear_coefficient, self.points)
        before = self._depth_before(mesh)
        first = mesh.load(before)
        depth_step = MICRO * (study.depth_step_um or 0.0)
        plan = StepPlan(depth_step or DEPTH_STEP_SHARE * first.deflection, study.steps)
        worn = wear_off(mesh, before, study.cycles, plan, job.report)
        coarser = wear_off(mesh, before, study.cycles, plan.halved, job.report)
        return FlankWearResult(
            study=study,
            gear_set=gears.name,
            names=tuple(gears.gears[n].name for n in gears.meshes[self.index].gears),
            mesh=mesh,
            worn=worn,
            coarser=coarser,
            gear_warnings=tuple(gear_set_warnings(gears)),
            tables=self._tables(mesh, worn.depth),
        )

    def _depth_before(self, mesh: WearingMesh) -> Array:
        """Depths (2, p) of wear that the gear set has [m]."""
        depth = np.zeros_like(mesh.roll_angles)
        spec = self.gears.meshes[self.index]
        roles = zip(spec.gears, ("driver", "driven"), strict=True)
        for row, (gear, role) in enumerate(roles):
            wear = self.gears.gears[gear].faults.wear_of(0)
            if wear is not None and is_first_flank(self.gears, self.index, gear):
                flank = zones(spec.pair, role)
                rolls = mesh.roll_lengths[row]
                depth[row] = profile_depth(wear, rolls, flank.start, flank.tip)
        return depth

    def _tables(self, mesh: WearingMesh, depth: Array) -> dict[str, Any] | None:
        """Tables of the gear set with its wear; None where it has no file for it."""
        gears, ref = self.gears, self.study.gear_set
        both = gears.meshes[self.index].gears
        if ref.preloaded is not None or not all(
            is_first_flank(gears, self.index, gear) for gear in both
        ):
            return None
        edits = {
            f"gear.{gear + 1}.worn_teeth": [_worn_teeth(angles, depths)]
            for gear, angles, depths in zip(both, mesh.roll_angles, depth, strict=True)
        }
        try:
            ref.changed(edits)
        except InputError as error:
            cycles = self.study.cycles
            text = f"cycles = {cycles:.12g}; flanks are worn too far, {error}"
            raise InputError(text) from None
        return load_tables(ref.name, ref.overrides | edits)


def _worn_teeth(roll_angles: Array, depth: Array) -> dict[str, Any]:
    """Keys of the wear of all teeth of a gear."""
    order = np.argsort(roll_angles)
    angles, depths = np.degrees(roll_angles[order]), depth[order] / MICRO
    return {
        "roll_angle_deg": angles.round(ROUNDED).tolist(),
        "depth_um": depths.round(ROUNDED).tolist(),
    }


@dataclass(frozen=True, eq=False, repr=False)
class FlankWearResult(StudyResult):
    """Depth of wear of both flanks, and what it changes in their mesh.

    names : of driver and driven gear
    worn : at the beginning and at the end
    coarser : the same in about half as many steps
    tables : of the gear set with its wear, as in a file, or None
    """

    study: FlankWear
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
            "teeth": [gear.teeth for gear in self._geometries],
            "torque_Nm": self.mesh.torque,
            "cycles": study.cycles,
            "wear_coefficient_m2_per_N": study.wear_coefficient,
            "steps": worn.steps,
            "largest_step_um": worn.largest_step / MICRO,
            "gears": [self._gear(row) for row in range(2)],
            "contact": [
                {"flanks": "before", **_contact(worn.first)},
                {"flanks": "worn", **_contact(worn.last)},
            ],
            "errors": self._errors,
            "warnings": [*self.gear_warnings, *self._warnings()],
        }

    @property
    def _geometries(self) -> tuple[Any, Any]:
        return self.mesh.pair.driver, self.mesh.pair.driven

    def _gear(self, row: int) -> dict[str, Any]:
        mesh, depth = self.mesh, self.worn.depth[row]
        deepest = int(depth.argmax())
        area = float(mesh.worn_areas(self.worn.lost)[row])
        width, teeth = mesh.contact.face_width, self._geometries[row].teeth
        per_turn = mesh.depth_per_passage(self.worn.first)[row]
        position = mesh.points.position
        return {
            "gear": self.names[row],
            "revolutions": self.study.cycles * float(mesh.passages[row, 0]),
            "largest_depth_um": float(depth[deepest]) / MICRO,
            "at_roll_angle_deg": float(np.degrees(mesh.roll_angles[row, deepest])),
            "at_diameter_mm": 1e3
            * float(contact_diameters(mesh.pair, position)[row][deepest]),
            "largest_per_turn_um": float(per_turn.max()) / MICRO,
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
        both = [self._columns(row) for row in range(2)]
        columns = {name: np.concatenate([c[name] for c in both]) for name in both[0]}
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
        title = (
            f"{self.gear_set}, mesh {self.study.mesh}, {self.mesh.torque:g} N m, "
            f"{self.study.cycles:g} revolutions of {self.names[0]}, "
            f"k = {self.study.wear_coefficient:g} m2/N"
        )
        return {"plot": partial(draw_wear, self.mesh, self.worn, self.names, title)}

    def page(self) -> Page:
        values = self.summary
        yield (
            "{gear_set} mesh {mesh} at {torque_Nm:g} N m on the driver, {cycles:g} "
            "revolutions, k = {wear_coefficient_m2_per_N:g} m2/N: {steps} steps of at "
            "most {largest_step_um:.4g} um"
        ).format_map(values)
        yield RowTable(values["gears"], GEARS, "Wear", ("gear",))
        yield RowTable(values["contact"], CHANGES, "Mesh", ("flanks",))
        text = (
            "depth of wear, estimated error: by steps {steps:.1e} of the largest, by "
            "positions {positions:.1e} of the mean; worn volume against sliding work "
            "{volume_balance:.1e}; loads at most {shift_pitches:.1e} base pitches from "
            "those of flanks without wear"
        )
        yield with_code("E30", text.format_map(values["errors"]))


def _contact(loaded: LoadedFlanks) -> dict[str, float]:
    stiffness, ste = loaded.stiffness, loaded.ste
    mean = float(stiffness.mean())
    return {
        "mean_stiffness_N_per_m": mean,
        "peak_to_peak_over_mean": float(np.ptp(stiffness)) / mean,
        "ste_mean_um": float(ste.mean()) / MICRO,
        "ste_peak_to_peak_um": float(np.ptp(ste)) / MICRO,
        "largest_line_load_N_per_m": float(loaded.line_load.max()),
        "corner_sliding_percent": 100.0 * loaded.corner_work,
    }
