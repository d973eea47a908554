"""Counts of a report that pages quote: `summary.json`, of which one is committed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

from fegear.files.output import read_text

SUMMARY = "summary.json"
COMMITTED = Path(__file__).parents[1] / SUMMARY


def totals_of(values: Mapping[str, Any]) -> dict[str, Any]:
    """Counts of the values of a report, by model and over all cases.

    metrics : what was judged, by case
    """
    models: dict[str, dict[str, int]] = {}
    for case in values["cases"]:
        for model in case["models"]:
            counts = models.setdefault(
                model["model"], {"cases": 0, "within": 0, "of": 0}
            )
            counts["cases"] += 1
            counts["within"] += model["within"]
            counts["of"] += model["within"] + model["outside"]
    sets = values["random_sets"]
    return {
        "made": {"date": date.today().isoformat(), "fegear": values["about"]["fegear"]},
        "models": models,
        "metrics": {
            case["case"]: [metric["metric"] for metric in case["metrics"]]
            for case in values["cases"]
        },
        "random_sets": {name: sets[name] for name in ("passed", "of") if name in sets},
    }


def committed_totals() -> dict[str, Any]:
    """Counts of the last run of all cases that is committed."""
    totals: dict[str, Any] = json.loads(read_text(COMMITTED))
    return totals
