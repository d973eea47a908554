"""The result of `fegear motion`: its page, tables and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from fegear.files.codes import with_code
from fegear.studies.page import (
    Columns,
    ColumnTable,
    Page,
    RowTable,
    cell,
    number,
    pluralize,
)
from fegear.studies.result import Draw, StudyResult
from fegear.studies.table import Table
from fegear.studies.trains.headings import friction_of_summary
from fegear.studies.trains.model_texts import static_line
from fegear.studies.trains.responses import UNITS
from fegear.studies.trains.train_problem import TrainFacts
from lumped.figures.sweeps import draw_time_history
from lumped.steady.losses import efficiency
from lumped.steady.motion import WAVE_LEGEND, TimeHistory, wave_columns
from lumped.steady.pair_motions import CONDITIONS
from lumped.steady.response import RESPONSE_QUANTITIES
from lumped.train.equilibrium import mesh_forces_at_rest
from lumped.train.load_sharing import load_sharing

SPECTRUM_LINES = 5  # largest ones of a spectrum, in the summary

ROWS = {  # of the screen, with the key of a mesh and its factor
    "RMS of dynamic transmission error [um]": ("dte_rms_m", 1e6),
    "mean [um]": ("dte_mean_m", 1e6),
    "largest value [um]": ("dte_peak_m", 1e6),
    "largest mesh force [N]": ("force_peak_N", 1.0),
    "contact lost [% of the time]": ("contact_loss_fraction", 100.0),
    "back side [% of the time]": ("back_side_fraction", 100.0),
}

PLANET_COLUMNS: Columns = {
    "planet": lambda row: str(row["planet"]),
    "at rest": cell("load_share_at_rest", scale=100.0),
    "in motion": cell("load_share", scale=100.0),
    "largest in motion": cell("load_share_peak", scale=100.0),
}


@dataclass(frozen=True, eq=False)
class MotionResult(StudyResult):
    """A motion over time.

    torque : on the input gear [N m]
    """

    study: Any
    facts: TrainFacts
    torque: float
    motion: TimeHistory

    @cached_property
    def summary(self) -> dict[str, Any]:
        motion, response = self.motion, self.motion.response
        return {
            **self.facts.summary,
            "torque_Nm": self.torque,
            "speed_Hz": float(response.frequency),
            "status": str(response.status),
            "settling_time_s": float(response.settling_time),
            "shown_time_s": float(motion.history.time[-1]),
            "section_points": len(motion.section_rate),
            "meshes": [_mesh_summary(motion, m) for m in range(len(motion.pairs))],
            "planets": _planet_rows(motion),
            "warnings": list(self.facts.warnings),
        }

    @property
    def table(self) -> Table:
        """A row for every time."""
        columns = wave_columns(self.motion)
        return Table(
            tuple(columns),
            lambda: zip(*columns.values(), strict=True),
            {**self.facts.header, **WAVE_LEGEND},
        )

    @property
    def figures(self) -> dict[str, Draw]:
        """Time history, tooth pairs, phase plane and spectrum."""
        values = {**self.summary, "torque_of": None}
        title = (
            f"{values['gear_set']} at {values['speed_Hz']:g} Hz and "
            f"{self.torque:g} N m, model {values['model']}, {values['excitation']}, "
            f"damping ratio {values['damping_ratio']:g}{friction_of_summary(values)}"
        )
        return {"plot": lambda: draw_time_history(self.motion, title)}

    def page(self) -> Page:
        values = self.summary
        yield from self.facts.notes
        yield (
            f"{values['gear_set']} at {values['speed_Hz']:g} Hz, "
            f"{values['torque_Nm']:g} N m, model {values['model']}, "
            f"{values['excitation']}, damping ratio {values['damping_ratio']:g}"
            f"{friction_of_summary(values)}\n"
            f"{values['status']}, settled for {values['settling_time_s']:.4g} s, "
            f"{pluralize(values['section_points'], 'point')} in the Poincaré section"
        )
        if line := static_line(values):
            yield line
        if values["body_modes"] is not None:
            yield with_code(
                "E04",
                f"body modes of the gears {values['body_modes']}; those left out: "
                f"{values['body_modes_left_out']}",
            )
        columns = {
            f"mesh {mesh['mesh']}": _mesh_cells(mesh) for mesh in values["meshes"]
        }
        labels = [
            *ROWS,
            "repeats after periods of the mesh",
            "largest amplitudes [um]",
        ]
        yield ColumnTable(labels, columns)
        if values["planets"]:
            yield RowTable(values["planets"], PLANET_COLUMNS, "Load shares [%]", ())
        for mesh in values["meshes"]:
            if "efficiency" in mesh:
                yield (
                    f"mesh {mesh['mesh']}: friction takes "
                    f"{mesh['friction_power_mean_W']:.4g} W, at most "
                    f"{mesh['friction_power_largest_W']:.4g} W; efficiency "
                    f"{100.0 * mesh['efficiency']:.3f} %"
                )
            parts = mesh["contact_conditions"].items()
            if parts:
                shares = (f"{CONDITIONS[n]} {100.0 * p:.2f} %" for n, p in parts)
                yield (
                    f"mesh {mesh['mesh']}, part of the cycle in which two tooth pairs "
                    f"or more can touch: {', '.join(shares)}"
                )


def _mesh_cells(mesh: dict[str, Any]) -> list[str]:
    cells = [number(factor * mesh[name]) for name, factor in ROWS.values()]
    lines = (
        f"{1e6 * line['amplitude_m']:.3g} at {line['frequency_Hz']:.6g} Hz"
        for line in mesh["largest_lines"]
    )
    return [*cells, str(mesh["period_multiple"] or "none"), "\n".join(lines)]


def _mesh_summary(motion: TimeHistory, m: int) -> dict[str, Any]:
    response, pairs = motion.response, motion.pairs[m]
    figures = {
        UNITS[name]: float(getattr(response, name)[m])
        for name in RESPONSE_QUANTITIES
        if name in UNITS
    }
    return {
        "mesh": m + 1,
        "period_multiple": int(response.period_multiple[m]),
        **figures,
        "engaged_pairs": sorted({int(count) for count in pairs.count}),
        "contact_conditions": dict(pairs.conditions),
        **_mesh_losses(motion, m),
        "largest_lines": _largest_lines(motion, m),
    }


def _planet_rows(motion: TimeHistory) -> list[dict[str, float | None]]:
    """Load shares of the planets of a planetary set, empty for other trains."""
    train, system, history = motion.system.train, motion.system, motion.history
    if train.carrier is None:
        return []
    shares_at_rest: Sequence[float | None] = [None] * len(train.carrier.gears)
    # the coupled model at rest has equal teeth
    if system.contacts is None or max(system.common_period) == 1:
        shares_at_rest = load_sharing(train, mesh_forces_at_rest(system)).share.tolist()
    moving = load_sharing(train, history.force, history.time)
    return [
        {
            "planet": number + 1,
            "load_share_at_rest": at_rest,
            "load_share": float(moving.share[number]),
            "load_share_peak": float(moving.share_peak[number]),
        }
        for number, at_rest in enumerate(shares_at_rest)
    ]


def _mesh_losses(motion: TimeHistory, m: int) -> dict[str, float]:
    """What friction takes from a mesh over the motion; empty without friction."""
    if motion.transmitted_power is None:
        return {}
    lost = motion.friction_power
    mean = float(motion.mean_of(lost)[m])
    driver, driven = (
        float(motion.mean_of(power)[m]) for power in motion.transmitted_power
    )
    return {
        "friction_power_mean_W": mean,
        "friction_power_largest_W": float(lost[:, m].max()),
        "driver_power_mean_W": driver,
        "driven_power_mean_W": driven,
        "efficiency": efficiency(driver, driven, mean),
    }


def _largest_lines(motion: TimeHistory, m: int) -> list[dict[str, float]]:
    """The largest lines of the spectrum by falling amplitude, without the mean."""
    order = 1 + motion.spectrum[1:, m].argsort(kind="stable")[::-1][:SPECTRUM_LINES]
    places = motion.spectrum_frequency[order], motion.spectrum[order, m]
    return [
        {"frequency_Hz": float(frequency), "amplitude_m": float(amplitude)}
        for frequency, amplitude in zip(*places, strict=True)
    ]
