"""Load sharing between the planets of a planetary set at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.version import package_version
from fegear.gearset.axial_forces import axial_force_on_driver
from fegear.gearset.model import GearSet, PlanetCarrier
from fegear.gearset.pitch_errors import pair_periods
from fegear.statics.excitation import ExcitationSource
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.study import NO_PICTURES, Study
from fegear.studies.table import Table
from fegear.studies.trains.loads import chosen_torques, torques_setting
from fegear.studies.trains.models import ALL_MODELS, lumped_model, tables_setting
from fegear.studies.trains.train_problem import TrainProblem
from fegear.studies.trains.train_study import TrainStudy
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.train.equilibrium import mesh_forces_at_rest
from lumped.train.load_sharing import LoadSharing, load_sharing
from lumped.train.system import LumpedSystem

OFFERED_SETTINGS = {name: ALL_MODELS[name] for name in ("number", "excitation")}
MIN_SHARE = 1e-3  # share below which a planet counts as one without contact
EQUAL_TEETH = "the coupled model at rest has equal teeth, here some differ"
FIXED_CENTERS, CENTERS_ON_BEARINGS = "fixed", "on bearings"
COLUMNS: Columns = {
    "torque\n[N m]": cell("torque_Nm", 6),
    "centres": lambda row: str(row["centers"]),
    "planet": lambda row: str(row["planet"]),
    "position\nerror [um]": cell("position_error_um"),
    "load share\n[%]": cell("load_share", 4, 100.0),
    "largest in a\nmesh cycle [%]": cell("load_share_peak", 4, 100.0),
    "mesh with\nsun [N]": cell("sun_mesh_force_N"),
}
HELICAL_COLUMNS: Columns = {
    "axial, of\nsun [N]": cell("sun_axial_force_N"),
    "tilting\n[N m]": cell("tilting_moment_Nm"),
}


@dataclass(frozen=True, kw_only=True)
class PlanetLoadSharing(
    TrainStudy,
    Study,
    command="sharing",
    example="sharing planetary-24-36-96 --torque 60 --model 1 -o shares.csv",
):
    """Load sharing between the planets of a planetary set at rest.

    Share of the torque of the sun that each planet carries, with all centres fixed and,
    where gears or carrier have bearings, with those on their bearings. Planets lose
    contact where the others carry the load.
    """

    pictures = NO_PICTURES

    torque: tuple[float, ...] = torques_setting()
    model: LumpedModel = lumped_model(OFFERED_SETTINGS)
    table: tuple[str, ...] = tables_setting()

    @property
    def reason_for_model_1(self) -> str:
        differ = max(pair_periods(self.gear_set.loaded)) > 1
        return EQUAL_TEETH if differ else super().reason_for_model_1

    def prepare(self) -> SharingProblem:
        carrier_of(self.gear_set.loaded)
        if self.model.number == "coupled" and self.reason_for_model_1:
            raise self.rejection("number", f"{EQUAL_TEETH}, allowed are 1, 2 and 3")
        # edits of bearings are read, whatever the model says
        model = replace(self.model, translations=True)
        return SharingProblem.of(replace(self, model=model))


def carrier_of(gears: GearSet) -> PlanetCarrier:
    """The carrier; InputError where the gear set has no planets."""
    if gears.carrier is None:
        raise InputError(
            f"{gears.name} has no [[planetary]]; load sharing is that of its planets"
        )
    return gears.carrier


@dataclass(frozen=True)
class SharingCase:
    """Load sharing at a torque on the input [N m]; centers : FIXED_CENTERS or not."""

    torque: float
    centers: str
    sharing: LoadSharing


@dataclass(frozen=True, eq=False)
class SharingProblem(TrainProblem):
    """A planetary set at each torque, with centres fixed and on bearings."""

    study: PlanetLoadSharing

    @cached_property
    def torques(self) -> tuple[float, ...]:
        """Torques on the input [N m]; InputError for none."""
        torques = chosen_torques(self.gears, self.study.torque)
        if 0.0 in torques:
            raise InputError("torque = 0; load sharing needs at least 1e-6 N m")
        return torques

    @property
    def centers(self) -> tuple[str, ...]:
        """FIXED_CENTERS, and CENTERS_ON_BEARINGS where there are any."""
        gears, carrier = self.gears.gears, carrier_of(self.gears)
        movable = carrier.bearing_stiffness or any(g.bearing_stiffness for g in gears)
        return (FIXED_CENTERS, CENTERS_ON_BEARINGS) if movable else (FIXED_CENTERS,)

    @property
    def motions(self) -> float:
        return 0.0

    @property
    def set_ups(self) -> int:
        return len(self.torques) * len(self.centers)

    def tasks(self) -> Iterator[Task]:
        yield Task("sharing", self._solve_sharing)

    def _solve_sharing(self, job: Job) -> PlanetLoadSharingResult:
        source, cases, systems = self.model.excitations, [], {}
        cases_to_solve = [
            (torque, name) for torque in self.torques for name in self.centers
        ]
        for solved_cases, (torque, name) in enumerate(cases_to_solve):
            job.report("load sharing", solved_cases, len(cases_to_solve))
            system = self._system(torque, name, source)
            systems[torque] = system
            sharing = load_sharing(system.train, mesh_forces_at_rest(system))
            cases.append(SharingCase(torque, name, sharing))
        return PlanetLoadSharingResult(
            study=self.study,
            gears=self.gears,
            model=self.model,
            notes=self.notes,
            cases=tuple(cases),
            train_warnings=(*self.warnings_at_rest(systems, speeds=(0.0,)),),
        )

    def _system(
        self, torque: float, centers: str, source: ExcitationSource
    ) -> LumpedSystem:
        # modes and inertia of the bodies change nothing at rest
        without = ("body", "modes") if self.model.number == "coupled" else ()
        translations = centers == CENTERS_ON_BEARINGS
        model = replace(self.model, translations=translations, without=without)
        return lumped_system(self.gears, torque, model, source)


@dataclass(frozen=True, eq=False)
class PlanetLoadSharingResult(StudyResult):
    """Load sharing at each torque, with centres fixed and on bearings."""

    study: PlanetLoadSharing
    gears: GearSet
    model: LumpedModel
    notes: tuple[str, ...]
    cases: tuple[SharingCase, ...]
    train_warnings: tuple[str, ...]

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            "gear_set": self.gears.name,
            "model": self.model.name,
            "excitation": self.model.excitation.header_of(self.gears)["excitation"],
            "cases": [self._case_entry(case) for case in self.cases],
            "warnings": [*self.train_warnings, *self._lost_contact()],
        }

    def _case_entry(self, case: SharingCase) -> dict[str, Any]:
        shares = case.sharing.share
        return {
            "torque_Nm": case.torque,
            "centers": case.centers,
            "mesh_load_factor": shares.size * float(shares.max()),
            "planets": planet_rows(case.sharing, self.gears),
        }

    @property
    def _planet_table_rows(self) -> list[dict[str, Any]]:
        """A row for each planet of each case."""
        return [
            {"torque_Nm": case["torque_Nm"], "centers": case["centers"], **planet}
            for case in self.summary["cases"]
            for planet in case["planets"]
        ]

    def _lost_contact(self) -> Iterator[str]:
        """A line for each case with planets that carry nothing."""
        for case in self.cases:
            numbers = np.flatnonzero(case.sharing.share < MIN_SHARE) + 1
            if numbers.size:
                listed = " and ".join(map(str, numbers.tolist()))
                yield with_code(
                    "W39",
                    f"{case.torque:g} N m, centres {case.centers}: no load on planet "
                    f"{listed} at rest, the others carry all of it",
                )

    @property
    def table(self) -> Table:
        """A row for every planet, at every torque and with either centres."""
        rows = self._planet_table_rows
        header = {
            "gear set": self.gears.name,
            "fegear version": package_version(),
            **self.model.excitation.header_of(self.gears),
            "model": self.model.name,
            **self.study.gear_set.entries,
        }
        return Table.of_rows(rows, header)

    def page(self) -> Page:
        values = self.summary
        yield from self.notes
        title = "{gear_set} at rest, model {model}, {excitation}".format_map(values)
        rows = self._planet_table_rows
        columns = COLUMNS | (HELICAL_COLUMNS if "tilting_moment_Nm" in rows[0] else {})
        yield RowTable(rows, columns, title, ("centres",))
        for case in values["cases"]:
            yield (
                f"{case['torque_Nm']:g} N m, centres {case['centers']}: largest share "
                f"{case['mesh_load_factor']:.4g} times that of equal planets"
            )


def planet_rows(sharing: LoadSharing, gears: GearSet) -> list[dict[str, Any]]:
    """Position error, shares and forces of each planet, as in the table."""
    carrier = carrier_of(gears)
    errors = carrier.position_errors or (0.0,) * len(carrier.planets)
    rows = []
    for number, error in enumerate(errors):
        forces = float(sharing.sun_force[number]), float(sharing.ring_force[number])
        row = {
            "planet": number + 1,
            "position_error_um": 1e6 * error,
            "load_share": float(sharing.share[number]),
            "load_share_peak": float(sharing.share_peak[number]),
            "sun_mesh_force_N": forces[0],
            "ring_mesh_force_N": forces[1],
        }
        rows.append(row | _axial_figures(gears, carrier.planets[number], forces))
    return rows


def _axial_figures(
    gears: GearSet, planet: int, forces: tuple[float, float]
) -> dict[str, float]:
    """Axial forces on a planet and the moment that they make; none of spur gears.

    forces : along the lines of action of its meshes with sun and ring [N]
    """
    meshes = sorted(gears.meshes_of[planet], key=lambda n: gears.meshes[n].pair.sign)
    on_planet, moment = [], 0.0
    for number, force in zip(reversed(meshes), forces, strict=True):
        mesh = gears.meshes[number]
        torque, drives = force * mesh.pair.driver_arm, mesh.driver == planet
        axial = axial_force_on_driver(gears, number, torque) * (1 if drives else -1)
        radius = gears.gears[planet].geometry.base_radius
        radius /= math.cos(mesh.pair.operating_pressure_angle)
        moment += axial * radius * mesh.pair.sign
        on_planet.append(axial)
    if not gears.meshes[meshes[0]].is_helical:
        return {}
    sun, ring = on_planet
    return {
        "sun_axial_force_N": sun,
        "ring_axial_force_N": ring,
        "tilting_moment_Nm": moment,
    }
