"""The result of `fegear stiffness`: its page, tables and figures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from fegear.commands.stiffness.crack_tips import CrackIntensities
from fegear.commands.stiffness.face_figure import draw_face
from fegear.commands.stiffness.figure import draw_table
from fegear.commands.stiffness.path_figure import draw_harris, draw_path
from fegear.commands.stiffness.sheet_figure import draw_sheet
from fegear.files.codes import with_code
from fegear.files.memory import peak_memory_MB
from fegear.gearset.helix import hand
from fegear.gearset.planes import plane_in_words
from fegear.gearset.yielding import SHAFTS, YIELD
from fegear.statics.harmonics import Harmonic
from fegear.statics.mesh_result import StaticsResult, discretisation
from fegear.statics.settings import CORNERS
from fegear.statics.table_warnings import table_warnings
from fegear.studies.columns import meanings
from fegear.studies.page import Columns, Page, RowTable, cell
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from lumped.train.table import MeshTable

# Way without load [m] above which it is said, far above that of round-off
MIN_FALL = 1e-7

COLUMNS: Columns = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "mean k\n1e8 N/m": cell("mean_stiffness_N_per_m", 5, 1e-8),
    "k p-p/\nmean k": cell("peak_to_peak_over_mean"),
    "local k\n1e8 N/m": cell("mean_local_stiffness_N_per_m", 5, 1e-8),
    "STE\nmean um": cell("ste_mean_um"),
    "STE\np-p um": cell("ste_peak_to_peak_um"),
    "NLTE\np-p um": cell("nlte_peak_to_peak_um"),
    "friction\nbending": cell("friction_bending_ratio_mean", 3),
}

STRESS_COLUMNS: Columns = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "p pitch\nMPa": cell("pressure_at_pitch_point_plane_strain_MPa", none="none"),
    "p max\nMPa": cell("max_pressure_plane_strain_MPa", none="none"),
    "at position\nbase pitches": cell("max_pressure_at_position", 4, none="none"),
    "root stress\ndriver MPa": cell("driver_root_stress_MPa", 4),
    "root stress\ndriven MPa": cell("driven_root_stress_MPa", 4),
    "loss factor\nH_V": cell("loss_factor", 4),
}

HARMONIC_COLUMNS = (
    *("torque_Nm", "order", "ste_amplitude_m", "ste_phase_rad"),
    *("stiffness_amplitude_N_per_m", "stiffness_phase_rad"),
)

FACE_COLUMNS: Columns = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "K_Hbeta": cell("load_distribution_factor", 4),
    "line load\nmax N/mm": cell("largest_line_load_N_per_mm", 4),
    "at\nmm": cell("largest_line_load_at_mm", 3),
    "at position\nbase pitches": cell("largest_line_load_at_position", 4),
    "on the path\nmax N/mm": cell("largest_line_load_on_path_N_per_mm", 4),
    "axial force\ndriver N": cell("driver_axial_force_N", 4),
    "axial force\ndriven N": cell("driven_axial_force_N", 4),
    "load centre\nmean mm": cell("load_center_mm", 3),
    "load centre\np-p mm": cell("load_center_peak_to_peak_mm", 3),
}
FACE_TITLE = (
    "Loads over the face width, places from its middle, positive toward the far end as "
    "axial forces are; line load of all contacts, tip corners among them, and of those "
    "on the path; K_Hbeta: largest load on a 24th of the width over the mean, of loads "
    "that are means over the cycle"
)

ROOT_COLUMNS: Columns = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "driver\nMPa": cell("driver_root_stress_MPa", 4),
    "driver\nat mm": cell("driver_root_stress_at_mm", 3),
    "driver\nK_Fbeta": cell("driver_root_stress_factor", 4),
    "driven\nMPa": cell("driven_root_stress_MPa", 4),
    "driven\nat mm": cell("driven_root_stress_at_mm", 3),
    "driven\nK_Fbeta": cell("driven_root_stress_factor", 4),
}
ROOT_TITLE = (
    "Root stress over the face width, tension across the fillets on the side of the "
    "loaded flanks; K_Fbeta: the largest over the mean over the width, of "
    "values that are the largest over the cycle"
)

DROP_COLUMNS: Columns = {
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "largest\ndrop %": cell("largest_stiffness_drop_percent", 4),
    "at position\nbase pitches": cell("largest_drop_at_position", 5),
}

DROP_TITLE = "Mesh stiffness against that of the same gears without faults"
STRESS_TITLE = (
    "Contact pressure in plane strain without tip corners and kinks, root stress and "
    "loss factor"
)

CRACK_COLUMNS = (
    *("torque_Nm", "position", "gear", "tooth"),
    *("mode1_stress_intensity_MPa_sqrt_m", "mode2_stress_intensity_MPa_sqrt_m"),
    *("energy_release_rate_J_per_m2", "energy_release_rate_error_J_per_m2"),
)

FACE_LOAD_COLUMNS = (
    *("torque_Nm", "position", "pair", "place_mm", "path_position"),
    *("line_load_N_per_mm", "max_pressure_MPa"),
)

ROOT_STRESS_COLUMNS = (
    *("torque_Nm", "position", "pair", "gear", "place_mm", "root_stress_MPa"),
)

CRACK_TIP_COLUMNS: Columns = {
    "gear": lambda row: row["gear"],
    "tooth": lambda row: f"{row['tooth']}",
    "torque\nN m": lambda row: f"{row['torque_Nm']:g}",
    "K_I\nMPa m^0.5": cell("mode1_stress_intensity_MPa_sqrt_m", 4),
    "K_II\nMPa m^0.5": cell("mode2_stress_intensity_MPa_sqrt_m", 4),
    "release\nrate J/m2": cell("energy_release_rate_J_per_m2", 4),
    "estimated\nerror J/m2": cell("energy_release_rate_error_J_per_m2", 2),
    "at position\nbase pitches": cell("position", 5),
}

ROOT_STRESS_NOTE = (
    "root stress is that of teeth without a crack: while a cracked tooth carries the "
    "load, that of the fillets of its neighbours"
)

CRACK_TIP_TITLE = "Tips of cracks where their energy release rate is largest"


@dataclass(frozen=True, eq=False)
class StiffnessResult(StudyResult):
    """A mesh table with what its gears are warned of.

    healthy : the table of the same gears without faults, None where they have none
    unsolved : torques [N m] that are left out, each with the reason
    """

    study: Any
    gear_set: str
    solved: StaticsResult
    gear_warnings: tuple[str, ...] = ()
    healthy: MeshTable | None = None
    crack_tips: tuple[CrackIntensities, ...] = ()
    unsolved: tuple[tuple[float, str], ...] = ()

    @property
    def complete(self) -> bool:
        return not self.unsolved

    @property
    def failure(self) -> str:
        """Torques that were not solved."""
        listed = ", ".join(f"{torque:.12g}" for torque, _ in self.unsolved)
        return f"torque = {listed} N m; not solved" if listed else ""

    @property
    def _warnings(self) -> Iterator[str]:
        yield from self.gear_warnings
        for torque, reason in self.unsolved:
            place = f"mesh {self.solved.mesh} at {torque:.12g} N m"
            yield with_code("W66", f"{place} is left out: {reason}")
        yield from table_warnings(self.solved)

    @cached_property
    def summary(self) -> dict[str, Any]:
        solved, elements = self.solved, self.study.elements
        return {
            "gear_set": self.gear_set,
            "mesh": solved.name,
            "teeth": solved.teeth,
            "plane": solved.table.header["plane"],
            "resolution": elements.resolution,
            "corner_contact": CORNERS[elements.corner_contact],
            "friction_coefficient": elements.friction,
            "shafts_yield": SHAFTS in solved.table.header,
            "face_width_mm": 1e3 * solved.problem.face_width,
            "contact_ratio": solved.problem.pair.contact_ratio,
            "positions": int(solved.table.position.size),
            "base_pitches": solved.pitches,
            "torques": [
                figures
                | self._harmonics_at_torque(t)
                | self._drop_at_torque(t)
                | discretisation(solved.errors[t] if solved.errors else None)
                for t, figures in enumerate(solved.key_figures)
            ],
            "crack_tips": list(self._largest_at_tips()),
            "evidence": solved.evidence,
            "warnings": [*self._warnings],
            "seconds": {name: round(s, 4) for name, s in solved.seconds.items()},
            "peak_memory_MB": round(peak_memory_MB(), 1),
        }

    @property
    def table(self) -> Table:
        """A row for every torque and position."""
        table = self.solved.table
        return Table.of(table.flat, {**table.header, **self.study.gear_set.entries})

    @cached_property
    def _harmonics(self) -> list[list[dict[str, float]]]:
        """Values but the torque, by torque and order."""
        count, solved = self.study.harmonic_count, self.solved
        columns = (
            solved.harmonics(name, count) for name in ("ste_m", "stiffness_N_per_m")
        )
        return [
            [_harmonic(*parts) for parts in zip(*at_load, strict=True)]
            for at_load in zip(*columns, strict=True)
        ]

    def _harmonics_at_torque(self, t: int) -> dict[str, Any]:
        return {"harmonics": self._harmonics[t]}

    def _drop_at_torque(self, t: int) -> dict[str, float]:
        """Largest drop of stiffness by faults, and where; nothing without faults."""
        if self.healthy is None:
            return {}
        table = self.solved.table
        healthy = self.healthy["stiffness_N_per_m"][t]
        turn = np.resize(healthy, table.position.size)
        drop = 1.0 - table["stiffness_N_per_m"][t] / turn
        worst = int(drop.argmax())
        return {
            "largest_stiffness_drop_percent": 100.0 * float(drop[worst]),
            "largest_drop_at_position": float(table.position[worst]),
        }

    def _largest_at_tips(self) -> Iterator[dict[str, Any]]:
        """Values of each crack at each torque where it would release most energy."""
        torque, position = self.solved.cycle.torque, self.solved.cycle.position
        for tip in self.crack_tips:
            for t, n in enumerate(tip.energy_release_rate.argmax(axis=1)):
                yield _values_at_crack_tip(
                    tip, float(torque[t]), float(position[n]), (t, n)
                )

    def _crack_rows(self) -> list[dict[str, Any]]:
        torque, position = self.solved.cycle.torque, self.solved.cycle.position
        return [
            _values_at_crack_tip(tip, float(torque[t]), float(position[n]), (t, n))
            for tip in self.crack_tips
            for t, n in np.ndindex(tip.error.shape)
        ]

    def _root_rows(self) -> list[dict[str, Any]]:
        """Root stress over the width of all teeth in pairs that carry load."""
        cycle, roots = self.solved.cycle, self.solved.roots
        over_width = roots.over_width if roots else ()
        return [
            {
                "torque_Nm": float(cycle.torque[t]),
                "position": float(cycle.position[n]),
                "pair": int(cycle.teeth[k]),
                "gear": gear,
                "place_mm": 1e3 * float(place),
                "root_stress_MPa": 1e-6 * float(stress),
            }
            for t, n, k in np.argwhere(cycle.load > 0.0).tolist()
            for gear, root in zip(("driver", "driven"), over_width, strict=False)
            for place, stress in zip(root.place, root.stress[t, n, k], strict=True)
        ]

    def _face_rows(self) -> list[dict[str, Any]]:
        """Loads of slices that carry some."""
        cycle, face = self.solved.cycle, self.solved.cycle.face
        if face.is_uniform:
            return []
        return [
            {
                "torque_Nm": float(cycle.torque[t]),
                "position": float(cycle.position[n]),
                "pair": int(cycle.teeth[k]),
                "place_mm": 1e3 * float(face.place[m]),
                "path_position": float(face.path_position[n, k, m]),
                "line_load_N_per_mm": 1e-3 * float(face.load[t, n, k, m]),
                "max_pressure_MPa": 1e-6 * float(face.pressure[t, n, k, m]),
            }
            for t, n, k, m in np.argwhere(face.load > 0.0).tolist()
        ]

    @property
    def more_tables(self) -> dict[str, Table]:
        harmonics = [
            {"torque_Nm": torque, **values}
            for torque, every in zip(
                self.solved.cycle.torque.tolist(), self._harmonics, strict=True
            )
            for values in every
        ]
        tables = {
            "harmonics": (harmonics, HARMONIC_COLUMNS),
            "cracks": (self._crack_rows(), CRACK_COLUMNS),
            "face_loads": (self._face_rows(), FACE_LOAD_COLUMNS),
            "root_stresses": (self._root_rows(), ROOT_STRESS_COLUMNS),
        }
        header = {
            "gear set": self.gear_set,
            "mesh": self.solved.name,
            **self.study.gear_set.entries,
        }
        return {
            name: Table.of_rows(
                rows, header | meanings("stiffness", *columns, table=name), columns
            )
            for name, (rows, columns) in tables.items()
        }

    @property
    def figures(self) -> dict[str, Draw]:
        is_uniform = self.solved.cycle.face.is_uniform
        over_face = {"face": partial(draw_face, self.solved, self._title)}
        draw_page = draw_table if is_uniform else draw_sheet
        return {
            "plot": partial(draw_page, self.solved, self._title),
            "path": partial(draw_path, self.solved, self._title),
            "harris": partial(draw_harris, self.solved, self._title),
            **({} if is_uniform else over_face),
        }

    @property
    def _title(self) -> str:
        head, end = (
            text.format_map(self.summary)
            for text in (
                "{gear_set}, mesh {mesh}, teeth {teeth}, contact ratio "
                "{contact_ratio:.3f}",
                "friction {friction_coefficient:g}, corner contact {corner_contact}, "
                "face width {face_width_mm:g} mm",
            )
        )
        plane = plane_in_words(self.summary["plane"])
        if self.summary["shafts_yield"]:
            plane += " on shafts that yield"
        return f"{head}{self._helix_text}\n{plane}, {end}"

    @property
    def _helix_text(self) -> str:
        """Overlap ratio and helix angle of helical gears, for titles."""
        teeth = self.solved.problem.pair.driver
        if not teeth.twist:
            return ""
        angle = math.degrees(math.atan(abs(teeth.twist) * teeth.reference_radius))
        overlap = self.summary["torques"][0]["overlap_ratio"]
        return f"\noverlap ratio {overlap:.3f}, helix angle {angle:.4g} deg"

    def _carried_over(self) -> str:
        """Which of both stiffnesses describes vibration about the load elsewhere."""
        mean = "mean k is the load over the deflection from no load"
        problem = self.solved.problem
        gap = problem.solver.gap_with(problem.leads, problem.solver.places)
        if np.ptp(gap) or any(problem.topographies):
            last = self.summary["torques"][-1]
            names = "mean_stiffness_N_per_m", "mean_local_stiffness_N_per_m"
            below = 100.0 * (1.0 - last[names[0]] / last[names[1]])
            mean += (
                f", which closes the gap over the width first: {below:.2g} % below "
                f"local k at {last['torque_Nm']:g} N m"
            )
        return f"for vibration in other programs take local k, the slope; {mean}"

    def _fallen_back(self) -> Iterator[str]:
        """How far gears fall back where tips carry in place of damaged teeth."""
        cycle, flanks = self.solved.cycle, self.solved.problem.flanks
        fallen = np.ptp(cycle.no_load[0])
        damaged = [f.faults for f in flanks if f.faults is not None]
        if fallen > MIN_FALL and any(
            one.missing or one.has_broken_tips for one in damaged
        ):
            position = self.solved.table.position[cycle.no_load[0].argmax()]
            share = fallen / self.solved.problem.pair.base_pitch
            yield (
                "beside damaged teeth tip corners carry past the path of contact: "
                f"without load the driver runs ahead by up to {1e3 * fallen:.4g} mm, "
                f"{100.0 * share:.3g} % of the base pitch, at position {position:.5g}"
            )

    def page(self) -> Page:
        values = self.summary
        yield (
            "{gear_set} mesh {mesh}, teeth {teeth}, face width {face_width_mm:g} mm, "
            "plane {plane}, resolution {resolution}, friction {friction_coefficient:g},"
            " corner contact {corner_contact}"
        ).format_map(values)
        overlap = values["torques"][0].get("overlap_ratio")
        ratio = f"contact ratio {values['contact_ratio']:.4f}"
        yield f"{ratio}, overlap ratio {overlap:.4f}" if overlap else ratio
        if values["shafts_yield"]:
            yield f"{SHAFTS} {YIELD}, which is in all values; --shafts off holds them"
        if values["base_pitches"] > 1:
            yield (
                f"with {'pitch errors' if self.healthy is None else 'faults'}, tooth "
                f"pairs repeat after {values['base_pitches']} base pitches: all of "
                "them are in the table"
            )
        yield from self._fallen_back()
        yield RowTable(values["torques"], COLUMNS, text_columns=())
        yield self._carried_over()
        yield RowTable(values["torques"], STRESS_COLUMNS, STRESS_TITLE, text_columns=())
        if not self.solved.cycle.face.is_uniform:
            yield RowTable(values["torques"], FACE_COLUMNS, FACE_TITLE, text_columns=())
            if self.solved.roots is not None:
                yield RowTable(
                    values["torques"], ROOT_COLUMNS, ROOT_TITLE, text_columns=()
                )
            yield from _axial_senses(self.solved)
        if values["crack_tips"]:
            yield ROOT_STRESS_NOTE
        if self.healthy is not None:
            yield RowTable(values["torques"], DROP_COLUMNS, DROP_TITLE, text_columns=())
        if values["crack_tips"]:
            yield RowTable(
                values["crack_tips"],
                CRACK_TIP_COLUMNS,
                CRACK_TIP_TITLE,
                text_columns=("gear",),
            )
        yield from _evidence_lines(values["evidence"])
        stages = ", ".join(f"{name} {s:.3f} s" for name, s in values["seconds"].items())
        peak = values["peak_memory_MB"]
        memory = f"; peak memory {peak:.0f} MB" if math.isfinite(peak) else ""
        yield f"time: {stages}{memory}"


def _harmonic(error: Harmonic, stiffness: Harmonic) -> dict[str, float]:
    return {
        "order": error.order,
        "ste_amplitude_m": error.amplitude,
        "ste_phase_rad": error.phase,
        "stiffness_amplitude_N_per_m": stiffness.amplitude,
        "stiffness_phase_rad": stiffness.phase,
    }


def _values_at_crack_tip(
    tip: CrackIntensities, torque: float, position: float, index: tuple[int, int]
) -> dict[str, Any]:
    """Values of a crack at a torque and position, by their index."""
    opening, sliding = (1e-6 * tip.stress_intensity[index]).tolist()
    return {
        "torque_Nm": torque,
        "position": position,
        "gear": tip.gear,
        "tooth": tip.tooth,
        "mode1_stress_intensity_MPa_sqrt_m": opening,
        "mode2_stress_intensity_MPa_sqrt_m": sliding,
        "energy_release_rate_J_per_m2": float(tip.energy_release_rate[index]),
        "energy_release_rate_error_J_per_m2": float(tip.error[index]),
    }


def _evidence_lines(values: dict[str, float | None]) -> Iterator[str]:
    if values["discretisation_ste_mean"] is not None:
        corner = values["discretisation_ste_corner"]
        peak = values["discretisation_ste_peak_to_peak"]
        distribution = values["discretisation_load_distribution_factor"]
        yield with_code(
            "E01",
            "discretisation, estimated error of STE at the worst torque: mean "
            f"{values['discretisation_ste_mean']:.1e}, on the path "
            f"{values['discretisation_ste_path']:.1e}, corner contact "
            + (f"{corner:.1e}" if corner is not None else "none")
            + ("" if peak is None else f", of its peak to peak {peak:.1e}")
            + ("" if distribution is None else f"; of K_Hbeta {distribution:.1e}"),
        )
    if values["discretisation_root_stress"] is not None:
        yield with_code(
            "E20",
            "root stress, estimated error over its peak at the worst torque: "
            f"{values['discretisation_root_stress']:.1e}",
        )
    balance = (
        "balance: complementarity {complementarity_residual:.1e}, T2/T1 against z2/z1 "
        "{torque_balance:.1e} (tilted normals of corner contact, relief and friction), "
        "its mean {work_balance:.1e} ({virtual_work:.1e} but for the tilt of deflected "
        "flanks), reciprocity {reciprocity:.1e}"
    ).format_map(values)
    yield with_code("E02", balance)


def _axial_senses(solved: StaticsResult) -> Iterator[str]:
    """Lines on where helical gears are pushed or move, nothing of spur gears."""
    if solved.cycle.face.groove:
        moved = ", ".join(
            f"{row['axial_float_um']:.4g} um at {row['torque_Nm']:g} N m, peak to peak "
            f"{row['axial_float_peak_to_peak_um']:.3g} um"
            for row in solved.key_figures
        )
        yield (
            "double helical: each half has half of the torque, the driver or its mate "
            "being free along its axis; a free driver is moved toward the far end by "
            f"{moved}; an error of the apex moves it by half of it"
        )
        return
    pair, force = solved.problem.pair, solved.key_figures[0]["driver_axial_force_N"]
    if not pair.driver.twist or not force:
        return
    ends = ("far", "near") if force > 0.0 else ("near", "far")
    senses = (
        f"{role} ({hand(gear)}-handed) toward the {end} end"
        for role, gear, end in zip(
            ("driver", "driven gear"), (pair.driver, pair.driven), ends, strict=True
        )
    )
    yield (
        f"axial force on {', on '.join(senses)}; seen from the near end the driver of "
        "the first mesh turns counter-clockwise"
    )
