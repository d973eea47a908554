"""The numbers an engineer asks of a mesh table, with units in their names."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fegear.memory import peak_memory_MB
from fegear.statics import StaticsResult


def summary(result: StaticsResult) -> dict[str, Any]:
    """Plain values, ready for JSON."""
    table, pair = result.table, result.problem.pair
    header = dict(table.header)
    return {
        "gear_set": header["gear set"],
        "mesh": header["mesh"],
        "teeth": header["teeth"],
        "plane": header["plane"],
        "resolution": header["resolution"],
        "corner_contact": header["corner contact"],
        "friction_coefficient": result.problem.friction,
        "face_width_mm": 1e3 * result.problem.face_width,
        "contact_ratio": pair.contact_ratio,
        "positions": int(table.position.size),
        "torques": [torque_summary(result, t) for t in range(table.torque_Nm.size)],
        "evidence": evidence(result),
        "seconds": {name: round(s, 4) for name, s in result.seconds.items()},
        "peak_memory_MB": round(peak_memory_MB(), 1),
    }


def torque_summary(result: StaticsResult, t: int) -> dict[str, float]:
    table = result.table
    pitch = result.cycle.teeth == 0  # the reference pair, at the pitch point at 0
    k, ste = table["stiffness_N_per_m"][t], table["ste_m"][t]
    return {
        "torque_Nm": float(table.torque_Nm[t]),
        "mean_stiffness_N_per_m": float(k.mean()),
        "peak_to_peak_over_mean": float(np.ptp(k) / k.mean()),
        "mean_local_stiffness_N_per_m": float(
            table["local_stiffness_N_per_m"][t].mean()
        ),
        "ste_mean_um": 1e6 * float(ste.mean()),
        "ste_peak_to_peak_um": 1e6 * float(np.ptp(ste)),
        "nlte_peak_to_peak_um": 1e6 * float(np.ptp(table["nlte_m"][t])),
        "pressure_at_pitch_point_MPa": 1e-6
        * float(result.cycle.pressure[t, 0, pitch][0]),
        "max_pressure_MPa": 1e-6 * float(table["max_pressure_Pa"][t].max()),
        "friction_bending_ratio_mean": float(table["friction_bending_ratio"][t].mean()),
    }


def evidence(result: StaticsResult) -> dict[str, float | None]:
    """What shows that the numbers can be trusted; relative, dimensionless."""
    error = result.error
    flanks = (result.problem.driver, result.problem.driven)
    return {
        "discretisation_ste_mean": error.mean if error else None,
        "discretisation_ste_path": error.path if error else None,
        "discretisation_ste_corner": _finite(error.corner) if error else None,
        "complementarity_residual": float(result.cycle.residual.max()),
        "torque_balance": result.torque_balance,
        "reciprocity": max(flank.reciprocity_error for flank in flanks),
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def print_summary(values: dict[str, Any]) -> None:
    """The summary as tables on the screen."""
    from rich.console import Console

    console = Console()
    console.print(
        f"[bold]{values['gear_set']}[/] mesh {values['mesh']}, teeth "
        f"{values['teeth']}, face width {values['face_width_mm']:g} mm, plane "
        f"{values['plane']}, resolution {values['resolution']}, friction "
        f"{values['friction_coefficient']:g}, corner contact "
        f"{values['corner_contact']}",
        highlight=False,
    )
    console.print(f"contact ratio {values['contact_ratio']:.4f}", highlight=False)
    console.print(_torque_table(values["torques"]))
    for line in _evidence_lines(values["evidence"]):
        console.print(line, highlight=False)
    stages = ", ".join(f"{name} {s:.3f} s" for name, s in values["seconds"].items())
    peak = values["peak_memory_MB"]
    memory = f"; peak memory {peak:.0f} MB" if math.isfinite(peak) else ""
    console.print(f"time: {stages}{memory}", highlight=False)


def _torque_table(torques: list[dict[str, float]]) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    columns = {
        "torque\nN m": ("torque_Nm", 1.0, "{:.4g}"),
        "mean k\n1e8 N/m": ("mean_stiffness_N_per_m", 1e-8, "{:.4f}"),
        "k p-p/\nmean k": ("peak_to_peak_over_mean", 1.0, "{:.4f}"),
        "local k\n1e8 N/m": ("mean_local_stiffness_N_per_m", 1e-8, "{:.4f}"),
        "STE\nmean um": ("ste_mean_um", 1.0, "{:.3f}"),
        "STE\np-p um": ("ste_peak_to_peak_um", 1.0, "{:.3f}"),
        "NLTE\np-p um": ("nlte_peak_to_peak_um", 1.0, "{:.3f}"),
        "p pitch\nMPa": ("pressure_at_pitch_point_MPa", 1.0, "{:.0f}"),
        "friction\nbending": ("friction_bending_ratio_mean", 1.0, "{:.3f}"),
    }
    for title in columns:
        table.add_column(title, justify="right", no_wrap=True)
    for row in torques:
        table.add_row(
            *(form.format(scale * row[key]) for key, scale, form in columns.values())
        )
    return table


def _evidence_lines(values: dict[str, float | None]) -> list[str]:
    lines = []
    if values["discretisation_ste_mean"] is not None:
        corner = values["discretisation_ste_corner"]
        lines.append(
            "discretisation, STE against a coarser mesh and contact grid: mean "
            f"{values['discretisation_ste_mean']:.1e}, on the path "
            f"{values['discretisation_ste_path']:.1e}, corner contact "
            + (f"{corner:.1e}" if corner is not None else "none")
        )
    lines.append(
        f"balance: complementarity {values['complementarity_residual']:.1e}, "
        f"T2/T1 against z2/z1 {values['torque_balance']:.1e} (tilted normals of "
        f"corner contact and friction), reciprocity {values['reciprocity']:.1e}"
    )
    return lines
