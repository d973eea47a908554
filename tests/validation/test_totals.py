"""Counts that pages quote are those of the cases as they are."""

from __future__ import annotations

from validation.commands.validate.report.totals import committed_totals, totals_of
from validation.study.cases import case_names, load_case


def test_committed_counts_are_of_the_cases_as_they_are():
    """Where this fails, run `fegear validate --all` and commit its summary.json."""
    totals, cases = committed_totals(), list(map(load_case, case_names()))
    assert totals["metrics"] == {
        case.name: [metric.name for metric in case.metric] for case in cases
    }
    for model, counts in totals["models"].items():
        with_model = [c for c in cases if model in {m.name for m in c.model}]
        assert counts["cases"] == len(with_model)
        assert 0 < counts["within"] <= counts["of"]


def test_counts_are_summed_over_cases():
    def case(name, within, outside):
        model = {"model": "model-1", "within": within, "outside": outside}
        return {"case": name, "models": [model], "metrics": [{"metric": "peak_force"}]}

    totals = totals_of(
        {
            "cases": [case("one", 3, 1), case("two", 2, 0)],
            "random_sets": {},
            "about": {"fegear": "1.0"},
        }
    )
    assert totals["models"] == {"model-1": {"cases": 2, "within": 5, "of": 6}}
    assert totals["metrics"] == {"one": ["peak_force"], "two": ["peak_force"]}
    assert totals["random_sets"] == {}
