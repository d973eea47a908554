"""The result of `fegear identify`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.commands.identify.least_squares import (
    WIDTH_FACTORS,
    Candidate,
    Identified,
    MeasuredStiffness,
    hub_limits,
)
from fegear.files.codes import with_code
from fegear.gearset.model import GearSet
from fegear.studies.columns import meanings
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table, finite_or_none
from lumped.figures.drawing import draw_title, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


LARGE_MISFIT = 3.0  # spreads of a figure, beyond which it is not met

BOUND_RTOL = 1e-3  # relative distance


@dataclass(frozen=True, eq=False)
class IdentificationResult(StudyResult):
    """The set chosen, and the valley of sets along the hub radius of a gear."""

    study: Any
    gears: GearSet
    measured: MeasuredStiffness
    solution: Identified

    @cached_property
    def summary(self) -> dict[str, Any]:
        """NaN where nothing was measured."""
        measured, solution, gears = self.measured, self.solution, self.gears
        return {
            "gear_set": gears.name,
            "driver_torque_Nm": measured.torque.tolist(),
            "measured_mean_stiffness_N_per_m": measured.mean.tolist(),
            "measured_stiffness_variation": measured.variation.tolist(),
            "mean_std": measured.mean_std,
            "variation_std": measured.variation_std,
            "best": plain_candidate(gears, solution.best),
            "warnings": list(self._warnings()),
            "interpolation_error": solution.interpolation_error,
            "equally_good_from": gears.gears[solution.along].name,
            "equally_good": [plain_candidate(gears, c) for c in solution.equally_good],
            "valley": [plain_candidate(gears, c) for c in solution.valley],
        }

    def _warnings(self) -> Iterator[str]:
        """Why the set chosen does not represent what was measured, if so."""
        best = self.solution.best
        misfits = self.measured.misfits(best.mean, best.variation)
        worst, factor = float(np.abs(misfits).max()), best.width_factor
        if worst > LARGE_MISFIT:
            yield with_code(
                "W17",
                f"no set agrees with the measured values: the best one is {worst:.3g} "
                "standard deviations off; check the values, material and tooth numbers",
            )
        for gear, hub in zip(self.gears.gears, best.hub_radius, strict=True):
            for limit in hub_limits(gear):
                if abs(hub / limit - 1.0) < BOUND_RTOL:
                    line = f'hub radius of gear "{gear.name}" is at its limit'
                    yield with_code("W18", line)
        if min(abs(factor / limit - 1.0) for limit in WIDTH_FACTORS) < BOUND_RTOL:
            line = f"face widths are at their limit, {factor:.3g} of those given"
            yield with_code("W19", line)

    @property
    def table(self) -> Table:
        """The set chosen and the valley, there the smallest hub first.

        `set` says which: chosen, equally good, or worse.
        """
        values = self.summary
        rows = [{"set": "chosen"} | values["best"]]
        for row in values["valley"]:
            kind = "equally good" if row in values["equally_good"] else "worse"
            rows.append({"set": kind} | row)
        header = {
            "gear set": values["gear_set"],
            **meanings("identify", "misfit"),
            **self.study.gear_set.entries,
        }
        return Table.of_rows(rows, header)

    @property
    def figures(self) -> dict[str, Draw]:
        return {"plot": lambda: draw_valley(self.gears, self.measured, self.solution)}

    def page(self) -> Page:
        values = self.summary
        yield self._solution_table()
        yield self._stiffness_table()
        yield with_code(
            "E13",
            f"misfit: squares of the differences over their standard deviations "
            f"({100.0 * values['mean_std']:g} % of a mean, "
            f"{values['variation_std']:g} of a variation), summed; interpolation "
            f"between hub radii changes a mean by {values['interpolation_error']:.1e}",
        )

    def _solution_table(self) -> RowTable:
        """Sets that are equally good, among them the one that is chosen."""
        values, names = self.summary, [gear.name for gear in self.gears.gears]
        best, width = values["best"], f"face width\nof {names[0]}\n[mm]"
        columns: Columns = {"": lambda row: "*" if row is best else ""}
        for name in names:
            title = f"hub radius\nof {name}\n[mm]"
            columns[title] = _fixed_decimals_cell(f"{name}_hub_radius_mm", 2)
        columns[width] = _fixed_decimals_cell(f"{names[0]}_face_width_mm", 2)
        columns["misfit"] = _fixed_decimals_cell("misfit", 3)
        key = f"{values['equally_good_from']}_hub_radius_mm"
        rows = sorted([best, *values["equally_good"]], key=lambda row: row[key])
        title = f"{values['gear_set']}: equally good sets, * the set chosen"
        return RowTable(rows, columns, title)

    def _stiffness_table(self) -> RowTable:
        """How the set chosen meets what was measured."""
        values, best = self.summary, self.summary["best"]
        means = values["measured_mean_stiffness_N_per_m"]
        variations = values["measured_stiffness_variation"]
        rows = [
            {
                "mesh": m,
                "mean": best[f"mesh{m}_mean_stiffness_N_per_m"],
                "measured_mean": finite_or_none(mean),
                "variation": best[f"mesh{m}_stiffness_variation"],
                "measured_variation": finite_or_none(variation),
            }
            for m, (mean, variation) in enumerate(
                zip(means, variations, strict=True), start=1
            )
        ]
        stiffness, ratio = "mean stiffness\n[1e8 N/m]", "peak to peak\nover mean"
        columns: Columns = {
            "mesh": lambda row: str(row["mesh"]),
            stiffness: cell("mean", 5, 1e-8),
            f"measured {stiffness}": cell("measured_mean", 5, 1e-8, none="-"),
            ratio: _fixed_decimals_cell("variation", 4),
            f"measured {ratio}": _fixed_decimals_cell("measured_variation", 4),
        }
        title = "the chosen set, meshed, and the measured values"
        return RowTable(rows, columns, title, text_columns=())


def _fixed_decimals_cell(key: str, decimals: int) -> Any:
    """A cell with so many decimals, a dash for None."""

    def shown(row: Mapping[str, Any]) -> str:
        return "-" if row[key] is None else f"{row[key]:.{decimals}f}"

    return shown


def plain_candidate(gear_set: GearSet, candidate: Candidate) -> dict[str, float]:
    """One set by column name, to the digits that a search finds again."""
    values = {}
    for gear, hub in zip(gear_set.gears, candidate.hub_radius, strict=True):
        width = 1e3 * candidate.width_factor * gear.face_width
        values[f"{gear.name}_face_width_mm"] = float(width)
        values[f"{gear.name}_hub_radius_mm"] = 1e3 * float(hub)
    for m, (mean, variation) in enumerate(
        zip(candidate.mean, candidate.variation, strict=True), start=1
    ):
        values[f"mesh{m}_mean_stiffness_N_per_m"] = float(mean)
        values[f"mesh{m}_stiffness_variation"] = float(variation)
    rounded = {name: float(f"{value:.5g}") for name, value in values.items()}
    return rounded | {"misfit": round(candidate.misfit, 4)}


def draw_valley(
    gear_set: GearSet, measured: MeasuredStiffness, solution: Identified
) -> Figure:
    """Hubs and width, and the figures they give, along the valley."""
    heights = (1.5, 1.0, 1.0, 0.8)
    figure, rows = panels(4, size=(8.0, 9.0), heights=heights, share=True)
    hubs, means, variations, misfit = (row[0] for row in rows)
    along = gear_set.gears[solution.along].name
    x = np.array([1e3 * c.hub_radius[solution.along] for c in solution.valley])
    _draw_hubs(hubs, gear_set, solution, x)
    for m in range(len(gear_set.meshes)):
        for axes, name, scale in ((means, "mean", 1e-8), (variations, "variation", 1)):
            curve = scale * np.array([getattr(c, name)[m] for c in solution.valley])
            (line,) = axes.plot(x, curve, label=f"mesh {m + 1}")
            wanted = scale * getattr(measured, name)[m]
            axes.axhline(wanted, color=line.get_color(), linestyle=":")
    means.set_ylabel("mean stiffness\n[1e8 N/m]")
    variations.set_ylabel("peak to peak\nover mean")
    means.legend(title="dotted: measured", fontsize=8)
    misfit.plot(x, [c.misfit for c in solution.valley], color="k")
    misfit.set_ylim(0.0, solution.best.misfit + 6.0)
    misfit.set_ylabel("misfit")
    misfit.set_xlabel(f"hub radius of {along} [mm]")
    good = [1e3 * c.hub_radius[solution.along] for c in solution.equally_good]
    for axes in (hubs, means, variations, misfit):
        if good:
            axes.axvspan(min(good), max(good), color="0.93", zorder=0)
        axes.axvline(
            1e3 * solution.best.hub_radius[solution.along], color="0.4", lw=0.8
        )
    draw_title(
        figure,
        f"{gear_set.name}: face width and hub radii from mesh stiffness\n"
        "grey: equally good sets, line: the set chosen",
    )
    return figure


def _draw_hubs(
    axes: Axes, gear_set: GearSet, solution: Identified, x: np.ndarray
) -> None:
    for i, gear in enumerate(gear_set.gears):
        if i != solution.along:
            radius = [1e3 * c.hub_radius[i] for c in solution.valley]
            axes.plot(x, radius, label=f"hub radius of {gear.name}")
    width = [
        c.width_factor * 1e3 * gear_set.gears[0].face_width for c in solution.valley
    ]
    name = gear_set.gears[0].name
    axes.plot(x, width, color="k", linestyle="--", label=f"face width of {name}")
    axes.set_ylabel("[mm]")
    axes.legend(fontsize=8)
