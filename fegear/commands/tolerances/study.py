"""Scatter of mesh stiffness and transmission error of gears within their tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from fegear.boundary import mesh_index
from fegear.commands.tolerances.bands import (
    SolvedSamples,
    ToleranceBands,
    contact_ratio,
    tolerance_bands,
)
from fegear.commands.tolerances.deviations import (
    CENTER,
    HELIX,
    Distribution,
    ToleranceProblem,
    sources_of,
)
from fegear.commands.tolerances.grades import tolerances_of_pair
from fegear.commands.tolerances.result import TolerancesResult
from fegear.files.errors import InputError
from fegear.gearset.leads import require_one_helix
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.gearset.plausibility import gear_set_warnings
from fegear.statics.contact_problem import require_solvable
from fegear.statics.machine import loaded_problem
from fegear.statics.plausibility import tip_warnings
from fegear.statics.settings import StaticsSettings
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.settings import (
    SettingsGroup,
    expose,
    group,
    refusal,
    setting,
)
from fegear.studies.study import PLOT, Study
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torque
from fegear.studies.trains.shafts import require_shafts_used
from lumped.common.array_types import Array
from lumped.common.options import Range
from lumped.common.units import UM
from meshes import GearPair
from meshes.gear import apart_from, floored

BLOCK, WIDTH_BLOCK = 250, 10  # pairs of gears of a task
SAMPLES, WIDTH_SAMPLES = 10_000, 200  # by default
OF_WIDTH = "helix_slope", "helix_form", "axes_in_plane", "axes_out_of_plane"
GRADES = Range(1, 11)
AMOUNT_RANGE = Range(0.0, 1e4, "um")
ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose("positions", "plane", "resolution", "corner_contact", "shafts"),
)
TABLE_HELP = {
    "samples_table": "Write the deviations of every pair of gears, and what follows "
    "from them, to this CSV file.",
    "cycle": "Write the band of the transmission error at each position to this CSV "
    "file.",
}


def _tolerance(text: str, gears: str = "both gears") -> Any:
    default = f"that of the grade of {gears}" if gears else "js7 of ISO 286"
    return setting(None, f"{text} [um]. [default: {default}]", AMOUNT_RANGE)


@dataclass(frozen=True, kw_only=True)
class Tolerances(
    Study,
    command="tolerances",
    example="tolerances best.toml --grade 6 -o bands.csv --plot bands.png",
):
    """Scatter of stiffness and transmission error by tolerances.

    Pairs of gears deviate at random within the tolerances of their grade by ISO
    1328-1:2013: profile slope and profile form, single pitch, and centre distance. Of
    gears whose loads vary over the face width, helix slope and form and the axes
    deviate as well. Their contact over one mesh cycle is solved for each, and predicted
    to first order from its slopes at the nominal pair. Pitch errors of the gear set are
    replaced; reliefs, profiles and leads stay.
    """

    pictures = PLOT
    more_tables = TABLE_HELP
    resumes = True
    unit = "block"
    partial = True

    gear_set: GearSetRef = DEFAULT_PAIR
    mesh: int = mesh_setting()
    torque: float | None = setting(
        None,
        "Torque on the driving gear of the mesh [N\u00a0m]. [default: middle load case "
        "of the gear set]",
    )
    grade: int = setting(6, "Tolerance grade of both gears by ISO 1328-1.", GRADES)
    driver_grade: int | None = setting(
        None, "Tolerance grade of the driver. [default: that of both gears]", GRADES
    )
    driven_grade: int | None = setting(
        None,
        "Tolerance grade of the driven gear. [default: that of both gears]",
        GRADES,
    )
    single_pitch_um: float | None = _tolerance("Tolerance of single pitches")
    profile_slope_um: float | None = _tolerance("Tolerance of profile slopes")
    profile_form_um: float | None = _tolerance("Tolerance of profile forms")
    helix_slope_um: float | None = _tolerance("Tolerance of helix slopes")
    helix_form_um: float | None = _tolerance("Tolerance of helix forms")
    axes_in_plane_um: float | None = _tolerance(
        "Largest deviation of the axes in their plane, over the common face width",
        "both gears by ISO/TR 10064-3",
    )
    axes_out_of_plane_um: float | None = _tolerance(
        "Largest deviation of the axes out of their plane, over the common face width",
        "both gears by ISO/TR 10064-3",
    )
    center_distance_um: float | None = _tolerance(
        "Largest deviation of the centre distance to either side", ""
    )
    distribution: Distribution = setting(
        "normal",
        "Distribution of deviations within the tolerance. normal: with a third of the "
        "tolerance as standard deviation, cut off at it; uniform: all equally likely.",
    )
    samples: int | None = setting(
        None,
        f"Number of pairs of gears that are solved. [default: {SAMPLES}, or "
        f"{WIDTH_SAMPLES} where loads vary over the face width]",
        Range(10, 100_000),
    )
    seed: int = setting(1, "Seed of the random deviations.", Range(0, 2**32))
    elements: StaticsSettings = group(ELEMENTS)

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        if self.driver_grade is not None and self.driven_grade is not None:
            yield "grade", "{driver_grade} and {driven_grade} take its place"

    def prepare(self) -> TolerancesProblem:
        gears = self.gear_set.healthy("tolerances")
        require_shafts_used(self.elements, gears, self.mesh, ELEMENTS)
        gears = self.elements.on_shafts(gears)
        index = mesh_index(gears, self.mesh)
        torque = chosen_torque(gears, self.torque, self.mesh)
        limits = self._limits(gears, index)  # before finite elements take a minute
        nominal = without_pitch_errors(gears)
        contact = loaded_problem(nominal, index, self.elements, torque)
        positions = self.elements.positions
        problem = ToleranceProblem(
            contact=contact,
            torque=torque,
            position=np.arange(positions) / positions,
            limits=limits,
            distribution=self.distribution,
        )
        warnings = (*gear_set_warnings(gears),)
        return TolerancesProblem(self, gears.name, problem, warnings)

    def _limits(self, gears: GearSet, index: int) -> dict[str, float]:
        """Tolerances [m] by source."""
        require_one_helix(gears, "tolerances")
        require_solvable(gears, index, self.elements)
        mesh = gears.meshes[index]
        names = ["single_pitch", "profile_slope", "profile_form", *OF_WIDTH, CENTER]
        amounts = {name: getattr(self, f"{name}_um") for name in names}
        if not mesh.varies_over_width:
            for name in OF_WIDTH:
                if amounts.pop(name) is not None:
                    raise refusal(
                        self,
                        f"{name}_um",
                        "needs loads that vary over the face width, of gears that are "
                        "helical, crowned or misaligned",
                    )
        grades = self.driver_grade or self.grade, self.driven_grade or self.grade
        one, other = (gears.gears[gear].face_width for gear in mesh.gears)
        widths = (one, other) if mesh.varies_over_width else None
        every = tolerances_of_pair(mesh.pair, grades, amounts, widths)
        sources = sources_of(mesh.varies_over_width)
        limits = {source: every[source] for source in sources}
        if not any(limits.values()):
            raise InputError("all tolerances are 0; one or more must be above 0")
        _require_mesh(mesh.pair, limits)
        return limits


def _require_mesh(pair: GearPair, limits: Mapping[str, float]) -> None:
    """Require gears that still mesh at the limits of their deviations."""
    half_module = 0.5 * pair.driver.module
    half = floored(half_module / UM)
    for source, limit in limits.items():
        if limit > half_module:
            raise InputError(
                f"{source} = {apart_from(limit / UM, half)} um; must be at most half "
                "the module, "
                f"{half} um"
            )
    bases = abs(pair.driver.base_radius + pair.driven.base_radius)
    if not pair.center_distance - limits[CENTER] > bases:
        raise InputError(f"{CENTER} = {limits[CENTER] / UM:.6g} um; the gears overlap")
    least = min(contact_ratio(pair, sign * limits[CENTER]) for sign in (-1, 1))
    if not least >= 1.0:
        raise InputError(
            f"{CENTER} = {limits[CENTER] / UM:.6g} um; the contact ratio falls to "
            f"{floored(least)}, at least 1 is needed"
        )


@dataclass(frozen=True, eq=False)
class TolerancesProblem(Problem):
    """Pairs of gears in blocks, and their first order."""

    study: Tolerances
    gear_set: str
    problem: ToleranceProblem
    gear_warnings: tuple[str, ...]

    @cached_property
    def _blocks(self) -> list[Array]:
        """Deviations of all pairs of gears in blocks."""
        study, over_width = self.study, HELIX[0] in self.problem.sources
        samples = study.samples or (WIDTH_SAMPLES if over_width else SAMPLES)
        deviations = self.problem.sample(samples, study.seed)
        size = WIDTH_BLOCK if over_width else BLOCK
        return np.split(deviations, np.arange(size, len(deviations), size))

    def tasks(self) -> Iterator[Task]:
        for i, block in enumerate(self._blocks):
            work = partial(self._solve_block, block)
            yield Task(f"{i}", work, size=len(block), n_records=1)

    def _solve_block(self, deviations: Array, job: Job) -> Mapping[str, Array]:
        if job.records and job.state is not None:
            return job.state

        def report(done: int) -> None:
            job.report("pairs of gears", done, len(deviations))

        contact = self.problem.solve(deviations, report)
        arrays = {
            **self.problem.quantities(
                contact.ste, contact.no_load, contact.distribution
            ),
            "ste": contact.ste,
            "lost_contact": self.problem.lost_contact(contact).astype(float),
        }
        job.add_record({}, arrays)
        return arrays

    def gather(
        self, results: Mapping[str, Mapping[str, Array] | None]
    ) -> TolerancesResult | None:
        study, problem = self.study, self.problem
        finished = {key: value for key, value in results.items() if value is not None}
        if not finished:
            return None
        blocks = self._blocks
        columns = {
            name: np.concatenate([block[name] for block in finished.values()])
            for name in next(iter(finished.values()))
        }
        solved = SolvedSamples(
            deviations=np.concatenate([blocks[int(key)] for key in finished]),
            values={name: columns[name] for name in problem.names},
            ste=columns["ste"],
            lost_contact=columns["lost_contact"] > 0.0,
        )
        bands = tolerance_bands(problem, solved, study.seed)
        return TolerancesResult(
            study=study,
            gear_set=self.gear_set,
            torque=problem.torque,
            bands=bands,
            complete=len(finished) == len(results),
            gear_warnings=(*self.gear_warnings, *self._tip_lines(bands)),
        )

    def _tip_lines(self, bands: ToleranceBands) -> Iterator[str]:
        """Warnings of nominal tips that meet the edge of an undercut."""
        pair, largest = self.problem.contact.pair, float(bands.linear.ste.max())
        yield from tip_warnings(self.study.mesh, self.problem.torque, pair, largest)
