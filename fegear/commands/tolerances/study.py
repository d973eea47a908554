"""Scatter of mesh stiffness and transmission error of gears within their tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from math import sqrt
from typing import Any

import numpy as np

from fegear.commands.tolerances.bands import (
    QUANTILE_STDERR,
    SolvedSamples,
    ToleranceBands,
    contact_ratio,
    tolerance_bands,
)
from fegear.commands.tolerances.deviations import (
    CENTER,
    LIMIT_OVER_STD,
    MEAN_STIFFNESS,
    PEAK_TO_PEAK,
    QUANTITIES,
    SOURCES,
    Distribution,
    ToleranceProblem,
)
from fegear.commands.tolerances.figure import draw_tolerances
from fegear.commands.tolerances.grades import (
    UM,
    tolerances_of_pair,
)
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.gearset.plausibility import gear_set_warnings
from fegear.statics.plausibility import tip_warnings
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import contact_problem
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.problem import Job, Problem, Task
from fegear.studies.result import Draw, StudyResult
from fegear.studies.settings import SettingsGroup, expose, group, setting
from fegear.studies.study import PLOT, Study
from fegear.studies.table import Table
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_index,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torque
from lumped.common.array_types import Array
from lumped.common.options import Range
from meshes import GearPair

BLOCK = 250  # pairs of gears of a task
MAX_BAND_ERROR = 0.1  # of the first order, above which a warning follows
GRADES = Range(1, 11)
AMOUNT = Range(0.0, 1e4, "um")
ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose("positions", "plane", "resolution", "corner_contact"),
)
MORE = {
    "samples_table": "Write the deviations of every pair of gears, and what follows "
    "from them, to this CSV file.",
    "cycle": "Write the band of the transmission error at each position to this CSV "
    "file.",
}
SCALES = {  # and names on the screen
    MEAN_STIFFNESS: (1e-8, "mean k [1e8 N/m]"),
    PEAK_TO_PEAK: (1e6, "STE p-p [um]"),
}
BAND: Columns = {
    "quantity": lambda row: SCALES[row["quantity"]][1],
    "nominal": lambda row: _scaled(row, "nominal"),
    "5 %": lambda row: _scaled(row, "p05"),
    "50 %": lambda row: _scaled(row, "p50"),
    "95 %": lambda row: _scaled(row, "p95"),
}
SOURCE: Columns = {
    "tolerance": lambda row: row["source"].replace("_", " "),
    "limit\n+- um": cell("limit_um", 3),
    "part of variance\n[%]": cell("share_of_ste_peak_to_peak", 3, 100.0),
    "95 % value\nwithout it [%]": lambda row: row["without"],
}


def _scaled(row: Mapping[str, Any], key: str) -> str:
    return f"{SCALES[row['quantity']][0] * row[key]:.4g}"


def _percent(value: float, of: float) -> str:
    """Change of a value [%], with its sign."""
    return f"{100.0 * (value / of - 1.0):+.1f}"


def _tolerance(text: str, gears: str = "both gears") -> Any:
    default = f"that of the grade of {gears}" if gears else "js7 of ISO 286"
    return setting(None, f"{text} [um]. [default: {default}]", AMOUNT)


@dataclass(frozen=True, kw_only=True)
class Tolerances(
    Study,
    command="tolerances",
    example="tolerances best.toml --grade 6 -o bands.csv --plot bands.png",
):
    """Scatter of stiffness and transmission error by tolerances.

    Pairs of gears deviate at random within the tolerances of their grade by ISO
    1328-1:2013: profile slope and profile form, single pitch, and centre distance.
    Their contact over one mesh cycle is solved for each, and predicted to first order
    from its slopes at the nominal pair. Pitch errors of the gear set are replaced;
    reliefs and profiles stay.
    """

    pictures = PLOT
    more_tables = MORE
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
    center_distance_um: float | None = _tolerance(
        "Largest deviation of the centre distance to either side", ""
    )
    distribution: Distribution = setting(
        "normal",
        "Distribution of deviations within the tolerance. normal: with a third of the "
        "tolerance as standard deviation, cut off at it; uniform: all equally likely.",
    )
    samples: int = setting(
        10_000, "Number of pairs of gears that are solved.", Range(10, 100_000)
    )
    seed: int = setting(1, "Seed of the random deviations.", Range(0, 2**32))
    elements: StaticsSettings = group(ELEMENTS)

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        if self.driver_grade is not None and self.driven_grade is not None:
            yield "grade", "{driver_grade} and {driven_grade} take its place"

    def prepare(self) -> TolerancesProblem:
        gears = self.gear_set.healthy("tolerances")
        index = mesh_index(gears, self.mesh)
        torque = chosen_torque(gears, self.torque, self.mesh)
        contact = contact_problem(without_pitch_errors(gears), index, self.elements)
        positions = self.elements.positions
        problem = ToleranceProblem(
            contact=contact,
            torque=torque,
            position=np.arange(positions) / positions,
            limits=self._limits(gears, index),
            distribution=self.distribution,
        )
        warnings = (*gear_set_warnings(gears),)
        return TolerancesProblem(self, gears.name, problem, warnings)

    def _limits(self, gears: GearSet, index: int) -> dict[str, float]:
        """Tolerances [m] by source."""
        pair = gears.meshes[index].pair
        names = "single_pitch", "profile_slope", "profile_form", CENTER
        amounts = {name: getattr(self, f"{name}_um") for name in names}
        grades = self.driver_grade or self.grade, self.driven_grade or self.grade
        limits = tolerances_of_pair(pair, grades, amounts)
        if not any(limits.values()):
            raise InputError("all tolerances are 0; one or more must be above 0")
        _require_mesh(pair, limits)
        return {source: limits[source] for source in SOURCES}


def _require_mesh(pair: GearPair, limits: Mapping[str, float]) -> None:
    """Require gears that still mesh at the limits of their deviations."""
    half_module = 0.5 * pair.driver.module
    for source, limit in limits.items():
        if limit > half_module:
            raise InputError(
                f"{source} = {limit / UM:.6g} um; must be at most half the module, "
                f"{half_module / UM:.6g} um"
            )
    bases = abs(pair.driver.base_radius + pair.driven.base_radius)
    if not pair.center_distance - limits[CENTER] > bases:
        raise InputError(f"{CENTER} = {limits[CENTER] / UM:.6g} um; the gears overlap")
    least = min(contact_ratio(pair, sign * limits[CENTER]) for sign in (-1, 1))
    if not least >= 1.0:
        raise InputError(
            f"{CENTER} = {limits[CENTER] / UM:.6g} um; the contact ratio falls to "
            f"{least:.4g}, at least 1 is needed"
        )


@dataclass(frozen=True, eq=False)
class TolerancesProblem(Problem):
    """Pairs of gears in blocks, and their first order."""

    study: Tolerances
    gear_set: str
    problem: ToleranceProblem
    gear_warnings: tuple[str, ...]

    def tasks(self) -> Iterator[Task]:
        study = self.study
        deviations = self.problem.sample(study.samples, study.seed)
        for i, block in enumerate(_blocks(deviations)):
            work = partial(self._solved, block)
            yield Task(f"{i}", work, size=len(block), n_records=1)

    def _solved(self, deviations: Array, job: Job) -> Mapping[str, Array]:
        if job.records and job.state is not None:
            return job.state

        def report(done: int) -> None:
            job.report("pairs of gears", done, len(deviations))

        contact = self.problem.solve(deviations, report)
        arrays = {
            **self.problem.quantities(contact.ste, contact.no_load),
            "ste": contact.ste,
            "lost_contact": self.problem.lost_contact(contact).astype(float),
        }
        job.add_record({}, arrays)
        return arrays

    def gather(
        self, results: Mapping[str, Mapping[str, Array] | None]
    ) -> TolerancesResult | None:
        study, problem = self.study, self.problem
        deviations = problem.sample(study.samples, study.seed)
        finished = {key: value for key, value in results.items() if value is not None}
        if not finished:
            return None
        blocks = _blocks(deviations)
        columns = {
            name: np.concatenate([block[name] for block in finished.values()])
            for name in next(iter(finished.values()))
        }
        solved = SolvedSamples(
            deviations=np.concatenate([blocks[int(key)] for key in finished]),
            values={name: columns[name] for name in QUANTITIES},
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


def _blocks(deviations: Array) -> list[Array]:
    return np.split(deviations, np.arange(BLOCK, len(deviations), BLOCK))


@dataclass(frozen=True, eq=False, repr=False)
class TolerancesResult(StudyResult):
    """Bands of pairs of gears within their tolerances; torque : on the driver [N m]."""

    study: Tolerances
    gear_set: str
    torque: float
    bands: ToleranceBands
    complete: bool = True
    gear_warnings: tuple[str, ...] = ()

    @cached_property
    def summary(self) -> dict[str, Any]:
        study, bands = self.study, self.bands
        least, nominal, largest = sorted(bands.contact_ratios)
        return {
            "gear_set": self.gear_set,
            "mesh": study.mesh,
            "torque_Nm": self.torque,
            "driver_grade": study.driver_grade or study.grade,
            "driven_grade": study.driven_grade or study.grade,
            "distribution": study.distribution,
            "samples": len(bands.solved.ste),
            "seed": study.seed,
            "quantities": bands.rows,
            "tolerances": self._sources,
            "contact_ratio": nominal,
            "contact_ratio_least": least,
            "contact_ratio_largest": largest,
            "lost_contact_fraction": float(bands.solved.lost_contact.mean()),
            "moved_extremes_fraction": bands.moved_extremes,
            "jammed_fraction": bands.jammed,
            "evidence": [self._evidence],
            "warnings": [*self.gear_warnings, *self._warnings()],
        }

    @property
    def _sources(self) -> list[dict[str, Any]]:
        bands = self.bands
        return [
            {
                "source": source,
                "limit_um": limit / UM,
                "share_of_ste_peak_to_peak": bands.effects[PEAK_TO_PEAK][source],
                "share_of_mean_stiffness": bands.effects[MEAN_STIFFNESS][source],
                "first_order_p95_without_um": bands.peak_to_peak_without[source] / UM,
            }
            for source, limit in bands.limits.items()
        ]

    @property
    def _sensitivities(self) -> list[dict[str, Any]]:
        """A row for each tolerance, with the change of the 95 % value without it."""
        (row,) = (row for row in self.bands.rows if row["quantity"] == PEAK_TO_PEAK)
        every = row["first_order_p95"] / UM
        return [
            source
            | {"without": f"{_percent(source['first_order_p95_without_um'], every)}"}
            for source in self._sources
        ]

    @property
    def _outside(self) -> Iterator[str]:
        """A line for each quantity whose nominal value is outside its band."""
        for row in self.bands.rows:
            if row["p05"] <= row["nominal"] <= row["p95"]:
                continue
            change = "raise" if row["nominal"] < row["p05"] else "lower"
            yield (
                f"{SCALES[row['quantity']][1]}: the nominal value is outside the band; "
                f"deviations of either sign take load from a tooth pair and {change} it"
            )

    @property
    def _evidence(self) -> str:
        text = (
            "derivatives of the transmission error from one contact solution, off "
            f"slopes over the scatter by {self.bands.linear.derivative_error:.2g}"
        )
        return with_code("E21", text)

    def _warnings(self) -> Iterator[str]:
        bands = self.bands
        stderr = QUANTILE_STDERR / sqrt(len(bands.solved.ste))
        for row in bands.rows:
            if row["band_error"] > MAX_BAND_ERROR + 2.0 * stderr:
                yield with_code("W29", self._nonlinear(row))
        if bands.jammed > 0.0:
            text = (
                f"backlash {bands.backlash / UM:.3g} um at the nominal centre distance;"
                f" the teeth of {100.0 * bands.jammed:.2g} % of the pairs of gears "
                "would jam"
            )
            yield with_code("W30", text)

    def _nonlinear(self, row: Mapping[str, Any]) -> str:
        """How far the first order of a quantity is off, and what it leaves out."""
        names = "p05", "p95", "first_order_p05", "first_order_p95"
        low, high, low_linear, high_linear = (_scaled(row, name) for name in names)
        lost = 100.0 * self.bands.solved.lost_contact.mean()
        return (
            f"{SCALES[row['quantity']][1]}: 5 and 95 % are {low} and {high}, to first "
            f"order {low_linear} and {high_linear}, {100.0 * row['band_error']:.0f} % "
            f"of the band off; {lost:.0f} % of the pairs of gears have a tooth pair on "
            "the path of contact without load, "
            f"{100.0 * self.bands.moved_extremes:.0f} % have their extremes elsewhere"
        )

    @property
    def _header(self) -> dict[str, str]:
        summary = self.summary
        names = "torque_Nm", "driver_grade", "driven_grade", "distribution", "samples"
        limits = self.bands.limits.items()
        return {
            **{name: f"{summary[name]}" for name in (*names, "seed")},
            **{f"{name} [um]": f"{limit / UM:g}" for name, limit in limits},
            **self.study.gear_set.entries,
        }

    @property
    def table(self) -> Table:
        """A row for each quantity."""
        rows = [list(row.values()) for row in self.bands.rows]
        return Table(tuple(self.bands.rows[0]), lambda: rows, self._header)

    @property
    def more_tables(self) -> dict[str, Table]:
        return {"samples_table": self._samples, "cycle": self._cycle}

    @property
    def _samples(self) -> Table:
        """A row for each pair of gears."""
        return Table.of(self.bands.sample_columns, self._header)

    @property
    def _cycle(self) -> Table:
        """A row for each position."""
        return Table.of(self.bands.cycle_columns, self._header)

    @property
    def figures(self) -> Mapping[str, Draw]:
        title = (
            f"{self.gear_set}, mesh {self.study.mesh}, {self.torque:g} N m: "
            f"{len(self.bands.solved.ste)} pairs of gears within their tolerances"
        )
        return {"plot": partial(draw_tolerances, self.bands, title)}

    def page(self) -> Page:
        values = self.summary
        yield (
            "{gear_set} mesh {mesh} at {torque_Nm:g} N m, grades {driver_grade} and "
            "{driven_grade} of ISO 1328-1: {samples} pairs of gears, seed {seed}"
        ).format_map(values)
        yield RowTable(values["quantities"], BAND, "Bands", ("quantity",))
        kind = "uniform within the limits"
        if values["distribution"] == "normal":
            kind = f"normal, limits at {LIMIT_OVER_STD:g} standard deviations"
        title = f"Tolerances, {kind}: effect on STE p-p to first order"
        yield RowTable(self._sensitivities, SOURCE, title, ("tolerance",))
        yield from self._outside
        yield (
            "contact ratio {contact_ratio_least:.4g} to {contact_ratio_largest:.4g}"
        ).format_map(values)
        yield from values["evidence"]
