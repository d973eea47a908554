"""Maps of impacts beside the events of the same wheel."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from loose_wheels import SINE, freedom, spur

from lumped.clatter.gearbox import Harmonics
from lumped.clatter.groups import WheelGroup
from lumped.clatter.impact_runs import centred_state, simulate
from lumped.clatter.maps import follow_map, map_exponent

# R = m = Theta = 1, equal dampings and a radial play that is never used up
UNIT = spur(
    *(0.7, -0.4, 0.5),
    inertia=1.0,
    mass=1.0,
    base_radius=1.0,
    ratio=1.0,
    radial=freedom(1.0, 0.5, -0.1, 0.5),
)


@pytest.mark.parametrize("wheel", [UNIT, spur(), spur(0.7, -0.02, 0.0)])
def test_the_implicit_map_is_the_event_system(wheel):
    group = WheelGroup((wheel,), SINE)
    state = centred_state(group)
    # chaos drives them apart in many impacts: the map starts from each event anew
    compared, last, start = 0, None, None
    for part in simulate(group, state, 2.0, max_impacts=0):
        if start is not None and len(part) == 1 and part.speed[0] > 1e-5:
            mapped = follow_map(group, "implicit", start, int(last.edge[0]), 1)
            for name in ("time", "edge", "speed", "impulse"):
                wanted, mapped_value = getattr(part, name), getattr(mapped, name)
                np.testing.assert_allclose(mapped_value, wanted, rtol=1e-10, atol=1e-13)
            compared += 1
        resting = len(part) != 1 or state.held.any()
        start, last = (None if resting else state.copy()), part
    assert compared > 20


def test_the_fermi_map_is_where_the_implicit_one_leads():
    """A large play, a small fast way of the excitation, no drag and no damping."""
    wheel = spur(0.99, 0.0, 0.0, ratio=1.0)
    wheel = replace(wheel, rotation=replace(wheel.rotation, play=1e-2))
    errors = []
    for size in (1e-5, 1e-6):
        group = WheelGroup((wheel,), Harmonics(1.0, (size,), (0.2,)))
        state = centred_state(group)
        state.q[0] = (group.excitation.at(np.zeros(1))[0]) / wheel.base_radius
        state.v[0] = 0.5 / wheel.base_radius  # from the upper edge to the lower one
        few = 5
        implicit, fermi = (
            follow_map(group, name, state.copy(), 1, few)
            for name in ("implicit", "fermi")
        )
        errors.append(np.abs(implicit.time / fermi.time - 1.0).max())
    assert errors[0] < 1e-2
    assert errors[1] < 0.2 * errors[0]


def test_the_exponent_of_the_fermi_map_is_that_of_its_derivative():
    """Tangents of t' = t + d / |J|, J' = -eps J + (1 + eps) e'(t') in plain Python."""
    group = WheelGroup((spur(0.9, 0.0, 0.0, ratio=1.0),), SINE)
    state = centred_state(group)
    first = next(iter(simulate(group, state, 1.0, max_impacts=0)))
    exponent = map_exponent(group, "fermi", state, int(first.edge[0]), 4000)
    turn, size, phase, count = 2.0 * math.pi / 0.04, 0.15e-3, 0.3, 40_000
    t, j = state.time * 0.04, 0.04 * state.v[0] / 0.04
    tangent, total = np.array([1.0, 0.0]), 0.0
    for _ in range(count):
        flight = 1e-4 / abs(j)
        t += flight
        rate = size * turn * math.cos(turn * t + phase)
        bend = -size * turn**2 * math.sin(turn * t + phase)
        dt = tangent[0] - flight / j * tangent[1]
        tangent = np.array([dt, -0.9 * tangent[1] + 1.9 * bend * dt])
        j = -0.9 * j + 1.9 * rate
        grown = math.hypot(tangent[0], 1e-3 * tangent[1])
        total, tangent = total + math.log(grown), tangent / grown
    assert exponent == pytest.approx(total / count, rel=0.05)  # of two samples
    assert exponent > 1.0


def test_a_map_ends_where_the_wheel_rests():
    group = WheelGroup((spur(0.3, -0.5),), SINE)
    state = centred_state(group)
    first = next(iter(simulate(group, state, 1.0, max_impacts=0)))
    impacts = follow_map(group, "implicit", state, int(first.edge[0]), 10_000)
    assert 3 < len(impacts) < 1000
    assert impacts.speed.min() * SINE.period > group.box.resting_speed
