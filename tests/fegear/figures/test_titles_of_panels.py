"""Titles of panels beside each other fit on the narrowest page of the wide form."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from fegear import load_gear_set
from fegear.commands.show.gear_set_figure import gear_set_figure
from fegear.figures.interactive import to_plotly

LETTER = 7.0  # pixels, more than a letter of these titles takes on average


def assert_titles_fit(figure: Figure) -> None:
    layout = to_plotly(figure).layout
    wide, page = layout.meta["wide"], layout.meta["breakpoint"]
    inner = page - wide["margin.l"] - wide["margin.r"]
    domains = [wide[f"xaxis{end}.domain"] for end in ("", "2")]
    titled = [n for n, axes in enumerate(figure.axes) if axes.get_title()]
    first = 1 if figure.get_suptitle() else 0
    for number, panel in enumerate(titled, first):
        left, right = domains[panel]
        lines = wide[f"annotations[{number}].text"].split("<br>")
        assert LETTER * max(map(len, lines)) <= inner * (right - left)


@pytest.mark.parametrize("name", ["liu-pair", "liu-idler", "liu-countershaft"])
def test_titles_of_a_gear_set(name):
    figure = gear_set_figure(load_gear_set(name))
    assert to_plotly(figure).layout.meta["breakpoint"] <= 800
    assert_titles_fit(figure)


def test_a_long_title_raises_the_panels():
    def figure(title: str) -> Figure:
        drawn = Figure(figsize=(10.0, 4.0), layout="constrained")
        for axes in drawn.subplots(1, 2):
            axes.plot([0.0, 1.0])
            axes.set_title(title)
        return drawn

    short, long = figure("a title"), figure("a title that is long " * 4)
    assert_titles_fit(long)
    margins = [to_plotly(f).layout.meta["wide"]["margin.t"] for f in (short, long)]
    assert margins[1] >= margins[0] + 15.0
