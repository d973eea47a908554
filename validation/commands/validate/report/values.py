"""What a report says, as plain values ready for JSON, CSV and templates."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation.commands.validate.random_sets.set_runs import SetRun
from validation.commands.validate.report.random_sets import random_set_values
from validation.study.budget import budget_of, budget_values
from validation.study.cases import Printed, Tolerance
from validation.study.metrics import METRICS, Verdict
from validation.study.printed import printed_figure
from validation.study.provenance import provenance
from validation.study.run_files import Run
from validation.study.runs import CaseResult, warnings_of
from validation.study.tasks import FE

QUICK = "quick: few speeds, torques and sets; not judged"
STATIC = ("mean_stiffness", "stiffness_variation", "static_deflection")


def report_values(
    results: Sequence[CaseResult],
    output: Path,
    commands: Mapping[str, str],
    random_sets: Sequence[SetRun] = (),
    quick: bool = False,
) -> dict[str, Any]:
    """All of a report; paths are relative to the output.

    commands : by the name of a case, or of all random sets, what runs it again, by ""
        what runs all
    quick : whether runs are quick ones, which are not judged
    """
    runs: list[Run | SetRun] = [run for result in results for run in result.runs]
    runs += random_sets
    return {
        "command": commands[""],
        "quick": QUICK if quick else "",
        "about": {**dict(provenance()), "runs made on": _machines(runs)},
        "random_sets": random_set_values(random_sets, output, commands),
        "cases": [
            case_values(result, output) | {"command": commands[result.case.name]}
            for result in results
        ],
    }


def _machines(runs: Sequence[Run | SetRun]) -> str:
    """Machines on which the runs were made, which may be others than this one."""
    return "; ".join({run.machine: None for run in runs})


def case_values(result: CaseResult, output: Path) -> dict[str, Any]:
    case = result.case
    return {
        "case": case.name,
        "title": case.title,
        "gear_set": case.gear_set,
        "fidelity": case.fidelity,
        "settings": dict(_settings(result)),
        "notes": case.notes,
        "warnings": list(warnings_of(result)),
        "models": [_model_values(result, model) for model in result.models],
        "metrics": [_metric_values(result, entry) for entry in case.metric],
        "budget": budget_values(budget_of(result)),
        "sources": [FE, *result.models],
        "printed": [_printed_values(result, entry, output) for entry in case.printed],
        "verdicts": [_verdict_values(result, v, output) for v in result.verdicts],
        "runs": [_run_values(run, output) for run in result.runs],
    }


def _settings(result: CaseResult) -> Iterator[tuple[str, str]]:
    case = result.case
    yield "gear set", case.gear_set
    if case.edits:
        yield "changed", "; ".join(case.edits)
    yield "torques on the input gear", f"{_listed_values(case.torques_Nm)} N m"
    if case.speeds_Hz:
        yield (
            "mesh frequencies",
            f"{case.speeds_Hz} Hz, {' and '.join(case.directions)}",
        )
    for wave in case.single_speed:
        yield f"motion at {wave.torque_Nm:g} N m", wave.label
    yield "finite elements", case.fidelity
    if case.speeds_Hz or case.single_speed:
        ratio = case.damping_ratio
        yield "damping ratio", "of the gear set" if ratio is None else f"{ratio:g}"
        yield "translations", "free" if case.translations else "held"
    if case.friction:
        rubbing = [model.name for model in case.model if model.friction]
        whose = ", ".join(["finite elements", *rubbing])
        yield "friction", f"{case.friction:g}, of {whose}"


def _listed_values(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _model_values(result: CaseResult, model: str) -> dict[str, Any]:
    verdicts = [verdict for verdict in result.verdicts if verdict.model == model]
    outside = [verdict.metric for verdict in verdicts if not verdict.within]
    return {
        "model": model,
        "within": len(verdicts) - len(outside),
        "outside": len(outside),
        "outside_by_metric": {m: outside.count(m) for m in dict.fromkeys(outside)},
        "per_speed_s": result.per_speed_s(model),
        "fe_per_speed_s": result.per_speed_s(FE),
        "cost_ratio": result.cost_ratio(model),
    }


def _metric_values(result: CaseResult, entry: Tolerance) -> dict[str, Any]:
    """A tolerance and how every model meets it."""
    metric = METRICS[entry.name]
    return {
        "metric": entry.name,
        "meaning": metric.meaning,
        "unit": metric.unit,
        "least": metric.allowed_is_minimum,
        "allowed": entry.allowed,
        "reason": entry.reason,
        "models": [_metric_of_model(result, entry.name, m) for m in result.models],
    }


def _metric_of_model(result: CaseResult, metric: str, model: str) -> dict[str, Any]:
    verdicts = [v for v in result.verdicts if (v.metric, v.model) == (metric, model)]
    return {
        "model": model,
        "within": sum(v.within for v in verdicts),
        "of": len(verdicts),
        "worst": worst(verdicts).measured if verdicts else math.nan,
    }


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """The one furthest from what is allowed; NaN is further than any."""

    def badness(verdict: Verdict) -> float:
        if math.isnan(verdict.measured):
            return math.inf
        least = METRICS[verdict.metric].allowed_is_minimum
        return -verdict.measured if least else abs(verdict.measured)

    return max(verdicts, key=badness)


def _verdict_values(
    result: CaseResult, verdict: Verdict, output: Path
) -> dict[str, Any]:
    (run,) = (
        run
        for run in result.of(verdict.model)
        if verdict.where.split(",")[0] == f"{run.torque:g} N m"
    )
    return asdict(verdict) | {"csv": _file(run, _csv_of(verdict.metric), output)}


def _csv_of(metric: str) -> str:
    """The file of a run that a metric is taken from."""
    if metric.startswith("wave"):
        return "waves.csv"
    return "statics.csv" if metric in STATIC else "sweep.csv"


def _file(run: Run, name: str, output: Path) -> str:
    return (run.directory / name).relative_to(output).as_posix()


def _printed_values(result: CaseResult, entry: Printed, output: Path) -> dict[str, Any]:
    """A printed value and the value of each run."""
    run_values = []
    for run in result.judged if entry.figure else ():
        value, name = printed_figure(run, entry.figure or "", entry.value)
        run_entry = {"source": run.source, "torque_Nm": run.torque}
        run_values.append(run_entry | {"value": value, "csv": _file(run, name, output)})
    return asdict(entry) | {"found": run_values}


def _run_values(run: Run, output: Path) -> dict[str, Any]:
    return {
        "source": run.source,
        "torque_Nm": run.torque,
        "directory": run.directory.relative_to(output).as_posix(),
        "natural_Hz": list(run.natural_Hz),
        # of all rows, one for each speed, direction and mesh
        "rows": len(run.table.rows),
        "rows_not_repeating": sum(row.period_multiple == 0 for row in run.table.rows),
        "cost": asdict(run.cost) | {"per_speed_s": run.cost.per_speed_s},
    }
