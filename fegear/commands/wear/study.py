"""Wear of both flanks of a mesh over many revolutions, by Archard's law."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fegear.boundary import mesh_index
from fegear.commands.wear.archard import (
    DEPTH_STEP_SHARE,
    MIN_STEPS,
    PathPoints,
    StepPlan,
    WearingMesh,
    WornFlanks,
    path_points,
    wear_off,
)
from fegear.commands.wear.face_result import FaceWearResult
from fegear.commands.wear.faces import WearingFaces, require_few_points
from fegear.commands.wear.result import FlankWearResult
from fegear.contact.profiles import profile_depth
from fegear.files.errors import InputError
from fegear.gearset.faults.checks import require_no_faults
from fegear.gearset.faults.tooth_faults import FAULT_KINDS
from fegear.gearset.leads import require_one_helix
from fegear.gearset.model import GearSet
from fegear.gearset.modifications import FlankTopography
from fegear.gearset.pitch_errors import is_first_flank, mesh_errors
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.read import load_tables
from fegear.gearset.topographies import topography_keys
from fegear.gearset.zones import zones
from fegear.statics.contact_problem import (
    require_solvable,
    slices_over_width,
)
from fegear.statics.machine import loaded_problem
from fegear.statics.mesh_faults import without_wear
from fegear.statics.settings import RESOLUTIONS, StaticsSettings
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.settings import SettingsGroup, expose, group, setting
from fegear.studies.study import PLOT, Study
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torque
from fegear.studies.trains.shafts import require_shafts_used
from fegear.studies.trains.train_problem import refuse_edits
from lumped.common.array_types import Array
from lumped.common.options import Range
from lumped.common.units import UM

ROUNDED = 9  # decimals of angles [deg] and depths [um] in a file
MIN_POSITIONS = 8
ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose(
        *("positions", "friction", "plane", "resolution", "corner_contact"), "shafts"
    ),
)


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
            "Write the gear set with its worn flanks to this TOML file: as worn_teeth "
            "of both gears, or topographies where loads vary over the face width.",
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
                f"positions = {positions}; must be {MIN_POSITIONS} or more, between "
                "which depths are interpolated"
            )

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        if self.steps is not None and self.depth_step_um is not None:
            yield "depth_step_um", "{steps} takes its place"
        if "gears" in outputs:
            index = mesh_index(self.gears, self.mesh)
            if self.gears.meshes[index].varies_over_width:
                return
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
        require_shafts_used(self.elements, gears, self.mesh, ELEMENTS)
        gears = self.elements.on_shafts(gears)
        if gears.carrier is not None:
            raise InputError(
                f"{gears.name}: planetary sets; wear is that of gears on fixed axes"
            )
        require_one_helix(gears, "worn flanks")
        require_no_faults(gears, set(FAULT_KINDS) - {"worn"}, "wear")
        return gears

    def prepare(self) -> WearProblem:
        gears = self.gears
        index = mesh_index(gears, self.mesh)
        torque = chosen_torque(gears, self.torque, self.mesh)
        _require_equal_teeth(gears, index)
        points = path_points(gears.meshes[index].pair, self.elements.positions)
        if gears.meshes[index].varies_over_width:
            self._require_faces(gears, index, points)
        return WearProblem(self, gears, index, torque, points)

    def _require_faces(self, gears: GearSet, index: int, points: PathPoints) -> None:
        """Refuse a mesh whose worn flanks are no topographies."""
        require_solvable(gears, index, self.elements)
        resolution = RESOLUTIONS[self.elements.resolution]
        slices = slices_over_width(gears, index, resolution)
        require_few_points(gears, index, points, slices)


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
    points: PathPoints

    def tasks(self) -> Iterator[Task]:
        yield Task("wear", self._wear_off)

    def _wear_off(self, job: Job) -> FlankWearResult:
        study, gears = self.study, self.gears
        bare = without_wear(gears, self.index)
        place = bare, self.index, study.elements
        contact = loaded_problem(*place, self.torque, job.report)
        varies = gears.meshes[self.index].varies_over_width
        kind = WearingFaces if varies else WearingMesh
        mesh = kind(contact, self.torque, study.wear_coefficient, self.points)
        before = self._depth_before(mesh)
        first = mesh.load(before)
        depth_step = UM * (study.depth_step_um or 0.0)
        plan = StepPlan(depth_step or DEPTH_STEP_SHARE * first.deflection, study.steps)
        worn = wear_off(mesh, before, study.cycles, plan, job.report)
        coarser = wear_off(mesh, before, study.cycles, plan.halved, job.report)
        kind_of_result: Callable[..., FlankWearResult] = FlankWearResult
        if isinstance(mesh, WearingFaces):
            error = mesh.slice_error(first, before)
            kind_of_result = partial(FaceWearResult, slice_error=error)
        return kind_of_result(
            study=study,
            gear_set=gears.name,
            names=tuple(gears.gears[n].name for n in gears.meshes[self.index].gears),
            mesh=mesh,
            worn=worn,
            coarser=coarser,
            gear_warnings=tuple(gear_set_warnings(gears)),
            tables=self._tables(mesh, worn),
        )

    def _depth_before(self, mesh: WearingMesh) -> Array:
        """Depths (2, p, ...) of wear that the gear set has [m]."""
        depth = mesh.unworn
        spec = self.gears.meshes[self.index]
        roles = zip(spec.gears, ("driver", "driven"), strict=True)
        for row, (gear, role) in enumerate(roles):
            wear = self.gears.gears[gear].faults.wear_of(0)
            if wear is not None and is_first_flank(self.gears, self.index, gear):
                flank = zones(spec.pair, role)
                rolls = mesh.roll_lengths[row]
                depth[row].T[...] = profile_depth(wear, rolls, flank.start, flank.tip)
        return depth

    def _tables(self, mesh: WearingMesh, worn: WornFlanks) -> dict[str, Any] | None:
        """Tables of the gear set with its wear; None where it has no file for it."""
        ref = self.study.gear_set
        if ref.preloaded is not None:
            return None
        if isinstance(mesh, WearingFaces):
            # worn_teeth that are there stay
            edits = _topography_edits(self.index, mesh.topographies(worn.lost), mesh)
        elif all(is_first_flank(self.gears, self.index, gear) for gear in self._both):
            edits = self._worn_teeth_edits(mesh, worn.depth)
        else:
            return None
        try:
            ref.changed(edits)
        except InputError as error:
            cycles = self.study.cycles
            text = f"cycles = {cycles:.12g}; flanks are worn too far, {error}"
            raise InputError(text) from None
        return load_tables(ref.name, ref.overrides | edits)

    @property
    def _both(self) -> tuple[int, int]:
        """Indices of driver and driven gear."""
        return self.gears.meshes[self.index].gears

    def _worn_teeth_edits(self, mesh: WearingMesh, depth: Array) -> dict[str, Any]:
        rows = zip(self._both, mesh.roll_angles, depth, strict=True)
        return {
            f"gear.{gear + 1}.worn_teeth": [_worn_teeth(angles, depths)]
            for gear, angles, depths in rows
        }


def _worn_teeth(roll_angles: Array, depth: Array) -> dict[str, Any]:
    """Keys of the wear of all teeth of a gear."""
    order = np.argsort(roll_angles)
    return {
        "roll_angle_deg": _rounded(np.degrees(roll_angles[order])),
        "depth_um": _rounded(depth[order] / UM),
    }


def _topography_edits(
    index: int, topographies: Sequence[FlankTopography], mesh: WearingMesh
) -> dict[str, Any]:
    """Keys of the topographies of both flanks of a mesh."""
    gears = mesh.pair.driver, mesh.pair.driven
    roles = "driver", "driven"
    return {
        f"mesh.{index + 1}.{role}_topography": topography_keys(
            topography, gear.base_radius, ROUNDED
        )
        for role, gear, topography in zip(roles, gears, topographies, strict=True)
    }


def _rounded(values: Array) -> list[Any]:
    return list(values.round(ROUNDED).tolist())
