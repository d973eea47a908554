"""Campbell diagram of spinning shafts with their gears, and their critical speeds."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fegear.commands.campbell.rotors import rotor_system
from fegear.files.codes import with_code
from fegear.files.output import TO_TABLE
from fegear.gearset.model import GearSet
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.speeds import SECONDS_PER_MINUTE
from fegear.statics.excitation import StiffnessSource
from fegear.studies.page import Columns, Page, RowTable, cell, number
from fegear.studies.problem import Job, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import group, setting
from fegear.studies.study import PLOT, Study
from fegear.studies.table import Table, finite_or_none
from fegear.studies.trains.gear_sets import GearSetRef
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.mean_stiffness import (
    FE_SETTINGS,
    mean_stiffnesses,
    stiffness_load,
)
from lumped.common.array_types import Array
from lumped.common.options import Range
from lumped.figures.campbell import CampbellCurves, OrderLine, draw_campbell
from lumped.rotors.campbell import Campbell, campbell, unstable_ranges
from lumped.rotors.critical import CriticalSpeed, critical_speeds
from lumped.rotors.description import RotorSystem
from lumped.rotors.matrices import assemble
from lumped.rotors.whirl import Instability, WhirlProblem, mode_kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RPM = 2.0 * math.pi / SECONDS_PER_MINUTE  # rad/s
DEFAULT_MODE = 4  # at rest, whose frequency the fastest shaft reaches by default
CRITICAL_TABLE = MappingProxyType(
    {"critical": f"Write the critical speeds {TO_TABLE}."}
)
MAX_SHOWN = 24  # critical speeds on the screen
GEAR_BEARING = re.compile(r"^(gear\..*|defaults)\.bearing_k[xy]_N_per_m$")


@dataclass(frozen=True, kw_only=True)
class CampbellDiagram(Study, command="campbell", example="campbell turbo-pair"):
    """Campbell diagram and critical speeds of spinning shafts.

    Gears are rigid bodies with two translations, two tilts and a rotation, on shafts
    of Euler-Bernoulli elements, bearings and mean mesh stiffnesses, all of which the
    [[shaft]] tables of the gear set describe. All shafts rotate at the speeds that
    their teeth impose.
    """

    pictures = PLOT
    more_tables = CRITICAL_TABLE

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
    torque: float | None = torque_setting()
    stiffness: Literal["given", "fe"] = setting(
        "given",
        "Mean mesh stiffness. given: mean_stiffness_N_per_m of the gear set, or "
        "finite elements where it is missing; fe: by finite elements at the torque.",
    )
    source: StiffnessSource = group(FE_SETTINGS)

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in self.gear_set.overrides:
            if GEAR_BEARING.match(key):
                raise self.gear_set.rejection(
                    key, "changes nothing here; bearings are those of [[shaft]]"
                )

    def tasks(self) -> Iterator[Task]:
        gears = self.gear_set.loaded
        load = stiffness_load(self, gears)
        yield Task("diagram", partial(self._solve, gears, load))

    def _solve(self, gears: GearSet, load: float | None, job: Job) -> CampbellResult:
        rotor_system(gears, [1.0] * len(gears.meshes), self.elements)  # refused early
        use_given = self.stiffness == "given"
        meshes = mean_stiffnesses(gears, load or 0.0, self.source, use_given)
        system = rotor_system(gears, [k for k, _ in meshes], self.elements)
        problem = WhirlProblem(assemble(system))
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
            _curves(diagram, rpm),
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
            tuple(gear_set_warnings(gears)),
        )


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


def _curves(diagram: Campbell, rpm: Array) -> CampbellCurves:
    return CampbellCurves(
        rpm=rpm,
        frequency_Hz=diagram.frequency_Hz,
        damping_ratio=diagram.damping_ratio + 0.0,
        whirl=diagram.whirl,
        torsion=diagram.torsion,
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
        kind=mode_kind(speed.whirl, speed.torsion),
        shaft=system.rotors[speed.rotor].name,
        whirl=speed.whirl,
        damping_ratio=speed.damping_ratio + 0.0,
        mesh_energy_fraction=speed.mesh_energy,
    )


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


@dataclass(frozen=True, eq=False, repr=False)
class CampbellResult(StudyResult):
    """Campbell diagram of a gear set.

    torque : on the input gear [N m], None where nothing depends on it
    discretisation : largest relative change of a frequency with twice the elements
    """

    study: CampbellDiagram
    gear_set: str
    torque: float | None
    mean_stiffness: tuple[MeanStiffness, ...]
    shafts: tuple[SpinningShaft, ...]
    curves: CampbellCurves
    orders: tuple[OrderLine, ...]
    critical: tuple[CriticalEntry, ...]
    unstable: tuple[UnstableSpeeds, ...]
    discretisation: float
    gear_warnings: tuple[str, ...] = ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        curves = self.curves
        return {
            "gear_set": self.gear_set,
            "torque_Nm": self.torque,
            "max_rpm": float(curves.rpm[-1]),
            "speeds": int(curves.rpm.size),
            "shafts": list(map(asdict, self.shafts)),
            "mean_stiffness": list(map(asdict, self.mean_stiffness)),
            "modes": [
                {
                    "at_rest_Hz": finite_or_none(float(curves.frequency_Hz[0, mode])),
                    "at_max_rpm_Hz": finite_or_none(
                        float(curves.frequency_Hz[-1, mode])
                    ),
                    "kind": curves.kind(mode),
                    "mesh_energy_fraction": float(curves.mesh_energy[0, mode]),
                }
                for mode in range(curves.count)
            ],
            "critical_speeds": list(map(asdict, self.critical)),
            "instabilities": list(map(asdict, self.unstable)),
            "discretisation_error": finite_or_none(self.discretisation),
            "warnings": [*self.gear_warnings, *self._instability_warnings()],
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
                ),
            )

    @property
    def _header(self) -> dict[str, str]:
        meshes = {f"mesh {one.mesh}": one.origin for one in self.mean_stiffness}
        shafts = {
            f"shaft {number}": f"{shaft.gears}, {shaft.speed_ratio:.12g} of the speed"
            for number, shaft in enumerate(self.shafts, start=1)
        }
        entries = self.study.gear_set.entries
        return {"gear set": self.gear_set, **meshes, **shafts, **entries}

    @property
    def table(self) -> Table:
        """A row for every speed and mode."""
        names = (
            *("driver_speed_rpm", "mode", "frequency_Hz", "damping_ratio", "kind"),
            *("whirl", "torsion_fraction", "mesh_energy_fraction"),
        )
        return Table(names, self._rows, self._header)

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        curves = self.curves
        for row, rpm in enumerate(curves.rpm.tolist()):
            for mode in range(curves.count):
                at = row, mode
                if not math.isfinite(curves.frequency_Hz[at]):
                    continue
                whirl, torsion = float(curves.whirl[at]), float(curves.torsion[at])
                yield (
                    rpm,
                    mode + 1,
                    float(curves.frequency_Hz[at]),
                    float(curves.damping_ratio[at]),
                    mode_kind(whirl, torsion),
                    whirl,
                    torsion,
                    float(curves.mesh_energy[at]),
                )

    @property
    def more_tables(self) -> dict[str, Table]:
        """A row for every critical speed."""
        names = tuple(CriticalEntry.__annotations__)
        rows = [tuple(asdict(entry).values()) for entry in self.critical]
        return {"critical": Table(names, lambda: rows, self._header)}

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": self._diagram}

    def _diagram(self) -> Figure:
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
        yield with_code(
            "E25",
            "frequencies change by at most "
            f"{number(100.0 * self.discretisation, 2)} % with twice the elements",
        )
        yield RowTable(values["modes"], MODE_COLUMNS, f"{self.gear_set}, modes")
        title = f"critical speeds to {number(values['max_rpm'], 4)} rpm"
        if len(self.critical) > MAX_SHOWN:
            title += f", the first {MAX_SHOWN} of {len(self.critical)}"
        if self.critical:
            shown = values["critical_speeds"][:MAX_SHOWN]
            yield RowTable(shown, CRITICAL_COLUMNS, title)
        else:
            yield f"no {title}"
        if not self.unstable:
            yield "no vibration grows at any of the speeds"


def _at_end(row: Any) -> str:
    value = row["at_max_rpm_Hz"]
    return "" if value is None else number(value, 5)


MODE_COLUMNS: Columns = {
    "at rest\n[Hz]": cell("at_rest_Hz", 5),
    "at highest\nspeed [Hz]": _at_end,
    "kind": lambda row: row["kind"],
    "energy in\nmeshes [%]": cell("mesh_energy_fraction", 3, 100.0),
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
