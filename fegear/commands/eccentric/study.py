"""An eccentric circular wheel and the wheel that it drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fegear.commands.eccentric.elastic_wheel import ElasticWheel
from fegear.commands.eccentric.gearing import Gearing
from fegear.commands.eccentric.gearing_files import DRAWINGS, MESHES
from fegear.commands.eccentric.result import EccentricResult
from fegear.commands.eccentric.turn import STEEL, Columns, contact_columns, wheel_meshes
from fegear.figures.film import FILMS
from fegear.files.errors import InputError
from fegear.files.output import TABLE_FORMATS, TO_SINGLE_TABLE, TO_TABLE
from fegear.gearset.torque_limits import TORQUE
from fegear.statics.choices import RESOLUTION
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.settings import display_name, setting
from fegear.studies.study import Study
from lumped.common.options import Range

LENGTH = Range(least=1e-3, most=1e6, unit="mm")
WIDTH = 10.0  # mm
BLOCK = 8  # positions that are solved and kept together
POSITIONS = 8  # for each tooth by default
CONTACT = {"contact": f"Write the contact over the turn {TO_SINGLE_TABLE}."}
FILM = {"animate": ("Film of a turn of the driven wheel, .gif or .mp4.", FILMS)}


@dataclass(frozen=True, kw_only=True)
class Eccentric(
    Study,
    command="eccentric",
    example="eccentric --radius 20 --eccentricity 6 --teeth 40 -o wheels.svg",
):
    """An eccentric circular wheel, and the wheel that it drives.

    The pitch curve and centre distance follow from rolling, and the base curve, which
    determines whether involute teeth are possible, from the pressure angle. With teeth
    both wheels are drawn and meshed, and under a torque their contact is solved over a
    turn.
    """

    resumes = True
    partial = True
    unit = "block"
    checkpoint_beside = "contact"
    output = (
        f"Write the points of the curves {TO_TABLE}, drawings to scale to .svg or .dxf "
        "[mm], meshes to .msh or .vtu [m]."
    )
    endings = (*TABLE_FORMATS, *DRAWINGS, *MESHES)
    more_tables = CONTACT
    more_files = FILM

    radius: float = setting(
        MISSING, "Radius of the driver's pitch circle [mm].", LENGTH
    )
    eccentricity: float = setting(
        MISSING,
        "Distance of the driver's bearing from its centre [mm].",
        Range(0.0, 1e6, "mm"),
    )
    ratio: float = setting(
        1.0,
        "Gear ratio, turns of the driver for one of the driven wheel: a whole number.",
    )
    pressure_angle: float = setting(20.0, "Angle of the line of action [degrees].")
    teeth: int | None = setting(
        None,
        "Number of teeth of the driver. [default: none, pitch and base curves only]",
    )
    addendum: float | None = setting(
        None, "Addendum of the teeth [modules]. [default: 1]"
    )
    dedendum: float | None = setting(
        None, "Dedendum of the teeth [modules]. [default: 1.25]"
    )
    torque: float | None = setting(
        None,
        "Torque on the driver [N\u00a0m], for the contact of steel wheels over a turn "
        "of the driven wheel. [default: none]",
        TORQUE,
    )
    face_width: float | None = setting(
        None, "Width of both wheels [mm]. [default: 10]", LENGTH
    )
    positions: int | None = setting(
        None,
        "Number of positions in a turn of the driven wheel. [default: 8 for each "
        "of its teeth]",
        Range(1, 100_000),
    )
    bore: float | None = setting(
        None,
        "Radius of both bores [mm], for meshes and contact. [default: two fifths "
        "of the largest possible]",
        LENGTH,
    )
    resolution: Literal["coarse", "default", "fine"] | None = setting(
        None, f"{RESOLUTION} [default: default]"
    )

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        if self.teeth is None:
            yield from ((name, "needs {teeth}") for name in ("addendum", "dedendum"))
        if self.torque is not None:
            return
        for name in ("face_width", "positions", "contact"):
            yield name, "needs {torque}"
        if Path(outputs.get("output", "")).suffix not in MESHES:
            for name in ("bore", "resolution"):
                yield name, "needs {torque} or an {output} in .msh or .vtu"

    @property
    def gearing(self) -> Gearing:
        """What the wheels are; InputError where there are no such wheels."""
        options = {"addendum": self.addendum, "dedendum": self.dedendum}
        heights = {name: value for name, value in options.items() if value is not None}
        place = self.radius, self.eccentricity, self.ratio
        return Gearing(*place, self.pressure_angle, self.teeth, **heights)

    @property
    def width(self) -> float:
        """Width of both wheels [mm]."""
        return self.face_width or WIDTH

    @property
    def meshing(self) -> tuple[float | None, str]:
        """Bore [mm] and resolution of both wheels' meshes."""
        return self.bore, self.resolution or "default"

    def prepare(self) -> EccentricProblem:
        return EccentricProblem(self, self.gearing)


@dataclass(frozen=True, eq=False)
class EccentricProblem(Problem):
    """Eccentric wheels, and the positions of their contact."""

    study: Eccentric
    gearing: Gearing

    def tasks(self) -> Iterator[Task]:
        study, toothed = self.study, self.gearing.toothed
        if study.torque is None:
            return
        if toothed is None:
            torque, teeth = display_name(study, "torque"), display_name(study, "teeth")
            raise InputError(
                f"{torque} needs {teeth}: pitch curves alone carry no load"
            )
        meshes = wheel_meshes(self.gearing, *study.meshing)
        driver, driven = (ElasticWheel(mesh, STEEL) for mesh in meshes)
        for wheel in (driver, driven):  # before threads use them
            _ = wheel.factor, wheel.boundary
        count = study.positions or POSITIONS * toothed.driven.teeth
        arcs = toothed.driven.curve.length * np.arange(count) / count
        load = study.torque / (1e-3 * study.width)
        for place, block in enumerate(np.split(arcs, np.arange(BLOCK, count, BLOCK))):
            work = partial(contact_columns, toothed, driver, driven, load, block)
            yield Task(f"{place}", partial(_compute_block, work), size=1)

    def gather(self, results: Mapping[str, Columns | None]) -> EccentricResult:
        blocks: list[Columns] = []
        for block in results.values():
            if block is None:  # after Ctrl-C; positions from the first on are kept
                break
            blocks.append(block)
        columns = {
            name: np.array([v for block in blocks for v in block[name]], float)
            for name in (blocks[0] if blocks else ())
        }
        complete = len(blocks) == len(results)
        return EccentricResult(self.study, self.gearing, columns, complete)


def _compute_block(work: Callable[[], Columns], job: Job) -> Columns:
    """Compute positions, or read them from the checkpoint."""
    for columns in job.records:
        return columns
    columns = work()
    job.add_record(columns, {})
    return columns
