"""The numbers an engineer asks of a mesh table, with units in their names."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from fegear.contact.problem import corner_positions
from fegear.memory import peak_memory_MB
from fegear.unphysical import BALANCE, ESTIMATE, doubts, doubts_of_check

if TYPE_CHECKING:
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
        "base_pitches": result.pitches,
        "torques": [torque_summary(result, t) for t in range(table.torque_Nm.size)],
        "evidence": evidence(result),
        "warnings": warnings(result),
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


def _pressure_on_path(result: StaticsResult, torque: int) -> float:
    """Largest contact pressure [Pa], but for that of sharp tip corners.

    Theirs has no limit: it follows the contact grid.
    """
    inside = ~corner_positions(result.problem, result.cycle, torque)
    return float(result.table["max_pressure_Pa"][torque][inside].max(initial=0.0))


def warnings(result: StaticsResult) -> list[str]:
    """Where the result cannot be physical, or its evidence speaks against it."""
    table = result.table
    number = table.header["mesh"].split()[0]
    unphysical = [
        line
        for t, torque in enumerate(table.torque_Nm)
        for line in doubts(
            f"mesh {number} at {torque:g} N m",
            result.problem.pair.driver.module,
            transmission_error=float(np.abs(table["ste_m"][t]).max()),
            pressure=_pressure_on_path(result, t),
        )
    ]
    return unphysical or list(_doubts_of_evidence(result, f"mesh {number}"))


def _doubts_of_evidence(result: StaticsResult, where: str) -> Iterator[str]:
    check = partial(doubts_of_check, where)
    residual = float(result.cycle.residual.max())
    yield from check("gaps and pressures of the contact", residual)
    what = "deflections where loads change places"
    yield from check(what, _reciprocity_error(result), ESTIMATE)
    if result.error is not None:
        what = "mean transmission errors of two meshes"
        yield from check(what, result.error.mean, ESTIMATE)
    if result.problem.friction == 0.0:
        what = "works of both torques over the cycle"
        places = result.table.position.size / result.pitches
        missed = 2.0 * result.torque_balance / places  # by sums that step over jumps
        yield from check(what, result.work_balance, BALANCE + missed)


def evidence(result: StaticsResult) -> dict[str, float | None]:
    """What shows that the numbers can be trusted; relative, dimensionless."""
    error = result.error
    return {
        "discretisation_ste_mean": error.mean if error else None,
        "discretisation_ste_path": error.path if error else None,
        "discretisation_ste_corner": _finite(error.corner) if error else None,
        "complementarity_residual": float(result.cycle.residual.max()),
        "torque_balance": result.torque_balance,
        "work_balance": result.work_balance,
        "reciprocity": _reciprocity_error(result),
    }


def _reciprocity_error(result: StaticsResult) -> float:
    flanks = (result.problem.driver, result.problem.driven)
    return max(flank.reciprocity_error for flank in flanks)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
