"""The random gear sets of a report, as plain values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation.commands.validate.random_sets.generator import NAME
from validation.commands.validate.random_sets.measuring import (
    COUPLED_UP,
    MODEL_1,
    REDUCED,
    WITHOUT,
    Measured,
)
from validation.commands.validate.random_sets.set_runs import FULL, SPEEDS, SetRun
from validation.commands.validate.random_sets.verdicts import (
    MAX_OTHER_BRANCH,
    MAX_P90,
    MEDIAN,
    NATURAL_ERROR,
    evaluate,
    quantiles,
    speed_errors,
)

TIMED = {
    "model_1_ms": MODEL_1,
    "without_modes_ms": WITHOUT,
    "coupled_ms": COUPLED_UP,
    "reduced_ms": REDUCED,
}


def random_set_values(
    runs: Sequence[SetRun], output: Path, commands: Mapping[str, str]
) -> dict[str, Any]:
    """Nothing where there are no runs; paths are relative to the output.

    commands : by NAME what runs them again
    """
    if not runs:
        return {}
    rows = [row_values(run, output) for run in runs if run.table.name == SPEEDS]
    full = [run for run in runs if run.table.name == FULL]
    return {
        "command": commands[NAME],
        "allowed": {
            "median": MEDIAN,
            "p90": MAX_P90,
            "other_branch_speeds": MAX_OTHER_BRANCH,
            "natural": NATURAL_ERROR,
        },
        "passed": sum(row["passed"] for row in rows),
        "of": len(rows),
        "rows": rows,
        "full": [asdict(point) for run in full for point in run.full],
        "full_failures": [f"{run.name}: {run.failure}" for run in full if run.failure],
    }


def row_values(run: SetRun, output: Path) -> dict[str, Any]:
    """Values of a set; a failed one has only its name and the failure."""
    table_path = run.table.relative_to(output).as_posix()
    common = {"set": run.name, "csv": table_path, "failure": run.failure}
    if run.measured is None:
        return common | {"verdict": "failed", "passed": False, "figures": {}}
    verdict = evaluate(run.measured)
    return common | {
        "verdict": verdict.summary,
        "passed": verdict.passed,
        "figures": quantities(run.measured),
    }


def quantities(measured: Measured) -> dict[str, Any]:
    """Columns of the table of random sets; errors are relative."""
    verdict = evaluate(measured)
    return {
        "kind": measured.kind,
        "teeth": "/".join(map(str, measured.teeth)),
        "hub_over_root": "/".join(f"{hub:.2f}" for hub in measured.hub_over_root),
        "torque_Nm": measured.torque_Nm,
        "speeds": len(measured.speeds_Hz),
        "first_Hz": measured.speeds_Hz[0],
        "last_Hz": measured.speeds_Hz[-1],
        "median_error": verdict.median,
        "p90_error": verdict.p90,
        "other_branch_speeds": verdict.other_branch_speeds,
        "median_with_other_branches": verdict.median_all,
        "p90_with_other_branches": verdict.p90_all,
        "worst_error": verdict.worst,
        "worst_Hz": verdict.worst_Hz,
        "usual_cutoff_p90": verdict.reference,
        "model_1_median": quantiles(speed_errors(measured, MODEL_1))[0],
        "without_modes_median": quantiles(speed_errors(measured, WITHOUT))[0],
        "natural_error": verdict.natural,
        "natural_Hz": verdict.natural_Hz,
        "body_modes": measured.body_modes,
        "left_out": measured.left_out,
        "warns": verdict.warns,
    } | {name: measured.ms_per_speed[source] for name, source in TIMED.items()}


def random_set_rows(values: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of the table as a CSV file; sets that failed are only in the report."""
    return [
        {"set": row["set"], "verdict": row["verdict"]} | row["figures"]
        for row in values.get("rows", ())
        if row["figures"]
    ]
