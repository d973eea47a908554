"""Every figure of the sources, computed anew of few points."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter
from quick_figures import (
    ATOL,
    RECORDED,
    REVIEWED,
    differences,
    places_of,
    quick_values,
    record_of,
)
from source_files import ROOT

from validation.commands.reproduce.source_figures import figure_numbers, load_figure
from validation.study.data_files import few_speeds, parsed_speeds

CHANGED = Path("build", "quick-figures")


def recorded_figures() -> dict[str, Any]:
    return json.loads(RECORDED.read_text())


@pytest.mark.slow
@pytest.mark.parametrize("number", figure_numbers())
def test_a_quick_figure_gives_what_is_recorded(number, tmp_path):
    """All values of one that does not are written, to compare with those before."""
    values = quick_values(number, tmp_path)
    lines = list(differences(places_of(number, values), recorded_figures()[number]))
    if lines:
        path = ROOT / CHANGED / f"{number}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(values, indent=1, sort_keys=True))
        lines.append(f"all values: {path}")
    assert lines == []


PLACES: dict[str, float | None] = {
    **{f"9.9/curve/y/{i}": 10.0 ** (i - 14) / 3.0 for i in range(20)},
    "9.9/curve/lost/0": None,
    "9.9/printed/peak/0": 2100.0,
}


def lines_of(changed: Mapping[str, float | None]) -> list[str]:
    return list(differences(dict(changed), record_of(dict(PLACES))))


@pytest.mark.parametrize("place", [p for p, v in PLACES.items() if v is not None])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_change_of_any_value_is_seen(place, sign):
    value = PLACES[place]
    change = max(3e-4 * value, 3.0 * ATOL)
    assert lines_of(PLACES | {place: value + sign * change})


def test_round_off_is_not_seen():
    random = np.random.default_rng(1)
    for _ in range(20):
        changed = {
            place: value and value * (1.0 + 1e-7 * random.standard_normal())
            for place, value in PLACES.items()
        }
        assert lines_of(changed) == []


def test_lost_new_renamed_and_exchanged_values_are_seen():
    y = [f"9.9/curve/y/{i}" for i in (12, 13)]
    fewer = {place: value for place, value in PLACES.items() if place != y[0]}
    for changed in (
        fewer,
        fewer | {"9.9/curve/x/12": PLACES[y[0]]},
        PLACES | {"9.9/curve/y/20": 1.0},
        PLACES | {y[0]: None},
        PLACES | {"9.9/curve/lost/0": 1.0},
        PLACES | {y[0]: PLACES[y[1]], y[1]: PLACES[y[0]]},
    ):
        assert lines_of(changed)


def test_records_are_short():
    for number, record in recorded_figures().items():
        assert len(record["values"]) >= 2, number
        assert len(record["values"]) <= REVIEWED + 8


def test_quick_parts_are_allowed_in_a_file_as_well():
    for number in figure_numbers():
        full, quick = load_figure(number), load_figure(number, quick=True)
        assert quick.is_quick
        assert not full.is_quick
        assert list(quick.parts) == list(full.parts)
        for part in quick.part:
            checked = TypeAdapter(type(part)).validate_python(vars(part))
            assert checked == part


@pytest.mark.parametrize(
    ("speeds", "few"),
    [
        ("800:4200:20", (800.0, 1660.0, 2520.0, 3380.0)),
        ("0.96:0.60:0.005", (0.96, 0.87, 0.78, 0.69, 0.6)),
        ("1,2,4,8,16,32", (1.0, 4.0, 16.0)),
        ("3:4:1", (3.0, 4.0)),
    ],
)
def test_few_speeds_are_speeds_of_the_range(speeds, few):
    text = few_speeds(speeds)
    assert parsed_speeds(text) == few
    assert set(few) <= set(parsed_speeds(speeds))
    assert (":" in text) == (":" in speeds)


def test_values_are_recorded_of_every_figure():
    assert set(recorded_figures()) == set(figure_numbers())
