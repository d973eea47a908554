"""Campbell diagram of spinning shafts with their gears, and their critical speeds."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fegear.commands.campbell.response import (
    MachineResponse,
    machine_response,
)
from fegear.commands.campbell.result import (
    CampbellResult,
    CriticalEntry,
    MeanStiffness,
    SpinningShaft,
    UnstableSpeeds,
)
from fegear.files.output import INTO_PICTURE, TO_SINGLE_TABLE
from fegear.gearset.lumped_train import train_of
from fegear.gearset.model import GearSet
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import group, setting
from fegear.studies.study import PLOT, Study
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.mean_stiffness import (
    FE_SETTINGS,
    mean_stiffnesses,
    stiffness_load,
)
from fegear.train.rolling_bearings import (
    bearings_at_rest,
    has_rolling_bearings,
    linearised_entries,
)
from fegear.train.rotors import (
    Motion,
    has_axial_motion,
    rotor_system,
    whirl_problem,
)
from lumped.common.array_types import Array
from lumped.common.options import Range
from lumped.figures.campbell import CampbellCurves, OrderLine
from lumped.rotors.campbell import Campbell, campbell, unstable_ranges
from lumped.rotors.critical import CriticalSpeed, critical_speeds
from lumped.rotors.description import RotorSystem
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import WhirlProblem, mode_kind

if TYPE_CHECKING:
    from fegear.statics.load_variation import LoadVariation
    from fegear.statics.machine import MachineAtRest

RPM = 2.0 * math.pi / SECONDS_PER_MINUTE  # rad/s
ANY_STIFFNESS = 1e8  # N/m, of meshes in a machine that is only checked
DEFAULT_MODE = 4  # at rest, whose frequency the fastest shaft reaches by default
VIBRATION = "needs mesh stiffnesses by finite elements and motion in space"
TABLES = MappingProxyType(
    {
        "critical": f"Write the critical speeds {TO_SINGLE_TABLE}.",
        "bearing_forces": "Write RMS forces of all bearings over the speed, excited by "
        f"the meshes, {TO_SINGLE_TABLE}; {VIBRATION}.",
        "mesh_forces": "Write RMS forces between the teeth of all meshes over the "
        f"speed {TO_SINGLE_TABLE}; {VIBRATION}.",
        "housing": "Write RMS accelerations of all nodes of the [housing] over the "
        f"speed {TO_SINGLE_TABLE}; {VIBRATION}.",
    }
)
PICTURES = MappingProxyType(
    {
        "response": "Draw RMS forces of bearings and between teeth over the speed "
        f"{INTO_PICTURE}; {VIBRATION}."
    }
)
OF_VIBRATION = "bearing_forces", "mesh_forces", "housing", "response"
GEAR_BEARING = re.compile(r"^(gear\..*|defaults)\.bearing_k[xy]_N_per_m$")


@dataclass(frozen=True, kw_only=True)
class CampbellDiagram(Study, command="campbell", example="campbell turbo-pair"):
    """Campbell diagram and critical speeds of spinning shafts.

    Gears are rigid bodies with two translations, two tilts and a rotation, on shafts
    of Euler-Bernoulli elements, bearings and mean mesh stiffnesses, all of which the
    [[shaft]] tables of the gear set describe. Where bearings take the thrust of helical
    gears, shafts also move along their axes. All shafts rotate at the speeds that their
    teeth impose.
    """

    pictures = PLOT | PICTURES
    more_tables = TABLES

    gear_set: GearSetRef
    max_rpm: float | None = setting(
        None,
        "Highest speed of the first mesh's driver [rpm]. [default: where the fastest "
        "shaft turns at the fourth frequency at rest, two digits rounded up]",
        Range(least=1.0, below=1e7, unit="rpm"),
    )
    points: int = setting(
        61, "Number of speeds, evenly spaced from 0.", Range(least=2, most=2001)
    )
    modes: int = setting(12, "Number of modes that are followed.", Range(1, 60))
    elements: int = setting(
        12,
        "Number of elements of a shaft, at least; one ends at every part.",
        Range(2, 100),
    )
    motion: Motion | None = setting(
        None,
        "Motion of shafts. space: also along their axes, and helical gears have their "
        "helix; plane: neither. [default: space for helical gears on shafts with "
        "bearings that take thrust, bearing_kz_N_per_m, else plane]",
    )
    torque: float | None = torque_setting()
    stiffness: Literal["given", "fe"] = setting(
        "given",
        "Mean mesh stiffness. given: mean_stiffness_N_per_m of the gear set, or "
        "finite elements where it is missing; fe: by finite elements at the torque.",
    )
    excitation: ExcitationSettings = group(FE_SETTINGS)

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in self.gear_set.overrides:
            if GEAR_BEARING.match(key):
                raise self.gear_set.rejection(
                    key, "changes nothing here; bearings are those of [[shaft]]"
                )

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        for name in OF_VIBRATION:
            if name in outputs and not self._solves_vibration(self.gear_set.loaded):
                yield name, "needs {stiffness} fe, {motion} space and plane width"
        if "housing" in outputs and self.gear_set.loaded.housing is None:
            yield "housing", "needs a gear set with [housing]"

    @property
    def joins_housing(self) -> bool:
        return True

    def tasks(self) -> Iterator[Task]:
        gears = self.gear_set.loaded
        load = stiffness_load(self, gears, has_rolling_bearings(gears))
        yield Task("diagram", partial(self._solve, gears, load))

    def _solve(self, gears: GearSet, load: float | None, job: Job) -> CampbellResult:
        shafts = self.elements, self.motion
        rolling = bearings_at_rest(gears, load)
        stiffnesses = [ANY_STIFFNESS] * len(gears.meshes)
        # refused before teeth are solved
        whirl_problem(gears, rotor_system(gears, stiffnesses, *shafts, rolling=rolling))
        variations: list[LoadVariation] = []
        if self._solves_vibration(gears):
            from fegear.train.space import loaded_machine

            machine = loaded_machine(gears, load or 0.0, self.excitation, job.report)
            variations, meshes = _loaded_meshes(machine, job)
            rolling = bearings_at_rest(gears, load, machine.loads_on_gears)
        else:
            is_given = self.stiffness == "given"
            meshes = mean_stiffnesses(gears, load or 0.0, self.excitation, is_given)
        stiffness = [k for k, _ in meshes]
        matrices = [one.stiffness for one in variations]
        system = rotor_system(gears, stiffness, *shafts, matrices, rolling)
        problem = whirl_problem(gears, system)
        rpm = np.linspace(0.0, self.max_rpm or default_rpm(problem), self.points)
        speeds = (RPM * rpm).tolist()
        total = len(speeds)
        diagram = campbell(
            problem,
            speeds,
            self.modes,
            lambda done: job.report("Campbell diagram", done, total),
        )
        lines = order_lines(gears, system)
        return CampbellResult(
            self,
            gears.name,
            load,
            tuple(_stiffness_entry(m, *mesh) for m, mesh in enumerate(meshes, 1)),
            tuple(map(_shaft_entry, system.rotors)),
            _campbell_curves(diagram, rpm),
            lines,
            tuple(_critical_entries(problem, diagram, lines, system)),
            tuple(
                UnstableSpeeds(
                    kind=part.kind,
                    from_rpm=part.low / RPM,
                    to_rpm=part.high / RPM,
                    frequency_Hz=part.frequency / (2.0 * math.pi),
                )
                for part in unstable_ranges(problem, diagram)
            ),
            discretisation_error(system, diagram),
            "space" if system.axial_motion else "plane",
            any(mesh.is_helical for mesh in gears.meshes),
            tuple(motion_warnings(gears, system.axial_motion, joins_housing=True)),
            self._response(gears, system, problem, variations, rpm, job),
            linearised_entries(gears, rolling),
            bool(variations),
            None if gears.housing is None else gears.housing.stated,
        )

    def _solves_vibration(self, gears: GearSet) -> bool:
        """Whether teeth are solved whose gears move in space."""
        is_solid = self.excitation.statics.plane_of(gears) == "width"
        by_elements = self.stiffness == "fe" and is_solid
        return by_elements and has_axial_motion(gears, self.motion)

    def _response(
        self,
        gears: GearSet,
        system: RotorSystem,
        problem: WhirlProblem,
        variations: list[LoadVariation],
        rpm: Array,
        job: Job,
    ) -> MachineResponse | None:
        if not variations:
            return None
        ratio = train_of(gears, 0.0).damping_ratio
        place = gears, system, problem, variations, rpm, ratio
        return machine_response(
            *place, lambda done: job.report("vibration", done, rpm.size)
        )


def _loaded_meshes(
    machine: MachineAtRest, job: Job
) -> tuple[list[LoadVariation], list[tuple[float, str]]]:
    """Loads of all meshes over their cycles; mean stiffnesses and their origin."""
    from fegear.train.space import standing_meshes

    variations, meshes = [], []
    for one in standing_meshes(machine, job.report):
        variation = one.variation
        text = f"finite elements at {one.torque:g} N m on the driver, on shafts that"
        variations.append(variation)
        meshes.append((float(variation.stiffness[0, 0]), f"{text} yield"))
    return variations, meshes


def default_rpm(problem: WhirlProblem) -> float:
    """Speed of the system, in rpm, up to which a diagram goes by default."""
    frequencies = problem.solve(0.0, DEFAULT_MODE).frequency
    fastest = max(map(abs, problem.system.speed_ratios))
    rpm = float(frequencies[-1]) / fastest / RPM
    unit = 10.0 ** (math.floor(math.log10(rpm)) - 1)
    return math.ceil(rpm / unit) * unit


def order_lines(gears: GearSet, system: RotorSystem) -> tuple[OrderLine, ...]:
    """Frequencies that are proportional to the speed: rotations and meshes."""
    rotations = [
        OrderLine(f"rotation of {rotor.name}", abs(rotor.speed_ratio))
        for rotor in system.rotors
    ]
    teeth = [
        OrderLine(
            f"mesh {number}",
            mesh.teeth * abs(system.rotors[mesh.rotors[0]].speed_ratio),
        )
        for number, mesh in enumerate(system.meshes, start=1)
    ]
    return (*rotations, *teeth)


def discretisation_error(system: RotorSystem, diagram: Campbell) -> float:
    """Largest relative change of the frequencies followed with twice the elements.

    At the highest speed of a diagram.
    """
    coarse = np.sort(diagram.eigenvalues[-1].imag)
    coarse = coarse[np.isfinite(coarse)]
    finer = replace(system, elements=2 * system.elements)
    modes = WhirlProblem(assemble(finer)).solve(float(diagram.speeds[-1]))
    nearest = [np.abs(modes.frequency / value - 1.0).min() for value in coarse]
    return float(max(nearest, default=math.nan))


def _campbell_curves(diagram: Campbell, rpm: Array) -> CampbellCurves:
    return CampbellCurves(
        rpm=rpm,
        frequency_Hz=diagram.frequency_Hz,
        damping_ratio=diagram.damping_ratio + 0.0,
        whirl=diagram.whirl,
        torsion=diagram.torsion,
        axial=diagram.axial,
        housing=diagram.housing,
        mesh_energy=diagram.mesh_energy,
    )


def _stiffness_entry(mesh: int, stiffness: float, origin: str) -> MeanStiffness:
    return MeanStiffness(mesh=mesh, stiffness_N_per_m=stiffness, origin=origin)


def _shaft_entry(rotor: Any) -> SpinningShaft:
    return SpinningShaft(gears=rotor.name, speed_ratio=rotor.speed_ratio)


def _critical_entries(
    problem: WhirlProblem,
    diagram: Campbell,
    lines: Sequence[OrderLine],
    system: RotorSystem,
) -> Iterator[CriticalEntry]:
    """Critical speeds of all orders, of frequencies that the diagram has."""
    highest = float(np.nanmax(diagram.eigenvalues.imag))
    for line in lines:
        for speed in critical_speeds(problem, diagram, line.order):
            if speed.frequency <= highest:
                yield _critical_entry(speed, line, system)


def _critical_entry(
    speed: CriticalSpeed, line: OrderLine, system: RotorSystem
) -> CriticalEntry:
    return CriticalEntry(
        excitation=line.name,
        order=line.order,
        driver_speed_rpm=speed.speed / RPM,
        frequency_Hz=speed.frequency / (2.0 * math.pi),
        kind=mode_kind(speed.whirl, speed.torsion, speed.axial, speed.housing),
        shaft=system.rotors[speed.rotor].name,
        whirl=speed.whirl,
        damping_ratio=speed.damping_ratio + 0.0,
        mesh_energy_fraction=speed.mesh_energy,
    )
