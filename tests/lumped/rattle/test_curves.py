"""Curves of bifurcations over damping and eccentricity beside closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lumped.continuation.bifurcations import DOUBLING, FOLD
from lumped.rattle.arcs import arcs_of, linearise_arcs
from lumped.rattle.branches import GRAZING, OrbitFinder
from lumped.rattle.curves import GRAZING_FOLD, curve_of, is_on
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import find_orbits
from lumped.rattle.periodic_orbits import (
    min_eccentricity,
    simple_rattle,
    two_sided_rattle,
)
from lumped.rattle.return_map import distance, follow

LIMITS = (0.5, 0.8), (0.02, 0.2)


@pytest.fixture(scope="module")
def curves():
    """Bifurcation curves by name and kind, of motions with one departure a period."""
    machine = Machine(damping=0.6, eccentricity=0.08, half_backlash=0.6)
    finder = OrbitFinder(machine, "damping", LIMITS[0], doublings=0)
    for orbit in find_orbits(machine, 1, (0.0, 7.0)):
        finder.from_departure(orbit.itinerary, orbit.departures[0], 0.6)
    curve_table = {}
    for branch in finder.branches:
        for point in branch.bifurcations:
            curve = curve_of(branch, point, "eccentricity", LIMITS)
            assert is_on(curve, branch, point, "eccentricity")
            curve_table[branch.itinerary.name, point.kind] = curve
    return curve_table


def scaled(point):
    return Machine(damping=point.first, eccentricity=point.second, half_backlash=0.6)


def test_the_fold_of_simple_rattle_is_the_closed_form(curves):
    curve = curves["P(1,1,0)", FOLD]
    assert len(curve.points) > 20
    for point in curve.points:
        assert point.second == pytest.approx(min_eccentricity(scaled(point)), rel=1e-8)


def test_folds_end_in_grazes_where_constructed_motions_do(curves):
    """Figure 6.2, where both are one point; their places are not printed."""
    (met,) = (p for p in curves["P(1,1,0)", FOLD].points if p.kind)
    assert met.kind == GRAZING_FOLD
    one, two = simple_rattle(replace(scaled(met), eccentricity=met.second * 1.000001))
    assert abs(one.margin) < 1e-3
    assert abs(two.margin) < 1e-3
    assert (met.first, met.second) == pytest.approx((0.77015, 0.09789), abs=1e-5)
    (met,) = (p for p in curves["P(1,1,1)", FOLD].points if p.kind)
    assert (met.first, met.second) == pytest.approx((0.760165, 0.095706), abs=1e-6)
    above = replace(scaled(met), eccentricity=met.second * (1.0 + 1e-9))
    both = two_sided_rattle(above)
    assert len(both) == 2
    assert max(abs(motion.margin) for motion in both) < 1e-4


def test_curves_end_on_the_limits(curves):
    for curve in curves.values():
        for point in curve.points:
            assert LIMITS[0][0] - 1e-6 <= point.first <= LIMITS[0][1] + 1e-6
            assert LIMITS[1][0] <= point.second <= LIMITS[1][1]
        least = min(point.first for point in curve.points)
        assert least == pytest.approx(0.5, abs=1e-6)


def test_constructed_motions_pass_through_minus_one_on_the_doubling(curves):
    curve = curves["P(1,1,1)", DOUBLING]
    for point in curve.points[5:-5:5]:
        min_multipliers = []
        for factor in (0.999, 1.0, 1.001):
            machine = replace(scaled(point), eccentricity=factor * point.second)
            near = min(
                two_sided_rattle(machine),
                key=lambda motion: distance(
                    (motion.time, motion.velocity), point.departure
                ),
            )
            path = follow(machine, (near.time, near.velocity), 2)
            multipliers = np.linalg.eigvals(
                linearise_arcs(machine, arcs_of(machine, path))
            )
            min_multipliers.append(multipliers.real.min())
        assert min_multipliers[0] > min_multipliers[1] > min_multipliers[2]
        assert min_multipliers[1] == pytest.approx(-1.0, abs=1e-6)


def test_grazing_curves_are_where_motions_become_virtual():
    machine = Machine(damping=0.6, eccentricity=0.1, half_backlash=0.6)
    finder = OrbitFinder(machine, "damping", (0.6, 0.75), doublings=0)
    in_phase, _ = simple_rattle(machine)
    path = follow(machine, (in_phase.time, in_phase.velocity), 2)
    assert path[0, 2] == 0
    (orbit,) = (o for o in find_orbits(machine, 1, (3.0, 4.0)) if o.stable)
    finder.from_departure(orbit.itinerary, orbit.departures[0], 0.6)
    (branch,) = finder.branches
    (point,) = branch.bifurcations
    assert point.kind == GRAZING
    curve = curve_of(branch, point, "eccentricity", ((0.6, 0.75), (0.05, 0.15)))
    assert len(curve.points) > 10
    for curve_point in curve.points:
        margins = [motion.margin for motion in simple_rattle(scaled(curve_point))]
        assert min(map(abs, margins)) < 1e-9
