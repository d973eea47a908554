"""Best reliefs and leads over torque and misalignment."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any, Literal, cast

import numpy as np

from fegear.boundary import mesh_index
from fegear.commands.relief.best_relief import (
    FIRST_GAINS,
    BestRelief,
    find_best_relief,
    refined,
    starting_designs,
    without_idle_features,
)
from fegear.commands.relief.cases import Cases, SolvedCases, compared_rows
from fegear.commands.relief.edits import (
    design_rows,
    left_out_features,
    vibration_entries,
)
from fegear.commands.relief.front import relief_front
from fegear.commands.relief.objective import (
    OF_ERROR,
    QUANTITY_OF,
    Objective,
    ReliefObjective,
    Term,
)
from fegear.commands.relief.relief_problem import LEADS, PLACES, Lead, ReliefProblem
from fegear.commands.relief.result import ReliefResult
from fegear.commands.relief.sought_mesh import LargestDepths, SoughtMesh
from fegear.commands.relief.tolerance import tolerance_band
from fegear.commands.relief.vibration import VibrationBest, VibrationSearch
from fegear.contact.plane.contact import PlaneContact
from fegear.files.errors import InputError
from fegear.files.output import INTO_PICTURE
from fegear.gearset.leads import require_one_helix
from fegear.gearset.model import GearSet
from fegear.gearset.modifications import ReliefShape
from fegear.gearset.motion_warnings import motion_warnings
from fegear.gearset.plausibility import gear_set_warnings
from fegear.gearset.read import load_tables
from fegear.statics.contact_problem import require_solvable
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.statics.settings import StaticsSettings
from fegear.statics.table_warnings import table_warnings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import (
    SettingsGroup,
    display_name,
    expose,
    group,
    setting,
)
from fegear.studies.study import PLOT, Study
from fegear.studies.trains.gear_sets import (
    DEFAULT_PAIR,
    GearSetRef,
    mesh_setting,
)
from fegear.studies.trains.loads import chosen_torques, torques_setting
from fegear.studies.trains.shafts import require_shafts_used
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

Goal = Literal[
    "largest",
    "mean",
    "harmonics",
    "vibration",
    "pressure",
    "line_load",
    "distribution",
    "root_stress",
]
SHOWN_TORQUES, SHOWN_OVER_WIDTH = 41, 7  # of the figure
MAX_OVER_ERROR = 2.0  # default largest relief over the largest transmission error
MAX_ORDER, MAX_WEIGHT = 64, 1e6
MAX_MISALIGNMENTS, STEP_RTOL = 100, 1e-9
MISALIGNMENTS = "must be A:B with A below B, A:B:STEP, or numbers with commas"
FEW_POSITIONS = 16  # of a first search
MAX_POINTS = 8  # of a topography, over profile or width
ELEMENTS = SettingsGroup(
    kind=StaticsSettings,
    exposed=expose("friction", "positions", "plane", "resolution", "shafts"),
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


def _parsed_leads(text: str) -> tuple[Lead, ...]:
    names = [part.strip() for part in text.split(",")]
    for name in names:
        if name not in LEADS or names.count(name) > 1:
            raise ValueError(f"must be {', '.join(LEADS)}, each once, with commas")
    return tuple(lead for lead in LEADS if lead in names)


def _parsed_points(text: str) -> tuple[int, int]:
    try:
        over_profile, over_width = (int(part) for part in text.split("x"))
    except ValueError:
        over_profile, over_width = 0, 0
    if not all(2 <= count <= MAX_POINTS for count in (over_profile, over_width)):
        raise ValueError(
            f"must be KxL, such as 3x4, with 2 to {MAX_POINTS} points over profile and "
            "width"
        )
    return over_profile, over_width


def _written_points(points: tuple[int, int]) -> str:
    return "x".join(map(str, points))


def _parsed_weights(text: str) -> tuple[tuple[Objective, float], ...]:
    pairs = []
    for part in text.split(","):
        name, _, number = part.partition("=")
        if name not in QUANTITY_OF:
            raise ValueError(
                f"must be {', '.join(QUANTITY_OF)}, such as distribution=0.5"
            )
        try:
            weight = float(number) if number else 1.0
        except ValueError:
            weight = math.nan
        if not 0.0 < weight < MAX_WEIGHT:
            raise ValueError(f"weights must be above 0 and below {MAX_WEIGHT:g}")
        pairs.append((cast("Objective", name), weight))
    if len(dict(pairs)) < len(pairs):
        raise ValueError("must have each objective once")
    return tuple(pairs)


def _written_weights(weights: tuple[tuple[Objective, float], ...]) -> str:
    return ",".join(f"{name}={weight:g}" for name, weight in weights)


def _parsed_misalignments(text: str) -> tuple[float, ...]:
    separator = ":" if ":" in text else ","
    try:
        values = [float(part) for part in text.split(separator)]
    except ValueError:
        values = [math.nan]
    is_finite = all(map(math.isfinite, values))
    if separator == ":":
        if not is_finite or len(values) > 3 or values[0] >= values[1]:
            raise ValueError(MISALIGNMENTS)
        low, high, *steps = values
        step = steps[0] if steps else 0.5 * (high - low)
        if step <= 0.0 or (high - low) / step > MAX_MISALIGNMENTS:
            raise ValueError(
                f"STEP must be above 0 and lead to at most {MAX_MISALIGNMENTS} steps"
            )
        count = math.floor((high - low) / step * (1.0 + STEP_RTOL)) + 1
        return tuple(low + i * step for i in range(count))
    if not is_finite:
        raise ValueError(MISALIGNMENTS)
    if len(set(values)) < len(values):
        raise ValueError("must have each misalignment once")
    return tuple(values)


def _written_orders(orders: tuple[int, ...]) -> str:
    return ",".join(map(str, orders))


@dataclass(frozen=True, kw_only=True)
class ReliefDesign(
    Study,
    command="relief",
    example="relief liu-pair --torque 60:140:20 -o best.toml --plot best.png",
):
    """Best reliefs and leads over torque and misalignment.

    Magnitude and length of the reliefs of both gears, and lead modifications and a
    topography of one of them, are sought together, from several starts, so that the
    objective is least: peak to peak or harmonics of the static transmission error,
    pressure, load or root stress over the face width, or the vibration over a band of
    speeds. Reliefs, leads and the topography that the gear set has at these places are
    replaced.
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
        "dynamic transmission error over speeds, by sweeps of the coupled model; of "
        "loads that vary over the face width, at the worst torque, pressure: largest "
        "contact pressure; line_load: largest load per length of contact on a band of "
        "the width; distribution: load distribution factor K_Hbeta; root_stress: "
        "largest tooth-root stress of both gears.",
        metavar="NAME",
    )
    also: tuple[tuple[Objective, float], ...] = setting(
        (),
        "Further objectives with weights, such as distribution=0.5. The sum of all "
        "over their values before is then least. [default: none]",
        metavar="NAME=WEIGHT",
        parse=_parsed_weights,
        write=_written_weights,
    )
    lead: tuple[Lead, ...] = setting(
        (),
        "Lead modifications to seek, of the gear with fewer teeth: crowning, slope, "
        "end_relief, with commas. [default: none]",
        metavar="NAME,NAME",
        parse=_parsed_leads,
        write=",".join,
    )
    topography: tuple[int, int] | None = setting(
        None,
        "Topography to seek, of the gear with fewer teeth: depths at KxL points over "
        "active profile and face width, such as 3x4. [default: none]",
        metavar="KxL",
        parse=_parsed_points,
        write=_written_points,
    )
    misalignment_um: tuple[float, ...] = setting(
        (),
        "Misalignments of the axes [um] in place of that of the gear set, the worst of "
        "which counts: A:B for both and their middle, A:B:STEP or with commas. "
        "[default: that of the gear set]",
        option="--misalignment-um",
        metavar="A:B",
        parse=_parsed_misalignments,
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
    tip: bool = setting(True, "Seek tip reliefs.")
    root: bool = setting(False, "Seek root reliefs as well.")
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
    max_lead_um: float | None = setting(
        None,
        "Largest depth of a lead modification [um]. [default: twice the largest static "
        "transmission error and the largest misalignment]",
        Range(above=0.0, below=1e4),
        option="--max-lead-um",
    )
    max_topography_um: float | None = setting(
        None,
        "Largest depth of a topography [um]. [default: twice the largest static "
        "transmission error and the largest misalignment]",
        Range(above=0.0, below=1e4),
        option="--max-topography-um",
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
        if "harmonics" not in self._goals:
            yield "harmonics", "needs {objective} harmonics"
        if self.objective != "vibration":
            for name in ("speeds", "rpm", "designs"):
                yield name, "needs {objective} vibration"
        else:
            for name in ("relief_tolerance_um", "length_tolerance", "also"):
                yield name, "needs another {objective}"
            yield "misalignment_um", "needs another {objective}"
        if not self.compromises:
            for name in ("pareto", "front"):
                yield name, "needs {compromises}"
        if not self.lead:
            yield "max_lead_um", "needs {lead}"
        if not self.topography:
            yield "max_topography_um", "needs {topography}"

    @property
    def _goals(self) -> tuple[str, ...]:
        """All objectives."""
        return self.objective, *(name for name, _ in self.also)

    def tasks(self) -> Iterator[Task]:
        study = with_frequencies(self, {"speeds": self.rpm})
        gears = study.gear_set.healthy("optimal reliefs")
        index = mesh_index(gears, study.mesh)
        require_shafts_used(study.elements, gears, study.mesh, ELEMENTS)
        torques = chosen_torques(gears, study.torque, study.mesh)
        if study.gear_set.preloaded is not None:
            raise InputError(f"gear_set = {gears.name}; needs a gear set by its name")
        if study.objective == "vibration" and not study.speeds:
            raise InputError("speeds is missing; objective = vibration needs a band")
        if not (study.tip or study.root or study.lead or study.topography):
            raise InputError(
                "tip = off; a relief, a lead or a topography must be sought, see "
                "--root, --lead and --topography"
            )
        if study.compromises and len(torques) < 2:
            raise InputError(
                f"compromises = {study.compromises}; needs two torques or more"
            )
        if "harmonics" in study._goals:
            study._require_resolved()
        mesh = study._sought_mesh(index)
        study._require_width(mesh)
        yield Task("relief", partial(study._find_reliefs, mesh, torques))

    def _require_resolved(self) -> None:
        """Raise InputError for a harmonic that the positions do not resolve."""
        largest_order = (self.elements.positions - 1) // 2
        if self.harmonics[-1] > largest_order:
            raise InputError(
                f"harmonics = {_written_orders(self.harmonics)}; at most "
                f"{largest_order} with positions = {self.elements.positions}"
            )

    def _require_width(self, mesh: SoughtMesh) -> None:
        """Refuse what needs loads that vary over the width, and cannot be solved so."""
        over_width = [g for g in self._goals if QUANTITY_OF.get(g, "ste") != "ste"]
        for gear_set in mesh.gear_sets:
            require_one_helix(gear_set, "best reliefs")
            require_solvable(gear_set, mesh.index, self.elements)
            if over_width and not gear_set.meshes[mesh.index].varies_over_width:
                raise InputError(
                    f"objective = {over_width[0]}; needs loads that vary over the face "
                    "width, of gears that are helical, crowned or misaligned, or "
                    f"{display_name(self, 'lead')}"
                )
        sought = self.lead or self.topography
        others = over_width or self.also or sought or len(mesh.gear_sets) > 1
        if self.compromises and others:
            raise InputError(
                f"compromises = {self.compromises}; are those of the peak to peak at "
                "one misalignment, of reliefs alone and without further objectives"
            )

    def _sought_mesh(self, index: int) -> SoughtMesh:
        return SoughtMesh(
            gear_set=self.gear_set,
            index=index,
            places=tuple(p for p in PLACES if getattr(self, p.partition("_")[2])),
            leads=self.lead,
            topography=self.topography,
            misalignments_um=self.misalignment_um,
            settings=replace(self.elements, root_stress="root_stress" in self._goals),
            shape=self.shape,
        )

    def _find_reliefs(
        self, mesh: SoughtMesh, torques: tuple[float, ...], job: Job
    ) -> ReliefResult:
        """Find the best reliefs and leads of a mesh at torques [N m]."""
        gears, index = self.gear_set.loaded, mesh.index
        cases = mesh.cases
        before = cases.solved(torques)
        limits = self._limits(before.largest_error, mesh.largest_misalignment)
        positions = np.arange(self.elements.positions) / self.elements.positions
        problem = mesh.problem(np.array(torques), positions, limits)
        problem = replace(problem, symmetric=self.symmetric)
        objective = self._static_objective(
            "largest" if self.objective == "vibration" else self.objective, before
        )
        problem = replace(problem, quantities=objective.quantities)
        best = self._search_best(problem, objective, job)
        vibration, design = None, best.design
        if self.objective == "vibration":
            vibration = self._search_least_vibration(problem, best, mesh, torques, job)
            design = vibration.design
        complete = vibration is None or vibration.complete
        front = self._compromise_front(problem, best, job) if complete else ((), 0)
        evaluations = best.evaluations + front[1]
        sought = problem
        if vibration is None:
            problem, design, more_evaluations = without_idle_features(
                problem, design, objective
            )
            evaluations += more_evaluations
        problem, design = problem.separate(design)
        rows = design_rows(problem, design, objective)
        edits = mesh.keys(sought, rows)
        changed = mesh.changed(edits)
        after = changed.solved(torques, self.elements.estimate_error)
        shown = before, after
        if len(torques) > 1:
            count = SHOWN_OVER_WIDTH if after.vary_over_width else SHOWN_TORQUES
            shown_torques = tuple(np.linspace(min(torques), max(torques), count))
            shown = cases.solved(shown_torques), changed.solved(shown_torques)
        return ReliefResult(
            study=self,
            gear_set=gears.name,
            meshes=[n + 1 for n in gears.meshes_of_same_flanks(index)],
            reliefs=rows.reliefs,
            leads=rows.leads,
            topography=(
                {"topography": sought.topography.key, **rows.topography}
                if sought.topography and rows.topography
                else None
            ),
            objective=objective,
            before=before.objective(objective) / objective.unit,
            after=after.objective(objective) / objective.unit,
            rows=compared_rows(before, after, bool(self.misalignment_um)),
            shown=compared_rows(*shown, bool(self.misalignment_um)),
            evaluations=evaluations,
            left_out=left_out_features(sought, rows),
            max_magnitude_um=problem.max_magnitude / UM,
            lead_limits={
                f"{lead.role}_lead.{lead.name}": lead.limits[0] for lead in sought.leads
            },
            max_topography_um=sought.topography.largest if sought.topography else None,
            vibration=vibration_entries(vibration),
            front=list(front[0]),
            tolerance=self._tolerance(problem, design, objective),
            warnings=self._warnings(changed, after, vibration is None),
            tables=self._tables(edits, after),
            complete=complete,
        )

    def _tables(self, edits: dict[str, Any], after: SolvedCases) -> dict[str, Any]:
        """Tables of the gear set with a design, in a plane that can be solved."""
        tables = load_tables(self.gear_set.name, self.gear_set.overrides | edits)
        if after.vary_over_width and "plane" in tables:
            tables["plane"] = "width"
        return tables

    def _warnings(
        self, changed: Cases, after: SolvedCases, is_static: bool
    ) -> list[str]:
        """Warnings of the gear set with its reliefs, and of its solutions."""
        of_set = gear_set_warnings if is_static else motion_warnings
        warnings = list(of_set(changed.gear_sets[0]))
        for solved in after.results:
            warnings += [w for w in table_warnings(solved) if w not in warnings]
        return warnings

    def _limits(self, largest_error: float, misalignment: float) -> LargestDepths:
        """Largest relief, lead and topography."""
        default = MAX_OVER_ERROR * largest_error
        over_width = default + misalignment
        return LargestDepths(
            UM * self.max_relief_um if self.max_relief_um else default,
            UM * self.max_lead_um if self.max_lead_um else over_width,
            UM * self.max_topography_um if self.max_topography_um else over_width,
        )

    def _static_objective(
        self, name: Objective, before: SolvedCases | None = None
    ) -> ReliefObjective:
        """The objective; before : by whose values several are scaled."""
        objective = ReliefObjective(name, self.harmonics)
        if not self.also or before is None:
            return objective

        def scale(name: Objective, weight: float) -> float:
            alone = ReliefObjective(name, self.harmonics)
            return before.objective(alone) / weight

        others = tuple(
            Term(name, scale(name, weight), self.harmonics)
            for name, weight in self.also
        )
        return replace(objective, others=others, scale=scale(name, 1.0))

    def _search_best(
        self, problem: ReliefProblem, objective: ReliefObjective, job: Job
    ) -> BestRelief:
        starts = starting_designs(problem, self.starts)
        report = partial(job.report, "searches")
        few = replace(
            problem,
            positions=_few_positions(problem, objective),
            torques=np.unique([problem.torques.min(), problem.torques.max()]),
        )
        is_quick = isinstance(problem.contact.solver, PlaneContact)
        if is_quick or few.positions.size == problem.positions.size:
            return find_best_relief(problem, starts, objective, report)
        # slices take long: at all positions from the best at few of them on
        first = find_best_relief(few, starts, objective, report, FIRST_GAINS)
        return refined(problem, first, objective)

    def _search_least_vibration(
        self,
        problem: ReliefProblem,
        best: BestRelief,
        mesh: SoughtMesh,
        torques: tuple[float, ...],
        job: Job,
    ) -> VibrationBest:
        """Begin with the best of each static objective, that of `best` first."""
        other_goals = OF_ERROR[1:]
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
            rows = design_rows(*problem.separate(design), None)
            return self.gear_set.changed(mesh.keys(problem, rows))

        search = VibrationSearch(
            changed=changed_gear_set,
            bounds=np.array(problem.bounds),
            model=LumpedModel(
                number="auto", excitation=stiffness, friction=elements.friction
            ),
            index=mesh.index,
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
        entries = []
        for point in points:
            magnitudes, lengths, _ = problem.parts(point.design)
            sizes = [len(group) for group in problem.groups]
            entries.append(
                {
                    "lowest_um": float(point.measures[0]) / UM,
                    "highest_um": float(point.measures[1]) / UM,
                    "magnitudes_um": np.repeat(magnitudes, sizes).tolist(),
                    "lengths_pitches": np.repeat(lengths, sizes).tolist(),
                }
            )
        return entries, evaluations

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
