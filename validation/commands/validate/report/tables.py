"""The tables of a report as rows of CSV files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from validation.commands.validate.random_sets.generator import NAME
from validation.commands.validate.report.random_sets import random_set_rows

Row = dict[str, Any]
RUN = ("source", "torque_Nm", "rows", "rows_not_repeating")


def report_tables(values: Mapping[str, Any]) -> dict[str, list[Row]]:
    """Rows by the name of the table; units are in the columns' names."""
    cases = values["cases"]
    tables: Mapping[str, Callable[[Mapping[str, Any]], Iterable[Row]]] = {
        "overview": _overview,
        "verdicts": lambda case: case["verdicts"],
        "budget": _budget,
        "costs": _costs,
        "printed": _printed,
    }
    rows_by_table = {
        name: [{"case": case["case"]} | row for case in cases for row in rows(case)]
        for name, rows in tables.items()
    }
    sets = values["random_sets"]
    return rows_by_table | {
        NAME: random_set_rows(sets),
        f"{NAME}-full": sets.get("full", []),
    }


def _overview(case: Mapping[str, Any]) -> Iterator[Row]:
    for model in case["models"]:
        yield {k: v for k, v in model.items() if not isinstance(v, dict)}


def _budget(case: Mapping[str, Any]) -> Iterator[Row]:
    for quantity in case["budget"].get("quantities", ()):
        common = {name: quantity[name] for name in ("quantity", "unit")}
        yield from (common | row for row in quantity["models"])


def _costs(case: Mapping[str, Any]) -> Iterator[Row]:
    for run in case["runs"]:
        yield {name: run[name] for name in RUN} | run["cost"]


def _printed(case: Mapping[str, Any]) -> Iterator[Row]:
    for entry in case["printed"]:
        columns = {f"printed_{k}" if k == "value" else k: v for k, v in entry.items()}
        columns.pop("found")
        for run_value in entry["found"] or [{}]:
            row = {
                k: run_value.get(k, "") for k in ("source", "torque_Nm", "value", "csv")
            }
            yield columns | row
