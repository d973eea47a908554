"""Interactive figures in headless Chromium, on a phone's and on a desk's width."""

from __future__ import annotations

import pytest
from interactive_figures import FIGURES, lines

from fegear.figures.interactive import interactive_page

WIDTHS = {390: "narrow", 1280: "wide"}
DRAWN = """() => {
  const frame = document.querySelector(".js-plotly-plot");
  const inside = (part) => {
    const box = part.getBoundingClientRect();
    return box.left >= -1 && box.right <= innerWidth + 1;
  };
  const names = ".xtitle, .ytitle, [class^=legend][class$=text]";
  const texts = [...frame.querySelectorAll(names)];
  return {
    layout: frame.dataset.layout,
    wide: document.documentElement.scrollWidth - innerWidth,
    traces: frame.querySelectorAll(".trace.scatter").length,
    outside: texts.filter((text) => !inside(text)).map((text) => text.textContent),
    size: frame.getBoundingClientRect().toJSON(),
  };
}"""
SHAPES = "() => document.querySelectorAll('.shapelayer path').length"


@pytest.fixture(params=WIDTHS)
def page(request, browser):
    """An empty page, with what it complained of and what it asked for."""
    context = browser.new_context(viewport={"width": request.param, "height": 900})
    page = context.new_page()
    page.complaints, page.asked = [], []
    page.on("console", lambda message: page.complaints.append(message.text))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    yield page
    context.close()


def open_figure(page, path, figure) -> None:
    path.write_text(interactive_page(figure), "utf-8")
    page.goto(path.as_uri())
    page.wait_for_selector(".main-svg")
    page.wait_for_timeout(300)


@pytest.mark.parametrize("draw", FIGURES)
def test_a_figure_is_drawn_and_fits_the_screen(page, tmp_path, draw):
    path = tmp_path / "figure.html"
    open_figure(page, path, draw())
    drawn = page.evaluate(DRAWN)
    width = page.viewport_size["width"]
    assert page.complaints == []
    assert page.asked == [path.as_uri()]
    assert drawn["layout"] == WIDTHS[width]
    assert drawn["wide"] <= 0
    assert drawn["traces"] > 0
    assert drawn["outside"] == []
    assert drawn["size"]["width"] == width
    assert drawn["size"]["height"] > 300


def test_an_entry_hides_the_line_across_a_panel(page, tmp_path):
    open_figure(page, tmp_path / "figure.html", lines())
    before = page.evaluate(SHAPES)
    page.locator(".legend2text", has_text="across").locator("..").locator(
        ".legend2toggle"
    ).click()
    page.wait_for_function(f"({SHAPES})() === {before - 1}")
    assert page.complaints == []


def test_the_layout_follows_the_width(page, tmp_path):
    open_figure(page, tmp_path / "figure.html", lines())
    for width, layout in reversed(WIDTHS.items()):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_selector(f".js-plotly-plot[data-layout={layout}]")
    assert page.complaints == []
