"""Every case, benchmark and ablation runs to its end, with recorded values."""

from __future__ import annotations

import csv
import json

import pytest
from quick_runs import ILL_CONDITIONED, differences, named_runs, recorded_values

from fegear.files.errors import InputError
from validation.commands.validate.study import Validation
from validation.study.cases import case_names, load_case

RUNS = named_runs()


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_a_quick_run_gives_the_recorded_values(name, tmp_path):
    """Only this finds a value of a report that changed where no tolerance is missed."""
    measured = RUNS[name](tmp_path)
    assert measured
    assert not list(differences(measured, recorded_values()[name]))
    for table in tmp_path.rglob("*.csv"):
        lines = [line for line in table.read_text().splitlines() if line[:1] != "#"]
        rows = list(csv.DictReader(lines))
        assert all(None not in row and None not in row.values() for row in rows)
    if name.startswith("validate"):
        assert json.loads((tmp_path / "report.json").read_text())["quick"]
        assert "not judged" in (tmp_path / "index.html").read_text()


def test_every_run_is_recorded():
    recorded = recorded_values()
    assert list(recorded) == sorted(RUNS)
    assert all(list(values) == sorted(values) for values in recorded.values())
    names = [name for values in recorded.values() for name in values]
    for part in ILL_CONDITIONED:
        assert any(part in name for name in names), part


@pytest.mark.parametrize("name", case_names())
def test_a_quick_case_has_few_speeds_and_all_else(name):
    case = load_case(name)
    quick = case.quick
    assert 0 < len(quick.speeds) + len(quick.single_speed) <= 4 or not case.speeds
    assert set(quick.speeds) <= set(case.speeds)
    assert (quick.model, quick.metric, quick.fidelity, quick.ablation) == (
        *(case.model, case.metric, case.fidelity, case.ablation),
    )
    assert len(quick.single_speed) == (len(case.single_speed) > 0)


def test_a_quick_report_replaces_no_full_one(tmp_path):
    (tmp_path / "report.json").write_text('{"quick": ""}')
    study = Validation(cases=("idler",), quick=True, directory=str(tmp_path))
    with pytest.raises(InputError, match=r"has a report of full runs; a quick one"):
        list(study.tasks())
    (tmp_path / "report.json").write_text('{"quick": "few speeds"}')
    study = Validation(cases=("idler",), directory=str(tmp_path))
    with pytest.raises(InputError, match=r"has a report of quick runs; a full one"):
        list(study.tasks())
