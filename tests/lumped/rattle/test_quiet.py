"""Critical eccentricity beside printed values and the motion itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lumped.rattle.departures import settle_departures
from lumped.rattle.kernels.settle import QUIET
from lumped.rattle.machine import Machine
from lumped.rattle.quiet import (
    contact_margin,
    critical_by_search,
    critical_eccentricity,
)

ROOTS = Machine(damping=3e-4, eccentricity=1e-4, half_backlash=6e-4, stiffness=1100.0)


def test_type_a_is_the_checked_value():
    """Printed 9.2e-5, from figures that were rounded."""
    assert critical_eccentricity(ROOTS) == pytest.approx(9.378e-5, rel=1e-4)


def test_flanks_of_any_stiffness_tend_to_the_impact_limit():
    """Eq. 2.37: delta / pi."""
    stiff = replace(ROOTS, stiffness=1e9)
    limit = critical_eccentricity(replace(ROOTS, stiffness=math.inf))
    assert critical_eccentricity(stiff) == pytest.approx(limit, rel=1e-6)
    assert limit == pytest.approx(ROOTS.damping / math.pi, rel=1e-6)


@given(
    damping=st.floats(1e-4, 1.0),
    stiffness=st.one_of(st.floats(50.0, 1e6), st.just(math.inf)),
)
def test_search_is_the_closed_form(damping, stiffness):
    machine = Machine(
        damping=damping, eccentricity=0.1, half_backlash=0.5, stiffness=stiffness
    )
    closed = critical_eccentricity(machine)
    assert critical_by_search(machine) == pytest.approx(closed, rel=1e-5)
    for factor, sign in ((0.99, 1.0), (1.01, -1.0)):
        margin = contact_margin(replace(machine, eccentricity=factor * closed))
        assert margin * sign > 0.0


@pytest.mark.parametrize("stiffness", [2000.0, math.inf])
@pytest.mark.parametrize(("factor", "quiet"), [(0.97, True), (1.03, False)])
def test_motion_that_barely_departs_stays_quiet_below_it_only(stiffness, factor, quiet):
    machine = Machine(
        damping=0.6, eccentricity=0.1, half_backlash=0.6, stiffness=stiffness
    )
    machine = replace(machine, eccentricity=factor * critical_eccentricity(machine))
    slow = [[0.1, 0.05], [0.6, 0.05]]
    settled = settle_departures(machine, np.array(slow), 3000)
    assert ((settled.period == QUIET) == quiet).all()


def test_ripple_of_the_torque_takes_from_the_margin():
    mean = 4.0 * math.pi * ROOTS.damping
    rippled = replace(ROOTS, ripple=0.03 * mean, ripple_phase=math.pi)
    assert critical_by_search(rippled) < critical_by_search(ROOTS)
    hopeless = replace(ROOTS, ripple=2.0 * mean)
    assert critical_by_search(hopeless) == 0.0
