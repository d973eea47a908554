"""What a reader needs from pictures: ranges, colors, marks and legends to be seen."""

from __future__ import annotations

import io
from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D

import fegear
from fegear.commands.stiffness.figure import draw_table
from fegear.gearset import load_gear_set, make_gear_set
from fegear.statics.settings import StaticsSettings
from fegear.statics.solving import solve_mesh
from lumped.attractors.attractor_sweeps import AttractorBranch
from lumped.attractors.attractors import Attractor
from lumped.figures.attractor_plots import draw_attractors
from lumped.figures.drawing import draw_legend, panels
from lumped.figures.sweeps import STATE_COLORS, STATE_NAMES, TOOTH_LINES
from validation.commands.reproduce.drawing import (
    _color,
    _label_without_direction,
    _line_style,
)
from validation.commands.reproduce.parts import Curve
from validation.commands.validate.report.figures import _number_decades

TORQUES = (50.0, 100.0, 200.0)
TEETH = {
    "module_mm": 3.0,
    "face_width_mm": 20.0,
    "hub_radius_mm": 15.0,
    "tooth_thinning_um": 20.0,
}


@pytest.fixture(scope="module")
def drawn():
    settings = StaticsSettings(resolution="coarse", positions=16)
    result = solve_mesh(
        load_gear_set("liu-pair"), torques_on_driver=TORQUES, settings=settings
    )
    figure = draw_table(result)
    figure.savefig(io.BytesIO(), format="png")
    return result, figure


def test_peak_to_peak_of_the_transmission_error_fills_its_panel(drawn):
    result, figure = drawn
    varying = figure.axes[2]
    low, high = varying.get_ylim()
    ranges = 1e6 * np.ptp(result.table["ste_m"], axis=1)
    assert high - low < 1.3 * ranges.max()
    labels = [text.get_text() for text in varying.get_legend().get_texts()]
    assert labels == [
        f"{torque:g} N m,\npeak to peak {width:.3g} um"
        for torque, width in zip(TORQUES, ranges, strict=True)
    ]


def test_peak_to_peak_is_that_of_all_base_pitches_where_some_are_shown():
    """With pitch errors of a gear of 21 teeth, 8 of 21 base pitches are drawn.

    Those around the tooth that differs most.
    """
    errors = [0.0] * 21
    errors[15], errors[2] = 12.0, -9.0  # um, of which the second is not drawn
    gears = make_gear_set(
        {
            "name": "one tooth set back",
            "gear": [
                {**TEETH, "name": "a", "teeth": 21, "pitch_errors_um": errors},
                {**TEETH, "name": "b", "teeth": 42},
            ],
            "mesh": [{"driver": "a", "driven": "b", "center_distance_mm": 94.5}],
        }
    )
    settings = StaticsSettings(resolution="coarse", positions=16, estimate_error=False)
    result = solve_mesh(gears, torques_on_driver=[100.0], settings=settings)
    varying = draw_table(result).axes[2]
    error = 1e6 * result.table["ste_m"][0]
    shown = slice(11 * 16, 19 * 16)
    assert varying.get_xlim() == (11.0, 19.0)
    assert np.ptp(error) > 1.2 * np.ptp(error[shown])
    (label,) = [text.get_text() for text in varying.get_legend().get_texts()]
    width = np.ptp(error)
    assert label == f"100 N m,\npeak to peak {width:.3g} um\nof all 21 pitches"
    drawn_error = error[shown] - error.mean()
    np.testing.assert_allclose(varying.lines[0].get_ydata(), drawn_error)


def test_colors_of_torques_are_told_apart_by_their_lightness(drawn):
    _, figure = drawn
    colors = [to_rgb(line.get_color()) for line in figure.axes[2].lines]
    lightness = np.array(colors) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness) > 0.1).all()


def test_legends_lie_beside_the_panels_and_inside_the_figure(drawn):
    _, figure = drawn
    whole = figure.bbox.extents
    for axes in figure.axes:
        legend = axes.get_legend().get_window_extent()
        assert legend.x0 >= axes.get_window_extent().x1
        assert legend.x1 <= whole[2]
        assert legend.y0 >= whole[1]


@pytest.mark.parametrize("count", [2, 9, 20])
def test_legends_of_figures_are_not_cut(count):
    figure, ((axes,),) = panels(1, size=(7.0, 4.0))
    handles = axes.plot(np.eye(count))
    for number, handle in enumerate(handles):
        handle.set_label(f"a curve with a long name, {number}")
    draw_legend(figure, handles, 4)
    figure.savefig(io.BytesIO(), format="png")
    legend = figure.legends[0].get_window_extent()
    assert figure.bbox.x0 <= legend.x0
    assert legend.x1 <= figure.bbox.x1


@pytest.mark.parametrize(("points", "least"), [(1, 4.0), (60, 2.0)])
def test_dots_of_bifurcations_are_larger_where_they_are_few(points, least):
    section = np.linspace(0.0, 1e-6, points)[:, None]
    one = Attractor(0, section, np.zeros_like(section), 0.1, 0.01)
    values = tuple(np.linspace(1000.0, 2000.0, 100).tolist())
    branch = AttractorBranch("up", values, (one,) * 100, True)
    figure = draw_attractors([branch], "speed [Hz]")
    assert figure.axes[0].lines[0].get_markersize() >= least


@pytest.mark.parametrize("limits", [(1e-4, 3e-2), (2e-3, 8e-3), (1.0, 40.0)])
def test_numbers_of_the_cost_plot_do_not_collide(limits):
    figure, ((axes,),) = panels(1, size=(8.0, 3.2))
    axes.set_xscale("log")
    axes.set_xlim(*limits)
    _number_decades(axes.xaxis)
    figure.savefig(io.BytesIO(), format="png")
    boxes = [
        label.get_window_extent()
        for label in axes.get_xticklabels()
        if label.get_text() and axes.bbox.x0 <= label.get_window_extent().x1
    ]
    assert len(boxes) >= 2
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


def test_color_is_the_torque_and_the_mark_the_method():
    labels = [
        f"{method}, {torque} N m"
        for torque in (50, 100, 150)
        for method in ("finite elements", "model 1")
    ]
    curves = [Curve("dots", ((0.0, 0.0),), label=f"{label}, up") for label in labels]
    assert [_label_without_direction(curve) for curve in curves] == labels
    colors = [to_rgb(_color(curve, labels)) for curve in curves]
    assert len(set(colors)) == 3
    assert colors[::2] == colors[1::2]
    looks = [repr(_line_style(curve, labels)) for curve in curves]
    assert len(set(looks)) == 2
    assert looks[:2] * 3 == looks


SWEEP = {
    "model": fegear.LumpedModel(
        number=1,
        excitation=fegear.ExcitationSettings(kind="rectangular"),
    ),
    "gear_set": "liu-pair",
}


def legend_of(figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_legend_of_a_sweep_has_what_the_figure_has():
    """Far from resonances there is neither a jump nor lost contact nor a mode."""
    calm = fegear.run(fegear.Sweep(**SWEEP, speeds=(300.0, 320.0, 340.0)))
    labels = legend_of(calm.figures["plot"]())
    assert not any("jump" in label or "lost" in label for label in labels)
    assert not any("natural" in label for label in labels)
    assert "speed down (dot inside: both)" in labels
    jumping = fegear.run(fegear.Sweep(**SWEEP, speeds=tuple(range(1700, 3300, 50))))
    labels = legend_of(jumping.figures["plot"]())
    assert {"jump", "contact lost in part"} <= {*labels}
    assert any("natural" in label for label in labels)


def test_speeds_up_and_down_that_coincide_are_both_seen():
    """A dot is in a square that is open, so that neither covers the other."""
    calm = fegear.run(fegear.Sweep(**SWEEP, speeds=(300.0, 320.0, 340.0)))
    up, down = calm.figures["plot"]().axes[0].lines[:2]
    assert down.get_markerfacecolor() == "none"
    assert down.get_markersize() > 1.5 * up.get_markersize()


def test_colours_of_a_motion_have_one_meaning():
    motion = fegear.run(fegear.Motion(**SWEEP, speed=2000.0))
    figure = motion.figures["plot"]()
    assert not {color for color, _ in TOOTH_LINES} & {*STATE_COLORS.values()}
    force = figure.axes[1].get_legend()
    assert [text.get_text() for text in force.get_texts()] == [
        "tooth pairs in turn",
        "mesh",
    ]
    colors = {line.get_color() for line in force.findobj(Line2D)}
    assert {color for color, _ in TOOTH_LINES} <= colors
    states = {int(s) for p in motion.motion.pairs for s in p.state[p.in_mesh]}
    assert legend_of(figure) == [STATE_NAMES[s] for s in STATE_NAMES if s in states]
