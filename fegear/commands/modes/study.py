"""Natural frequencies and mesh strain energy of a train."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Literal

from fegear.commands.modes.result import ModesResult
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.speeds import cycles_per_turn, mesh_frequency
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import group, refusal, setting, setting_of
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import chosen_torque, torque_setting
from fegear.studies.trains.mean_stiffness import (
    FE_SETTINGS,
    mean_stiffnesses,
    require_stiffness_edits,
    stiffness_load,
)
from fegear.studies.trains.speeds import RPM
from fegear.studies.trains.train_problem import reduction_note
from fegear.train.loaded_modes import (
    averages_of_modes,
    mesh_stiffness_of_modes,
    modes_under_load,
    system_of_modes,
)
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import GearMotion, LumpedModel
from fegear.train.rotating_frame import frame_warnings, speed_warnings
from lumped.common.checks import require_present
from lumped.train.mode_families import mode_families, whirl_senses
from lumped.train.modes import Modes, natural_modes
from lumped.train.rotating_frame import RotatingFrameModes, whirl_modes
from lumped.train.space_modes import SpaceShares, space_shares
from lumped.train.system import LumpedSystem
from lumped.train.train import Train


@dataclass(frozen=True, kw_only=True)
class NaturalModes(Study, command="modes", example="modes liu-idler --translations"):
    """Natural frequencies of a train, and what its modes strain.

    They are those of small vibrations about the state under load, with the relief as it
    is cut, by the coupled model. Averages of model 1 stand beside them.
    """

    pictures = NO_PICTURES

    gear_set: GearSetRef
    torque: float | None = torque_setting()
    translations: bool = setting_of(
        LumpedModel, "translations", option="--translations"
    )
    motion: GearMotion = setting_of(LumpedModel, "motion", option="--motion")
    stiffness: Literal["auto", "coupled", "fe", "given"] = setting(
        "auto",
        "Mesh stiffness. auto: coupled, or averages of model 1 where the gear set "
        "needs that; coupled: of the coupled model about its loaded state; fe: mean by "
        "finite elements at the torque, without relief; given: mean_stiffness_N_per_m "
        "of the gear set, or fe where it is missing.",
    )
    rpm: float | None = setting(
        None,
        "Rotational speed of the input of a planetary set [rpm], at which "
        "--translations have gyroscopic and centripetal forces. [default: at rest]",
        RPM,
        metavar="RPM",
    )
    excitation: ExcitationSettings = group(FE_SETTINGS)

    @property
    def gears(self) -> GearSet:
        """The gear set with its edits."""
        require_stiffness_edits(self)
        return self.gear_set.nominal("natural modes")

    @property
    def joins_housing(self) -> bool:
        return self.motion == "space"

    @property
    def load(self) -> float | None:
        """Torque on the input gear [N m], None where nothing depends on it."""
        rolling = any(gear.rolling_bearing for gear in self.gears.gears)
        if self.translations and rolling:
            return chosen_torque(self.gears, self.torque)
        return stiffness_load(self, self.gears)

    def tasks(self) -> Iterator[Task]:
        if self.rpm is not None and (
            self.gears.carrier is None or not self.translations
        ):
            needed = (
                "needs a planetary set and {translations}, whose modes depend on it"
            )
            raise refusal(self, "rpm", needed)
        if self.motion == "space":
            if self.stiffness != "auto":
                raise refusal(self, "motion", "needs {stiffness} auto")
            yield Task("modes", partial(self._modes_in_space, self.load or 0.0))
            return
        is_by_averages = self.stiffness in ("fe", "given")
        solve = self._modes_of_averages if is_by_averages else self._modes_under_load
        yield Task("modes", partial(solve, self.load))

    def _modes_under_load(self, load: float | None, job: Job) -> ModesResult:
        torque, gears = load or 0.0, self.gears
        model = LumpedModel(
            number="coupled",
            translations=self.translations,
            bearings="linear",
            excitation=self.excitation,
        )
        if self.stiffness == "auto":
            system, reason = system_of_modes(gears, torque, model)
        else:
            system, reason = lumped_system(gears, torque, model), ""
        origin = f"at {torque:g} N m on the input gear"
        if system.contacts is None:
            origins = [f"average of model 1 {origin}"] * len(gears.meshes)
            modes = self._modes_at_speed(system.train, system.modes)
            return self._result(load, system.train, modes, origins, reason=reason)
        origins = [f"tangent of the coupled model {origin}"] * len(gears.meshes)
        at_rest = modes_under_load(system)
        modes = self._modes_at_speed(system.train, at_rest, system)
        averages = [] if self.rpm else averages_of_modes(system, at_rest)
        return self._result(
            load, system.train, modes, origins, system, tuple(averages), reason
        )

    def _modes_in_space(self, torque: float, job: Job) -> ModesResult:
        model = LumpedModel(
            number=1,
            translations=self.translations,
            motion="space",
            excitation=self.excitation,
        )
        system = lumped_system(self.gears, torque, model)
        space = require_present(system.space, "motion in space")
        shares = space_shares(space, system.modes)
        origin = f"average over the cycle at {torque:g} N m on the input gear"
        origins = [origin] * len(self.gears.meshes)
        reason = reduction_note(system)
        return self._result(
            torque, system.train, system.modes, origins, reason=reason, shares=shares
        )

    def _modes_of_averages(self, load: float | None, job: Job) -> ModesResult:
        torque = load or 0.0
        has_given_stiffness = self.stiffness == "given"
        stiffnesses = mean_stiffnesses(
            self.gears, torque, self.excitation, has_given_stiffness
        )
        train = train_of(self.gears, torque, self.translations)
        modes = natural_modes(train, [value for value, _ in stiffnesses])
        origins = [origin for _, origin in stiffnesses]
        return self._result(load, train, self._modes_at_speed(train, modes), origins)

    def _modes_at_speed(
        self, train: Train, modes: Modes, system: LumpedSystem | None = None
    ) -> Modes:
        """Modes at the speed, those at rest without one."""
        if self.rpm is None:
            return modes
        frequency = mesh_frequency(cycles_per_turn(self.gears), self.rpm)
        meshes = None if system is None else mesh_stiffness_of_modes(system, modes)
        return whirl_modes(modes, train.carrier_angular_speed(frequency), meshes)

    def _result(
        self,
        load: float | None,
        train: Train,
        modes: Modes,
        origins: list[str],
        system: LumpedSystem | None = None,
        averages: tuple[float | None, ...] = (),
        reason: str = "",
        shares: SpaceShares | None = None,
    ) -> ModesResult:
        at_speed = modes if isinstance(modes, RotatingFrameModes) else None
        return ModesResult(
            *(self, self.gears.name, load, train.damping_ratio, modes, origins),
            system=system,
            averages=averages,
            reason=reason,
            gear_warnings=(
                *motion_warnings(self.gears, self.joins_housing),
                *frame_warnings(train),
                *(speed_warnings(at_speed) if at_speed else ()),
            ),
            families=mode_families(train, modes) if train.carrier else (),
            whirl=whirl_senses(train, at_speed) if at_speed else (),
            shares=shares,
        )
