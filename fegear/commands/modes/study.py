"""Natural frequencies and mesh strain energy of a train."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np

from fegear.files.codes import with_code
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.speeds import cycles_per_turn, mesh_frequency
from fegear.statics.excitation import StiffnessSource
from fegear.studies.page import ColumnTable, Page, pluralize
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.settings import (
    group,
    refusal,
    setting,
    setting_of,
)
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import chosen_torque, torque_setting
from fegear.studies.trains.mean_stiffness import (
    FE_SETTINGS,
    mean_stiffnesses,
    require_stiffness_edits,
    stiffness_load,
)
from fegear.studies.trains.model_texts import body_entries, body_modes_warnings
from fegear.studies.trains.speeds import RPM
from fegear.studies.trains.train_problem import bodies_described
from fegear.train.loaded_modes import (
    averages_of_modes,
    mesh_stiffness_of_modes,
    modes_under_load,
    system_of_modes,
)
from fegear.train.lumped_models import LumpedModel, default_speeds, lumped_system
from fegear.train.rotating_frame import frame_warnings, speed_warnings
from lumped.train.coordinates import SPRING_KINDS
from lumped.train.mode_families import (
    Family,
    Whirl,
    mode_families,
    multiplicities,
    whirl_senses,
)
from lumped.train.modes import MIN_FELT_ENERGY, Modes, natural_modes
from lumped.train.rotating_frame import RotatingFrameModes, whirl_modes
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

ELSEWHERE = {
    "shaft": "\nshafts\n[%]",
    "bearing": "\nbearings\n[%]",
    "body": "\nbodies\n[%]",
}
MIN_SHOWN_ENERGY = 5e-4  # part of the energy; a column without a larger one is left out
MAX_COLUMNS = 3  # of meshes with a column of their own on the screen
MIN_MESH_ENERGY_FRACTION = (
    1e-6  # part of the strain energy in the meshes below which there is none
)


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
    source: StiffnessSource = group(FE_SETTINGS)

    @property
    def gears(self) -> GearSet:
        """The gear set with its edits."""
        require_stiffness_edits(self)
        return self.gear_set.nominal("natural modes")

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
        by_averages = self.stiffness in ("fe", "given")
        solve = self._of_averages if by_averages else self._under_load
        yield Task("modes", partial(solve, self.load))

    def _under_load(self, load: float | None, job: Job) -> ModesResult:
        torque, gears = load or 0.0, self.gears
        model = LumpedModel(
            number="coupled",
            translations=self.translations,
            bearings="linear",
            stiffness=self.source,
        )
        if self.stiffness == "auto":
            system, reason = system_of_modes(gears, torque, model)
        else:
            system, reason = lumped_system(gears, torque, model), ""
        origin = f"at {torque:g} N m on the input gear"
        if system.contacts is None:
            origins = [f"average of model 1 {origin}"] * len(gears.meshes)
            modes = self._at_speed(system.train, system.modes)
            return self._result(load, system.train, modes, origins, reason=reason)
        origins = [f"tangent of the coupled model {origin}"] * len(gears.meshes)
        at_rest = modes_under_load(system)
        modes = self._at_speed(system.train, at_rest, system)
        averages = [] if self.rpm else averages_of_modes(system, at_rest)
        return self._result(
            load, system.train, modes, origins, system, tuple(averages), reason
        )

    def _of_averages(self, load: float | None, job: Job) -> ModesResult:
        torque = load or 0.0
        use_given = self.stiffness == "given"
        stiffnesses = mean_stiffnesses(self.gears, torque, self.source, use_given)
        train = train_of(self.gears, torque, self.translations)
        modes = natural_modes(train, [value for value, _ in stiffnesses])
        origins = [origin for _, origin in stiffnesses]
        return self._result(load, train, self._at_speed(train, modes), origins)

    def _at_speed(
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
    ) -> ModesResult:
        at_speed = modes if isinstance(modes, RotatingFrameModes) else None
        return ModesResult(
            *(self, self.gears.name, load, train.damping_ratio, modes, origins),
            system=system,
            averages=averages,
            reason=reason,
            gear_warnings=(
                *gear_set_warnings(self.gears),
                *frame_warnings(train),
                *(speed_warnings(at_speed) if at_speed else ()),
            ),
            families=mode_families(train, modes) if train.carrier else (),
            whirl=whirl_senses(train, at_speed) if at_speed else (),
        )


@dataclass(frozen=True, eq=False, repr=False)
class ModesResult(StudyResult):
    """Modes of a train.

    torque : on the input gear [N m], None where nothing depends on it
    origins : of the mean stiffness of each mesh, in words
    system : of the coupled model, None for others
    averages : natural frequency of each mode about the averages of model 1 [Hz], None
        for vibration of the bodies; empty for others than the coupled model at rest
    reason : why the model was chosen, empty where it was given
    families : of the modes of a planetary set, empty for others
    whirl : senses of the orbits of its members at speed, empty at rest
    """

    study: NaturalModes
    gear_set: str
    torque: float | None
    damping_ratio: float
    modes: Modes
    origins: list[str]
    system: LumpedSystem | None = None
    averages: tuple[float | None, ...] = ()
    reason: str = ""
    gear_warnings: tuple[str, ...] = ()
    families: tuple[Family, ...] = ()
    whirl: tuple[Whirl, ...] = ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, modes = self.study, self.modes
        return {
            "gear_set": self.gear_set,
            "model_reason": self.reason or None,
            "torque_Nm": self.torque,
            "translations": study.translations,
            "input_speed_rpm": study.rpm,
            "damping_ratio": self.damping_ratio,
            "mean_stiffness": [
                {"mesh": m, "stiffness_N_per_m": float(value), "origin": origin}
                for m, (value, origin) in enumerate(
                    zip(modes.mean_stiffness, self.origins, strict=True), start=1
                )
            ],
            "natural_frequencies_Hz": [
                float(modes.frequency_Hz[i])
                for i in np.flatnonzero(modes.mesh_energy.sum(axis=0) > MIN_FELT_ENERGY)
            ],
            "modes": [
                {
                    "frequency_Hz": float(modes.frequency_Hz[i]),
                    "average_frequency_Hz": self.averages[i] if self.averages else None,
                    "mesh_energy": [float(part) for part in modes.mesh_energy[:, i]],
                    **{f"{part}_energy": v[i] for part, v in self._elsewhere.items()},
                    "kind": name_mode(modes, i),
                    **self._family(i),
                }
                for i in range(modes.frequency_Hz.size)
            ],
            **self._bodies(),
        }

    @cached_property
    def _elsewhere(self) -> dict[str, list[float]]:
        """Fractions (n,) of the strain energy that are not in the meshes.

        What is left of the coupled model is in the bodies of the gears.
        """
        modes = self.modes
        parts = {kind: modes.spring_energy(kind) for kind in SPRING_KINDS}
        if self.system is not None:
            elsewhere = modes.mesh_energy.sum(axis=0) + sum(parts.values())
            parts["body"] = np.where(modes.strain > 0.0, 1.0 - elsewhere, 0.0)
        return {kind: part.tolist() for kind, part in parts.items()}

    def _family(self, i: int) -> dict[str, Any]:
        """Family, multiplicity and whirl of a mode of a planetary set, None for
        others."""
        whirl = self.whirl[i] if self.whirl else None
        if not self.families:
            return {"family": None, "multiplicity": None, "whirl": whirl}
        same = multiplicities(self.modes.frequency_Hz.tolist())
        return {"family": self.families[i], "multiplicity": same[i], "whirl": whirl}

    def _bodies(self) -> dict[str, Any]:
        if self.system is None:
            return {**bodies_described({}), "warnings": list(self.gear_warnings)}
        speeds = default_speeds(self.system)
        entries = bodies_described(body_entries(self.system, speeds))
        warnings = body_modes_warnings(self.system, speeds)
        return entries | {"warnings": [*self.gear_warnings, *warnings]}

    @property
    def table(self) -> Table:
        """A row for every mode."""
        meshes = range(1, len(self.origins) + 1)
        first = ["frequency_Hz", *(["average_frequency_Hz"] if self.averages else [])]
        parts = [f"{kind}_energy" for kind in self._elsewhere]
        last = ["kind", *(("family", "multiplicity") if self.families else ())]
        last += ["whirl"] if self.whirl else []
        names = (
            *first,
            *(f"mesh{m}_energy_fraction" for m in meshes),
            *(f"{part}_fraction" for part in parts),
            *last,
        )
        rows = [
            (
                *(math.nan if mode[key] is None else mode[key] for key in first),
                *mode["mesh_energy"],
                *(mode[key] for key in (*parts, *last)),
            )
            for mode in self.summary["modes"]
        ]
        header = {
            "gear set": self.gear_set,
            "translations": "yes" if self.study.translations else "no",
            **({"input speed": f"{self.study.rpm:g} rpm"} if self.whirl else {}),
            **{f"mesh {m}": self.origins[m - 1] for m in meshes},
            **self.study.gear_set.entries,
        }
        return Table(names, lambda: rows, header)

    def page(self) -> Page:
        values = self.summary
        if self.reason:
            yield self.reason
        for entry in values["mean_stiffness"]:
            yield (
                f"mesh {entry['mesh']}: mean stiffness "
                f"{entry['stiffness_N_per_m']:.5g} N/m, {entry['origin']}"
            )
        if values["body_modes"] is not None:
            yield with_code(
                "E05",
                f"body modes of the gears {values['body_modes']}; those left out "
                f"{values['body_modes_left_out']}",
            )
        title, torque = values["gear_set"], values["torque_Nm"]
        if torque is not None:
            title += f", {torque:g} N m on the input gear"
        if self.whirl:
            title += f", input at {values['input_speed_rpm']:g} rpm"
        modes = self._shown(values["modes"])
        columns = {}
        if self.averages:
            columns["averages\nof model 1\n[Hz]"] = [
                "-" if (f := mode["average_frequency_Hz"]) is None else f"{f:.1f}"
                for mode in modes
            ]
        columns |= self._energies(modes)
        if self.families:
            columns["family"] = [mode["family"] for mode in modes]
        if self.whirl:
            columns["whirl"] = [mode["whirl"] for mode in modes]
        columns["what moves most"] = [mode["kind"] for mode in modes]
        frequencies = [f"{mode['frequency_Hz']:10.1f}" for mode in modes]
        yield ColumnTable(frequencies, columns, "natural\nfrequency\n[Hz]", title)
        if left := values["modes"][len(modes) :]:
            ends = (left[0]["frequency_Hz"], left[-1]["frequency_Hz"])
            yield (
                f"{pluralize(len(left), 'more mode')}, {ends[0]:.1f} to {ends[1]:.1f} "
                "Hz, which the bodies add: all by -o or --json"
            )

    def _shown(self, modes: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """The lowest modes, as many as the train has with rigid bodies."""
        if self.system is None:
            return modes
        return modes[: self.system.modes.frequency_Hz.size]

    def _energies(self, modes: list[dict[str, Any]]) -> dict[str, list[str]]:
        """Columns of the parts of the strain energy, which add up to 100 %."""
        meshes = range(len(self.origins))
        if len(meshes) > MAX_COLUMNS:
            columns = {
                f"energy in\nmeshes 1 to {len(meshes)}\n[%]": [
                    " ".join(str(round(100.0 * part)) for part in mode["mesh_energy"])
                    for mode in modes
                ]
            }
        else:
            columns = {
                f"energy in\nmesh {m + 1}\n[%]": [
                    f"{100.0 * mode['mesh_energy'][m]:.1f}" for mode in modes
                ]
                for m in meshes
            }
        for kind, parts in self._elsewhere.items():
            if any(abs(part) > MIN_SHOWN_ENERGY for part in parts):
                columns[ELSEWHERE[kind]] = [
                    f"{100.0 * max(part, 0.0):.1f}" for part in parts[: len(modes)]
                ]
        return columns


def name_mode(modes: Modes, i: int) -> str:
    """Rigid rotation, or the coordinate that holds most of the kinetic energy."""
    energy = modes.coordinates.mass * np.abs(modes.shapes[:, i]) ** 2
    gear, direction = modes.coordinates.labels[int(energy.argmax())]
    if modes.frequency_Hz[i] == 0.0:
        return (
            "rigid rotation" if direction == "rotation" else f"free: {gear} {direction}"
        )
    leader = f"{gear} {direction}"
    if modes.mesh_energy[:, i].sum() < MIN_MESH_ENERGY_FRACTION:
        return f"strains no mesh: {leader}"
    return leader
