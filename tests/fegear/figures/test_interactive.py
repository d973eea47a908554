"""Figures of plotly have what the figures of matplotlib have."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from interactive_checks import check_figure
from interactive_figures import FIGURES, X, lines
from matplotlib.figure import Figure

from fegear.cli import run
from fegear.figures.interactive import interactive_page, set_plotly_source, to_plotly
from fegear.figures.saving import save_figure
from fegear.files import output
from fegear.files.errors import InputError
from fegear.studies.notebook import figure_html


@pytest.mark.parametrize("draw", FIGURES)
def test_every_artist_is_converted(draw):
    figure = draw()
    check_figure(figure, to_plotly(figure))


@pytest.mark.parametrize("draw", FIGURES)
def test_equal_figures_give_equal_pages(draw):
    page = interactive_page(draw(), "plotly.min.js")
    assert page == interactive_page(draw(), "plotly.min.js")
    assert page.count("<script") == 2
    assert "http" not in page.replace("http://www.w3.org", "")


def test_scales_limits_and_text():
    shown = to_plotly(lines())
    layout = shown.layout
    assert (layout.xaxis.type, layout.yaxis.type) == ("log", "linear")
    assert layout.yaxis2.type == "log"
    assert layout.yaxis2.range[0] > layout.yaxis2.range[1]
    assert layout.xaxis2.matches == "x"
    assert layout.annotations[0].text == "lines &lt;b&gt; &amp; %&#123;x}"
    assert layout.legend.title.text == "dotted: &lt;mean&gt; &amp; &#36;x&#36;"
    (steps,) = (t for t in shown.data if t.name == "steps" and t.x[0] is not None)
    assert steps.line.shape == "hv"
    assert "time [s]: %{x}" in steps.hovertemplate
    assert {shape.yref for shape in layout.shapes} == {"y", "y domain", "y2 domain"}


def test_what_is_unknown_is_refused():
    axes = Figure().subplots()
    axes.quiver([0.5], [0.5], [1.0], [1.0])
    with pytest.raises(TypeError, match=r"^no interactive form of Quiver$"):
        to_plotly(axes.figure)
    axes = Figure().subplots()
    axes.plot([0.0], [0.0], marker="$a$")
    with pytest.raises(TypeError, match="no interactive form of the marker"):
        to_plotly(axes.figure)
    axes = Figure().subplots()
    axes.set_yscale("symlog")
    with pytest.raises(TypeError, match="no interactive form of a symlog axis"):
        to_plotly(axes.figure)


NUMBERS = st.floats(-1e6, 1e6, allow_nan=False) | st.just(float("nan"))
LINES = st.tuples(
    arrays(float, 4, elements=NUMBERS),
    st.sampled_from(["-", "--", ":", "-.", "o", "x-", "s--", "."]),
    st.sampled_from(["", "a", "b<i>", "$c$ 100 %"]),
)


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.lists(LINES, max_size=3), min_size=1, max_size=3),
    st.booleans(),
    st.booleans(),
)
def test_random_lines_are_converted(drawn, share, log):
    figure = Figure(layout="constrained")
    grid = figure.subplots(len(drawn), squeeze=False, sharex=share)
    for (axes,), content in zip(grid, drawn, strict=True):
        axes.set_yscale("log" if log else "linear")
        for values, style, label in content:
            axes.plot(range(4), values, style, label=label or None)
        if any(label for *_, label in content):
            axes.legend()
    check_figure(figure, to_plotly(figure))


def test_a_page_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "gears.html"
    assert run(["show", "liu-idler", "--plot", str(path)]) == 0
    page = path.read_text("utf-8")
    assert page.startswith("<!doctype html>")
    assert page.endswith("</html>\n")
    before = path.read_bytes()

    def fail(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fegear.figures.interactive.interactive_page", fail)
    assert run(["show", "liu-idler", "--plot", str(path)]) == 2
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["gears.html"]


def test_without_plotly_a_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(output, "has_plotly", lambda: False)
    path = tmp_path / "gears.html"
    assert run(["show", "liu-idler", "--plot", str(path)]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.endswith("needs plotly: pip install 'fegear[interactive]'")
    assert not path.exists()


def test_plotly_is_imported_only_for_an_interactive_figure():
    script = "import sys, fegear.figures.interactive; sys.exit('plotly' in sys.modules)"
    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_notebook_has_plotly_once_or_from_a_url():
    try:
        set_plotly_source(None)
        first, second = (figure_html(lines(), 50) for _ in range(2))
        assert len(first) > len(second) + 1_000_000
        set_plotly_source("_static/plotly.min.js")
        third = figure_html(lines(), 50)
    finally:
        set_plotly_source(None)
    assert 'script.src = "_static/plotly.min.js"' in third
    for part in (first, second, third):
        assert '<img alt="figure" src="data:image/png;base64,' in part


def test_a_figure_that_was_drawn_before_has_the_same_layout(tmp_path):
    """Its numbers of logarithmic axes are still powers, not the text of them."""
    figure = lines()
    before = to_plotly(figure).layout.margin.l
    save_figure(figure, tmp_path / "x.png")
    assert to_plotly(figure).layout.margin.l == pytest.approx(before, abs=5.0)


def test_devices_take_png_as_before(tmp_path):
    path = tmp_path / "x.png"
    save_figure(lines(), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match=r"name must end in"):
        output.require_picture(tmp_path / "x.htm")


def test_data_are_those_of_the_figure_to_the_bit():
    figure = Figure()
    figure.subplots().plot(X / 3.0, X / 7.0)
    (trace,) = to_plotly(figure).data
    assert np.array_equal(trace.x, X / 3.0)
    assert np.array_equal(trace.y, X / 7.0)
