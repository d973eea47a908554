"""Scatter of mesh stiffness and transmission error of gears within their tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fegear.figures.tolerances import draw_tolerances
from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.gearset.model import GearSet
from fegear.gearset.pitch_errors import without_pitch_errors
from fegear.gearset.tolerance_grades import (
    UM,
    center_distance_tolerance,
    flank_tolerances,
)
from fegear.statics.solving import StaticsSettings, contact_problem
from fegear.statics.tolerances import (
    CENTER,
    LIMIT_OVER_STD,
    MEAN_STIFFNESS,
    PEAK_TO_PEAK,
    QUANTITIES,
    SOURCES,
    Distribution,
    LinearContact,
    ToleranceProblem,
    contact_ratio,
    linear_contact,
    total_effects,
)
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.study import (
    PLOT,
    Draw,
    Job,
    Problem,
    SettingsGroup,
    Study,
    StudyResult,
    Task,
    expose,
    group,
    setting,
)
from fegear.studies.table import Table
from fegear.studies.trains import (
    DEFAULT_PAIR,
    GearSetRef,
    chosen_torque,
    mesh_index,
    mesh_setting,
)
from lumped.common.options import Range

Array = NDArray[np.float64]
BLOCK = 250  # pairs of gears of a task
LINEAR_SAMPLES = 10_000  # of the first order
PERCENTILES = 5, 50, 95
MAX_BAND_ERROR = 0.1  # of the first order, above which a warning follows
QUANTILE_STDERR = 0.64  # of a limit over the band, times the root of the sample size
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
SCALES = {
    MEAN_STIFFNESS: (1e-8, "mean k [1e8 N/m]"),
    PEAK_TO_PEAK: (1e6, "STE p-p [um]"),
}
BAND: Columns = {
    "quantity": lambda row: SCALES[row["quantity"]][1],
    "nominal": lambda row: _scaled(row, "nominal"),
    "5 %": lambda row: _scaled(row, "p05"),
    "50 %": lambda row: _scaled(row, "p50"),
    "95 %": lambda row: _scaled(row, "p95"),
    "first order\n5 %": lambda row: _scaled(row, "first_order_p05"),
    "first order\n50 %": lambda row: _scaled(row, "first_order_p50"),
    "first order\n95 %": lambda row: _scaled(row, "first_order_p95"),
}
SOURCE: Columns = {
    "tolerance": lambda row: row["source"].replace("_", " "),
    "limit\n+- um": cell("limit_um", 3),
    "part of variance\nof STE p-p %": cell("share_of_ste_peak_to_peak", 3, 100.0),
    "part of variance\nof mean k %": cell("share_of_mean_stiffness", 3, 100.0),
}


def _scaled(row: Mapping[str, Any], key: str) -> str:
    return f"{SCALES[row['quantity']][0] * row[key]:.4g}"


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
    from the derivatives of the contact of the nominal pair. Pitch errors of the gear
    set are replaced; reliefs and profiles stay.
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
        gears = self.gear_set.loaded
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
        return TolerancesProblem(self, gears.name, problem)

    def _limits(self, gears: GearSet, index: int) -> dict[str, float]:
        """Tolerances [m] by source."""
        pair = gears.meshes[index].pair
        limits: dict[str, float] = {}
        names = "single_pitch", "profile_slope", "profile_form"
        amounts = {name: getattr(self, f"{name}_um") for name in names}
        for role, gear in (("driver", pair.driver), ("driven", pair.driven)):
            grade = getattr(self, f"{role}_grade") or self.grade
            for name, amount in amounts.items():
                if amount is None:
                    limit = getattr(flank_tolerances(gear, grade), name)
                else:
                    limit = UM * amount
                limits[f"{role}_{name}"] = limit
        if self.center_distance_um is None:
            limits[CENTER] = center_distance_tolerance(pair.center_distance)
        else:
            limits[CENTER] = UM * self.center_distance_um
        if not any(limits.values()):
            raise InputError("all tolerances are 0; one or more must be above 0")
        return {source: limits[source] for source in SOURCES}


@dataclass(frozen=True, eq=False)
class TolerancesProblem(Problem):
    """Pairs of gears in blocks, and their first order."""

    study: Tolerances
    gear_set: str
    problem: ToleranceProblem

    def tasks(self) -> Iterator[Task]:
        study = self.study
        deviations = self.problem.sample(study.samples, study.seed)
        for i, block in enumerate(_blocks(deviations)):
            yield Task(f"{i}", partial(self._solved, block), size=len(block))

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
        linear = linear_contact(problem)
        count = LINEAR_SAMPLES
        ste, no_load = linear.solve(problem.sample(count, study.seed))
        pair = problem.contact.pair
        return TolerancesResult(
            study=study,
            gear_set=self.gear_set,
            torque=problem.torque,
            limits=dict(problem.limits),
            variables=problem.variables,
            position=problem.position,
            deviations=np.concatenate([blocks[int(key)] for key in finished]),
            values={name: columns[name] for name in QUANTITIES},
            ste=columns["ste"],
            lost_contact=columns["lost_contact"] > 0.0,
            nominal=_nominal(problem, linear),
            linear=linear,
            linear_values=problem.quantities(ste, no_load),
            linear_ste_std=np.asarray(ste.std(axis=0)),
            effects=total_effects(problem, linear, count, study.seed),
            contact_ratios=tuple(
                contact_ratio(pair, side * problem.limits[CENTER])
                for side in (1.0, 0.0, -1.0)
            ),
            backlash=pair.backlash,
            backlash_slope=2.0 * np.sin(pair.operating_pressure_angle),
            complete=len(finished) == len(results),
        )


def _blocks(deviations: Array) -> list[Array]:
    return np.split(deviations, np.arange(BLOCK, len(deviations), BLOCK))


def _nominal(problem: ToleranceProblem, linear: LinearContact) -> dict[str, float]:
    """Quantities of the nominal pair of gears."""
    ste, no_load = linear.solve(np.zeros((1, len(problem.variables))))
    values = problem.quantities(ste, no_load)
    return {name: float(value[0]) for name, value in values.items()}


@dataclass(frozen=True, eq=False, repr=False)
class TolerancesResult(StudyResult):
    """Bands of pairs of gears within their tolerances.

    limits : tolerances [m] by source; variables : the source of each deviation (v,)
    position : (n,) of the mesh cycle [base pitches]
    deviations : (s, v) [m]; values : quantities (s,); ste : transmission error (s, n)
    lost_contact : (s,) whether a tooth pair on the path of contact carries no load
    nominal : quantities without deviations
    linear : derivatives; linear_values : quantities to first order
    linear_ste_std : standard deviation of the transmission error to first order (n,)
    effects : part of each quantity's variance that each source has
    contact_ratios : at the largest, the nominal and the smallest centre distance
    backlash : of the nominal pair [m]; backlash_slope : by the centre distance
    """

    study: Tolerances
    gear_set: str
    torque: float
    limits: dict[str, float]
    variables: tuple[str, ...]
    position: Array
    deviations: Array
    values: dict[str, Array]
    ste: Array
    lost_contact: NDArray[np.bool_]
    nominal: dict[str, float]
    linear: LinearContact
    linear_values: dict[str, Array]
    linear_ste_std: Array
    effects: dict[str, dict[str, float]]
    contact_ratios: tuple[float, ...]
    backlash: float
    backlash_slope: float
    complete: bool = True

    @cached_property
    def summary(self) -> dict[str, Any]:
        study = self.study
        return {
            "gear_set": self.gear_set,
            "mesh": study.mesh,
            "torque_Nm": self.torque,
            "driver_grade": study.driver_grade or study.grade,
            "driven_grade": study.driven_grade or study.grade,
            "distribution": study.distribution,
            "samples": len(self.deviations),
            "seed": study.seed,
            "tolerances": self.sources,
            "contact_ratio_least": self.contact_ratios[0],
            "contact_ratio": self.contact_ratios[1],
            "contact_ratio_largest": self.contact_ratios[2],
            "quantities": self.bands,
            "lost_contact_fraction": float(self.lost_contact.mean()),
            "moved_extremes_fraction": self.moved_extremes,
            "jammed_fraction": self.jammed,
            "derivative_error": self.linear.derivative_error,
            "evidence": [self._evidence],
            "warnings": list(self._warnings()),
        }

    @property
    def sources(self) -> list[dict[str, Any]]:
        return [
            {
                "source": source,
                "limit_um": limit / UM,
                "share_of_ste_peak_to_peak": self.effects[PEAK_TO_PEAK][source],
                "share_of_mean_stiffness": self.effects[MEAN_STIFFNESS][source],
            }
            for source, limit in self.limits.items()
        ]

    @cached_property
    def bands(self) -> list[dict[str, Any]]:
        """Percentiles of each quantity, by the samples and to first order."""
        return [
            {
                "quantity": name,
                "nominal": self.nominal[name],
                **_percentiles("p", self.values[name]),
                **_percentiles("first_order_p", self.linear_values[name]),
                "band_error": _band_error(self.values[name], self.linear_values[name]),
            }
            for name in QUANTITIES
        ]

    @property
    def moved_extremes(self) -> float:
        """Part of the pairs of gears with extremes at other positions."""
        moved = np.zeros(len(self.ste), bool)
        for find in (np.argmax, np.argmin):
            shift = np.abs(find(self.ste, axis=1) - find(self.linear.ste))
            moved |= np.minimum(shift, self.position.size - shift) > 1
        return float(moved.mean())

    @property
    def jammed(self) -> float:
        """Part of the pairs of gears without backlash at their centre distance."""
        increase = self.deviations[:, self.variables.index(CENTER)]
        return float((self.backlash + self.backlash_slope * increase < 0.0).mean())

    @property
    def _evidence(self) -> str:
        text = (
            "derivatives of the transmission error from one contact solution, against "
            f"differences of solutions: {self.linear.derivative_error:.2g}"
        )
        return with_code("E21", text)

    def _warnings(self) -> Iterator[str]:
        allowed = MAX_BAND_ERROR + 2.0 * QUANTILE_STDERR / sqrt(len(self.ste))
        for row in self.bands:
            if row["band_error"] > allowed:
                text = (
                    f"{SCALES[row['quantity']][1]}: 5 and 95 % are {_scaled(row, 'p05')} "
                    f"and {_scaled(row, 'p95')}, to first order "
                    f"{_scaled(row, 'first_order_p05')} and "
                    f"{_scaled(row, 'first_order_p95')}, "
                    f"{100.0 * row['band_error']:.0f} % of the band off; "
                    f"{100.0 * self.lost_contact.mean():.0f} % of the pairs of gears "
                    "have a tooth pair on the path of contact without load, "
                    f"{100.0 * self.moved_extremes:.0f} % have extremes elsewhere"
                )
                yield with_code("W29", text)
        if self.jammed > 0.0:
            text = (
                f"backlash {self.backlash / UM:.3g} um at the nominal centre distance: "
                f"the teeth of {100.0 * self.jammed:.2g} % of the pairs of gears would "
                "jam"
            )
            yield with_code("W30", text)

    @property
    def _header(self) -> dict[str, str]:
        summary = self.summary
        names = "torque_Nm", "driver_grade", "driven_grade", "distribution", "samples"
        return {
            **{name: f"{summary[name]}" for name in (*names, "seed")},
            **{
                f"{name} [um]": f"{limit / UM:g}" for name, limit in self.limits.items()
            },
            **self.study.gear_set.entries,
        }

    @property
    def table(self) -> Table:
        """A row for each quantity."""
        rows = [list(row.values()) for row in self.bands]
        return Table(tuple(self.bands[0]), lambda: rows, self._header)

    @property
    def more_tables(self) -> dict[str, Table]:
        return {"samples_table": self._samples, "cycle": self._cycle}

    @property
    def _samples(self) -> Table:
        """A row for each pair of gears."""
        columns = dict[str, Any]()
        for name, column in zip(
            _numbered(self.variables), self.deviations.T, strict=True
        ):
            columns[f"{name}_deviation_m"] = column
        columns |= self.values
        columns["lost_contact"] = self.lost_contact.astype(int)
        return Table.of(columns, self._header)

    @property
    def _cycle(self) -> Table:
        """A row for each position."""
        percentiles = np.percentile(self.ste, PERCENTILES, axis=0)
        columns = {
            "position": self.position,
            "ste_nominal_m": self.linear.ste,
            **{
                f"ste_p{percent:02d}_m": values
                for percent, values in zip(PERCENTILES, percentiles, strict=True)
            },
            "ste_std_m": self.ste.std(axis=0),
            "ste_first_order_std_m": self.linear_ste_std,
        }
        return Table.of(columns, self._header)

    @property
    def figures(self) -> Mapping[str, Draw]:
        return {"plot": partial(draw_tolerances, self)}

    def page(self) -> Page:
        values = self.summary
        yield (
            "{gear_set} mesh {mesh} at {torque_Nm:g} N m, grades {driver_grade} and "
            "{driven_grade} of ISO 1328-1: {samples} pairs of gears, seed {seed}"
        ).format_map(values)
        yield RowTable(self.bands, BAND, "Bands", ("quantity",))
        kind = "uniform within the limits"
        if values["distribution"] == "normal":
            kind = f"normal, limits at {LIMIT_OVER_STD:g} standard deviations"
        yield RowTable(self.sources, SOURCE, f"Tolerances, {kind}", ("tolerance",))
        yield (
            "contact ratio {contact_ratio_least:.4g} to {contact_ratio_largest:.4g}"
        ).format_map(values)
        yield from values["evidence"]


def _percentiles(prefix: str, values: Array) -> dict[str, float]:
    percentiles = np.percentile(values, PERCENTILES).tolist()
    return {
        f"{prefix}{percent:02d}": value
        for percent, value in zip(PERCENTILES, percentiles, strict=True)
    }


def _band_error(values: Array, linear: Array) -> float:
    """Largest difference of the limits of both bands over the band of the samples."""
    ends = PERCENTILES[0], PERCENTILES[-1]
    one, other = np.percentile(values, ends), np.percentile(linear, ends)
    return float(np.abs(one - other).max() / (np.ptp(one) or 1.0))


def _numbered(names: Sequence[str]) -> list[str]:
    """Names with a number where several are equal."""
    return [
        f"{name}_{1 + names[:i].count(name)}" if names.count(name) > 1 else name
        for i, name in enumerate(names)
    ]
