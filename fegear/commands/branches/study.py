"""Branches of periodic motions of a gear set over speed or a parameter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fegear.commands.branches.result import (
    BALANCE_SCHEME,
    INTEGRATION_SCHEME,
    BranchesResult,
)
from fegear.files.errors import InputError
from fegear.files.speed_ranges import MESH_FREQUENCY
from fegear.statics.plausibility import motion_warnings
from fegear.studies.problem import Job, Task
from fegear.studies.settings import (
    SettingsGroup,
    display_name,
    expose,
    group,
    refusal,
    setting,
)
from fegear.studies.study import Study
from fegear.studies.trains.axes import (
    limits,
    limits_axis,
    written_limits,
    written_limits_axis,
)
from fegear.studies.trains.loads import torque_setting
from fegear.studies.trains.model_texts import body_modes_warnings, natural_in_words
from fegear.studies.trains.models import (
    ALL_MODELS,
    EXCITATION,
    SPACE,
    lumped_model,
    tables_setting,
)
from fegear.studies.trains.parametric import TORQUE, ParametricProblem, ParametricStudy
from fegear.studies.trains.speeds import (
    FREQUENCY,
    refuse_both,
    rpm_limits_setting,
    with_frequencies,
)
from fegear.train.model_settings import LumpedModel
from fegear.train.resonances import natural_frequencies
from lumped.branches.branch_settings import BranchSettings
from lumped.branches.cascades import find_cascades
from lumped.branches.motions import Family, ParameterFamily, SpeedFamily
from lumped.branches.periodic import BranchFinder
from lumped.branches.points import PeriodicBranch
from lumped.common.checks import require_present
from lumped.common.csv_text import format_exact
from lumped.common.options import Range
from lumped.common.workers import Stopped
from lumped.steady.maps import Axis
from lumped.train.system import LumpedSystem

SPEEDS = Range(0.1, 1e6, "Hz")


POINTS_HELP = 300.0  # of branches by mesh, about, as long as settled motions
SHOT = "shooting integrates motions with true contact"
FINDER_HELP = SettingsGroup(
    kind=BranchSettings,
    exposed=expose("harmonics", "period_multiple", "solver", "sweep_points", "starts"),
)


@dataclass(frozen=True, kw_only=True)
class Branches(
    ParametricStudy,
    Study,
    command="branches",
    example="branches liu-idler --speeds 700:4500 -o b.csv --plot b.png",
):
    """Periodic motions over speed or a parameter, stable and unstable.

    Harmonic balance, or integration over the period, and arc-length continuation with
    folds, cascades of period doublings and Floquet multipliers. With --output each
    branch is stored in FILE.partial until the file is written; --resume continues from
    there.
    """

    resumes = True
    partial = True
    unit = "branch"

    speeds: tuple[float, float] | None = setting(
        None,
        "Mesh frequencies of the first mesh [Hz] between which branches are followed; "
        "this or --over. [default: none]",
        SPEEDS,
        metavar="A:B",
        parse=limits,
        write=written_limits,
    )
    rpm: tuple[float, ...] = rpm_limits_setting("--speeds, or of --at if it is one")
    over: Axis | None = setting(
        None,
        "Follow branches over this parameter at one speed instead: a key of the "
        "gear set, torque_Nm or damping_ratio, from A to B. [default: none]",
        metavar="KEY=A:B",
        parse=limits_axis,
        write=written_limits_axis,
    )
    at: float | None = setting(
        None,
        "Mesh frequency of the first mesh [Hz] with --over.",
        FREQUENCY,
        metavar="HZ",
    )
    torque: float | None = torque_setting()
    steepness: float | None = setting(
        None,
        "Smooth the contact function by tanh of this steepness [1/um], as the "
        "source does, for comparison; for models 1 to 3. [default: none]",
        Range(0.01, 1e6, "per um"),
        metavar="PER_UM",
    )
    finding: BranchSettings = group(FINDER_HELP)
    model: LumpedModel = lumped_model(ALL_MODELS | SPACE | {"excitation": EXCITATION})
    table: tuple[str, ...] = tables_setting()

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_both(self, "speeds", "rpm")
        refuse_both(self, "at", "rpm")
        if self.rpm:
            self._require_rpm()
        else:
            self._require_speeds()
        if self.model.motion == "space":
            self._require_balance()
        if self.model.number == "coupled" or self.is_shooting:
            self._refuse_balance()

    def _require_rpm(self) -> None:
        """Two speeds of rotation without another parameter, else one."""
        needed = 2 if self.over is None else 1
        if len(self.rpm) != needed:
            rpm, over = display_name(self, "rpm"), display_name(self, "over")
            why = f"needed without {over}" if needed == 2 else f"allowed with {over}"
            form = "A:B is" if needed == 2 else "one speed is"
            raise InputError(f"{rpm} = {written_limits(self.rpm)}; {form} {why}")

    def _require_speeds(self) -> None:
        over, at, speeds = (
            display_name(self, name) for name in ("over", "at", "speeds")
        )
        if self.speeds is None and self.over is None:
            raise InputError(f"{speeds} A:B or {over} KEY=A:B is needed")
        if self.over is None:
            if self.at is not None:
                raise refusal(self, "at", "needs {over}")
        elif self.speeds is not None:
            raise InputError(
                f"{over}; {speeds} takes its place, one of them is allowed"
            )
        elif self.at is None:
            raise InputError(f"{over} KEY=A:B needs a mesh frequency, {at} HZ")
        elif self.table:
            raise refusal(self, "table", "{over} varies what tables hold")

    def _require_balance(self) -> None:
        """Refuse what harmonic balance of motion in space does not have."""
        reason = "{motion} space has harmonic balance with true contact"
        if self.is_shooting:
            reason = reason.format(motion=display_name(self, "motion"))
            raise refusal(self.finding, "solver", reason, FINDER_HELP)
        if self.steepness is not None:
            raise refusal(self, "steepness", reason)

    def _refuse_balance(self) -> None:
        """Refuse what belongs to harmonic balance, where motions are integrated."""
        is_coupled = self.model.number == "coupled"
        model = f"{display_name(self, 'number')} coupled"
        if is_coupled and self.finding.solver != BranchSettings().solver:
            raise refusal(
                self.finding,
                "solver",
                f"motions of {model} are integrated",
                FINDER_HELP,
            )
        if self.steepness is not None:
            reason = f"contact of {model} is smooth" if is_coupled else SHOT
            raise refusal(self, "steepness", reason)
        if self.finding.harmonics != BranchSettings().harmonics:
            reason = f"motions of {model} are integrated" if is_coupled else SHOT
            raise refusal(self.finding, "harmonics", reason, FINDER_HELP)

    @property
    def is_shooting(self) -> bool:
        """Whether motions of models 1 to 3 are integrated over their period."""
        return self.finding.solver == "shooting"

    @property
    def reason_for_model_1(self) -> str:
        if self.steepness is not None:
            return "the coupled model has no contact function that could be smoothed"
        defaults = BranchSettings()
        if self.finding.solver != defaults.solver:
            return "motions of the coupled model are integrated by its own method"
        if self.finding.harmonics != defaults.harmonics:
            return "the coupled model has no harmonic balance"
        return super().reason_for_model_1

    @property
    def axes(self) -> tuple[Axis, ...]:
        return () if self.over is None else (self.over,)

    @property
    def fixed_mesh_frequencies(self) -> tuple[float, ...]:
        return self.speeds or (() if self.at is None else (self.at,))

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the parameter."""
        values = self.speeds if self.over is None else self.over.values
        return require_present(values, "speeds")[0], require_present(values, "speeds")[
            -1
        ]

    @property
    def parameter(self) -> str:
        """Name of what varies."""
        return MESH_FREQUENCY if self.over is None else self.over.name

    @property
    def numerics(self) -> BranchSettings:
        """Settings of the continuation, with the steepness of contact [1/m]."""
        steepness = None if self.steepness is None else 1e6 * self.steepness
        return replace(self.finding, steepness=steepness)

    def prepare(self) -> BranchesProblem:
        single = None if self.over is None else next(iter(self.rpm), None)
        speeds = {"speeds": self.rpm} if single is None else {"at": single}
        return BranchesProblem.of(with_frequencies(self, speeds))


@dataclass(frozen=True, eq=False)
class BranchesProblem(ParametricProblem):
    """A train over speed or a parameter."""

    study: Branches

    @cached_property
    def first(self) -> LumpedSystem:
        """The train at the first value of the parameter."""
        return self.system(() if self.study.over is None else self.study.ends[:1])

    @property
    def first_torque(self) -> float:
        """Torque on the input gear at the first value of the parameter [N m]."""
        return (
            self.study.ends[0]
            if TORQUE in self.study.axis_names
            else self.reference_torque
        )

    @property
    def is_integrated(self) -> bool:
        """Whether motions are fixed points of the map over their period."""
        return self.model.number == "coupled" or self.study.is_shooting

    @property
    def family(self) -> Family:
        over, at, ends = self.study.over, self.study.at, self.study.ends
        if over is None or at is None:
            return SpeedFamily(self.first)
        return ParameterFamily(over.name, lambda v: self.system((v,)), at, ends)

    @property
    def motions(self) -> float:
        return POINTS_HELP * len(self.gears.meshes)

    @property
    def set_ups(self) -> int:
        return 1 if self.study.over is None else int(self.motions)

    def tasks(self) -> Iterator[Task]:
        yield Task("branches", self._follow_branches)

    def _follow_branches(self, job: Job) -> BranchesResult:
        """Follow branches; Ctrl-C leaves those that were finished."""
        low, high = self.study.ends

        def watch(place: int, value: float) -> None:
            finished_branches = round(100.0 * (value - low) / (high - low))
            job.report(
                f"branch {place + 1}, {finder.family.label_of(value)}",
                finished_branches,
                100,
            )

        finder = BranchFinder(
            self.family,
            self.study.ends,
            self.study.numerics,
            report=watch,
            finished=job.records,
            store_branch=lambda branch: job.add_record(branch, {}),
        )
        try:
            finder.find(low)
            return self._result(finder.branches, complete=True)
        except (Stopped, KeyboardInterrupt):
            return self._result(finder.branches, complete=False)

    def _result(
        self, branches: Sequence[PeriodicBranch], complete: bool
    ) -> BranchesResult:
        study, is_integrated = self.study, self.is_integrated
        header = self.header(INTEGRATION_SCHEME if is_integrated else BALANCE_SCHEME)
        if study.at is not None:
            header["speed_Hz"] = format_exact(study.at)
        if TORQUE not in study.axis_names:
            header["torque_Nm"] = format_exact(self.reference_torque)
        if not is_integrated:
            header["harmonics"] = str(study.numerics.harmonics)
        if study.numerics.steepness is not None:
            steepness = format_exact(study.numerics.steepness)
            header["contact"] = f"closes by tanh, {steepness} per m"
        if not complete:
            finished_branches = f"{len(branches)} branches before it was interrupted"
            header["incomplete"] = finished_branches
        warnings = self._warnings(branches)
        return BranchesResult(
            study,
            self.facts(study.parameter, header, study.at, warnings),
            tuple(branches),
            natural_Hz=tuple(natural_frequencies(self.first)),
            natural=natural_in_words(self.first, self.first_torque),
            cascades=tuple(find_cascades(branches, self.family.unit)),
            complete=complete,
            is_integrated=is_integrated,
        )

    def _warnings(self, branches: Sequence[PeriodicBranch]) -> Iterator[str]:
        """Warn where the model leaves out too much or deflections are not physical."""
        points = [point for branch in branches for point in branch.points]
        if not points:
            return
        yield from body_modes_warnings(self.first, [p.frequency for p in points])
        peaks = np.max([point.figures["dte_peak"] for point in points], axis=0)
        where = ", at its worst point"
        yield from motion_warnings(self.gears, where, peaks, 0.0 * peaks)
