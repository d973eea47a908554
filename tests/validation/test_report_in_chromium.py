"""A report in headless Chromium, on a phone's and on a desk's width.

It makes a small report; FEGEAR_REPORT=DIR names a finished one to be looked at
instead. Screenshots go to FEGEAR_SCREENSHOTS=DIR where it is given.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from case_files import case_text
from typer.testing import CliRunner

from fegear.cli import app

WIDTHS = (390, 1280)
FIGURES = """() => [...document.querySelectorAll("figure")].map((figure) => {
  const picture = figure.querySelector("svg");
  const { width, height } = picture.getBoundingClientRect();
  const drawn = [...picture.querySelectorAll("path")].some(
    (path) => path.getTotalLength() > 100
  );
  const png = figure.querySelectorAll("a")[1].href;
  return { name: figure.id, width, height, drawn, png };
})"""
LOADED = """async (urls) => {
  const sizes = [];
  for (const url of urls) {
    const image = new Image();
    image.src = url;
    await image.decode();
    sizes.push(image.naturalWidth);
  }
  return sizes;
}"""
CONTRAST = """() => {
  const style = getComputedStyle(document.body);
  const light = (text) =>
    text.match(/\\d+/g).slice(0, 3).reduce((a, b) => a + +b, 0) / 765;
  const ink = getComputedStyle(document.querySelector("figure svg")).color;
  return [light(style.backgroundColor), light(style.color), light(ink)];
}"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    report_path = os.environ.get("FEGEAR_REPORT")
    if report_path:
        return Path(report_path).resolve()
    directory = tmp_path_factory.mktemp("page")
    (directory / "small.toml").write_text(case_text("small", "1000:1100:50", 1.0))
    argv = ["validate", str(directory / "small.toml"), "-o", str(directory / "out")]
    assert CliRunner().invoke(app, argv, catch_exceptions=False).exit_code == 0
    return directory / "out"


@pytest.fixture(params=WIDTHS)
def page(request, browser, folder):
    """The page, with what it complained of and what it asked for."""
    context = browser.new_context(viewport={"width": request.param, "height": 1200})
    page = context.new_page()
    page.complaints, page.asked = [], []
    page.on("console", lambda message: page.complaints.append(message.text))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto((folder / "index.html").as_uri())
    yield page
    context.close()


def test_every_figure_is_drawn_and_its_picture_can_be_loaded(page):
    figures = page.evaluate(FIGURES)
    assert figures
    for figure in figures:
        assert figure["drawn"], figure
        assert figure["width"] > 300, figure
        assert figure["height"] > 100, figure
    sizes = page.evaluate(LOADED, [figure["png"] for figure in figures])
    assert min(sizes) > 500


def test_it_needs_no_network_and_complains_of_nothing(page, folder):
    page.wait_for_timeout(200)
    assert page.asked == [(folder / "index.html").as_uri()]
    assert page.complaints == []


def test_the_first_table_is_complete(page):
    rows = page.eval_on_selector_all(
        "#overview tr", "rows => rows.map(r => [...r.cells].map(c => c.innerText))"
    )
    cases = page.eval_on_selector_all("h2[id]", "heads => heads.map(h => h.id)")
    head, *rows = rows
    assert rows
    assert all(len(row) == len(head) and all(row) for row in rows)
    assert [*dict.fromkeys(row[0] for row in rows)] == cases[:-1]  # the last: made with


def test_it_fits_the_screen(page):
    wide = page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert wide[0] <= wide[1]
    where = os.environ.get("FEGEAR_SCREENSHOTS")
    if where:
        name = f"report-{page.viewport_size['width']}.png"
        page.screenshot(path=str(Path(where) / name))


def test_it_can_be_read_in_the_dark(page):
    for scheme, sign in (("light", 1.0), ("dark", -1.0)):
        page.emulate_media(color_scheme=scheme)
        paper, ink, figure = page.evaluate(CONTRAST)
        assert sign * (paper - ink) > 0.7
        assert sign * (paper - figure) > 0.7


def test_a_table_can_be_copied(page):
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("button.copy >> nth=0")
    page.wait_for_function("document.querySelector('.copy').textContent == 'copied'")
    text = page.evaluate("navigator.clipboard.readText()")
    lines = text.split("\n")
    assert lines[0].startswith("case\tmodel\twithin")
    assert len({line.count("\t") for line in lines}) == 1
