"""Quick runs of everything that gives evidence, and the recorded values of them.

`python tests/quick_runs.py` records `tests/quick_values.json` anew, or of the named
runs alone: `python tests/quick_runs.py "validate idler"`.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fegear.studies.running import run
from fegear.studies.trains.gear_sets import GearSetRef
from validation.commands.ablation.study import Ablation
from validation.commands.bench.study import AllBenchmarks
from validation.commands.validate.study import RANDOM_SETS, Validation
from validation.study.cases import case_names

RECORDED = Path(__file__).parent / "quick_values.json"
RTOL = 1e-4
# by kind of run: metrics are differences of quantities near 1, which settle to 1e-6 or
# better on every machine, those of an ablation in per cent; errors are small themselves
ATOL = {"validate": 1e-6, "ablation": 1e-4, "bench": 1e-12}
Values = dict[str, float]  # by name: the row, then the column
# what depends on the machine in itself, by the end of a name, and why
TIMES = {
    "_s": "seconds",
    "_ms": "milliseconds",
    "ms": "milliseconds",
    "us_per_step": "time of a step",
    "ms_per_speed": "time of a speed",
    "us_per_speed": "time of a speed",
    "us_per_period": "time of a period",
    "ms_per_period": "time of a period",
    "ms_per_position": "time of a position",
    "ms_per_motion": "time of a motion",
    "us_per_transition": "time of a transition",
    "us_per_impact": "time of an impact",
    "us_per_cell": "time of a cell",
    "impacts_per_s": "impacts in a second",
    "per_item_us": "time of a speed or period",
    "seconds": "seconds",
    "ratio": "ratio of two times",
    "peak_memory_MB": "memory of the process",
    "cost_ratio": "ratio of two times",
}
# what round-off or a branch decides, by a part of the name, and why
ILL_CONDITIONED = {
    "bench branches/sweeps": "nearest of stable motions, differences near round-off",
    "bench branches/points": "motions are sampled by their number on adaptive arcs",
    "bench branches/stability": "draws motions by their number on adaptive arcs",
    "bench branches/orders": "errors of many harmonics are near those of shooting",
    "bench lumped/races": "the opponent is the fastest run, by time",
    "bench lumped/points": "errors near the tolerance of the reference",
    "bench stability/multipliers": "errors near round-off of the integration",
    "bench clatter/points": "errors of event times near round-off",
    "bench eccentric/points": "errors near the tolerance of the root",
}
# values that exist at some rows only, by the end of a name, and why
MAY_BE_NAN = {
    "bench stability/edges/0/order": "an order needs a row before",
    "error_median": "a reference has no error",
    "error_largest": "a reference has no error",
    "error_corner": "no position may be at a corner",
}


def validation_runs() -> tuple[str, ...]:
    """Names of the cases, and of the random sets."""
    return (*case_names(), RANDOM_SETS)


def benchmarks() -> dict[str, Any]:
    """Quick benchmarks by subject."""
    return {study.subject: study for study in AllBenchmarks(quick=True).benchmarks}


def validated(name: str, directory: Path) -> Values:
    """Metrics of a quick case, or errors of a quick random set, in an empty folder."""
    study = Validation(cases=(name,), quick=True, directory=str(directory))
    result = run(study)
    assert result.complete
    assert not result.failure
    values, measured = result.values, dict[str, Any]()
    for case in values["cases"]:
        for verdict in case["verdicts"]:
            label = f"{verdict['model']}, {verdict['where']}, {verdict['metric']}"
            measured[f"validate {name}/{label}"] = verdict["measured"]
    for row in values["random_sets"].get("rows", ()):
        assert not row["failure"], row["failure"]
        measured |= _numbers(f"validate {name}/{row['set']}", row["figures"])
    assert not values["random_sets"].get("full_failures")
    for row in values["random_sets"].get("full", ()):
        measured |= _numbers(f"validate {name}/full {row['name']}", row)
    return measured


def benched(subject: str, directory: Path) -> Values:
    """All numbers of a quick benchmark."""
    result = run(benchmarks()[subject])
    assert result.complete
    result.write(directory)
    return dict(_numbers(f"bench {subject}", result.summary))


def ablated(gear_set: str) -> Values:
    """Largest errors of the models of an ablation at three speeds."""
    study = Ablation(
        gear_set=GearSetRef(name=gear_set),
        torque=100.0,
        speeds=(1700.0, 1800.0, 1900.0),
    )
    result = run(study)
    assert result.complete
    quantities = result.summary["quantities"]
    return {
        f"ablation {gear_set}/{model['model']}/{quantity['quantity']}": model[
            "largest_error"
        ]
        for quantity in quantities
        for model in quantity["models"]
        if model["places"]
    }


def _numbers(name: str, value: Any) -> Values:
    """Numbers of nested values by the names that lead to them, without times."""
    if isinstance(value, Mapping):
        entries = value.items()
    elif isinstance(value, list | tuple):
        entries = enumerate(value)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        return {} if _is_time(name) else {name: float(value)}
    else:
        return {}
    return {
        inner: number
        for key, entry in entries
        for inner, number in _numbers(f"{name}/{key}", entry).items()
    }


def _is_time(name: str) -> bool:
    return any(name.rsplit("/", 1)[-1].endswith(end) for end in TIMES)


def is_ill_conditioned(name: str) -> bool:
    return any(part in name for part in ILL_CONDITIONED)


def may_be_nan(name: str) -> bool:
    return any(name.endswith(end) for end in MAY_BE_NAN)


def differences(
    measured: Values, recorded: Mapping[str, float | None]
) -> Iterator[str]:
    """Names that only one of both has, values that are not finite or differ."""
    for name in sorted(measured.keys() ^ recorded.keys()):
        yield f"{name}: {'new' if name in measured else 'missing'}"
    for name in sorted(measured.keys() & recorded.keys()):
        value, expected = measured[name], recorded[name]
        if not math.isfinite(value):
            if expected is not None or not may_be_nan(name):
                yield f"{name}: {value}"
        elif expected is None:
            if not is_ill_conditioned(name):
                yield f"{name}: {value}, recorded without a value"
        elif not (
            is_ill_conditioned(name)
            or math.isclose(
                value, expected, rel_tol=RTOL, abs_tol=ATOL[name.partition(" ")[0]]
            )
        ):
            yield f"{name}: {value!r}, recorded {expected!r}"


def named_runs() -> dict[str, Callable[[Path], Values]]:
    """All quick runs by name: functions of a directory."""
    runs: dict[str, Callable[[Path], Values]] = {}
    for name in validation_runs():
        runs[f"validate {name}"] = lambda at, name=name: validated(name, at)
    for subject in benchmarks():
        runs[f"bench {subject}"] = lambda at, subject=subject: benched(subject, at)
    for gear_set in ABLATED:
        runs[f"ablation {gear_set}"] = lambda at, name=gear_set: ablated(name)
    return runs


ABLATED = ("liu-pair",)


def recorded_values() -> dict[str, dict[str, float | None]]:
    """Recorded values by run and name; None of those that are not compared."""
    return json.loads(RECORDED.read_text()) if RECORDED.exists() else {}


def record(names: list[str]) -> None:
    """Record the values of runs."""
    runs, recorded = named_runs(), recorded_values()
    for name in names or runs:
        with TemporaryDirectory() as directory:
            values = runs[name](Path(directory))
        recorded[name] = {key: _recorded(key, value) for key, value in values.items()}
        text = json.dumps(recorded, indent=1, sort_keys=True, allow_nan=False)
        RECORDED.write_text(text + "\n")


def _recorded(name: str, value: float) -> float | None:
    comparable = math.isfinite(value) and not is_ill_conditioned(name)
    return value if comparable else None


if __name__ == "__main__":
    record(sys.argv[1:])
