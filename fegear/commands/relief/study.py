"""Profile relief of least transmission error over torque."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from fegear.boundary import mesh_index
from fegear.commands.relief.best_relief import (
    PLACES,
    BestRelief,
    ReliefProblem,
    find_best_relief,
    relief_ranges,
    starting_designs,
    without_idle_reliefs,
)
from fegear.commands.relief.edits import (
    left_out_reliefs,
    peak_rows,
    relief_edits,
    relief_rows,
    vibration_entries,
)
from fegear.commands.relief.front import relief_front
from fegear.commands.relief.objective import Objective, ReliefObjective
from fegear.commands.relief.result import ReliefResult
from fegear.commands.relief.tolerance import tolerance_band
from fegear.commands.relief.vibration import VibrationBest, VibrationSearch
from fegear.contact.plane.contact import PlaneContact
from fegear.files.errors import InputError
from fegear.files.output import INTO_PICTURE
from fegear.gearset.model import GearSet
from fegear.gearset.modifications import ReliefShape
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.read import load_tables
from fegear.statics.contact_problem import contact_problem
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import mesh_statics
from fegear.statics.table_warnings import table_warnings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import SettingsGroup, expose, group, setting
from fegear.studies.study import PLOT, Study
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torques, torques_setting
from fegear.studies.trains.speeds import (
    refuse_both,
    rpms_setting,
    speeds_setting,
    with_frequencies,
)
from fegear.train.model_settings import LumpedModel
from lumped.common.array_types import Array
from lumped.common.options import Range
from lumped.common.units import UM

Goal = Literal["largest", "mean", "harmonics", "vibration"]
STATIC_GOALS: tuple[Objective, ...] = ("largest", "mean", "harmonics")
SHOWN_TORQUES = 41  # of the figure
MAX_OVER_ERROR = 2.0  # default largest relief over the largest transmission error
MAX_ORDER = 64
FEW_POSITIONS = 16  # of a first search
ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose("friction", "positions", "plane", "resolution"),
)
TABLE_HELP = {
    "torques": "Write the peak to peak at each torque, before and after, to this CSV "
    "file.",
    "pareto": "Write the compromises between the lowest and the highest torque to this "
    "CSV file; needs --compromises.",
}
PICTURE_HELP = PLOT | {
    "front": "Draw the compromises between the lowest and the highest torque "
    f"{INTO_PICTURE}; needs --compromises."
}


def _parsed_orders(text: str) -> tuple[int, ...]:
    try:
        orders = tuple(int(part) for part in text.split(","))
    except ValueError:
        raise ValueError("allowed are whole numbers, such as 1,2,3") from None
    if not all(1 <= order <= MAX_ORDER for order in orders):
        raise ValueError(f"must be 1 to {MAX_ORDER}")
    return tuple(sorted(set(orders)))


def _written_orders(orders: tuple[int, ...]) -> str:
    return ",".join(map(str, orders))


@dataclass(frozen=True, kw_only=True)
class ReliefDesign(
    Study,
    command="relief",
    example="relief liu-pair --torque 60:140:20 -o best.toml --plot best.png",
):
    """Profile relief of least transmission error over torque.

    Magnitude and length of the reliefs of both gears are sought together, from several
    starts, so that the objective is least: peak to peak or harmonics of the static
    transmission error at the torques, or the vibration over a band of speeds. Reliefs
    that the gear set has at these places are replaced.
    """

    partial = True
    pictures = PICTURE_HELP
    more_tables = TABLE_HELP
    output = "Write the gear set with its best relief to this TOML file."
    endings = (".toml",)

    gear_set: GearSetRef = DEFAULT_PAIR
    mesh: int = mesh_setting()
    torque: tuple[float, ...] = torques_setting("driving gear of the mesh")
    objective: Goal = setting(
        "largest",
        "Quantity to minimise. largest: peak to peak of the static transmission error "
        "at the worst torque; mean: the mean peak to peak of all torques; harmonics: "
        "root of the sum of squares of amplitudes of some harmonics of the static "
        "transmission error, at the worst torque; vibration: largest RMS of the "
        "dynamic transmission error over speeds, by sweeps of the coupled model.",
    )
    harmonics: tuple[int, ...] = setting(
        (1, 2, 3),
        "Orders of the mesh frequency, with commas, of the objective harmonics.",
        metavar="N,N",
        parse=_parsed_orders,
        write=_written_orders,
    )
    speeds: tuple[float, ...] = speeds_setting(
        (),
        "Mesh frequencies of the first mesh [Hz] of the objective vibration. [default: "
        "none]",
    )
    rpm: tuple[float, ...] = rpms_setting("--speeds")
    designs: int = setting(
        40,
        "Largest number of designs whose vibration is computed, each by a sweep up "
        "and down at every torque.",
        Range(1, 10000),
    )
    shape: ReliefShape = setting("linear", "Depth of the reliefs over the roll angle.")
    root: bool = setting(False, "Seek root reliefs as well as tip reliefs.")
    symmetric: bool = setting(
        False,
        "Seek one magnitude and one length in base pitches for both gears.",
    )
    max_relief_um: float | None = setting(
        None,
        "Largest magnitude of a relief [um]. [default: twice the largest static "
        "transmission error]",
        Range(above=0.0, below=1e4),
        option="--max-relief-um",
    )
    starts: int = setting(
        5, "Number of designs from which searches start.", Range(1, 64)
    )
    compromises: int = setting(
        0,
        "Number of compromises between the peak to peak at the lowest and at the "
        "highest torque to seek.",
        Range(0, 101),
    )
    relief_tolerance_um: float = setting(
        0.0,
        "Deviation of the magnitudes [um], uniform within plus and minus this, whose "
        "effect on the objective is computed.",
        Range(0.0, below=1e3),
        option="--relief-tolerance-um",
    )
    length_tolerance: float = setting(
        0.0,
        "The same of the lengths [base pitches].",
        Range(0.0, below=1.0),
        option="--length-tolerance",
    )
    elements: StaticsSettings = group(ELEMENTS)

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_both(self, "speeds", "rpm")

    def unused_options(self, outputs: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        defaults = {field.name: field.default for field in fields(self)}
        for name, reason in self._settings_without_effect():
            if name in outputs or getattr(self, name, None) != defaults.get(name):
                yield name, reason

    def _settings_without_effect(self) -> Iterator[tuple[str, str]]:
        """Yield settings and outputs that need another setting."""
        if self.objective != "harmonics":
            yield "harmonics", "needs {objective} harmonics"
        if self.objective != "vibration":
            for name in ("speeds", "rpm", "designs"):
                yield name, "needs {objective} vibration"
        else:
            for name in ("relief_tolerance_um", "length_tolerance"):
                yield name, "needs another {objective}"
        if not self.compromises:
            for name in ("pareto", "front"):
                yield name, "needs {compromises}"

    def tasks(self) -> Iterator[Task]:
        study = with_frequencies(self, {"speeds": self.rpm})
        gears = study.gear_set.healthy("optimal reliefs")
        index = mesh_index(gears, study.mesh)
        torques = chosen_torques(gears, study.torque, study.mesh)
        if study.gear_set.preloaded is not None:
            raise InputError(f"gear_set = {gears.name}; needs a gear set by its name")
        if study.objective == "vibration" and not study.speeds:
            raise InputError("speeds is missing; objective = vibration needs a band")
        if study.compromises and len(torques) < 2:
            raise InputError(
                f"compromises = {study.compromises}; needs two torques or more"
            )
        if study.objective == "harmonics":
            study._require_resolved()
        yield Task("relief", partial(study._find_reliefs, index, torques))

    def _require_resolved(self) -> None:
        """Raise InputError for a harmonic that the positions do not resolve."""
        largest_order = (self.elements.positions - 1) // 2
        if self.harmonics[-1] > largest_order:
            raise InputError(
                f"harmonics = {_written_orders(self.harmonics)}; at most "
                f"{largest_order} with positions = {self.elements.positions}"
            )

    def _find_reliefs(
        self, index: int, torques: tuple[float, ...], job: Job
    ) -> ReliefResult:
        """Find the best reliefs of a mesh, by its index, at torques [N m]."""
        gears = self.gear_set.loaded
        settings = replace(self.elements, root_stress=False)
        quick_settings = replace(settings, estimate_error=False)
        before = mesh_statics(
            gears, index, torques, quick_settings, job.report
        ).cycle.ste
        problem = self._relief_problem(index, torques, float(np.abs(before).max()))
        objective = self._static_objective(
            "largest" if self.objective == "vibration" else self.objective
        )
        best = self._search_best(problem, objective, job)
        vibration, design = None, best.design
        if self.objective == "vibration":
            vibration = self._search_least_vibration(problem, best, index, torques, job)
            design = vibration.design
        complete = vibration is None or vibration.complete
        front = self._compromise_front(problem, best, job) if complete else ((), 0)
        evaluations = best.evaluations + front[1]
        places = [entry.place for entry in problem.ranges]
        if vibration is None:
            problem, design, more_evaluations = without_idle_reliefs(
                problem, design, objective
            )
            evaluations += more_evaluations
        problem, design = problem.separate(design)
        reliefs = relief_rows(problem, design, objective)
        edits = self._relief_keys(places, reliefs)
        after = self.gear_set.changed(edits)
        shown_torques = torques
        if len(torques) > 1:
            shown_torques = tuple(
                np.linspace(min(torques), max(torques), SHOWN_TORQUES)
            )
        after_ste = _transmission_errors(after, index, torques, quick_settings)
        return ReliefResult(
            study=self,
            gear_set=gears.name,
            meshes=[n + 1 for n in gears.meshes_of_same_flanks(index)],
            reliefs=reliefs,
            before_um=self._objective_of_errors(before, objective) / UM,
            after_um=self._objective_of_errors(after_ste, objective) / UM,
            rows=peak_rows(torques, before, after_ste),
            shown=peak_rows(
                shown_torques,
                _transmission_errors(gears, index, shown_torques, quick_settings),
                _transmission_errors(after, index, shown_torques, quick_settings),
            ),
            evaluations=evaluations,
            left_out=left_out_reliefs(places, reliefs),
            max_magnitude_um=problem.max_magnitude / UM,
            vibration=vibration_entries(vibration),
            front=list(front[0]),
            tolerance=self._tolerance(problem, design, objective),
            warnings=[
                *(gear_set_warnings if vibration is None else motion_warnings)(after),
                *table_warnings(mesh_statics(after, index, torques, settings)),
            ],
            tables=load_tables(self.gear_set.name, self.gear_set.overrides | edits),
            complete=complete,
        )

    def _relief_keys(
        self, places: list[str], reliefs: list[dict[str, Any]]
    ) -> dict[str, Any]:
        """Keys that give the reliefs to the mesh and to those with the same flanks."""
        edits: dict[str, Any] = {}
        for index in self.gear_set.loaded.meshes_of_same_flanks(self.mesh - 1):
            edits |= relief_edits(index + 1, places, reliefs, self.shape)
        return edits

    def _relief_problem(
        self, index: int, torques: tuple[float, ...], largest: float
    ) -> ReliefProblem:
        """The sought reliefs; largest : transmission error [m]."""
        places = PLACES if self.root else PLACES[:2]
        elements = replace(self.elements, root_stress=False)
        contact = contact_problem(self.gear_set.loaded, index, elements)
        no_reliefs: dict[str, Any] = {"tip_relief": None}
        if self.root:
            no_reliefs["root_relief"] = None
        contact_without_reliefs = replace(
            contact,
            driver=replace(contact.driver, **no_reliefs),
            driven=replace(contact.driven, **no_reliefs),
        )
        return ReliefProblem(
            contact=contact_without_reliefs,
            ranges=relief_ranges(contact_without_reliefs, places),
            torques=np.array(torques),
            positions=np.arange(self.elements.positions) / self.elements.positions,
            max_magnitude=UM * self.max_relief_um
            if self.max_relief_um
            else MAX_OVER_ERROR * largest,
            shape=self.shape,
            symmetric=self.symmetric,
        )

    def _static_objective(self, name: Objective) -> ReliefObjective:
        return ReliefObjective(name, self.harmonics)

    def _objective_of_errors(self, ste: Array, objective: ReliefObjective) -> float:
        """Objective [m] of transmission errors over one base pitch or several."""
        pitches = ste.shape[1] // self.elements.positions
        orders = tuple(pitches * order for order in objective.harmonics)
        return replace(objective, harmonics=orders).of(ste)

    def _search_best(
        self, problem: ReliefProblem, objective: ReliefObjective, job: Job
    ) -> BestRelief:
        starts = starting_designs(problem, self.starts)
        report = partial(job.report, "searches")
        few = replace(problem, positions=_few_positions(problem, objective))
        is_quick = isinstance(problem.contact.solver, PlaneContact)
        if is_quick or few.positions.size == problem.positions.size:
            return find_best_relief(problem, starts, objective, report)
        # slices take long: at all positions from the best at few of them on
        first = find_best_relief(few, starts, objective, report)
        best = find_best_relief(problem, [first.design], objective, report)
        evaluations = first.evaluations + best.evaluations
        return replace(best, evaluations=evaluations, starts=first.starts)

    def _search_least_vibration(
        self,
        problem: ReliefProblem,
        best: BestRelief,
        index: int,
        torques: tuple[float, ...],
        job: Job,
    ) -> VibrationBest:
        """Begin with the best of each static objective, that of `best` first."""
        other_goals = STATIC_GOALS[1:]
        if (self.elements.positions - 1) // 2 < self.harmonics[-1]:
            other_goals = other_goals[:1]
        static = {"largest": best.design} | {
            name: self._search_best(problem, self._static_objective(name), job).design
            for name in other_goals
        }
        elements = self.elements
        stiffness = ExcitationSettings(
            plane=elements.plane, resolution=elements.resolution
        )

        def changed_gear_set(design: Array) -> GearSet:
            reliefs = relief_rows(*problem.separate(design), None)
            places = [entry.place for entry in problem.ranges]
            edits = self._relief_keys(places, reliefs)
            return self.gear_set.changed(edits)

        search = VibrationSearch(
            changed=changed_gear_set,
            bounds=np.array(problem.bounds),
            model=LumpedModel(
                number="auto", excitation=stiffness, friction=elements.friction
            ),
            index=index,
            torques=torques,
            speeds=self.speeds,
            limit=self.designs,
            job=job,
        )
        return search.find(self.gear_set.loaded, static)

    def _compromise_front(
        self, problem: ReliefProblem, best: BestRelief, job: Job
    ) -> tuple[list[dict[str, Any]], int]:
        if not self.compromises:
            return [], 0
        points, evaluations = relief_front(
            problem,
            self._static_objective("largest"),
            self.compromises,
            (best.design,),
            partial(job.report, "compromises"),
        )
        count = len(problem.ranges)
        designs = [problem.separate(point.design)[1] for point in points]
        return [
            {
                "lowest_um": float(point.measures[0]) / UM,
                "highest_um": float(point.measures[1]) / UM,
                "magnitudes_um": design[:count].tolist(),
                "lengths_pitches": design[count:].tolist(),
            }
            for point, design in zip(points, designs, strict=True)
        ], evaluations

    def _tolerance(
        self, problem: ReliefProblem, design: Array, objective: ReliefObjective
    ) -> dict[str, float] | None:
        if not (self.relief_tolerance_um or self.length_tolerance):
            return None
        if not problem.ranges:  # the teeth are best without relief
            return None
        limits = UM * self.relief_tolerance_um, self.length_tolerance
        band = tolerance_band(problem, design, objective, *limits)
        return {
            "nominal_um": band.nominal / UM,
            "by_derivatives_um": band.first_order / UM,
            "by_solutions_um": band.solved / UM,
            "difference": band.difference,
            "samples": band.samples,
        }


def _few_positions(problem: ReliefProblem, objective: ReliefObjective) -> Array:
    """Equal steps among the positions of a problem, which resolve its objective."""
    positions, least = problem.positions, FEW_POSITIONS
    if objective.name == "harmonics":
        least = max(least, 2 * max(objective.harmonics) + 1)
    steps = [
        step
        for step in range(1, positions.size + 1)
        if positions.size % step == 0 and positions.size // step >= least
    ]
    return np.asarray(positions[:: max(steps, default=1)])


def _transmission_errors(
    gears: Any, index: int, torques: Any, settings: StaticsSettings
) -> Any:
    return mesh_statics(gears, index, torques, settings).cycle.ste
