"""Intervals of instability: the same in every window and on every grid."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from friction_pairs import COUPLED, pair_system
from matplotlib.collections import PolyCollection

from fegear.gearset import load_gear_set
from fegear.statics.excitation_settings import ExcitationSettings
from fegear.train.lumped_models import lumped_system
from fegear.train.model_settings import LumpedModel
from lumped.figures.drawing import COLORS
from lumped.figures.stability import draw_chart
from lumped.stability.combinations import combinations
from lumped.stability.intervals import scan_stability
from lumped.stability.multipliers import largest_multiplier, multipliers
from lumped.stability.periodic_system import periodic_system
from lumped.train.friction import ToothFriction

LOW, HIGH = 1.7, 12.4  # Hz


@pytest.fixture(scope="module", params=[0.0, 0.1, 0.16])
def pair(request):
    """With a friction coefficient; from 0.13 on wide intervals touch."""
    rub = ToothFriction(request.param) if request.param else None
    return periodic_system(pair_system(0.3, 0.001, rub))


@pytest.fixture(scope="module")
def reference(pair):
    return scan_stability(pair, [LOW, HIGH]).intervals


@pytest.mark.parametrize("steps", [400, 80, 20, 7])
def test_intervals_do_not_depend_on_the_grid(pair, reference, steps):
    intervals = scan_stability(pair, np.linspace(LOW, HIGH, steps)).intervals
    assert [interval.kind for interval in intervals] == [
        interval.kind for interval in reference
    ]
    np.testing.assert_allclose(
        [(interval.low, interval.high) for interval in intervals],
        [(interval.low, interval.high) for interval in reference],
        rtol=1e-7,
    )


@pytest.mark.slow
def test_no_interval_holds_or_leaves_out_a_speed(pair, reference):
    """Beside multipliers at speeds that are much closer."""
    speeds = np.arange(LOW, HIGH, 5e-4)
    grows = largest_multiplier(pair, speeds) > 1.0 + 1e-9
    inside = np.zeros(speeds.size, bool)
    for interval in reference:
        inside |= (interval.low <= speeds) & (speeds <= interval.high)
    assert grows.any()
    assert (inside == grows).all()


@pytest.mark.parametrize("window", [(5.71, 11.3), (4.77, 11.3), (11.1, 11.3)])
def test_names_do_not_depend_on_the_window(pair, reference, window):
    """Whose ends lie inside of intervals."""
    intervals = scan_stability(pair, window).intervals
    expected = [
        interval
        for interval in reference
        if interval.low < window[1] and interval.high > window[0]
    ]
    assert [interval.kind for interval in intervals] == [
        interval.kind for interval in expected
    ]
    assert intervals[-1].kind == "2 f3"


def test_modes_meet_what_intervals_are_named_after(pair, reference):
    """Within 0.4 of a mesh frequency."""
    f1, f2, f3 = COUPLED
    for interval in reference:
        formula = interval.kind.replace("2 f", "2 * f")
        met = eval(formula, {"f1": f1, "f2": f2, "f3": f3})
        order = int(formula.split("/")[1]) if "/" in formula else 1
        assert abs(met - interval.worst) * order < 0.4 * interval.worst


def test_where_intervals_touch_others_begin_to_grow():
    """At friction 0.16 the growth of f3 - f1 and f1 + f3, with multipliers that are
    complex, ends where that of (2 f3) / 2, real, begins."""
    pair = periodic_system(pair_system(0.3, 0.001, ToothFriction(0.16)))
    intervals = scan_stability(pair, [5.0, 6.0]).intervals
    assert [interval.kind for interval in intervals] == [
        "f3 - f1",
        "(2 f3) / 2",
        "f1 + f3",
    ]
    for one, two in pairwise(intervals):
        assert one.high == two.low
        values = multipliers(pair, one.high + 1e-6 * np.array([-1.0, 1.0]))
        worst = [row[np.abs(row).argmax()] for row in values]
        assert sorted(abs(value.imag) > 0.0 for value in worst) == [False, True]


def test_combinations_have_colors_of_their_own(pair):
    columns = [scan_stability(pair, [1.0, HIGH]) for _ in range(2)]
    kinds = {interval.kind for interval in columns[0].intervals}
    axes = draw_chart((0.0, 1.0), columns, (1.0, HIGH), "friction", "pair").axes[0]
    colors = [
        tuple(collection.get_facecolor()[0])
        for collection in axes.collections
        if isinstance(collection, PolyCollection)
    ]
    named = [color for color in colors if len(set(color[:3])) > 1]
    assert len(named) == len(set(named)) == min(len(kinds), len(COLORS))
    assert len(colors) == len(kinds)


@pytest.mark.parametrize("window", [(0.37, 0.46), (0.2, 0.21)])
def test_what_grows_at_low_speeds_has_a_name(window):
    pair = periodic_system(pair_system(0.5, 1e-4))
    intervals = scan_stability(pair, window).intervals
    assert intervals
    assert all(interval.kind.startswith("(") for interval in intervals)


def test_names_tell_the_mesh_whose_harmonic_is_met():
    model = LumpedModel(number=1, excitation=ExcitationSettings(kind="rectangular"))
    gears = load_gear_set("liu-countershaft")
    system = periodic_system(lumped_system(gears, 100.0, model))
    resonances = combinations(system, (500.0, 3000.0))
    assert "(2 f1) / 2 of mesh 2" in {resonance.name for resonance in resonances}
    for resonance in resonances:
        rate = float(system.rates[resonance.mesh])
        assert resonance.order == pytest.approx(resonance.harmonic * rate, rel=1e-12)
        assert ("of mesh 2" in resonance.name) == (resonance.mesh == 1)
        assert "." not in resonance.name
