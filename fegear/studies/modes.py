"""Natural frequencies and mesh strain energy of a train."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fegear.files.codes import with_code
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.power_path import mesh_torques_at
from fegear.gearset.speeds import cycles_per_turn, mesh_frequency
from fegear.statics.excitation import Excitations, StiffnessSource, unmodified
from fegear.studies.page import ColumnTable, Page
from fegear.studies.study import (
    NO_PICTURES,
    Job,
    SettingsGroup,
    Study,
    StudyResult,
    Task,
    expose,
    group,
    refusal,
    refuse_given,
    setting,
    setting_of,
)
from fegear.studies.table import Table
from fegear.studies.train_problem import bodies_described
from fegear.studies.trains import RPM, GearSetRef, chosen_torque, torque_setting
from fegear.train.lumped_models import (
    LumpedModel,
    body_entries,
    body_modes_warnings,
    default_speeds,
    lumped_system,
)
from fegear.train.rotating_frame import frame_warnings, speed_warnings
from lumped.common.checks import require_present
from lumped.train.mode_families import (
    Family,
    Whirl,
    mode_families,
    multiplicities,
    whirl_senses,
)
from lumped.train.modes import Modes, natural_modes
from lumped.train.rotating_frame import (
    RotatingFrameModes,
    whirl_modes,
    without_free_motions,
)
from lumped.train.system import LumpedSystem
from lumped.train.train import Train

FloatArray = NDArray[np.float64]
MIN_MESH_ENERGY_FRACTION = (
    1e-6  # part of the strain energy in the meshes below which there is none
)
FE_SETTINGS = SettingsGroup(kind=StiffnessSource, exposed=expose("plane", "resolution"))


@dataclass(frozen=True, kw_only=True)
class NaturalModes(Study, command="modes", example="modes liu-idler --translations"):
    "Natural frequencies of a train, and the meshes they strain."

    pictures = NO_PICTURES

    gear_set: GearSetRef
    torque: float | None = torque_setting()
    translations: bool = setting_of(
        LumpedModel, "translations", option="--translations"
    )
    stiffness: Literal["given", "fe", "coupled"] = setting(
        "given",
        "Mean mesh stiffness. given: mean_stiffness_N_per_m of the gear set, or "
        "finite elements where it is missing; fe: by finite elements at the "
        "torque; coupled: of the coupled model about its loaded state.",
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
        solve = self._under_load if self.stiffness == "coupled" else self._linear
        yield Task("modes", partial(solve, self.load))

    def _under_load(self, load: float | None, job: Job) -> ModesResult:
        torque = load or 0.0
        coupled = LumpedModel(
            number="coupled",
            translations=self.translations,
            bearings="linear",
            stiffness=self.source,
        )
        system = lumped_system(self.gears, torque, coupled)
        origin = f"tangent of the coupled model at {torque:g} N m on the input gear"
        origins = [origin] * len(self.gears.meshes)
        modes = self._at_speed(system.train, modes_under_load(system), system)
        return self._result(load, system.train, modes, origins, system)

    def _linear(self, load: float | None, job: Job) -> ModesResult:
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
        meshes = None if system is None else mesh_stiffness_of_modes(system)
        return whirl_modes(modes, train.carrier_angular_speed(frequency), meshes)

    def _result(
        self,
        load: float | None,
        train: Train,
        modes: Modes,
        origins: list[str],
        system: LumpedSystem | None = None,
    ) -> ModesResult:
        at_speed = modes if isinstance(modes, RotatingFrameModes) else None
        return ModesResult(
            *(self, self.gears.name, load, train.damping_ratio, modes, origins),
            system=system,
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
    gear_warnings: tuple[str, ...] = ()
    families: tuple[Family, ...] = ()
    whirl: tuple[Whirl, ...] = ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, modes = self.study, self.modes
        return {
            "gear_set": self.gear_set,
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
            "modes": [
                {
                    "frequency_Hz": float(modes.frequency_Hz[i]),
                    "mesh_energy": [float(part) for part in modes.mesh_energy[:, i]],
                    "kind": name_mode(modes, i),
                    **self._family(i),
                }
                for i in range(modes.frequency_Hz.size)
            ],
            **self._bodies(),
        }

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
        last = ["kind", *(("family", "multiplicity") if self.families else ())]
        last += ["whirl"] if self.whirl else []
        names = "frequency_Hz", *(f"mesh{m}_energy_fraction" for m in meshes), *last
        rows = [
            (mode["frequency_Hz"], *mode["mesh_energy"], *(mode[key] for key in last))
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
        modes = values["modes"]
        columns = {
            f"energy in\nmesh {entry['mesh']} [%]": [
                f"{100.0 * mode['mesh_energy'][m]:.1f}" for mode in modes
            ]
            for m, entry in enumerate(values["mean_stiffness"])
        }
        if self.families:
            columns["family"] = [mode["family"] for mode in modes]
        if self.whirl:
            columns["whirl"] = [mode["whirl"] for mode in modes]
        columns["what moves most"] = [mode["kind"] for mode in modes]
        frequencies = [f"{mode['frequency_Hz']:10.1f}" for mode in modes]
        yield ColumnTable(frequencies, columns, "natural\nfrequency [Hz]", title)


def modes_under_load(system: LumpedSystem) -> Modes:
    """Modes that strain a mesh, of the coupled model about its loaded state.

    Mean stiffnesses are tangents of the meshes.
    """
    contacts = require_present(system.contacts, "coupled model")
    loaded, shapes, modes = system.loaded, system.arrays.shapes, system.modes
    loaded = require_present(loaded, "loaded state")
    bodies, hub_count = contacts.body_modes, system.moving.size
    # of bodies that yield as they do at rest
    at_rest = replace(system, contacts=replace(contacts, modes=None))
    still = require_present(at_rest.loaded, "loaded state")
    modal_stiffness = np.einsum("mi,mij,mj->m", shapes, still.meshes, shapes)
    hub_and_body_shapes = bodies.to_unit @ loaded.shapes
    space = modes.coordinates
    names = [_name_of_body_mode(system, i) for i in range(bodies.count)]
    # body modes have a mass of 1 and no place in the train; free motions are left out
    frame = [
        np.pad(matrix, (0, bodies.count))
        for matrix in (space.gyroscopic, without_free_motions(modes))
    ]
    return Modes(
        coordinates=replace(
            space,
            labels=(*space.labels, *names),
            mass=np.append(space.mass, np.ones(bodies.count)),
            gyroscopic=frame[0],
            centripetal=frame[1],
        ),
        mean_stiffness=modal_stiffness / (shapes**2).sum(axis=1) ** 2,
        frequency_Hz=loaded.frequency_Hz,
        shapes=np.concatenate(
            [
                modes.shapes[:, system.moving] @ hub_and_body_shapes[:hub_count],
                hub_and_body_shapes[hub_count:],
            ]
        ),
        mesh_shapes=shapes @ hub_and_body_shapes[:hub_count],
        mesh_energy=loaded.mesh_energy,
    )


def mesh_stiffness_of_modes(system: LumpedSystem) -> FloatArray:
    """Tangent stiffness (m, n, n) of each mesh in the modes about the loaded state."""
    loaded = require_present(system.loaded, "loaded state")
    return np.asarray(loaded.shapes.T @ loaded.meshes @ loaded.shapes)


def _name_of_body_mode(system: LumpedSystem, i: int) -> tuple[str, str]:
    """Gear, and the number of nodal diameters."""
    bodies = require_present(system.contacts, "coupled model").body_modes
    gear, n = system.train.gears[int(bodies.gears[i])], int(bodies.nodal_diameters[i])
    diameters = "1 nodal diameter" if n == 1 else f"{n} nodal diameters"
    return gear.name, f"body, {diameters}" if n else "body against its hub"


def stiffness_load(study: Any, gears: GearSet) -> float | None:
    """Torque on the input gear [N m] of mean stiffnesses, None where all are given.

    study : with the settings torque, stiffness and source, which are refused where
        they would change nothing
    """
    if study.stiffness != "given" or not all(m.mean_stiffness for m in gears.meshes):
        return chosen_torque(gears, study.torque)
    if study.torque is not None:
        reason = f"{gears.name} gives all mean stiffnesses, use "
        raise refusal(study, "torque", reason + "{stiffness} fe")
    reason = "the gear set gives all stiffness parameters, nothing is solved"
    refuse_given(study.source, [*FE_SETTINGS.exposed], reason, FE_SETTINGS)
    return None


def mean_stiffnesses(
    gear_set: GearSet, torque: float, source: StiffnessSource, use_given: bool
) -> list[tuple[float, str]]:
    """Mean stiffness of every mesh [N/m], and where it comes from."""
    excitations, stiffnesses = Excitations(source), []
    for mesh, driver_torque in enumerate(mesh_torques_at(gear_set, torque)):
        nominal = gear_set.meshes[mesh].mean_stiffness
        origin = (
            f"finite elements at {driver_torque:g} N m on the driver, without relief"
        )
        if nominal is not None and use_given:
            value, origin = nominal, "given by the gear set"
        else:
            table = excitations.table(unmodified(gear_set, mesh), mesh, driver_torque)
            value = float(table["stiffness_N_per_m"].mean())
        stiffnesses.append((value, origin))
    return stiffnesses


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
