"""Figures of orbits of machines that rattle, small ones beside what is known."""

from __future__ import annotations

import math

import pytest

from lumped.rattle.machine import Machine
from lumped.rattle.periodic_orbits import min_eccentricity
from validation.commands.reproduce.computations.kinds import COMPUTE
from validation.commands.reproduce.source_figures import load_figure, read_figure

HEAD = """
number = "rattle-9.9"
title = "A figure"
caption = "Something."
machine = "roots-scaled"
x = "damping"
y = "eccentricity [rad]"

[[part]]
"""


def results(figure):
    return {
        part.own_name: COMPUTE[type(part)](
            part, figure.scene(part), lambda stage, done, total: None
        )
        for part in figure.part
    }


@pytest.mark.slow
@pytest.mark.parametrize("number", ["rattle-2.12", "rattle-3.13"])
def test_printed_values_are_found(number):
    figure = load_figure(number)
    part_results = results(figure)
    for printed in figure.printed:
        (value,) = part_results[printed.part].values[printed.value_name]
        assert value == pytest.approx(printed.value, abs=1e-4)


@pytest.mark.slow
def test_branches_show_both_departures_and_stability():
    (result,) = results(load_figure("rattle-3.13")).values()
    for style in ("line", "dashed"):
        assert sum(curve.style == style for curve in result.curves) == 2
    assert {curve.label for curve in result.curves} == {"P(1,2,0)"}


def test_curves_of_existence_meet_where_closed_forms_do():
    text = f"""{HEAD}
kind = "existence"
over = {{ figure = "damping", low = 0.6, high = 0.8 }}
against = {{ figure = "eccentricity", low = 0.05, high = 0.15 }}
starts = 2
slices = [0.08]
names = ["P(1,1,0)"]
"""
    (result,) = results(read_figure(text)).values()
    (first,) = result.values["grazing fold of P(1,1,0).first"]
    (second,) = result.values["grazing fold of P(1,1,0).second"]
    machine = Machine(damping=first, eccentricity=second, half_backlash=0.6)
    assert second == pytest.approx(min_eccentricity(machine), rel=1e-6)
    (curve,) = result.curves
    assert curve.label == "fold of P(1,1,0)"
    assert math.isnan(curve.points[-1][0])


def test_settled_motions_have_a_panel_each_and_stay_near_the_play():
    text = f"""{HEAD}
kind = "settled_rattle"
starts = 12
iterations = 2000
turns = 5
edits = ["machine.damping=0.575"]
"""
    (result,) = results(read_figure(text)).values()
    assert result.values["quiet"][0] >= 1.0
    panels = {curve.panel for curve in result.curves}
    assert len(panels) == result.values["kinds"][0]
    for curve in result.curves:
        times, places = zip(*curve.points, strict=True)
        assert max(t for t in times if not math.isnan(t)) == pytest.approx(5, abs=0.1)
        assert max(abs(x) for x in places if not math.isnan(x)) < 0.6 + 1e-9
