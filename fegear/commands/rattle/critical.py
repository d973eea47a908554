"""Eccentricity at which a machine begins to rattle, and which change helps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import degrees, inf
from typing import Any, ClassVar

from fegear.commands.rattle.machine_studies import LoadMachineRef
from fegear.commands.rattle.machines import NamedMachine
from fegear.commands.rattle.permanent_contact import contact_limits
from fegear.commands.rattle.single_impact import single_impact_lines
from fegear.studies.page import Page, heading
from fegear.studies.problem import Job, Task
from fegear.studies.result import StudyResult
from fegear.studies.study import Study
from fegear.studies.table import Table

MIN_SHOWN = 1e-3  # per cent per cent
LIMIT_TITLES = {  # whose changes are shown
    "critical_sensitivity": "critical eccentricity",
    "least_quiet_sensitivity": "least quiet eccentricity",
}
Slope = float | tuple[float | None, float | None]  # or of one per cent less and more


@dataclass(frozen=True, kw_only=True)
class RattleThreshold(
    Study, command="rattle critical", example="rattle critical roots-a --epsilon 8e-5"
):
    """Determine whether a machine can run without rattling, and which change helps.

    It takes machines with any parts: unequal shafts, gears on springs, an absorber.
    """

    pictures: ClassVar[Mapping[str, str]] = {}

    machine: LoadMachineRef

    def tasks(self) -> Iterator[Task]:
        yield Task("quiet", self._find_thresholds)

    def _find_thresholds(self, job: Job) -> CriticalResult:
        named = self.machine.named
        return CriticalResult(self, named, contact_limits(named))


@dataclass(frozen=True, eq=False)
class CriticalResult(StudyResult):
    """Critical eccentricity, margin of contact and sensitivities of a machine."""

    study: RattleThreshold
    named: NamedMachine
    summary: dict[str, Any]

    @property
    def table(self) -> Table:
        """A row for each parameter of the machine and limit that it changes."""
        percents = "percent_for_1_percent_less", "percent_for_1_percent_more"
        names = "parameter", "limit", *percents
        rows = [
            (name, limit, *_slopes_of_both_sides(slope))
            for key, limit in LIMIT_TITLES.items()
            for name, slope in self.summary[key].items()
            if slope is not None
        ]
        return Table(names, lambda: rows, {"machine": self.named.name})

    def page(self) -> Page:
        values = self.summary
        yield from heading(self.named)
        yield f"eccentricity {values['eccentricity_rad']:g} rad, {_window_text(values)}"
        if values["quiet_motion_exists"]:
            margin = values["least_contact_load_over_mean"]
            yield (
                "permanent contact exists: the tooth load is at least "
                f"{margin:.1%} of its mean"
            )
        else:
            yield "no permanent contact: the flanks separate in every turn"
        yield from single_impact_lines(
            values["single_impact"],
            "with rigid flanks, rattle of one impact a turn",
            values["eccentricity_rad"],
        )
        if "driving_eccentricity_rad" in values:
            yield _assembly_text(values)
        if values["ripple"]:
            without = values["critical_without_ripple_rad"]
            yield f"critical eccentricity without torque ripple {without:.4g} rad"
        for key, limit in LIMIT_TITLES.items():
            yield from _changes_by_figures(values[key], limit)


def _window_text(values: Mapping[str, Any]) -> str:
    """Eccentricities with permanent contact."""
    lowest = values["least_quiet_eccentricity_rad"]
    critical = values["critical_eccentricity_rad"]
    if critical is None:
        return "no permanent contact at any eccentricity, for the torque ripple"
    if lowest > 0.0:
        return (
            f"quiet from {lowest:.4g} rad, below which the torque ripple parts the "
            f"flanks, to the critical {critical:.4g} rad"
        )
    return f"critical {critical:.4g} rad"


def _changes_by_figures(slopes: Mapping[str, Slope | None], limit: str) -> Page:
    """Sensitivities of a limit to the parameters, the largest first."""
    finite_slopes = {name: slope for name, slope in slopes.items() if slope is not None}
    for name, slope in sorted(
        finite_slopes.items(), key=lambda both: -_largest_slope(both[1])
    ):
        if _largest_slope(slope) < MIN_SHOWN:
            continue
        if isinstance(slope, tuple):
            less, more = map(_percent_text, slope)
            yield f"1 % more {name}: {more} {limit}, 1 % less: {less}"
        else:
            yield f"1 % more {name}: {_percent_text(slope)} {limit}"


def _slopes_of_both_sides(slope: Slope) -> tuple[float | None, float | None]:
    """For one per cent less and more."""
    return slope if isinstance(slope, tuple) else (-slope, slope)


def _percent_text(change: float | None) -> str:
    return "no" if change is None else f"{change:+.3g} %"


def _largest_slope(slope: Slope) -> float:
    """The largest eccentricity; beyond all values where there is no limit."""
    return max(
        inf if side is None else abs(side) for side in _slopes_of_both_sides(slope)
    )


def _assembly_text(values: Mapping[str, Any]) -> str:
    """What assembling the gears at another angle would change."""
    driving, driven = (
        values[f"{side}_eccentricity_rad"] for side in ("driving", "driven")
    )
    phase = values["eccentricity_phase_rad"]
    within = values["quiet_phase_max_rad"]
    text = (
        f"gears of {driving:g} and {driven:g} rad, their long sides "
        f"{degrees(phase):.4g} degrees apart: "
    )
    if within is None:
        return f"{text}no other angle makes it quiet"
    beyond = values["quiet_phase_min_rad"]
    least = f"beyond {degrees(beyond):.4g} and " if beyond else ""
    return f"{text}it can run quietly {least}within {degrees(within):.4g} degrees"
