"""Resonances of a gear set by closed forms: what to expect before anything is swept."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fegear.commands.theory.result import TheoryResult
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.speeds import cycles_per_turn
from fegear.gearset.unmodified import unmodified
from fegear.gearset.zones import zones
from fegear.statics.excitation import ExcitationSource
from fegear.statics.plausibility import mesh_warnings
from fegear.studies.problem import Job, Task
from fegear.studies.study import Study
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.model_texts import file_header, natural_in_words
from fegear.studies.trains.models import SPRINGS, lumped_model, tables_setting
from fegear.studies.trains.train_problem import TrainFacts, TrainProblem
from fegear.studies.trains.train_study import TrainStudy
from fegear.train.loaded_modes import system_of_modes
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from fegear.train.resonances import natural_frequencies
from lumped.closed_forms import (
    ParametricSystem,
    optimal_relief,
    parametric_system,
    predictions,
)
from lumped.closed_forms.parametric import MIN_DAMPING
from lumped.common.csv_text import format_exact
from lumped.train.excitation import MeshExcitation
from lumped.train.system import LumpedSystem

POSITIONS = 1024  # of a base pitch, for the extremes of the stiffness
START_RTOL = 1e-6  # of roll lengths that are the same but for rounding


@dataclass(frozen=True, kw_only=True)
class Theory(
    TrainStudy,
    Study,
    command="theory",
    example="theory liu-idler --torque 100 --excitation rectangular -o theory.csv",
):
    """Resonances of a lumped train by closed forms.

    First-order multiple scales about the mean mesh stiffness, `lumped.closed_forms`,
    predict resonances, loss of contact, peaks, the damping that suppresses a
    subharmonic and the best tip relief without time integration. The relief is that
    of each tip, linear from the highest point of single-tooth contact (HPSTC). Every
    prediction reports where its assumptions do not hold.
    """

    torque: float | None = torque_setting()
    model: LumpedModel = lumped_model(SPRINGS, 1)
    table: tuple[str, ...] = tables_setting()

    def prepare(self) -> TheoryProblem:
        return TheoryProblem.of(self)


@dataclass(frozen=True, eq=False)
class TheoryProblem(TrainProblem):
    """A train under one torque."""

    study: Theory

    def tasks(self) -> Iterator[Task]:
        yield Task("resonances", self._predict)

    def _predict(self, job: Job) -> TheoryResult:
        """InputError without load, damping, or anything that varies."""
        torque, model, name = self.single_torque, self.model, self.gears.name
        if model.number == "coupled":
            raise InputError(
                "number = coupled; closed forms are those of models 1, 2 and 3"
            )
        source = model.excitations
        system = lumped_system(self.gears, torque, model, source)
        ratio = system.train.damping_ratio
        if not MIN_DAMPING <= ratio < 1.0:
            raise InputError(
                f"damping_ratio = {ratio:g}; closed forms need one from "
                f"{MIN_DAMPING:g} to below 1"
            )
        if not (system.static_deflection > 0.0).all():
            raise InputError(
                f"torque = {torque:g}; closed forms need one that loads the drive "
                "flanks of all meshes"
            )
        try:
            parametric = parametric_system(system)
        except ValueError as error:
            raise InputError(f"{name}: {error}") from None
        resonances = predictions(parametric)
        if not resonances:
            raise InputError(
                f"{name}: neither stiffness nor transmission error of a mesh varies, "
                "nothing resonates"
            )
        ranges = tuple(
            self._stiffness_range(source, mesh, on_mesh)
            for mesh, on_mesh in enumerate(mesh_torques_at(self.gears, torque))
        )
        reliefs = range(len(self.gears.meshes))
        natural, _ = system_of_modes(self.gears, torque, model)
        return TheoryResult(
            self.study,
            self._facts(torque, system, parametric),
            torque,
            system,
            parametric,
            resonances,
            optimal_reliefs=tuple(
                self._optimal_relief(parametric, mesh, ranges[mesh]) for mesh in reliefs
            ),
            other_reliefs=tuple(
                tuple(_other_relief_texts(self.gears, mesh)) for mesh in reliefs
            ),
            natural_Hz=tuple(natural_frequencies(natural)),
            natural=natural_in_words(natural, torque),
        )

    def _facts(
        self, torque: float, system: LumpedSystem, parametric: ParametricSystem
    ) -> TrainFacts:
        ratio, rest_warnings = system.train.damping_ratio, np.abs(parametric.deflection)
        order = f"{parametric.stiffness_harmonics.shape[1]} harmonics"
        method = f"closed forms, {order}"
        return TrainFacts(
            summary=self.summary_head(ratio) | {"torque_Nm": torque},
            header={
                **file_header(self.gears, self.model, ratio, method),
                "model": self.model.name,
                "torque_Nm": format_exact(torque),
            },
            cycles_per_turn=cycles_per_turn(self.gears),
            notes=self.notes,
            warnings=(
                *self.warnings_at_rest({torque: system}),
                *mesh_warnings(
                    self.gears.meshes, ", at rest", rest_warnings, 0.0 * rest_warnings
                ),
            ),
        )

    def _optimal_relief(
        self,
        parametric: ParametricSystem,
        mesh: int,
        stiffness_range: tuple[float, float] | None,
    ) -> float | None:
        """None unless one and two pairs alternate, as eq. 2.28 requires."""
        if stiffness_range is None:
            return None
        lowest, highest = stiffness_range
        ratio = self.gears.meshes[mesh].pair.contact_ratio
        # rounding apart, it takes two pairs to be stiffer, and at most twice as stiff
        if not (1.0 < ratio < 2.0 and lowest * (1.0 + 1e-9) < highest <= 2.0 * lowest):
            return None
        force = float(parametric.stiffness[mesh] * parametric.elastic[mesh])
        return optimal_relief(force, lowest, highest)

    def _stiffness_range(
        self, source: ExcitationSource, mesh: int, torque: float
    ) -> tuple[float, float] | None:
        """That of a mesh whose teeth have no relief, None for tables of others."""
        without_relief = unmodified(self.gears, mesh)
        if self.study.table and without_relief.meshes[mesh] != self.gears.meshes[mesh]:
            return None
        return _stiffness_range(
            source.mesh_excitation(without_relief, mesh, torque, self.model.springs)
        )


def _stiffness_range(excitation: MeshExcitation) -> tuple[float, float]:
    """Lowest and highest stiffness of the mesh over its cycle [N/m]."""
    x = (np.arange(POSITIONS) + 0.5) / POSITIONS
    total = np.sum([pair.stiffness(x) for pair in excitation.pairs], axis=0)
    return float(total.min()), float(total.max())


def _other_relief_texts(gear_set: GearSet, mesh: int) -> Iterator[str]:
    """Reliefs of a mesh to which the best tip relief does not apply, in words."""
    spec = gear_set.meshes[mesh]
    if spec.is_helical:
        yield "lines of contact are inclined: eq. 2.28 is that of spur gears"
    for role, index, modified in zip(
        ("driver", "driven"), spec.gears, spec.flanks, strict=True
    ):
        flank, name = zones(spec.pair, role), gear_set.gears[index].name
        tip = modified.tip_relief
        if modified.root_relief is not None:
            yield f"{name} has a root relief too"
        if modified.profile is not None:
            yield f"{name} has another profile modification too"
        if tip is None:
            continue
        if tip.power != 1.0:
            yield f"the tip relief of {name} is {tip.shape}"
        start, high = tip.start_roll_length, flank.high
        if not math.isclose(start, high, rel_tol=START_RTOL):
            yield (
                f"the tip relief of {name} starts at a roll angle of "
                f"{flank.roll_angle_deg(start):.4g} deg, HPSTC is at "
                f"{flank.roll_angle_deg(high):.4g} deg"
            )
