"""Branches of orbits beside printed bifurcations and constructed motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lumped.continuation.bifurcations import DOUBLING, FOLD
from lumped.rattle.assembly import Assembly
from lumped.rattle.branches import GRAZING, OrbitFinder, orbits_at
from lumped.rattle.machine import Machine
from lumped.rattle.orbits import default_speed, find_orbits
from lumped.rattle.periodic_orbits import (
    min_eccentricity,
    simple_rattle,
    two_sided_rattle,
)
from lumped.rattle.permanent_contact import quiet_motion
from lumped.rattle.return_map import distance, follow

SPEEDS = 0.0, 7.0
SCALED = Machine(damping=0.6, eccentricity=0.1, half_backlash=0.6)


def branches(figure, limits, value, count=2, machine=SCALED, doublings=1):
    finder = OrbitFinder(machine, figure, limits, doublings)
    there = replace(machine, **{figure: value})
    for orbit in find_orbits(there, count, SPEEDS):
        finder.from_departure(orbit.itinerary, orbit.departures[0], value)
    return finder.branches


@pytest.fixture(scope="module")
def over_damping():
    return branches("damping", (0.5, 0.75), 0.575)


@pytest.fixture(scope="module")
def over_eccentricity():
    return branches("eccentricity", (0.055, 0.11), 0.072, count=1)


def points(branch_list, name, kind):
    return [
        point.parameter
        for branch in branch_list
        if branch.itinerary.name == name
        for point in branch.bifurcations
        if point.kind == kind
    ]


@pytest.mark.parametrize(
    ("name", "kind", "printed", "digits"),
    [
        ("P(1,2,0)", FOLD, 0.5997, 1e-4),
        ("P(2,2,1)", DOUBLING, 0.5818, 1e-4),
        ("P(4,4,2)", GRAZING, 0.5922, 1e-4),
        ("P(1,1,0)", GRAZING, 0.6905, 2e-4),  # 0.69068
    ],
)
def test_printed_bifurcations_over_damping(over_damping, name, kind, printed, digits):
    """Figures 3.13 and 3.14, section 6.2."""
    (parameter,) = points(over_damping, name, kind)
    assert parameter == pytest.approx(printed, abs=digits)


def test_printed_bifurcations_over_eccentricity(over_eccentricity):
    """Section 6.2: a doubling at 0.076, births at 0.0596 and, seen at, 0.067."""
    (doubles,) = points(over_eccentricity, "P(1,1,1)", DOUBLING)
    assert doubles == pytest.approx(0.076, abs=5e-4)
    (born,) = points(over_eccentricity, "P(1,1,0)", FOLD)
    assert born == pytest.approx(min_eccentricity(SCALED), rel=1e-9)
    (born,) = points(over_eccentricity, "P(1,1,1)", FOLD)
    for value, count in ((born - 1e-7, 0), (born + 1e-7, 2)):
        machine = replace(SCALED, eccentricity=value)
        assert len(two_sided_rattle(machine)) == count


def test_grazing_ends_where_the_closed_form_becomes_virtual(over_damping):
    (grazes,) = points(over_damping, "P(1,1,0)", GRAZING)
    for value, physical in ((grazes - 1e-9, True), (grazes + 1e-9, False)):
        in_phase, _ = simple_rattle(replace(SCALED, damping=value))
        assert in_phase.physical == physical
    # the motion that meets both flanks is the same there
    assert points(over_damping, "P(1,1,1)", GRAZING) == [
        pytest.approx(grazes, rel=1e-9)
    ]


def test_every_orbit_is_a_fixed_point_of_the_return_map(over_damping):
    for branch in over_damping:
        for point in branch.points[1:-1:5]:
            machine = replace(SCALED, damping=point.parameter)
            count = len(point.departures)
            path = follow(machine, point.departures[0], count + 1)
            assert distance(path[0], path[-1]) < 1e-6 * max(1.0, point.largest)
            assert path[:-1, 2].sum() == branch.itinerary.lower


def test_a_doubled_motion_settles_where_it_is_stable(over_damping):
    (branch,) = (b for b in over_damping if b.itinerary.name == "P(4,4,2)")
    (orbit,) = orbits_at(branch, 0.585)
    assert orbit.stable
    machine = replace(SCALED, damping=0.585)
    path = follow(machine, np.add(orbit.departures[0], 1e-4), 401)
    gap = min(distance(path[-1], departure) for departure in orbit.departures)
    assert gap < 1e-9
    assert branch.origin.startswith("period doubling of branch ")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("figure", "limits", "changes"),
    [
        ("half_backlash", (0.58, 0.7), {}),
        ("restitution", (0.9, 1.0), {}),
        ("stiffness", (5e3, 2e4), {"stiffness": 1e4}),
        ("ripple", (0.0, 0.5), {"ripple_order": 2}),
        ("ripple_phase", (0.0, 1.0), {"ripple": 0.3, "ripple_order": 2}),
    ],
)
def test_any_figure_of_the_machine_can_vary(figure, limits, changes):
    machine = replace(SCALED, **changes)
    value = 0.5 * (limits[0] + limits[1])
    branch_list = branches(figure, limits, value, 1, machine)
    simple_branches = [b for b in branch_list if b.itinerary.name == "P(1,1,0)"]
    assert simple_branches
    for branch in simple_branches:
        ends = sorted((branch.points[0].parameter, branch.points[-1].parameter))
        assert ends == pytest.approx(limits, abs=1e-9)
        assert not branch.bifurcations
        for point in branch.points[1:-1:3]:
            there = replace(machine, **{figure: point.parameter})
            path = follow(there, point.departures[0], 2)
            assert distance(path[0], path[-1]) < 1e-6


def test_a_branch_that_comes_back_to_a_limit_turns_once():
    """And not where it leaves the range."""
    machine = replace(SCALED, stiffness=1000.0)
    branch_list = branches("stiffness", (50.0, 2000.0), 515.0, 1, machine)
    for branch in branch_list:
        for point in branch.bifurcations:
            assert 51.0 < point.parameter < 1999.0
    assert points(branch_list, "P(1,1,1)", FOLD) == [pytest.approx(64.781, abs=1e-2)]


def test_where_flanks_stop_parting_is_one_graze():
    """And the critical eccentricity is that of the machine there."""
    machine = replace(SCALED, stiffness=109.0)
    branch_list = branches("stiffness", (10.0, 1000.0), 109.0, 1, machine)
    fading = [
        (point.kind, point.parameter)
        for branch in branch_list
        for point in branch.bifurcations
        if abs(point.departures[0][1]) < 1e-3
    ]
    assert [kind for kind, _ in fading] == [GRAZING, GRAZING]
    assert sorted(value for _, value in fading) == pytest.approx(
        [13.10757, 41.47006], abs=1e-5
    )
    for _, value in fading:
        there = Assembly(machine=replace(machine, stiffness=value))
        critical = quiet_motion(there).critical_eccentricity
        assert critical == pytest.approx(machine.eccentricity, rel=1e-9)
    # folds of motions that rattle stay, next to a graze as well
    assert points(branch_list, "P(1,1,0)", FOLD) == pytest.approx([36.71424, 95.62888])


def test_branches_that_nearly_cross_are_not_mixed_up():
    """A pitchfork of P(1,1,1) that the drag's drift leaves imperfect."""
    pump = Machine(
        damping=3e-4, eccentricity=1e-4, half_backlash=6e-4, stiffness=1100.0
    )
    finder = OrbitFinder(pump, "eccentricity", (0.0, 2e-3), 0)
    there = replace(pump, eccentricity=5.5e-4)
    for orbit in find_orbits(there, 1, (0.0, default_speed(there))):
        if orbit.name == "P(1,1,1)":
            finder.from_departure(orbit.itinerary, orbit.departures[0], 5.5e-4)
    assert len(finder.branches) == 2
    grazes = [
        max(p.parameter for p in branch.bifurcations if p.kind == GRAZING)
        for branch in finder.branches
    ]
    assert sorted(grazes) == pytest.approx([1.537119e-3, 1.537346e-3], rel=1e-6)
    births = [
        min(p.parameter for p in branch.bifurcations if p.kind == FOLD)
        for branch in finder.branches
    ]
    assert sorted(births) == pytest.approx([3.2e-8, 5.30947e-4], rel=1e-3)
