"""Result of `fegear relief`: its tables, figures and page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.commands.relief.best_relief import MIN_EFFECT
from fegear.commands.relief.cases import LARGEST
from fegear.commands.relief.objective import QUANTITY_OF, ReliefObjective
from fegear.commands.relief.quantities import Quantity
from fegear.commands.relief.relief_problem import PLACES
from fegear.files.codes import with_code
from fegear.files.output import write_text
from fegear.files.toml import toml_text
from fegear.gearset.read import relative_tables
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from lumped.common.units import UM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

OBJECTIVE_TEXTS = {
    "largest": "largest peak to peak of the static transmission error",
    "mean": "mean peak to peak of the static transmission error",
    "harmonics": "largest root sum of squares of harmonics {orders} of the static "
    "transmission error",
    "vibration": "largest peak to peak of the static transmission error",
    "pressure": "largest contact pressure",
    "line_load": "largest load per length on a band of the width",
    "distribution": "largest load distribution factor K_Hbeta",
    "root_stress": "largest tooth-root stress",
}
UNITS: Mapping[str, str] = {
    "ste": "um",
    "pressure": "MPa",
    "line_load": "N/mm",
    "distribution": "",
    "root_stress": "MPa",
}
MAX_LINEAR_ERROR = 0.1  # of the band by derivatives
LIMIT_RTOL = 1e-3  # within which a magnitude is at its limit
RELIEF_COLUMNS: Columns = {
    "relief": lambda row: row["relief"],
    "magnitude\num": cell("magnitude_um", 4),
    "length\nbase pitches": cell("length_pitches", 4),
    "begins at\ndiameter [mm]": cell("start_diameter_mm", 6),
    "length on line\nof action [mm]": cell("length_mm", 4),
}
LEAD_COLUMNS: Columns = {
    "lead": lambda row: row["lead"],
    "depth\num": cell("size_um", 4),
    "length\nmm": lambda row: (
        "" if row["length_mm"] is None else f"{row['length_mm']:.4g}"
    ),
}
TORQUE_COLUMNS: Columns = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "p-p of STE\nbefore [um]": cell("before_um", 4),
    "p-p of STE\nafter [um]": cell("after_um", 4),
}
MISALIGNMENT_COLUMNS: Columns = {
    "misalignment\num": lambda row: f"{row['misalignment_um']:g}"
}
# titles and units of columns of values over the width
OVER_WIDTH: Mapping[Quantity, tuple[str, str]] = {
    "distribution": ("K_Hbeta", ""),
    "line_load": ("band load", " [N/mm]"),
    "pressure": ("pressure", " [MPa]"),
    "root_stress": ("root stress", " [MPa]"),
}
COMPROMISE_COLUMNS: Columns = {
    "at the lowest\ntorque [um]": cell("lowest_um", 4),
    "at the highest\ntorque [um]": cell("highest_um", 4),
    "magnitudes\num": lambda row: ", ".join(f"{x:.4g}" for x in row["magnitudes_um"]),
    "lengths\nbase pitches": lambda row: ", ".join(
        f"{x:.3g}" for x in row["lengths_pitches"]
    ),
}


# ends of names of rows, and of columns in units of SI with the factor to them
COLUMN_UNITS = {"_um": ("_m", UM), "_N_per_mm": ("_N_per_m", 1e3), "_MPa": ("_Pa", 1e6)}


def _in_si_units(name: str) -> tuple[str, float]:
    """Column of a value of rows, and the factor of its unit."""
    for end, (si_end, factor) in COLUMN_UNITS.items():
        if name.endswith(end):
            return name.removesuffix(end) + si_end, factor
    return name, 1.0


@dataclass(frozen=True, eq=False)
class ReliefResult(StudyResult):
    """Best reliefs and leads, and what they do.

    reliefs, leads : place, size and sensitivity of each
    topography : its key in a mesh, and the keys in it; None without
    left_out : those that were sought and change the objective too little
    max_magnitude_um : largest relief that is allowed
    lead_limits : lowest and highest depth of each lead [um]
    max_topography_um : largest depth of a topography that is allowed, None without
    objective : static one, of vibration the largest peak to peak
    before, after : of it, in the unit of its quantity
    rows : peak to peak of the transmission error, and largest values over the width, in
        all cases of misalignment and torque, before and after
    shown : the same at the torques of the figure
    evaluations : solutions of the mesh cycle during the searches
    vibration : RMS of the dynamic transmission error over speeds, and peaks
    front : compromises between the lowest and the highest torque
    tolerance : objective of reliefs with deviations
    tables : of the gear set with the reliefs, as in its file
    complete : whether the search for the least vibration came to its end
    """

    study: Any
    gear_set: str
    meshes: list[int]
    reliefs: list[dict[str, Any]]
    leads: list[dict[str, Any]]
    topography: dict[str, Any] | None
    objective: ReliefObjective
    before: float
    after: float
    rows: list[dict[str, float]]
    shown: list[dict[str, float]]
    evaluations: int
    vibration: dict[str, Any] | None
    front: list[dict[str, Any]]
    tolerance: dict[str, float] | None
    warnings: list[str]
    tables: dict[str, Any]
    left_out: list[str]
    max_magnitude_um: float
    lead_limits: Mapping[str, tuple[float, float]]
    max_topography_um: float | None
    complete: bool = True

    @cached_property
    def summary(self) -> dict[str, Any]:
        values: dict[str, Any] = {
            "gear_set": self.gear_set,
            "mesh": self.study.mesh,
            "meshes": self.meshes,
            "objective": self.study.objective,
            f"objective_before{self._unit_end}": self._objective_before_and_after[0],
            f"objective_after{self._unit_end}": self._objective_before_and_after[1],
            "reliefs": self.reliefs,
            "leads": self.leads,
            "topography": self.topography,
            "left_out": self.left_out,
            "max_relief_um": self.max_magnitude_um,
            "torques": self.rows,
            "starts": self.study.starts,
            "evaluations": self.evaluations,
        }
        if self.study.objective == "harmonics":
            values["harmonics"] = list(self.study.harmonics)
        if self.vibration:
            values["vibration"] = self.vibration
        if self.front:
            values["compromises"] = self.front
        if self.tolerance:
            values["tolerance"] = self.tolerance
        return values | {"warnings": [*self.warnings, *self._doubtful_results()]}

    @property
    def _objective_before_and_after(self) -> tuple[float, float]:
        """Objective before and after, of vibration its peak [um]."""
        if self.vibration:
            return self.vibration["peak_before_um"], self.vibration["peak_after_um"]
        return self.before, self.after

    @property
    def _unit(self) -> str:
        """Unit of the objective, of a sum none."""
        if self.objective.others:
            return ""
        return UNITS[QUANTITY_OF[self.objective.name]]

    @property
    def _unit_end(self) -> str:
        """What ends the names of values of the objective."""
        unit = self._unit.replace("/", "_per_")
        return f"_{unit}" if unit else ""

    def _with_unit(self, value: float) -> str:
        return f"{value:.4g} {self._unit}".rstrip()

    def _doubtful_results(self) -> Iterator[str]:
        """Yield warnings of the search and of the tolerances."""
        before, after = self._objective_before_and_after
        if after >= before:
            least = f"{before:.4g} um" if self.vibration else self._with_unit(before)
            text = f"no relief within the limits gives less than {least}"
            yield with_code("W28", text)
        yield from self._limit_warning()
        if not self.complete:
            text = f"the search for the least vibration ended after {self._sweep_text}"
            yield with_code("W31", text)
        if self.tolerance and self.tolerance["difference"] > MAX_LINEAR_ERROR:
            error = 100.0 * self.tolerance["difference"]
            text = (
                f"the effect of the tolerances by derivatives is off by {error:.0f} %"
            )
            yield with_code("W32", text)

    def _limit_warning(self) -> Iterator[str]:
        """A warning of reliefs whose magnitude ends at the limit."""
        largest_um = self.max_magnitude_um
        names = [
            relief["relief"]
            for relief in self.reliefs
            if relief["magnitude_um"] >= (1.0 - LIMIT_RTOL) * largest_um
        ]
        if names:
            text = (
                f"{' and '.join(names)}: the magnitude ends at the largest allowed, "
                f"{largest_um:.4g} um, which --max-relief-um raises"
            )
            yield with_code("W37", text)
        ends = [
            row["lead"]
            for row in self.leads
            if abs(row["size_um"])
            >= (1.0 - LIMIT_RTOL) * max(map(abs, self.lead_limits[row["lead"]]))
        ]
        if ends:
            largest_um = max(map(abs, self.lead_limits[ends[0]]))
            text = (
                f"{' and '.join(ends)}: the depth ends at the largest allowed, "
                f"{largest_um:.4g} um, which --max-lead-um raises"
            )
            yield with_code("W37", text)

        if self.topography and self.max_topography_um:
            largest = max(map(max, self.topography["depth_um"]))
            if largest >= (1.0 - LIMIT_RTOL) * self.max_topography_um:
                text = (
                    f"{self.topography['topography']}: a depth ends at the largest "
                    f"allowed, {self.max_topography_um:.4g} um, which "
                    "--max-topography-um raises"
                )
                yield with_code("W37", text)

    @property
    def _sweep_text(self) -> str:
        values = self.vibration or {}
        return f"{values['designs']} designs, {values['sweeps']} sweeps"

    @property
    def more_tables(self) -> dict[str, Table]:
        return {"torques": self._torque_table, "pareto": self._compromise_table}

    @property
    def _compromise_table(self) -> Table:
        """A row for every compromise."""
        places = PLACES[: len(self.front[0]["magnitudes_um"])] if self.front else ()
        names = (
            *("peak_to_peak_lowest_m", "peak_to_peak_highest_m"),
            *(f"{place}_magnitude_m" for place in places),
            *(f"{place}_length_pitches" for place in places),
        )
        rows = [
            [
                *(UM * point[name] for name in ("lowest_um", "highest_um")),
                *(UM * size for size in point["magnitudes_um"]),
                *point["lengths_pitches"],
            ]
            for point in self.front
        ]
        ends = {
            f"{which} torque [N m]": f"{torque:g}"
            for which, torque in self._torque_range
        }
        return Table(names, lambda: rows, ends | self.study.gear_set.entries)

    @property
    def _torque_range(self) -> list[tuple[str, float]]:
        torques = [row["torque_Nm"] for row in self.rows]
        return [("lowest", min(torques)), ("highest", max(torques))]

    @property
    def _torque_table(self) -> Table:
        """A row for every torque."""
        names = ["torque_Nm", "peak_to_peak_before_m", "peak_to_peak_after_m"]
        of_reliefs = {
            row["relief"]: f"{row['magnitude_um']} um, {row['length_pitches']} pitches"
            for row in self.reliefs
        }
        of_leads = {
            row["lead"]: f"{row['size_um']} um"
            + (f", {row['length_mm']} mm" if row["length_mm"] else "")
            for row in self.leads
        }
        if self.topography:
            of_leads[self.topography["topography"]] = (
                f"{self.topography['depth_um']} um"
            )
        more = {
            name: _in_si_units(name)
            for name in self.rows[0]
            if name not in ("torque_Nm", "before_um", "after_um")
        }
        rows = [
            [
                row["torque_Nm"],
                *(UM * row[f"{when}_um"] for when in ("before", "after")),
                *(factor * row[name] for name, (_, factor) in more.items()),
            ]
            for row in self.rows
        ]
        names += [column for column, _ in more.values()]
        header = of_reliefs | of_leads | self.study.gear_set.entries
        return Table(names, lambda: rows, header)

    @property
    def text(self) -> str:
        """Text of the gear-set file with the reliefs."""
        return toml_text(self.tables)

    def write(self, path: str | Path) -> None:
        """Write the gear-set file."""
        write_text(path, toml_text(relative_tables(self.tables, Path(path))))

    @property
    def figures(self) -> Mapping[str, Draw]:
        figures: dict[str, Draw] = {"plot": self._draw}
        return figures | {"front": self._draw_front} if self.front else figures

    @property
    def _title(self) -> str:
        return f"{self.gear_set}, mesh {self.study.mesh}"

    def _draw(self) -> Figure:
        from lumped.figures.drawing import panels

        count = 2 if self.vibration else 1
        figure, axes = panels(count, size=(8.0, 4.5 if count == 1 else 7.5))
        static_axes, *vibration_axes = (axis for row in axes for axis in row)
        for name, label, style in (
            ("before_um", "before", "--"),
            ("after_um", "best design", "-"),
        ):
            self._draw_cases(static_axes, name, label, style)
        static_axes.set_xlabel("torque on the driving gear [N m]")
        static_axes.set_ylabel("peak to peak of the static\ntransmission error [um]")
        static_axes.set_ylim(bottom=0.0)
        static_axes.legend(fontsize=8)
        static_axes.set_title(self._title)
        for axis in vibration_axes:
            self._draw_bands(axis)
        return figure

    def _draw_cases(self, axes: Axes, name: str, label: str, style: str) -> None:
        """A curve over torque for each misalignment."""
        from lumped.figures.drawing import color_of

        cases: dict[float | None, list[dict[str, float]]] = {}
        for row in self.shown:
            cases.setdefault(row.get("misalignment_um"), []).append(row)
        for i, (misalignment_um, rows) in enumerate(cases.items()):
            torques = [row["torque_Nm"] for row in rows]
            at = (
                ""
                if misalignment_um is None
                else f", misaligned by {misalignment_um:g} um"
            )
            axes.plot(
                torques,
                [row[name] for row in rows],
                style,
                color=color_of(i),
                marker="o" if len(torques) == 1 else "",
                label=f"{label}{at}",
            )

    def _draw_bands(self, axes: Any) -> None:
        values = self.vibration or {}
        labels = {
            "before_um": "before",
            "static_um": "relief of least static peak to peak",
            "after_um": "relief of least vibration",
        }
        for name, label in labels.items():
            rms = np.array(values[name])
            rms[~np.isfinite(rms)] = np.nan
            axes.plot(values["speeds_Hz"], rms, label=label)
        axes.set_xlabel("mesh frequency of the first mesh [Hz]")
        axes.set_ylabel("largest RMS of the dynamic\ntransmission error [um]")
        axes.set_yscale("log")
        axes.legend(fontsize=8)

    def _draw_front(self) -> Figure:
        from lumped.figures.drawing import panels

        figure, ((axes,),) = panels(1, size=(6.5, 5.0))
        points = [(row["lowest_um"], row["highest_um"]) for row in self.front]
        axes.plot(*zip(*points, strict=True), marker="o", label="compromises")
        before, after = (
            [rows[i][name] for i in self._extreme_rows]
            for rows, name in ((self.rows, "before_um"), (self.rows, "after_um"))
        )
        axes.plot(*before, "s", label="before")
        axes.plot(*after, "D", label=f"best relief, {self.study.objective}")
        low, high = (torque for _, torque in self._torque_range)
        axes.set_xlabel(f"peak to peak of the STE at {low:g} N m [um]")
        axes.set_ylabel(f"peak to peak of the STE at {high:g} N m [um]")
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        axes.legend(fontsize=8)
        axes.set_title(self._title)
        return figure

    @property
    def _extreme_rows(self) -> tuple[int, int]:
        torques = [row["torque_Nm"] for row in self.rows]
        return int(np.argmin(torques)), int(np.argmax(torques))

    def page(self) -> Page:
        values = self.summary
        orders = ", ".join(map(str, self.study.harmonics))
        measure = OBJECTIVE_TEXTS[self.study.objective].format(orders=orders)
        if self.objective.others:
            also = ", ".join(f"{weight:g} {name}" for name, weight in self.study.also)
            measure += f" over that before, plus {also} over theirs,"
        before, after = map(self._with_unit, (self.before, self.after))
        yield (
            f"{self.gear_set} mesh {self.study.mesh}, {measure} {before} before, "
            f"{after} after"
        )
        if len(self.meshes) > 1:
            mesh_numbers = ", ".join(map(str, self.meshes))
            yield f"the same flanks meet in meshes {mesh_numbers}: all have the relief"
        if self.vibration:
            yield (
                "peak RMS of the dynamic transmission error {peak_before_um:.4g} um "
                "before, {peak_static_um:.4g} um with the least static peak to peak, "
                "{peak_after_um:.4g} um after"
            ).format_map(self.vibration)
        if self.reliefs:
            title = "Best relief" + (", none left out" if self.vibration else "")
            columns = RELIEF_COLUMNS | self._change_column
            yield RowTable(self.reliefs, columns, title, ("relief",))
        if self.leads:
            columns = LEAD_COLUMNS | self._change_column
            yield RowTable(self.leads, columns, "Best lead modification", ("lead",))
        if self.topography:
            columns, rows = self._topography_table
            yield RowTable(rows, columns, f"Best {self._topography_name} [um]", ())
        early_reliefs = [r["relief"] for r in self.reliefs if r["in_single_contact"]]
        if early_reliefs:
            yield (
                f"{' and '.join(early_reliefs)}: begins inside single contact, so that "
                "one pair alone never bears the load on unrelieved flanks"
            )
        if self.left_out:
            yield (
                f"left out, as the objective changes by less than "
                f"{100.0 * MIN_EFFECT:g} % of that without any: "
                + ", ".join(self.left_out)
            )
        yield RowTable(self.rows, self._case_columns, "At the torques", ())
        if self.front:
            yield RowTable(self.front, COMPROMISE_COLUMNS, "Compromises", ())
            yield from self._compromise_notes
        if self.tolerance:
            yield with_code("E22", self._tolerance_text)
        yield (
            f"{values['starts']} starts, {values['evaluations']} solutions of the mesh "
            "cycle" + (f", {self._sweep_text}" if self.vibration else "")
        )

    @property
    def _change_column(self) -> Columns:
        unit = f" [{self._unit}]" if self._unit else ""
        return {f"objective{unit}\nby 1 um more": cell("objective_per_um", 3)}

    @property
    def _topography_name(self) -> str:
        return (self.topography or {})["topography"].replace("_", " ")

    @property
    def _topography_table(self) -> tuple[Columns, list[dict[str, Any]]]:
        """Depths over roll angle, and in columns over place."""
        table = self.topography or {}
        columns: Columns = {"roll angle\ndeg": cell("roll_angle_deg", 5)}
        for place in table["place_mm"]:
            columns |= {f"at\n{place:.4g} mm": cell(f"at_{place}_mm", 4)}
        rows = [
            {"roll_angle_deg": angle}
            | {
                f"at_{place}_mm": depth
                for place, depth in zip(table["place_mm"], depths, strict=True)
            }
            for angle, depths in zip(
                table["roll_angle_deg"], table["depth_um"], strict=True
            )
        ]
        return columns, rows

    @property
    def _case_columns(self) -> Columns:
        columns = dict(TORQUE_COLUMNS)
        if "misalignment_um" in self.rows[0]:
            columns = MISALIGNMENT_COLUMNS | columns
        for quantity, (title, unit) in OVER_WIDTH.items():
            for when in ("before", "after"):
                name = LARGEST[quantity].format(when)
                if name in self.rows[0]:
                    columns[f"{title}\n{when}{unit}"] = cell(name, 4)
        return columns

    @property
    def _compromise_notes(self) -> Iterator[str]:
        """Why there are fewer compromises than were sought."""
        sought, count = self.study.compromises, len(self.front)
        if count < sought:
            yield (
                f"{count} of {sought} searches: the others ended at one of these, or "
                "at a design that is no better than one of these at either torque"
            )

    @property
    def _tolerance_text(self) -> str:
        return (
            "95 % of gears with these deviations are below {by_derivatives_um:.4g} um "
            "by derivatives, {by_solutions_um:.4g} um by {samples} solutions, "
            "{nominal_um:.4g} um without"
        ).format_map(self.tolerance or {})
