"""A train as matrices for other programs: mass, damping, stiffness and meshes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal

from fegear.boundary import mesh_index
from fegear.commands.export.fmu import FmuMesh
from fegear.commands.export.result import MODELS, ModelExportResult
from fegear.files.output import listed
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.power_path import mesh_torques_at
from fegear.statics.excitation import Excitations
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import (
    group,
    refusal,
    refuse_non_default,
    setting,
    setting_of,
)
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import chosen_torque, torque_setting
from fegear.studies.trains.mean_stiffness import (
    FE_SETTINGS,
    mean_stiffnesses,
    require_stiffness_edits,
)
from fegear.train.loaded_modes import (
    LinearModel,
    linear_model,
    linear_model_of_springs,
    system_of_modes,
)
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import GearMotion, LumpedModel
from fegear.train.space_matrices import linear_model_in_space
from lumped.common.checks import require_present
from lumped.train.modes import natural_modes
from lumped.train.train import Train

SPRINGS = 1  # model of the mesh in an FMU: every tooth pair with stiffness and gap


@dataclass(frozen=True, kw_only=True)
class ModelExport(
    Study, command="export", example="export liu-idler --translations -o model.mat"
):
    """Mass, damping and stiffness matrices for other programs.

    M x'' + C x' + K x = load, about the state under load with the relief as it is cut;
    vibration of the gears' bodies has coordinates of its own. Row i of mesh_vectors
    times x is the deflection of mesh i. By fe or given stiffness K is made of mean
    mesh stiffnesses, from which models with varying ones are built. With --mesh, an
    FMU (FMI 2.0, co-simulation) of one mesh, whose torques follow from angles and
    speeds of its gears.
    """

    pictures = NO_PICTURES
    output = f"Write the model to this file, {listed(MODELS)}."
    endings = MODELS
    must_write = True

    gear_set: GearSetRef
    torque: float | None = torque_setting()
    mesh: int | None = setting(
        None,
        "Number of the mesh, counted from 1, that an .fmu contains, with the stiffness "
        "of tooth pairs by finite elements. [default: none]",
    )
    translations: bool = setting_of(
        LumpedModel, "translations", option="--translations"
    )
    motion: GearMotion = setting_of(LumpedModel, "motion", option="--motion")
    damping_ratio: float | None = setting_of(LumpedModel, "damping_ratio")
    stiffness: Literal["auto", "fe", "given"] = setting(
        "auto",
        "Mesh stiffness. auto: of the coupled model about its loaded state, or "
        "averages of model 1 where the gear set needs that; fe: mean by finite "
        "elements at the torque, without relief; given: mean_stiffness_N_per_m of the "
        "gear set, or fe where it is missing.",
    )
    excitation: ExcitationSettings = group(FE_SETTINGS)

    @property
    def gears(self) -> GearSet:
        """The gear set with its edits."""
        require_stiffness_edits(self)
        return self.gear_set.healthy("exported models")

    @property
    def joins_housing(self) -> bool:
        return self.motion == "space"

    def tasks(self) -> Iterator[Task]:
        gears = self.gears
        if self.motion == "space" and (self.stiffness != "auto" or self.mesh):
            raise refusal(self, "motion", "needs {stiffness} auto and no {mesh}")
        is_given = all(m.mean_stiffness for m in gears.meshes)
        if self.stiffness == "given" and is_given and self.mesh is None:
            reason = "the gear set gives all stiffness parameters, nothing is solved"
            refuse_non_default(
                self.excitation, [*FE_SETTINGS.exposed], reason, FE_SETTINGS
            )
        yield Task("model", partial(self._export_model, gears))

    def _export_model(self, gears: GearSet, job: Job) -> ModelExportResult:
        torque = chosen_torque(gears, self.torque)
        train = train_of(gears, torque, self.translations, self.damping_ratio)
        if self.stiffness == "auto" and self.mesh is None:
            linear, origins = self._model_under_load(gears, torque)
        else:
            has_given_stiffness = self.stiffness != "fe"
            stiffnesses = mean_stiffnesses(
                gears, torque, self.excitation, has_given_stiffness
            )
            modes = natural_modes(train, [value for value, _ in stiffnesses])
            linear = linear_model_of_springs(modes, train.damping_ratio)
            origins = [origin for _, origin in stiffnesses]
        fmu_mesh = None if self.mesh is None else self._fmu_mesh(gears, train, torque)
        warnings = (*motion_warnings(gears, self.joins_housing),)
        return ModelExportResult(
            self, gears.name, torque, train, linear, origins, fmu_mesh, warnings
        )

    def _model_under_load(
        self, gears: GearSet, torque: float
    ) -> tuple[LinearModel, list[str]]:
        """The equations about the loaded state, and where each stiffness comes from."""
        model = LumpedModel(
            number=1,
            translations=self.translations,
            motion=self.motion,
            damping_ratio=self.damping_ratio,
            excitation=self.excitation,
        )
        if self.motion == "space":
            system = lumped_system(gears, torque, model)
            origin = f"average over the cycle at {torque:g} N m on the input gear"
            return linear_model_in_space(system), [origin] * len(gears.meshes)
        system, _ = system_of_modes(gears, torque, model)
        origin = f"at {torque:g} N m on the input gear"
        if system.contacts is None:
            linear = linear_model_of_springs(system.modes, system.train.damping_ratio)
            name = "average of model 1"
        else:
            linear, name = linear_model(system), "tangent of the coupled model"
        return linear, [f"{name} {origin}"] * len(gears.meshes)

    def _fmu_mesh(self, gears: GearSet, train: Train, torque: float) -> FmuMesh:
        """The mesh with its tooth pairs at the torque on its driver."""
        index = mesh_index(gears, require_present(self.mesh, "mesh"))
        torque_on_driver = mesh_torques_at(gears, torque)[index]
        source = Excitations(self.excitation)
        excitation = source.mesh_excitation(gears, index, torque_on_driver, SPRINGS)
        mesh = train.meshes[index]
        pair = train.gears[mesh.driver], train.gears[mesh.driven]
        reduced_mass = 1.0 / sum(gear.base_radius**2 / gear.inertia for gear in pair)
        critical = 2.0 * math.sqrt(excitation.mean_stiffness * reduced_mass)
        return FmuMesh(
            excitation=excitation,
            driver_teeth=pair[0].teeth,
            base_radii=(abs(pair[0].base_radius), abs(pair[1].base_radius)),
            backlash=mesh.backlash,
            damping=train.damping_ratio * critical,
            phase=mesh.phase,
            description=(
                f"{gears.name}, mesh {self.mesh}: {pair[0].name} drives "
                f"{pair[1].name}, tooth pairs at {torque_on_driver:g} N m on the driver"
            ),
        )
