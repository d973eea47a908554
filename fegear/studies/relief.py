"""Profile relief of least transmission error over torque."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.files.codes import with_code
from fegear.files.errors import InputError
from fegear.files.output import write_text
from fegear.files.toml import toml_text
from fegear.gearset.model import ReliefShape
from fegear.gearset.read import load_tables, relative_tables
from fegear.statics.best_relief import (
    MICRO,
    PLACES,
    BestRelief,
    Objective,
    ReliefProblem,
    find_best_relief,
    objective_value,
    peak_to_peak,
    relief_ranges,
    starting_designs,
)
from fegear.statics.solving import StaticsSettings, contact_problem, solve_mesh
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.stiffness import table_warnings
from fegear.studies.study import (
    PLOT,
    Draw,
    Job,
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
    chosen_torques,
    mesh_index,
    mesh_setting,
    torques_setting,
)
from lumped.common.options import Range

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN_TORQUES = 41  # of the figure
MAX_OVER_ERROR = 2.0  # default largest relief over the largest transmission error
ELEMENTS = SettingsGroup(
    kind=StaticsSettings, exposed=expose("positions", "plane", "resolution")
)
MORE = {
    "torques": "Write the peak to peak at each torque, before and after, to this CSV "
    "file."
}
DESIGN: Columns = {
    "relief": lambda row: row["relief"],
    "magnitude\num": cell("magnitude_um", 4),
    "length\nbase pitches": cell("length_pitches", 4),
    "p-p of STE\nper um [um]": cell("peak_to_peak_per_um", 3),
}
TORQUES: Columns = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "p-p of STE\nbefore [um]": cell("before_um", 4),
    "p-p of STE\nafter [um]": cell("after_um", 4),
}


@dataclass(frozen=True, kw_only=True)
class ReliefDesign(
    Study,
    command="relief",
    example="relief liu-pair --torque 60:140:20 -o best.toml --plot best.png",
):
    """Profile relief of least transmission error over torque.

    Magnitude and length of the reliefs of both gears are sought together, from several
    starts, so that the objective is least: the largest, or the mean, peak to peak of
    the static transmission error at the torques. Reliefs that the gear set has at these
    places are replaced.
    """

    pictures = PLOT
    more_tables = MORE
    output = "Write the gear set with its best relief to this TOML file."
    endings = (".toml",)

    gear_set: GearSetRef = DEFAULT_PAIR
    mesh: int = mesh_setting()
    torque: tuple[float, ...] = torques_setting("driving gear of the mesh")
    objective: Objective = setting(
        "largest",
        "Peak to peak of the static transmission error to minimise. largest: that of "
        "the worst torque; mean: the mean of all torques.",
    )
    shape: ReliefShape = setting("linear", "Depth of the reliefs over the roll angle.")
    root: bool = setting(False, "Seek root reliefs as well as tip reliefs.")
    max_relief_um: float | None = setting(
        None,
        "Largest magnitude of a relief [um]. [default: twice the largest static "
        "transmission error]",
        Range(above=0.0, below=1e4),
        option="--max-relief-um",
    )
    starts: int = setting(
        12, "Number of designs from which searches start.", Range(1, 64)
    )
    elements: StaticsSettings = group(ELEMENTS)

    def tasks(self) -> Iterator[Task]:
        gears = self.gear_set.loaded
        index = mesh_index(gears, self.mesh)
        torques = chosen_torques(gears, self.torque, self.mesh)
        if self.gear_set.preloaded is not None:
            raise InputError(f"gear_set = {gears.name}; needs a gear set by its name")
        yield Task("relief", partial(self._find, index, torques))

    def _find(self, index: int, torques: tuple[float, ...], job: Job) -> ReliefResult:
        gears, settings = self.gear_set.loaded, self.elements
        quick = replace(settings, estimate_error=False, root_stress=False)
        before = solve_mesh(gears, index, torques, quick, job.report)
        contact = contact_problem(gears, index, settings)
        places = PLACES if self.root else PLACES[:2]
        without: dict[str, Any] = {f"{place}_relief": None for place in places}
        bare = replace(contact, **without)
        largest = float(np.abs(before.cycle.ste).max())
        problem = ReliefProblem(
            contact=bare,
            ranges=relief_ranges(bare, places),
            torques=np.array(torques),
            positions=np.arange(settings.positions) / settings.positions,
            max_magnitude=MICRO * self.max_relief_um
            if self.max_relief_um
            else MAX_OVER_ERROR * largest,
            shape=self.shape,
        )
        best = find_best_relief(
            problem,
            starting_designs(problem, self.starts),
            self.objective,
            partial(job.report, "searches"),
        )
        reliefs = _reliefs(problem, best)
        edits = _edits(self.mesh, reliefs, self.shape)
        tables = load_tables(self.gear_set.name, self.gear_set.overrides | edits)
        shown = torques
        if len(torques) > 1:
            shown = tuple(np.linspace(min(torques), max(torques), SHOWN_TORQUES))
        after = self.gear_set.changed(edits)
        return ReliefResult(
            study=self,
            gear_set=gears.name,
            reliefs=reliefs,
            rows=_rows(torques, before.cycle.ste, _ste(after, index, torques, quick)),
            shown=_rows(
                shown,
                _ste(gears, index, shown, quick),
                _ste(after, index, shown, quick),
            ),
            evaluations=best.evaluations,
            warnings=table_warnings(solve_mesh(after, index, torques, settings)),
            tables=tables,
        )


def _ste(gears: Any, index: int, torques: Any, settings: StaticsSettings) -> Any:
    return solve_mesh(gears, index, torques, settings).cycle.ste


def _reliefs(problem: ReliefProblem, best: BestRelief) -> list[dict[str, Any]]:
    """Sought reliefs with rounded sizes, and what a micrometre more would change."""
    count = len(problem.ranges)
    ste, slopes = problem.ste(best.design)
    worst = int(np.argmax(peak_to_peak(ste)))
    ends = int(np.argmax(ste[worst])), int(np.argmin(ste[worst]))
    change = (slopes[worst, ends[0]] - slopes[worst, ends[1]]) / MICRO
    return [
        {
            "relief": f"{entry.place}_relief",
            "magnitude_um": round(float(best.design[i]), 2),
            "length_pitches": round(float(best.design[count + i]), 4),
            "peak_to_peak_per_um": float(change[i]),
        }
        for i, entry in enumerate(problem.ranges)
    ]


def _edits(
    mesh: int, reliefs: list[dict[str, Any]], shape: ReliefShape
) -> dict[str, Any]:
    """Keys of the gear set that give the reliefs, in place of those for both gears."""
    edits: dict[str, Any] = {}
    for relief in reliefs:
        both = relief["relief"].partition("_")[2]
        edits[f"mesh.{mesh}.{both}.magnitude_um"] = 0
    for relief in reliefs:
        key = f"mesh.{mesh}.{relief['relief']}"
        edits[f"{key}.magnitude_um"] = relief["magnitude_um"]
        if relief["magnitude_um"]:
            edits[f"{key}.length_pitches"] = relief["length_pitches"]
            edits[f"{key}.shape"] = shape
    return edits


def _rows(torques: Any, before: Any, after: Any) -> list[dict[str, float]]:
    ranges = zip(torques, peak_to_peak(before), peak_to_peak(after), strict=True)
    return [
        {
            "torque_Nm": float(torque),
            "before_um": float(one) / MICRO,
            "after_um": float(two) / MICRO,
        }
        for torque, one, two in ranges
    ]


@dataclass(frozen=True, eq=False, repr=False)
class ReliefResult(StudyResult):
    """Best reliefs, and what they do.

    reliefs : place, size and sensitivity of each
    rows : peak to peak of the transmission error at the torques, before and after
    shown : the same at the torques of the figure
    evaluations : solutions of the mesh cycle during the search
    tables : of the gear set with the reliefs, as in its file
    """

    study: ReliefDesign
    gear_set: str
    reliefs: list[dict[str, Any]]
    rows: list[dict[str, float]]
    shown: list[dict[str, float]]
    evaluations: int
    warnings: list[str]
    tables: dict[str, Any]

    @cached_property
    def summary(self) -> dict[str, Any]:
        return {
            "gear_set": self.gear_set,
            "mesh": self.study.mesh,
            "objective": self.study.objective,
            "objective_before_um": self._objective("before_um"),
            "objective_after_um": self._objective("after_um"),
            "reliefs": self.reliefs,
            "torques": self.rows,
            "starts": self.study.starts,
            "evaluations": self.evaluations,
            "warnings": [*self.warnings, *self._worse()],
        }

    def _worse(self) -> Iterator[str]:
        """Yield a warning where the gear set was as good before."""
        before, after = self._objective("before_um"), self._objective("after_um")
        if after >= before:
            text = f"no relief within the limits gives less than {before:.4g} um"
            yield with_code("W28", text)

    def _objective(self, name: str) -> float:
        values = np.array([row[name] for row in self.rows])
        return objective_value(values, self.study.objective)

    @property
    def more_tables(self) -> dict[str, Table]:
        return {"torques": self._torques}

    @property
    def _torques(self) -> Table:
        """A row for every torque."""
        names = "torque_Nm", "peak_to_peak_before_m", "peak_to_peak_after_m"
        rows = [
            [row["torque_Nm"], MICRO * row["before_um"], MICRO * row["after_um"]]
            for row in self.rows
        ]
        header = {
            row["relief"]: f"{row['magnitude_um']} um, {row['length_pitches']} pitches"
            for row in self.reliefs
        }
        return Table(names, lambda: rows, header | self.study.gear_set.entries)

    @property
    def text(self) -> str:
        """Text of the gear-set file with the reliefs."""
        return toml_text(self.tables)

    def write(self, path: str | Path) -> None:
        """Write the gear-set file."""
        write_text(path, toml_text(relative_tables(self.tables, Path(path))))

    @property
    def figures(self) -> Mapping[str, Draw]:
        return {"plot": self._draw}

    def _draw(self) -> Figure:
        from lumped.figures.drawing import panels

        figure, ((axes,),) = panels(1, size=(8.0, 4.5))
        torques = [row["torque_Nm"] for row in self.shown]
        single = "o" if len(torques) == 1 else ""
        for name, label in (("before_um", "before"), ("after_um", "best relief")):
            values = [row[name] for row in self.shown]
            axes.plot(torques, values, marker=single, label=label)
        axes.set_xlabel("torque on the driving gear [N m]")
        axes.set_ylabel("peak to peak of the static\ntransmission error [um]")
        axes.set_ylim(bottom=0.0)
        axes.legend(fontsize=8)
        axes.set_title(f"{self.gear_set}, mesh {self.study.mesh}")
        return figure

    def page(self) -> Page:
        values = self.summary
        yield (
            "{gear_set} mesh {mesh}, {objective} peak to peak of the static "
            "transmission error {objective_before_um:.4g} um before, "
            "{objective_after_um:.4g} um after"
        ).format_map(values)
        yield RowTable(self.reliefs, DESIGN, "Best relief", ("relief",))
        yield RowTable(self.rows, TORQUES, "At the torques", ())
        yield (
            f"{values['starts']} searches, {values['evaluations']} solutions of the "
            "mesh cycle"
        )
