"""Reports: every link leads somewhere, every number stands in a CSV file beside."""

from __future__ import annotations

import csv
import json
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from PIL import Image
from typer.testing import CliRunner

from fegear.cli import app
from validation.commands.validate.report.values import worst
from validation.pages.templates import shown
from validation.study.metrics import Verdict

pytestmark = pytest.mark.slow

MOVING = """
name = "moving"
title = "Pair <in> motion & more"
gear_set = "liu-pair"
torques_Nm = [50, 100]
speeds_Hz = "1000:1200:50"
fidelity = "quasistatic"
notes = "a note"
ablation = true

[[model]]
number = 1

[[model]]
number = "coupled"

[[metric]]
name = "rms_distance"
allowed = 1e-9
reason = "nothing meets this"

[[metric]]
name = "wave_correlation"
allowed = 0.5
reason = "for a test"

[[single_speed]]
torque_Nm = 100
speed_Hz = 1100

[[printed]]
quantity = "natural frequency"
value = 2000
unit = "Hz"
where = "nowhere"
figure = "natural"

[[printed]]
quantity = "mean stiffness"
value = 298000000.0
unit = "N/m"
where = "Table 5.1"
figure = "mesh1.mean_stiffness"
"""
PARTS = "hardening", "pairs", "body", "modes"  # of gears without an idler


class Page(HTMLParser):
    """Links, cells of the first table, and identifiers of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.ids, self.tables, self.sources = [], [], [], []
        self._cell = None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.links += (
            [attributes["href"]] if tag == "a" and "href" in attributes else []
        )
        self.ids += [attributes["id"]] if "id" in attributes else []
        self.sources += [v for k, v in attrs if k in ("src", "xlink:href")]
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self._cell = ""

    def handle_data(self, data):
        if self._cell is not None:
            self._cell += data

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.tables[-1][-1].append(self._cell.strip())
            self._cell = None


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A report of a case that moves and of the pair with friction."""
    directory = tmp_path_factory.mktemp("report")
    case = directory / "moving.toml"
    case.write_text(MOVING)
    argv = ["validate", str(case), "friction-pair", "-o", str(directory / "out")]
    result = CliRunner().invoke(app, argv, catch_exceptions=False)
    assert result.exit_code == 1, result.output
    return directory / "out"


@pytest.fixture(scope="module")
def page(folder):
    return Page((folder / "index.html").read_text(encoding="utf-8"))


def test_every_link_leads_to_a_file_or_a_place_on_the_page(folder, page):
    """Only a report of all cases has all kinds of links."""
    assert len(page.links) > 50
    for link in set(page.links):
        if link.startswith("#"):
            assert link[1:] in page.ids
        else:
            assert (folder / link).is_file(), link
    assert len(page.ids) == len(set(page.ids))


def test_nothing_comes_from_elsewhere(folder, page):
    text = (folder / "index.html").read_text(encoding="utf-8")
    assert all(source.startswith("#") for source in page.sources)
    outside = set(re.findall(r'https?://[^"\s<]+', text))
    names = ("http://www.w3.org/", "http://purl.org/", "http://creativecommons.org/")
    assert all(url.startswith(names) for url in outside), outside
    assert "Pair &lt;in&gt; motion &amp; more" in text


FRICTION = "", "-friction", "-friction-bending-0"


def test_first_table_has_every_case_and_model(page):
    head, *rows = page.tables[0]
    assert head[:4] == ["case", "model", "within", "out\xadside"]
    assert [row[:2] for row in rows] == [
        ["moving", "model-1"],
        ["moving", "model-coupled"],
        *(["friction-pair", f"model-1{rub}"] for rub in FRICTION),
        *(["friction-pair", f"model-{i}"] for i in (2, 3)),
    ]
    assert all(cell for row in rows for cell in row)
    assert all(int(row[2]) + int(row[3]) for row in rows)
    assert float(rows[0][4]) > 0.0
    assert rows[2][4] == "-"


def test_every_number_of_a_verdict_stands_in_the_table_beside(folder):
    values = json.loads((folder / "report.json").read_text())
    with (folder / "tables" / "verdicts.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    verdicts = [v for case in values["cases"] for v in case["verdicts"]]
    assert [float(row["measured"]) for row in rows] == [v["measured"] for v in verdicts]
    assert {row["csv"].rsplit("/")[-1] for row in rows} == {
        "sweep.csv",
        "waves.csv",
        "statics.csv",
    }
    moving = [v for v in verdicts if v["metric"] == "rms_distance"]
    assert len({v["csv"] for v in moving}) == 4  # two models at two torques


def test_the_budget_stands_in_its_table_and_figure(folder, page):
    with (folder / "tables" / "budget.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["case"] for row in rows} == {"moving"}
    models = ["model 1", *(f"without {n}" for n in PARTS)]
    (table,) = (t for t in page.tables if "model 1" in t[0])
    assert table[0] == ["quantity", *models, "coupled"]
    (force,) = (row for row in table if row[0] == "peak force [%]")
    written = [row for row in rows if row["quantity"] == "peak force"]
    assert [row["model"] for row in written] == table[0][1:]
    for cell, row in zip(force[1:], written, strict=True):
        assert cell.startswith(shown(float(row["largest_error"]), 2))
    assert "without hardening" in (folder / "report.md").read_text(encoding="utf-8")
    assert "budget" in " ".join(page.ids)
    # what is not judged stands in no other table or figure
    assert not any("without" in cell for row in page.tables[0] for cell in row)
    drawn = (folder / "figures" / "moving-dte-rms-100Nm.svg").read_text()
    assert "without" not in drawn


LABELS = {
    "cost": "run time per speed [s]",
    "moving-dte-rms-50Nm": "mesh frequency [Hz]",
    "moving-wave1-100Nm": "force [kN]",
    "friction-pair-statics-100Nm": "mesh position [base pitches from the pitch point]",
}


def test_figures_are_whole_and_named_in_both_texts(folder):
    page = (folder / "index.html").read_text(encoding="utf-8")
    text = (folder / "report.md").read_text(encoding="utf-8")
    names = sorted(path.stem for path in (folder / "figures").glob("*.svg"))
    assert set(LABELS) <= set(names)
    for name in names:
        root = ElementTree.parse(folder / "figures" / f"{name}.svg").getroot()
        assert LABELS.get(name, "") in "".join(root.itertext())
        with Image.open(folder / "figures" / f"{name}.png") as image:
            low, high = image.convert("L").getextrema()
        assert high - low > 150  # ink on paper
        assert f'<figure id="{name}">' in page
        assert f"(figures/{name}.png)" in text


def test_settings_versions_and_commands_are_stated(folder):
    text = (folder / "report.md").read_text(encoding="utf-8")
    for snippet in ("liu-pair", "50, 100 N m", "1000:1200:50 Hz", "quasistatic"):
        assert snippet in text
    assert "again by `fegear validate friction-pair -o " in text
    assert r"## Pair \<in\> motion \& more" in text
    assert "numpy" in text
    assert "cores" in text


def test_the_same_report_again_is_the_same(folder, tmp_path):
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    case = folder.parent / "moving.toml"
    argv = ["validate", str(case), "friction-pair", "-o", str(folder)]
    CliRunner().invoke(app, argv, catch_exceptions=False)
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before


def test_worst_is_the_furthest_from_what_is_allowed():
    def of(metric, *values):
        return [Verdict(metric, "m", "", v, 0.5, "1", False, "") for v in values]

    assert worst(of("rms_distance", 0.1, 0.9)).measured == 0.9
    assert worst(of("peak_frequency", 0.1, -0.9)).measured == -0.9
    assert worst(of("wave_correlation", 0.1, 0.9)).measured == 0.1
    one = worst(of("wave_correlation", 0.1, float("nan"), 0.9)).measured
    assert one != one
